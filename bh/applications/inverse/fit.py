"""Problems A and B for a growing number of segments: each begins, among others, with the best of one segment less."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.applications.inverse.forward import Forward
from bh.applications.inverse.models import model
from bh.applications.inverse.optimisers import Found, Genetic, Optimiser, Polished, polish
from bh.applications.inverse.problems import FitCurve, MoveTip
from bh.applications.inverse.segments import DesignError
from bh.applications.inverse.self_intersection import Projected, SelfIntersectionRule
from bh.applications.inverse.simulate import Landing
from bh.errors import InputError

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]


def fit_curve(
    curve: ArrayLike,
    most: int,
    optimiser: Optimiser | None = None,
    seed: int = 1,
    problem: FitCurve | None = None,
) -> list[tuple[FitCurve, Found]]:
    """Problem A for 1 to `most` segments: creases without pinches along a plane curve (k, 2) from the origin, mm.

    Cutting a segment in two changes nothing, so the error cannot grow with their number.

    Args:
        curve: (k, 2) points, mm, the first one at the origin.
        most: segments.
        optimiser: how the best design is searched; None for a polished genetic algorithm.
        seed: the same seed gives the same designs.
        problem: other settings than the default ones (samples, heading).

    Returns:
        For 1 to `most` segments the problem and the best design.

    Raises:
        DesignError: no curve, or no segments.
    """
    if most < 1:
        raise DesignError(f"{most} segments cannot be; give 1 or more")
    optimiser = optimiser or Polished(Genetic(100, 60))
    base = problem or FitCurve(np.asarray(curve, dtype=float), 1)
    found: list[tuple[FitCurve, Found]] = []
    for n in range(1, most + 1):
        task = replace(base, n=n)
        none: Bools = np.zeros(0, dtype=bool)
        top = optimiser.minimise(task, seed + n)
        starts = [top.x, *(_cut(found[-1][1].x) if found else ())]
        for start in starts:
            smooth = polish(_Squares(task), start, none)
            for other in (polish(task, smooth.x, none), polish(task, start, none)):
                top = other if other.better(top) else top
        found.append((task, top))
    return found


def folded_fit(fits: Sequence[tuple[FitCurve, Found]], surrogate: Forward) -> tuple[FitCurve, Found, Landing]:
    """The fit of most segments that can be cut and folded: beside tight arcs panels overlap.

    Args:
        fits: of `fit_curve`.
        surrogate: that simulates whole strips.

    Returns:
        the problem, its best design, and where the strip lands.

    Raises:
        DesignError: none of them can.
    """
    why: InputError | None = None
    for problem, top in reversed(fits):
        try:
            return problem, top, surrogate.land(*problem.design(top.x).lists())
        except InputError as error:
            why = error
    raise DesignError(f"no fit of the curve can be cut and folded: {why}")


class _Squares:
    """The same fit by the mean of squares: smooth where the mean of distances has kinks, so a better way down."""

    def __init__(self, problem: FitCurve) -> None:
        self.problem, self.lower, self.upper, self.switches = problem, problem.lower, problem.upper, 0

    def residuals(self, x: Array, on: Bools) -> Array:
        """(N, 2 samples), over the length of the curve."""
        del on  # nothing is switched here
        apart = self.problem.points(x) - self.problem.goal
        return np.asarray(apart.reshape(len(x), -1) / self.problem.size)

    def evaluate(self, x: Array, on: Bools) -> tuple[Array, Array]:
        return (self.residuals(x, on) ** 2).sum(axis=1), np.zeros(len(x))


def _cut(x: Array) -> Iterator[Array]:
    """Variables of `FitCurve` with one of the segments cut in two, at its middle or near an end."""
    theta, length = np.split(x, 2)
    for i in range(len(theta)):
        for part in (0.5, 0.1, 0.9):
            parts = [
                np.concatenate((v[:i], [part * v[i], (1.0 - part) * v[i]], v[i + 1 :]))
                for v in (theta, length)
            ]
            yield np.concatenate(parts)


def move_tip(
    most: int,
    optimiser: Optimiser | None = None,
    seed: int = 1,
    rules: Sequence[SelfIntersectionRule] | None = None,
    surrogate: Forward | None = None,
) -> list[tuple[MoveTip, Found]]:
    """Problem B for 1 to `most` segments: creases whose end a pinch moves as far as it can.

    Args:
        most: segments.
        optimiser: how the best design is searched; None for a polished genetic algorithm.
        seed: the same seed gives the same designs.
        rules: what is forbidden; None for the source's rule.
        surrogate: of the segments; None for the model that converges.

    Returns:
        For 1 to `most` segments the problem and the best design.

    Raises:
        DesignError: less than one segment.
    """
    if most < 1:
        raise DesignError(f"{most} segments cannot be; give 1 or more")
    optimiser = optimiser or Polished(Genetic(150, 80))
    found: list[tuple[MoveTip, Found]] = []
    for n in range(1, most + 1):
        task = MoveTip(surrogate or model(), n, tuple(rules) if rules is not None else (Projected(),))
        top = optimiser.minimise(task, seed + n)
        for x, on in _longer(found[-1][1]) if found else []:
            other = polish(task, x, on)
            top = other if other.better(top) else top
        found.append((task, top))
    return found


def _longer(found: Found) -> Iterator[tuple[Array, Bools]]:
    """The best of one segment less with another long, slightly curved one at either end, pinched or not."""
    s, length = np.split(found.x, 2)
    for extra in (-0.3, 0.05, 0.3):
        for pinched in (True, False):
            for first in (True, False):
                at = 0 if first else len(s)
                x = np.concatenate((np.insert(s, at, extra), np.insert(length, at, 290.0)))
                yield x, np.insert(found.on, at, pinched)


def arc_length(points: ArrayLike) -> float:
    """Length of a polygon (k, 2), mm."""
    return float(np.linalg.norm(np.diff(np.asarray(points, dtype=float), axis=0), axis=1).sum())


def curvature(curve: ArrayLike) -> tuple[Array, Array]:
    """(arc length, curvature), mm and 1/mm, of a fine polygon (k, 2): turns at vertices over mean edge lengths.

    Args:
        curve: (k, 2) vertices, mm.
    """
    points = np.asarray(curve, dtype=float)
    steps = np.diff(points, axis=0)
    size = np.linalg.norm(steps, axis=1)
    heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]), period=2.0 * math.pi)
    return np.cumsum(size)[:-1], np.diff(heading) / (0.5 * (size[1:] + size[:-1]))
