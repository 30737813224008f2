"""The studies of the source's Chapter 3 on a few small meshes; the whole of each through `bh verify`."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from verification.studies.ch3 import cone, fig3_6, fig3_8, fig3_10


def test_lifted_annulus_is_softest_on_the_coarse_mesh_of_bars() -> None:
    """Fig. 3.10 (d): long cells lock; the converged force is lower still."""
    forces = [fig3_10.lift(alpha, 1, "alternating", "bars-and-hinges").force[-1] for alpha in (1.0, 2.0, 4.0)]
    assert forces == sorted(forces)
    fine = fig3_10.lift(1.0, 4, "alternating", "consistent")
    assert fine.path.outcome == "reached"
    assert 0.10 < fine.force[-1] < 0.75 * forces[0]


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
def test_work_of_the_lifting_force_is_the_energy_gained(formulation: str) -> None:
    """What the tip's force does on its way is stored; the held end does no work. And the end does not move."""
    item = fig3_10.lift(1.0, 1, "alternating", formulation, by=10.0)
    states = [item.folded, *(state for state in item.path if state.step == 1)]
    gained = item.lifted.energy.total - item.folded.energy.total
    work = PchipInterpolator(item.rise, item.force).integrate(0.0, item.rise[-1])
    assert item.rise[-1] == pytest.approx(10.0, abs=1e-9)
    assert work == pytest.approx(gained, rel=0.02)
    nodes = item.folded.mesh.nodes("edge:start")
    assert np.abs(states[-1].points[nodes] - item.folded.points[nodes]).max() < 1e-9


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
def test_reached_angles_by_rest_angle_and_length_scale(formulation: str) -> None:
    """Fig. 3.8 (a): stiff creases take their rest angle; soft ones and small angles stay behind."""
    study = fig3_8.studies()[0]
    items = [fig3_8.reach(study, Lstar, formulation, study.coarse) for Lstar in (0.01, 25.0, 700.0)]
    assert all(item.path.outcome == "reached" for item in items)
    angles = np.array([item.angles[0] for item in items])
    assert angles.shape == (3, len(study.rests))
    assert np.abs(angles[0, :4] - study.rests[:4]).max() < 0.1
    assert (np.diff(angles, axis=0) > 0.0).all()
    off = angles - np.array(study.rests)
    assert (np.diff(off[1:], axis=1) > 0.0).all()
    # the states in between belong to rest angles in between
    assert (items[1].all_rests[0], items[1].all_rests[-1]) == (180.0, 0.0)
    at = int(np.argmin(np.abs(items[1].all_rests - 90.0)))
    assert items[1].all_angles[0, at] == angles[1, study.rests.index(90)]
    assert (items[1].all_angles[0] > items[1].all_rests)[1:].all()  # the first is flat


def test_small_deviation_of_a_stiff_crease_is_the_moment_over_its_stiffness() -> None:
    """phi - phi_R = M / k_f (Eq. 3.12): ten times the L*, ten times the distance, while both are small."""
    study = fig3_8.studies()[0]
    first, second = (fig3_8.reach(study, Lstar, "consistent", (16, 2)) for Lstar in (0.01, 0.1))
    column = study.rests.index(90)
    ratio = (second.angles[0, column] - 90.0) / (first.angles[0, column] - 90.0)
    assert ratio == pytest.approx(10.0, rel=0.01)
    path = second.path
    state = next(item for item in path if math.isclose(item.step + item.lam, column + 1.0))
    k_f = path.model.sheet.bending_stiffness(nu=0.0) / 0.1
    moment = float(np.abs(state.crease_moment("crease")).mean())
    assert math.radians(second.angles[0, column] - 90.0) == pytest.approx(moment / k_f, rel=0.01)


def test_two_creases_lag_by_their_curvature() -> None:
    """Fig. 3.8 (d): the curved crease stays farther from its rest angle than the straighter one."""
    study = fig3_8.studies()[1]
    item = fig3_8.reach(study, 25.0, "consistent", study.coarse)
    off = np.abs(item.angles - np.array(study.rests))
    assert item.path.outcome == "reached"
    assert (off[0] > off[1]).all()


def test_free_ends_lack_energy_with_rows_only() -> None:
    """Fig. 3.6: the ends of the converged sheet are flatter over more than ten millimetres; one row cannot show it."""
    angle = cone.ANGLES[0]
    rows = fig3_6.fold(angle, fig3_6.Mesh("consistent", "alternating", 2.0, 4))
    bars = fig3_6.fold(angle, fig3_6.Mesh("bars-and-hinges", "staggered", 12.0))
    assert rows.density is not None
    assert bars.density is not None
    assert 0.85 < rows.ratio < 0.92 < bars.ratio < 1.0
    assert fig3_6.lost_length(rows.density) > 5.0 * fig3_6.lost_length(bars.density)
    assert fig3_6.reach_of_end(rows.density) > 10.0
    assert fig3_6.reach_of_end(bars.density) == fig3_6.BIN
    # both ends alike, and nothing is lost between the bins
    assert rows.density == pytest.approx(rows.density[::-1], rel=0.02)
    assert rows.density.mean() == pytest.approx(rows.ratio, rel=0.01)


def test_lost_length_and_reach_of_a_made_profile() -> None:
    density = np.full(40, 2.0)
    density[:3] = density[-3:] = [0.0, 1.0, 1.0]  # two thirds of three bins at each end
    assert fig3_6.lost_length(density) == pytest.approx(2.0 * fig3_6.BIN)
    assert fig3_6.reach_of_end(density) == 3.0 * fig3_6.BIN
    assert fig3_6.lost_length(np.ones(40)) == 0.0
    assert fig3_6.reach_of_end(np.ones(40)) == 0.0
