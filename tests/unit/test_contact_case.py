"""Case `contact`: what its counts are made of, and the elastica that its strip is judged by."""

import math
from dataclasses import replace

import numpy as np
import pytest

from verification.framework.checks import CaseResult
from verification.studies.solver.contact import meeting, pressed, read
from verification.studies.solver.contact_layers import block, height
from verification.studies.solver.contact_scenes import Row, drawn, play
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
    deflection, force, arm = read(pressed(32, 0.2))
    exact = wrapped_by(deflection, 40.0, 60.0, 4000.0 * 5.0 * 0.3**3 / 12.0)
    assert force == pytest.approx(exact.force, rel=0.05)
    assert arm == pytest.approx(exact.arm, rel=0.1)
