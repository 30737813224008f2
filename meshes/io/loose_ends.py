"""Lines that end inside a face of a plane graph: tied to its rim by facet lines, so that it is cut into plain faces."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from meshes.curves import Array
from meshes.io.fold_frame import Frame, Side, side
from meshes.topology import Ints

BACK = 0.87  # cosine of the angle, 30 degrees, within which a tie would run back along its line


def tie_ends(frame: Frame, kinds: str = "C") -> Frame:
    """The frame with a flat edge (F) from every loose end of its cuts to the nearest vertex that it sees.

    Args:
        frame: flat, without faces.
        kinds: letters of the edges whose loose ends are tied.
    """
    if not set(kinds) & set(frame.letters) or not frame.flat:
        return frame

    xy = frame.points[:, :2]
    edges, letters = frame.edges, frame.letters
    degree = np.bincount(np.ravel(edges), minlength=len(xy))
    ends = [
        v
        for edge, letter in zip(edges, letters, strict=True)
        if letter in kinds
        for v in edge
        if degree[v] == 1
    ]
    added = _ties(xy, frame, [end for end in dict.fromkeys(ends) if degree[end] == 1])
    if not added:
        return frame
    angles = None if frame.angles is None else [*frame.angles, *(0.0 for _ in added)]
    return replace(frame, edges=edges + added, letters=letters + ["F"] * len(added), angles=angles)


def _ties(xy: Array, frame: Frame, ends: list[int]) -> list[Side]:
    """Edges from loose ends to vertices that hang together with the rim, so that no part hangs by one of them alone."""
    import shapely

    tree = shapely.STRtree(shapely.linestrings(xy[np.array(frame.edges)]))
    part = _parts(frame.edges, len(xy))
    used = np.unique(frame.edges)
    rim = [part[a] for (a, _), letter in zip(frame.edges, frame.letters, strict=True) if letter == "B"]
    anchored = np.isin(part[used], rim or part[used])
    added: list[Side] = []
    waiting = ends
    while waiting:
        left = []
        for end in waiting:
            if any(end in pair for pair in added):
                continue
            own = {v for pair in added if part[end] in part[list(pair)] for v in pair if part[end] not in rim}
            other = _where(xy, end, used[anchored], frame, added, tree, own)
            if other is None:
                left.append(end)
            else:
                added.append(side(end, other))
        done = {part[end] for end in ends} - {part[end] for end in left}
        anchored |= np.isin(part[used], list(done))
        if len(left) == len(waiting):
            break
        waiting = left
    return added


def _where(
    xy: Array, end: int, others: Ints, frame: Frame, added: list[Side], tree: Any, avoid: set[int]
) -> int | None:
    """The nearest of other vertices that a loose end sees.

    If it can be helped it is none of `avoid`, to which other ends of the same lines are tied, nor lies back along them.
    """
    before = next(sum(edge) - end for edge in frame.edges if end in edge)
    nearest = others[np.argsort(((xy[others] - xy[end]) ** 2).sum(axis=1), kind="stable")]
    joined = {side(*edge) for edge in (*frame.edges, *added)}
    along = xy[before] - xy[end]
    for fresh in (True, False):
        for other in nearest.tolist():
            away = xy[other] - xy[end]
            back = away @ along > BACK * np.linalg.norm(away) * np.linalg.norm(along)
            good = not back and other not in avoid
            pair = side(end, other)
            if other == end or good != fresh or pair in joined:
                continue
            if _sees(xy, pair, frame.edges, tree, added):
                return int(other)
    return None


def _parts(edges: list[Side], count: int) -> Ints:
    """(count,) which vertices hang together, by a number for each such part."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    one, two = np.array(edges).T
    graph = coo_array((np.ones(len(one)), (one, two)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _sees(xy: Array, pair: Side, edges: list[Side], tree: Any, added: list[Side]) -> bool:
    """Whether the segment between two vertices meets no line but at their own ends there."""
    import shapely

    line = shapely.LineString(xy[list(pair)])
    near = tree.query(line, predicate="dwithin", distance=1e-9 * line.length)
    for other in [*(edges[k] for k in near.tolist()), *added]:
        shared = set(other) & set(pair)
        segment = shapely.LineString(xy[list(other)])
        if not shared:
            if segment.distance(line) <= 1e-9 * line.length:
                return False
            continue
        # two that share an end must not lie over each other
        at = next(iter(shared))
        a = xy[sum(pair) - at] - xy[at]
        b = xy[sum(other) - at] - xy[at]
        if abs(a[0] * b[1] - a[1] * b[0]) <= 1e-9 * np.linalg.norm(a) * np.linalg.norm(b) and a @ b > 0.0:
            return False
    return True
