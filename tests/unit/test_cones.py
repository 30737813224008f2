"""Creased discs: the closed form of their two states, and the way that leads to the other one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bh import trace
from verification.studies.solver.cones import (
    BACK,
    OCTAVES,
    STAGES,
    cone_model,
    disc_mesh,
    elevations,
    of_octave,
    small_hole,
)
from verification.theory.creased_cone import cone_state, small


@pytest.mark.parametrize(
    ("creases", "snapped", "energy"),
    [(3, False, 0.090869), (4, False, 0.350891), (2, True, 1.064634), (4, True, 2.616506)],
)
def test_small_slopes(creases: int, snapped: bool, energy: float) -> None:
    """Figures that Hermite finite elements around the disc gave, too."""
    assert small(creases, snapped)[2] == pytest.approx(energy, abs=2e-6)


def test_any_angle() -> None:
    """Energies at 30, 60 and 90 degrees; a small angle has those of small slopes."""
    for degrees, energy in ((30.0, 0.71504), (60.0, 2.83307), (90.0, 6.27589)):
        assert cone_state(4, math.radians(degrees), True).energy == pytest.approx(energy, abs=2e-5)
    assert cone_state(2, 1e-2, True).energy / 1e-4 == pytest.approx(small(2, True)[2], rel=1e-3)
    state = cone_state(4, math.radians(90.0), False)
    assert np.degrees([state.middle, state.crease]) == pytest.approx([-34.370, -15.237], abs=2e-3)


def test_discs_of_two_holes_are_the_same_but_for_an_octave() -> None:
    large, small_ = disc_mesh(3, 2, 2), disc_mesh(4, 2, 2)
    around = 2 * 2 * 4
    assert len(small_.points) - len(large.points) == 2 * around
    assert small_.points[2 * around :] == pytest.approx(large.points)
    assert small_.points[: len(large.points)] == pytest.approx(0.5 * large.points)


def test_limits_of_small_holes() -> None:
    """Values and energies that go as the law of holes says give its limits; those that do not settle give none."""
    seen = [26.0 - 21.0 / (octaves - 2.4) for octaves in OCTAVES]
    limit, offset = small_hole(seen)
    assert (limit, offset) == pytest.approx((26.0, 2.4))
    energies = [1.145 * octaves * math.log(2.0) - 0.3 - 0.8 / (octaves - 2.4) for octaves in OCTAVES]
    assert of_octave(energies, offset) == pytest.approx(1.145)
    assert not np.isfinite(small_hole([20.0, 21.0, 22.5])).any()
    assert not np.isfinite(of_octave(energies, small_hole([20.0, math.nan, 22.5])[1]))


@pytest.mark.slow
def test_creases_lead_to_the_other_state_and_back() -> None:
    """On a coarse disc: its energies are in the order of the closed forms, and the axis has the sign of the state."""
    path = trace(cone_model(6, "consistent", 4, 2), warn=False, neighbours=False)
    assert path.reached
    assert path.stable
    ends = {state.step: state for state in path}
    energy = {step: state.energy.total for step, state in ends.items()}
    assert energy[0] == pytest.approx(energy[BACK], rel=1e-4)
    ratio = cone_state(4, math.pi / 3, True).energy / cone_state(4, math.pi / 3, False).energy
    assert energy[STAGES[2].step] / energy[0] == pytest.approx(ratio, rel=0.1)
    for stage in STAGES:
        middle, crease = elevations(ends[stage.step], stage.creases)
        sign = 1.0 if stage.snapped else -1.0  # at rest it is the cone of valley creases
        assert (middle > 0.0) == (sign * stage.exact.middle > 0.0)
        assert (crease > middle) == stage.snapped
