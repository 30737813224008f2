"""Drawn lines made one plane graph: ends joined, T-junctions and crossings given a node, gaps healed. mm.

Points that stand out (ends and corners of lines) within `gap` of each other become one node, the first drawn; a node
within `gap` of a line becomes a node of that line, and moves onto it if it is the end of others; where lines cross
without a node they get one. Nothing moves by much more than `gap`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from meshes.curves import Array, arc_lengths
from meshes.drawn_curves import Chain
from meshes.errors import PatternError
from meshes.limits import check_limit
from meshes.topology import Ints

CORNER = 0.35  # rad; a line that turns by more at a vertex has a corner there
CHUNK = 8  # segments whose crossings are counted at a time: the first ones of a scribble decide
ROUNDS = 4  # of crossings that show when lines have been moved
# what wins where lines are drawn over each other
RANK = ("boundary", "cut", "mountain", "valley", "flat", "facet")
RIM = ("boundary", "cut")
FOLDED = ("mountain", "valley")
STARTS, ENDS = slice(None, -1), slice(1, None)  # of the segments of a line's vertices


@dataclass(frozen=True)
class DrawnLine:
    """A line of a drawing, in mm.

    Attributes:
        points: (k, 2), mm.
        kind: what it stands for, one of `RANK`.
        name: for messages.
        angle: drawn fold angle, rad, or nan.
        curve: what the points were taken from, mm; None for these points themselves.
        layer: the name of its layer in the drawing, or "".
    """

    points: Array
    kind: str
    name: str
    angle: float = float("nan")
    curve: Chain | None = None
    layer: str = ""


@dataclass(frozen=True)
class Graph:
    """A plane graph.

    Attributes:
        points: (n, 2) nodes, mm.
        edges: (e, 2) node numbers.
        kinds: of the edges, each one of `RANK`.
        lines: of every edge the number of its line.
        joined: how many ends were moved.
        gap: the distance that did it, mm.
        remarks: lines of both folds that lie over each other, and which of them was taken; one line each.
        origin: of one sheet out of several: the place in the drawing, mm, that its own origin is.
        scale: of one sheet out of several: how much larger it is than in the drawing.
    """

    points: Array
    edges: Ints
    kinds: tuple[str, ...]
    lines: tuple[int, ...]
    joined: int
    gap: float
    remarks: tuple[str, ...] = ()
    origin: tuple[float, float] = (0.0, 0.0)
    scale: float = 1.0

    def select(self, kinds: Sequence[str]) -> Ints:
        """Numbers of the edges of some kinds, rising.

        Returns:
            (k,) numbers.
        """
        return np.flatnonzero([kind in kinds for kind in self.kinds])


def corners(points: Array, closed: bool = False) -> NDArray[np.bool_]:
    """Where a polyline turns by more than `CORNER`.

    Args:
        points: (k, 2) vertices, mm.
        closed: the last vertex repeats the first one, which can then be a corner too.

    Returns:
        (k,) truth values; the ends of an open line are no corners.
    """
    steps = np.diff(points, axis=0)
    heading = np.arctan2(steps[:, 1], steps[:, 0])
    turn = np.abs((np.diff(heading) + np.pi) % (2.0 * np.pi) - np.pi)
    found = np.zeros(len(points), dtype=bool)
    found[1:-1] = turn > CORNER
    if closed and len(points) > 2:
        around = abs((heading[0] - heading[-1] + np.pi) % (2.0 * np.pi) - np.pi)
        found[0] = found[-1] = around > CORNER
    return found


def heal(lines: Sequence[DrawnLine], gap: float) -> Graph:
    """The plane graph of some lines.

    Args:
        lines: with two points or more each, mm.
        gap: what misses by up to so much is joined, mm.

    Raises:
        PatternError: lines do not come apart within the tolerance.
    """
    web = _Web(lines, gap)
    web.attach(range(len(web.nodes)))
    for _ in range(ROUNDS):
        fresh = web.cross()
        if not fresh:
            return web.graph()
        web.attach(fresh)
    x, y = web.nodes[fresh[0]]
    raise PatternError(
        f"lines near ({x:.6g}, {y:.6g}) run together and cross within gap = {gap:.3g} mm; "
        "draw them once, or choose a smaller gap"
    )


def check_crossings(ends: Array) -> None:
    """Refuse a scribble before anything is made of it; counts no further than the limit.

    Args:
        ends: (n, 4) of segments, x and y of the first and of the second point, in any unit.

    Raises:
        PatternError: more of them cross than may; segments that only touch do not.
    """
    import shapely

    segments = shapely.linestrings(ends.reshape(-1, 2, 2))
    tree = shapely.STRtree(segments)
    found = 0.0
    for first in range(0, len(segments), CHUNK):
        found += 0.5 * len(tree.query(segments[first : first + CHUNK], predicate="crosses")[0])
        check_limit("crossings", found, "this drawing", PatternError)


class _Web:
    """Lines as sequences of vertices (place along the line, node or -1 for a vertex that only shapes it)."""

    def __init__(self, lines: Sequence[DrawnLine], gap: float) -> None:
        import shapely

        self.lines = list(lines)
        self.gap = gap
        self.along = [arc_lengths(line.points) for line in self.lines]
        self.marks: list[dict[float, int]] = [{} for _ in self.lines]  # place along the line: node
        self.on: list[set[int]] = [set() for _ in self.lines]  # nodes of the line
        self.shapes = np.array([shapely.LineString(line.points) for line in self.lines], dtype=object)
        self.nodes: list[tuple[float, float]] = []
        self.moved = 0
        self.conflicts: dict[tuple[int, int], str] = {}
        self._join_ends()

    def _join_ends(self) -> None:
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components
        from scipy.spatial import cKDTree

        owner: list[tuple[int, float]] = []
        places: list[Array] = []
        for number, line in enumerate(self.lines):
            turns = np.flatnonzero(corners(line.points)).tolist() if len(line.points) > 2 else []
            for k in (0, *turns, len(line.points) - 1):
                owner.append((number, float(self.along[number][k])))
                places.append(line.points[k])
        points = np.array(places)
        pairs = cKDTree(points).query_pairs(self.gap, output_type="ndarray")
        count = len(points)
        near = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
        _, group = connected_components(near, directed=False)
        first: dict[int, int] = {}
        for (number, at), point, label in zip(owner, points, group.tolist(), strict=True):
            if label not in first:
                first[label] = self._new(point)
            node = first[label]
            self.moved += bool(np.any(point != self.nodes[node]))
            self._mark(number, at, node)
        self._hard = [(point, first[label]) for point, label in zip(points, group.tolist(), strict=True)]

    def _new(self, point: Sequence[float] | Array) -> int:
        self.nodes.append((float(point[0]), float(point[1])))
        return len(self.nodes) - 1

    def attach(self, nodes: Sequence[int]) -> None:
        """Nodes that lie on lines, or nearly, become nodes of these lines."""
        import shapely

        wanted = set(nodes)
        spots = [(point, node) for point, node in self._hard if node in wanted]
        spots += [(np.array(self.nodes[node]), node) for node in nodes]
        tree = shapely.STRtree(self.shapes)
        points = shapely.points(np.array([point for point, _ in spots]))
        at, on = tree.query(points, predicate="dwithin", distance=self.gap)
        places = shapely.line_locate_point(self.shapes[on], points[at])
        hosts: dict[int, dict[int, float]] = {}
        for spot, number, place in zip(at.tolist(), on.tolist(), places.tolist(), strict=True):
            node = spots[spot][1]
            if node not in self.on[number]:
                hosts.setdefault(node, {}).setdefault(number, place)
        rims = [k for k, line in enumerate(self.lines) if line.kind in RIM]
        fixed = set().union(*(self.on[k] for k in rims))
        for node, met in hosts.items():
            self._move(node, met, node in fixed)
            for number, place in met.items():
                self.moved += 1
                self._mark(number, self._free(number, place), node)

    def _mark(self, number: int, place: float, node: int) -> None:
        self.marks[number][place] = node
        self.on[number].add(node)

    def _move(self, node: int, met: dict[int, float], fixed: bool) -> None:
        """A T-junction: the end of a line goes to the line that it meets, so that this one stays straight."""
        import shapely

        if len(met) != 1:
            return
        ((number, place),) = met.items()
        if self.lines[number].kind in RIM or not fixed:
            point = shapely.line_interpolate_point(self.shapes[number], place)
            self.nodes[node] = (float(point.x), float(point.y))

    def _free(self, number: int, place: float) -> float:
        """A place along a line that no other node has."""
        while place in self.marks[number]:
            place = float(np.nextafter(place, np.inf))
        return place

    def chain(self, number: int) -> tuple[Array, list[int], list[float]]:
        """Vertices (k, 2) of a line, their nodes (-1: none) and places; none shapes the line next to a node."""
        marks = sorted(self.marks[number].items())
        points = self.lines[number].points
        taken = np.array([-np.inf, *(place for place, _ in marks), np.inf])
        along = self.along[number]
        after = np.searchsorted(taken, along)
        alone = np.minimum(along - taken[after - 1], taken[after] - along) > self.gap
        vertices = [(place, node, self.nodes[node]) for place, node in marks]
        vertices += [(float(along[k]), -1, tuple(points[k].tolist())) for k in np.flatnonzero(alone).tolist()]
        vertices.sort(key=lambda vertex: vertex[0])
        places = [place for place, _, _ in vertices]
        return np.array([p for _, _, p in vertices]), [node for _, node, _ in vertices], places

    def cross(self) -> list[int]:
        """Give crossings without a node one; returns the new nodes."""
        import shapely

        chains = [self.chain(number) for number in range(len(self.lines))]
        a, b = (np.vstack([points[part] for points, _, _ in chains]) for part in (STARTS, ENDS))
        low, high = (np.concatenate([places[part] for _, _, places in chains]) for part in (STARTS, ENDS))
        ids = np.array([pair for _, nodes, _ in chains for pair in pairwise(nodes)])
        number = np.repeat(np.arange(len(chains)), [len(nodes) - 1 for _, nodes, _ in chains])
        tree = shapely.STRtree(shapely.linestrings(np.stack((a, b), axis=1)))
        one, two = tree.query(tree.geometries, predicate="intersects")
        shared = (ids[one][:, :, None] == ids[two][:, None, :]) & (ids[one][:, :, None] >= 0)
        next_ = (number[one] == number[two]) & (np.abs(one - two) == 1)
        apart = (one < two) & ~next_ & ~shared.any(axis=(1, 2))
        one, two = one[apart], two[apart]
        s, t, meet = _meetings(a[one], b[one], a[two], b[two])
        one, two, s, t = one[meet], two[meet], s[meet], t[meet]
        nodes = self._nodes_at(a[one] + s[:, None] * (b[one] - a[one]))
        for segments, part in ((one, s), (two, t)):
            places = low[segments] + part * (high - low)[segments]
            for line, place, node in zip(number[segments].tolist(), places.tolist(), nodes, strict=True):
                if node not in self.on[line]:
                    self._mark(line, self._free(line, place), node)
        return list(dict.fromkeys(nodes))

    def _nodes_at(self, points: Array) -> list[int]:
        """Of each of (k, 2) crossings the nearest node within the gap, or a new one."""
        from scipy.spatial import cKDTree

        away, nearest = cKDTree(np.array(self.nodes)).query(points) if len(points) else ((), ())
        cells: dict[tuple[int, int], list[int]] = {}  # one gap wide: the new nodes in them
        found: list[int] = []
        for point, old, off in zip(points.tolist(), nearest, away, strict=True):
            x, y = (math.floor(c / self.gap) for c in point)
            near = [n for i in (x - 1, x, x + 1) for j in (y - 1, y, y + 1) for n in cells.get((i, j), ())]
            best, distance = int(old), float(off)
            for node in near:
                if (d := math.dist(self.nodes[node], point)) < distance:
                    best, distance = node, d
            if distance > self.gap:
                best = self._new(point)
                cells.setdefault((x, y), []).append(best)
            found.append(best)
        return found

    def graph(self) -> Graph:
        points: list[tuple[float, float]] = list(self.nodes)
        shaping: dict[tuple[int, int], int] = {}  # curves that are drawn twice share their vertices too
        found: dict[tuple[int, int], tuple[str, int]] = {}
        for number, line in enumerate(self.lines):
            places, nodes, _ = self.chain(number)
            for k, node in enumerate(nodes):
                if node < 0:
                    key = (round(places[k, 0] / (0.01 * self.gap)), round(places[k, 1] / (0.01 * self.gap)))
                    if key not in shaping:
                        points.append((float(places[k, 0]), float(places[k, 1])))
                        shaping[key] = len(points) - 1
                    nodes[k] = shaping[key]
            for a, b in pairwise(nodes):
                if a != b:
                    self._put(found, (min(a, b), max(a, b)), line.kind, number, points)
        edges = np.array(list(found), dtype=np.int64).reshape(-1, 2)
        used, renumbered = np.unique(edges, return_inverse=True)
        return Graph(
            points=np.array(points).reshape(-1, 2)[used],
            edges=renumbered.reshape(-1, 2),
            kinds=tuple(kind for kind, _ in found.values()),
            lines=tuple(number for _, number in found.values()),
            joined=self.moved,
            gap=self.gap,
            remarks=tuple(self.conflicts.values()),
        )

    def _put(
        self,
        found: dict[tuple[int, int], tuple[str, int]],
        pair: tuple[int, int],
        kind: str,
        number: int,
        points: list[tuple[float, float]],
    ) -> None:
        """Remember an edge; of two lines over each other the more telling one stays, of two folds the upper one."""
        if pair not in found:
            found[pair] = kind, number
            return
        before, other = found[pair]
        if before != kind and before in FOLDED and kind in FOLDED:
            x, y = np.mean([points[pair[0]], points[pair[1]]], axis=0)
            self.conflicts.setdefault(
                (other, number),
                f"{self.lines[other].name} ({before}) and {self.lines[number].name} ({kind}) lie over each other at "
                f"({x:.6g}, {y:.6g}): taken as {kind}, which is drawn later; remove one of them if that is not meant",
            )
            found[pair] = kind, number
            return
        if RANK.index(kind) < RANK.index(before):
            found[pair] = kind, number


def _meetings(a: Array, b: Array, c: Array, d: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Parameters (k,) where segments a-b and c-d meet, (k, 2) each; whether they do, and are not parallel."""
    u, v, w = b - a, d - c, c - a
    cross = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    meet = np.abs(cross) > 1e-12 * np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1)
    over = np.where(meet, cross, 1.0)
    s = (w[:, 0] * v[:, 1] - w[:, 1] * v[:, 0]) / over
    t = (w[:, 0] * u[:, 1] - w[:, 1] * u[:, 0]) / over
    return np.clip(s, 0.0, 1.0), np.clip(t, 0.0, 1.0), meet
