"""Element arrays of the consistent formulation: constant matrices of triangles, edge rotations, crease springs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bh.actuation import Ramp
from bh.errors import ModelError
from bh.mechanics.consistent_kernels import NONE, OWN, TURN, choose_sides
from bh.mechanics.kinematics import dihedral_angles
from bh.mechanics.stiffness import folding_hinge_stiffness
from bh.model import Model
from bh.program import HELD, SHEET, SPRING, StepProgram
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ConsistentElements:
    """Element arrays of one step; t triangles, h spring hinges, edge k of a triangle is opposite its corner k.

    Attributes:
        triangles: (t, 3) nodes.
        rest_square: (t, 3) squares of the edges' lengths in the stress-free sheet, mm^2.
        K: (t, 3, 3) energy of stretching 1/2 gamma.K.gamma, N / mm^3.
        B: (t, 3, 3) energy of bending 1/2 theta.B.theta, N mm; free edges are eliminated from it.
        kind, quad, ghost, place, rotation: what the angles theta are, see `bh.mechanics.consistent_kernels`.
        rest: (t, 3) rest dihedral angles of TURN edges, rad.
        nodes: (t, p) rows of the unknowns of an element: its corners, wings and (one row past the nodes) rotations.
        springs: (h,) rows of `mesh.topology.hinges`; `hinges` (h, 4) their nodes, `turns` (h, 2) their rotations.
        spring_stiffness: (h,) N mm / rad; spring_rest, couple: (h,) rest angles (rad) and applied couples (N mm).
        side_rotation: (m, 2) the rotation of each side of every hinge.
        held: (m,) held dihedral angles at every hinge, rad; nan where it is not held.
        rotations: how many there are.
    """

    triangles: Ints
    rest_square: Array
    K: Array
    B: Array
    kind: Ints
    quad: Ints
    ghost: Array
    place: Ints
    rotation: Ints
    rest: Ramp
    nodes: Ints
    springs: Ints
    hinges: Ints
    turns: Ints
    spring_stiffness: Array
    spring_rest: Ramp
    couple: Ramp
    side_rotation: Ints
    held: Ramp
    rotations: int

    @cached_property
    def spring_nodes(self) -> Ints:
        """(h, 5) rows of the unknowns of a spring: its nodes, and the row past the nodes for its rotations."""
        past = np.full((len(self.hinges), 1), self.nodes.max(initial=0))
        return np.hstack((self.hinges, past))


def triangle_frames(points: Array, triangles: Ints) -> tuple[Array, Array]:
    """(t, 3, 2) edge vectors in each triangle's own plane, edge k from corner k + 1 to k + 2, and areas (t,)."""
    corner = points[triangles]
    edge = np.roll(corner, 1, axis=1) - np.roll(corner, -1, axis=1)
    normal = np.cross(edge[:, 0], edge[:, 1])
    doubled = np.linalg.norm(normal, axis=1)
    e1 = edge[:, 0] / np.linalg.norm(edge[:, 0], axis=1)[:, None]
    e2 = np.cross(normal / doubled[:, None], e1)
    return np.stack((np.einsum("tki,ti->tk", edge, e1), np.einsum("tki,ti->tk", edge, e2)), axis=2), (
        0.5 * doubled
    )


def stretching_matrices(edges: Array, areas: Array, E: float, t: float, nu: float) -> Array:
    """(t, 3, 3) K of 1/2 gamma.K.gamma = 1/2 A t E:C:E in plane stress; gamma_k = e_k.E.e_k (N / mm^3).

    `edges` (t, 3, 2) as of `triangle_frames`. Three edges give the three components of a constant Green strain.
    """
    x, y = edges[..., 0], edges[..., 1]
    strain = np.linalg.inv(np.stack((x * x, y * y, 2.0 * x * y), axis=2))  # (E_xx, E_yy, E_xy) from gamma
    modulus = E * t / (1.0 - nu**2)
    C = modulus * np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 2.0 * (1.0 - nu)]])
    return np.einsum("t,tik,ij,tjl->tkl", areas, strain, C, strain, optimize=True)


def bending_matrices(edges: Array, areas: Array, D: float, nu: float) -> Array:
    """(t, 3, 3) B of 1/2 theta.B.theta = 1/2 A D ((1 - nu) kappa:kappa + nu tr(kappa)^2), N mm.

    kappa = (1/A) sum_k L_k theta_k mu_k (x) mu_k with the outward normals mu_k of the stress-free edges.
    """
    lengths = np.linalg.norm(edges, axis=2)
    tangent = edges / lengths[..., None]
    cosine = np.einsum("tki,tli->tkl", tangent, tangent)  # of the normals too, which are turned by a right angle
    weight = lengths[:, :, None] * lengths[:, None, :] * (D / areas)[:, None, None]
    return weight * ((1.0 - nu) * cosine**2 + nu)


def without_free_edges(B: Array, free: NDArray[np.bool_]) -> Array:
    """B after the rotations of `free` (t, 3) edges have taken their moments away (Schur complement)."""
    rows = np.flatnonzero(free.any(axis=1))
    if len(rows) == 0:
        return B
    out = B.copy()
    off = free[rows]
    either = off[:, :, None] | off[:, None, :]
    inverse = np.where(either, 0.0, np.linalg.inv(B[rows]))
    scale = np.trace(inverse, axis1=1, axis2=2)
    unit = np.where(scale > 0.0, scale, 1.0)[:, None, None] * np.eye(3)
    out[rows] = np.where(either, 0.0, np.linalg.inv(np.where(off[:, :, None] & either, unit, inverse)))
    return out


def consistent_elements(
    model: Model, program: StepProgram, held_start: Array, moment_start: Array
) -> ConsistentElements:
    """Element arrays of a model in one step; `held_start` and `moment_start` (m,) are what its creases begin with.

    Dihedral angles (rad) and total moments (N mm) of all hinges.

    Raises:
        ModelError: given element stiffness, or a couple on a crease that is no spring.
    """
    if model.stiffness is not None:
        raise ModelError("given bar and hinge stiffness is of bars-and-hinges only; use that formulation")
    mesh, sheet, law = model.mesh, model.sheet, program.law
    _check_moments(mesh, program)
    topology = mesh.topology
    edges, areas = triangle_frames(mesh.points, mesh.triangles)
    clamped = np.zeros(len(topology.edges), dtype=bool)
    clamped[program.constraints.clamped] = True
    clamped = clamped[topology.triangle_edges]
    hinge_of = topology.edge_hinges[topology.triangle_edges]
    free = (hinge_of < 0) & ~clamped
    side = (topology.edge_triangles[topology.triangle_edges, 0] != np.arange(len(areas))[:, None]).astype(int)

    spring = law == SPRING
    turning = choose_sides(topology.edge_triangles[topology.hinge_edges], ~spring, len(areas))
    turns = (hinge_of >= 0) & ~spring[hinge_of] & (turning[hinge_of] == side)
    kind = np.where(free, NONE, np.where(turns | clamped, TURN, OWN))
    side_rotation, rotations = _number_rotations(spring)
    rotation = np.where(hinge_of >= 0, side_rotation[hinge_of, side], -1)
    quad, place, nodes = _neighbourhoods(mesh, turns, clamped, hinge_of)

    reference = dihedral_angles(mesh.points, topology.hinges)
    held = Ramp(np.where(np.isnan(program.held.start), held_start, program.held.start), program.held.end)
    rest = [
        np.append(np.where(law == HELD, angle, reference), np.pi)[hinge_of] for angle in (held.start, held.end)
    ]
    springs = np.flatnonzero(spring)
    ends = mesh.points[topology.hinges[:, 1:3]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    k_fold = folding_hinge_stiffness(program.stiffness, length)[springs]
    begin = held_start[springs] - moment_start[springs] / np.where(k_fold == 0.0, np.inf, k_fold)
    begin = np.where(np.isnan(program.rest.start[springs]), begin, program.rest.start[springs])
    lengths = np.linalg.norm(edges, axis=2)
    D = sheet.bending_stiffness()
    return ConsistentElements(
        triangles=mesh.triangles, rest_square=lengths**2,
        K=stretching_matrices(edges, areas, sheet.E, sheet.t, sheet.nu),
        B=without_free_edges(bending_matrices(edges, areas, D, sheet.nu), free),
        kind=kind, quad=quad, ghost=_ghosts(mesh, clamped), place=place, rotation=rotation,
        rest=Ramp(*rest), nodes=nodes, springs=springs, hinges=np.ascontiguousarray(topology.hinges[springs]),
        turns=side_rotation[springs], spring_stiffness=k_fold, spring_rest=Ramp(begin, program.rest.end[springs]),
        couple=Ramp((program.moment.start * length)[springs], (program.moment.end * length)[springs]),
        side_rotation=side_rotation,
        held=Ramp(*(np.where(law == HELD, angle, np.nan) for angle in (held.start, held.end))), rotations=rotations,
    )  # fmt: skip


def _check_moments(mesh: SheetMesh, program: StepProgram) -> None:
    """Opposite couples on the two sides of an uncreased sheet do no work: its sides turn together."""
    idle = (program.law == SHEET) & ((program.moment.start != 0.0) | (program.moment.end != 0.0))
    if idle.any():
        edge = mesh.topology.hinges[int(np.argmax(idle)), 1:3].tolist()
        raise ModelError(
            f"the moment at edge {edge} acts on a crease that is ordinary sheet, which cannot fold; "
            "give the crease a stiffness or Lstar"
        )


def _number_rotations(spring: NDArray[np.bool_]) -> tuple[Ints, int]:
    """(m, 2) rotation of each side of every hinge, and their number: one a hinge, two at a spring crease."""
    first = np.cumsum(np.where(spring, 2, 1)) - np.where(spring, 2, 1)
    return np.column_stack((first, first + spring)), int(len(spring) + spring.sum())


def _neighbourhoods(
    mesh: SheetMesh, turns: NDArray[np.bool_], clamped: NDArray[np.bool_], hinge_of: Ints
) -> tuple[Ints, Ints, Ints]:
    """(quad, place, nodes) of `ConsistentElements`."""
    triangles, t = mesh.triangles, len(mesh.triangles)
    wings = max(int(turns.sum(axis=1).max(initial=0)), 1)
    nodes = np.full((t, 3 + wings + 1), len(mesh.points), dtype=np.int64)
    nodes[:, :3] = triangles
    slot = 2 + np.cumsum(turns, axis=1)
    quad = np.zeros((t, 3, 4), dtype=np.int64)
    place = np.zeros((t, 3, 4), dtype=np.int64)
    at, k = np.nonzero(turns)
    quad[at, k] = mesh.topology.hinges[hinge_of[at, k]]
    same = quad[at, k][:, :, None] == triangles[at][:, None, :]
    place[at, k] = np.where(same.any(axis=2), same.argmax(axis=2), slot[at, k][:, None])
    across = np.where(same.any(axis=2), 0, quad[at, k]).sum(axis=1)  # the one node that is not a corner
    nodes[at, slot[at, k]] = across
    at, k = np.nonzero(clamped)
    # corner, its opposite edge counter-clockwise, and a ghost that moves with the edge
    place[at, k] = np.column_stack((k, (k + 1) % 3, (k + 2) % 3, (k + 1) % 3))
    quad[at, k] = np.take_along_axis(triangles[at], place[at, k], axis=1)
    return quad, place, nodes


def _ghosts(mesh: SheetMesh, clamped: NDArray[np.bool_]) -> Array:
    """(t, 3, 3) where the sheet would go on across a clamped edge: its outward direction, as long as the edge, mm."""
    ghost = np.zeros((len(mesh.triangles), 3, 3))
    at, k = np.nonzero(clamped)
    corner = mesh.points[mesh.triangles[at]]
    rows = np.arange(len(at))
    a, b = corner[rows, (k + 1) % 3], corner[rows, (k + 2) % 3]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    ghost[at, k] = np.cross(b - a, normal)
    return ghost
