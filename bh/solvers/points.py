"""Points of a path and the increments between them, which driver and strategies hand to each other; extrapolation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from bh.solvers.factor import Factor, IndefiniteError
from bh.solvers.outcome import Critical, Outcome
from bh.solvers.system import Evaluation, System, Tangent

Array = NDArray[np.float64]


class Mode(StrEnum):
    """How a path goes on from a state; the values are what path files hold."""

    LOAD = "load control"
    ARC = "arc length"
    DISPLACEMENT = "displacement control"


LOAD, ARC, DISPLACEMENT = Mode.LOAD, Mode.ARC, Mode.DISPLACEMENT
NOT_STABLE = "the state at the value that ends the step is not stable"  # how a note on an increment says it


@dataclass(frozen=True)
class Point:
    """A converged state on the way of one step: lambda, unknowns, element forces and the rate of work there.

    `mode` is how to go on from here (LOAD, ARC or DISPLACEMENT), also for a resumed run; `negative` counts the
    negative modes of the state, None where that is not known.
    """

    lam: float
    q: Array
    forces: Array
    energy: float
    power: float
    mode: Mode = LOAD
    negative: int | None = None


@dataclass(frozen=True, eq=False)
class CriticalPoint:
    """Where an eigenvalue of the tangent goes through zero, found by bisection along the path.

    Attributes:
        kind: "limit" where lambda turns back, else "bifurcation".
        mode: (n,) null vector of the tangent; its displacements have unit length.
        negative: number of negative modes before and behind.
        error: half the width in lambda of the last interval.
    """

    kind: Critical
    lam: float
    q: Array
    mode: Array
    negative: tuple[int, int]
    error: float


@dataclass(frozen=True, eq=False)
class Factorised:
    """What the negative modes of a state were counted from, for who asks more of it.

    Attributes:
        tangent: at the state.
        factor: of its matrix, but for a shift at the level of rounding; None where that is not positive definite.
    """

    tangent: Tangent
    factor: Factor | None


@dataclass(frozen=True)
class Increment:
    """What one increment of lambda came to.

    `outcome` is "reached" for an accepted state; else it names why the step could not go on and `point` is the last
    accepted state. `cuts` tells why the increment was cut before it was accepted. `jumped` is True where the state
    lies on another branch than the one before, so that nothing can be extrapolated through it; `critical` holds what
    was passed on the way. `factorised` is what stability was seen from at the end of a step, where it is at hand.
    """

    point: Point
    outcome: Outcome
    iterations: int
    imbalance: float
    next_increment: float
    cuts: tuple[str, ...] = ()
    note: str = ""
    jumped: bool = False
    critical: tuple[CriticalPoint, ...] = ()
    factorised: Factorised | None = field(default=None, compare=False)

    @property
    def reached(self) -> bool:
        """Is this an accepted state?"""
        return self.outcome is Outcome.REACHED

    @property
    def negative(self) -> int | None:
        """Number of negative modes of the state; None where that was not looked at."""
        return self.point.negative

    @property
    def stable(self) -> bool | None:
        """True if no mode is negative, None where that was not looked at."""
        return None if self.negative is None else self.negative == 0


def point(
    system: System,
    q: Array,
    lam: float,
    mode: Mode = LOAD,
    evaluation: Evaluation | None = None,
    negative: int | None = None,
) -> Point:
    """The point of a path at given unknowns; `evaluation` is the system's there, if it is known already.

    Args:
        system: whose equilibrium is sought.
        q: (n,) unknowns.
        lam: load parameter of the step, 0 to 1.
        mode: how the path came there.
        evaluation: the system's at (q, lam), if it is known already.
        negative: number of negative modes; None if it is not known.
    """
    evaluation = evaluation or system.evaluate(q, lam)
    return Point(lam, q, evaluation.forces, evaluation.energy, system.power(q, lam), mode, negative)


def power_rate(system: System, here: Point) -> float:
    """Rate d power / d lambda along the path's own tangent, N mm; nan where the state is critical.

    Args:
        system: whose equilibrium is sought.
        here: of the path.
    """
    try:
        factor, _ = system.tangent(here.q, here.lam, here.forces).matrix.factorise_any()
    except IndefiniteError:
        return np.nan
    rate = system.control_rate(here.q, here.lam)
    return system.control_stiffness(here.q, here.lam) - float(rate @ factor.solve(rate))


def interpolate(points: Sequence[Point], at: Sequence[float], target: float) -> tuple[Array, float, Array]:
    """The state at `target` by the polynomial through states at other values of a parameter.

    Args:
        points: states, up to three.
        at: the parameter of each, such as lambda or an amplitude.
        target: its value asked for.

    Returns:
        (n,) unknowns, lambda and (f,) element forces, N or N mm.
    """
    q, lam, forces = np.zeros_like(points[-1].q), 0.0, np.zeros_like(points[-1].forces)
    for i, item in enumerate(points):
        weight = 1.0
        for j, other in enumerate(at):
            if j != i:
                weight *= (target - other) / (at[i] - other)
        q += weight * item.q
        lam += weight * item.lam
        forces += weight * item.forces
    return q, lam, forces


def extrapolate(points: Sequence[Point], lam: float) -> tuple[Array, Array]:
    """Unknowns and element forces at `lam` by the polynomial through up to three points (constant, line, parabola).

    Args:
        points: last ones of the path, in order; one to three.
        lam: where to.

    Returns:
        (n,) unknowns and (f,) element forces, N or N mm.
    """
    q, _, forces = interpolate(points, [item.lam for item in points], lam)
    return q, forces


def ways(points: Sequence[Point], there: Point, pieces: int) -> list[tuple[Array, float]]:
    """Places from the last of some points to another one, on the polynomial through three points or two.

    Args:
        points: last ones of the path, in order.
        there: where it leads to.
        pieces: straight ways between the places.

    Returns:
        unknowns (n,) and lambda of each place, the two points included.
    """
    here = points[-1]
    through = [*points[-2:], there]
    lams = np.linspace(here.lam, there.lam, pieces + 1)[1:-1].tolist()
    return [(here.q, here.lam), *((extrapolate(through, lam)[0], lam) for lam in lams), (there.q, there.lam)]


def lambda_after(lam: float, step: float) -> float:
    """Where an increment of size `step` leads to; it leaves no crumb for the end of the step at 1.

    Args:
        lam: of the last state, below 1.
        step: increment of lambda that is wanted.
    """
    left = 1.0 - lam
    return 1.0 if step > 0.999 * left else lam + (0.5 * left if step > 0.7 * left else step)


def fold_ahead(points: Sequence[Point], primal: int) -> float:
    """Estimated lambda of the limit point that the path runs into, from its last three points; inf if none is seen.

    Close to a limit point lambda* - lambda goes with the square of the distance in q, so (d lambda / d q)^2, which is
    a current stiffness parameter (Bergan et al. 1978), falls to zero as a straight line.

    Args:
        points: last ones of the path, in order.
        primal: number of unknowns that are no multipliers.
    """
    if len(points) < 3:
        return np.inf
    a, b, c = points[-3:]
    speeds = [
        np.linalg.norm((y.q - x.q)[:primal]) / (y.lam - x.lam) if y.lam > x.lam else 0.0
        for x, y in ((a, b), (b, c))
    ]
    # only where the stiffness has fallen clearly: every curved path has some change
    if min(speeds) <= 0.0 or speeds[1] < 1.5 * speeds[0]:
        return np.inf
    before, now = (1.0 / v**2 for v in speeds)
    middle = 0.5 * (b.lam + c.lam)
    return float(middle + 0.5 * (c.lam - a.lam) * now / (before - now))
