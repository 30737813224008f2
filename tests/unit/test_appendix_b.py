"""The study of App. B: distances of curves, fields by cells, loads at a right angle, and what is said of failures."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import typer
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from bh.analysis.alignment import aligned, hausdorff
from bh.solvers.outcome import Outcome
from verification.framework import cases, command
from verification.framework.checks import CaseResult, Check, Context
from verification.studies.app_b import appendix_b_cross as cross
from verification.studies.app_b import appendix_b_fields as fields
from verification.studies.app_b import appendix_b_shell as table
from verification.studies.app_b import shell_folding as folding

U = np.linspace(0.0, 3.0, 40)
HELIX = np.stack([np.cos(U), np.sin(U), U], axis=1)


# --------------------------------------------------------------------------------------- curves


def test_a_moved_curve_is_brought_back() -> None:
    turn = Rotation.from_rotvec([0.3, -2.0, 1.1])
    moved = turn.apply(HELIX) + np.array([3.0, -4.0, 50.0])
    back, found, shift = aligned(moved, HELIX)
    np.testing.assert_allclose(back, HELIX, atol=1e-12)
    np.testing.assert_allclose(found.apply(moved) + shift, HELIX, atol=1e-12)
    assert hausdorff(back, HELIX) < 1e-12


def test_a_mirrored_curve_is_not() -> None:
    """A left-handed helix is no right-handed one."""
    back, _, _ = aligned(HELIX * [1.0, 1.0, -1.0], HELIX)
    assert np.abs(back - HELIX).max() > 0.1


def test_distances_of_lines() -> None:
    line = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]])
    kinked = np.array([[0.0, 0.0, 0.0], [5.0, 0.7, 0.0], [10.0, 0.0, 0.0]])
    longer = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [13.0, 0.0, 0.0]])
    assert hausdorff(line, line + np.array([0.0, 0.0, 2.0])) == pytest.approx(2.0)
    assert hausdorff(line, kinked) == pytest.approx(0.7)
    assert hausdorff(line, longer) == hausdorff(longer, line) == pytest.approx(3.0)
    halves = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [10.0, 0.0, 0.0]])
    assert hausdorff(line, halves) < 1e-14  # where the corners lie does not matter


# --------------------------------------------------------------------------------------- loads at a right angle


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
@pytest.mark.parametrize("actuation", ["b", "c-spring", "c-hinge"])
def test_loads_fold_by_a_right_angle(formulation: str, actuation: str) -> None:
    solved = folding.solve(actuation, 8, 1, formulation)
    assert solved.reached
    assert solved.state.fold_angle("crease").mean() == pytest.approx(math.pi / 2, abs=1e-6)
    assert 0.0 < solved.load < folding.ENOUGH[actuation]


def test_the_moment_is_that_of_the_spring_and_of_the_sheet() -> None:
    """(b) against (a): the couple a length is k_f pi / 2 and what the sheet takes at the same angle."""
    couple = folding.solve("b", 16, 1, "bars-and-hinges").load
    sheet = folding.solve("a", 16, 1, "bars-and-hinges").state.crease_moment("crease").mean()
    assert couple == pytest.approx(folding.CREASE_STIFFNESS * math.pi / 2 + sheet, rel=1e-3)


def test_a_load_that_is_not_enough_has_no_right_angle() -> None:
    """The last state lies short of it, and the outcome says so."""
    model = folding.sheet_model("b", 8, 1).crease("crease", stiffness=folding.CREASE_STIFFNESS)
    solved = folding.load(model.moment("crease", to=2e-3), 2e-3)
    assert solved.outcome == "stalled"
    assert not solved.reached
    assert solved.state.fold_angle("crease").mean() < 1.0


# --------------------------------------------------------------------------------------- fields by cells


def state(density: Any, along: int = 16, rows: int = 2) -> Any:
    """Stands for a state: the sector's mesh with a given energy an area."""
    mesh = folding.sheet_model("a", along, rows).mesh
    middle = mesh.points[mesh.triangles].mean(axis=1)
    values = density(np.hypot(middle[:, 0], middle[:, 1]), np.arctan2(middle[:, 1], middle[:, 0]))
    return SimpleNamespace(mesh=mesh, energy_density={"stretching": values, "bending": 2.0 * values})


def test_a_uniform_field_is_uniform() -> None:
    grid = fields.on_grid(state(lambda r, theta: 3.0 + 0.0 * r), 16, 2)
    np.testing.assert_allclose(grid.density["stretching"], 3.0, rtol=1e-13)
    np.testing.assert_allclose(grid.along_r("bending"), 6.0, rtol=1e-13)
    np.testing.assert_allclose(grid.along_theta("bending", 90.0), 6.0, rtol=1e-13)
    assert grid.area.sum() == pytest.approx(0.5 * math.pi / 4 * (110.0**2 - 90.0**2), rel=1e-13)
    assert grid.part("bending", np.abs(grid.r - 100.0) < 5.0) == pytest.approx(0.5, rel=1e-12)


def test_every_cell_has_its_place() -> None:
    """A field that grows with r in one case and with theta in another comes out in order."""
    by_r = fields.on_grid(state(lambda r, theta: r), 16, 2)
    np.testing.assert_allclose(by_r.along_r("stretching"), by_r.r, atol=0.3)
    by_theta = fields.on_grid(state(lambda r, theta: theta - theta.min()), 16, 2)
    np.testing.assert_allclose(by_theta.along_theta("stretching", 101.0), by_theta.theta, atol=0.04)


# --------------------------------------------------------------------------------------- failures are told


def test_what_was_not_reached_is_no_value() -> None:
    """The record of a failed path has its outcome, and neither a value nor an error."""
    right = Check(case="c", quantity="q", value=1.0, unit="mm", reference=1.0, source="s", tolerance=0.1)
    assert (right.record()["value"], right.record()["error"], right.record()["passed"]) == (1.0, 0.0, True)
    record = replace(right, outcome="stalled").record()
    assert (record["value"], record["error"], record["passed"]) == (None, None, False)
    assert record["outcome"] == "stalled"


def solved(outcome: Outcome = Outcome.REACHED) -> folding.Solved:
    return replace(folding.solve("a", 8, 1), outcome=outcome)


def test_an_unconverged_mesh_spoils_the_table() -> None:
    """One of three meshes fails, not the finest: no limit, no rate, no value in any record."""
    result = CaseResult("appendix_b_shell", "t", "q", "s")
    meshes = ((8, 1), (16, 2), (32, 4))
    table.record(result, "a", [solved(), solved(Outcome.STALLED), solved()], meshes)
    records = [check.record() for check in result.checks]
    assert len(records) == 5
    for record in records:
        assert record["outcome"] == "stalled"
        assert record["value"] is None
        assert record["error"] is None
        assert not {"rate", "error_bar", "finest"} & set(record["params"])
    assert result.verdict == "differs"


def failing(monkeypatch: pytest.MonkeyPatch, module: Any, actuation: str, formulation: str) -> None:
    """One case of a study ends early; the others are solved on coarse meshes."""
    real = folding.solve
    known: dict[tuple[str, str], folding.Solved] = {}

    def solve(which: str, along: int, rows: int, by: str = "shell", kind: Any = "mirrored") -> folding.Solved:
        if (which, by) not in known:
            known[which, by] = real(which, 8, 1, by)
        failed = (which, by) == (actuation, formulation)
        return replace(known[which, by], outcome=Outcome.LIMIT_POINT) if failed else known[which, by]

    monkeypatch.setattr(module, "solve", solve)


@pytest.mark.parametrize("by", ["consistent", "shell"])
def test_cross_reports_a_failure_without_figures(
    by: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """If the judge fails, no comparison with it stands either."""
    failing(monkeypatch, cross, "b", by)
    result = cross.run(Context(tmp_path, True, lambda text: None))
    for check in result.checks:
        params, record = check.params, check.record()
        lost = params["actuation"] == "b" and (by in ("shell", params["formulation"]))
        assert record["outcome"] == ("limit-point" if lost else "reached")
        assert (record["value"] is None) == lost
    plotted = next(p for p in result.plots if p["id"] == "appendix-b-cross-b")
    labels = {series["label"].split(",")[0] for series in plotted["series"]}
    assert by not in labels
    assert "bars-and-hinges" in labels
    assert result.verdict == "differs"


def test_fields_report_a_failure_without_figures(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    failing(monkeypatch, fields, "d", "shell")
    monkeypatch.setattr(fields, "_pictures", lambda result, context, states: None)
    on_grid = fields.on_grid
    monkeypatch.setattr(fields, "on_grid", lambda at, along, rows: on_grid(at, 8, 1))
    result = fields.run(Context(tmp_path, True, lambda text: None))
    (lost,) = [check for check in result.checks if check.params["actuation"] == "d"]
    assert (lost.record()["value"], lost.outcome) == (None, "limit-point")
    assert all(series["label"] != "(d)" for curve in result.plots for series in curve["series"])


# --------------------------------------------------------------------------------------- the command


def test_the_command_runs_all_parts(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert cases.with_parts(["cone"]) == ["cone"]
    parts = ["appendix_b", "appendix_b_shell", "appendix_b_cross", "appendix_b_fields", "appendix_b_sheets"]
    assert cases.with_parts(["appendix_b_shell", "appendix_b"]) == [parts[1], parts[0], *parts[2:]]
    asked: list[list[str]] = []

    def run(names: list[str], *_: object) -> dict[str, Any]:
        asked.append(names)
        return {"checks": [], "versions": {}}

    monkeypatch.setattr("verification.framework.run.run", run)
    app = typer.Typer()
    app.command()(command.verify)
    done = CliRunner().invoke(app, ["appendix_b", "--quick", "--results", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert asked == [parts]
