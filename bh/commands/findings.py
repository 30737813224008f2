"""What a command that measures something gives: lines, a JSON file, a picture."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from bh.runtime.terminal import say

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def check_picture(file: Path | None) -> None:
    """See that the name of a picture is one of a kind that can be drawn.

    Args:
        file: its name, or None for no picture.

    Raises:
        InputError: it is none; one line.
    """
    from bh.errors import InputError

    if file is not None and file.suffix.lower() not in (".png", ".svg", ".pdf"):
        raise InputError(f"picture '{file}' is no .png, .svg or .pdf file; name it so")


def hand_out(
    lines: Iterable[str],
    figures: Mapping[str, object],
    draw: Callable[[], Figure],
    json_file: Path | None,
    picture: Path | None,
    quiet: bool,
) -> None:
    """Print the lines, and write what files are wished for; each file is whole or not there.

    Args:
        lines: to print.
        figures: for the JSON file.
        draw: makes the picture; it is called where one is wished for.
        json_file: None for none.
        picture: None for none.
        quiet: print nothing.
    """
    import json

    from meshes.io.export import replacing

    if not quiet:
        for line in lines:
            say(line)
    if json_file is not None:
        with replacing(json_file) as draft:
            draft.write_text(json.dumps(figures, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    if picture is not None:
        figure = draw()
        with replacing(picture) as draft:
            figure.savefig(draft, format=picture.suffix.lower()[1:], dpi=150)
    for file in (json_file, picture):
        if file is not None and not quiet:
            say(f"wrote {file}")
