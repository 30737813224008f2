"""Why a step could not go on, said by name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bh.solvers.matrices import IndefiniteError
from bh.solvers.modes import lowest_mode
from bh.solvers.outcome import Outcome
from bh.solvers.points import Increment
from bh.solvers.system import System

# stiffness of a motion, in parts of the typical one, that is rounding; next to a critical point it is merely small
FREE = 1e-15
FALLING = -1e-9  # the same, of a motion that gains energy: no rounding any more


def diagnose(system: System, failure: Increment) -> Increment:
    """A failed increment with the outcome that names its reason, where the last state tells it.

    In this order: what the system itself sees (contact of panels, loads that turn a free sheet), a motion without
    stiffness ("mechanism") or with a negative one ("unstable"), and what the strategy has found ("limit-point",
    "bifurcation", "stalled").

    Args:
        system: whose equilibrium is sought.
        failure: the increment that failed.
    """
    here = failure.point
    obstacle = system.obstacle(here.q, here.lam)
    if obstacle is not None:
        outcome, reason = obstacle
        return replace(failure, outcome=outcome, note=f"{reason}; {failure.note}")
    if failure.outcome is not Outcome.STALLED:
        return failure
    motion, stiffness = free_motion(system, failure)
    if not motion:
        return failure
    if stiffness < FALLING:
        note = f"the sheet would leave its last state: {motion}, and gains energy by it; {failure.note}"
        return replace(failure, outcome=Outcome.UNSTABLE, note=note)
    return replace(failure, outcome=Outcome.MECHANISM, note=f"{motion} without resistance; {failure.note}")


def free_motion(system: System, failure: Increment) -> tuple[str, float]:
    """The motion of the last state that nothing resists.

    Args:
        system: whose equilibrium is sought.
        failure: the increment that failed.

    Returns:
        it in words, and its stiffness in parts of the typical one; empty and 0 where there is none.
    """
    here = failure.point
    matrix = system.tangent(here.q, here.lam, here.forces).matrix
    try:
        stiffness, mode = lowest_mode(matrix, system.size, system.primal)
    except IndefiniteError:
        return "", 0.0
    rng = np.random.default_rng(3)
    probe = np.concatenate((rng.normal(size=system.primal), np.zeros(system.size - system.primal)))
    typical = float(np.linalg.norm((matrix @ probe)[: system.primal]) / np.linalg.norm(probe))
    if stiffness >= FREE * typical:
        return "", 0.0
    return system.describe(here.q, here.lam, mode), stiffness / max(typical, 1e-300)
