"""Sizes of drawings: what can be asked for, and what is worth a remark. mm."""

from __future__ import annotations

import math
from collections.abc import Mapping

from meshes.errors import FileFormatError

SMALL, LARGE = 5.0, 5000.0  # mm; a longer side beyond these gets a remark


def check_lengths(lengths: Mapping[str, float | None]) -> None:
    """Refuse options that cannot be.

    Args:
        lengths: by name, mm (of scale: mm a unit); None where an option is not given.

    Raises:
        FileFormatError: one is no positive number, or scale and fit are both given.
    """
    for name, value in lengths.items():
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise FileFormatError(f"{name} = {value} cannot be; give a positive number")
    if lengths["scale"] is not None and lengths["fit"] is not None:
        raise FileFormatError("scale and fit are both given; give one of them")


def absurd(size: float) -> bool:
    """True of a sheet whose longer side is `size` mm where few are smaller than a stamp or longer than a room."""
    return not SMALL <= size <= LARGE


def size_remarks(size: float, stated: bool) -> list[str]:
    """What to say of a sheet whose longer side is `size` mm.

    Args:
        size: mm.
        stated: whether the file names its unit.

    Returns:
        the lines, none where there is nothing to say.
    """
    if not absurd(size):
        return []
    origin = "as the file says" if stated else "as the file states no unit"
    return [
        f"the sheet is {size:.3g} mm long, {origin}; if that is not meant, give its longer side: fit = 200.0 (mm), or "
        "scale (mm a unit of the drawing)"
    ]
