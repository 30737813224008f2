"""Nodes for elements of first and second order: the mesh as it is, or lifted.

A lifted mesh has a node in the middle of every edge, on the curve that the edge lies on. High-order shells need it:
with straight edges along a curved crease their energy is 10-40 % wrong and converges at first order only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from meshes.curves import Arc, Array, Curve, Line
from meshes.errors import MeshError
from meshes.mesh import SheetMesh
from meshes.topology import Ints

SAMPLES = 2001  # of a curve, for the first guess of a node's parameter
NEAR = 1e-6  # of the sheet's size: farther nodes are not on the curve


@dataclass(frozen=True, eq=False)
class LinearMesh:
    """A flat sheet of three-node triangles, under the names of `QuadraticMesh`.

    Raises:
        MeshError: the sheet is not flat.
    """

    sheet: SheetMesh

    degree = 1
    flat = True

    def __post_init__(self) -> None:
        """Refuse a sheet that is not flat."""
        plane_axes(self.sheet)

    @cached_property
    def planar(self) -> Array:
        """(n, 2) node positions along the axes of the sheet's plane, mm."""
        return _planar(self.sheet, self.nodes)

    @property
    def nodes(self) -> Array:
        """(n, 3) node positions, mm."""
        return self.sheet.points

    @property
    def triangles(self) -> Ints:
        """(t, 3) node numbers of every triangle."""
        return self.sheet.triangles

    @property
    def linear(self) -> SheetMesh:
        """The sheet itself; `QuadraticMesh.linear` cuts its triangles up."""
        return self.sheet

    @cached_property
    def carriers(self) -> Ints:
        """(t, 6) places that unknowns of an element belong to: its corners, then its edges, numbered from n."""
        return _with_edges(self.sheet)

    @cached_property
    def places(self) -> Array:
        """(n + e, 3) where these are, mm: the nodes, then the middles of the edges."""
        return np.vstack((self.sheet.points, self.sheet.points[self.sheet.topology.edges].mean(axis=1)))


@dataclass(frozen=True, eq=False)
class QuadraticMesh:
    """A sheet of six-node triangles, flat unless `lay_on` made it.

    Attributes:
        sheet: the mesh of its corners.
        nodes: (n + e, 3) node positions, mm: the n points of the sheet, then one node on each edge of its topology.
        triangles: (t, 6) corners, then the middle nodes of the edges opposite corners 0, 1 and 2.
        flat: whether the sheet lies in a plane.
    """

    sheet: SheetMesh
    nodes: Array
    triangles: Ints
    flat: bool = True

    degree = 2

    @cached_property
    def planar(self) -> Array:
        """(n + e, 2) node positions along the axes of the sheet's plane, mm."""
        return _planar(self.sheet, self.nodes)

    @property
    def carriers(self) -> Ints:
        """(t, 6) places that unknowns of an element belong to: its corners, then its edges, numbered from n."""
        return self.triangles

    @property
    def places(self) -> Array:
        """(n + e, 3) where these are, mm."""
        return self.nodes

    @cached_property
    def linear(self) -> SheetMesh:
        """Every triangle as four on the same nodes, with the same named places."""
        corner, middle = self.triangles[:, :3], self.triangles[:, 3:]
        (a, b, c), (d, e, f) = corner.T, middle.T
        parts = ((a, f, e), (f, b, d), (e, d, c), (d, e, f))
        sheet = self.sheet
        return replace(
            sheet,
            points=self.nodes,
            triangles=np.column_stack([np.column_stack(part) for part in parts]).reshape(-1, 3),
            edge_sets={name: self._halves(pairs) for name, pairs in sheet.edge_sets.items()},
            fold_angles={name: np.repeat(angles, 2) for name, angles in sheet.fold_angles.items()},
            spans=None,
        )

    def _halves(self, pairs: Ints) -> Ints:
        middle = len(self.sheet.points) + self.sheet.topology.find_edges(pairs)
        return np.column_stack((pairs[:, 0], middle, middle, pairs[:, 1])).reshape(-1, 2)


ElementMesh = LinearMesh | QuadraticMesh
Surface = Callable[[Array], Array]  # (k, 2) points of a chart to (k, 3) points of a surface, mm


def _planar(sheet: SheetMesh, nodes: Array) -> Array:
    axes = plane_axes(sheet)
    return nodes[:, :2] if axes[2, 2] == 1.0 else nodes @ axes[:2].T


def _with_edges(mesh: SheetMesh) -> Ints:
    return np.column_stack((mesh.triangles, len(mesh.points) + mesh.topology.triangle_edges))


def plane_axes(mesh: SheetMesh) -> Array:
    """(3, 3) axes of the plane that a sheet lies in, anywhere in space: two in it, then its normal.

    Triangles are counter-clockwise from the normal's side. For a sheet in a plane z = const, so seen from +z, they are
    x, y and z.

    Raises:
        MeshError: the sheet is not flat.
    """
    corners = mesh.points[mesh.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
    normal /= max(float(np.linalg.norm(normal)), 1e-300)
    height = (mesh.points - mesh.points.mean(axis=0)) @ normal
    if float(np.abs(height).max()) > 1e-9 * mesh.size:
        raise MeshError("the shell takes only a sheet that is flat; unfold it first")
    if normal[2] > 1.0 - 1e-15:
        return np.eye(3)
    first = np.eye(3)[int(np.argmin(np.abs(normal)))]
    first = first - (first @ normal) * normal
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(normal, first), normal])


def lift(mesh: SheetMesh) -> QuadraticMesh:
    """Lift a flat sheet to second order on the curves of its edge sets.

    Args:
        mesh: a flat sheet; `mesh.curves` holds the exact curve of an edge set where there is one.

    Returns:
        The mesh with a node in the middle of every edge. Edges without a curve stay straight.

    Raises:
        MeshError: the sheet is not flat, an edge set does not lie on its curve, or a curved edge turns a
            triangle inside out (the mesh is too coarse for its curves).
    """
    middle = edge_middles(mesh)
    lifted = QuadraticMesh(mesh, np.vstack((mesh.points, middle)), _with_edges(mesh))
    _check_orientation(lifted)
    return lifted


def lay_on(chart: SheetMesh, surface: Surface) -> QuadraticMesh:
    """A surface that is not flat: every node of a lifted chart, the middles of its edges too, put where it is.

    Args:
        chart: a flat mesh; its lengths mean nothing, its named places are those of the surface.
        surface: maps the chart to the surface, one to one; triangles that are counter-clockwise in the chart are so
            from the side of the surface's normal.

    Returns:
        The mesh, with `sheet` the corners on the surface.

    Raises:
        MeshError: as `lift`, a surface that gives no points in space, or leaves triangles no area.
    """
    lifted = lift(chart)
    nodes = np.asarray(surface(lifted.planar), dtype=float)
    if nodes.shape != lifted.nodes.shape or not np.isfinite(nodes).all():
        raise MeshError("a surface has to map (k, 2) points of its chart to (k, 3) finite points, mm")
    sheet = replace(chart, points=nodes[: len(chart.points)], curves={}, spans=None, drawn=None)
    return QuadraticMesh(sheet, nodes, lifted.triangles, flat=False)


def edge_middles(mesh: SheetMesh) -> Array:
    """(e, 3) the middle of every edge of the topology, mm: on the curve that the edge lies on, else of its chord.

    Raises:
        MeshError: the sheet is not flat, or an edge set does not lie on its curve.
    """
    plane_axes(mesh)
    try:
        return _middles(mesh, mesh.points, NEAR * mesh.size)
    except MeshError:
        move = _moved(mesh)
        if move is None:
            raise
        scale, turn, shift = move
        assert mesh.drawn is not None
        middle: Array = scale * _middles(mesh, mesh.drawn, NEAR * mesh.size / scale) @ turn.T + shift
        return middle


def _middles(mesh: SheetMesh, points: Array, near: float) -> Array:
    """(e, 3) middles of the edges between points (n, 3), on their curves."""
    ends = points[mesh.topology.edges]
    middle: Array = ends.mean(axis=1)
    for name, curve in mesh.curves.items():
        if name not in mesh.edge_sets or isinstance(curve, Line):
            continue
        edges = mesh.topology.find_edges(mesh.edge_sets[name])
        middle[edges, :2] = _middle(name, curve, ends[edges, :, :2], near)
    return middle


def _moved(mesh: SheetMesh) -> tuple[float, Array, Array] | None:
    """Scale, rotation (3, 3) and shift (3,) from where a mesh was drawn to where it is; None if it has another shape.

    The best rotation of one set of points onto another is a polar decomposition (Kabsch 1976).
    """
    if mesh.drawn is None:
        return None
    from_, to = mesh.drawn.mean(axis=0), mesh.points.mean(axis=0)
    a, b = mesh.drawn - from_, mesh.points - to
    scale = float(np.linalg.norm(b) / np.linalg.norm(a))
    left, _, right = np.linalg.svd(b.T @ a)
    turn = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    if float(np.abs(scale * a @ turn.T - b).max()) > NEAR * mesh.size:
        return None
    return scale, turn, to - scale * turn @ from_


def _middle(name: str, curve: Curve, ends: Array, near: float) -> Array:
    """(k, 2) points on the curve halfway between (k, 2, 2) points on it."""
    if isinstance(curve, Arc):
        centre = np.asarray(curve.centre)
        off = np.abs(np.linalg.norm(ends - centre, axis=2) - curve.radius).max(initial=0.0)
        _check_on_curve(name, float(off), near)
        out = ends.mean(axis=1) - centre
        middle: Array = centre + curve.radius * out / np.linalg.norm(out, axis=1, keepdims=True)
        return middle
    u, off = _parameters(curve, ends.reshape(-1, 2))
    _check_on_curve(name, off, near)
    first, second = u.reshape(-1, 2).T
    if curve.closed:  # the short way round
        second = second - np.round(second - first)
    return curve.point(np.mod(0.5 * (first + second), 1.0) if curve.closed else 0.5 * (first + second))


def _check_on_curve(name: str, off: float, near: float) -> None:
    if off > near:
        raise MeshError(f"the nodes of '{name}' are {off:.3g} mm off its curve; mesh along the curve")


def _parameters(curve: Curve, points: Array) -> tuple[Array, float]:
    """Parameters u of points on a curve, by a search among samples that is narrowed down; and the largest distance."""
    u = np.linspace(0.0, 1.0, SAMPLES)
    samples = curve.point(u)
    best = np.array([u[int(np.argmin(((samples - p) ** 2).sum(axis=1)))] for p in points])
    reach = 1.0 / (SAMPLES - 1)
    for _ in range(40):
        trial = np.clip(best[:, None] + reach * np.array([-1.0, -0.5, 0.0, 0.5, 1.0]), 0.0, 1.0)
        at = curve.point(trial.ravel()).reshape(len(points), 5, 2)
        distance = np.linalg.norm(at - points[:, None, :], axis=2)
        best = trial[np.arange(len(points)), distance.argmin(axis=1)]
        reach *= 0.5
    return best, float(distance.min(axis=1).max(initial=0.0))


def _check_orientation(mesh: QuadraticMesh) -> None:
    """The Jacobian of the quadratic map keeps its sign at corners and middles of edges."""
    x = mesh.planar[mesh.triangles]
    corners = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0.5, 0.5], [0.5, 0, 0.5], [0.5, 0.5, 0]])
    slope = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    for b in corners:
        g = np.empty((6, 2))
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            g[k] = (4.0 * b[k] - 1.0) * slope[k]
            g[3 + k] = 4.0 * (b[i] * slope[j] + b[j] * slope[i])
        jacobian = np.linalg.det(np.einsum("tnc,nd->tcd", x, g))
        if (jacobian <= 0.0).any():
            row = int(np.argmin(jacobian))
            nodes = mesh.triangles[row, :3].tolist()
            at, off = x[row, :3].mean(axis=0)
            raise MeshError(
                f"triangle {row} (nodes {nodes}) near ({at:.6g}, {off:.6g}) is turned inside out by its curved edge; "
                "use a finer mesh there"
            )
