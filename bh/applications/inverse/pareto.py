"""Distance from a point against length of the crease: what the source leaves open (6.4.3), as a front of trades."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize

from bh.applications.inverse.models import Name
from bh.applications.inverse.problems import Design, ReachPoint
from bh.applications.inverse.reach import Library, library
from bh.applications.inverse.segments import DesignError

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Trade:
    """A design that no other one beats in both.

    Attributes:
        design: crease and pinches.
        missed: distance from the point by the surrogate, mm.
        total: length of the crease, mm.
    """

    design: Design
    missed: float
    total: float


def pareto(
    target: ArrayLike,
    allowances: Sequence[float] = (0.1, 1.0, 3.0, 10.0, 30.0),
    most: int = 3,
    starts: int = 6,
    books: Sequence[Library] = (),
    name: Name = "converged",
) -> list[Trade]:
    """The shortest creases found that end within some distances of a point, the nearest first; dominated ones left out.

    Args:
        target: (3,) point, mm.
        allowances: distances, mm, rising.
        most: segments.
        starts: library designs that each search begins with, for each number of segments.
        books: libraries to take; where there is none of a number of segments, those of the model `name`.
        name: of the model.

    Returns:
        the creases, with their lengths and distances, mm.

    Raises:
        DesignError: the target is no point, or nothing ends within the largest allowance.
    """
    point = np.asarray(target, dtype=float)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise DesignError(f"the target {target!r} is no point; give three coordinates in mm")
    found: list[Trade] = []
    for n in range(1, most + 1):
        book = next((b for b in books if b.n == n), None) or library(n, name=name)
        problem = book.problem(point)
        near = list(zip(*book.nearest(point, 20 * starts), strict=True))
        near.sort(key=lambda pair: float(pair[0][n:].sum()))
        for x, on in near[:starts]:
            for allowed in allowances:
                trade = _shortened(problem, x, on, allowed)
                if trade is not None:
                    found.append(trade)
    found.sort(key=lambda trade: (round(trade.missed, 3), trade.total))  # a micrometre is no trade
    front: list[Trade] = []
    for trade in found:
        if not front or trade.total < front[-1].total - 1e-3:
            front.append(trade)
    if not front:
        raise DesignError(
            f"no crease of up to {most} segments ends within {max(allowances):g} mm of the target; allow more"
        )
    return front


def _shortened(problem: ReachPoint, x: Array, on: Bools, allowed: float) -> Trade | None:
    """The shortest design next to a start that ends within a distance of the target, or None."""
    n, width = problem.n, problem.upper - problem.lower
    step = 1e-7

    def gap(z: Array) -> tuple[Array, Array]:
        """(allowed^2 - distance^2) / 100 mm^2 and its gradient."""
        inward = np.where(z > 0.5, -step, step)
        trial = problem.lower + width * np.vstack((z, z + np.diag(inward)))
        ends = problem.end(trial, np.tile(on, (len(trial), 1))) - problem.target
        value = (allowed**2 - (ends**2).sum(axis=1)) / 100.0
        return value[:1], (value[1:] - value[0]) / inward

    length = np.concatenate((np.zeros(n), width[n:])) / 100.0
    start = np.clip((x - problem.lower) / width, 0.0, 1.0)
    done = minimize(
        lambda z: (float(length @ z), length),
        start,
        jac=True,
        method="SLSQP",
        bounds=[(0.0, 1.0)] * (2 * n),
        options={"maxiter": 80, "ftol": 1e-8},
        constraints={"type": "ineq", "fun": lambda z: gap(z)[0], "jac": lambda z: gap(z)[1]},
    )
    best = (problem.lower + width * np.clip(done.x, 0.0, 1.0))[None]
    missed, broken = problem.evaluate(best, on[None])
    if broken[0] > 0.0 or missed[0] > allowed * 1.001 + 1e-6:
        return None
    design = problem.design(best[0], on)
    return Trade(design, float(missed[0]), design.total)
