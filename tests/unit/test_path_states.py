"""States of paths: energies, reactions, and loads that rounding hides."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import bh
import meshes
from bh import (
    Displace,
    Fold,
    Force,
    Model,
    Path,
    trace,
)
from bh.loading.load_step import crease_hinges
from tests.unit.sample_paths import (
    CORNERS,
    FREE,
    MESH,
    MODELS,
    SHEET,
    D,
    every,
    reached,
)


@every
def test_energy_density_integrates_to_the_energies(name: str) -> None:
    for state in reached(MODELS[name]):
        areas = state.mesh.areas
        for kind in ("stretching", "bending", "folding"):
            total = getattr(state.energy, kind)
            assert float(areas @ state.energy_density[kind]) == pytest.approx(total, rel=1e-12, abs=1e-18)
            nodal = state.nodal_energy_density(kind)
            assert nodal.shape == (len(state.points),)
            lumped = np.bincount(state.mesh.triangles.ravel(), np.repeat(areas / 3.0, 3), len(nodal))
            assert float(lumped @ nodal) == pytest.approx(total, rel=1e-12, abs=1e-18)
            assert nodal.max() <= state.energy_density[kind].max() + 1e-18
            assert nodal.min() >= 0.0


def test_folding_energy_lies_at_the_crease() -> None:
    state = reached(MODELS["spring, supported"])[-1]
    hinges = MESH.topology.hinges[crease_hinges(MESH, "crease")]
    pairs = {frozenset(row[1:3]) for row in hinges.tolist()}
    at_crease = np.array(
        [any(frozenset(p) in pairs for p in ((a, b), (b, c), (c, a))) for a, b, c in MESH.triangles.tolist()]
    )
    density = state.energy_density["folding"]
    assert (density[at_crease] > 0.0).all()
    assert (density[~at_crease] == 0.0).all()
    law = D / 20.0
    lengths = np.linalg.norm(MESH.points[hinges[:, 2]] - MESH.points[hinges[:, 1]], axis=1)
    by_hand = 0.5 * law * float(lengths @ (state.dihedral("crease") - 1.2) ** 2)
    assert state.energy.folding == pytest.approx(by_hand, rel=1e-12)


def test_reactions_balance_the_forces() -> None:
    """Sum of forces and of moments over supports, prescribed displacements and dead loads; zero at free nodes."""
    model = CORNERS.step(
        Fold("crease", to=2.3),
        Force("edge:outer", each=(1e-4, -2e-4, 3e-4)),
        Displace("corner:outer-end", (1.0, 0.0, 2.0), 1.0),
    )
    for state in reached(model)[1:]:
        applied = np.zeros_like(state.points)
        applied[MESH.nodes("edge:outer")] = state.lam * np.array([1e-4, -2e-4, 3e-4])
        assert np.abs(state.reactions).max() > 1e-5
        total = state.reactions + applied
        assert np.abs(total.sum(axis=0)).max() < 1e-8
        assert np.abs(np.cross(state.points, total).sum(axis=0)).max() < 1e-6
        free = np.ones(len(state.points), dtype=bool)
        for place in ("corner:inner-start", "corner:outer-start", "corner:inner-end", "corner:outer-end"):
            free[MESH.corners[place]] = False
        assert np.abs(state.reactions[free]).max() == 0.0
        assert state.reaction("corner:inner-end")[:2] == pytest.approx([0.0, 0.0], abs=1e-14)
        pull = state.reaction("corner:outer-end")
        assert np.linalg.norm(np.cross(pull, [1.0, 0.0, 2.0])) < 1e-12  # only along the prescribed direction


def test_displacements_are_met() -> None:
    direction = np.array([1.0, 0.0, 2.0]) / math.sqrt(5.0)
    path = reached(CORNERS.displace("corner:outer-end", (1.0, 0.0, 2.0), 1.5).fold("crease", to=2.8))
    for state in path:
        u = state.displacement("corner:outer-end")[0]
        assert u @ direction == pytest.approx(1.5 * min(1.0, state.step + state.lam), abs=1e-12)
    assert state.displacement("corner:inner-start") == pytest.approx(np.zeros((1, 3)), abs=0.0)


def test_reaction_is_the_slope_of_the_energy() -> None:
    """Castigliano: the reaction at a displaced node is dU / du, by central differences over three paths."""

    def solved(by: float) -> bh.State:
        return reached(
            CORNERS.fold("crease", to=2.5).fold("crease", to=2.5)
            if by is None
            else CORNERS.step(Fold("crease", to=2.5), Displace("corner:outer-end", "z", by))
        )[-1]

    by, h = 0.8, 1e-3
    slope = (solved(by + h).energy.total - solved(by - h).energy.total) / (2.0 * h)
    assert solved(by).reaction("corner:outer-end")[2] == pytest.approx(slope, rel=1e-5)


def test_moment_of_a_held_crease_is_the_slope_of_the_energy() -> None:
    """dU / d(angle) = moment a length times the length of the crease."""
    h = 1e-4
    low, mid, high = (reached(FREE.fold("crease", to=2.0 + d))[-1] for d in (-h, 0.0, h))
    slope = (high.energy.total - low.energy.total) / (2.0 * h)
    edges = MESH.crease_edges("crease")
    lengths = np.linalg.norm(MESH.points[edges[:, 1]] - MESH.points[edges[:, 0]], axis=1)
    # U falls as the crease opens; the multiplier is the moment that the holder must add
    assert float(lengths @ mid.crease_moment("crease")) == pytest.approx(-slope, rel=1e-5)


# --- loads that rounding hides -------------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
def test_loads_that_rounding_hides_are_told(formulation: str) -> None:
    """Ten thousand times smaller than what still is right to 1e-3."""
    model = replace(CORNERS, formulation=formulation)

    def pushed(force: float) -> Path:
        return trace(model.step(Force("corner:outer-end", total=(0.0, 0.0, force))))

    right, small, lost = pushed(1e-5), pushed(1e-10), pushed(1e-14)
    wanted = right[-1].energy.total / 1e-10
    assert small[-1].energy.total / 1e-20 == pytest.approx(wanted, rel=1e-3)
    assert lost[-1].energy.total / 1e-28 != pytest.approx(wanted, rel=1e-3)  # what there is to tell of
    told = [any("rounding hides" in line for line in path.remarks) for path in (right, small, lost)]
    assert told == [False, False, True]


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
@pytest.mark.parametrize("size", [1e-7, 1e-9, 1e-11])
def test_tiny_motions_are_solved(formulation: str, size: float) -> None:
    """Guesses that look balanced, since rounding hides their forces, were taken as they were: 25 times the energy."""
    model = replace(CORNERS, formulation=formulation)

    def energy(by: float) -> float:
        return trace(model.fold("crease", by=by, Lstar=25.0))[-1].energy.total / by**2

    assert energy(size) == pytest.approx(energy(1e-4), rel=1e-2)


def test_a_sheet_that_folds_without_forces_is_not_hidden_by_rounding() -> None:
    strip = meshes.structured(meshes.strip(40.0, 8.0, creases=[4.0]), along=4)
    path = trace(Model(strip, SHEET, formulation="bars-and-hinges").fold("all", by=1.0))
    assert path.reached
    assert path[-1].energy.total < 1e-12
    assert not any("rounding hides" in line for line in path.remarks)
