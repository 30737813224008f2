"""The last resort of a sheet whose panels stop each other: from the end of its branch it moves downhill to rest.

Panels that meet head on and slip off each other make limit points by the dozen, on branches that arc length follows
for hundreds of states without coming any further. A sheet does not: behind the first of them it snaps. What it snaps
to hangs on its mass and its damping; here the motion is damped so much that it goes straight downhill, and it is told.
"""

from __future__ import annotations

from collections.abc import Sequence

from bh.solvers.lagging import Lagging
from bh.solvers.load_control import LoadControl
from bh.solvers.outcome import Outcome
from bh.solvers.points import Increment, Point, point
from bh.solvers.settling import Settling
from bh.solvers.system import Hindered, Remembering, System

AHEAD = 0.02  # of the step, from the last stable state to where the sheet comes to rest
STEPS = 500  # downhill
FALLS = 5  # in one step


def snaps(system: System) -> bool:
    """Is a sheet let fall where its branch leads nowhere? Only where something stops it, and nothing hangs on the way.

    What rubs, and creases that yield, remember the last state of the path; the fall begins at one before it.

    Args:
        system: of the step.
    """
    rubs = isinstance(system, Lagging) and system.lags
    yields = isinstance(system, Remembering) and system.remembers
    return isinstance(system, Hindered) and system.hindered and not (rubs or yields)


def settled_ahead(system: System, seen: Sequence[Point], load: LoadControl) -> Increment | None:
    """Where the sheet comes to rest a little ahead of the stable state that has come furthest; None if nowhere.

    Args:
        system: whose panels stop each other.
        seen: accepted states of the step.
        load: goes on from there.
    """
    stable = [at for at in seen if at.negative == 0 and at.lam < 1.0]
    if not stable:
        return None
    top = max(stable, key=lambda at: at.lam)
    # motions are looked for from an accepted state again, not from the last one of arc length
    if system.penetration(top.q, top.lam, top.q, top.lam):
        return None
    lam = min(top.lam + AHEAD, 1.0)
    found = Settling(most=STEPS).settle(system, top.q, lam)
    if not (found.converged and found.stable) or system.penetration(top.q, top.lam, found.q, lam):
        return None
    there = point(system, found.q, lam, evaluation=found.evaluation, negative=found.negative)
    # beside what the actuation would have done to the state before
    falls = top.energy + (lam - top.lam) * top.power - there.energy
    lost = f": its energy falls by {falls:.3g} N mm" if falls > 0.0 else ""
    note = f"the sheet snaps where its branch leads nowhere, at lambda {lam:.6g}{lost}"
    return Increment(
        there,
        Outcome.REACHED,
        found.iterations,
        found.evaluation.imbalance,
        load.cautious(system),
        note=note,
        jumped=True,
    )
