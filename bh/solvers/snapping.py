"""A sheet whose supports are let go of, where it has no equilibrium near by: it snaps, and that is told.

Behind a limit point of ordinary loads the branch goes on, and arc length follows it. What stands for supports that are
let go of (`bh.loading.tethers`) is no load that could be taken back: a branch that turns there leads nowhere, and the
sheet falls to the next state downhill.
"""

from __future__ import annotations

from dataclasses import replace

from bh.solvers.newton import Newton, Solution
from bh.solvers.points import Point, point
from bh.solvers.pseudo_transient import PseudoTransient
from bh.solvers.stability import leave_saddle
from bh.solvers.system import System

FALLS = 3  # cuts of an increment before the sheet is let fall
STEPS = 1000  # downhill, and of a motion to rest, that a fall may take


def lets_go(system: System) -> bool:
    """Does a system let go of supports?

    Args:
        system: of a step.
    """
    return bool(getattr(system, "tethers", None))


def fall(system: System, here: Point, lam: float, newton: Newton) -> tuple[Solution, str]:
    """The stable state downhill from the last one, at a lambda at which there is none near by, and a note.

    Args:
        system: that lets go of supports.
        here: the last state.
        lam: load parameter of the step, 0 to 1.
        newton: settings.

    Returns:
        both; an empty note where none was found.
    """
    method = replace(newton, full=0, globalised=STEPS, transient=PseudoTransient(most=STEPS))
    found = method.solve(system, here.q, lam)
    if found.converged and found.stable is False:
        found, _ = leave_saddle(system, found, lam, method)
    there = point(system, found.q, lam, evaluation=found.evaluation, negative=found.negative)
    if not (found.converged and found.stable) or there.energy > here.energy:
        return found, ""
    if system.penetration(here.q, here.lam, there.q, lam):
        return found, ""
    falls = f"its energy falls by {here.energy - there.energy:.3g} N mm"
    return found, f"the sheet snaps where it is let go of, at lambda {lam:.6g}: {falls}"
