"""`bh fold --sheet all`: every sheet of a drawing folded, each in a folder of its own, and one picture of them all."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from bh.commands.fold import SECONDS, Folded, fold_file
from bh.errors import InputError
from bh.runtime.progress import ProgressMeter
from bh.scene.folding import Wish

PICTURE = "folded.png"


@dataclass(frozen=True)
class FoldedSheets:
    """What has come of the sheets of a drawing.

    Attributes:
        sheets: by number, from 1 in rows from the top left.
        left: why the others are not folded, by number; one line each.
        picture: of all sheets side by side.
    """

    sheets: dict[int, Folded]
    left: dict[int, str]
    picture: Path


def fold_sheets(
    file: Path,
    folder: Path,
    wish: Wish,
    *,
    seconds: float = SECONDS,
    progress: bool | ProgressMeter = False,
    force: bool = False,
) -> FoldedSheets:
    """Fold all sheets of a drawing, into sheet-1, sheet-2, ... of a folder, and draw them side by side.

    Args:
        file: .svg, .dxf, .fold, .cp or .opx.
        folder: for the results; made if need be.
        wish: how to fold; its sheet is not looked at.
        seconds: for all of them, in equal shares.
        progress: as for `bh.trace`.
        force: write over scenes that are there.

    Returns:
        the sheets; those without a crease, and others that cannot be folded, are left out and named.

    Raises:
        InputError: the file cannot be read, or none of its sheets can be folded.
    """
    from bh.plotting.pictures import side_by_side
    from meshes.io.drawing import DrawingOptions, count_sheets

    options: DrawingOptions = {"scale": wish.scale, "frame": wish.frame}
    count = max(count_sheets(file, **options), 1)
    sheets: dict[int, Folded] = {}
    left: dict[int, str] = {}
    first: InputError | None = None
    for number in range(1, count + 1):
        try:
            sheets[number] = fold_file(
                file,
                folder / f"sheet-{number}",
                replace(wish, sheet=number),
                seconds=max(seconds / count, 1.0),
                progress=progress,
                force=force,
            )
        except InputError as error:
            first = first or error
            left[number] = str(error)
    if first is not None and not sheets:
        raise first
    picture = side_by_side([done.path[-1] for done in sheets.values()], folder / PICTURE)
    return FoldedSheets(sheets, left, picture)
