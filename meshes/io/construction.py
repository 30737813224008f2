"""Construction lines that are drawn as the outline is: a grid that reaches beyond the sheet is no part of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from meshes.planar import DrawnLine

ROUNDS = 20  # lines whose ends lay on lines that were left out end loosely then


def without_construction(lines: Sequence[DrawnLine], gap: float) -> tuple[list[DrawnLine], list[str]]:
    """Leave out boundary lines that end loosely at both ends and reach beyond the outline that the others make.

    Lines within the sheet stay, whatever their ends meet; so does everything where the others close no outline.

    Args:
        lines: what is drawn, mm.
        gap: ends within this distance of another line meet it, mm.

    Returns:
        the lines that are left, and one remark where some are not.
    """
    import shapely

    shapes = np.array([shapely.LineString(line.points) for line in lines], dtype=object)
    closed = np.array([np.array_equal(line.points[0], line.points[-1]) for line in lines])
    rim = np.flatnonzero([line.kind == "boundary" for line in lines])
    rest = rim
    for _ in range(ROUNDS):
        loose = _loose(shapes[rest], gap) & ~closed[rest]
        if not loose.any():
            break
        rest = rest[~loose]
    extra = np.setdiff1d(rim, rest)
    if not len(extra) or not len(rest):
        return list(lines), []
    drawn = shapely.union_all(shapely.buffer(shapes[rest], gap))
    inside = shapely.union_all([shapely.Polygon(part.exterior) for part in shapely.get_parts(drawn)])
    if inside.area <= 2.0 * drawn.area:  # no sheet, lines only
        return list(lines), []
    out = extra[~shapely.covered_by(shapes[extra], inside)].tolist()
    if not out:
        return list(lines), []
    return (
        [line for k, line in enumerate(lines) if k not in set(out)],
        [
            f"{len(out)} lines in the outline's colour (first {lines[out[0]].name}) end loosely beyond the outline: "
            "taken as construction lines, left out"
        ],
    )


def _loose(shapes: NDArray[np.object_], gap: float) -> NDArray[np.bool_]:
    """Of (n,) lines those whose ends both lie further than `gap` from every other line, (n,)."""
    import shapely

    tree = shapely.STRtree(shapes)
    met = np.zeros(len(shapes), dtype=bool)
    for end in (0, -1):
        at, on = tree.query(shapely.get_point(shapes, end), predicate="dwithin", distance=gap)
        met[at[at != on]] = True
    return ~met
