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
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.mechanics.contact.blocks import in_pairs, no_blocks, partners
from bh.mechanics.contact.detection import Detection
from bh.mechanics.contact.friction import Rubbing
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
ipctk.set_num_threads(1)  # sums in one order, so that the same input gives the same numbers
# it warns of ways that begin too near, which are refused here
ipctk.set_logger_level(ipctk.LoggerLevel.error)


class SheetBarrier:
    """The barrier of a sheet; positions x are (n, 3), mm."""

    KIND = 0  # of contacts, for what is remembered of them

    def __init__(self, mesh: SheetMesh, offset: float, reach: float, pressure: float) -> None:
        """Pairs that can meet.

        Args:
            mesh: the stress-free sheet.
            offset: distance m that is never gone below, mm; 0 for the middle surface itself.
            reach: how far beyond it the barrier acts, mm.
            pressure: kappa, N / mm^2.
        """
        self.nodes = len(mesh.points)
        self.edges: Ints = mesh.topology.edges
        self.triangles = mesh.triangles
        solid = ipctk.CollisionMesh(mesh.points, self.edges.astype(np.int32), mesh.triangles.astype(np.int32))
        if offset > 0.0:
            near = _neighbours(mesh, LOCAL * (offset + reach))
            solid.can_collide = ipctk.make_sparse_filter(dict.fromkeys(near, False), True)
        self._begin(solid, mesh, offset, reach, pressure)

    def _begin(
        self, solid: ipctk.CollisionMesh, mesh: SheetMesh, offset: float, reach: float, pressure: float
    ) -> None:
        """What presses among the parts of a collision mesh, whose first nodes are those of the sheet."""
        self.offset, self.reach, self._mesh = offset, reach, solid
        self._partner = partners(mesh)
        self._pressure = pressure
        self.harden(1.0)
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

    def harden(self, factor: float) -> None:
        """Press by a number of times what the model asks for, until told otherwise.

        Args:
            factor: 1 for the model's own.
        """
        self._potential = ipctk.BarrierPotential(self.reach, factor * self._pressure, True)

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

    def places(self, x: Array, lam: float) -> Array:  # noqa: ARG002 - moulds move
        """Positions (n, 3) of all that can meet, as the other methods take them: here those of the sheet.

        Args:
            x: (nodes, 3) positions of the sheet, mm.
            lam: load parameter of the step, 0 to 1.
        """
        return x

    def rates(self, v: Array, moving: float) -> Array:  # noqa: ARG002 - moulds move
        """Velocities (n, 3) of all that can meet.

        Args:
            v: (nodes, 3) velocities of the sheet.
            moving: rate of lambda.
        """
        return v

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

    def room(self, x: Array) -> float:
        """Part of the reach that is left to the pair that presses hardest at positions x; 1 where none does."""
        return (self.distance(x) - self.offset) / self.reach

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
        f += self._potential.gradient(pairs, self._mesh, x).reshape(-1, 3)[: self.nodes]
        return float(self._potential(pairs, self._mesh, x))

    def blocks(self, x: Array) -> tuple[Ints, Array]:
        """Hessian as pairs of nodes (p, 2), first one higher, and their matrices (p, 6, 6), N / mm, whose sum it is."""
        pairs = self._pairs(x)
        if len(pairs) == 0:
            return no_blocks()
        H = self._potential.hessian(pairs, self._mesh, x).tobsr(blocksize=(3, 3))
        row = np.repeat(np.arange(len(x)), np.diff(H.indptr))
        column = H.indices.astype(np.int64)
        inside = (row < self.nodes) & (column < self.nodes)
        return in_pairs(row[inside], column[inside], H.data[inside], self._partner)

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

    def rubbing(self, x: Array, mu: float) -> Rubbing:
        """What presses at positions x, to rub with a coefficient mu; nothing is stuck.

        Args:
            x: (nodes, 3) positions, mm.
            mu: coefficient of friction.
        """
        pairs = self._pairs(x)
        if len(pairs) == 0:
            return Rubbing.none()
        slides = ipctk.TangentialCollisions()
        slides.build(self._mesh, x, pairs, self._potential, 1.0)
        keys, weights = np.full((len(slides), 5), -1, dtype=np.int64), np.zeros((len(slides), 4))
        normals, force = np.zeros((len(slides), 3)), np.zeros(len(slides))
        edges, faces = self._mesh.edges, self._mesh.faces
        for k in range(len(slides)):
            pair = slides[k]
            nodes = [n for n in pair.vertex_ids(edges, faces) if n >= 0]
            keys[k, 0], keys[k, 1 : 1 + len(nodes)] = self.KIND + len(nodes), nodes
            weights[k, : len(nodes)] = pair.compute_coefficients(x, edges, faces)[: len(nodes)]
            normals[k] = np.cross(*np.asarray(pair.tangent_basis).T)
            force[k] = self.coefficient(nodes, mu) * pair.weight * pair.normal_force_magnitude
            del pair  # of what `slides` holds; the library breaks down where it outlives that
        return Rubbing(keys, weights, normals, force, np.zeros((len(slides), 3)))

    def coefficient(self, nodes: Sequence[int], mu: float) -> float:  # noqa: ARG002 - moulds have their own
        """Of friction between some nodes, where it is mu in general.

        Args:
            nodes: of a contact.
            mu: coefficient of the model.
        """
        return mu

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
        # positions that were tried may have led the chain astray; motions are looked for from x again
        self._detection.go_back(x)
        free = self.clear(moved) and self.free_part(x, moved) >= 1.0
        return not (free and self._detection.linked(moved))

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

    def first_meetings(self, x: Array) -> str:
        """What is wrong with a first state x (n, 3), mm: it meets itself, or parts of it are nearer than the offset."""
        near = self.offset > 0.0 and not ipctk.has_intersections(self._mesh, x)
        what = (
            f"parts of the first state are nearer than {self.offset:.4g} mm"
            if near
            else "the first state meets itself"
        )
        return f"{what} ({self.meetings(x)})"

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
    return SheetBarrier(mesh, offset, reach, barrier_pressure(model))


def barrier_pressure(model: Model) -> float:
    """Kappa of a barrier, N / mm^2: what bends a panel as wide as the sheet's mean edge is long flat.

    Others would do, this one is in the middle.

    Args:
        model: of the sheet.
    """
    return model.sheet.E * (model.sheet.t / float(np.median(mesh_edges(model.mesh)))) ** 3
