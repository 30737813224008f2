"""Supports and prescribed displacements, resolved to constrained directions at nodes; and whether they are enough."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError, NotHeldError
from bh.model.supports import Constraint, RigidBody
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
_Row = tuple[
    Array, float, float, float
]  # direction, start, end (nan where not known yet), and how much further
MOTIONS = ("translation along x", "translation along y", "translation along z",
           "rotation about x", "rotation about y", "rotation about z")  # fmt: skip
UNBALANCED = (
    "the forces on a sheet without enough supports are not in equilibrium; add supports or balance them"
)
RIGID = "or a support at 'rigid-body' that takes them out without force"
TURNED = "the forces turn the free sheet, so they do not stay in equilibrium; add supports"


@dataclass(frozen=True)
class Prescribed:
    """Displacement along one direction at some nodes, from `start` to `end` (mm) while lambda runs from 0 to 1.

    `start` is nan where the displacement that the step begins with is to be taken; where `end` is nan it is `further`
    than that, and not known yet.
    """

    nodes: Ints
    direction: tuple[float, float, float]
    start: float
    end: float
    further: float = 0.0


@dataclass(frozen=True)
class Constraints:
    """Constrained directions of all nodes in local axes.

    Attributes:
        fixed: (n, 3) True where the local component is prescribed.
        start, end: (n, 3) prescribed local displacement at lambda = 0 and 1, mm (zero for supports of stress-free
            places; start is nan where the displacement that the step begins with is to be taken, both are where
            that is held and not known yet).
        frame_of: (n,) row of `frames` for nodes whose local axes are not x, y, z; else -1.
        frames: (f, 3, 3) rows are the local axes.
        rigid_body: True if the remaining rigid motions are to be taken out.
        clamped: (k, 2) boundary edges, as node pairs, across which the sheet keeps its slope.
        as_it_lies: (k,) which of them keep the slope that the step begins with; the others keep that of the
            stress-free sheet.
    """

    fixed: NDArray[np.bool_]
    start: Array
    end: Array
    frame_of: Ints
    frames: Array
    rigid_body: bool
    clamped: Ints = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    as_it_lies: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))


@dataclass(frozen=True, eq=False)
class Lying:
    """What holds the sheet as it lies where a step begins, and where that is.

    Attributes:
        supports: that came in during the run.
        points: (n, 3) positions where the step begins, mm; None where they are not known yet, as nothing is solved.
    """

    supports: tuple[Constraint, ...] = ()
    points: Array | None = None


def resolve(
    mesh: SheetMesh,
    supports: Iterable[Constraint],
    prescribed: Iterable[Prescribed] = (),
    in_contact: bool = False,
    lying: Lying | None = None,
) -> Constraints:
    """Collect all supports and prescribed displacements into local axes a node.

    A sheet without any support gets the rigid-body support by itself, unless it is `in_contact` with what holds it.
    Whether supports are enough is judged where the step begins: in the stress-free sheet without `lying`, at its
    points, or, where these are not known yet, in a shape as general as can be (what is too few there always is).

    Args:
        mesh: of the sheet.
        supports: that hold stress-free places.
        prescribed: displacements.
        in_contact: something else carries the sheet.
        lying: of a later step of a model whose supports change.

    Raises:
        ModelError: supports contradict each other.
        NotHeldError: they leave rigid motions free.
    """
    supports, prescribed = list(supports), list(prescribed)
    here = lying.supports if lying is not None else ()
    rigid_body = not (supports or prescribed or here)
    rigid_body |= any(isinstance(each, RigidBody) for each in (*supports, *here))
    moved = np.zeros_like(mesh.points)
    if lying is not None:
        moved = np.full_like(moved, np.nan) if lying.points is None else lying.points - mesh.points
    # flat places are the last word
    fixed, place, oblique = _gathered(mesh, ((here, moved), (supports, np.zeros_like(moved))), prescribed)
    start, end, frame_of, frames = _local_axes(fixed, place, oblique)
    edges, as_it_lies = _clamps(mesh, supports, here)
    constraints = Constraints(
        fixed, start, end, frame_of, frames, rigid_body and not in_contact, edges, as_it_lies
    )
    if not in_contact:
        _check_rigid_motions(mesh, constraints, lying)
    return constraints


def _gathered(
    mesh: SheetMesh, held: Iterable[tuple[Iterable[Constraint], Array]], prescribed: Iterable[Prescribed]
) -> tuple[NDArray[np.bool_], Array, dict[int, list[_Row]]]:
    """What is held and prescribed, along x, y, z and along other directions.

    Args:
        mesh: of the sheet.
        held: supports, and where (n, 3) they hold the nodes, mm from the stress-free place; later ones prevail.
        prescribed: displacements.

    Returns:
        (n, 3) True where a component is held, (n, 3) where; rows of other directions by node, supports first, so that
        a displacement that begins where it is does not make theirs unknown.
    """
    fixed, place = np.zeros(mesh.points.shape, dtype=bool), np.zeros(mesh.points.shape)
    oblique: dict[int, list[_Row]] = {}
    for group, at in held:
        for nodes, direction in (pair for each in group for pair in each.fixed(mesh)):
            if np.abs(direction).max() == 1.0:
                axis = int(np.abs(direction).argmax())
                fixed[nodes, axis], place[nodes, axis] = True, at[nodes, axis]
            else:
                for node in nodes.tolist():
                    value = float(direction @ at[node])
                    oblique.setdefault(node, []).append((direction, value, value, 0.0))
    for item in prescribed:
        for node in item.nodes.tolist():
            direction = np.asarray(item.direction, dtype=float)
            oblique.setdefault(node, []).append((direction, item.start, item.end, item.further))
    return fixed, place, oblique


def _local_axes(
    fixed: NDArray[np.bool_], place: Array, oblique: dict[int, list[_Row]]
) -> tuple[Array, Array, Ints, Array]:
    """Axes of their own for nodes that are held along other directions than x, y, z; `fixed` (n, 3) follows.

    Returns:
        `start`, `end`, `frame_of` and `frames` of `Constraints`.
    """
    start, end = place.copy(), place.copy()
    frame_of = np.full(len(place), -1, dtype=np.int64)
    frames: list[Array] = []
    for node, extra in oblique.items():
        aligned_rows = np.flatnonzero(fixed[node])
        rows = [(np.eye(3)[k], place[node, k], place[node, k], 0.0) for k in aligned_rows] + extra
        rows.sort(key=lambda row: bool(np.isnan(row[2])))  # what is known decides what follows from it
        fixed[node], start[node], end[node] = False, 0.0, 0.0
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
    return start, end, frame_of, np.array(frames).reshape(-1, 3, 3)


def _clamps(
    mesh: SheetMesh, supports: Iterable[Constraint], here: Iterable[Constraint]
) -> tuple[Ints, NDArray[np.bool_]]:
    """(k, 2) clamped edges as node pairs, and (k,) which of them keep the slope that the step begins with."""
    none = [np.zeros(0, dtype=np.int64)]
    flat = np.unique(np.concatenate(none + [each.clamps(mesh) for each in supports]))
    lying = np.unique(np.concatenate(none + [each.clamps(mesh) for each in here]))
    rows = np.union1d(flat, lying).astype(np.int64)
    return mesh.topology.edges[rows], ~np.isin(rows, flat)


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
    scale = np.ones(6)
    scale[3:] = 1.0 / max(float(np.linalg.norm(np.ptp(points, axis=0))), 1e-300)
    if not (constraints.fixed.any() or len(constraints.clamped)):
        return np.diag(scale)
    motions = rigid_motions(points).reshape(len(points), 3, 6) * scale
    for node in np.flatnonzero(constraints.frame_of >= 0):
        motions[node] = constraints.frames[constraints.frame_of[node]] @ motions[node]
    rows = motions[constraints.fixed]
    if len(constraints.clamped):  # no turn about a clamped edge
        along = points[constraints.clamped[:, 1]] - points[constraints.clamped[:, 0]]
        along /= np.linalg.norm(along, axis=1)[:, None]
        rows = np.vstack((rows, np.hstack((np.zeros_like(along), along))))
    # the triangular factor has the same null space and six rows at most, where all left vectors would be (k, k)
    _, values, right = np.linalg.svd(np.linalg.qr(rows, mode="r"), full_matrices=True)
    rank = int((values > 1e-7 * max(values[0], 1e-300)).sum())
    return np.asarray(scale[:, None] * right[rank:].T)


def orthonormal(motions: Array) -> Array:
    """Orthonormal columns that span those of (n, r), r few: Cholesky's factor of their products, applied twice.

    It takes a fraction of the time of Householder's reflections, and the second pass makes the columns orthogonal to
    rounding as long as the first can be taken (Yamamoto et al. 2015).

    Args:
        motions: (n, r) rates of the unknowns in rigid motions, scaled to be of a kind.
    """
    if motions.shape[1] == 0:
        return motions
    out = motions
    try:
        for _ in range(2):
            triangle = np.linalg.cholesky(out.T @ out)
            out = out @ np.linalg.inv(triangle).T
    except np.linalg.LinAlgError:  # columns that depend on each other
        return np.asarray(np.linalg.qr(motions)[0])
    return out


def _check_rigid_motions(mesh: SheetMesh, constraints: Constraints, lying: Lying | None) -> None:
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
    points = mesh.points if lying is None else lying.points
    if points is None:  # a general shape: nothing lies on a line by accident
        points = mesh.points + mesh.size * np.random.default_rng(1).uniform(-0.3, 0.3, mesh.points.shape)
    for number in range(count):
        triangles = mesh.triangles[bodies == number]
        nodes = np.arange(len(mesh.points)) if count == 1 else np.unique(triangles)
        x, y, _ = mesh.points[nodes].mean(axis=0)
        where = f" of the piece at ({x:.4g}, {y:.4g})" if count > 1 else ""
        _check_piece(points[nodes], mesh.size, _restricted(constraints, nodes), where)


def check_held(
    mesh: SheetMesh, constraints: Constraints, sprung: NDArray[np.bool_], lying: Lying | None = None
) -> None:
    """Raises `NotHeldError` where supports and springs together leave rigid motions free.

    Args:
        mesh: of the sheet.
        constraints: what supports hold.
        sprung: (n, 3) True where a spring pulls along x, y or z.
        lying: of a step of a model whose supports change.

    Raises:
        NotHeldError: one line that names the motions.
    """
    _check_rigid_motions(mesh, replace(constraints, fixed=constraints.fixed | sprung), lying)


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
        as_it_lies=constraints.as_it_lies[(clamped >= 0).all(axis=1)],
    )


def _check_piece(points: Array, extent: float, constraints: Constraints, where: str) -> None:
    left = free_motions(points, constraints)
    if left.shape[1] == 0:
        return
    size = np.ones(6)
    size[3:] = extent
    share = np.linalg.norm(left * size[:, None], axis=1)
    named = np.flatnonzero(share > 0.3)
    names = ", ".join(MOTIONS[k] for k in named)
    if len(named) != left.shape[1]:  # none of them alone, such as a turn about a slanted line
        names = f"combinations of {names}"
    raise NotHeldError(
        f"the supports leave {left.shape[1]} of 6 rigid motions{where} free ({names}); "
        + ("add supports there" if where else f"add supports, {RIGID}")
    )


def _orthonormal(node: int, rows: list[_Row]) -> tuple[Array, Array]:
    """Gram-Schmidt over the directions at a node; values follow, redundant ones must agree."""
    axes: list[Array] = []
    values: list[Array] = []
    for direction, start, end, further in rows:
        rest, value = direction.astype(float).copy(), np.array([start, end])
        follows = np.zeros(2)  # of what is held already, for a place that is not known yet
        for axis, known in zip(axes, values, strict=True):
            share = float(rest @ axis)
            rest, value = rest - share * axis, value - share * known
            follows = follows + share * known if abs(share) > 1e-12 else follows
        norm = float(np.linalg.norm(rest))
        if np.isnan(value).all() and norm <= 1e-9:
            moves = follows[1] - follows[0] if not np.isnan(follows).all() else 0.0
            value = np.array([0.0, further - moves if not np.isnan(moves) else np.inf])
        if norm > 1e-9:
            axes.append(rest / norm)
            values.append(value / norm)
        elif np.nanmax(np.abs(value)) > 1e-12 * (1.0 + abs(float(np.nan_to_num(end)))):
            raise ModelError(
                f"node {node} is fixed and displaced along the same direction; remove the support or the displacement"
            )
    return np.array(axes), np.array(values)


def _complete(axes: Array) -> Array:
    """Three orthonormal rows that begin with the given ones."""
    _, _, right = np.linalg.svd(axes, full_matrices=True)
    return np.vstack((axes, right[len(axes) :]))
