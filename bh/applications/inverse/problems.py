"""The source's three problems (Eq. 6.20 to 6.22): fit a plane curve, move the tip furthest, reach a point."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.applications.inverse.forward import Forward
from bh.applications.inverse.segments import DesignError
from bh.applications.inverse.self_intersection import Projected, SelfIntersectionRule, allowed
from meshes.curves import arc_lengths, interpolated

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Design:
    """A crease pattern with its actuation: curvature before folding (1/mm), length (mm) and pinch of every segment.

    Attributes:
        k0: (n,) curvatures before folding, 1/mm.
        length: (n,), mm.
        pinched: (n,).
    """

    k0: Array
    length: Array
    pinched: Bools

    @property
    def n(self) -> int:
        """Number of segments."""
        return len(self.k0)

    @property
    def total(self) -> float:
        """Length of the whole crease, mm."""
        return float(self.length.sum())

    def mirrored(self) -> Design:
        """With all curvatures reversed: its end is the mirror image in y (6.4.3)."""
        return Design(-self.k0, self.length, self.pinched)

    def lists(self) -> tuple[list[float], list[float], list[bool]]:
        """Curvatures, lengths and pinches as plain lists: the arguments of `simulate`.

        Returns:
            (n,) each: 1/mm, mm, and truth values.
        """
        return self.k0.tolist(), self.length.tolist(), self.pinched.tolist()

    def rows(self) -> list[dict[str, float | bool]]:
        """A plain description, one entry a segment.

        Returns:
            the entries in order along the crease.
        """
        each = zip(self.k0, self.length, self.pinched, strict=True)
        return [{"k0": float(k), "length": float(s), "pinched": bool(f)} for k, s, f in each]


# --- Problem A ----------------------------------------------------------------------------------------------


def resample(curve: ArrayLike, count: int) -> Array:
    """(count, 2) points at equal distances along a curve given by points (k, 2), both ends included.

    Args:
        curve: (k, 2), mm.
        count: of the points.

    Raises:
        DesignError: fewer than two different points.
    """
    points = np.asarray(curve, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2 or not np.isfinite(points).all():
        raise DesignError("a target curve needs at least two points (x, y) in mm")
    s = arc_lengths(points)
    if s[-1] <= 0.0:
        raise DesignError("the target curve has no length; give different points")
    return interpolated(np.linspace(0.0, s[-1], count), s, points)


def _sampled(curve: Callable[[Array], tuple[Array, Array]], last: float) -> Array:
    """(k, 2) fine points of a parametric curve; finer at the start, where the spiral is tight."""
    return np.column_stack(curve(last * np.linspace(0.0, 1.0, 20001) ** 1.5))


CURVES: dict[str, Array] = {
    "parabola": _sampled(lambda t: (t, 2.0 * t**1.5 / 30.0), 211.6),  # Eq. 6.17
    "spiral": _sampled(lambda t: (-np.exp(t) * np.cos(t) + 1.0, np.exp(t) * np.sin(t)), 5.362),  # Eq. 6.18
    "cosine": _sampled(lambda t: (t, 20.0 * np.cos(t / 45.63) - 20.0), 286.7),  # Eq. 6.19
}


@dataclass(frozen=True, eq=False)
class FitCurve:
    """Problem A (Eq. 6.20): n segments without pinches along a plane curve that begins at the origin.

    Variables are the folded sector angles k_i l_i (rad, within 2 pi) and the lengths (mm). The value is the mean
    distance between `samples` equally spaced points of crease and curve, over the length of the curve.

    Attributes:
        target: (k, 2) points of the curve, mm.
        heading: polar angle of the crease at its start, rad; 0 in the source (R_0 = I).
    """

    target: Array
    n: int
    samples: int = 101
    fold: float = 0.5 * math.pi
    heading: float = 0.0
    switches: int = 0

    @cached_property
    def goal(self) -> Array:
        """(samples, 2) points of the target at equal distances, mm."""
        return resample(self.target, self.samples)

    @cached_property
    def size(self) -> float:
        """Length of the target, mm."""
        return float(np.linalg.norm(np.diff(np.asarray(self.target), axis=0), axis=1).sum())

    @property
    def lower(self) -> Array:
        """(2 n,) least values of the variables."""
        return np.concatenate((np.full(self.n, -2.0 * math.pi), np.zeros(self.n)))

    @property
    def upper(self) -> Array:
        """(2 n,) largest values of the variables."""
        return np.concatenate((np.full(self.n, 2.0 * math.pi), np.full(self.n, 1.2 * self.size)))

    def evaluate(self, x: Array, on: Bools) -> tuple[Array, Array]:
        """(N,) mean distances over the length of the curve, and violations, which are zero."""
        del on  # nothing is switched here
        distance = np.linalg.norm(self.points(x) - self.goal, axis=-1).mean(axis=-1) / self.size
        return distance, np.zeros(len(x))

    def points(self, x: Array) -> Array:
        """(N, samples, 2) points of folded creases: plane arcs, chords and turns of which add up."""
        theta, length = x[:, : self.n], np.maximum(x[:, self.n :], 1e-9)
        zero = np.zeros((len(x), 1))
        turned = self.heading + np.concatenate((zero, np.cumsum(theta, axis=1)), axis=1)
        knots = np.concatenate((zero, np.cumsum(length, axis=1)), axis=1)
        chords = length * np.sinc(0.5 * theta / np.pi) * np.exp(1j * (turned[:, :-1] + 0.5 * theta))
        ends = np.concatenate((zero, np.cumsum(chords, axis=1)), axis=1)
        at = np.linspace(0.0, 1.0, self.samples) * knots[:, -1:]
        which = np.minimum((at[:, :, None] >= knots[:, None, 1:]).sum(axis=-1), self.n - 1)
        row = np.arange(len(x))[:, None]
        along = at - knots[row, which]
        half = 0.5 * (theta / length)[row, which] * along
        found = ends[row, which] + along * np.sinc(half / np.pi) * np.exp(1j * (turned[row, which] + half))
        return np.stack((found.real, found.imag), axis=-1)

    def design(self, x: Array) -> Design:
        """The design of variables (2 n,)."""
        theta, length = x[: self.n], np.maximum(x[self.n :], 1e-9)
        return Design(theta / length * math.sin(0.5 * self.fold), length, np.zeros(self.n, dtype=bool))


# --- Problems B and C ---------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Segments:
    """Variables of n segments in the data set's domain: s_i = k0_i over the largest of that length, then the lengths.

    So constraints (1) to (3) of Eq. 6.21 and 6.22 are the box, and only self-intersection (4) is left.
    """

    surrogate: Forward
    n: int
    rules: Sequence[SelfIntersectionRule] = field(default_factory=lambda: (Projected(),))

    @property
    def lower(self) -> Array:
        return np.concatenate((np.full(self.n, -1.0), np.full(self.n, self.surrogate.domain.length[0])))

    @property
    def upper(self) -> Array:
        return np.concatenate((np.ones(self.n), np.full(self.n, self.surrogate.domain.length[1])))

    @property
    def switches(self) -> int:
        return self.n

    def split(self, x: Array) -> tuple[Array, Array]:
        """(k0, length) of variables (..., 2 n)."""
        s, length = x[..., : self.n], x[..., self.n :]
        return s * self.surrogate.domain.largest_curvature(length), length

    def variables(self, design: Design) -> Array:
        """(2 n,) variables of a design."""
        s = design.k0 / self.surrogate.domain.largest_curvature(design.length)
        return np.concatenate((s, design.length))

    def design(self, x: Array, on: Bools) -> Design:
        k0, length = self.split(np.asarray(x))
        return Design(k0, length, np.asarray(on, dtype=bool))

    def violation(self, x: Array, on: Bools) -> Array:
        return allowed(self.rules, self.surrogate, *self.split(x), on)


@dataclass(frozen=True, eq=False)
class MoveTip(_Segments):
    """Problem B (Eq. 6.21): distance between the ends of the folded and of the pinched crease, negative, mm."""

    def evaluate(self, x: Array, on: Bools) -> tuple[Array, Array]:
        """(N,) distances between both ends, negative, mm, and (N,) violations of the rules."""
        k0, length = self.split(x)
        pinched = self.surrogate.forward(k0, length, on, check=False)[0][..., -1, :]
        before = self.surrogate.unpinched(k0, length)[0][..., -1, :]
        return -np.linalg.norm(pinched - before, axis=-1), self.violation(x, on)


@dataclass(frozen=True, eq=False)
class ReachPoint(_Segments):
    """Problem C (Eq. 6.22): the distance of the crease's end from a point, mm."""

    target: Array = field(default_factory=lambda: np.zeros(3))

    def end(self, x: Array, on: Bools) -> Array:
        """(..., 3) ends of designs, mm.

        Args:
            x: (..., 2 n) variables.
            on: (..., n) pinches.

        Returns:
            the ends, mm.
        """
        return self.surrogate.forward(*self.split(x), on, check=False)[0][..., -1, :]

    def evaluate(self, x: Array, on: Bools) -> tuple[Array, Array]:
        """(N,) distances from the point, mm, and (N,) violations of the rules."""
        return np.linalg.norm(self.end(x, on) - self.target, axis=-1), self.violation(x, on)

    def residuals(self, x: Array, on: Bools) -> Array:
        """(N, 3) from the target to the ends, mm.

        Args:
            x: (N, 2 n) variables.
            on: (N, n) pinches.
        """
        found: Array = self.end(x, on) - self.target
        return found
