"""Construction lines that are drawn as the outline is: a grid that reaches beyond the sheet is no part of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from meshes.curves import Array

ROUNDS = 20  # lines whose ends lay on lines that were left out end loosely then


def construction(lines: Sequence[Array], kinds: Sequence[str], gap: float) -> list[int]:
    """Boundary lines that end loosely at both ends and reach beyond the outline that the others make.

    Lines within the sheet are none, whatever their ends meet; nor is any where the others close no outline.

    Args:
        lines: (k, 2) points each, in any unit.
        kinds: what they stand for, see `meshes.planar.RANK`.
        gap: ends within this distance of another line meet it, in the same unit.

    Returns:
        their numbers, rising.
    """
    import shapely

    rim = np.flatnonzero([kind == "boundary" for kind in kinds])
    shapes = np.array([shapely.LineString(lines[k]) for k in rim.tolist()], dtype=object)
    closed = shapely.is_closed(shapes)
    rest = np.arange(len(rim))
    for _ in range(ROUNDS):
        loose = _loose(shapes[rest], gap) & ~closed[rest]
        if not loose.any():
            break
        rest = rest[~loose]
    extra = np.setdiff1d(np.arange(len(rim)), rest)
    if not len(extra) or not len(rest):
        return []
    drawn = shapely.union_all(shapely.buffer(shapes[rest], gap))
    inside = shapely.union_all([shapely.Polygon(part.exterior) for part in shapely.get_parts(drawn)])
    if inside.area <= 2.0 * drawn.area:  # no sheet, lines only
        return []
    return [int(k) for k in rim[extra[~shapely.covered_by(shapes[extra], inside)]]]


def _loose(shapes: NDArray[np.object_], gap: float) -> NDArray[np.bool_]:
    """Of (n,) lines those whose ends both lie further than `gap` from every other line, (n,)."""
    import shapely

    tree = shapely.STRtree(shapes)
    met = np.zeros(len(shapes), dtype=bool)
    for end in (0, -1):
        at, on = tree.query(shapely.get_point(shapes, end), predicate="dwithin", distance=gap)
        met[at[at != on]] = True
    return ~met
