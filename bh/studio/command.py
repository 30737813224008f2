"""`bh studio`: a window in which a sheet is folded and pulled."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bh.errors import InputError
from bh.studio.door import Door
from bh.studio.library import LIBRARY


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
    door = Door.opened(port)
    seen = browser and (file is None or file in LIBRARY or Path(file).is_file())
    if seen:  # it starts while the program is still being read
        door.show()
    from bh.studio.opening import sheet_of
    from bh.studio.server import open_window

    try:
        sheet = sheet_of(file, material)
    except InputError as error:
        if seen:
            door.refuse(f"bh studio: {error}")
        raise
    open_window(sheet, browser=False, door=door)
