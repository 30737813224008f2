"""Loads that are spread: pressure, forces a length of an edge and an area of the sheet, couples on free edges.

Every one comes in during its step and stays until another one of its kind is asked for at its place. `bh.Weight` and
`bh.Force` are modules of their own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.step import Actuation, StepBuilder
from bh.model.supports import select
from meshes import SheetMesh
from meshes.quantities import Typed, take_units
from meshes.topology import Ints

Array = NDArray[np.float64]
ON_ALL = "all"


@dataclass(frozen=True)
class Pressure(Actuation):
    """A pressure on the lower side of the sheet, which follows it: it pushes along the normal of the upper side.

    Attributes:
        p: N / mm^2 (MPa) at the end of the step; negative pushes from above.
        triangles: that it acts on, or None for all of them.
    """

    p: float
    triangles: Sequence[int] | None = None

    if TYPE_CHECKING:

        def __init__(self, p: Typed, triangles: Sequence[int] | None = None) -> None:
            """See the class."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        take_units(self, "pressure", p="pressure")
        _finite("pressure p", (self.p,), "N/mm^2")
        _keep(self, "triangles")

    def apply(self, builder: StepBuilder) -> None:
        """Ask for the pressure on its triangles."""
        builder.press(_chosen("pressure", builder.mesh, self.triangles), self.p)


@dataclass(frozen=True)
class LineForce(Actuation):
    """A dead force a length along an edge of the sheet or a crease.

    Attributes:
        at: name of a set of edges, such as "edge:end" or "crease:NAME".
        per_length: (3,) N / mm of the flat sheet, at the end of the step.
    """

    at: str
    per_length: Sequence[float]

    if TYPE_CHECKING:

        def __init__(self, at: str, per_length: Sequence[Typed]) -> None:
            """See the class."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        what = f"line force at '{self.at}'"
        take_units(self, what, per_length="line force")
        _vector(f"{what}: per_length", self.per_length, "N/mm")
        _keep(self, "per_length")

    @property
    def key(self) -> str:
        """By what it is replaced: another one at this place."""
        return f"line:{self.at}"

    def apply(self, builder: StepBuilder) -> None:
        """Ask for the force, half of that of every edge on each of its ends.

        Raises:
            ModelError: no edges have that name.
        """
        mesh = builder.mesh
        edges = edges_at(mesh, self.at, "line force")
        ends = mesh.topology.edges[edges]
        half = 0.5 * np.linalg.norm(mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]], axis=1)
        share = np.bincount(ends.T.ravel(), np.tile(half, 2), minlength=len(mesh.points))
        builder.bear(share[:, None] * np.asarray(self.per_length, dtype=float), self.key)


@dataclass(frozen=True)
class AreaForce(Actuation):
    """A dead force an area of the flat sheet.

    Attributes:
        per_area: (3,) N / mm^2 at the end of the step.
        triangles: that it acts on, or None for all of them.
    """

    per_area: Sequence[float]
    triangles: Sequence[int] | None = None

    if TYPE_CHECKING:

        def __init__(self, per_area: Sequence[Typed], triangles: Sequence[int] | None = None) -> None:
            """See the class."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        take_units(self, "area force", per_area="pressure")
        _vector("area force: per_area", self.per_area, "N/mm^2")
        _keep(self, "per_area")
        _keep(self, "triangles")

    key = "area"

    def on(self, mesh: SheetMesh) -> Ints:
        """(k,) triangles that it acts on.

        Raises:
            ModelError: the mesh does not have one of them.
        """
        return _chosen("area force", mesh, self.triangles)

    def apply(self, builder: StepBuilder) -> None:
        """Ask for the force of every triangle, a third on each of its corners."""
        mesh = builder.mesh
        rows = self.on(mesh)
        corners = mesh.triangles[rows]
        area = np.bincount(corners.ravel(), np.repeat(mesh.areas[rows] / 3.0, 3), minlength=len(mesh.points))
        builder.bear(area[:, None] * np.asarray(self.per_area, dtype=float), self.key)


@dataclass(frozen=True)
class EdgeMoment(Actuation):
    """A dead couple a length about a free edge of the sheet; positive turns the outside towards the upper side.

    It works on the turn of the sheet's tangent plane about the edge, so bars and hinges, which have none, refuse it.

    Attributes:
        at: name of a set of edges of the boundary, such as "edge:end".
        to: N mm / mm at the end of the step.
    """

    at: str
    to: float

    if TYPE_CHECKING:

        def __init__(self, at: str, to: Typed) -> None:
            """See the class."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        what = f"edge moment at '{self.at}'"
        take_units(self, what, to="couple")
        _finite(f"{what}: to", (self.to,), "N mm/mm")

    def apply(self, builder: StepBuilder) -> None:
        """Ask for the couple.

        Raises:
            ModelError: no edges have that name, or they lie inside the sheet.
        """
        mesh = builder.mesh
        edges = edges_at(mesh, self.at, "edge moment")
        if (mesh.topology.edge_triangles[edges, 1] >= 0).any():
            raise ModelError(
                f"edge moment at '{self.at}': it lies inside the sheet; use an edge of the boundary, or moment"
            )
        builder.turn(edges, self.to)


@dataclass(frozen=True)
class Couple(Actuation):
    """A dead couple about any axis on the nodes of a place, made of forces that do not turn with the sheet.

    Node i at r_i of the flat sheet, s_i from the middle of the place, has the force w x s_i with w such that the forces
    have the moment and no resultant; of all such forces they are the smallest. They keep their directions: where the
    place turns by a small angle their moment is the one asked for, beyond it changes as the arms between them do.

    Attributes:
        at: name of a place, or node indices; two nodes or more that do not lie on one line along the axis.
        total: (3,) moment about the directions of x, y and z at the end of the step, N mm, right-handed.
    """

    at: str | Sequence[int]
    total: Sequence[float]

    if TYPE_CHECKING:

        def __init__(self, at: str | Sequence[int], total: Sequence[Typed]) -> None:
            """See the class."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        what = f"couple at '{self.at}'"
        if isinstance(self.total, list | tuple):
            take_units(self, what, total="energy")
        _vector(f"{what}: total", self.total, "N mm")
        _keep(self, "total")
        if not isinstance(self.at, str):
            _keep(self, "at")

    @property
    def key(self) -> str:
        """By what it is replaced: another one at this place."""
        return f"couple:{self.at}"

    def apply(self, builder: StepBuilder) -> None:
        """Ask for the forces.

        Raises:
            ModelError: the place is one node, or a line along the axis.
        """
        mesh = builder.mesh
        nodes = select(mesh, self.at)
        arms = mesh.points[nodes] - mesh.points[nodes].mean(axis=0)
        moment = np.asarray(self.total, dtype=float)
        inertia = float((arms**2).sum()) * np.eye(3) - arms.T @ arms
        turn = np.linalg.pinv(inertia, rcond=1e-9, hermitian=True) @ moment
        if not np.allclose(
            inertia @ turn, moment, rtol=0.0, atol=1e-9 * max(float(np.abs(moment).max()), 1e-300)
        ):
            raise ModelError(
                f"couple at '{self.at}': forces on nodes of one line have no moment about it; give more nodes, or "
                "edge_moment"
            )
        force = np.zeros_like(mesh.points)
        force[nodes] = np.cross(turn, arms)
        builder.bear(force, self.key)


def edges_at(mesh: SheetMesh, at: str, what: str) -> Ints:
    """(k,) rows of `mesh.topology.edges` of a named set.

    Args:
        mesh: has the set.
        at: its name.
        what: acts there, for the message.

    Raises:
        ModelError: there is no such set; the line names those there are.
    """
    if at not in mesh.edge_sets:
        raise ModelError(f"{what} at '{at}': no edges have that name; use one of {', '.join(mesh.edge_sets)}")
    return np.asarray(mesh.topology.find_edges(mesh.edge_sets[at]))


def _chosen(what: str, mesh: SheetMesh, triangles: Sequence[int] | None) -> Ints:
    count = len(mesh.triangles)
    if triangles is None:
        return np.arange(count)
    rows = np.asarray(triangles, dtype=np.int64)
    if rows.size == 0 or rows.min() < 0 or rows.max() >= count:
        raise ModelError(f"{what}: triangles must be numbers from 0 to {count - 1}, at least one")
    return np.unique(rows)


def _finite(what: str, values: Sequence[float], unit: str) -> None:
    numbers = [isinstance(value, int | float) and not isinstance(value, bool) for value in values]
    if not (all(numbers) and all(math.isfinite(value) for value in values)):
        raise ModelError(f"{what} is not finite; give numbers in {unit}")


def _vector(what: str, vector: Sequence[float], unit: str) -> None:
    if isinstance(vector, str) or len(vector) != 3:
        raise ModelError(f"{what} = {vector} cannot be; give three numbers [x, y, z] in {unit}")
    _finite(what, vector, unit)


def _keep(item: Actuation, key: str) -> None:
    """Lists, as files have them, become tuples of plain numbers, which can be compared and hashed."""
    value = getattr(item, key)
    if value is not None:
        object.__setattr__(item, key, tuple(np.asarray(value).tolist()))
