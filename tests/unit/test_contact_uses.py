"""Uses of contact in case `contact`: each figure of the case can fail, and strips that cross are told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshes
from bh.analysis.contact import first_contact
from verification.framework.checks import CaseResult, Context
from verification.studies.solver import contact_more, contact_uses


def failed(result: CaseResult) -> list[str]:
    return [check.quantity for check in result.checks if check.passed is False]


def test_friction_moulds_and_creases_hold_and_fail_with_other_numbers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    result = CaseResult("contact", "Contact", "?", "s")
    contact_more.friction(result, quick=True)
    contact_more.mould(result)
    contact_more.shut(result, quick=True)
    assert failed(result) == []
    assert len(result.checks) == 7
    wrong = CaseResult("contact", "Contact", "?", "s")
    monkeypatch.setattr(contact_more, "FACETS", 6)  # a hexagon is no cylinder
    contact_more.mould(wrong)
    assert failed(wrong) == ["force of a mould of facets that bends a strip"]


def test_distance_of_panels_that_share_no_crease() -> None:
    mesh = meshes.structured(meshes.strip(10.0, 30.0, [10.0, 20.0], ["mountain", "valley"]), along=2, rows=2)
    x = mesh.points.copy()
    assert contact_uses.apart(mesh, x) == pytest.approx(10.0)
    third = x[:, 1] >= 20.0
    x[third, 1], x[third, 2] = 40.0 - x[third, 1], 0.7  # over the second panel
    x[third & (x[:, 1] < 10.5), 1] = 9.9
    assert 0.7 < contact_uses.apart(mesh, x) < 0.71


def test_panels_of_fig_5_3_stop_where_their_thickness_says() -> None:
    path = contact_uses.closed("thickness")
    assert path.reached
    angle, ratio = contact_uses._curve(path)
    assert angle[-1] == pytest.approx(2.0 * np.arcsin(0.05), rel=0.03)
    assert ratio[-1] > 11.0
    assert first_contact(path) is None


@pytest.mark.slow
def test_the_uses_of_the_case_hold(tmp_path: Path) -> None:
    result = CaseResult("contact", "Contact", "?", "s")
    contact_uses.uses(result, Context(tmp_path, True, lambda _: None))
    assert failed(result) == []
    assert {picture["file"] for picture in result.pictures} == {p.name for p in tmp_path.iterdir()}
    assert sum("panels met without contact" in note for note in result.notes) == 1


@pytest.mark.slow
def test_a_strip_of_two_segments_meets_itself_and_is_stopped() -> None:
    path = contact_uses.crossing("two segments", contact="auto")
    assert contact_uses.said(path)
    assert first_contact(path) is None
    assert any(state.energy.contact > 0.0 for state in path)
    assert first_contact(contact_uses.crossing("two segments", contact=False)) is not None
