"""Mirror symmetry of a model: the plane, who is whose image, and whether everything that happens is symmetric too.

The letter is the coordinate that changes its sign, in the sheet's own axes: x and y of the plane, about the middle of
the sheet; of a sector of an annulus x is radial and y goes along the crease at the middle of the arc (as in the source,
3.5.1), so that "y" exchanges its two ends.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.loading.load_step import LoadStep
from bh.model.constraints import Constraints
from bh.model.model import Model
from bh.model.step import Step
from bh.model.supports import RigidBody, Support
from meshes import Arc, SheetMesh
from meshes.fans import places
from meshes.topology import Ints

Array = NDArray[np.float64]
NEAR = 1e-7  # of the size of the sheet: nodes are images of each other
ALIKE = 1e-9  # relative: values are
ADVICE = "mend that, or leave out symmetry"
Plane = str | Sequence[float]


@dataclass(frozen=True, eq=False)
class Mirror:
    """A plane that maps a mesh to itself. Of two images the one with `side` below zero is kept.

    Attributes:
        normal: (3,) unit normal of the plane; `offset` its distance from the origin along it, mm.
        node: (n,) the image of every node; `side` (n,) -1, 0 (in the plane) or 1.
        edge, hinge, triangle: (e,), (m,), (t,) images of edges, hinges and triangles.
        edge_weight, hinge_weight, triangle_weight: what part of each is in the kept half: 1, 1/2 (its own image), 0.
    """

    mesh: SheetMesh
    normal: Array
    offset: float
    node: Ints
    side: Ints
    edge: Ints
    hinge: Ints
    triangle: Ints

    @property
    def matrix(self) -> Array:
        """(3, 3) reflection of vectors."""
        return np.asarray(np.eye(3) - 2.0 * np.outer(self.normal, self.normal))

    @cached_property
    def edge_weight(self) -> Array:
        """(e,) parts of the edges in the kept half."""
        return self._weight(self.edge, self.side[self.mesh.topology.edges].sum(axis=1))

    @cached_property
    def hinge_weight(self) -> Array:
        """(m,) parts of the hinges in the kept half."""
        return np.asarray(self.edge_weight[self.mesh.topology.hinge_edges])

    @cached_property
    def hinge_inside(self) -> NDArray[np.bool_]:
        """(m,) hinges whose edge lies in the plane."""
        ends = self.mesh.topology.hinges[:, 1:3]
        return np.asarray((self.side[ends] == 0).all(axis=1))

    @cached_property
    def triangle_weight(self) -> Array:
        """(t,) parts of the triangles in the kept half."""
        return self._weight(self.triangle, self.side[self.mesh.triangles].sum(axis=1))

    @staticmethod
    def _weight(image: Ints, side: Ints) -> Array:
        return np.where(image == np.arange(len(image)), 0.5, np.where(side < 0, 1.0, 0.0))


def mirror(mesh: SheetMesh, plane: Plane) -> Mirror:
    """The mirror of a mesh along "x" or "y" (see the module), or of a plane through its middle with a given normal.

    Args:
        mesh: of the whole sheet.
        plane: "x", "y", or the normal (3,) of a plane through the middle of the mesh.

    Raises:
        ModelError: the plane cannot be, or the mesh is not its own image; one line.
    """
    normal = _normal(mesh, plane)
    along = mesh.points @ normal
    offset = float(0.5 * (along.max() + along.min()))
    size = max(float(np.linalg.norm(np.ptp(mesh.points, axis=0))), 1e-300)
    node = _images(mesh, normal, offset, NEAR * size)
    side = np.where(np.abs(along - offset) <= NEAR * size, 0, np.sign(along - offset)).astype(np.int64)
    topology = mesh.topology
    corners = np.sort(mesh.triangles, axis=1)
    images = np.sort(node[mesh.triangles], axis=1)
    order, other = np.lexsort(corners.T), np.lexsort(images.T)
    if not np.array_equal(corners[order], images[other]):
        raise ModelError(
            f"symmetry along {plane}: the mesh ({mesh.kind}) is not its own image; take staggered or "
            "alternating cells in an even number, or leave out symmetry"
        )
    triangle = np.empty(len(corners), dtype=np.int64)
    triangle[other] = order
    edge = topology.find_edges(node[topology.edges])
    hinge = topology.edge_hinges[edge[topology.hinge_edges]]
    return Mirror(mesh, normal, offset, node, side, edge, hinge, triangle)


def _normal(mesh: SheetMesh, plane: Plane) -> Array:
    if not isinstance(plane, str):
        try:
            vector = np.asarray(plane, dtype=float)
        except (TypeError, ValueError):
            vector = np.zeros(0)
        if vector.shape != (3,) or not np.isfinite(vector).all() or not vector[:2].any() or vector[2] != 0.0:
            raise ModelError(
                f'symmetry = {plane} cannot be; give "x", "y" or a normal [x, y, 0] in the sheet'
            )
        return np.asarray(vector / np.linalg.norm(vector))
    if plane not in ("x", "y"):
        raise ModelError(
            f'symmetry = "{plane}" is not known; give "x", "y" or a normal [x, y, 0] in the sheet'
        )
    inner = mesh.curves.get("edge:inner")
    if isinstance(inner, Arc) and not inner.closed:
        before, after = inner.point(
            np.array([0.25, 0.75])
        )  # the chord is parallel to the tangent in the middle
        y = np.append(after - before, 0.0)
        y /= np.linalg.norm(y)
        return y if plane == "y" else np.array([y[1], -y[0], 0.0])
    return np.array([1.0, 0.0, 0.0] if plane == "x" else [0.0, 1.0, 0.0])


def _images(mesh: SheetMesh, normal: Array, offset: float, near: float) -> Ints:
    from scipy.spatial import cKDTree

    known, reflected = mesh.points, _reflected(mesh.points, normal, offset)
    if (
        places(known) != np.arange(len(known))
    ).any():  # nodes doubled at cuts differ by the triangles round them
        middle = _middles(mesh)
        known, reflected = (
            np.hstack((known, middle)),
            np.hstack((reflected, _reflected(middle, normal, offset))),
        )
    distance, image = cKDTree(known).query(reflected)
    if distance.max() > near:
        worst = int(np.argmax(distance))
        x, y, z = mesh.points[worst]
        raise ModelError(
            f"the mesh is not mirror-symmetric: node {worst} at ({x:.4g}, {y:.4g}, {z:.4g}) has no image across the "
            f"plane normal to ({normal[0]:.3g}, {normal[1]:.3g}, 0); mend the mesh, or leave out symmetry"
        )
    return np.asarray(image, dtype=np.int64)


def _reflected(points: Array, normal: Array, offset: float) -> Array:
    return np.asarray(points - 2.0 * np.outer(points @ normal - offset, normal))


def _middles(mesh: SheetMesh) -> Array:
    """(n, 3) mean of the centres of the triangles round every node, mm."""
    centres = mesh.points[mesh.triangles].mean(axis=1)
    total = np.zeros_like(mesh.points)
    for corner in mesh.triangles.T:
        np.add.at(total, corner, centres)
    count = np.bincount(mesh.triangles.ravel(), minlength=len(total))
    return np.asarray(total / count[:, None])


def halved(model: Model, plane: Mirror, free: bool) -> Model:
    """The model with its nodes in the plane held there; `free` if nothing else holds it in some step.

    Args:
        model: of the whole sheet.
        plane: of its mirror.
        free: nothing else holds it in some step.
    """
    nodes = np.flatnonzero(plane.side == 0).tolist()
    extra: list[Support | RigidBody] = [Support(nodes, (tuple(plane.normal.tolist()),))] if nodes else []
    if free and not any(isinstance(item, RigidBody) for item in model.supports):
        extra.append(RigidBody())
    return replace(model, supports=(*model.supports, *extra))


def _refuse(asked: Step, step: LoadStep, where: str) -> None:
    """Raises `ModelError` with one line where a step has what is not solved by halves."""
    reasons = (
        (asked.looks_back, "whose supports change"),
        (bool(step.bodies), "that touches bodies"),
        (step.pressure is not None, "under pressure"),
        (step.ground is not None, "on springs to the ground"),
        (step.edge_couple is not None, "with couples on its edges"),
        (step.growth is not None, "that expands"),
    )
    for is_so, words in reasons:
        if is_so:
            raise ModelError(f"{where}: a sheet {words} is not solved by halves; leave out symmetry")


def check(model: Model, steps: Sequence[LoadStep], plane: Mirror) -> None:
    """Raises `ModelError` with one line that names what is not symmetric.

    Args:
        model: of the whole sheet.
        steps: its load steps.
        plane: of its mirror.

    Raises:
        ModelError: the grain, a support, a crease or an actuation has no image in the plane.
    """
    _check_sheets(model, plane)
    for number, step in enumerate(steps):
        where = f"step {number + 1}"
        _refuse(model.steps[number], step, where)
        _check_hinges(model, step, plane, where)
        for name in ("start", "end"):
            force = getattr(step.force, name)
            _same(force[plane.node], force @ plane.matrix, model, f"{where}: the forces")
        for what, tensor, vector in _constrained(step.constraints):
            image = np.einsum("ij,njk,kl->nil", plane.matrix, tensor, plane.matrix)
            _same(tensor[plane.node], image, model, f"{where}: the supports")
            _same(
                vector[plane.node], vector @ plane.matrix, model, f"{where}: the displacements at the {what}"
            )
        clamped = model.mesh.topology.find_edges(step.constraints.clamped)
        if set(plane.edge[clamped].tolist()) != set(clamped.tolist()):
            raise ModelError(f"{where}: the clamped edges are not mirror-symmetric; {ADVICE}")


def _check_sheets(model: Model, plane: Mirror) -> None:
    """Zones, grains and laminates."""
    sections = model.sections
    if sections.of is not None and (sections.of != sections.of[plane.triangle]).any():
        x, y, _ = model.mesh.points[
            model.mesh.triangles[np.argmax(sections.of != sections.of[plane.triangle])]
        ].mean(axis=0)
        raise ModelError(f"the zones are not mirror-symmetric (at ({x:.4g}, {y:.4g}) mm); {ADVICE}")
    if any(sheet.plies is not None for sheet in sections.sheets):
        raise ModelError("a laminate is not solved by halves; leave out symmetry")
    for grain in (sheet.grain for sheet in sections.sheets):
        if grain is None:
            continue
        along = math.cos(grain) * plane.normal[0] + math.sin(grain) * plane.normal[1]
        if min(abs(along), math.sqrt(max(1.0 - along**2, 0.0))) > 1e-7:
            raise ModelError(
                f"the grain at {math.degrees(grain):.6g} degrees is not mirror-symmetric: it runs neither along nor "
                f"across the plane; {ADVICE}"
            )


def _check_hinges(model: Model, step: LoadStep, plane: Mirror, where: str) -> None:
    values = {"law": step.law, "stiffness": step.stiffness}
    for name in ("rest", "prescribed", "moment"):
        ramp = getattr(step, name)
        values |= {f"{name} at the start": ramp.start, f"{name} at the end": ramp.end}
    values |= {"pinch": step.pinch.toward, "extent of the pinch": step.pinch.part}
    for name, value in values.items():
        one, other = np.nan_to_num(value), np.nan_to_num(value[plane.hinge])
        off = np.abs(one - other) > ALIKE * max(float(np.abs(one).max(initial=0.0)), 1e-300)
        if off.any():
            a, b = model.mesh.topology.hinges[int(np.argmax(off)), 1:3]
            raise ModelError(
                f"{where}: the creases are not mirror-symmetric ({name} at edge {a}-{b}); {ADVICE}"
            )


def _constrained(c: Constraints) -> list[tuple[str, Array, Array]]:
    """(n, 3, 3) projectors on constrained directions and (n, 3) prescribed displacements at both ends, global."""
    axes = np.broadcast_to(np.eye(3), (len(c.fixed), 3, 3)).copy()
    turned = np.flatnonzero(c.frame_of >= 0)
    axes[turned] = c.frames[c.frame_of[turned]]
    normals = axes * c.fixed[:, :, None]
    tensor = np.einsum("nki,nkj->nij", normals, normals)
    return [
        (name, tensor, np.einsum("nk,nki->ni", np.nan_to_num(values), normals))
        for name, values in (("start", c.start), ("end", c.end))
    ]


def _same(one: Array, other: Array, model: Model, what: str) -> None:
    off = np.abs(one - other).reshape(len(one), -1).max(axis=1)
    if off.max() > ALIKE * max(float(np.abs(one).max()), 1e-12):
        node = int(np.argmax(off))
        x, y, _ = model.mesh.points[node]
        raise ModelError(
            f"{what} are not mirror-symmetric (node {node} at ({x:.4g}, {y:.4g}) and its image differ); {ADVICE}"
        )
