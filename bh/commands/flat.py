"""What `bh export` is asked for a flat pattern, from words of the command line."""

from __future__ import annotations

from typing import Literal, cast

from bh.errors import InputError
from bh.scene.flat import Angles, Cutting
from meshes.quantities import spoken


def cutting(
    facets: bool, kerf: str | None, perforate: str | None, units: str, angles: str | None, marks: bool
) -> Cutting:
    """The options of a flat pattern.

    Args:
        facets: also lines that do not fold.
        kerf: a length, or None.
        perforate: two lengths with a comma between, or None.
        units: "mm" or "in".
        angles: "layer" or "text", or None.
        marks: of pinches.

    Raises:
        InputError: lengths that are none; the writer checks the words.
    """
    lengths: tuple[float, float] | None = None
    if perforate is not None:
        parts = perforate.split(",")
        if len(parts) != 2:
            raise InputError(f"--perforate {perforate} cannot be; give two lengths, such as 3,1")
        lengths = spoken(parts[0], "length"), spoken(parts[1], "length")
    return Cutting(
        facets,
        lengths,
        0.0 if kerf is None else spoken(kerf, "length"),
        cast(Literal["mm", "in"], units),
        cast(Angles | None, angles),
        marks,
    )
