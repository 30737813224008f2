"""What is typed behind `bh fold`; what it does is in `bh.commands.fold`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bh.runtime.terminal import say
from bh.scene.options import a_length, a_time, an_angle


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
            "--material", help="paper, card, board, pet, pp, aluminium or steel; default card, or paper."
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
    write: Annotated[
        list[str] | None,
        typer.Option("--write", metavar="glb", help="Also glb, stl, obj, ...; may be repeated."),
    ] = None,
    seconds: Annotated[
        float,
        typer.Option("--seconds", metavar="60s", parser=a_time, help="Processor time to spend on it."),
    ] = 60.0,
    force: Annotated[bool, typer.Option("--force", help="Write over a scene that is there.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
) -> None:
    """Fold a drawing: picture, result and the scene that did it."""
    from bh.commands.fold import fold_file
    from bh.commands.summary import summary
    from bh.scene.folding import Wish

    number = int(frame) if frame is not None and frame.isdigit() else frame
    wish = Wish(
        angle,
        percent,
        material,
        fit,
        scale,
        number,
        tuple(write or ()),
    )
    folder = Path(f"{file.stem}-folded") if output is None else output
    done = fold_file(file, folder, wish, seconds=seconds, progress=not quiet, force=force)
    if not quiet:
        for line in done.proposal.assumed:
            say(f"assumed: {line}")
        for line in done.notes:
            say(f"tried: {line}")
        say(f"mesh: {done.proposal.mesh}; {done.path.model.formulation}")
        summary(done.path, done.scene, done.written, None)
    if not done.path.reached:
        say(
            f"bh: {file}: folded to {100 * done.path[-1].lam:.0f} % of what was wanted ({done.notes[-1]}); "
            f"more time: --seconds; what was reached is in '{done.written[2]}'",
            err=True,
        )
        raise typer.Exit(1)
