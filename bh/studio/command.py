"""`bh studio`: a window in which a sheet is folded and pulled."""

from __future__ import annotations

from typing import Annotated

import typer

from bh.studio.opening import sheet_of
from bh.studio.server import open_window
from bh.studio.sheets import LIBRARY


def studio(
    file: Annotated[
        str | None,
        typer.Argument(
            help=f"A drawing (.svg, .dxf, .fold, .cp, .opx), a scene (.toml), or a pattern: {', '.join(LIBRARY)}."
        ),
    ] = None,
    material: Annotated[str, typer.Option(help="paper, card, board, pet, pp, aluminium or steel.")] = "card",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Of this machine; 0 for a free one.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the browser of this machine.")] = True,
) -> None:
    """Fold a sheet by sliders, in a window of the browser.

    Args:
        file: a drawing, a scene, or the name of a pattern of the library.
        material: one of those of `bh fold`.
        port: of this machine; 0 for a free one.
        browser: open it.

    Raises:
        InputError: the file cannot be read or meshed, or the port is taken.
    """
    open_window(sheet_of(file, material), port, browser)
