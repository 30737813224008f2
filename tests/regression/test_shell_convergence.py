"""The shell against closed forms and published values, with observed rates of convergence."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import bh
import meshes
from bh.model.model import Model
from bh.solvers.load_control import LoadControl
from bh.solvers.points import Increment
from bh.testing import assert_values_converge
from fem.kirchhoff_love import follow
from fem.state import ShellState
from verification.studies.app_b import shell_folding as folding
from verification.studies.app_b.appendix_b_shell import TABLE_B1
from verification.theory import shell_benchmarks as sze


def last(states: list[ShellState], increments: list[Increment]) -> ShellState:
    assert increments[-1].outcome == "reached", increments[-1].note
    return states[-1]


def test_rolled_strip_converges_to_its_closed_form() -> None:
    """End moment up to a full circle: energy and tip at fourth order (quadratic positions, linear moments)."""
    energy, x, z = sze.rolled_strip_exact()
    levels = (12, 24, 48)
    totals, tips = [], []
    for along in levels:
        model, moments = sze.rolled_strip(along)
        state = last(*follow(model, moments))
        tip = state.points[model.mesh.nodes("edge:end")].mean(axis=0)
        totals.append(state.energy.total)
        tips.append(math.hypot(tip[0] - x, tip[2] - z))
    sizes = [1.0 / along for along in levels]
    assert_values_converge(totals, sizes, name="energy", unit="N mm", expected=energy, order=3.5, within=2e-5)
    assert_values_converge(tips, sizes, name="tip", unit="mm", expected=0.0, order=3.5, within=2e-4)


def test_strip_under_end_shear() -> None:
    """Sze, Liu and Lo (2004), table 1."""
    model = sze.sheared_strip(10)
    state = last(*follow(model))
    tip = state.displacement("edge:end").mean(axis=0)
    u, w = sze.SHEAR[4.0]
    assert -tip[0] == pytest.approx(u, rel=2e-3)
    assert tip[2] == pytest.approx(w, rel=1e-3)


def test_slit_ring() -> None:
    """Sze, Liu and Lo (2004), table 3; their shear-deformable shell is a little softer."""
    model = sze.pulled_ring(40, 4)
    states, increments = follow(model)
    last(states, increments)
    for step, published in enumerate(sze.RING_TABLE.values()):
        state = next(s for s in states if s.step == step and s.lam == 1.0)
        lip = [state.displacement(f"corner:{end}-end")[0, 2] for end in ("low", "high")]
        np.testing.assert_allclose(lip, published, rtol=0.012)
        assert (lip < np.array(published)).all()


@pytest.mark.parametrize(("actuation", "total"), [("a", 5.370e-2), ("d", 5.044e-2)])
def test_appendix_b_converges(actuation: str, total: float) -> None:
    """Folded to 90 degrees in one increment; the total settles 1.7-1.8 % below Table B.1."""
    totals, stretching = [], []
    for along, rows in ((8, 1), (16, 2), (32, 4)):  # totals turn on these meshes, so they show no order
        solved = folding.solve(actuation, along, rows)
        assert solved.outcome == "reached"
        assert solved.iterations <= 8
        totals.append(solved.state.energy.total)
        stretching.append(solved.state.energy.stretching)
    assert totals[-1] == pytest.approx(total, rel=1e-3)
    assert totals[-2] == pytest.approx(total, rel=1e-2)
    assert abs(stretching[-1] - stretching[-2]) < 0.25 * abs(stretching[-2] - stretching[-1 - 2])
    assert totals[-1] / TABLE_B1[actuation][2] - 1.0 == pytest.approx(-0.0175, abs=2e-3)


def test_appendix_b_by_a_moment_is_nearly_by_rotation() -> None:
    """The spring takes nearly all of the moment, so the fold is nearly uniform."""
    moment, rotation = folding.solve("b", 16, 2), folding.solve("a", 16, 2)
    energy = moment.state.energy
    assert energy.stretching + energy.bending == pytest.approx(rotation.state.energy.total, rel=1e-3)
    angles = moment.state.fold_angle("crease")
    assert angles.mean() == pytest.approx(math.pi / 2, abs=1e-6)
    assert np.ptp(angles) < 0.01


def test_curved_edges_are_needed() -> None:
    """With straight edges along the crease the energy is far off at this density and only halves its error."""
    curved = folding.sheet_model("a", 16, 2)
    straight = replace(curved, mesh=replace(curved.mesh, curves={}))
    energy = [fold(m).energy.total for m in (curved, straight)]
    assert abs(energy[1] / energy[0] - 1.0) > 0.02


def fold(model: Model) -> ShellState:
    path = bh.trace(model.fold("crease", by=math.pi / 2), strategy=LoadControl(2.0, 2.0))
    assert path.outcome == "reached"
    state = path[-1]
    assert isinstance(state, ShellState)
    return state


def test_appendix_b_by_a_force_has_two_readings() -> None:
    """The table's 5.87e-2 N mm lies between the spring resisting the force and the crease a free hinge."""
    spring, hinge = folding.solve("c-spring", 16, 2), folding.solve("c-hinge", 16, 2)
    totals = []
    for solved in (spring, hinge):
        assert solved.outcome == "reached"
        assert solved.state.fold_angle("crease").mean() == pytest.approx(math.pi / 2, abs=1e-6)
        energy = solved.state.energy
        totals.append(energy.stretching + energy.bending)
    assert totals[0] > 1.05 * TABLE_B1["c"][2]
    assert totals[1] < 0.95 * TABLE_B1["c"][2]
    assert hinge.load < 0.25 * spring.load


def test_three_creases_fold_alternately() -> None:
    """Fig. B.7 (b): mountain, valley, mountain, in one increment from flat and without supports."""
    arcs = meshes.annulus_sector([90.0, 100.0, 110.0], 10.0, 0.4, folds=["mountain", "valley", "mountain"])
    mesh = meshes.structured(arcs, along=8, rows=1, kind="mirrored")
    solved = folding.rotate(Model(mesh, folding.SHEET, formulation="shell"), "all")
    assert solved.outcome == "reached"
    for crease, sign in (("crease-1", 1.0), ("crease-2", -1.0), ("crease-3", 1.0)):
        np.testing.assert_allclose(solved.state.fold_angle(crease), sign * math.pi / 2, rtol=1e-12)


def test_full_annulus_buckles_into_two_waves() -> None:
    """Fig. B.7 (a); the supports that hold the phase of the waves carry nothing but what the mesh lacks in symmetry."""
    model = folding.full_annulus(48, 1)
    solved = folding.rotate(model, strategy=folding.BUCKLE)
    assert solved.outcome == "reached"
    assert solved.state.stable
    height = solved.state.crease_points("crease")[:, 2]
    waves = np.abs(np.fft.rfft(height - height.mean()))
    assert np.argmax(waves) == 2
    assert waves[2] > 50 * np.delete(waves, 2).max()
    moment = np.nanmean(solved.state.crease_moments)
    assert np.abs(solved.state.reactions).max() < 1e-2 * abs(moment)  # 1e-5 with 144 cells
