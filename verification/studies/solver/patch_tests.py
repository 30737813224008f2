"""Patch tests of plates: states of constant strain or constant curvature on distorted meshes, solved for the inside."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import meshes
from bh import Displace, Model, Sheet, trace
from bh.loading.builder import load_steps
from bh.mechanics.consistent.formulation import Consistent
from bh.mechanics.consistent.system import ConsistentSystem
from bh.model.ramp import Ramp
from bh.solvers.linear import linear_response
from meshes import SheetMesh
from meshes.cells import Kind

Array = NDArray[np.float64]
EDGES = ("inner", "outer", "start", "end")
STRETCHES = {
    "stretch": ((1.02, 0.0), (0.0, 1.0)),
    "shear": ((1.0, 0.03), (0.0, 1.0)),
    "both": ((1.01, 0.02), (-0.01, 0.98)),
}
CURVATURES = {
    "bending": (0.3, 0.0, 0.0),
    "bending across": (0.0, -0.2, 0.0),
    "twist": (0.0, 0.0, 0.4),
    "all": (0.3, -0.2, 0.15),
}


@dataclass(frozen=True)
class PatchError:
    """Relative errors of the energy and of the unknowns inside."""

    energy: float
    inside: float
    unknowns: int


def distorted(kind: Kind, seed: int, along: int = 7, rows: int = 5, by: float = 0.28) -> SheetMesh:
    """A rectangle 3 x 2 mm whose inner nodes are moved at random by up to `by` cells."""
    mesh = meshes.structured(meshes.strip(3.0, 2.0), along=along, rows=rows, kind=kind)
    points = mesh.points.copy()
    inside = np.setdiff1d(np.arange(len(points)), rim(mesh))
    cell = np.array([3.0 / along, 2.0 / rows])
    points[inside, :2] += np.random.default_rng(seed).uniform(-by, by, (len(inside), 2)) * cell
    return replace(mesh, points=points, spans=None)


def rim(mesh: SheetMesh) -> NDArray[np.int64]:
    """Nodes of the boundary."""
    return np.unique(mesh.topology.boundary)


def strain_energy_density(sheet: Sheet, strain: Array) -> float:
    """1/2 t E:C:E in plane stress for a strain (2, 2), N mm / mm^2."""
    nu = sheet.nu
    if sheet.grain is not None:
        a = np.array([np.cos(sheet.grain), np.sin(sheet.grain)])
        b = np.array([-a[1], a[0]])
        e = np.array([a @ strain @ a, b @ strain @ b, 2.0 * a @ strain @ b])
        return 0.5 * sheet.t * float(e @ np.linalg.solve(compliance(sheet), e))
    norm, trace_ = float((strain**2).sum()), float(np.trace(strain))
    return 0.5 * sheet.E * sheet.t / (1.0 - nu**2) * ((1.0 - nu) * norm + nu * trace_**2)


def compliance(sheet: Sheet) -> Array:
    """(3, 3) strains along the grain, across it, and shear, of a unit stress in an orthotropic sheet, 1 / MPa."""
    assert sheet.E2 is not None
    assert sheet.G12 is not None
    mixed = -sheet.nu / sheet.E
    return np.array([[1.0 / sheet.E, mixed, 0.0], [mixed, 1.0 / sheet.E2, 0.0], [0.0, 0.0, 1.0 / sheet.G12]])


def stretching_error(mesh: SheetMesh, sheet: Sheet, F: Array) -> PatchError:
    """Boundary nodes moved to F x (finite strain): the inside must follow, at the energy of the Green strain."""
    F = np.asarray(F, dtype=float)
    target = mesh.points.copy()
    target[:, :2] = mesh.points[:, :2] @ F.T
    shift = target - mesh.points
    nodes = rim(mesh).tolist()
    model = Model(mesh, sheet, formulation="consistent", contact=False).support("all", "z")
    model = model.step(
        *(Displace([n], axis, float(shift[n, i])) for n in nodes for i, axis in enumerate("xy"))
    )
    path = trace(model)
    state = path[-1]
    green = 0.5 * (F.T @ F - np.eye(2))
    exact = strain_energy_density(sheet, green) * float(mesh.areas.sum())
    inside = np.abs(state.points - target).max() / np.abs(shift).max()
    return PatchError(abs(state.energy.total / exact - 1.0), float(inside), path.unknowns)


def bending_error(mesh: SheetMesh, sheet: Sheet, curvature: Array) -> PatchError:
    """Deflection w = 1/2 x.kappa.x and its slope imposed on the boundary (linear): the inside must follow.

    `curvature` is (kappa_xx, kappa_yy, kappa_xy).
    """
    xx, yy, xy = curvature
    kappa = np.array([[xx, xy], [xy, yy]])
    x = mesh.points[:, :2]
    w = 0.5 * np.einsum("ni,ij,nj->n", x, kappa, x)
    model = Model(mesh, sheet, formulation="consistent", contact=False).support("all", "xy")
    for edge in EDGES:
        model = model.support(f"edge:{edge}", "xy", clamp=True)
    model = model.step(*(Displace([n], "z", float(w[n])) for n in rim(mesh).tolist()))
    system = Consistent().system(model, load_steps(model)[0], None)
    with_slopes(system, mesh, kappa)
    response = linear_response(system, system.start())
    moved = system.vectors(response.dq)[:, 2]
    inner = np.setdiff1d(np.arange(len(w)), rim(mesh))
    exact = float(mesh.areas.sum()) * sheet.t**2 / 12.0 * strain_energy_density(sheet, kappa)
    inside = np.abs(moved - w)[inner].max() / np.abs(w).max()
    return PatchError(abs(response.energy / exact - 1.0), float(inside), system.size)


def with_slopes(system: ConsistentSystem, mesh: SheetMesh, kappa: Array) -> None:
    """Let the clamps turn to the outward slope of w = 1/2 x.kappa.x at the middle of each edge (lambda = 1)."""
    e = system.elements
    clamp = (e.patches.hinge < 0) & (np.abs(e.ghost).max(axis=2) > 0.0)
    a, b = (mesh.points[e.quad[clamp][:, i], :2] for i in (1, 2))
    outward = e.ghost[clamp][:, :2] / np.linalg.norm(e.ghost[clamp], axis=1)[:, None]
    slope = np.einsum("ni,ij,nj->n", outward, kappa, 0.5 * (a + b))
    end = e.rest.end.copy()
    end[clamp] -= slope  # a sheet that rises towards its edge is less than flat against the level beyond it
    system.elements = replace(e, rest=Ramp(e.rest.start, end))
