"""What can be read from a state of the shell, under the names that every formulation uses."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bh.formulations.state import Energy
from bh.formulations.stress import Resultants
from bh.model.model import Model
from bh.model.zones import Sections
from fem import grain
from fem import sections as by_triangle
from fem.here import Here
from fem.shell import ShellElements, maps, side_normals
from fem.spaces import MOMENTS, SLOPES, STRAINS, gradients
from fem.state import ShellState
from fem.system import ShellSystem

Array = NDArray[np.float64]
MIDDLE = np.array([[1.0 / 3.0, 1.0 / 3.0]])


def observe(
    model: Model, system: ShellSystem, q: Array, lam: float, step: int, stable: bool | None
) -> ShellState:
    """Everything that can be read from the unknowns `q` at `lam`.

    Args:
        model: the model that `system` was made from.
        system: of the step.
        q: (size,) unknowns.
        lam: how much of the step is applied, 0 to 1.
        step: number of the step.
        stable: whether the state is stable, None if that was not asked.
    """
    here = system.at(q, lam)
    e, mesh, creases = system.elements, model.mesh, system.creases
    strain, curvature = system.elastic(here.x, system.side_rotations(here.components), lam)
    membrane_forces, moments = np.hsplit(here.forces, 2)
    stretching = 0.5 * np.einsum("tk,tk->t", membrane_forces, strain)
    bending = 0.5 * np.einsum("tk,tk->t", moments, curvature)
    beta = system.components.beta(here.components)
    folding, dissipated = creases.energy(beta, lam), 0.0
    if creases.laws is not None:
        lost = creases.laws.held(beta - creases.rest.at(lam)).dissipated
        folding, dissipated = folding - lost, float(lost.sum())
    sides = mesh.topology.edge_triangles[creases.edges]
    by_triangle = np.zeros(len(mesh.triangles))
    share = folding / e.areas[sides].sum(axis=1)
    for side in range(2):
        np.add.at(by_triangle, sides[:, side], share)
    fold_angles, couples = np.zeros((2, len(mesh.topology.hinges), beta.shape[1]))
    fold_angles[creases.hinges] = beta
    couples[creases.hinges] = _couples(system, here)
    angles = np.mod(math.pi - _jumps(system, here), 2.0 * math.pi)
    angles[creases.hinges] = math.pi - beta.mean(axis=1)
    reactions = np.zeros_like(here.x)
    local = system.gradient(here)[: system.components.first_alpha].reshape(-1, 3)
    reactions[system.constraints.fixed] = local[system.constraints.fixed]
    in_plane, bent = stresses(e, model.sections, moments, strain)
    return ShellState(
        mesh=mesh,
        step=step,
        lam=lam,
        points=here.x[: len(mesh.points)],
        energy=Energy(
            float(stretching.sum()),
            float(bending.sum()),
            float(folding.sum()),
            contact=here.contact,
            dissipated=dissipated,
            ground=0.0 if system.outside is None else system.outside.spring_energy(here.x),
        ),
        dihedral_angles=angles,
        energy_density={
            "stretching": stretching / e.areas,
            "bending": bending / e.areas,
            "folding": by_triangle,
        },
        reactions=_to_corners(system, system.components.to_global(reactions)),
        crease_moments=_crease_moments(system, couples),
        contact_forces={} if system.outside is None else system.outside.bar_forces(here.x, lam),
        stable=stable,
        nodes=here.x,
        frames=system.carried_frames(here.components),
        fold_angles=fold_angles,
        crease_couples=couples,
        crease_history=creases.laws.by_edge() if creases.laws is not None and system.remembers else None,
        point_history=system.history if system.remembers else None,
        membrane_forces=in_plane,
        moments=bent,
        recover=partial(
            resultants,
            model.sections,
            in_plane,
            bent,
            None if system.rest is None else system.rest.mean.at(lam),
            None if system.load_step.changed is None else system.load_step.changed.at(lam),
        ),
    )


def resultants(
    made_of: Sections,
    forces: Array,
    moments: Array,
    rest: Array | None = None,
    changed: Array | None = None,
) -> Resultants:
    """What stresses are made of; strains and curvatures are those that forces and moments belong to.

    Args:
        made_of: what every triangle is made of.
        forces: (t, 3) membrane forces at the middle of each triangle, N / mm.
        moments: (t, 3) moments there, N.
        rest: (2, t, 3) strain and curvature at rest, which the others are beside.
        changed: (t,) change of temperature or moisture.
    """
    sheet = made_of.sheets[0]
    if by_triangle.needed(made_of):
        found = by_triangle.matrices(made_of.sheets)
        strain, curvature = by_triangle.strains(found, made_of, forces, moments)
        if rest is not None:
            strain, curvature = strain + rest[0], curvature + rest[1]
        return Resultants(sheet, strain, curvature, forces, moments, made_of, changed)
    C = grain.compliance_in_drawing(sheet)
    strain, curvature = forces @ C / sheet.t, moments @ C * 12.0 / sheet.t**3
    if rest is not None:
        strain, curvature = strain + rest[0], curvature + rest[1]
    return Resultants(sheet, strain, curvature, forces, moments)


def _to_corners(system: ShellSystem, nodal: Array) -> Array:
    """Reactions of middle nodes halved to the ends of their edges, so that resultants are kept."""
    corners = len(system.mesh.sheet.points)
    out = nodal[:corners].copy()
    if system.mesh.degree == 1:
        return out
    for end in range(2):
        np.add.at(out, system.mesh.sheet.topology.edges[:, end], 0.5 * nodal[corners:])
    return out


def _couples(system: ShellSystem, here: Here) -> Array:
    """(c, r) couples on the fold angles: a spring's own, and what an imposed angle takes, N mm / rad."""
    creases = system.creases
    sheet = system.components.beta(system.components.spread(here.pull))
    spring = -creases.springs(system.components.beta(here.components), here.lam)
    out: Array = np.where(creases.prescribed[:, None], sheet, spring)
    return out


def _crease_moments(system: ShellSystem, couples: Array) -> Array:
    """(m,) mean moment a length of crease, nan elsewhere."""
    creases = system.creases
    out = np.full(len(couples), np.nan)
    out[creases.hinges] = couples[creases.hinges].sum(axis=1) / creases.mass.sum(axis=(1, 2))
    return out


def _jumps(system: ShellSystem, here: Here) -> Array:
    """(m,) angle between the normals on both sides at the middle of every hinge's edge, rad, mountain positive."""
    e = system.elements
    tau, normal = side_normals(system.mesh, here.x)
    topology = system.mesh.sheet.topology
    left, right = topology.edge_triangles[topology.hinge_edges].T
    one = np.argmax(e.loops.edges[left] == topology.hinge_edges[:, None], axis=1)
    two = np.argmax(e.loops.edges[right] == topology.hinge_edges[:, None], axis=1)
    a, b, edge = normal[left, one], normal[right, two], tau[left, one]
    triple = np.einsum("mc,mc->m", edge, np.cross(a, b)) / np.linalg.norm(edge, axis=1)
    out: Array = np.arctan2(triple, np.einsum("mc,mc->m", a, b))
    return out


def stresses(
    elements: ShellElements, made_of: Sections, moments: Array, strain: Array
) -> tuple[Array, Array]:
    """Membrane forces and moments (t, 3) at the middle of each triangle, components xx, yy, xy of the flat sheet.

    Of a surface that is not flat they are those along the axes of `fem.shell.maps`.

    Args:
        elements: of the sheet.
        made_of: what every triangle is made of.
        moments: (t, 3 m) generalised moments.
        strain: (t, 3 m) generalised strains.

    Returns:
        Membrane forces, N/mm, and moments, N.
    """
    slopes = gradients(MIDDLE) if elements.mesh.degree == 2 else SLOPES[None]
    F = maps(elements.mesh, slopes)[:, 0]
    middle = elements.tables.middle
    eps = np.einsum("tjm,m,jab->tab", strain.reshape(len(F), 3, -1), middle, STRAINS)
    inverse = np.linalg.inv(F)
    eps = np.einsum("tac,tab,tbd->tcd", inverse, eps, inverse)
    m = np.einsum("tjm,m,jab->tab", moments.reshape(len(F), 3, -1), middle, MOMENTS)
    m = np.einsum("tca,tab,tdb->tcd", F, m, F) / np.linalg.det(F)[:, None, None] ** 2
    pick = ([0, 1, 0], [0, 1, 1])
    bent = m[:, pick[0], pick[1]]
    return _forces(eps, bent, made_of), bent


def _forces(eps: Array, moments: Array, made_of: Sections) -> Array:
    """(t, 3) membrane forces of strains (t, 2, 2), N / mm; of a laminate those beside moments (t, 3)."""
    sheet, pick = made_of.sheets[0], ([0, 1, 0], [0, 1, 1])
    if by_triangle.needed(made_of):
        rows = eps[:, pick[0], pick[1]] * [1.0, 1.0, 2.0]
        return by_triangle.membrane_forces(by_triangle.matrices(made_of.sheets), made_of, rows, moments)
    if sheet.grain is not None:
        return np.asarray(grain.forces(eps, sheet)[:, pick[0], pick[1]])
    trace = np.einsum("taa->t", eps)[:, None, None] * np.eye(2)
    N = sheet.E * sheet.t / (1.0 - sheet.nu**2) * ((1.0 - sheet.nu) * eps + sheet.nu * trace)
    return np.asarray(N[:, pick[0], pick[1]])
