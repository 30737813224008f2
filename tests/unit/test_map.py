"""The map of kinds of sheets: sheets are drawn the same again, cells say what they are of, empty ones why."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh.errors import InputError
from reports.records import Case, CaseInfo, Check
from reports.sheet_map import sheet_map
from verification.framework.checks import CaseResult
from verification.studies.solver import map as case
from verification.studies.solver.map import MEMBERS, QUANTITIES, apart, high_stress, solved
from verification.studies.solver.map_sheets import ABSENT, EIGHTHS, KINDS, sample


@pytest.mark.parametrize("kind", KINDS)
def test_sheets_are_drawn_the_same_again_and_have_meshes(kind: str) -> None:
    one, again, other = sample(kind, 0), sample(kind, 0), sample(kind, 1)
    assert one.words == again.words
    assert np.array_equal(one.model.mesh.points, again.model.mesh.points)
    assert one.words != other.words
    found = [next(member.meshes(one), None) for member in MEMBERS if member.slender == 1]
    sizes = [len(mesh.triangles) for mesh in found if mesh is not None]
    assert len(sizes) == 3
    assert sizes == sorted(set(sizes))
    missing = {quantity for quantity, there in (("force", one.force), ("stiffness", one.probes)) if not there}
    missing |= set() if one.spring else {"fold angle"}
    assert missing == set(ABSENT.get(kind, {}))  # cells are empty by intent, and the map says why


def found(value: float, **why: Any) -> dict[str, Any]:
    errors = dict.fromkeys(QUANTITIES, float("nan")) | {"energy": value, "shape": 0.1 * value}
    models = {
        member.name: {"errors": dict(errors), "time_s": 0.1, "unknowns": 100, "why": ""} for member in MEMBERS
    }
    return {"words": "a sheet", "bars": dict(errors) | {"energy": 0.01}, "models": models} | why


def mapped(*sheets: dict[str, Any]) -> CaseResult:
    result = CaseResult("map", "t", "q", "the shell")
    case._cells(result, "narrow ring", list(sheets))
    return result


def test_a_cell_is_the_median_with_its_bar_and_empty_ones_say_why() -> None:
    refused = found(0.3)
    refused["models"]["bars and hinges"] = {
        "errors": None,
        "time_s": float("nan"),
        "unknowns": None,
        "why": "refused: a grain",
    }
    late = {"words": "a sheet", "why": "more than 60 s of processor time"}
    result = mapped(found(0.1), found(0.2), refused, late)
    checks = [(n, Check(**check.record())) for n, check in enumerate(result.checks, 1)]
    shown = sheet_map([Case(CaseInfo(name="map"), checks)])
    assert shown is not None
    assert shown.quantities == ["energy", "shape"]  # nothing pulls, nothing is held
    bars, _, two, _ = shown.kinds["narrow ring"]
    assert [row.model for row in (bars, two)] == ["bars and hinges", "consistent, 2 rows"]
    assert two.cells["energy"][1].value == pytest.approx(0.2)
    assert two.cells["energy"][1].bar == pytest.approx(0.01)
    assert two.cells["energy"][1].params["largest"] == pytest.approx(0.3)
    assert two.time_s == pytest.approx(0.1)
    assert bars.cells["energy"][1].params["sheets"] == 2
    assert (bars.without, two.without) == (2, 1)
    assert bars.why == "more than 60 s of processor time; refused: a grain"
    assert all(check.passed is None for check in result.checks)  # reported: a map judges nobody


def test_a_mesh_that_does_not_converge_fails() -> None:
    for coarse, fine, passed in ((0.2, 0.1, True), (0.1, 0.2, False), (0.001, 0.005, True)):
        sheet = found(coarse)
        sheet["models"]["consistent, 4 rows"]["errors"]["energy"] = fine
        result = mapped(sheet)
        case._converges(result, "narrow ring")
        assert result.checks[-1].passed is passed


def test_a_kind_without_any_figure_has_no_cells() -> None:
    result = mapped({"words": "a sheet", "why": "the shell does not reach its end"})
    assert {check.quantity for check in result.checks} == {"sheets without figures"}


def test_cells_that_are_empty_by_intent_say_why() -> None:
    result = mapped(found(0.1))
    case._absent(result, "narrow ring", 5)
    checks = [(n, Check(**check.record())) for n, check in enumerate(result.checks, 1)]
    shown = sheet_map([Case(CaseInfo(name="map"), checks)])
    assert shown is not None
    assert list(shown.kinds) == ["narrow ring"]
    assert [row.model for row in shown.kinds["narrow ring"]] == [member.name for member in MEMBERS]
    assert shown.empty == [
        ("force", "nothing pulls or presses", ["narrow ring"]),
        ("stress", "the model is bars and hinges, which have none", ["narrow ring"]),
    ]


def test_a_ring_is_compared_with_the_nearer_of_its_two_saddles() -> None:
    """Turned by a right angle a saddle is as good; a sheet without twins keeps its distance."""
    item = sample("closed ring", 0)
    mesh = next(MEMBERS[2].meshes(item))
    assert len(mesh.nodes("edge:outer")) % EIGHTHS == 0
    flat = bh.Model(mesh, item.model.sheet, formulation="bars-and-hinges", contact=False)
    state = bh.trace(flat.fold("crease", by=1e-3), neighbours=False)[-1]
    x, y = mesh.points[:, 0], mesh.points[:, 1]
    up = np.column_stack((x, y, 0.002 * (x**2 - y**2)))
    one, other = replace(state, points=up), replace(state, points=up * [1.0, 1.0, -1.0])
    assert apart(one, other, item) < 1e-3
    assert apart(one, other, replace(item, twins=())) > 1.0


def test_a_sheet_that_takes_too_long_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    def endless(*_: object, **__: object) -> None:
        while True:
            pass

    monkeypatch.setattr(case, "trace", endless)
    monkeypatch.setattr(case, "LIMIT_S", 0.05)
    path, took, why = solved(MEMBERS[2], sample("twisted", 0))
    assert path is None
    assert math.isnan(took)
    assert why == "more than 0.05 s of processor time"


def test_the_stress_that_is_compared_is_what_five_percent_of_the_area_exceed() -> None:
    """Of a strip pulled evenly it is the pull; bars and hinges have none."""
    mesh = meshes.structured(meshes.strip(20.0, 5.0, [2.5], "flat"), along=8, rows=1)
    model = bh.Model(mesh, bh.Sheet(E=1000.0, nu=0.0, t=0.5), formulation="consistent")
    model = model.support("edge:start", "xyz").support("edge:end", "z").displace("edge:end", "x", 0.02)
    strain = 0.001 * (1.0 + 0.0005)  # Green's
    assert high_stress(bh.trace(model)[-1]) == pytest.approx(1000.0 * strain, rel=1e-6)
    assert math.isnan(high_stress(bh.trace(replace(model, formulation="bars-and-hinges"))[-1]))


def test_kinds_may_be_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BH_MAP", "network, closed ring")
    assert case.wanted(("twisted",)) == ["network", "closed ring"]
    monkeypatch.setenv("BH_MAP", "")
    assert case.wanted(("twisted",)) == ["twisted"]
    monkeypatch.setenv("BH_MAP", "networks")
    with pytest.raises(InputError, match="there is no kind 'networks'; give some of narrow ring"):
        case.wanted(("twisted",))
