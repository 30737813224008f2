"""Supports and prescribed displacements, resolved to constrained directions at nodes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
MOTIONS = ("translation along x", "translation along y", "translation along z",
           "rotation about x", "rotation about y", "rotation about z")  # fmt: skip
UNBALANCED = (
    "the forces on a sheet without enough supports are not in equilibrium; add supports or balance them"
)
RIGID = "or a support at 'rigid-body' that takes them out without force"
TURNED = "the forces turn the free sheet, so they do not stay in equilibrium; add supports"


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
    """Nodes that cannot move in some directions.

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
class RigidBody(Constraint):
    """Takes out exactly the rigid motions that the other supports leave free, without any force (see `bh.trace`)."""

    def fixed(self, mesh: SheetMesh) -> Iterable[tuple[Ints, Array]]:
        """See `Constraint.fixed`."""
        return []


@dataclass(frozen=True)
class Prescribed:
    """Displacement along one direction at some nodes, from `start` to `end` (mm) while lambda runs from 0 to 1.

    `start` is nan where the displacement that the step begins with is to be taken.
    """

    nodes: Ints
    direction: tuple[float, float, float]
    start: float
    end: float


@dataclass(frozen=True)
class Constraints:
    """Constrained directions of all nodes in local axes.

    Attributes:
        fixed: (n, 3) True where the local component is prescribed.
        start, end: (n, 3) prescribed local displacement at lambda = 0 and 1, mm (zero for supports; start is nan
            where the displacement that the step begins with is to be taken).
        frame_of: (n,) row of `frames` for nodes whose local axes are not x, y, z; else -1.
        frames: (f, 3, 3) rows are the local axes.
        rigid_body: True if the remaining rigid motions are to be taken out.
        clamped: (k, 2) boundary edges, as node pairs, across which the sheet keeps its slope.
    """

    fixed: NDArray[np.bool_]
    start: Array
    end: Array
    frame_of: Ints
    frames: Array
    rigid_body: bool
    clamped: Ints = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))


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


def resolve(
    mesh: SheetMesh,
    supports: Iterable[Constraint],
    prescribed: Iterable[Prescribed] = (),
    in_contact: bool = False,
) -> Constraints:
    """Collect all supports and prescribed displacements into local axes a node.

    A sheet without any support gets the rigid-body support by itself, unless it is `in_contact` with what holds it.

    Args:
        mesh: of the sheet.
        supports: that hold it.
        prescribed: displacements.
        in_contact: something else carries the sheet.

    Raises:
        ModelError: supports contradict each other, or leave rigid motions free.
    """
    supports, prescribed = list(supports), list(prescribed)
    n = len(mesh.points)
    fixed = np.zeros((n, 3), dtype=bool)
    oblique: dict[int, list[tuple[Array, float, float]]] = {}
    rigid_body = (not supports and not prescribed) or any(isinstance(s, RigidBody) for s in supports)
    for support in supports:
        for nodes, direction in support.fixed(mesh):
            if np.abs(direction).max() == 1.0:
                fixed[nodes, int(np.abs(direction).argmax())] = True
            else:
                for node in nodes.tolist():
                    oblique.setdefault(node, []).append((direction, 0.0, 0.0))
    for item in prescribed:
        for node in item.nodes.tolist():
            direction = np.asarray(item.direction, dtype=float)
            oblique.setdefault(node, []).append((direction, item.start, item.end))

    start, end = np.zeros((n, 3)), np.zeros((n, 3))
    frame_of = np.full(n, -1, dtype=np.int64)
    frames: list[Array] = []
    for node, extra in oblique.items():
        rows = [(axis, 0.0, 0.0) for axis in np.eye(3)[fixed[node]]] + extra
        fixed[node] = False
        axes, values = _orthonormal(node, rows)
        aligned = (np.abs(axes).max(axis=1) > 1.0 - 1e-12).all()
        if aligned:
            columns = np.abs(axes).argmax(axis=1)
            signs = np.sign(axes[np.arange(len(axes)), columns])
            fixed[node, columns] = True
            start[node, columns], end[node, columns] = signs * values[:, 0], signs * values[:, 1]
        else:
            fixed[node, : len(axes)] = True
            start[node, : len(axes)], end[node, : len(axes)] = values.T
            frame_of[node] = len(frames)
            frames.append(_complete(axes))
    stacked = np.array(frames).reshape(-1, 3, 3)
    clamps = [support.clamps(mesh) for support in supports]
    clamped = mesh.topology.edges[np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *clamps]))]
    constraints = Constraints(fixed, start, end, frame_of, stacked, rigid_body and not in_contact, clamped)
    if not in_contact:
        _check_rigid_motions(mesh, constraints)
    return constraints


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


def rigid_motions(points: Array) -> Array:
    """(3 n, 6) displacements of the unit translations and of unit rotations about the centroid.

    Returns:
        columns: three translations, then three rotations; mm.
    """
    n = len(points)
    arm = points - points.mean(axis=0)
    motions = np.zeros((n, 3, 6))
    motions[:, [0, 1, 2], [0, 1, 2]] = 1.0
    motions[:, 1, 3], motions[:, 2, 3] = -arm[:, 2], arm[:, 1]
    motions[:, 0, 4], motions[:, 2, 4] = arm[:, 2], -arm[:, 0]
    motions[:, 0, 5], motions[:, 1, 5] = -arm[:, 1], arm[:, 0]
    return motions.reshape(3 * n, 6)


def free_motions(points: Array, constraints: Constraints) -> Array:
    """(6, r) combinations of the scaled rigid motions that the supports allow, r from 0 to 6.

    Rotations are scaled by the size of the sheet, so that ranks do not depend on the unit of length.

    Args:
        points: (n, 3) of the stress-free sheet, mm.
        constraints: what is fixed.
    """
    motions = rigid_motions(points).reshape(len(points), 3, 6)
    scale = np.ones(6)
    scale[3:] = 1.0 / max(float(np.linalg.norm(np.ptp(points, axis=0))), 1e-300)
    motions = motions * scale
    for node in np.flatnonzero(constraints.frame_of >= 0):
        motions[node] = constraints.frames[constraints.frame_of[node]] @ motions[node]
    rows = motions[constraints.fixed]
    if len(constraints.clamped):  # no turn about a clamped edge
        along = points[constraints.clamped[:, 1]] - points[constraints.clamped[:, 0]]
        along /= np.linalg.norm(along, axis=1)[:, None]
        rows = np.vstack((rows, np.hstack((np.zeros_like(along), along))))
    if len(rows) == 0:
        return np.diag(scale)
    # the triangular factor has the same null space and six rows at most, where all left vectors would be (k, k)
    _, values, right = np.linalg.svd(np.linalg.qr(rows, mode="r"), full_matrices=True)
    rank = int((values > 1e-7 * max(values[0], 1e-300)).sum())
    return np.asarray(scale[:, None] * right[rank:].T)


def _check_rigid_motions(mesh: SheetMesh, constraints: Constraints) -> None:
    """Nothing of the sheet is free, unless the rest is to be taken out; each piece of a parted sheet counts alone."""
    bodies = _bodies(mesh)
    count = int(bodies.max()) + 1
    if constraints.rigid_body and count > 1:
        raise ModelError(
            f"cuts part the sheet into {count} pieces, and nothing holds them to each other: hold each of them by "
            "supports of its own, or end the cuts inside the sheet"
        )
    if constraints.rigid_body:
        return
    for number in range(count):
        triangles = mesh.triangles[bodies == number]
        nodes = np.arange(len(mesh.points)) if count == 1 else np.unique(triangles)
        x, y, _ = mesh.points[nodes].mean(axis=0)
        where = f" of the piece at ({x:.4g}, {y:.4g})" if count > 1 else ""
        _check_piece(mesh, _restricted(constraints, nodes), nodes, where)


def _bodies(mesh: SheetMesh) -> Ints:
    """(t,) number of the body of each triangle: pieces that share a node, as those of a truss do, are one."""
    piece = mesh.pieces
    count = int(piece.max()) + 1
    if count == 1:
        return piece
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs = np.repeat(piece, 3), count + mesh.triangles.ravel()
    graph = coo_array((np.ones(len(pairs[0])), pairs), shape=(count + len(mesh.points),) * 2)
    labels = connected_components(graph, directed=False)[1][:count]
    return np.asarray(np.unique(labels, return_inverse=True)[1][piece], dtype=np.int64)


def _restricted(constraints: Constraints, nodes: Ints) -> Constraints:
    """The constraints of some nodes (k,), which are all nodes of the edges that they have in common."""
    number = np.full(len(constraints.fixed), -1, dtype=np.int64)
    number[nodes] = np.arange(len(nodes))
    clamped = number[constraints.clamped]
    return replace(
        constraints,
        fixed=constraints.fixed[nodes],
        start=constraints.start[nodes],
        end=constraints.end[nodes],
        frame_of=constraints.frame_of[nodes],
        clamped=clamped[(clamped >= 0).all(axis=1)],
    )


def _check_piece(mesh: SheetMesh, constraints: Constraints, nodes: Ints, where: str) -> None:
    left = free_motions(mesh.points[nodes], constraints)
    if left.shape[1] == 0:
        return
    size = np.ones(6)
    size[3:] = mesh.size
    share = np.linalg.norm(left * size[:, None], axis=1)
    named = np.flatnonzero(share > 0.3)
    names = ", ".join(MOTIONS[k] for k in named)
    if len(named) != left.shape[1]:  # none of them alone, such as a turn about a slanted line
        names = f"combinations of {names}"
    raise ModelError(
        f"the supports leave {left.shape[1]} of 6 rigid motions{where} free ({names}); "
        + ("add supports there" if where else f"add supports, {RIGID}")
    )


def _orthonormal(node: int, rows: list[tuple[Array, float, float]]) -> tuple[Array, Array]:
    """Gram-Schmidt over the directions at a node; values follow, redundant ones must agree."""
    axes: list[Array] = []
    values: list[Array] = []
    for direction, start, end in rows:
        rest, value = direction.astype(float).copy(), np.array([start, end])
        for axis, known in zip(axes, values, strict=True):
            share = float(rest @ axis)
            rest, value = rest - share * axis, value - share * known
        norm = float(np.linalg.norm(rest))
        if norm > 1e-9:
            axes.append(rest / norm)
            values.append(value / norm)
        elif np.nanmax(np.abs(value)) > 1e-12 * (1.0 + abs(end)):
            raise ModelError(
                f"node {node} is fixed and displaced along the same direction; remove the support or the displacement"
            )
    return np.array(axes), np.array(values)


def _complete(axes: Array) -> Array:
    """Three orthonormal rows that begin with the given ones."""
    _, _, right = np.linalg.svd(axes, full_matrices=True)
    return np.vstack((axes, right[len(axes) :]))
