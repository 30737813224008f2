"""Whether the state that is shown is where a run from flat ends: branches can meet without a snap that is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bh.live import Controls, Frame, Session

SAME = 1e-5  # of the sheet's size: what a state may be off on the same branch
PIECE = 0.05  # s of work between two looks whether it is to end


@dataclass(frozen=True, eq=False)
class FromFlat:
    """Where a run from flat ends.

    Attributes:
        here: in the state that is shown.
        said: one line for the person.
    """

    here: bool
    said: str

    def message(self) -> dict[str, object]:
        """What a window is told.

        Returns:
            as JSON.
        """
        return {"kind": "branch", "here": self.here, "said": self.said}


def from_flat(session: Session, frame: Frame, settles: bool, going: Callable[[], bool]) -> FromFlat | None:
    """Fold the sheet anew from flat, in one step, and pull on it in a second one, as its scene does.

    Args:
        session: the handling of the sheet; it is not changed.
        frame: its state at rest.
        settles: its springs move it downhill to rest where a branch ends.
        going: asked between two pieces of work; False ends it.

    Returns:
        where that ends; None where it was ended.
    """
    if session.straight:
        return FromFlat(True, "ends here: it came this way")
    anew, wanted = Session(session.model, settles=settles), frame.wanted
    for part in (Controls(wanted.folds), Controls(wanted.folds, wanted.grips)):
        anew.ask(part)
        there = anew.update(0.0)
        while not there.at_rest:
            if not going():
                return None
            there = anew.update(PIECE)
            if there.note:
                return FromFlat(False, f"does not get here: {there.note}")
    off = float(np.linalg.norm(there.points - frame.points, axis=1).max())
    if anew.left:  # a run follows the branch round its limit points and may go anywhere
        return FromFlat(False, "snaps on its way, and may end elsewhere")
    if off <= SAME * float(np.ptp(session.mesh.points, axis=0).max()):
        return FromFlat(True, "ends here")
    ends = (
        f"{there.state.energy.total:.4g} N mm there, {frame.state.energy.total:.4g} here, {off:.3g} mm apart"
    )
    return FromFlat(False, f"ends on another branch: {ends}")
