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

LETTING_GO = (
    "what is let go of carries much, and no state was found that the sheet would spring to: let go of less at a time, "
    "or fold the sheet free and hold it as it lies (hold)"
)


def advice(outcome: Outcome, letting_go: bool = False) -> str:
    """What to try after an early end; empty where nothing general is known.

    Args:
        outcome: of the path.
        letting_go: whether it ended where a step begins to release supports.
    """
    early = outcome in (Outcome.UNSTABLE, Outcome.STALLED, Outcome.LIMIT_POINT)
    return LETTING_GO if letting_go and early else ADVICE.get(outcome, "")
