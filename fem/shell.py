"""Elements of the nonlinear Kirchhoff-Love shell: generalised strains and curvatures, and their stiffness.

Weak form in docs/fem.md. An element with quadratic positions has 18 measures and 18 forces conjugate to them, linear in
each other:

- 9 membrane strains: Green's strain x_,a . x_,b / 2 - X_,a . X_,b / 2 of the quadratic positions, interpolated to the
  linear Regge space (Neunteufel and Schoeberl 2021), exactly quadratic in the nodes; forces N = membrane . strain;
- 9 curvatures, one for each linear moment tensor sigma of the Hellan-Herrmann-Johnson space (Neunteufel and Schoeberl
  2019): int_T sigma : (nu . x_,ab) - int_dT sigma_nn (theta - gamma) ds, with theta the angle of the element's outward
  conormal to the frame of the edge and gamma the rotation of that side of the edge, an unknown: the hybridised form
  in which moments are local to the element. Condensing them leaves m = bending . curvature and the energy 1/2
  curvature . m.

So the energy of the sheet is a plain minimum over positions and edge rotations, and keeping the forces as independent
variables in Newton's method is the mixed method itself.

With linear positions: 3 strains and 3 curvatures, all constant. Shapes below: n nodes, m functions with each of
three tensors, r rotations an edge (`fem.spaces.Tables`); n = 6, m = 3, r = 2 or n = 3, m = 1, r = 1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bh.model.sheet import Sheet
from bh.model.zones import Sections, SheetZone, sections
from fem import grain, kernels
from fem import sections as by_triangle
from fem.kernels import Frames, Loops
from fem.spaces import MOMENTS, STRAINS, Tables, tables
from meshes.curved import ElementMesh, plane_axes
from meshes.topology import Ints

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ShellElements:
    """Elements of a sheet; t triangles, q points inside, p points on an edge.

    Attributes:
        membrane: (t, 3 m, 3 m) stiffness against generalised strains.
        bending: (t, 3 m, 3 m) stiffness against generalised curvatures.
        strain0: (t, 3 m) strains that the metric of the stress-free sheet would have.
        lengths: (e,) lengths of the (curved) edges, mm.
        areas: (t,) of the stress-free triangles, mm^2.
        edge_fit: (e, r, p) rotations of edges whose angles at the points of the edge come nearest to given ones.
        coupling: (t, 3 m, 3 m) energy strain . coupling . curvature of laminates, or None.
        curvature0: (t, 3 m) curvatures of the stress-free sheet, 1/mm; None where it is flat.
    """

    mesh: ElementMesh
    tables: Tables
    loops: Loops
    membrane: Array
    bending: Array
    strain0: Array
    lengths: Array
    areas: Array
    edge_fit: Array
    coupling: Array | None = None
    curvature0: Array | None = None

    @property
    def moves(self) -> int:
        """Coordinates of an element's nodes."""
        return 3 * self.tables.nodes

    @property
    def width(self) -> int:
        """Coordinates and side rotations of an element."""
        return self.moves + 3 * self.tables.rotations

    def measures(self, x: Array, gamma: Array, frames: Frames) -> tuple[Array, Array]:
        """Strains and curvatures, (t, 3 m) each, at positions x (n, 3) and side rotations gamma (t, 3, r), rad.

        Args:
            x: (n, 3) positions, mm.
            gamma: (t, 3, r) side rotations, rad.
            frames: of the edges.
        """
        strain, curvature = np.empty_like(self.strain0), np.empty_like(self.strain0)
        kernels.measures(x, gamma, self.loops, frames, strain, curvature)
        return strain - self.strain0, curvature if self.curvature0 is None else curvature - self.curvature0

    def gradients(self, x: Array, frames: Frames) -> Array:
        """(t, 6 m, w) derivatives of strains and curvatures by positions and side rotations, w = `width`.

        Args:
            x: (n, 3) positions, mm.
            frames: of the edges.
        """
        B = np.empty((len(self.areas), 2 * self.tables.measures, self.width))
        kernels.gradients(x, self.loops, frames, B)
        return B

    def forces(self, strain: Array, curvature: Array) -> Array:
        """(t, 6 m) forces conjugate to the measures.

        Args:
            strain: (t, 3 m).
            curvature: (t, 3 m), 1/mm.
        """
        out = np.concatenate(
            (
                (self.membrane @ strain[:, :, None])[..., 0],
                (self.bending @ curvature[:, :, None])[..., 0],
            ),
            axis=1,
        )
        if self.coupling is not None:
            other = np.swapaxes(self.coupling, 1, 2)
            out += np.hstack(
                ((self.coupling @ curvature[:, :, None])[..., 0], (other @ strain[:, :, None])[..., 0])
            )
        return out

    def tangent(self, x: Array, forces: Array, B: Array, frames: Frames) -> Array:
        """(t, w, w) element tangents with the given forces (t, 6 m) in their geometric part.

        Args:
            x: (n, 3) positions of all nodes, mm.
            forces: (t, 6 m) conjugate to strains and curvatures.
            B: (t, 6 m, w) gradients there.
            frames: of the step.
        """
        K = np.zeros((len(self.areas), self.width, self.width))
        kernels.add_material(B, self.membrane, self.bending, K)
        if self.coupling is not None:
            stretch, bend = np.split(B, 2, axis=1)
            mixed = np.swapaxes(stretch, 1, 2) @ self.coupling @ bend
            K += mixed + np.swapaxes(mixed, 1, 2)
        kernels.add_geometric(x, forces, self.loops, frames, K)
        return K


def shell_elements(mesh: ElementMesh, sheet: Sheet, zones: tuple[SheetZone, ...] = ()) -> ShellElements:
    """Elements of a sheet; the mesh says of which degree.

    Args:
        mesh: of the stress-free sheet, of first or second order.
        sheet: material and thickness.
        zones: parts of it that are made of something else.

    Raises:
        ModelError: a zone that has no triangle, or two that share one.
    """
    table = tables(mesh.degree)
    X = (mesh.planar if mesh.flat else mesh.nodes)[mesh.triangles]
    F = maps(mesh, table.slopes)
    J = np.linalg.det(F)
    tangent = np.einsum("tnc,jpn->tjpc", X, table.along)
    speed = np.linalg.norm(tangent, axis=-1)
    edges = mesh.sheet.topology.triangle_edges
    corners = mesh.sheet.triangles
    sides = np.where(np.roll(corners, -1, axis=1) < np.roll(corners, -2, axis=1), 1.0, -1.0)
    lengths = np.empty(len(mesh.sheet.topology.edges))
    lengths[edges] = speed @ table.edge_weights
    rim = table.edge_weights / speed
    inside = table.weights / J if mesh.degree > 1 else np.empty((len(edges), 0))  # linear shapes do not bend
    loops = Loops(
        nodes=mesh.triangles,
        edges=np.ascontiguousarray(edges),
        sides=sides,
        inside=inside,
        rim=rim,
        Q=table.Q,
        factors=np.ascontiguousarray(table.factors),
        slopes=np.ascontiguousarray(table.slopes.transpose(0, 2, 1)),
        bend=np.ascontiguousarray(table.bend.T),
        S=table.S,
        along=table.along,
        across=table.across,
        turn=table.turn,
    )
    membrane, bending, coupling = _stiffness(table, F, J, sections(mesh.sheet, sheet, zones))
    elements = ShellElements(
        mesh,
        table,
        loops,
        membrane,
        bending,
        np.zeros((len(edges), table.measures)),
        lengths,
        J @ table.weights,
        _edge_fit(table, rim, edges, sides),
        coupling,
    )
    flat = np.zeros((len(edges), 3, table.rotations))
    strain0, curvature0 = elements.measures(mesh.nodes, flat, first_frames(mesh))
    return replace(elements, strain0=strain0, curvature0=None if mesh.flat else curvature0)


def maps(mesh: ElementMesh, slopes: Array) -> Array:
    """(t, q, 2, 2) gradients of the maps from the reference triangle to the stress-free sheet, mm.

    Args:
        mesh: of the elements.
        slopes: (q, n, 2) derivatives of the shapes at the points.

    Returns:
        In the axes of the drawing; of a surface that is not flat in those of its tangent plane at each point, the
        first along the line that leads there from corner 0 toward corner 1.
    """
    if mesh.flat:
        out: Array = np.einsum("tnc,qnd->tqcd", mesh.planar[mesh.triangles], slopes)
        return out
    g, h = np.einsum("tnc,qnd->dtqc", mesh.nodes[mesh.triangles], slopes)
    first = unit(g)
    along = (h * first).sum(axis=-1)
    away = np.linalg.norm(h - along[..., None] * first, axis=-1)
    rows = (np.linalg.norm(g, axis=-1), along), (np.zeros_like(away), away)
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _stiffness(table: Tables, F: Array, J: Array, made_of: Sections) -> tuple[Array, Array, Array | None]:
    """Of membrane, bending and both, (t, 3 m, 3 m) each, with F (t, q, 2, 2) and J (t, q) of the flat sheet."""
    sheet = made_of.sheets[0]
    if by_triangle.needed(made_of):
        bases = _basis(table, STRAINS), _basis(table, MOMENTS)
        found = by_triangle.matrices(made_of.sheets)
        return by_triangle.stiffness(*bases, table.weights, F, J, found, made_of)
    if sheet.grain is not None:
        return (
            grain.membrane_stiffness(_basis(table, STRAINS), table.weights, F, J, sheet),
            grain.bending_stiffness(_basis(table, MOMENTS), table.weights, F, J, sheet),
            None,
        )
    metric = np.einsum("tqca,tqcb->tqab", F, F)
    return membrane_stiffness(table, metric, J, sheet), bending_stiffness(table, metric, J, sheet), None


def _edge_fit(table: Tables, rim: Array, edges: Ints, sides: Array) -> Array:
    """(e, r, p) see `ShellElements`: least squares with the weights (t, 3, p) with which curvatures are measured."""
    weights = np.empty((int(edges.max()) + 1, len(table.s)))
    weights[edges] = np.where(
        sides[..., None] > 0.0, rim, rim[..., ::-1]
    )  # from the lower to the higher node
    weighted = weights[:, None] * table.turn
    return np.asarray(np.linalg.solve(weighted @ table.turn.T, weighted))


def _basis(table: Tables, tensors: Array) -> Array:
    """(q, 3 m, 2, 2) tensor functions at the points inside."""
    out = table.factors[..., None, None] * tensors[:, None]
    return out.reshape(len(out), -1, 2, 2)


def membrane_stiffness(table: Tables, metric: Array, J: Array, sheet: Sheet) -> Array:
    """Stiffness against generalised strains, with C = E t / (1 - nu^2) [(1 - nu) eps : eps + nu tr(eps)^2].

    Args:
        table: of the degree of the mesh.
        metric: (t, q, 2, 2) of the flat sheet at the points inside, mm^2.
        J: (t, q) Jacobian there, mm^2.
        sheet: material and thickness.

    Returns:
        (t, 3 m, 3 m) of int C:eps:eps dA; eps covariant.
    """
    stiffness = sheet.E * sheet.t / (1.0 - sheet.nu**2)
    raised = np.linalg.inv(metric)
    eps = _basis(table, STRAINS)
    mixed = np.einsum("tqab,qkbc->tqkac", raised, eps)  # eps^a_c
    trace = np.einsum("tqkaa->tqk", mixed)
    weight = stiffness * table.weights * J
    out: Array = (1.0 - sheet.nu) * np.einsum("tq,tqkab,tqlba->tkl", weight, mixed, mixed, optimize=True)
    out += sheet.nu * np.einsum("tq,tqk,tql->tkl", weight, trace, trace, optimize=True)
    return 0.5 * (out + out.transpose(0, 2, 1))


def bending_stiffness(table: Tables, metric: Array, J: Array, sheet: Sheet) -> Array:
    """Stiffness against generalised curvatures: the inverse of a compliance.

    Args:
        table: of the degree of the mesh.
        metric: (t, q, 2, 2) of the flat sheet at the points inside, mm^2.
        J: (t, q) Jacobian there, mm^2.
        sheet: material and thickness.

    Returns:
        (t, 3 m, 3 m) inverse of int 12 / (E t^3) [(1 + nu) sigma : sigma - nu tr(sigma)^2] dA, sigma = F s
        F^T / J^2.
    """
    compliance = 12.0 / (sheet.E * sheet.t**3)
    lowered = np.einsum("tqab,qkbc->tqkac", metric, _basis(table, MOMENTS))
    trace = np.einsum("tqkaa->tqk", lowered)
    weight = compliance * table.weights / J**3
    flexibility = (1.0 + sheet.nu) * np.einsum("tq,tqkab,tqlba->tkl", weight, lowered, lowered, optimize=True)
    flexibility -= sheet.nu * np.einsum("tq,tqk,tql->tkl", weight, trace, trace, optimize=True)
    out: Array = np.linalg.inv(flexibility)
    return 0.5 * (out + out.transpose(0, 2, 1))


def edge_tangents(mesh: ElementMesh, x: Array) -> Array:
    """(e, p, 3) derivatives of positions x (n, 3) along every edge, from its lower to its higher node, mm.

    Args:
        mesh: of the elements.
        x: (n, 3) positions, mm.
    """
    s = tables(mesh.degree).s
    edges = mesh.sheet.topology.edges
    low, high, middle = x[edges[:, 0]], x[edges[:, 1]], x[len(mesh.sheet.points) :]
    if mesh.degree == 1:
        return np.repeat((high - low)[:, None], len(s), axis=1)
    ds = np.stack((4.0 * s - 3.0, 4.0 - 8.0 * s, 4.0 * s - 1.0))
    return np.asarray(np.einsum("kp,kec->epc", ds, np.stack((low, middle, high))))


def side_normals(mesh: ElementMesh, x: Array) -> tuple[Array, Array]:
    """(t, 3, 3) tangents, counter-clockwise, and normals of each triangle at the middles of its edges, mm and mm^2.

    Args:
        mesh: of the elements.
        x: (n, 3) positions, mm.
    """
    table = tables(mesh.degree)
    middle, xe = len(table.s) // 2, x[mesh.triangles]  # Gauss points are odd in number
    tau = np.einsum("jn,tnc->tjc", table.along[:, middle], xe)
    return tau, np.cross(tau, np.einsum("jn,tnc->tjc", table.across[:, middle], xe))


def unit(vectors: Array) -> Array:
    """Vectors (..., 3) of length one in the directions of the given ones.

    Returns:
        of the shape of `vectors`.
    """
    out: Array = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return out


def first_frames(mesh: ElementMesh) -> Frames:
    """Frames of the stress-free sheet: its own normal; where it is not flat the mean of both sides'.

    Which normal does not matter (the energy does not depend on the frames), but that none is far from its edges' own.
    """
    t0 = unit(edge_tangents(mesh, mesh.nodes))
    if mesh.flat:
        return Frames(t0, np.ascontiguousarray(np.broadcast_to(plane_axes(mesh.sheet)[2], t0.shape)))
    normal = np.zeros((len(t0), 1, 3))
    np.add.at(normal[:, 0], mesh.sheet.topology.triangle_edges, unit(side_normals(mesh, mesh.nodes)[1]))
    return Frames(t0, unit(normal - (normal * t0).sum(axis=-1, keepdims=True) * t0))


def carried_frames(mesh: ElementMesh, frames: Frames, x: Array, alpha: Array) -> Frames:
    """Frames that went with the edges to positions x and turned with their rotations alpha (e, r).

    With them the same state has alpha = 0 and the same measures, exactly.

    Args:
        mesh: elements.
        frames: where the step begins.
        x: (n, 3) positions of all nodes, mm.
        alpha: (e, r) rotations of the edges, rad.
    """
    t = unit(edge_tangents(mesh, x))
    along = np.einsum("epc,epc->ep", frames.d0, t) / (1.0 + np.einsum("epc,epc->ep", frames.t0, t))
    d = frames.d0 - along[..., None] * (frames.t0 + t)
    angle = alpha @ tables(mesh.degree).turn
    turned = np.cos(angle)[..., None] * d - np.sin(angle)[..., None] * np.cross(t, d)
    return Frames(t, unit(turned))


def flat_stiffness(e: ShellElements, mesh: ElementMesh) -> tuple[float, float, float]:
    """Of the stress-free sheet, from element stiffness that is never formed as a whole.

    Args:
        e: its elements.
        mesh: they are of.

    Returns:
        a scale of energy, N mm, and the largest force, N, and moment on an edge, N mm, a mm of displacement of a node.
    """
    B = e.gradients(mesh.nodes, first_frames(mesh))
    count, moves = e.tables.measures, e.moves
    stretch, move, turn = B[:, :count, :moves], B[:, count:, :moves], B[:, count:, moves:]
    moments = e.bending @ turn
    # no entry of a semi-definite matrix is larger than the largest on its diagonal
    push = (stretch * (e.membrane @ stretch)).sum(axis=1) + (move * (e.bending @ move)).sum(axis=1)
    couple = np.abs(moments.transpose(0, 2, 1) @ move)
    if e.coupling is not None:  # rounded strains turn edges, too
        push = push + 2.0 * np.abs((stretch * (e.coupling @ move)).sum(axis=1))
        couple = couple + np.abs((e.coupling @ turn).transpose(0, 2, 1) @ stretch)
    return 0.5 * float((turn * moments).sum()), float(push.max()), float(couple.max())
