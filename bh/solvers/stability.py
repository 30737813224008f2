"""Is an equilibrium stable, and if not, where does it go; where on a path does stability change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bh.solvers.hyperplane import correct
from bh.solvers.modes import count_negative, lowest_mode, nearest_mode
from bh.solvers.newton import Newton, Solution
from bh.solvers.outcome import Critical
from bh.solvers.points import CriticalPoint, Point, point
from bh.solvers.system import System

Array = NDArray[np.float64]


def leave_saddle(system: System, saddle: Solution, lam: float, newton: Newton) -> tuple[Solution, str]:
    """From an unstable equilibrium downhill along its lowest mode to a stable one at the same lambda.

    Both senses of the mode are tried where they are not mirror images, and the state of lower energy is taken.
    Returns the stable state and a note; if none of lower energy is found, the saddle itself and an empty note.

    Args:
        system: whose equilibrium is sought.
        saddle: unstable equilibrium.
        lam: load parameter of the step, 0 to 1.
        newton: settings of the way down.

    Returns:
        the stable state and a note; the saddle itself and an empty note if none of lower energy is found.
    """
    tangent = system.tangent(saddle.q, lam, saddle.evaluation.forces)
    _, mode = lowest_mode(tangent.matrix, len(saddle.q), system.primal)
    mode /= max(float(np.abs(mode).max()), 1e-300)
    size = float(np.ptp(saddle.q[: system.primal])) or 1.0
    spent = 0
    for amplitude in (1e-2, 5e-2, 2e-1):
        starts = [saddle.q + sense * amplitude * size * mode for sense in (1.0, -1.0)]
        merits = [system.evaluate(start, lam).merit for start in starts]
        base = saddle.evaluation.merit
        same = abs(merits[0] - merits[1]) <= 1e-6 * abs(merits[0] - base)
        best: Solution | None = None
        for start in starts[:1] if same else starts:
            found = newton.solve_globalised(system, start, lam)
            spent += found.iterations
            lower = found.evaluation.energy < saddle.evaluation.energy
            better = best is None or found.evaluation.energy < best.evaluation.energy
            if found.converged and found.stable and lower and better:
                best = found
        if best is not None:
            note = f"left an unstable state at lambda {lam:.6g} along its lowest mode"
            return replace(best, iterations=spent), note
    return replace(saddle, iterations=0, reason="unstable and no stable state found nearby"), ""


def locate(
    system: System,
    a: Point,
    b: Point,
    negative: tuple[int, int],
    tolerance: float = 1e-8,
    width: float = 1e-5,
) -> tuple[CriticalPoint, ...]:
    """Critical points between two states of one branch with different numbers of negative modes, by bisection.

    States between are found on hyperplanes normal to the chord, so that limit points are no obstacle. `width` is the
    last interval in parts of the chord. Points that cannot be bracketed (another branch comes in between) are left
    out: a point that is returned has been seen from both sides.

    Args:
        system: whose equilibrium is sought.
        a: one end of the path's piece.
        b: the other end.
        negative: numbers of negative modes at both.
        tolerance: relative imbalance of the states between.
        width: last interval, in parts of the chord.

    Returns:
        the points in order along the path.
    """
    found: list[CriticalPoint] = []
    low, high, before = (a, 0.0), (b, 1.0), negative[0]
    while before != negative[1] and len(found) < 4:
        pair = _bisect(system, a, b, (low, high), (before, negative[1]), tolerance, width)
        if pair is None:
            break
        left, right, behind = pair
        found.append(_critical_point(system, a, b, left[0], right[0], (before, behind)))
        low, before = right, behind
    return tuple(found)


Place = tuple[Point, float]  # a state and where it is on the chord, from 0 to 1


def _bisect(
    system: System,
    a: Point,
    b: Point,
    places: tuple[Place, Place],
    negative: tuple[int, int],
    tolerance: float,
    width: float,
) -> tuple[Place, Place, int] | None:
    """The last interval in which the count leaves the first of `negative`, which it has at the first of `places`.

    Returns:
        its ends and the count behind it; None if the path is lost.
    """
    (low, high), (before, behind) = places, negative
    normal = (b.q - a.q)[: system.primal]
    while high[1] - low[1] > width:
        p, q = low[0], high[0]
        forces = 0.5 * (p.forces + q.forces)
        state = correct(system, 0.5 * (p.q + q.q), 0.5 * (p.lam + q.lam), forces, normal, tolerance)
        if state.reason:
            return None
        middle = point(system, state.q, state.lam, a.mode, state.evaluation), 0.5 * (low[1] + high[1])
        count = count_negative(system.tangent(state.q, state.lam, state.evaluation.forces).matrix)
        if count == before:
            low = middle
        else:
            high, behind = middle, count
    return low, high, behind


def _critical_point(
    system: System, a: Point, b: Point, left: Point, right: Point, negative: tuple[int, int]
) -> CriticalPoint:
    p = system.primal
    lam, q = 0.5 * (left.lam + right.lam), 0.5 * (left.q + right.q)
    forces = 0.5 * (left.forces + right.forces)
    mode = nearest_mode(system.tangent(q, lam, forces).matrix, system.size, p)
    # at a limit point the path itself runs along the mode, and the mode does work on the change of the load
    chord = (b.q - a.q)[:p]
    along = abs(float(mode[:p] @ chord)) > 0.1 * float(np.linalg.norm(chord))
    work = mode * system.control_rate(q, lam)
    loaded = abs(float(work.sum())) > 1e-3 * float(np.abs(work).sum())
    kind = Critical.LIMIT if along and loaded else Critical.BIFURCATION
    return CriticalPoint(kind, lam, q, mode, negative, 0.5 * abs(right.lam - left.lam))
