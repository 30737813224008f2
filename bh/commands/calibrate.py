"""`bh calibrate`: numbers of a scene from what was measured."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bh.commands.findings import check_picture, hand_out
from bh.runtime.terminal import say


def calibrate(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Calibration file (TOML); docs/calibrate.md.")],
    starts: Annotated[
        int | None,
        typer.Option("--starts", metavar="N", help="Beginnings that are tried; default the file's."),
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write all figures to a JSON file.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option("--picture", metavar="FILE", help="Draw the residuals: PNG, SVG or PDF.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
) -> None:
    """Find numbers of a scene by what was measured."""
    from bh.applications import calibration, calibration_picture
    from bh.commands.calibrate_file import load_task

    check_picture(picture)
    task = load_task(file)
    found = calibration.calibrate(
        task.build,
        task.data,
        task.free,
        task.starts if starts is None else starts,
        task.seed,
        progress=None if quiet else lambda line: say(line, err=True),
    )
    values = " ".join(
        f"--set {name}={value:.6g}" for name, value in zip(found.names, found.values, strict=True)
    )
    lines = (
        *str(found).splitlines(),
        f"misfit {found.misfit:.4g} of {len(found.residuals)} values and {len(found.names)} parameters, "
        f"{found.solved} solutions",
        f"bh run {task.scene.name} {values}",
    )
    hand_out(lines, found.as_dict(), lambda: calibration_picture.picture(found), json_file, picture, quiet)
