"""What the driver and its strategies hand to each other: points of a path, increments, and extrapolation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.solvers.system import Evaluation, System

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Point:
    """A converged state on the way of one step: lambda, unknowns, element forces and the rate of work there.

    `mode` is "arc length" where the state was found so, which a resumed run has to go on with.
    """

    lam: float
    q: Array
    forces: Array
    energy: float
    power: float
    mode: str = ""


@dataclass(frozen=True)
class Increment:
    """What one increment of lambda came to.

    `outcome` is "reached" for an accepted state; else it names why the step could not go on and `point` is the last
    accepted state. `cuts` tells why the increment was cut before it was accepted; `negative` counts the negative
    eigenvalues of the tangent (0: stable), None where that is not known.
    """

    point: Point
    outcome: str
    iterations: int
    imbalance: float
    stable: bool | None
    next_increment: float
    cuts: tuple[str, ...] = ()
    note: str = ""
    negative: int | None = None


def point(
    system: System, q: Array, lam: float, mode: str = "", evaluation: Evaluation | None = None
) -> Point:
    """The point of a path at given unknowns; `evaluation` is the system's there, if it is known already."""
    evaluation = evaluation or system.evaluate(q, lam)
    return Point(lam, q, evaluation.forces, evaluation.energy, system.power(q, lam), mode)


def extrapolate(points: Sequence[Point], lam: float) -> tuple[Array, Array]:
    """Unknowns and element forces at `lam` by the polynomial through up to three points (constant, line, parabola)."""
    q, forces = np.zeros_like(points[-1].q), np.zeros_like(points[-1].forces)
    for i, item in enumerate(points):
        weight = 1.0
        for j, other in enumerate(points):
            if j != i:
                weight *= (lam - other.lam) / (item.lam - other.lam)
        q += weight * item.q
        forces += weight * item.forces
    return q, forces
