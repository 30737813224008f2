"""`bh response`: force against displacement of a place of a solved scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bh.commands.findings import check_picture, hand_out
from bh.runtime.terminal import say
from bh.scene.options import a_length


def response(  # noqa: PLR0913 - the options of a command line
    scene: Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file (TOML).")],
    at: Annotated[str, typer.Option("--at", metavar="PLACE", help="The place that is moved.")],
    to: Annotated[
        float,
        typer.Option("--to", metavar="LENGTH", parser=a_length, help="How far: 10mm, or a number in mm."),
    ],
    axis: Annotated[
        str, typer.Option("--axis", metavar="AXIS", help="Along x, y, z, or three numbers: 0,0.6,0.8.")
    ] = "z",
    hold: Annotated[
        list[str] | None,
        typer.Option("--hold", metavar="PLACE", help="Clamp it as it lies; as often as wanted."),
    ] = None,
    points: Annotated[int, typer.Option("--points", metavar="N", help="States at least.")] = 20,
    changes: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Set a key: sheet.t=0.2, steps[0].fold.to=60deg."),
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write all figures to a JSON file.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option("--picture", metavar="FILE", help="Draw the curve: PNG, SVG or PDF.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
) -> None:
    """Solve a scene, move a place of it on, and show its force."""
    from bh.applications import response as curve
    from bh.scene.load import load_scene

    check_picture(picture)
    direction = _direction(axis)
    loaded = load_scene(scene, changes or ())
    found = curve.response(
        loaded.model,
        at,
        direction,
        to,
        hold=hold or (),
        points=points,
        accuracy=loaded.accuracy,
        progress=not quiet,
    )
    hand_out(curve.lines(found), found.as_dict(), lambda: curve.picture(found), json_file, picture, quiet)
    if not found.reached:
        say(f"bh: {scene}: the curve ended early: {found.outcome} ({found.reason})", err=True)
        raise typer.Exit(1)


def _direction(text: str) -> tuple[float, ...]:
    from bh.errors import InputError
    from bh.model.supports import AXES

    if text in AXES:
        return AXES[text]
    try:
        found = tuple(float(part) for part in text.split(","))
    except ValueError:
        found = ()
    if len(found) != 3:
        raise InputError(f"--axis {text} is no direction; give x, y, z or three numbers such as 0,0.6,0.8")
    return found
