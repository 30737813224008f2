"""`bh bend`: three-point bending of a folded corrugation."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bh.commands.findings import check_picture, hand_out
from bh.runtime.terminal import say
from bh.scene.options import a_length

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bh.model.model import Model


def bend(  # noqa: PLR0913 - the options of a command line
    source: Annotated[
        str, typer.Argument(metavar="SCENE|NAME", help="Scene of a free corrugation, or parabolic-edge, ...")
    ],
    azimuth: Annotated[
        list[str] | None,
        typer.Option("--azimuth", metavar="ANGLE", help="Of the bar, from x; as often as wanted; 0, 90deg."),
    ] = None,
    depth: Annotated[
        float | None,
        typer.Option("--depth", metavar="LENGTH", parser=a_length, help="Of a NAME, folded: 6mm."),
    ] = None,
    span: Annotated[
        float, typer.Option("--span", metavar="LENGTH", parser=a_length, help="Between the supports.")
    ] = 50.0,
    width: Annotated[
        float, typer.Option("--bar", metavar="LENGTH", parser=a_length, help="Its width.")
    ] = 10.0,
    travel: Annotated[
        float, typer.Option("--travel", metavar="LENGTH", parser=a_length, help="Of the bar, down.")
    ] = 10.0,
    tape: Annotated[
        float, typer.Option("--tape", metavar="N/MM", help="Hold valleys over the supports; 0: free.")
    ] = 0.0,
    changes: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Set a key of the scene: sheet.t=0.2."),
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write all figures to a JSON file.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option("--picture", metavar="FILE", help="Draw the curves: PNG, SVG or PDF.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
) -> None:
    """Bend a folded corrugation over supports; show its stiffness."""
    from bh.applications.corrugation import Rig, report

    check_picture(picture)
    rig = Rig(span=span, bar=width, travel=travel, tape=tape)
    angles = [_azimuth(text) for text in azimuth or ("0", "90deg")]
    sheet = _sheet(source, depth, changes or ())
    found = report.tests(sheet, 6.0 if depth is None else depth, angles, rig)
    hand_out(
        report.lines(found),
        report.as_dict(found),
        lambda: report.picture(found),
        json_file,
        picture,
        quiet,
    )
    early = [test for test in found if not test.converged]
    if early:
        say(f"bh: {source}: the test ended early: {early[0].outcome} ({early[0].reason})", err=True)
        raise typer.Exit(1)


def _azimuth(text: str) -> float:
    """Of the bar, rad; 90 without a unit is 14 turns and never meant."""
    from bh.errors import InputError
    from meshes.quantities import degrees_meant, spoken

    angle = spoken(text, "angle")
    if abs(angle) > 2.0 * math.pi:
        raise InputError(f"--azimuth {text} is more than a turn{degrees_meant(angle)}")
    return angle


def _sheet(source: str, depth: float | None, changes: Sequence[str]) -> str | Model:
    """The name of a corrugation of the library, or the model of a scene."""
    from bh.errors import InputError
    from bh.scene.load import load_scene
    from meshes.corrugations import KINDS

    if source in KINDS:
        if changes:
            raise InputError(f"--set is for scenes; write {source} into a scene as [pattern] kind")
        return source
    if not Path(source).suffix:
        raise InputError(f"'{source}' is no scene file and none of {', '.join(KINDS)}")
    if depth is not None:
        raise InputError(f"--depth is for names; a scene says it itself: until = {{ depth = {depth:g} }}")
    scene = load_scene(Path(source), changes)
    if scene.accuracy is not None:
        raise InputError(
            f"{source}: bars press on one mesh; give it a [mesh], such as --set mesh.along=32 --set mesh.rows=2, "
            "and no accuracy"
        )
    return scene.model
