"""From a branch that loses its stability onto the stable one that begins there, without leaving equilibrium.

Load control finds no stable state behind a bifurcation, and minimising the energy from the old branch creeps through
narrow curved valleys: thin sheets bend easily and stretch hardly. Here the bifurcation is bracketed on the old branch,
which Newton's method follows beyond it, and the amplitude of the buckling mode takes the place of lambda as what is
prescribed (Wagner and Wriggers 1988; Seydel 2010): on the hyperplane at some distance along the mode lies the new
branch and nothing of the old one.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.solvers.hyperplane import correct
from bh.solvers.matrices import IndefiniteError
from bh.solvers.modes import count_negative, lowest_mode
from bh.solvers.newton import Newton
from bh.solvers.outcome import Critical, Outcome
from bh.solvers.points import CriticalPoint, Increment, Point, extrapolate, interpolate, point
from bh.solvers.saddle import MultiplierMatrix
from bh.solvers.system import System

Array = NDArray[np.float64]
WIDTH = 0.05  # of the bracket, in parts of its distance from the last state
LEAST_WIDTH = 1e-3  # and in parts of what was looked through
AMPLITUDES = (0.4, 0.1)  # of the first state on the new branch, in parts of the largest unknown
GROWTH = 2.0  # of the amplitude from one state to the next
STATES, FAR = 6, 0.05  # most states on the new branch, and how far lambda rises there, in parts of itself
NEWTON_STEPS = 12


class Branch(NamedTuple):
    """States on the stable branch, in the order of lambda, and where it begins.

    There are none where no branch was found, and no critical point where the old one has none.
    """

    points: tuple[Point, ...]
    imbalances: tuple[float, ...]
    critical: tuple[CriticalPoint, ...]
    iterations: int

    def increments(self, cuts: tuple[str, ...], spent: int) -> list[Increment]:
        """The states as accepted increments; the first has what was `spent` on finding them.

        Args:
            cuts: what was cut before, in words.
            spent: iterations.

        Returns:
            one for each state, in the order of lambda.
        """
        found = []
        for k, there in enumerate(self.points):
            before = self.points[k - 1].lam if k else self.critical[0].lam
            note = f"the stable branch that begins at lambda {self.critical[0].lam:.6g}" if k == 0 else ""
            found.append(
                Increment(
                    there,
                    Outcome.REACHED,
                    0 if k else spent,
                    self.imbalances[k],
                    there.lam - before,
                    () if k else cuts,
                    note,
                    critical=() if k else self.critical,
                )
            )
        return found


NO_BRANCH = Branch((), (), (), 0)


class State(NamedTuple):
    """An equilibrium and what is left of its imbalance."""

    point: Point
    imbalance: float


class _Bracket(NamedTuple):
    """The last stable and the first unstable state of a branch, close to each other."""

    below: Point
    above: Point


def onto_stable_branch(system: System, here: Point, lam: float, newton: Newton) -> Branch:
    """The first states of the stable branch that leaves the present one between a stable state and `lam`.

    Args:
        system: what is solved.
        here: a stable state.
        lam: up to where a bifurcation is looked for.
        newton: its tolerance is taken.

    Returns:
        a few stable states with rising lambda. None of them where the present branch cannot be followed to
        `lam`, is stable there, or the new branch runs backwards or is unstable.
    """
    bracket, spent = _bracket(system, here, lam, newton)
    if bracket is None:
        return NO_BRANCH._replace(iterations=spent)
    above = bracket.above
    p = system.primal
    try:
        _, mode = lowest_mode(system.tangent(above.q, above.lam, above.forces).matrix, len(above.q), p)
    except IndefiniteError:
        return NO_BRANCH._replace(iterations=spent)
    mode /= float(np.abs(mode[:p]).max())
    unit = mode / float(np.linalg.norm(mode[:p]))
    begins = _critical_point(system, bracket, unit)
    states, used = _along(system, bracket, mode, newton.tolerance)
    points, imbalances = zip(*states, strict=True) if states else ((), ())
    return Branch(points, imbalances, (begins,), spent + used)


def _bracket(system: System, here: Point, lam: float, newton: Newton) -> tuple[_Bracket | None, int]:
    """The loss of stability on the branch of `here`, by bisection in lambda."""
    primary = replace(newton, unstable=True, globalised=0, transient=None)
    forces = here.forces
    found = primary.solve_full(system, here.q, lam, forces)
    spent = found.iterations
    if not found.converged or not found.negative:
        return None, spent
    below, above = here, point(system, found.q, lam, evaluation=found.evaluation, negative=found.negative)
    least = LEAST_WIDTH * (lam - here.lam)
    while above.lam - below.lam > max(WIDTH * (above.lam - here.lam), least):
        middle = 0.5 * (below.lam + above.lam)
        q, forces = extrapolate([below, above], middle)
        found = primary.solve_full(system, q, middle, forces)
        spent += found.iterations
        if not found.converged or system.objection(here.q, here.lam, found.q, middle):
            return None, spent
        there = point(system, found.q, middle, evaluation=found.evaluation, negative=found.negative)
        below, above = (below, there) if found.negative else (there, above)
    return _Bracket(below, above), spent


def _critical_point(system: System, bracket: _Bracket, mode: Array) -> CriticalPoint:
    """Where the curvature along the mode is zero, on a straight line between the ends of the bracket."""
    curvatures = []
    for end in bracket:
        matrix = system.tangent(end.q, end.lam, end.forces).matrix
        primal = matrix.augmented if isinstance(matrix, MultiplierMatrix) else matrix
        along = mode[: system.primal]
        curvatures.append(float(along @ (primal @ along)))
    low, high = curvatures
    part = min(max(low / (low - high), 0.0), 1.0) if low > high else 0.5
    below, above = bracket
    lam = below.lam + part * (above.lam - below.lam)
    q = below.q + part * (above.q - below.q)
    negative = (0, above.negative or 1)
    return CriticalPoint(Critical.BIFURCATION, lam, q, mode, negative, 0.5 * (above.lam - below.lam))


def _along(system: System, bracket: _Bracket, mode: Array, tolerance: float) -> tuple[list[State], int]:
    """Stable states of the branch that leaves along a mode, in the sense in which lambda rises."""
    above = bracket.above
    tangent = system.tangent(above.q, above.lam, above.forces)
    size = float(np.abs(above.q[: system.primal]).max())
    spent = 0
    for part in AMPLITUDES:
        for sense in (1.0, -1.0):
            push = sense * part * size * mode
            forces = tangent.predicted_forces(above.forces, push)
            first, used = _corrected(system, above.q + push, above.lam, forces, mode, tolerance)
            spent += used
            if first is None:  # the other sense is most often its mirror image
                break
            if first.point.lam > bracket.below.lam and first.point.negative == 0:
                states, used = _onward(system, above, first, part * size, mode, tolerance)
                return states, spent + used
    return [], spent


def _onward(
    system: System, origin: Point, first: State, amplitude: float, mode: Array, tolerance: float
) -> tuple[list[State], int]:
    """More states along the branch by rising amplitude, as long as they are stable and lambda rises."""
    points, amplitudes, states, spent = [origin, first.point], [0.0, amplitude], [first], 0
    while len(states) < STATES and points[-1].lam < (1.0 + FAR) * origin.lam:
        target = GROWTH * amplitudes[-1]
        q, lam, forces = interpolate(points[-3:], amplitudes[-3:], target)
        there, used = _corrected(system, q, lam, forces, mode, tolerance)
        spent += used
        if there is None or there.point.negative != 0 or not points[-1].lam < there.point.lam < 1.0:
            break
        states.append(there)
        points.append(there.point)
        amplitudes.append(target)
    return states, spent


def _corrected(
    system: System, q: Array, lam: float, forces: Array, mode: Array, tolerance: float
) -> tuple[State | None, int]:
    """The equilibrium at the guess's own amplitude, or None; and the iterations."""
    found = correct(system, q, lam, forces, mode[: system.primal], tolerance, NEWTON_STEPS)
    if found.reason:
        return None, found.iterations
    negative = count_negative(system.tangent(found.q, found.lam, found.evaluation.forces).matrix)
    there = point(system, found.q, found.lam, evaluation=found.evaluation, negative=negative)
    return State(there, found.evaluation.imbalance), found.iterations
