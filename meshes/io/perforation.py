"""Creases that are drawn as dashes, each a line of its own, made whole again.

Machines that ignore the style of a line need perforated creases cut up (`meshes.io.write_pattern(perforate=...)`), and
such files come back. Dashes follow one another in their own direction, with gaps that are not much longer than they
are; the crease goes on to the line that it would meet within one more gap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from meshes.curves import Array, arc_lengths
from meshes.planar import DrawnLine
from meshes.topology import Ints

if TYPE_CHECKING:
    from shapely import STRtree

LEAST = 4  # dashes of a crease
STRAIGHT = 0.95  # cosine between a dash and the gap after it
LONGEST_GAP = 2.5  # of the dash before it
CHUNK = 256  # ends whose gaps are looked for at a time
ALIKE = 3.0  # most that the gaps of one crease differ from their median
KINDS = ("mountain", "valley", "flat")


@dataclass(frozen=True)
class _Ends:
    """Both ends of the lines: points (2 n, 2), directions out of the line (2 n, 2), lengths (2 n,) of the lines, mm."""

    points: Array
    out: Array
    lengths: Array


def join_dashes(lines: Sequence[DrawnLine], near: float) -> tuple[list[DrawnLine], list[str]]:
    """Put dashes together that make up a crease.

    Args:
        lines: what is drawn, mm.
        near: ends within this distance of another line meet it and belong to no gap, mm.

    Returns:
        the lines with the dashes of a crease as one, and one remark where there were any.
    """
    import shapely

    out = list(lines)
    gone: set[int] = set()
    dashes = creases = 0
    tree = shapely.STRtree([shapely.LineString(line.points) for line in lines])
    for kind in KINDS:
        numbers = [k for k, line in enumerate(lines) if line.kind == kind and not _closed(line)]
        if len(numbers) < LEAST:
            continue
        ends = _ends([lines[k] for k in numbers])
        for chain in _chains(ends, _meeting(ends, numbers, tree, near), near):
            rows = [numbers[index] for index, _ in chain]
            parts = [lines[row].points[:: 1 if on else -1] for row, (_, on) in zip(rows, chain, strict=True)]
            gap = max(float(np.linalg.norm(b[0] - a[-1])) for a, b in pairwise(parts))
            points = _lengthened(np.vstack(parts), 1.5 * gap, tree, rows)
            points = _lengthened(points[::-1], 1.5 * gap, tree, rows)[::-1]
            first = lines[rows[0]]
            out[rows[0]] = replace(
                first, points=points, name=f"{first.name} and the dashes after it", curve=None
            )
            gone.update(rows[1:])
            dashes, creases = dashes + len(rows), creases + 1
    if not creases:
        return out, []
    word = "crease" if creases == 1 else "creases"
    return (
        [line for k, line in enumerate(out) if k not in gone],
        [f"{dashes} dashes in line are taken as {creases} perforated {word}"],
    )


def _lengthened(points: Array, by: float, tree: STRtree, own: Sequence[int]) -> Array:
    """Points (k, 2) with the place where the line, made longer by up to `by`, meets the first that is not its `own`."""
    import shapely

    last = points[-1]
    ahead = last - points[-2]
    tip = last + by * ahead / max(float(np.linalg.norm(ahead)), 1e-300)
    ray = shapely.LineString([last, tip])
    others = np.setdiff1d(tree.query(ray, predicate="intersects"), own)
    met = shapely.get_parts(ray.intersection(tree.geometries[others]))
    spots = [np.asarray(place.coords)[0] for place in met if not place.is_empty]
    if not spots:
        return points
    return np.vstack((points, min(spots, key=lambda spot: float(np.linalg.norm(spot - last)))))


def _closed(line: DrawnLine) -> bool:
    return bool(np.array_equal(line.points[0], line.points[-1]))


def _chains(ends: _Ends, meeting: Ints, near: float) -> list[list[tuple[int, bool]]]:
    """Rows of dashes in order, each with whether it is passed from its first point to its last."""
    link = _links(ends, meeting, near)
    found = []
    seen: set[int] = set()
    for start in range(len(link) // 2):
        if start in seen:
            continue
        # walk backwards to the beginning of the row (or round it), then forwards
        end, first = 2 * start, start
        while link[end] >= 0:
            end = int(link[end]) ^ 1
            if end // 2 == first:
                break
        chain, gaps = [], []
        end ^= 1  # the end that the row goes on from
        while True:
            chain.append((end // 2, end % 2 == 1))
            seen.add(end // 2)
            other = int(link[end])
            if other < 0 or other // 2 in seen:
                break
            gaps.append(float(np.linalg.norm(ends.points[end] - ends.points[other])))
            end = other ^ 1
        typical = float(np.median(gaps)) if gaps else 0.0
        if len(chain) >= LEAST and max(gaps) <= ALIKE * typical and min(gaps) * ALIKE >= typical:
            found.append(chain)
    return found


def _ends(dashes: Sequence[DrawnLine]) -> _Ends:
    points, out, lengths = [], [], []
    for dash in dashes:
        p = dash.points
        lengths += 2 * [float(arc_lengths(p)[-1])]
        for end, inner in ((p[0], p[1]), (p[-1], p[-2])):
            points.append(end)
            out.append((end - inner) / max(float(np.linalg.norm(end - inner)), 1e-300))
    return _Ends(np.array(points), np.array(out), np.array(lengths))


def _meeting(ends: _Ends, numbers: Sequence[int], tree: STRtree, near: float) -> Ints:
    """Numbers of the ends that lie on another line than their own, `numbers` (n,): no gap begins there."""
    import shapely

    at, on = tree.query(shapely.points(ends.points), predicate="dwithin", distance=near)
    return np.unique(at[on != np.asarray(numbers)[at // 2]])


def _links(ends: _Ends, meeting: Ints, near: float) -> Ints:
    """(2 n,) the end on the other side of the gap after each end, -1 where there is none; links are mutual."""
    from scipy.spatial import cKDTree

    count = len(ends.points)
    best = np.full(count, -1)
    free = np.setdiff1d(np.arange(count), meeting)
    if not len(free):
        return best
    tree = cKDTree(ends.points[free])
    for first in range(0, len(free), CHUNK):  # rows of a scribble see each other: not all pairs at once
        some = free[first : first + CHUNK]
        balls = tree.query_ball_point(ends.points[some], LONGEST_GAP * ends.lengths[some])
        end = np.repeat(some, [len(ball) for ball in balls])
        other = free[np.concatenate([np.asarray(ball, dtype=np.int64) for ball in balls])]
        gap = ends.points[other] - ends.points[end]
        size = np.linalg.norm(gap, axis=1)
        ahead = np.einsum("ij,ij->i", gap, ends.out[end]) > STRAIGHT * size
        facing = -np.einsum("ij,ij->i", gap, ends.out[other]) > STRAIGHT * size
        fits = (other // 2 != end // 2) & (size > near) & ahead & facing
        end, other, size = end[fits], other[fits], size[fits]
        order = np.lexsort((size, end))[::-1]  # the nearest is written last
        best[end[order]] = other[order]
    mutual = (best >= 0) & (best[best] == np.arange(count))
    return np.where(mutual, best, -1)
