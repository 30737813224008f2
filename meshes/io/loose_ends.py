"""Lines that end inside a face of a plane graph: tied to its rim by facet lines, so that it is cut into plain faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from meshes.curves import Array
from meshes.errors import FileFormatError
from meshes.io.fold_frame import Frame, Side, side
from meshes.limits import check_limit
from meshes.topology import Ints

AT_ONCE = 64  # ways that are looked along together
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
    check_limit("loose_ends", len(ends), "this drawing", FileFormatError)
    part = _parts(frame.edges, len(xy))
    used = np.unique(frame.edges)
    rim = {part[a] for (a, _), letter in zip(frame.edges, frame.letters, strict=True) if letter == "B"}
    anchored = np.isin(part[used], list(rim) or part[used])
    sight = _Sight(xy, frame.edges)
    before = {v: a + b - v for a, b in reversed(frame.edges) for v in (a, b)}
    tied: dict[int, set[int]] = {}  # by part, both ends of its ties
    waiting = ends
    while waiting:
        left = []
        for end in waiting:
            if end in sight.tied:
                continue
            own = set() if part[end] in rim else tied.get(int(part[end]), set())
            other = _where(xy, end, before[end], used[anchored], sight, own)
            if other is None:
                left.append(end)
                continue
            sight.add(side(end, other))
            for v in (end, other):
                tied.setdefault(int(part[v]), set()).update((end, other))
        done = {part[end] for end in ends} - {part[end] for end in left}
        anchored |= np.isin(part[used], list(done))
        if len(left) == len(waiting):
            break
        waiting = left
    return sight.added


def _where(xy: Array, end: int, before: int, others: Ints, sight: _Sight, avoid: set[int]) -> int | None:
    """The nearest of other vertices that a loose end sees.

    If it can be helped it is none of `avoid`, to which other ends of the same lines are tied, nor lies back along them,
    towards the vertex `before`.
    """
    away = xy[others] - xy[end]
    along = xy[before] - xy[end]
    order = np.argsort((away**2).sum(axis=1), kind="stable")
    back = away @ along > BACK * np.linalg.norm(away, axis=1) * np.linalg.norm(along)
    good = (~back & ~np.isin(others, list(avoid)))[order]
    nearest = others[order]
    found = sight.first(end, nearest[good])
    return sight.first(end, nearest[~good]) if found is None else found


class _Sight:
    """What is seen from a vertex past the edges of a frame and the ties that were added to it."""

    def __init__(self, xy: Array, edges: list[Side]) -> None:
        import shapely

        self.xy, self.edges = xy, np.array(edges)
        self.tree = shapely.STRtree(shapely.linestrings(xy[self.edges]))
        self.joined = {side(*edge) for edge in edges}
        self.added: list[Side] = []
        self.tied: set[int] = set()  # ends of ties
        self.ties = shapely.STRtree([])  # of the added edges

    def add(self, pair: Side) -> None:
        """One more tie."""
        import shapely

        self.added.append(pair)
        self.joined.add(pair)
        self.tied.update(pair)
        self.ties = shapely.STRtree(shapely.linestrings(self.xy[np.array(self.added)]))

    def first(self, end: int, others: Ints) -> int | None:
        """The first of some vertices to which a tie from an end meets no line but at its own ends."""
        import shapely

        others = np.array(
            [v for v in others.tolist() if v != end and side(end, v) not in self.joined], dtype=int
        )
        for start in range(0, len(others), AT_ONCE):
            some = others[start : start + AT_ONCE]
            ways = shapely.linestrings(
                np.stack((np.broadcast_to(self.xy[end], (len(some), 2)), self.xy[some]), axis=1)
            )
            far = 1e-9 * shapely.length(ways)
            free = np.arange(len(some))
            for tree, lines in ((self.tree, self.edges), (self.ties, np.array(self.added, dtype=int))):
                way, line = tree.query(ways[free], predicate="dwithin", distance=far[free])
                met = way[self._in_the_way(end, some[free[way]], lines[line].reshape(-1, 2))]
                free = np.delete(free, np.unique(met))
            if len(free):
                return int(some[free[0]])
        return None

    def _in_the_way(self, end: int, others: Ints, segments: Ints) -> NDArray[np.bool_]:
        """(m,) which segments (m, 2) that a tie from an end to another vertex (m,) touches are in its way.

        All are but those that leave one of its ends in another direction.
        """
        own = (segments == end).any(axis=1)
        shared = own | (segments == others[:, None]).any(axis=1)
        at = np.where(own, end, others)
        a = self.xy[end + others - at] - self.xy[at]
        b = self.xy[np.where(shared, segments.sum(axis=1) - at, at)] - self.xy[at]
        flat = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) <= 1e-9 * np.linalg.norm(
            a, axis=1
        ) * np.linalg.norm(b, axis=1)
        found: NDArray[np.bool_] = ~shared | (flat & ((a * b).sum(axis=1) > 0.0))
        return found


def _parts(edges: list[Side], count: int) -> Ints:
    """(count,) which vertices hang together, by a number for each such part."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    one, two = np.array(edges).T
    graph = coo_array((np.ones(len(one)), (one, two)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
