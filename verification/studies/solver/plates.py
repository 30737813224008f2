"""Plates in small displacement by the consistent formulation: square plates, Cook's panel, strips."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

import meshes
from bh import Force, Model, Sheet
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.solvers.linear import linear_response
from meshes import SheetMesh
from meshes.cells import Kind
from verification.studies.ch3 import strips
from verification.theory import strips as strip_theory

Array = NDArray[np.float64]
NAME = "consistent"


@dataclass(frozen=True)
class Answer:
    """A value, and the number of unknowns that it took."""

    value: float
    unknowns: int


def nodal_areas(mesh: SheetMesh) -> Array:
    """(n,) a third of the area of the triangles around every node, mm^2."""
    out = np.zeros(len(mesh.points))
    np.add.at(out, mesh.triangles.ravel(), np.repeat(mesh.areas / 3.0, 3))
    return out


def loaded(model: Model, forces: Array) -> Model:
    """The model with dead forces (n, 3) on its nodes, N."""
    at = np.flatnonzero(np.abs(forces).max(axis=1) > 0.0)
    return model.step(*(Force([int(n)], each=tuple(forces[n])) for n in at))


def displacement(model: Model) -> tuple[Array, int]:
    """(n, 3) small displacements of the model's one step, mm, and the number of unknowns."""
    system = formulation(model.formulation).system(model, load_steps(model)[0], None)
    response = linear_response(system, system.start())
    return system.vectors(response.dq), system.size


def square_plate(cells: int, kind: Kind, nu: float, clamped: bool) -> Answer:
    """Deflection of the centre under a uniform load, times D / (q a^4)."""
    mesh = meshes.structured(meshes.strip(1.0, 1.0), along=cells, rows=cells, kind=kind)
    model = Model(mesh, Sheet(E=1.0, t=0.01, nu=nu), formulation=NAME, contact=False)
    for edge in ("inner", "outer", "start", "end"):
        model = model.support(f"edge:{edge}", "z", clamp=clamped)
    model = model.support("corner:inner-start", "xy").support("corner:inner-end", "y")
    u, unknowns = displacement(loaded(model, nodal_areas(mesh)[:, None] * [[0.0, 0.0, 1.0]]))
    centre = int(np.linalg.norm(mesh.points[:, :2] - 0.5, axis=1).argmin())
    return Answer(float(u[centre, 2]) * model.sheet.bending_stiffness(), unknowns)


def cooks_panel(cells: int, kind: Kind) -> Answer:
    """Deflection of the middle of the loaded end of Cook's panel: 48 wide, ends 44 and 16 high, shear force 1."""
    unit = meshes.structured(meshes.strip(1.0, 1.0), along=cells, rows=cells, kind=kind)
    x, y = unit.points[:, 0], unit.points[:, 1]
    mesh = replace(unit, points=np.column_stack((48.0 * x, 44.0 * x + y * (44.0 - 28.0 * x))), spans=None)
    model = Model(mesh, Sheet(E=1.0, t=1.0, nu=1.0 / 3.0), formulation=NAME, contact=False)
    model = model.support("edge:start", "xyz").support("all", "z")
    forces = np.zeros((len(mesh.points), 3))
    end = mesh.edge_sets["edge:end"]
    share = np.linalg.norm(mesh.points[end[:, 0]] - mesh.points[end[:, 1]], axis=1) / 16.0
    for side in range(2):
        np.add.at(forces[:, 1], end[:, side], 0.5 * share)
    u, unknowns = displacement(loaded(model, forces))
    nodes = mesh.nodes("edge:end")
    nodes = nodes[np.argsort(mesh.points[nodes, 1])]
    return Answer(float(np.interp(52.0, mesh.points[nodes, 1], u[nodes, 1])), unknowns)


def strip_ratio(load: str, kind: Kind, rows: int, alpha: float = 1.0, nu: float = 0.0) -> Answer:
    """Stiffness of the strip of 3.4.1 over theory, with `rows` rows of cells of aspect ratio alpha.

    Out of plane the strip is simply supported under a uniform load, which suits every mesh; the work of the load over
    that of the beam, inverted.
    """
    along = max(1, round(alpha * rows * strips.L / strips.H))
    mesh = meshes.structured(meshes.strip(strips.L, strips.H), along=along, rows=rows, kind=kind)
    model = Model(mesh, Sheet(E=strips.E, t=strips.T, nu=nu), formulation=NAME, contact=False)
    if load == "bending_out_of_plane":
        model = model.support("edge:start", "xyz").support("edge:end", "yz")
        forces = nodal_areas(mesh)[:, None] * [[0.0, 0.0, 1.0]]
        u, unknowns = displacement(loaded(model, forces))
        work = strip_theory.uniform_load_work(strips.E, strips.L, strips.H, strips.T)
        return Answer(work / (0.5 * float(np.vdot(forces, u))), unknowns)
    model, expected = strips.loaded(model, load)
    system = formulation(NAME).system(model, load_steps(model)[0], None)
    return Answer(linear_response(system, system.start()).energy / expected, system.size)


def rates(errors: list[float]) -> list[float]:
    """Orders of convergence where each error belongs to half the cells of the next."""
    return [math.log2(abs(a) / abs(b)) for a, b in pairwise(errors)]
