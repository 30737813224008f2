"""What a window can go back to, stroke by stroke."""

from __future__ import annotations

import bh.studio.messages as asked
from bh.live import Mark
from bh.live.history import lightened
from bh.studio.sheets import LiveSheet

REMEMBERED = 200  # strokes that are taken back
Was = tuple[LiveSheet, Mark, str]  # a sheet, where it lay, and the name of its material


def pushed(pile: list[Was], newest: Was) -> None:
    """Lay what was there on what can be gone back to, which ends at a number and at a size.

    Args:
        pile: the newest last; it is changed.
        newest: to be laid on it.
    """
    kept = [*pile, newest][-REMEMBERED:]
    marks = lightened([mark for _, mark, _ in kept], REMEMBERED)
    pile[:] = [(sheet, mark, material) for (sheet, _, material), mark in zip(kept, marks, strict=True)]


def moved(message: asked.Asked) -> tuple[object, ...]:
    """Which slider, point or jaws a message moves.

    Args:
        message: checked.

    Returns:
        its name or numbers; nothing of other messages.
    """
    match message:
        case asked.Fold(crease=crease):
            return (crease,)
        case asked.Pull(node=node):
            return (node,)
        case asked.Pinch(a=a, b=b):
            return a, b
        case _:
            return ()
