"""Fans of triangles: a triangulation taken apart along some of its edges, on arrays alone.

Triangles round a node stay joined through the edges between them that are not cut; each fan of triangles that is left
gets a node of its own, all at the same place of the flat sheet. That alone is right for cuts that end inside the sheet
(one fan: the node at the tip stays one), on creases and on the outline (two), and for cuts that meet or cross (three,
four, ...). A piece within a closed cut falls out and leaves a hole.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshes.curves import Array
from meshes.errors import MeshError
from meshes.topology import Ints, Topology, build


@dataclass(frozen=True, eq=False)
class Opened:
    """A mesh whose cuts are open.

    Attributes:
        points: (n, 2 or 3) nodes, mm; those of the mesh with closed cuts first, then the copies.
        triangles: (t, 3) node numbers, the triangles in their order.
        place: (n,) the node of the mesh with closed cuts at the same place.
        closed: topology with closed cuts; its triangles are numbered as those here.
        cut: (e,) edges of `closed` that are cut.
        fallen: areas of the pieces that fell out, mm^2.
        number: (m,) of every node that was given its number in `closed`, -1 where it fell out.
        middles: the node put in the middle of a short cut, by its two ends (numbers given, the smaller first).
    """

    points: Array
    triangles: Ints
    place: Ints
    closed: Topology
    cut: NDArray[np.bool_]
    fallen: tuple[float, ...]
    number: Ints
    middles: Mapping[tuple[int, int], int]

    def pairs(self, pairs: Ints) -> Ints:
        """Edges of the open mesh for edges of the given one.

        Args:
            pairs: (k, 2) node pairs, numbers as they were given.

        Returns:
            (m, 2) node pairs in the same order; those of a cut twice: along its left side as the pairs run, then along
            its right side. Pairs of pieces that fell out are left out.
        """
        if self.middles:
            pairs = np.array(
                [half for pair in pairs.tolist() for half in self._halves(*pair)], dtype=np.int64
            )
        pairs = np.asarray(pairs, dtype=np.int64).reshape(-1, 2)
        pairs = self.number[pairs[self.left(pairs)]]
        edges = self.closed.find_edges(pairs)
        sides = self.closed.edge_triangles[edges].copy()
        # of a triangle on the left the second node of the pair comes after the first
        swap = ~self._runs(sides[:, 0], pairs) & (sides[:, 1] >= 0)
        sides[swap] = sides[swap][:, ::-1]
        both = self.cut[edges] & (sides[:, 1] >= 0)
        return np.vstack((self._at(sides[:, 0], pairs), self._at(sides[both, 1], pairs[both])))

    def left(self, pairs: Ints) -> NDArray[np.bool_]:
        """(k,) which of these edges (k, 2), numbers as they were given, did not fall out with a piece."""
        here = np.sort(self.number[np.asarray(pairs, dtype=np.int64)], axis=1)
        stride = len(self.points)
        # a crease across a piece that fell out may have both ends on the cut round it
        return (here[:, 0] >= 0) & np.isin(_keys(here, stride), _keys(self.closed.edges, stride))

    def edges_before(self, topology: Topology) -> Ints:
        """(e,) for every edge of the open mesh the edge of the given one (with its `topology`) in the same place.

        Raises:
            MeshError: a cut was so short that it got a node.
        """
        given = np.full(int(self.place.max()) + 1, -1, dtype=np.int64)
        there = np.flatnonzero(self.number >= 0)
        given[self.number[there]] = there
        open_edges = build(self.triangles, len(self.points)).edges
        if self.middles:
            raise MeshError("a cut is one edge of the mesh only, and could not open; use more cells along")
        return topology.find_edges(given[self.place[open_edges]])

    def _halves(self, a: int, b: int) -> list[tuple[int, int]]:
        middle = self.middles.get((min(a, b), max(a, b)))
        return [(a, b)] if middle is None else [(a, middle), (middle, b)]

    def _runs(self, triangle: Ints, pairs: Ints) -> NDArray[np.bool_]:
        """Whether triangles (k,) run from the first node of pairs (k, 2) to the second."""
        corner = self.place[self.triangles[triangle]]
        return np.asarray(
            ((corner == pairs[:, :1]) & (np.roll(corner, -1, axis=1) == pairs[:, 1:])).any(axis=1)
        )

    def _at(self, triangle: Ints, pairs: Ints) -> Ints:
        """(k, 2) nodes that triangles (k,) have at the places of pairs (k, 2)."""
        own = self.triangles[triangle]
        found = [own[self.place[own] == pairs[:, k, None]] for k in range(2)]
        return np.column_stack(found).reshape(-1, 2)


def take_apart(points: Array, triangles: Ints, cuts: Ints) -> Opened:
    """Open a mesh along some of its edges.

    A cut of one edge with both ends inside the sheet gets a node in its middle, without which it could not open. Pieces
    that reach the outside of the sheet stay, others fall out.

    Args:
        points: (n, 2 or 3) nodes, mm.
        triangles: (t, 3) node numbers.
        cuts: (k, 2) node pairs, edges of the mesh; those on its rim are open already.

    Raises:
        MeshError: a pair is no edge of the mesh.
    """
    topology = build(triangles, len(points))
    cut = np.zeros(len(topology.edges), dtype=bool)
    cut[topology.find_edges(cuts)] = True
    points, triangles, middles = _bisected(points, triangles, topology, cut)
    count = len(points)
    if middles:
        pairs = [tuple(pair) for pair in topology.edges[cut].tolist()]
        parts = [
            part
            for a, b in pairs
            for part in ([(a, middles[a, b]), (middles[a, b], b)] if (a, b) in middles else [(a, b)])
        ]
        topology = build(triangles, count)
        cut = np.zeros(len(topology.edges), dtype=bool)
        cut[topology.find_edges(np.array(parts))] = True
    keep, fallen = _kept(points, triangles, topology, cut)
    number = np.arange(count)
    if fallen:
        pairs_left = topology.edges[cut]
        used = np.unique(triangles[keep])
        number = np.full(count, -1, dtype=np.int64)
        number[used] = np.arange(len(used))
        points, triangles = points[used], number[triangles[keep]]
        topology = build(triangles, len(points))
        pairs_left = number[pairs_left]
        # within a piece that fell out, or joining nodes that are left by no edge that is
        pairs_left = pairs_left[(pairs_left >= 0).all(axis=1)]
        cut = np.isin(_keys(topology.edges, len(points)), _keys(pairs_left, len(points)))
    opened, place = _doubled(triangles, topology, cut, len(points))
    return Opened(points[place], opened, place, topology, cut, fallen, number, middles)


def lips(points: Array, topology: Topology) -> list[Ints]:
    """Edges of the rim that lie in one place in the flat sheet, as the lips of a cut do.

    Args:
        points: (n, 3) nodes of the flat sheet, mm.
        topology: of the mesh.

    Returns:
        Numbers of the edges that lie in one place, of each such place two or more.
    """
    rim = np.flatnonzero(topology.edge_triangles[:, 1] < 0)
    spot = places(points)
    keys = _keys(np.sort(spot[topology.edges[rim]], axis=1), len(points))
    order = np.argsort(keys, kind="stable")
    groups = np.split(rim[order], np.flatnonzero(np.diff(keys[order])) + 1)
    return [group for group in groups if len(group) > 1]


def places(points: Array) -> Ints:
    """(n,) for every node the first one at exactly the same place of points (n, d): itself, but for copies at cuts."""
    _, first, inverse = np.unique(points, axis=0, return_index=True, return_inverse=True)
    return np.asarray(first[inverse.ravel()], dtype=np.int64)


def pieces(triangles: Ints, topology: Topology, cut: NDArray[np.bool_] | None = None) -> Ints:
    """(t,) number of the piece of the sheet that a triangle belongs to, pieces joined through edges that are not `cut`.

    Args:
        triangles: (t, 3) node numbers.
        topology: of these.
        cut: (e,) edges that join nothing; None for none.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    joined = topology.hinge_edges if cut is None else topology.hinge_edges[~cut[topology.hinge_edges]]
    one, two = topology.edge_triangles[joined].T
    graph = coo_array((np.ones(len(one)), (one, two)), shape=(len(triangles),) * 2)
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _keys(pairs: Ints, stride: int) -> Ints:
    return np.asarray(pairs[:, 0] * stride + pairs[:, 1], dtype=np.int64)


def _bisected(
    points: Array, triangles: Ints, topology: Topology, cut: NDArray[np.bool_]
) -> tuple[Array, Ints, dict[tuple[int, int], int]]:
    """The mesh with a node in the middle of cuts that are one edge with both ends inside the sheet."""
    degree = np.bincount(topology.edges[cut].ravel(), minlength=len(points))
    degree[np.unique(topology.boundary)] += 2
    short = cut & (topology.edge_triangles[:, 1] >= 0) & (degree[topology.edges] == 1).all(axis=1)
    if not short.any():
        return points, triangles, {}
    at = np.flatnonzero(short)
    new = len(points) + np.arange(len(at))
    middles = dict(zip(map(tuple, topology.edges[at].tolist()), new.tolist(), strict=True))
    rows = list(map(list, triangles.tolist()))
    for edge, node in zip(at.tolist(), new.tolist(), strict=True):
        for t in topology.edge_triangles[edge].tolist():
            # the edge lies opposite corner k; no triangle has two such edges, as they would share an end
            k = int(np.flatnonzero(topology.triangle_edges[t] == edge)[0])
            a, b, c = triangles[t, k], triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
            rows[t] = [a, b, node]
            rows.append([a, node, c])
    middle = points[topology.edges[at]].mean(axis=1)
    return np.vstack((points, middle)), np.array(rows, dtype=np.int64), middles


def _kept(
    points: Array, triangles: Ints, topology: Topology, cut: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], tuple[float, ...]]:
    """Which triangles belong to pieces that reach the outside of the sheet, and the areas of the other pieces."""
    piece = pieces(triangles, topology, cut)
    reach = np.zeros(piece.max() + 1, dtype=bool)
    reach[piece[topology.edge_triangles[_outside(points, topology), 0]]] = True
    keep = reach[piece]
    if keep.all():
        return keep, ()
    a, b, c = (points[triangles[:, k]] for k in range(3))
    u, v = b - a, c - a
    area = 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    if points.shape[1] == 3:
        area = 0.5 * np.linalg.norm(np.cross(u, v), axis=1)
    sums = np.bincount(piece, weights=area)
    return keep, tuple(sums[~reach].tolist())


def _outside(points: Array, topology: Topology) -> Ints:
    """Edges of the rim that surround the sheet: those joined to the node farthest to the left."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    rim = np.flatnonzero(topology.edge_triangles[:, 1] < 0)
    a, b = topology.edges[rim].T
    graph = coo_array((np.ones(len(rim)), (a, b)), shape=(len(points),) * 2)
    loop = connected_components(graph, directed=False)[1]
    return np.asarray(rim[loop[a] == loop[a[int(np.argmin(points[a, 0]))]]])


def _doubled(triangles: Ints, topology: Topology, cut: NDArray[np.bool_], count: int) -> tuple[Ints, Ints]:
    """Triangles (t, 3) on doubled nodes, and the place (n,) of every node; the first fan of a node keeps its number."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    joined = topology.hinge_edges[~cut[topology.hinge_edges]]
    rows: list[Ints] = []
    sides = topology.edge_triangles[joined]
    for end in range(2):  # corners of two triangles at one end of the edge between them are one
        node = topology.edges[joined, end, None]
        corners = [3 * sides[:, s] + (triangles[sides[:, s]] == node).argmax(axis=1) for s in range(2)]
        rows.append(np.column_stack(corners))
    one, two = np.vstack(rows).T
    size = triangles.size
    graph = coo_array((np.ones(len(one)), (one, two)), shape=(size, size))
    fans, fan = connected_components(graph, directed=False)
    _, first = np.unique(fan, return_index=True)
    node_of_fan = triangles.ravel()[first]
    order = np.lexsort((first, node_of_fan))
    lead = np.ones(fans, dtype=bool)
    lead[1:] = np.diff(node_of_fan[order]) != 0
    number = np.empty(fans, dtype=np.int64)
    number[order[lead]] = node_of_fan[order[lead]]
    copies = order[~lead]
    number[copies] = count + np.arange(len(copies))
    place = np.concatenate((np.arange(count), node_of_fan[copies]))
    return number[fan].reshape(-1, 3), place
