"""The edge-smoothed membrane of the consistent formulation: exactness, spectrum, rates, and what it is for."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray

import meshes
from bh import Displace, Model, Sheet, trace
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.mechanics.consistent.formulation import Consistent, ConstantStrain
from bh.mechanics.consistent.membrane import Membrane, constant_strain, smoothed_strain
from bh.mechanics.consistent.membrane_kernels import edge_strains
from bh.mechanics.consistent.system import ConsistentSystem
from bh.solvers.linear import linear_response
from bh.testing import assert_values_converge
from meshes.cells import Kind
from verification.studies.solver.convergence import folded, sector
from verification.studies.solver.patch_tests import distorted

Array = NDArray[np.float64]
KINDS: tuple[Kind, ...] = get_args(Kind)
SHEET = Sheet(E=1000.0, t=0.1, nu=0.3)


def none(mesh: meshes.SheetMesh) -> NDArray[np.bool_]:
    return np.zeros(len(mesh.topology.hinges), dtype=bool)


def crumpled(mesh: meshes.SheetMesh) -> meshes.SheetMesh:
    points = mesh.points.copy()
    points[:, 2] += 0.1 * np.random.default_rng(3).normal(size=len(points))
    return replace(mesh, points=points)


# --------------------------------------------------------------------------------------- cells


@pytest.mark.parametrize("measure", [smoothed_strain, constant_strain])
def test_cells_cover_the_sheet_and_own_every_bar_once(measure: object) -> None:
    mesh = crumpled(distorted("alternating", 2))
    crease = none(mesh)
    crease[::7] = True
    membrane: Membrane = measure(mesh, crease)  # type: ignore[operator]
    assert sum(float(cells.area.sum()) for cells in membrane.cells) == pytest.approx(
        mesh.areas.sum(), rel=1e-13
    )
    owned = np.concatenate([cells.bars[cells.owned] for cells in membrane.cells])
    assert np.array_equal(np.sort(owned), np.arange(len(membrane.bars)))
    if measure is smoothed_strain:
        assert not crease[membrane.edges.source].any()
        assert len(membrane.edges.source) == (~crease).sum()


def test_neighbours_are_unfolded() -> None:
    """Two triangles at any dihedral angle measure what the flat pair does."""
    flat = np.array([[0.7, 1.3, 0.0], [0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.1, -0.8, 0.0]])
    hinge = np.array([[0, 1, 2, 3]])
    turned = flat.copy()
    turned[3] = [1.1, -0.8 * math.cos(1.0), 0.8 * math.sin(1.0)]
    one, two = edge_strains(flat, hinge), edge_strains(turned, hinge)
    np.testing.assert_allclose(two[0], one[0], atol=1e-14)
    np.testing.assert_allclose(one[1], [[1.3, 0.8]], atol=1e-14)


@pytest.mark.parametrize("kind", KINDS)
def test_strain_of_a_cell_is_the_mean_by_area(kind: Kind) -> None:
    """Against the deformation gradients of the two triangles, for random moves in the plane."""
    mesh = distorted(kind, 5)
    x = mesh.points.copy()
    x[:, :2] += 0.05 * np.random.default_rng(4).normal(size=(len(x), 2))
    corners = mesh.triangles
    before, after = (
        np.stack((p[corners[:, 1]] - p[corners[:, 0]], p[corners[:, 2]] - p[corners[:, 0]]), axis=2)[:, :2]
        for p in (mesh.points, x)
    )
    F = after @ np.linalg.inv(before)
    green = 0.5 * (np.swapaxes(F, 1, 2) @ F - np.eye(2))
    membrane = smoothed_strain(mesh, none(mesh))
    ends = x[membrane.bars]
    gamma = 0.5 * (((ends[:, 1] - ends[:, 0]) ** 2).sum(axis=1) - membrane.rest_square)
    found = membrane.edges.strains(gamma)
    sides = mesh.topology.edge_triangles[mesh.topology.hinge_edges]
    weight = mesh.areas[sides] / mesh.areas[sides].sum(axis=1)[:, None]
    mean = np.einsum("hs,hsij->hij", weight, green[sides])
    along = mesh.points[mesh.topology.hinges[:, 2]] - mesh.points[mesh.topology.hinges[:, 1]]
    along = along[:, :2] / np.linalg.norm(along, axis=1)[:, None]
    across = np.column_stack((-along[:, 1], along[:, 0]))
    expected = np.column_stack(
        [
            np.einsum("hi,hij,hj->h", along, mean, along),
            np.einsum("hi,hij,hj->h", across, mean, across),
            2.0 * np.einsum("hi,hij,hj->h", along, mean, across),
        ]
    )
    np.testing.assert_allclose(found, expected, atol=1e-13)


# --------------------------------------------------------------------------------------- spectrum


def panels() -> dict[str, meshes.SheetMesh]:
    one = {
        f"one row, {kind}": meshes.structured(meshes.strip(3.0, 1.0), along=6, rows=1, kind=kind)
        for kind in KINDS
    }
    narrow = meshes.structured(meshes.strip(3.0, 0.1), along=4, rows=1)
    ring = meshes.structured(meshes.full_annulus(6.0, 1.0), along=16, rows=1)
    return {
        **one,
        "slender cells": narrow,
        "pair": meshes.SheetMesh(
            np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]])
        ),
        "distorted": distorted("one-way", 3),
        "distorted, alternating": distorted("alternating", 4),
        "made curved": crumpled(distorted("staggered", 2)),
        "gmsh": meshes.unstructured(meshes.strip(3.0, 2.0), size=0.7),
        "ring with a crease": ring,
    }


PANELS = panels()


def hessian(mesh: meshes.SheetMesh, sheet: Sheet) -> Array:
    """Second derivatives of the energy of a free sheet, of positions and rotations, without any ground."""
    model = Model(mesh, sheet, formulation="consistent")
    creases = list(mesh.creases)
    model = (
        model.fold(creases[0], rest=math.pi, Lstar=5.0) if creases else model.force("node:0", each=(0.0,) * 3)
    )
    system = Consistent().system(model, load_steps(model)[0], None)
    assert isinstance(system, ConsistentSystem)
    design = Consistent().derivatives(system, np.zeros(system.size), 0.0)
    n, r = mesh.points.size, system.elements.rotations
    columns = []
    for unit in np.eye(n + r):
        f, moments = design.second_variation(unit[:n].reshape(-1, 3), np.ascontiguousarray(unit[n:]))
        columns.append(np.concatenate((f.ravel(), moments)))
    return np.array(columns)


@pytest.mark.parametrize("nu", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("name", PANELS)
def test_free_panel_has_six_zero_modes(name: str, nu: float) -> None:
    """And no other that is nearly one: bending has its own scale, t^2 / h^2 of stretching."""
    H = hessian(PANELS[name], Sheet(E=1.0, t=1.0, nu=nu))
    assert np.abs(H - H.T).max() <= 1e-12 * np.abs(H).max()
    values = np.linalg.eigvalsh(H)
    assert (np.abs(values) < 1e-10 * values[-1]).sum() == 6
    assert values[6] > 1e-7 * values[-1]


def test_spectrum_can_fail() -> None:
    """Edges alone, without what their triangles keep at the boundary, leave strains that alternate."""
    mesh = PANELS["one row, one-way"]
    membrane = smoothed_strain(mesh, none(mesh))
    x, size = mesh.points, 2 * len(mesh.points)
    counts = []
    for with_triangles in (True, False):
        G = np.zeros((len(membrane.bars), size))
        d = x[membrane.bars[:, 1], :2] - x[membrane.bars[:, 0], :2]
        for b, (i, j) in enumerate(membrane.bars):
            G[b, 2 * i : 2 * i + 2], G[b, 2 * j : 2 * j + 2] = -d[b], d[b]
        H = np.zeros((size, size))
        for cells in membrane.cells if with_triangles else (membrane.edges,):
            for K, bars in zip(cells.stiffness(np.eye(3)), cells.bars, strict=True):
                H += G[bars].T @ K @ G[bars]
        values = np.linalg.eigvalsh(H)
        counts.append(int((values < 1e-10 * values[-1]).sum()))
    assert counts[0] == 3 < counts[1]


# --------------------------------------------------------------------------------------- what it is for


def bent(mesh: meshes.SheetMesh, made: Consistent, length: float, height: float) -> float:
    """Energy of a strip whose ends are turned in its plane (pure bending) over that of a beam; nu = 0."""
    turn = 1e-4
    model = Model(mesh, replace(SHEET, nu=0.0), formulation="consistent").support("all", "z")
    model = model.support("edge:start", "x").support("corner:inner-start", "y")
    model = model.step(
        *(
            Displace([int(i)], "x", -turn * float(mesh.points[i, 1] - 0.5 * height))
            for i in mesh.nodes("edge:end")
        )
    )
    system = made.system(model, load_steps(model)[0], None)
    beam = SHEET.E * SHEET.t * height**3 / 12.0 * turn**2 / (2.0 * length)
    return linear_response(system, system.start()).energy / beam


def strip(rows: int, kind: Kind) -> meshes.SheetMesh:
    return meshes.structured(meshes.strip(10.0, 1.0), along=10 * rows, rows=rows, kind=kind)


def test_strip_bent_in_its_plane() -> None:
    smoothed = [bent(strip(rows, "staggered"), Consistent(), 10.0, 1.0) for rows in (1, 2, 4, 8)]
    constant = [bent(strip(rows, "staggered"), ConstantStrain(), 10.0, 1.0) for rows in (1, 2, 4, 8)]
    assert smoothed == pytest.approx([1.115, 1.014, 1.002, 1.000], abs=0.0005)
    assert constant == pytest.approx([3.184, 1.546, 1.137, 1.034], abs=0.0005)


@pytest.mark.parametrize("kind", KINDS)
def test_in_plane_bending_converges_at_second_order_or_better(kind: Kind) -> None:
    values = [bent(strip(rows, kind), Consistent(), 10.0, 1.0) for rows in (2, 4, 8)]
    found = assert_values_converge(values, (1 / 2, 1 / 4, 1 / 8), expected=1.0, order=1.9, within=0.025)
    assert found.values[-1] > 1.0


def test_in_plane_bending_on_gmsh_meshes() -> None:
    errors = []
    for size in (0.5, 0.25, 0.125):
        mesh = meshes.unstructured(meshes.strip(10.0, 1.0), size=size)
        errors.append(abs(bent(mesh, Consistent(), 10.0, 1.0) - 1.0))
    assert errors[0] < 0.1
    assert errors[2] < 0.005
    assert errors[0] > errors[1] > errors[2]


def test_folded_energies_rise_from_below() -> None:
    """App. B (a): 0.05370 N mm is the limit of the quadratic shell."""
    totals = []
    for along, rows in ((16, 1), (32, 2), (32, 4), (64, 8)):
        path = folded(sector(along, rows, "staggered"), "a", 0.38, "consistent")
        assert path.outcome == "reached"
        totals.append(path[-1].energy.total)
    assert np.diff(totals).min() > 0.0
    assert [total / 0.05370 - 1.0 for total in totals] == pytest.approx(
        [-0.124, -0.038, -0.013, -0.004], abs=0.001
    )


def test_energy_density_is_shared_by_area() -> None:
    """Of a uniform strain every triangle has its own; and the sum is the whole in any state."""
    mesh = distorted("alternating", 6)
    model = Model(mesh, SHEET, formulation="consistent").support("all", "z")
    rim = np.unique(mesh.topology.boundary).tolist()
    along = [Displace([n], "x", 0.01 * float(mesh.points[n, 0])) for n in rim]
    model = model.step(*along, *(Displace([n], "y", 0.0) for n in rim))
    state = trace(model)[-1]
    density = state.energy_density["stretching"]
    assert density == pytest.approx(np.full(len(density), density.mean()), rel=1e-9)


def test_creases_take_their_own_side_in_every_step() -> None:
    """A crease that does not fold in a step is one all the same, so that energy goes on from step to step."""
    mesh = sector(8, 2, "staggered")
    model = Model(mesh, SHEET, formulation="consistent").force("corner:outer-end", each=(0.0, 0.0, 0.0))
    folding = model.fold("crease", to=3.0)
    cells = []
    for step in load_steps(folding):
        system = formulation("consistent").system(folding, step, None)
        assert isinstance(system, ConsistentSystem)
        cells.append(system.elements.stretching.membrane.edges.source)
    one, two = cells
    assert np.array_equal(one, two)
    crease = mesh.topology.edge_hinges[mesh.topology.find_edges(mesh.crease_edges("crease"))]
    assert not np.isin(cells[0], crease).any()
