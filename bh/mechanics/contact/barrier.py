"""Incremental potential contact between the panels of one sheet (Li et al. 2020; Li, Kaufman and Jiang 2021).

With d the distance of a node from a triangle, or of two edges, m the offset and h the reach (mm), the barrier

    b(d) = -kappa h ((d^2 - m^2) / (2 m h + h^2) - 1)^2 ln((d^2 - m^2) / (2 m h + h^2)),   m < d < m + h,

is zero beyond, has two continuous derivatives, and grows without bound as the surfaces meet. It acts between all parts
of the sheet that share no node, each with the area that belongs to it. The library `ipctk` finds the pairs, and gives
gradients, Hessians and continuous collision detection.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager

import ipctk
import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.mechanics.contact.detection import Detection
from bh.mechanics.shared.assembly import add_lower, rotate
from bh.mechanics.shared.kinematics import OPTIONS
from bh.mechanics.shared.sparsity import Slots
from bh.model.model import Model, drawn_flat
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
OFFSET, REACH = (
    0.985,
    0.02,
)  # of the thickness: layers rest between 0.985 and 1.005 of it apart, under light loads at the end
LOCAL = (
    4.0  # thicknesses along the flat sheet within which it does not meet itself: a hinge has no room for them
)
SLACK = 0.05  # of an edge that nodes move by while pairs are kept
NAMED = 3  # pairs in a message
# s of one core of 2.5 GHz: a search a triangle, detection and a look at the distance of a pair, and what a pair that
# presses takes for its part of gradient and Hessian
SEARCHED, DETECTED, PRESSED = 1.2e-6, 4e-7, 2e-6
MOST_KEPT = 2  # times as many pairs as there are now, for those of before to be kept in the pattern
ipctk.set_num_threads(1)  # sums in one order, so that the same input gives the same numbers


class SheetBarrier:
    """The barrier of a sheet; positions x are (n, 3), mm."""

    def __init__(self, mesh: SheetMesh, offset: float, reach: float, pressure: float) -> None:
        """Pairs that can meet.

        Args:
            mesh: the stress-free sheet.
            offset: distance m that is never gone below, mm; 0 for the middle surface itself.
            reach: how far beyond it the barrier acts, mm.
            pressure: kappa, N / mm^2.
        """
        self.offset, self.reach = offset, reach
        self.edges: Ints = mesh.topology.edges
        self.triangles = mesh.triangles
        self._mesh = ipctk.CollisionMesh(
            mesh.points, self.edges.astype(np.int32), mesh.triangles.astype(np.int32)
        )
        if offset > 0.0:
            near = _neighbours(mesh, LOCAL * (offset + reach))
            self._mesh.can_collide = ipctk.make_sparse_filter(dict.fromkeys(near, False), True)
        self._potential = ipctk.BarrierPotential(reach, pressure, True)
        slack = max(reach, SLACK * float(np.median(mesh_edges(mesh))))
        self._detection = Detection(self._mesh, offset, offset + reach, slack)
        self._last: tuple[Array, ipctk.NormalCollisions] | None = None
        self._asleep = False
        self._built = 0.0  # s for pairs that press

    @property
    def seconds(self) -> float:
        """What it has taken so far, s of one core of 2.5 GHz, counted by its work: the same on every machine."""
        found = self._detection
        return found.searches * SEARCHED * len(self.triangles) + found.looks * DETECTED + self._built

    def _intersects(self, x: Array) -> bool:
        self._detection.searches += 1
        return bool(ipctk.has_intersections(self._mesh, x))

    @contextmanager
    def asleep(self) -> Iterator[None]:
        """Stands in nobody's way and presses on nothing: a state is found first, and the way to it looked at then."""
        self._asleep = True
        try:
            yield
        finally:
            self._asleep = False

    def clear_ways(self, places: Sequence[Array]) -> float:
        """How many of the straight ways from place to place are clear; if all, motions are looked for from the last.

        Clear is a way on which no parts come within the reach of each other, so that nothing presses.

        Args:
            places: each (nodes, 3) positions, mm; the first is an accepted state.

        Returns:
            number of the ways, and a part of the one that is not clear.
        """
        for k, (x, moved) in enumerate(itertools.pairwise(places)):
            part = self._detection.free_part(x, moved, self.offset + self.reach)
            if part < 1.0:
                return k + part
        if self.presses(places[-1]):
            return len(places) - 2.0
        self._detection.begin(places[-1])
        return len(places) - 1.0

    def clear(self, x: Array) -> bool:
        """Is the sheet at positions x free of intersections, with layers farther apart than the offset?"""
        if self._intersects(x):
            return False
        return self.offset == 0.0 or self.distance(x) > self.offset

    def distance(self, x: Array) -> float:
        """Least distance of parts that can meet, mm; offset + reach where none are nearer."""
        pairs = self._pairs(x)
        if len(pairs) == 0:
            return self.offset + self.reach
        return float(np.sqrt(pairs.compute_minimum_distance(self._mesh, x)))

    def presses(self, x: Array) -> bool:
        """Are any parts within the reach of each other at positions x?"""
        return len(self._pairs(x)) > 0

    def forces(self, x: Array, f: Array) -> float:
        """Adds the gradient to f (n, 3), N, and returns the energy, N mm; inf where the sheet passes through itself.

        Args:
            x: (nodes, 3) positions, mm.
            f: (nodes, 3) N; the gradient is added where the energy is finite.
        """
        if not np.isfinite(x).all():
            return np.inf
        if self._asleep:
            return 0.0
        if not self._detection.linked(x) and self._intersects(x):
            return np.inf
        pairs = self._pairs(x)
        if len(pairs) == 0:
            return 0.0
        if self.offset > 0.0 and pairs.compute_minimum_distance(self._mesh, x) <= self.offset**2:
            return np.inf
        f += self._potential.gradient(pairs, self._mesh, x).reshape(-1, 3)
        return float(self._potential(pairs, self._mesh, x))

    def blocks(self, x: Array) -> tuple[Ints, Array]:
        """Hessian as pairs of nodes (p, 2), first one higher, and their matrices (p, 6, 6), N / mm, whose sum it is.

        Nodes of several pairs have their own 3 x 3 block in one of them only.
        """
        pairs = self._pairs(x)
        if len(pairs) == 0:
            return np.zeros((0, 2), dtype=np.int64), np.zeros((0, 6, 6))
        H = self._potential.hessian(pairs, self._mesh, x).tobsr(blocksize=(3, 3))
        row = np.repeat(np.arange(len(x)), np.diff(H.indptr))
        column = H.indices.astype(np.int64)
        below = row > column
        nodes = np.column_stack((row[below], column[below]))
        out = np.zeros((len(nodes), 6, 6))
        out[:, :3, 3:] = H.data[below]
        out[:, 3:, :3] = H.data[below].transpose(0, 2, 1)
        own = row == column
        home = {int(node): k for k, node in reversed(list(enumerate(nodes.ravel())))}
        for node, block in zip(row[own].tolist(), H.data[own], strict=True):
            k = home[node]
            at = 3 * (k % 2)
            out[k // 2, at : at + 3, at : at + 3] = block
        return nodes, out

    def pair_forces(self, x: Array) -> list[tuple[Ints, Array]]:
        """What each pair in contact does: its nodes (k,) and the forces (k, 3), N, that it puts on them; k is 2 to 4.

        The forces of a pair are in balance, and so are their moments.

        Args:
            x: (nodes, 3) positions, mm.
        """
        pairs, found = self._pairs(x), []
        edges, faces = self._mesh.edges, self._mesh.faces
        for k in range(len(pairs)):
            nodes = np.array([n for n in pairs[k].vertex_ids(edges, faces) if n >= 0], dtype=np.int64)
            gradient = np.asarray(self._potential.gradient(pairs[k], pairs[k].dof(x, edges, faces)))
            found.append((nodes, -gradient.reshape(-1, 3)[: len(nodes)]))
        return found

    def times(self, x: Array, v: Array) -> Array:
        """(n, 3) Hessian at x times v (n, 3).

        Args:
            x: (nodes, 3) positions, mm.
            v: (nodes, 3) velocities.
        """
        pairs = self._pairs(x)
        if len(pairs) == 0:
            return np.zeros_like(v)
        H = self._potential.hessian(pairs, self._mesh, x)
        return np.asarray(H @ v.ravel()).reshape(-1, 3)

    def free_part(self, x: Array, moved: Array) -> float:
        """How much of the straight way from x to `moved` nothing stands in, 0 to 1.

        Args:
            x: (nodes, 3) positions, mm, with nothing passing through anything.
            moved: (nodes, 3) positions, mm.
        """
        return 1.0 if self._asleep else self._detection.free_part(x, moved)

    def begin(self, x: Array) -> bool:
        """Whether the sheet is clear at x (`clear`), from where motions are looked for from now on.

        Args:
            x: (nodes, 3) positions, mm.
        """
        if not self.clear(x):
            return False
        self._detection.begin(x)
        return True

    def passed(self, x: Array, moved: Array) -> bool:
        """Whether no motion is known between two states of a path in which nothing passes through anything.

        Args:
            x: (nodes, 3) positions of an accepted state, mm.
            moved: (nodes, 3) positions of the next one, mm.
        """
        if self._asleep or self._detection.linked(moved):
            return False
        return not (self.clear(moved) and self.free_part(x, moved) >= 1.0)

    def approach(self, x: Array, moved: Array) -> float:
        """How much of the straight way from x to `moved` leads to where the first pair is half within the reach.

        Args:
            x: (nodes, 3) positions, mm, with nothing passing through anything.
            moved: (nodes, 3) positions, mm.
        """
        within, part = self.offset + 0.5 * self.reach, 0.0
        if self.distance(x) <= self.offset + 0.9 * self.reach:
            return 1.0
        for _ in range(3):  # additive detection stops short of what it sees
            at = x + part * (moved - x)
            if self.distance(at) <= self.offset + 0.9 * self.reach:
                break
            free = self._detection.free_part(at, moved, within)
            part += free * (1.0 - part)
            if free >= 1.0:
                return 1.0
        return part

    def meetings(self, x: Array, most: int = NAMED) -> str:
        """What intersects or lies within the offset at x, in words: the first `most` pairs, by their nodes.

        Args:
            x: (nodes, 3) positions, mm.
            most: pairs to name.
        """
        found = [f"edge {self._words(e)} and triangle {self._words(t)}" for e, t in self._crossings(x)]
        limit = self.offset**2
        for k in range(len(self._pairs(x)) if limit > 0.0 else 0):
            pair = self._pairs(x)[k]
            place = pair.dof(x, self._mesh.edges, self._mesh.faces)
            if pair.compute_distance(place) <= limit:
                nodes = [n for n in pair.vertex_ids(self._mesh.edges, self._mesh.faces) if n >= 0]
                found.append(f"nodes {self._words(nodes)}")
        more = f"; and {len(found) - most} more" if len(found) > most else ""
        return "; ".join(found[:most]) + more

    @staticmethod
    def _words(nodes: Iterable[int]) -> str:
        return "-".join(str(int(node)) for node in nodes)

    def _crossings(self, x: Array) -> list[tuple[Ints, Ints]]:
        """Edges (2,) and triangles (3,) without a common node that intersect at x."""
        near = ipctk.Candidates()
        near.build(self._mesh, x, 0.0)
        ends = {(int(c.edge0_id), int(c.edge1_id)) for c in near.ee_candidates}
        edges = sorted({edge for pair in ends for edge in pair})
        found = []
        for edge in edges:
            a, b = self.edges[edge]
            for triangle in self.triangles:
                if a in triangle or b in triangle:
                    continue
                if ipctk.is_edge_intersecting_triangle(x[a], x[b], *x[triangle]):
                    found.append((self.edges[edge], triangle))
        return found

    def _pairs(self, x: Array) -> ipctk.NormalCollisions:
        if self._asleep:
            return ipctk.NormalCollisions()
        # the same state is asked for its energy, its Hessian and its distance one after the other
        if self._last is not None and np.array_equal(self._last[0], x):
            return self._last[1]
        found = ipctk.NormalCollisions()
        found.use_area_weighting = True
        near = self._detection.candidates(x)
        found.build(near, self._mesh, x, self.reach, self.offset)
        self._built += len(near) * DETECTED + len(found) * PRESSED
        self._last = (x.copy(), found)
        return found


def mesh_edges(mesh: SheetMesh) -> Array:
    """(e,) lengths of the edges, mm."""
    ends = mesh.points[mesh.topology.edges]
    return np.asarray(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))


def _neighbours(mesh: SheetMesh, within: float) -> list[tuple[int, int]]:
    """Pairs (low, high) of nodes that are nearer than `within` in the sheet: as it lies flat, else along its edges."""
    if drawn_flat(mesh):
        from scipy.spatial import cKDTree

        return [(int(a), int(b)) for a, b in cKDTree(mesh.points).query_pairs(within)]
    import scipy.sparse as sp
    from scipy.sparse.csgraph import dijkstra

    a, b = mesh.topology.edges.T
    size = len(mesh.points)
    graph = sp.coo_array((mesh_edges(mesh), (a, b)), shape=(size, size))
    far = dijkstra(graph, directed=False, limit=within)
    low, high = np.nonzero(np.triu(np.isfinite(far), k=1))
    return list(zip(low.tolist(), high.tolist(), strict=True))


def sheet_barrier(model: Model) -> SheetBarrier:
    """The barrier that a model asks for (`Model.contact`).

    Args:
        model: with contact.

    Raises:
        ModelError: the thickness does not fit its mesh.
    """
    mesh, sheet = model.mesh, model.sheet
    lengths = mesh_edges(mesh)
    heights = 2.0 * mesh.areas / lengths[mesh.topology.triangle_edges].max(axis=1)
    thick = model.contact == "thickness"
    if thick and any(zone.sheet.t != sheet.t for zone in model.zones):
        raise ModelError("contact = thickness: zones have another thickness; give a gap in mm")
    offset = OFFSET * sheet.t if thick else 0.0
    reach = REACH * sheet.t if thick else float(model.contact)
    if offset + reach > heights.min():
        what = f"contact = {'thickness' if thick else format(reach, 'g')}"
        raise ModelError(
            f"{what}: layers {offset + reach:.4g} mm apart do not fit triangles {heights.min():.4g} mm high; "
            "give a smaller gap, or a coarser mesh"
        )
    # what bends a panel as wide as the sheet's mean edge is long flat: any pressure would do, this one is in the middle
    pressure = sheet.E * (sheet.t / float(np.median(lengths))) ** 3
    return SheetBarrier(mesh, offset, reach, pressure)


class ContactBlocks:
    """Where the Hessian of a barrier goes in the tangent: pairs of nodes, a new set only where a pair is new."""

    def __init__(self) -> None:
        """No pairs."""
        self.pairs: Ints = np.zeros((0, 2), dtype=np.int64)
        self._keys: Ints = np.zeros(0, dtype=np.int64)

    def known(self, pairs: Ints) -> bool:
        """Are all of these (p, 2) among the pairs? If not, they are now, with those of before unless they are many."""
        keys = _keys(pairs)
        if np.isin(keys, self._keys).all():
            return True
        if len(self.pairs) <= MOST_KEPT * len(pairs):  # pairs come and go: what was near will be near again
            keys = np.union1d(self._keys, keys)
            self.pairs, self._keys = np.column_stack((keys >> 31, keys & (2**31 - 1))), keys
        else:
            order = np.argsort(keys)
            self.pairs, self._keys = pairs[order], keys[order]
        return False

    def add(
        self, pairs: Ints, blocks: Array, frame_of: Ints, frames: Array, slots: Slots, data: Array
    ) -> None:
        """Adds the blocks (p, 6, 6) of pairs (p, 2) to the values `data`; `slots` are those of `self.pairs`.

        Args:
            pairs: (p, 2) nodes.
            blocks: (p, 6, 6) N / mm.
            frame_of: (nodes,) row of `frames` of each node, -1 where axes are global.
            frames: (k, 3, 3) axes of oblique supports.
            slots: of `self.pairs`.
            data: values of the matrix, N / mm; added to.
        """
        if len(pairs):
            rows = np.searchsorted(self._keys, _keys(pairs))
            _add_blocks(pairs, blocks, rows, frame_of, frames, slots, data)


def _keys(pairs: Ints) -> Ints:
    return np.asarray(pairs[:, 0] * 2**31 + pairs[:, 1])


@njit(**OPTIONS)
def _add_blocks(pairs, blocks, rows, frame_of, frames, slots, data):  # type: ignore[no-untyped-def]
    for k in range(len(pairs)):
        if len(frames) > 0:
            rotate(blocks[k], pairs[k], frame_of, frames)
        add_lower(blocks[k], np.int64(6), slots[rows[k]], data)
