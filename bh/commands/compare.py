"""`bh compare`: one scene by every formulation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bh.commands.findings import check_picture, hand_out
from bh.runtime.terminal import say

if TYPE_CHECKING:
    from bh.applications.comparison import Stiff


def compare(
    scene: Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file (TOML).")],
    formulations: Annotated[
        list[str] | None,
        typer.Option("--formulation", metavar="NAME", help="One of them, as often as wanted; default all."),
    ] = None,
    stiffness: Annotated[
        list[str] | None,
        typer.Option("--stiffness", metavar="PLACE:AXIS", help="Also compare it: corner:outer-end:z."),
    ] = None,
    changes: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Set a key: sheet.t=0.2, steps[0].fold.to=60deg."),
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write all figures to a JSON file.")
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option("--picture", metavar="FILE", help="Draw the differences: PNG, SVG or PDF."),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
) -> None:
    """Solve a scene by every formulation on one mesh, and compare."""
    from bh.applications import comparison
    from bh.scene.load import load_scene

    check_picture(picture)
    loaded = load_scene(scene, changes or ())
    wanted = _stiffness(stiffness) if stiffness else None
    found = comparison.compare(
        loaded.model,
        formulations=formulations or (),
        accuracy=loaded.accuracy,
        symmetry=loaded.symmetry,
        stiffness=wanted,
        progress=not quiet,
    )
    hand_out(
        comparison.lines(found),
        found.as_dict(),
        lambda: comparison.picture(found),
        json_file,
        picture,
        quiet,
    )
    # one that cannot do this at all, and was not asked for by name, is no failure of the comparison
    named = formulations or ()
    missing = [
        member.formulation
        for member in found.members
        if not member.reached and (member.path is not None or member.formulation in named)
    ]
    if found.reference is None:
        missing = [member.formulation for member in found.members]
    if missing:
        say(f"bh: {scene}: not reached by {', '.join(missing)}", err=True)
        raise typer.Exit(1)


def _stiffness(asked: list[str]) -> Stiff:
    from bh.applications.comparison import Stiff
    from bh.errors import InputError
    from bh.model.supports import AXES

    text, *more = asked
    if more:
        raise InputError(
            f"--stiffness {text} and {', '.join(more)}: one place and axis can be compared at a time"
        )
    place, _, axis = text.rpartition(":")
    if not place or axis not in AXES:
        raise InputError(f"--stiffness {text} is no place and axis; write it as corner:outer-end:z")
    return Stiff(place, AXES[axis])
