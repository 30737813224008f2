"""Element arrays of the consistent formulation in one step: triangles, patches, edge rotations, crease springs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.state import State
from bh.loading.load_step import LoadStep
from bh.materials import Constant, LinearElastic, Material
from bh.mechanics.bars_and_hinges.stiffness import bending_hinge_stiffness, folding_hinge_stiffness
from bh.mechanics.consistent.bending import Bending
from bh.mechanics.consistent.clamps import Clamps, clamps
from bh.mechanics.consistent.coupling import Coupling, sheet_coupling
from bh.mechanics.consistent.growth import Growth, sheet_growth, with_growth
from bh.mechanics.consistent.kernels import OWN, TURN
from bh.mechanics.consistent.membrane import Measure, smoothed_strain
from bh.mechanics.consistent.patches import (
    Patches,
    bending_matrices,
    curvature_maps,
    frame_angles,
    patches,
    triangle_frames,
)
from bh.mechanics.consistent.sections import SheetLaws, sheet_laws
from bh.mechanics.consistent.stretching import Stretching
from bh.mechanics.shared.hinge_lock import ZONE, until_closed
from bh.mechanics.shared.kinematics import dihedral_angles
from bh.model.laws import PRESCRIBED, SHEET, SPRING
from bh.model.model import Model
from bh.model.ramp import Ramp
from bh.solvers.matrices import reverse_cuthill_mckee
from meshes import SheetMesh
from meshes.topology import Ints

if TYPE_CHECKING:
    from bh.loading.symmetry import Mirror

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
LINEAR = LinearElastic()


@dataclass(frozen=True, eq=False)
class ConsistentElements:
    """Element arrays of one step: t triangles, c patches with a angles, h spring hinges.

    Attributes:
        members: (t,) which triangles of the mesh these are; triangles: (t, 3) nodes; edge k is opposite corner k.
        heights: (t, 3) of the triangles on their edges in the stress-free sheet, mm.
        stretching: cells of the membrane and their law; `bending` patches and theirs.
        B_triangle: (t, 3, 3) energy of bending of a triangle by the angles at its edges, N mm.
        patches: matrices and angles of the patches.
        quad, ghost, place, rotation, column: of the angles, see `bh.mechanics.consistent.kernels`.
        rest: (c, a) rest dihedral angles of TURN angles, rad.
        nodes: (c, p) nodes of the matrix of a patch, then -1; `width` (c,) its number of rows, rotations included.
        springs: (h,) rows of `mesh.topology.hinges`; `hinges` (h, 4) their nodes, `turns` (h, 2) their rotations.
        spring_stiffness: (h,) N mm / rad; spring_rest, couple: (h,) rest angles (rad) and applied couples (N mm).
        prescribed: (m,) prescribed dihedral angles at every hinge, rad; nan where it is not prescribed.
        lock: (m,) stiffness of the locks of hinges that close, N mm / rad; zero at prescribed ones.
        rotations: how many there are.
        growth: what is at rest where, of a sheet that is not at rest as it is drawn.
        coupling: of laminates; triangles are then patches of their own.
        turning: (rotations,) couples on edges, on the rotations of those edges, N mm.
        let_go: (rotations,) couples of clamps that are let go of, where the step begins, N mm.
    """

    members: Ints
    triangles: Ints
    heights: Array
    stretching: Stretching
    bending: Bending
    B_triangle: Array
    patches: Patches
    quad: Ints
    ghost: Array
    place: Ints
    rotation: Ints
    column: Ints
    rest: Ramp
    nodes: Ints
    width: Ints
    springs: Ints
    hinges: Ints
    turns: Ints
    spring_stiffness: Array
    spring_rest: Ramp
    couple: Ramp
    prescribed: Ramp
    lock: Array
    rotations: int
    turning: Ramp
    let_go: Array
    growth: Growth | None = None
    coupling: Coupling | None = None


def consistent_elements(
    model: Model,
    load_step: LoadStep,
    prescribed_start: Array,
    moment_start: Array,
    plane: Mirror | None = None,
    measure: Measure = smoothed_strain,
    material: Material = LINEAR,
    start: State | None = None,
) -> ConsistentElements:
    """Element arrays of a model in one step.

    Args:
        model: of the sheet.
        load_step: actuations of the step.
        prescribed_start: (m,) dihedral angles of all hinges at the start, rad.
        moment_start: (m,) total moments of all hinges at the start, N mm.
        plane: of the symmetry, for the half of a sheet (`bh.mechanics.shared.mirrored`); None for all.
        measure: of the strain.
        material: laws of strain and of curvature.
        start: the state that the step begins at, for clamps as it lies; None for the stress-free sheet.

    Raises:
        ModelError: given element stiffness, a couple on a crease that is no spring, or a grain that the material does
            not know.
    """
    if model.stiffness is not None:
        raise ModelError("given bar and hinge stiffness is of bars-and-hinges only; use that formulation")
    mesh, law = model.mesh, load_step.law
    _check_moments(mesh, load_step)
    topology = mesh.topology
    edges, areas = triangle_frames(mesh.points, mesh.triangles)
    laws = sheet_laws(material, model.sections, mesh)
    maps, angle = curvature_maps(edges, areas), frame_angles(mesh.points, mesh.triangles)
    B = bending_matrices(
        maps, areas, laws.of_triangles(np.arange(len(areas)), angle).moduli(np.zeros((len(areas), 3)))
    )
    held, spring = clamps(mesh, load_step, start), law == SPRING
    part = None if plane is None else plane.triangle_weight
    condense = isinstance(laws.bending[0], Constant) and laws.coupling is None
    joined = patches(mesh, B, spring, held.edges, triangle_ranks(mesh), group=part, condense=condense)
    if plane is not None:
        from bh.mechanics.consistent.half import half_patches

        joined = half_patches(joined, spring, plane)
    rotation, turns, rotations, turning, let_go = _number_rotations(mesh, joined, spring, plane, held)
    part_area = areas if part is None else part * areas
    membrane = measure(mesh, creased(mesh, law) | model.sections.borders(mesh))
    bending_law = laws.of_triangles(joined.members[:, 0], angle[joined.members[:, 0]])
    quad, ghost = _quads(mesh, joined, held.outward)
    nodes, place = _rows(joined, quad)
    has = rotation >= 0
    in_nodes = 3 * (nodes >= 0).sum(axis=1)
    column = np.where(has, in_nodes[:, None] + np.cumsum(has, axis=1) - 1, -1)
    width = in_nodes + has.sum(axis=1)
    # local axes are turned in blocks of three rows: there must be as many nodes, be they none
    nodes = np.pad(nodes, ((0, 0), (0, -(-int(width.max()) // 3) - nodes.shape[1])), constant_values=-1)

    prescribed = load_step.prescribed_angles(prescribed_start)
    springs, k_fold, spring_rest, couple = _springs(mesh, load_step, spring, prescribed_start, moment_start)
    stretching = Stretching(membrane, laws, mesh.points)
    growth = sheet_growth(mesh, load_step.growth, stretching, maps, angle)
    rest = with_growth(_rest(mesh, joined, law, prescribed), mesh, growth, joined.hinge, joined.half_edge)
    spring_rest = with_growth(spring_rest, mesh, growth, springs)
    whole = ConsistentElements(
        members=np.arange(len(mesh.triangles)), triangles=mesh.triangles,
        heights=2.0 * areas[:, None] / np.linalg.norm(edges, axis=2),
        stretching=stretching,
        bending=Bending(joined, bending_law, maps, part_area, quad, ghost, rotation), B_triangle=B, patches=joined,
        quad=quad, ghost=ghost, place=place, rotation=rotation, column=column, width=width, nodes=nodes,
        rest=rest, springs=springs,
        hinges=np.ascontiguousarray(topology.hinges[springs]), turns=turns[springs],
        spring_stiffness=k_fold, spring_rest=spring_rest,
        couple=couple,
        prescribed=Ramp(*(np.where(law == PRESCRIBED, at, np.nan) for at in (prescribed.start, prescribed.end))),
        lock=lock_stiffness(model, load_step), rotations=rotations, turning=turning, let_go=let_go, growth=growth,
        coupling=_coupling(model, laws, stretching, maps, angle, growth, plane),
    )  # fmt: skip
    return whole if plane is None else _half(whole, plane)


def _coupling(
    model: Model,
    laws: SheetLaws,
    stretching: Stretching,
    maps: Array,
    angle: Array,
    growth: Growth | None,
    plane: Mirror | None,
) -> Coupling | None:
    if laws.coupling is None:
        return None
    if plane is not None:
        raise ModelError("a laminate that couples is not solved by halves; leave out symmetry")
    B = np.broadcast_to(model.sections.each(list(laws.coupling)), (len(maps), 3, 3))
    return sheet_coupling(model.mesh, B, stretching, maps, angle, growth)


def _springs(
    mesh: SheetMesh, load_step: LoadStep, spring: Bools, prescribed_start: Array, moment_start: Array
) -> tuple[Ints, Array, Ramp, Ramp]:
    """Rows (h,) of springs, stiffness (N mm / rad), rest angles (rad) and couples (N mm)."""
    springs = np.flatnonzero(spring)
    ends = mesh.points[mesh.topology.hinges[:, 1:3]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    k_fold = folding_hinge_stiffness(load_step.stiffness, length)[springs]
    couple = Ramp((load_step.moment.start * length)[springs], (load_step.moment.end * length)[springs])
    # a released crease goes on with its moment, of which the couple carries its part
    carried = moment_start[springs] - couple.start
    begin = prescribed_start[springs] - carried / np.where(k_fold == 0.0, np.inf, k_fold)
    begin = np.where(np.isnan(load_step.rest.start[springs]), begin, load_step.rest.start[springs])
    return springs, k_fold, Ramp(begin, load_step.rest.end[springs]), couple


def creased(mesh: SheetMesh, law: Ints) -> Bools:
    """(m,) hinges that are drawn as creases or fold in this step: the strain may jump there, whatever a step does.

    Args:
        mesh: of the sheet.
        law: (m,) kind of law of every hinge.
    """
    topology = mesh.topology
    out = law != SHEET
    for name in mesh.creases:
        hinge = topology.edge_hinges[topology.find_edges(mesh.crease_edges(name))]
        out[hinge[hinge >= 0]] = True
    return np.asarray(out)


def lock_stiffness(model: Model, load_step: LoadStep) -> Array:
    """(m,) stiffness of the locks, N mm / rad: the spring's own or that of uncreased sheet (Eq. 3.11), the larger one.

    Held creases follow their angle and have none, nor have hinges that are made closed.

    Args:
        model: of the sheet.
        load_step: actuations of the step.
    """
    mesh, topology = model.mesh, model.mesh.topology
    if not model.hinge_lock or len(topology.hinges) == 0:
        return np.zeros(len(topology.hinges))
    ends = mesh.points[topology.hinges[:, 1:3]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    areas = mesh.areas[topology.edge_triangles[topology.hinge_edges]].sum(axis=1)
    sheet = bending_hinge_stiffness(model.sheet.E, model.sheet.t, length, areas)
    spring = np.where(load_step.law == SPRING, folding_hinge_stiffness(load_step.stiffness, length), 0.0)
    without = (load_step.law == PRESCRIBED) | (
        until_closed(dihedral_angles(mesh.points, topology.hinges)) < ZONE
    )
    return np.where(without, 0.0, np.maximum(spring, sheet))


def _check_moments(mesh: SheetMesh, load_step: LoadStep) -> None:
    """Opposite couples on the two sides of an uncreased sheet do no work: its sides turn together."""
    idle = (load_step.law == SHEET) & ((load_step.moment.start != 0.0) | (load_step.moment.end != 0.0))
    if idle.any():
        edge = mesh.topology.hinges[int(np.argmax(idle)), 1:3].tolist()
        raise ModelError(
            f"the moment at edge {edge} acts on a crease that is ordinary sheet, which cannot fold; "
            "give the crease a stiffness or Lstar"
        )


def triangle_ranks(mesh: SheetMesh) -> Array:
    """(t,) mean place of the corners in a narrow order of the nodes."""
    hinges = mesh.topology.hinges
    pairs = [(i, j) for i in range(4) for j in range(i)]
    rows = np.concatenate([mesh.triangles[:, 0], *(hinges[:, i] for i, _ in pairs)])
    columns = np.concatenate([mesh.triangles[:, 1], *(hinges[:, j] for _, j in pairs)])
    order, _ = reverse_cuthill_mckee(rows, columns, len(mesh.points))
    position = np.empty(len(order))
    position[order] = np.arange(len(order))
    return np.asarray(position[mesh.triangles].mean(axis=1))


def _number_rotations(
    mesh: SheetMesh, joined: Patches, spring: Bools, plane: Mirror | None, held: Clamps
) -> tuple[Ints, Ints, int, Ramp, Array]:
    """Rotation of every angle (c, a) or -1, of both sides of every hinge (m, 2), their number, and couples, N mm.

    There is one for each hinge between two patches, and two for each spring crease, and one for each free edge that
    keeps its own, as those do whose clamp is let go of or that are turned, with their couples; but one for a spring in
    the plane of a symmetric sheet, and none for what lies outside of its half.
    """
    count = np.ones(len(spring), dtype=np.int64)
    two_sided = spring.copy()
    if plane is not None:
        two_sided &= ~plane.hinge_inside
        count[plane.hinge_weight == 0.0] = 0
    count[two_sided & (count > 0)] = 2
    count[joined.hinge[joined.inner]] = 0
    first = np.cumsum(count) - count
    both = np.column_stack((first, first + two_sided))
    triangles = mesh.topology.edge_triangles[mesh.topology.hinge_edges, 0]
    side = (joined.half_edge // 3 != triangles[joined.hinge]).astype(np.int64)
    has = (joined.hinge >= 0) & ~joined.inner
    rotation = np.where(has, both[joined.hinge, side], -1)
    edge = mesh.topology.triangle_edges.ravel()[joined.half_edge]
    couple, load = held.couple[edge], Ramp(held.load.start[edge], held.load.end[edge])
    turned = (joined.kind == TURN) & (joined.hinge < 0) & ((couple != 0.0) | held.loaded[edge])
    free = ((joined.hinge < 0) & (joined.kind == OWN)) | turned
    rotation[free] = count.sum() + np.arange(free.sum())
    rotations = int(count.sum() + free.sum())
    start, end, let_go = np.zeros((3, rotations))
    for out, value in ((start, load.start), (end, load.end), (let_go, couple)):
        out[rotation[turned]] = value[turned]
    return rotation, both, rotations, Ramp(start, end), let_go


def _quads(mesh: SheetMesh, joined: Patches, outward: Array) -> tuple[Ints, Array]:
    """Nodes (c, a, 4) of TURN angles, and ghosts (c, a, 3) of clamps: where the sheet would go on, mm.

    That is `outward` (e, 3) where it is given, else as in the stress-free sheet.
    """
    quad = np.zeros((*joined.kind.shape, 4), dtype=np.int64)
    ghost = np.zeros((*joined.kind.shape, 3))
    turning = (joined.kind == TURN) & (joined.hinge >= 0)
    quad[turning] = mesh.topology.hinges[joined.hinge[turning]]
    clamp = (joined.kind == TURN) & (joined.hinge < 0)
    triangle, k = joined.half_edge[clamp] // 3, joined.half_edge[clamp] % 3
    # corner, its opposite edge counter-clockwise, and a ghost that moves with the edge
    corners = np.column_stack((k, (k + 1) % 3, (k + 2) % 3, (k + 1) % 3))
    quad[clamp] = np.take_along_axis(mesh.triangles[triangle], corners, axis=1)
    points = mesh.points[quad[clamp]]
    normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    given = outward[mesh.topology.triangle_edges.ravel()[joined.half_edge[clamp]]]
    ghost[clamp] = np.where(np.isnan(given), np.cross(points[:, 2] - points[:, 1], normal), given)
    return quad, ghost


def _rest(mesh: SheetMesh, joined: Patches, law: Ints, prescribed: Ramp) -> Ramp:
    """(c, a) rest dihedral angles of the patches: imposed, of the stress-free sheet, pi at clamps, rad."""
    reference = dihedral_angles(mesh.points, mesh.topology.hinges)
    start, end = (
        np.append(np.where(law == PRESCRIBED, at, reference), np.pi)[joined.hinge]
        for at in (prescribed.start, prescribed.end)
    )
    return Ramp(start, end)


def _rows(joined: Patches, quad: Ints) -> tuple[Ints, Ints]:
    """Nodes (c, p) that the angles of a patch depend on, then -1; and the place (c, a, 4) of each quad among them."""
    count = len(quad)
    past = int(quad.max()) + 1
    used = np.where((joined.kind == TURN)[..., None], quad, past).reshape(count, -1)
    ordered = np.sort(used, axis=1)
    fresh = np.diff(ordered, axis=1, prepend=-1) > 0
    slot = np.cumsum(fresh, axis=1) - 1
    nodes = np.full(used.shape, past, dtype=np.int64)
    row, at = np.nonzero(fresh)
    nodes[row, slot[row, at]] = ordered[row, at]
    nodes = nodes[:, : max(int((nodes < past).sum(axis=1).max()), 1)]
    place = (used[:, :, None] == nodes[:, None, :]).argmax(axis=2)
    return np.where(nodes < past, nodes, -1), place.reshape(quad.shape)


def _half(e: ConsistentElements, plane: Mirror) -> ConsistentElements:
    """Triangles, springs and locks of the half; patches and rotations are those of the half already."""
    weight = plane.triangle_weight
    triangle = weight > 0.0
    membrane = e.stretching.membrane.weighted(weight, plane.hinge_weight)
    by = plane.hinge_weight[e.springs]
    spring = by > 0.0
    by = by[spring]
    return replace(
        e, members=e.members[triangle], triangles=np.ascontiguousarray(e.triangles[triangle]),
        heights=e.heights[triangle], stretching=Stretching(membrane, e.stretching.laws, e.stretching.points),
        B_triangle=(weight[:, None, None] * e.B_triangle)[triangle], springs=e.springs[spring],
        hinges=np.ascontiguousarray(e.hinges[spring]), turns=e.turns[spring],
        spring_stiffness=by * e.spring_stiffness[spring],
        spring_rest=Ramp(e.spring_rest.start[spring], e.spring_rest.end[spring]),
        couple=Ramp(by * e.couple.start[spring], by * e.couple.end[spring]), lock=plane.hinge_weight * e.lock,
    )  # fmt: skip
