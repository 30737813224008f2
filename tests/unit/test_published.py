"""Closed forms behind the case `published`, and that a wrong spring would be seen."""

from __future__ import annotations

import math

import pytest

from bh import trace
from verification.studies.solver.published.vee import INCLINE, spans, vee_model
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
