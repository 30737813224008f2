"""What to try where a path did not reach its end, by its outcome."""

from __future__ import annotations

from bh.solvers.outcome import Outcome

ADVICE: dict[Outcome, str] = {
    Outcome.LIMIT_POINT: "impose the displacement or the angle in place of the force or couple; that goes on beyond "
    "the largest one",
    Outcome.BIFURCATION: "leave the strategy out, or take at_bifurcation = 'stable', to follow the stable branch",
    Outcome.UNSTABLE: "look at path.critical_points, and at path.remarks for how the sheet would leave the state",
    Outcome.MECHANISM: "add supports, or stiffness to what moves",
    Outcome.CONTACT: "stop earlier (until), or let hinges lock (hinge_lock = true)",
    Outcome.STALLED: "fold in several steps, give creases that cannot all have their angles springs (Lstar), or take a "
    "finer mesh or the consistent formulation",
    Outcome.TARGET_MISSED: "let the actuation go further, or ask for a value that occurs",
    Outcome.UNFINISHED: "go on with resume",
}
