"""What is typed behind `bh fold`; what it does is in `bh.commands.fold`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bh.runtime.terminal import say
from bh.scene.options import a_length, a_sheet, a_time, an_angle

if TYPE_CHECKING:
    from bh.commands.fold import Folded


def fold(  # noqa: PLR0913 - the options of a command line
    file: Annotated[Path, typer.Argument(metavar="FILE", help="SVG, DXF, FOLD, .cp or .opx.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="DIR", help="Output folder; default FILE-folded.")
    ] = None,
    angle: Annotated[
        float | None,
        typer.Option("--angle", metavar="60deg", parser=an_angle, help="Fold angle of every crease."),
    ] = None,
    percent: Annotated[
        float | None,
        typer.Option("--percent", help="Of the drawn angles, or of 180 degrees; default 80 of 180."),
    ] = None,
    material: Annotated[
        str | None,
        typer.Option(
            "--material",
            help="paper, card, board, pet, pp, aluminium or steel (default card, or paper), "
            "or of the table: card-300.",
        ),
    ] = None,
    fit: Annotated[
        float | None,
        typer.Option("--fit", metavar="200mm", parser=a_length, help="Longer side of the sheet."),
    ] = None,
    scale: Annotated[
        float | None,
        typer.Option("--scale", metavar="1mm", parser=a_length, help="What a unit of the drawing is."),
    ] = None,
    frame: Annotated[
        str | None, typer.Option("--frame", help="Of a FOLD file: number (0 is the key frame) or title.")
    ] = None,
    sheet: Annotated[
        str | None,
        typer.Option(
            "--sheet",
            metavar="N|all",
            parser=a_sheet,
            help="Which of several sheets, in rows from the top left.",
        ),
    ] = None,
    write: Annotated[
        list[str] | None,
        typer.Option("--write", metavar="glb", help="Also glb, stl, obj, ...; may be repeated."),
    ] = None,
    seconds: Annotated[
        float,
        typer.Option(
            "--seconds", metavar="150s", parser=a_time, help="For solving; counted by work, not by the clock."
        ),
    ] = 150.0,
    contact: Annotated[bool, typer.Option("--contact", help="Panels of nets stop each other: slow.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Write over a scene that is there.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
) -> None:
    """Fold a drawing: picture, result and the scene that did it."""
    from bh.commands import fold_all
    from bh.commands.fold import fold_file
    from bh.commands.place import marking
    from bh.scene.folding import Wish

    number = int(frame) if frame is not None and frame.isdigit() else frame
    one = sheet if isinstance(sheet, int) else None
    wish = Wish(angle, percent, material, fit, scale, number, one, tuple(write or ()), contact)
    folder = Path(f"{file.stem}-folded") if output is None else output
    if sheet == "all":
        together = fold_all.fold_sheets(file, folder, wish, seconds=seconds, progress=not quiet, force=force)
        ended = [_told(done, f"{file}, sheet {at}", quiet) for at, done in together.sheets.items()]
        for at, why in together.left.items():
            say(f"bh: sheet {at} is left out: {why}", err=True)
        if not quiet:
            say(f"all sheets: {together.picture}")
    else:
        reading = {"fit": fit, "scale": scale, "frame": number, "sheet": one}
        given = {key: value for key, value in reading.items() if value is not None}
        with marking(file, folder.parent, given):
            done = fold_file(file, folder, wish, seconds=seconds, progress=not quiet, force=force)
        ended = [_told(done, str(file), quiet)]
    if not all(ended):
        raise typer.Exit(1)


def _told(done: Folded, name: str, quiet: bool) -> bool:
    """Print what has come of a sheet; True if it folded all the way."""
    from bh.commands.summary import summary

    if not quiet:
        for line in done.proposal.assumed:
            say(f"assumed: {line}")
        for line in done.notes:
            say(f"tried: {line}")
        say(f"mesh: {done.proposal.mesh}; {done.path.model.formulation}")
        summary(done.path, done.scene, done.written, done.contact)
    if not done.path.reached:
        say(
            f"bh: {name}: folded to {100 * done.path[-1].lam:.0f} % of what was wanted ({done.notes[-1]}); "
            f"more time: --seconds; what was reached is in '{done.written[2]}'",
            err=True,
        )
    return done.path.reached
