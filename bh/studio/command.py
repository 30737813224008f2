"""`bh studio`: a window in which a sheet is folded and pulled."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bh.errors import InputError
from bh.studio.server import open_window
from bh.studio.sheets import LIBRARY, LONGEST, LiveSheet, of_file, of_library


def studio(
    file: Annotated[
        str | None,
        typer.Argument(help=f"A drawing (.svg, .dxf, .fold, .cp, .opx), or a pattern: {', '.join(LIBRARY)}."),
    ] = None,
    material: Annotated[str, typer.Option(help="paper, card, board, pet, pp, aluminium or steel.")] = "card",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Of this machine; 0 for a free one.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the browser of this machine.")] = True,
) -> None:
    """Fold a sheet by sliders, in a window of the browser.

    Args:
        file: a drawing, or the name of a pattern of the library.
        material: one of those of `bh fold`.
        port: of this machine; 0 for a free one.
        browser: open it.

    Raises:
        InputError: the file cannot be read or meshed, or the port is taken.
    """
    open_window(_sheet(file, material), port, browser)


def _sheet(file: str | None, material: str) -> LiveSheet | None:
    if file is None:
        return None if material == "card" else of_library(next(iter(LIBRARY)), material)
    if file in LIBRARY and not Path(file).exists():
        return of_library(file, material)
    try:
        with Path(file).open("rb") as stream:
            data = stream.read(LONGEST + 1)
    except OSError as error:
        raise InputError(
            f"'{file}' cannot be read ({error.strerror}); give a drawing, or one of {', '.join(LIBRARY)}"
        ) from error
    return of_file(file, data, material)
