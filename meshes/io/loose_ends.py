"""Lines that end inside a face of a plane graph: tied to its rim by facet lines, so that it is cut into plain faces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from meshes.curves import Array
from meshes.io.fold_frame import Frame, Side, side


def tie_ends(frame: Frame, kinds: str = "C") -> Frame:
    """The frame with a flat edge (F) from every loose end of its cuts to the nearest vertex that it sees.

    Args:
        frame: flat, without faces.
        kinds: letters of the edges whose loose ends are tied.
    """
    if not set(kinds) & set(frame.letters) or not frame.flat:
        return frame
    import shapely

    xy = frame.points[:, :2]
    edges, letters = list(frame.edges), list(frame.letters)
    joined = {side(*edge) for edge in edges}
    degree = np.bincount(np.ravel(edges), minlength=len(xy))
    ends = [
        v
        for edge, letter in zip(edges, letters, strict=True)
        if letter in kinds
        for v in edge
        if degree[v] == 1
    ]
    used = np.unique(edges)
    lines = shapely.linestrings(xy[np.array(edges)])
    tree = shapely.STRtree(lines)
    added: list[Side] = []
    for end in ends:
        if degree[end] > 1:
            continue
        for other in _nearest(xy, used, end):
            pair = side(end, other)
            if other == end or pair in joined or not _sees(xy, pair, edges, tree, added):
                continue
            added.append(pair)
            joined.add(pair)
            degree[[end, other]] += 1
            break
    if not added:
        return frame
    angles = None if frame.angles is None else [*frame.angles, *(0.0 for _ in added)]
    return replace(frame, edges=edges + added, letters=letters + ["F"] * len(added), angles=angles)


def _nearest(xy: Array, used: Any, end: int) -> Iterator[int]:
    away = ((xy[used] - xy[end]) ** 2).sum(axis=1)
    yield from used[np.argsort(away, kind="stable")].tolist()


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
