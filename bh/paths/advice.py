"""A path that did not reach its end in one line: how far it came, why it ended there, and what to try."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bh.solvers.outcome import Outcome

if TYPE_CHECKING:
    from bh.paths.path import Path

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


def told(path: Path) -> str:
    """Outcome, place, reason and advice of a path in one line.

    Args:
        path: that did not reach its end.
    """
    number = min(len(path.steps), len(path.model.steps))
    lam = path.records[-1].lam if path.records and path.records[-1].step == number - 1 else 0.0
    reason = f" ({path.reason})" if path.reason else ""
    where = f"step {max(number, 1)} of {len(path.model.steps)} at lambda {lam:.3g}"
    advice = ADVICE.get(path.outcome, "")
    return f"the path ended early, {path.outcome}, in {where}{reason}" + (f"; {advice}" if advice else "")
