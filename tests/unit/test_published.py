"""Closed forms behind the case `published`, and that a wrong spring would be seen."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from bh import trace
from verification.studies.solver.published.clamped_fold import KINK, clamp_couple, kink_left
from verification.studies.solver.published.vee import INCLINE, spans, vee_model
from verification.theory import angle_section, clamped_arch, folded_ring
from verification.theory.sine import SineFold
from verification.theory.vee import compliance, opened


@pytest.mark.parametrize("ratio", [0.2, 1.0, 5.0])
def test_small_forces_open_as_the_closed_form(ratio: float) -> None:
    found = 2.0 * (opened(1e-6, ratio, INCLINE) - math.cos(INCLINE)) / 1e-6
    assert found == pytest.approx(compliance(ratio, INCLINE), rel=1e-5)


def test_limits_of_the_elastica() -> None:
    assert opened(0.5, 1e-9, INCLINE) > 0.999  # a crease without stiffness lets the strip go straight
    assert opened(0.5, 1e9, 0.0) == pytest.approx(1.0)
    found = [opened(force, 1.0, INCLINE) for force in (0.1, 1.0, 10.0)]
    assert math.cos(INCLINE) < found[0] < found[1] < found[2] < 1.0


def test_a_strip_is_pulled_open_as_the_elastica_and_a_wrong_spring_is_seen() -> None:
    path = trace(vee_model(1.0, (1.0,), "consistent", 8)).require()
    rest, pulled = spans(path)
    assert rest == pytest.approx(math.cos(INCLINE), rel=1e-6)
    assert pulled == pytest.approx(opened(1.0, 1.0, INCLINE), rel=1e-3)
    assert abs(pulled - opened(1.0, 1.1, INCLINE)) > 3e-3


@pytest.mark.parametrize("share", [0.3, 0.85])
def test_energy_and_length_of_sine_creases_are_those_of_the_folded_curve(share: float) -> None:
    family = SineFold(12.0, 100.0, 30.0, share)
    tangent, cosine = math.tan(family.incline), math.cos(family.incline)
    slope = 12.0 * family.q

    def bend(x: float) -> float:
        s = slope * math.cos(family.q * x)
        root = math.sqrt(1.0 - (s * tangent) ** 2)
        curve = slope * family.q * math.sin(family.q * x) * tangent / root
        return 0.5 * curve**2 * 30.0

    def along(x: float) -> float:
        s = slope * math.cos(family.q * x)
        return math.sqrt(1.0 + s * s - (s / cosine) ** 2)

    assert family.energy(2.0) == pytest.approx(2.0 * quad(bend, 0.0, 100.0)[0], rel=1e-9)
    assert family.length == pytest.approx(quad(along, 0.0, 100.0)[0], rel=1e-9)
    assert family.fold_angle(np.array([25.0]))[0] == pytest.approx(2.0 * family.incline)  # at a crest


def test_flat_sine_creases_have_no_energy_and_their_full_length() -> None:
    flat = SineFold(12.0, 100.0, 30.0, 1e-4)
    assert flat.energy(1.0) == pytest.approx(0.0, abs=1e-6)
    assert flat.length == pytest.approx(100.0, rel=1e-7)


@pytest.mark.slow
def test_the_folded_ring_keeps_its_length_and_has_more_energy_than_a_plane_circle() -> None:
    theta = math.radians(150.0)
    ring = folded_ring.folded_ring(theta)
    assert ring.energy > 2.0 * math.pi / math.tan(0.5 * theta) ** 2
    assert 0.0 < ring.height < 1.0
    assert ring.crest != pytest.approx(ring.node, rel=1e-3)
    assert folded_ring.curvature(math.pi) == 1.0


def test_layers_take_a_small_part_of_thin_panels_and_all_of_thick_ones() -> None:
    theta = math.radians(90.0)
    thin, thick = (folded_ring.release(theta, 100.0, 5.0, t) for t in (1e-5, 50.0))
    wide = 3.0**0.25 * 5.0 / math.sqrt(100.0 * 1e-5)
    assert thin == pytest.approx(2.0 / wide, rel=1e-12)
    assert thick == pytest.approx(1.0, abs=1e-3)
    assert folded_ring.release(theta, 100.0, 5.0, 1e-9) == pytest.approx(
        2.0 / (3.0**0.25 * 5.0 / math.sqrt(1e-7))
    )
    narrow = folded_ring.release(theta, 100.0, 2.5, 0.25 * 0.02)  # the thickness with the square of the width
    assert narrow == pytest.approx(folded_ring.release(theta, 100.0, 5.0, 0.02))


@pytest.mark.slow
def test_a_ring_with_layers_has_less_energy_and_nearly_the_height() -> None:
    theta = math.radians(90.0)
    isometric, layered = folded_ring.folded_ring(theta), folded_ring.folded_ring(theta, 0.4387)
    assert layered.energy == pytest.approx(0.806 * isometric.energy, rel=1e-3)
    assert layered.height == pytest.approx(1.00063 * isometric.height, rel=2e-5)


def test_the_snapping_strip_has_its_known_values() -> None:
    assert clamped_arch.second_mode() == pytest.approx(8.98682, rel=1e-6)
    mu, tau = clamped_arch.snap()
    assert mu == pytest.approx(1.7818, abs=1e-4)
    assert clamped_arch.turned(tau - 0.1) < mu > clamped_arch.turned(tau + 0.1)
    assert clamped_arch.turned(2.0 * math.pi + 1e-5) < 1e-3  # the arch between straight clamps
    assert clamped_arch.turned(clamped_arch.second_mode() - 1e-5) < 1e-2  # the saddle


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_the_angle_section_buckles_below_the_bound_of_plane_legs(nu: float) -> None:
    exact, bound = angle_section.exact(160.0, 20.0, nu), angle_section.rayleigh(160.0, 20.0, nu)
    assert 0.95 * bound < exact < bound
    if nu == 0.3:
        assert angle_section.exact(2e3, 20.0, nu) == pytest.approx(
            0.425, abs=2e-3
        )  # a long plate, Timoshenko


def test_a_fold_between_clamps_that_follow_it_keeps_its_kink() -> None:
    turn = (0.5 * KINK, -0.5 * KINK)
    assert kink_left(turn) == pytest.approx(KINK)
    assert clamp_couple(turn) == pytest.approx(0.0, abs=1e-15)
    assert kink_left((0.005, -0.002)) == pytest.approx(kink_left((0.002, -0.005)))  # seen from the other end
