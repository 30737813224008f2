"""Case `contact`: what its counts are made of, and the elastica that its strip is judged by."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bh.analysis.contact import first_contact
from verification.framework.checks import CaseResult
from verification.studies.solver import contact_strips
from verification.studies.solver.contact import lift_off, meeting, orders, pressed, read
from verification.studies.solver.contact_layers import block, height
from verification.studies.solver.contact_scenes import Row, drawn, play
from verification.theory import touching
from verification.theory.wrapped import wrapped, wrapped_by

GOOD = Row(0, "a letter", "reached", pressed=True, fine="reached", apart=1e-9)


def counted(*rows: Row) -> CaseResult:
    result = CaseResult("contact", "Contact", "?", "s")
    meeting(result, rows)
    return result


def failed(*rows: Row) -> list[str]:
    return [check.quantity for check in counted(*rows).checks if check.passed is False]


def test_a_scene_that_crosses_ends_apart_in_silence_or_without_a_reason_fails_its_check() -> None:
    assert failed(GOOD) == []
    assert failed(GOOD, replace(GOOD, crossing="step 1")) == [
        "scenes with an accepted state that meets itself"
    ]
    assert failed(replace(GOOD, outcome="stalled")) == ["scenes that do not reach and do not say why"]
    assert failed(replace(GOOD, outcome="stalled", reason="it is stuck")) == []
    assert len(failed(replace(GOOD, apart=0.03))) == 1
    assert failed(replace(GOOD, apart=0.03, told=("jump",))) == []


def test_scenes_are_the_same_every_time_and_ask_for_contact() -> None:
    for number in range(8):
        words, model = drawn(number)
        again = drawn(number)[1]
        assert drawn(number)[0] == words
        assert np.array_equal(model.mesh.points, again.mesh.points)
        assert model.contact in (0.05, 0.1, 0.2)


def test_a_block_is_as_high_as_its_sheets_are_thick() -> None:
    path = block(0.1)
    assert path.outcome == "reached"
    assert height(path) == pytest.approx(0.5, rel=0.01)
    assert path[0].points[:, 2].max() + 0.1 > 0.505  # they lie apart at first
    path.steps.clear()
    assert math.isnan(height(path))


@pytest.mark.slow
def test_a_scene_is_played_and_presses() -> None:
    row = play(2)
    assert row.outcome == "reached"
    assert row.pressed
    assert row.crossing == ""
    assert row.apart < 0.02


def test_the_elastica_on_a_cylinder_is_one_on_a_point_before_it_wraps_and_the_arm_lies_on_the_cylinder() -> (
    None
):
    # small deflections of a strip of half length L: F = 6 EI d / L^3 by beam theory
    EI, L, R = 100.0, 40.0, 400.0
    begin = wrapped(1e-6, L, R, EI)
    assert begin.force == pytest.approx(6.0 * EI * begin.deflection / L**3, rel=2e-2)
    later = wrapped_by(12.0, 40.0, 60.0, EI)
    assert later.deflection == pytest.approx(12.0, rel=1e-9)
    assert 0.0 < later.arm < 60.0 * math.sin(later.phi)
    with pytest.raises(ValueError, match="different signs"):
        wrapped_by(1e-3, 40.0, 60.0, EI)


def test_the_strip_has_the_force_of_the_elastica_on_a_coarse_mesh() -> None:
    path = pressed(32, 0.2)
    deflection, force, arm = read(path)
    exact = wrapped_by(deflection, 40.0, 60.0, 4000.0 * 5.0 * 0.3**3 / 12.0)
    assert force == pytest.approx(exact.force, rel=0.05)
    assert arm == pytest.approx(exact.arm, rel=0.1)
    assert lift_off(path, arm) == pytest.approx(60.0 * math.sin(exact.phi), rel=0.02)


def test_elasticas_that_meet_themselves_are_those_of_small_slopes() -> None:
    EI = 45.0
    flat = touching.pressed(
        0.02, 1000.0, 40.0, EI
    )  # EI / (R V) from its end, and rises by what is left of its bow
    assert flat.flat == pytest.approx(40.0 - 2.25, rel=1e-3)
    with pytest.raises(ValueError, match="leave its image"):
        touching.pressed(1e-3, 1000.0, 40.0, EI)
    # a ring: (pi / 4 - 2 / pi) F R^3 / EI by Castigliano
    shorter = 0.002
    assert touching.squeezed(1.0, 1.0, 2.0 - shorter) == pytest.approx(
        shorter / (math.pi / 4.0 - 2.0 / math.pi), rel=1e-2
    )
    assert touching.squeezed(20.0, EI) == pytest.approx(touching.squeezed(1.0, 1.0) * EI / 400.0, rel=1e-6)


def test_bowed_strips_lie_flat_as_far_as_their_elastica_and_hand_on_the_force_of_their_ends() -> None:
    at, force, end = contact_strips.read_strips(contact_strips.two_strips(16, 0.1))
    assert force == pytest.approx(end, rel=1e-6)
    exact = touching.pressed(end, contact_strips.BOW, contact_strips.HALF, contact_strips.EI)
    assert at == pytest.approx(exact.flat, rel=0.01)


def test_a_ring_that_is_squeezed_shut_keeps_its_shape_and_presses_on_itself() -> None:
    path = contact_strips.ring(16, 0.1)
    shut = 0.5 * touching.squeezed(contact_strips.RADIUS, contact_strips.EI)
    assert path.outcome == "reached"
    assert contact_strips.read_ring(path) == pytest.approx((contact_strips.FACTOR - 1.0) * shut, rel=0.02)
    assert first_contact(path) is None


def test_orders_are_read_from_the_widest_and_the_least_gap_of_the_finest_mesh() -> None:
    result = CaseResult("contact", "Contact", "", "")
    for gap in (0.2, 0.1, 0.05):
        for along in (16, 32):
            result.check(
                "force",
                1.0 + gap**2 * (1.0 if along == 32 else 3.0),
                reference=1.0,
                params={"gap": gap, "along": along},
            )
    orders(result)
    assert result.checks[-1].quantity == "order in the gap: force"
    assert result.checks[-1].value == pytest.approx(2.0)
