"""The state between two states of a path at which a quantity has a wanted value."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from bh.solvers.hyperplane import correct
from bh.solvers.modes import count_negative
from bh.solvers.points import Point, point
from bh.solvers.system import System

MOST = 60


def locate_zero(
    system: System,
    a: Point,
    b: Point,
    values: tuple[float, float],
    goal: Callable[[Point], float],
    tolerance: float,
    accuracy: float = 1e-8,
) -> tuple[Point, float, int] | None:
    """The point where `goal` is zero to `tolerance` between two states of one branch with values of different sign.

    States between are found on hyperplanes normal to the chord, as lambda need not rise; where, by regula falsi that
    halves the value of an end that stays (Illinois; Dowell and Jarratt 1971).

    Returns the point, its imbalance and the iterations, or None if the path between the two is lost.

    Args:
        system: whose equilibrium is sought.
        a: one end of the path's piece.
        b: the other end.
        values: of the goal at both, of different sign.
        goal: what is to be zero at a point.
        tolerance: on the goal, in its unit.
        accuracy: imbalance of the states between, relative.

    Returns:
        the point, its imbalance and the iterations, or None if the path between the two is lost.
    """
    normal = (b.q - a.q)[: system.primal]
    (low, high), (g_low, g_high) = (a, b), values
    spent, side = 0, 0
    for _ in range(MOST):
        part = min(max(g_low / (g_low - g_high), 0.02), 0.98)
        forces = (1.0 - part) * low.forces + part * high.forces
        q, lam = (1.0 - part) * low.q + part * high.q, (1.0 - part) * low.lam + part * high.lam
        state = correct(system, q, lam, forces, normal, accuracy)
        spent += state.iterations
        if state.reason:
            return None
        middle = point(system, state.q, state.lam, b.mode, state.evaluation)
        g = goal(middle)
        if abs(g) <= tolerance:
            negative = count_negative(system.tangent(state.q, state.lam, state.evaluation.forces).matrix)
            return replace(middle, negative=negative), state.evaluation.imbalance, spent
        if g * g_low > 0.0:
            low, g_low = middle, g
            g_high, side = (0.5 * g_high if side == 1 else g_high), 1
        else:
            high, g_high = middle, g
            g_low, side = (0.5 * g_low if side == -1 else g_low), -1
    return None
