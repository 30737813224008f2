"""Functions of one or two curvatures from levels of meshes: Chebyshev sums of what each level adds, extrapolated.

Arguments are curvatures over the largest, in [-1, 1]; values are vectors of motions (..., 6). A level is interpolated
as the level before plus a polynomial through the differences, which are smoother than the values: so it may have fewer
points. Errors of the formulation go with the square of the width of the cells once the layers along the crease and the
edges are resolved, so the limit is f + (f - f') / 3 of the last two levels. Its error bar is all of what is added
there, the distance to the limit that the levels before the last would have given, and what the polynomials may miss
between their points: a pinch turns nearly as k0 |k0| about a straight crease, which they follow slowly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from bh.applications.inverse.series_kernel import summed

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Series:
    """A Chebyshev sum: coefficients (d + 1, 6) of one argument, or (d + 1, d + 1, 6) of two."""

    coefficients: Array

    @classmethod
    def through(cls, values: Array) -> Series:
        """Through values (d + 1, 6) or (d + 1, d + 1, 6) at Chebyshev points, increasing."""
        c = values
        for axis in range(values.ndim - 1):
            c = np.moveaxis(_matrix(values.shape[axis]) @ np.moveaxis(c, axis, -2), -2, axis)
        return cls(np.asarray(c))

    def __call__(self, *x: Array) -> Array:
        """(..., 6) values at one or two arguments (...) in [-1, 1]."""
        return summed(self.coefficients, *x)

    def __add__(self, other: Series) -> Series:
        """The sum of both, of any degrees."""
        size = max(self.coefficients.shape[0], other.coefficients.shape[0])
        return Series(self._padded(size) + other._padded(size))

    def times(self, factor: float) -> Series:
        """The same times a number."""
        return Series(factor * self.coefficients)

    def _padded(self, size: int) -> Array:
        c = self.coefficients
        return np.pad(c, [(0, size - n) for n in c.shape[:-1]] + [(0, 0)])


def points(count: int) -> Array:
    """(count,) Chebyshev points in [-1, 1], increasing; with an odd count symmetric to the last bit."""
    d = count - 1
    found: Array = np.sin(0.5 * np.pi * np.arange(-d, d + 1, 2) / d)
    return found


def lagrange(at: Array, x: float) -> Array:
    """(k,) weights of values at different places (k,) in the polynomial through them at x.

    Args:
        at: (k,) places.
        x: where the polynomial is wanted.
    """
    others = at[:, None] - at + np.eye(len(at))
    found: Array = ((x - at) * ~np.eye(len(at), dtype=bool) + np.eye(len(at))).prod(axis=1) / others.prod(
        axis=1
    )
    return found


def _matrix(count: int) -> Array:
    """From values at Chebyshev points to coefficients."""
    return np.asarray(np.linalg.inv(chebyshev.chebvander(points(count), count - 1)), dtype=np.float64)


class Function(Protocol):
    """Vectors of motions as a function of one or two curvatures, such as a `Series`."""

    def __call__(self, *x: Array) -> Array:
        """(..., 6) values at one or two arguments (...) in [-1, 1]."""
        ...


@dataclass(frozen=True, eq=False)
class Sampled:
    """A function that is a little different for every sample: a sum of others, each times a number of the sample.

    Attributes:
        base: the function that all have in common.
        others: what is added.
        amounts: (S,) how many times each of them is.
    """

    base: Function
    others: tuple[Function, ...]
    amounts: tuple[Array, ...]

    def __call__(self, *x: Array) -> Array:
        """(S, ..., 6) values at one or two arguments (S, ...) in [-1, 1]."""
        found = self.base(*x)
        for other, amount in zip(self.others, self.amounts, strict=True):
            found = found + amount.reshape(-1, *[1] * (found.ndim - 1)) * other(*x)
        return found


@dataclass(frozen=True, eq=False)
class Limit:
    """A function known on levels of meshes.

    Attributes:
        levels: the function on each of them, coarse first, three or more.
        value: the limit.
        doubts: what error bars are made of: the step from the last level to the limit, and that from the limit
            of the levels before.
        between: (6,) what the sums may miss between the points of their levels, not negative; the same everywhere.
    """

    levels: tuple[Series, ...]
    value: Series
    doubts: tuple[Series, ...]
    between: Array

    @classmethod
    def of(cls, values: list[Array]) -> Limit:
        """From values at the Chebyshev points of every level, coarse first; see `Series.through`."""
        levels: list[Series] = []
        between = np.zeros(6)
        for i, each in enumerate(values):
            at = points(each.shape[0])
            grid = np.meshgrid(*([at] * (each.ndim - 1)), indexing="ij")
            before = levels[-1] if levels else Series(np.zeros((1,) * (each.ndim - 1) + (6,)))
            added: Array = each - before(*grid)
            levels.append(before + Series.through(added))
            between += missed_between(added) * (4.0 / 3.0 if i == len(values) - 1 else 1.0)
        last, other = (
            fine + (fine + coarse.times(-1.0)).times(1.0 / 3.0)
            for coarse, fine in ((levels[-2], levels[-1]), (levels[-3], levels[-2]))
        )
        return cls(tuple(levels), last, (last + levels[-1].times(-1.0), last + other.times(-1.0)), between)

    def bar(self, *x: Array) -> Array:
        """(..., 6) error bars at one or two arguments (...) in [-1, 1], not negative."""
        return np.asarray(sum(np.abs(doubt(*x)) for doubt in self.doubts) + self.between)


def missed_between(values: Array) -> Array:
    """(6,) what a polynomial through values may miss between their points, not negative.

    A third of the largest miss of the polynomial through every second point at the others: what bends as x |x| is
    missed by a quarter when the points are doubled, what is smooth by far less.

    Args:
        values: (d + 1, 6) or (d + 1, d + 1, 6) at Chebyshev points, d even.
    """
    axes = values.ndim - 1
    grid = np.meshgrid(*([points(values.shape[0])] * axes), indexing="ij")
    half = Series.through(values[(slice(None, None, 2),) * axes])
    return np.asarray(np.abs(values - half(*grid)).max(axis=tuple(range(axes))) / 3.0)
