"""What holds a sheet: supports of places, by name or by node."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class Constraint:
    """What holds a sheet.

    A support of your own derives from it and is a frozen dataclass of plain values (docs/extending.md).
    """

    def fixed(self, mesh: SheetMesh) -> Iterable[tuple[Ints, Array]]:
        """Nodes and a unit direction in which they cannot move, (k,) and (3,), as often as needed."""
        raise NotImplementedError

    def clamps(self, mesh: SheetMesh) -> Ints:
        """Rows of `mesh.topology.edges` across which the sheet keeps its slope.

        Returns:
            (k,) rows; none but for a clamp.
        """
        return np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class Support(Constraint):
    """Nodes that cannot move in some directions: from their stress-free places, or in a step from where it begins.

    Attributes:
        at: a place of the mesh ("corner:inner-start", "edge:inner", "crease:NAME", "node:N", "all") or node indices.
        fix: letters out of "xyz", or one or more direction vectors (k, 3) that need not be unit or orthogonal.
        clamp: also hold the slope of the sheet across the boundary edges of the place: there it keeps the outward
            direction that it had (a clamped edge, or a plane of symmetry). Else the sheet can turn about its edge.
    """

    at: str | Sequence[int]
    fix: str | Sequence[Sequence[float]] = "xyz"
    clamp: bool = False

    def fixed(self, mesh: SheetMesh) -> Iterable[tuple[Ints, Array]]:
        """See `Constraint.fixed`."""
        nodes = select(mesh, self.at)
        return [(nodes, direction) for direction in directions(self.fix)]

    def clamps(self, mesh: SheetMesh) -> Ints:
        """See `Constraint.clamps`."""
        return clamped_edges(mesh, self.at) if self.clamp else super().clamps(mesh)


@dataclass(frozen=True)
class Hold(Constraint):
    """Nodes held in all directions, and at edges of the boundary the slope too: clamped as they lie.

    In `Step.support` it holds them where the step finds them. Bars and hinges have no slope: hold nodes there.

    Attributes:
        at: a place of the mesh or node indices, as for `Support`.
    """

    at: str | Sequence[int]

    def fixed(self, mesh: SheetMesh) -> Iterable[tuple[Ints, Array]]:
        """See `Constraint.fixed`."""
        nodes = select(mesh, self.at)
        return [(nodes, direction) for direction in directions("xyz")]

    def clamps(self, mesh: SheetMesh) -> Ints:
        """See `Constraint.clamps`."""
        if not isinstance(self.at, str) or self.at not in mesh.edge_sets:
            return super().clamps(mesh)
        edges = mesh.topology.find_edges(mesh.edge_sets[self.at])
        inside = (mesh.topology.edge_triangles[edges, 1] >= 0).any()
        return super().clamps(mesh) if inside else edges


@dataclass(frozen=True)
class RigidBody(Constraint):
    """Takes out exactly the rigid motions that the other supports leave free, without any force (see `bh.trace`)."""

    def fixed(self, mesh: SheetMesh) -> Iterable[tuple[Ints, Array]]:
        """See `Constraint.fixed`."""
        return []


def directions(fix: str | Sequence[Sequence[float]]) -> list[Array]:
    """Unit direction vectors of a support.

    Returns:
        (3,) each, of length one.

    Raises:
        ModelError: unknown letters, or vectors that are not three finite numbers.
    """
    if isinstance(fix, str):
        wrong = sorted(set(fix) - set("xyz"))
        if wrong or not fix or len(set(fix)) != len(fix):
            raise ModelError(f"support fix = '{fix}' is not understood; use letters out of 'xyz', each once")
        return [np.array(AXES[letter]) for letter in fix]
    vectors = np.atleast_2d(np.asarray(fix, dtype=float))
    if vectors.shape[1] != 3 or not np.isfinite(vectors).all():
        raise ModelError("support directions must be vectors of three finite numbers")
    norms = np.linalg.norm(vectors, axis=1)
    if (norms == 0.0).any():
        raise ModelError("a support direction is the zero vector; give it a direction")
    return list(vectors / norms[:, None])


def select(mesh: SheetMesh, at: str | Sequence[int]) -> Ints:
    """Node indices of a place name or of explicit indices; errors name what there is.

    Args:
        mesh: has the nodes and the names of places.
        at: name of a place, or node indices.

    Returns:
        (k,) node indices.

    Raises:
        ModelError: no nodes, or indices that are not in the mesh.
    """
    if isinstance(at, str):
        return mesh.nodes(at)
    nodes = np.asarray(at)
    if nodes.dtype.kind not in "iu" or nodes.ndim != 1 or len(nodes) == 0:
        raise ModelError("a place must be a name or a list of node indices")
    if nodes.min() < 0 or nodes.max() >= len(mesh.points):
        raise ModelError(f"node {nodes.max()} is not in the mesh; use 0 to {len(mesh.points) - 1}")
    return nodes.astype(np.int64)


def clamped_edges(mesh: SheetMesh, at: str | Sequence[int]) -> Ints:
    """Rows of `mesh.topology.edges` that a clamp at a place holds: its edges, or boundary edges between its nodes.

    Args:
        mesh: of the sheet.
        at: name of a place, or node indices.

    Returns:
        (k,) rows.

    Raises:
        ModelError: the place has no edges, or some inside the sheet, where there is no outward direction to hold.
    """
    topology = mesh.topology
    if isinstance(at, str) and at in mesh.edge_sets:
        found = topology.find_edges(mesh.edge_sets[at])
    else:
        inside = np.zeros(len(mesh.points), dtype=bool)
        inside[select(mesh, at)] = True
        found = np.flatnonzero(inside[topology.edges].all(axis=1) & (topology.edge_triangles[:, 1] < 0))
    if len(found) == 0 or (topology.edge_triangles[found, 1] >= 0).any():
        raise ModelError(f"a clamp at '{at}' needs edges of the boundary; name one, such as edge:start")
    return found


def same_place(one: str | Sequence[int], other: str | Sequence[int]) -> bool:
    """Whether two places are given by the same name, or the same nodes in the same order.

    Args:
        one: name of a place, or node indices.
        other: another.
    """
    if isinstance(one, str) or isinstance(other, str):
        return one == other
    return tuple(one) == tuple(other)
