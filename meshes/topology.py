"""Edges, hinges and boundary of a triangulated sheet."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from meshes.errors import MeshError

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Topology:
    """Connectivity that is derived from the triangles alone.

    Attributes:
        edges: (e, 2) node pairs, each with its smaller node first, sorted.
        edge_triangles: (e, 2) the triangles on both sides; -1 in the second column on the boundary.
        hinges: (m, 4) rows (wing, edge, edge, wing), one for each interior edge. The first triangle runs
            edge -> edge counter-clockwise, so that the dihedral angle is measured on the side away from the
            triangles' normals (below a sheet that is meshed counter-clockwise).
        hinge_edges: (m,) index into `edges` for each hinge.
        triangle_edges: (t, 3) index into `edges` of the edge opposite each triangle corner.
    """

    edges: Ints
    edge_triangles: Ints
    hinges: Ints
    hinge_edges: Ints
    triangle_edges: Ints

    def find_edges(self, pairs: Ints) -> Ints:
        """Index into `edges` of each node pair (k, 2), in either order.

        Raises:
            MeshError: a pair is not an edge of the mesh.
        """
        pairs = np.sort(np.asarray(pairs, dtype=np.int64).reshape(-1, 2), axis=1)
        stride = int(self.edges.max(initial=0)) + 1
        keys = self.edges[:, 0] * stride + self.edges[:, 1]
        wanted = pairs[:, 0] * stride + pairs[:, 1]
        found = np.searchsorted(keys, wanted)
        found_safe = np.minimum(found, len(keys) - 1)
        wrong = (keys[found_safe] != wanted) | (pairs[:, 1] >= stride)
        if wrong.any():
            a, b = pairs[int(np.argmax(wrong))]
            raise MeshError(f"nodes {a} and {b} are not joined by an edge of the mesh; mesh along that line")
        return found

    @cached_property
    def edge_hinges(self) -> Ints:
        """(e,) row of `hinges` of every edge, -1 on the boundary."""
        rows = np.full(len(self.edges), -1, dtype=np.int64)
        rows[self.hinge_edges] = np.arange(len(self.hinges))
        return rows

    @property
    def boundary(self) -> Ints:
        """(b, 2) boundary edges as node pairs, the smaller node first."""
        return self.edges[self.edge_triangles[:, 1] < 0]


def build(triangles: Ints, nodes: int) -> Topology:
    """Topology of (t, 3) `triangles` on `nodes` nodes.

    Args:
        triangles: (t, 3) node numbers.
        nodes: how many nodes there are.

    Raises:
        MeshError: an index is out of range, a triangle repeats a node, an edge has more than two triangles
            (non-manifold) or neighbouring triangles are oriented against each other.
    """
    triangles = np.asarray(triangles, dtype=np.int64)
    if triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) == 0:
        raise MeshError("the mesh has no triangles; give an array (t, 3) of node indices")
    bad = (triangles < 0) | (triangles >= nodes)
    if bad.any():
        row = int(np.argmax(bad.any(axis=1)))
        raise MeshError(
            f"triangle {row} names a node outside 0..{nodes - 1}; mend its indices {triangles[row]}"
        )
    if (triangles == np.roll(triangles, 1, axis=1)).any():
        row = int(np.argmax((triangles == np.roll(triangles, 1, axis=1)).any(axis=1)))
        raise MeshError(f"triangle {row} uses a node twice ({triangles[row]}); remove it")

    # directed edge k of a triangle lies opposite its corner k
    tail, head = np.roll(triangles, -1, axis=1), np.roll(triangles, -2, axis=1)
    low, high = np.minimum(tail, head).ravel(), np.maximum(tail, head).ravel()
    keys = low * nodes + high
    _, first, inverse, counts = np.unique(keys, return_index=True, return_inverse=True, return_counts=True)
    edges = np.column_stack((low[first], high[first]))
    if (counts > 2).any():
        a, b = edges[int(np.argmax(counts > 2))]
        raise MeshError(
            f"edge {a}-{b} has {counts.max()} triangles (non-manifold); a sheet has one or two an edge"
        )

    triangle_edges = inverse.reshape(triangles.shape)
    order = np.argsort(inverse, kind="stable")
    start = np.concatenate(([0], np.cumsum(counts)[:-1]))
    half_1 = order[start]
    inner = np.flatnonzero(counts == 2)
    half_2 = np.full(len(edges), -1, dtype=np.int64)
    half_2[inner] = order[start[inner] + 1]
    tails, heads, corners = tail.ravel(), head.ravel(), triangles.ravel()
    same = tails[half_1[inner]] == tails[half_2[inner]]
    if same.any():
        a, b = edges[inner[int(np.argmax(same))]]
        raise MeshError(
            f"the triangles at edge {a}-{b} are oriented against each other; turn one of them round"
        )

    # the lower-numbered triangle gives the direction; half-edge 3 t + k belongs to triangle t
    one, two = half_1[inner], half_2[inner]
    hinges = np.column_stack((corners[one], tails[one], heads[one], corners[two]))
    edge_triangles = np.full((len(edges), 2), -1, dtype=np.int64)
    edge_triangles[:, 0] = half_1 // 3
    edge_triangles[inner, 1] = two // 3
    return Topology(edges, edge_triangles, hinges, inner, triangle_edges)


def dihedral_angles(points: NDArray[np.float64], hinges: Ints) -> NDArray[np.float64]:
    """(m,) dihedral angles of `hinges` (m, 4) with nodes at `points` (n, 3), rad in [0, 2 pi); flat is pi exactly.

    Args:
        points: (n, 3) node positions, in any unit.
        hinges: (m, 4) rows (wing, edge, edge, wing).

    Returns:
        (m,) angles on the side away from the triangles' normals, rad in [0, 2 pi); flat is pi exactly.
    """
    wing, tail, head, other = (points[hinges[:, k]] for k in range(4))
    edge = head - tail
    one, two = np.cross(edge, wing - tail), np.cross(other - tail, edge)
    sine = np.linalg.norm(edge, axis=1) * np.einsum("mi,mi->m", one, other - tail)
    turn = np.arctan2(sine, np.einsum("mi,mi->m", one, two))
    return np.asarray(np.mod(np.pi + turn, 2.0 * np.pi))


def boundary_loops(topology: Topology) -> list[Ints]:
    """The boundary as closed loops of nodes, longest first.

    Returns:
        Node numbers of every loop; the last one is joined to the first.

    Raises:
        MeshError: the boundary touches itself at a node, so that loops cannot be told apart.
    """
    neighbours: dict[int, list[int]] = {}
    for a, b in topology.boundary.tolist():
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    for node, ends in neighbours.items():
        if len(ends) != 2:
            raise MeshError(f"the boundary touches itself at node {node}; split the node")
    loops: list[Ints] = []
    seen: set[int] = set()
    for begin in neighbours:
        if begin in seen:
            continue
        loop, previous, node = [begin], -1, begin
        while True:
            a, b = neighbours[node]
            following = a if a != previous else b
            if following == begin:
                break
            loop.append(following)
            previous, node = node, following
        seen.update(loop)
        loops.append(np.asarray(loop, dtype=np.int64))
    return sorted(loops, key=len, reverse=True)


def chain_nodes(pairs: Ints) -> Ints:
    """Nodes of a chain of edges in order; of one that closes the first is repeated last.

    Args:
        pairs: (k, 2) nodes of the edges, each beginning where the one before ends.

    Returns:
        (k + 1,) node numbers.
    """
    return np.append(pairs[:, 0], pairs[-1, 1])
