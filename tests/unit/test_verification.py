"""The cases that judge the solvers: they run, their records have the agreed form, and their verdicts can be bad."""

from __future__ import annotations

import json
import math
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import verification.framework.cases as registry
from meshes import InputError
from verification.framework import command, environment
from verification.framework import run as runner
from verification.framework.cases import ALL_CASES, CASES, LONG_CASES, case
from verification.framework.checks import CaseResult, Check, Context, line, plot
from verification.framework.records import Record
from verification.framework.run import run, write_json
from verification.framework.source_claims import unclaimed, unheard
from verification.studies.solver import campaign

# the keys of a stored record
KEYS = {
    "case",
    "quantity",
    "params",
    "value",
    "unit",
    "reference",
    "source",
    "error",
    "tolerance",
    "passed",
    "unknowns",
    "iterations",
    "wall_time_s",
    "outcome",
}
UNLIKE = {  # verdicts of cases that do not hold whole, or that only measure
    "bending_fit": "reported",
    "page_figures": "reported",
}
SLOW = {
    "appendix_b",
    "attack",  # half a minute to four; its parts have tests of their own, as those of the next three
    "defaults",
    "drawings",
    "landing",
    "tolerances",
    "designs",
    "bend_twist",
    "cones",
    "agreement",
    "bending_fit",
    "bifurcations",
    "map",
    "published",
    "fig3_9",
    "fig3_8",
    "fig3_10",
    "fig5_3",
    "gradients",
    "hard_cases",
    "scan",
    "fig5_5",
    "fig5_9",
    "fig5_10",
    "fig5_11",
    "pinch_shell",
    "three_point",
    "corrugation_stiffness",
    "appendix_b_shell",  # test_shell_convergence.py has the same figures
    "shell_benchmarks",  # the same
    "appendix_b_cross",
    "branches",
    "contact",
    "consistent",
    "convergence",
    "appendix_b_fields",
    "fig3_11",
    "forward",
    "honesty",
    "page_figures",
    "problem_c",
    "sheets_3",
    "speed_error",
    "top_down",
}  # over some five seconds on a slow machine; `bh verify` runs them all


def check(**changes: Any) -> Check:
    given: dict[str, Any] = {
        "case": "c",
        "quantity": "q",
        "params": {"alpha": 2.0},
        "value": 1.05,
        "unit": "mm",
        "reference": 1.0,
        "source": "s",
        "tolerance": 0.1,
    } | changes
    return Check(**given)


def no_constants(text: str) -> Any:
    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is not JSON")

    return json.loads(text, parse_constant=refuse)


# --------------------------------------------------------------------------------------- records and verdicts


@pytest.mark.parametrize(
    ("changes", "error", "passed"),
    [
        ({}, 0.05, True),
        ({"value": 1.2}, 0.2, False),
        ({"value": 0.8}, 0.2, False),  # too small is as wrong as too large
        ({"value": 1.125, "tolerance": 0.125}, 0.125, True),  # the bound belongs to it
        ({"reference": -1.0, "value": -1.05}, 0.05, True),
        ({"reference": -1.0, "value": 1.0}, 2.0, False),
        ({"reference": 0.0, "value": -0.05}, 0.05, True),  # absolute where the reference is zero
        ({"reference": 0.0, "value": 0.2}, 0.2, False),
        ({"reference": 1e-9, "value": 2e-9}, 1.0, False),  # small is not zero
        ({"tolerance": None}, 0.05, None),
        ({"reference": None}, None, None),
        ({"outcome": "stalled"}, 0.05, False),  # a right number from a path that failed is not right
        ({"outcome": "stalled", "tolerance": None}, 0.05, False),
        ({"tolerance": 0.0, "value": 1.0}, 0.0, True),
    ],
)
def test_error_and_passed(changes: dict[str, Any], error: float | None, passed: bool | None) -> None:
    made = check(**changes)
    assert made.error == (None if error is None else pytest.approx(error))
    assert made.passed is passed


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_does_not_pass(value: float, tmp_path: Path) -> None:
    made = check(value=value)
    assert made.passed is False
    write_json(tmp_path / "record.json", made.record())
    record = no_constants((tmp_path / "record.json").read_text())
    assert record["value"] is None
    assert record["error"] is None
    assert record["passed"] is False


def test_record_has_exactly_the_agreed_keys() -> None:
    record = check(unknowns=7, iterations=3, wall_time_s=0.5).record()
    assert set(record) == KEYS
    assert record["params"] == {"alpha": 2.0}
    assert record["passed"] is True
    assert set(check(reference=None, tolerance=None).record()) == KEYS


@pytest.mark.parametrize(
    ("checks", "verdict"),
    [
        ([], "reported"),
        ([{}], "holds"),
        ([{"tolerance": None}], "reported"),
        ([{}, {"tolerance": None}], "holds"),
        ([{}, {"value": 9.0}], "differs"),
        ([{"tolerance": None, "outcome": "bifurcation"}], "differs"),
        ([{}, {"value": math.nan}], "differs"),
    ],
)
def test_verdict(checks: list[dict[str, Any]], verdict: str) -> None:
    result = CaseResult("c", "t", "q", "s", checks=[check(**changes) for changes in checks])
    assert result.verdict == verdict
    assert result.summary()["verdict"] == verdict


def test_plots_with_gaps_can_be_stored(tmp_path: Path) -> None:
    """A curve with a value that could not be computed: null in the file, not NaN."""
    curve = plot("id", "t", "x", "y", [line("a", [1.0, 2.0], [math.nan, 3.0])], "caption", log="x")
    write_json(tmp_path / "plot.json", {"plots": [curve]})
    data = no_constants((tmp_path / "plot.json").read_text())["plots"][0]
    assert data["series"][0]["y"] == [None, 3.0]
    assert data["x"] == {"label": "x", "log": True}
    assert data["y"]["log"] is False


def test_json_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    file = tmp_path / "data.json"
    write_json(file, {"a": 1})
    with pytest.raises(TypeError):
        write_json(file, {"a": object()})
    assert json.loads(file.read_text()) == {"a": 1}
    with pytest.raises(InputError, match="nowhere") as caught:
        write_json(tmp_path / "nowhere" / "data.json", {})
    assert "\n" not in str(caught.value)


# --------------------------------------------------------------------------------------- cases


def test_unknown_case() -> None:
    with pytest.raises(InputError, match="'tori'") as caught:
        case("tori")
    for name in ALL_CASES:
        assert name in str(caught.value)
    assert "\n" not in str(caught.value)


def test_unknown_case_runs_nothing(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        run(["derivatives", "tori"], tmp_path / "results")
    assert not (tmp_path / "results").exists()


def test_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="file") as caught:
        run(["shear_calibration"], tmp_path / "file" / "results")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name
        for name in ALL_CASES
        if name != "campaign"  # its parts have tests of their own
    ],
)
def test_case_in_quick_mode(name: str, tmp_path: Path) -> None:
    """Runs, holds, and stores records that a JSON reader gets back as they were."""
    told: list[str] = []
    data = run([name], tmp_path, quick=True, report=told.append)
    assert any(name in text for text in told)
    stored = no_constants((tmp_path / "checks.json").read_text())
    assert set(stored) == {"checks", "versions", "date", "machine", "quick", "cases"}
    assert stored["quick"] is True
    assert len(stored["checks"]) == len(data["checks"]) > 5
    for record in stored["checks"]:
        assert set(record) == KEYS
        assert record["case"] == name
        assert record["quantity"]
        assert record["source"]
        # what was not reached has an outcome and no value
        assert record["value"] is not None or record["outcome"] not in (None, "reached")
        assert (record["error"] is None) == (record["reference"] is None)
        assert record["passed"] is not False or name in UNLIKE, record
    records = [Record(**record) for record in stored["checks"]]
    assert (
        unclaimed(records) == []
    )  # verification/claims.toml has a claim for each quantity that the source prints
    assert unheard(records) == []
    (summary,) = stored["cases"]
    assert summary["name"] == name
    assert summary["verdict"] == UNLIKE.get(name, "holds")
    assert summary["wall_time_s"] > 0.0
    for picture in summary["pictures"]:
        assert (tmp_path / picture["file"]).stat().st_size > 1000
        assert picture["alt"]
    for curve in summary["plots"]:
        for series in curve["series"]:
            assert len(series["x"]) == len(series["y"]) > 0
    assert {"python", "numpy", "curved-crease-workbench"} <= set(stored["versions"])


def test_records_of_the_strips(tmp_path: Path) -> None:
    """The quantities and parameters that a report of Chapter 3 needs."""
    records = run(["strips"], tmp_path, quick=True)["checks"]
    assert {r["quantity"] for r in records} == {
        "tension",
        "torsion",
        "bending_out_of_plane",
        "bending_in_plane",
    }
    assert all({"mesh", "alpha", "formulation"} <= set(r["params"]) for r in records)
    assert {r["params"]["mesh"] for r in records} == {"staggered", "alternating", "one-way", "mirrored"}
    by = {(r["quantity"], r["params"]["mesh"], r["params"]["alpha"]): r["value"] for r in records}
    assert by["tension", "alternating", 8.0] == pytest.approx(1.0, abs=1e-6)
    assert by["torsion", "alternating", 1.0] == pytest.approx(4.0, rel=0.02)
    assert 0.0 < by["bending_out_of_plane", "alternating", 4.0] - 1.0 < 0.1
    assert by["bending_in_plane", "alternating", 8.0] == pytest.approx(3.0, rel=0.1)


def test_a_run_keeps_what_others_found(tmp_path: Path) -> None:
    first = run(["shear_calibration", "derivatives"], tmp_path, quick=True)
    file = tmp_path / "checks.json"
    old = no_constants(file.read_text())
    old["date"] = old["cases"][0]["date"] = old["cases"][1]["date"] = "2020-01-01T00:00:00+00:00"
    write_json(file, old)
    again = run(["shear_calibration"], tmp_path)
    assert {record["case"] for record in again["checks"]} == {
        "shear_calibration"
    }  # what is returned is of this run
    stored = no_constants(file.read_text())
    assert [info["name"] for info in stored["cases"]] == ["shear_calibration", "derivatives"]
    fresh, kept = stored["cases"]
    assert (fresh["date"], fresh["quick"]) == (stored["date"], False)
    assert (kept["date"], kept["quick"]) == ("2020-01-01T00:00:00+00:00", True)
    assert kept["versions"] == first["versions"]
    assert stored["quick"] is True  # of one of them
    of_case = {
        name: [r for r in stored["checks"] if r["case"] == name]
        for name in ("derivatives", "shear_calibration")
    }
    assert of_case["derivatives"] == [r for r in old["checks"] if r["case"] == "derivatives"]
    assert len(of_case["shear_calibration"]) == len(again["checks"])


def test_the_longest_cases_begin_first() -> None:
    assert registry.longest_first(["strips", "published", "cone", "scan"]) == [
        "published",
        "scan",
        "cone",
        "strips",
    ]


def test_cases_of_over_a_minute_are_long_and_have_a_record_of_a_whole_run() -> None:
    """What a report does not run it shows from a record, whole, not quick."""
    assert {s.name for s in registry.STUDIES if s.seconds > registry.LONGEST and not s.long} == set()
    # others of these tests have a folder of their own
    records = Path(registry.__file__).parents[1] / "records"
    assert {name for name in LONG_CASES if not (records / f"{name}.json").is_file()} <= {"drawings"}
    for file in (records / f"{name}.json" for name in LONG_CASES if name != "drawings"):
        name = file.stem
        record = json.loads(file.read_text(encoding="utf-8"))
        (info,) = record["cases"]
        assert (info["name"], info["quick"]) == (name, False)
        assert {check["case"] for check in record["checks"]} == {name}


def test_records_name_no_pictures() -> None:
    """They are shipped without any, so that a report has nothing to miss."""
    for file in (Path(registry.__file__).parents[1] / "records").glob("*.json"):
        for of in json.loads(file.read_text())["cases"]:
            assert of["pictures"] == of["scenes"] == [], file.name


def test_cases_at_a_time_find_the_same(tmp_path: Path) -> None:
    """By two processes: the same values in the same order, and what fails there is told here."""
    names = ["shear_calibration", "derivatives", "strips"]
    one = run(names, tmp_path / "one", quick=True)
    told: list[str] = []
    two = run(names, tmp_path / "two", quick=True, report=told.append, jobs=2)
    keys = ("case", "quantity", "params", "value", "passed")
    assert [[r[key] for key in keys] for r in two["checks"]] == [
        [r[key] for key in keys] for r in one["checks"]
    ]
    assert two["machine"]["cases at a time"] == 2
    assert told[0].startswith("3 cases, 2 at a time")
    assert sorted(text.split(":")[0] for text in told[1:]) == sorted(names)
    with pytest.raises(InputError, match="no verification case 'nonsense'"):
        run([*names, "nonsense"], tmp_path / "three", jobs=2)


def test_what_is_left_of_a_file_of_one_run(tmp_path: Path) -> None:
    """A file of a version that kept no date with the cases: they get that of the file."""
    run(["shear_calibration"], tmp_path, quick=True)
    file = tmp_path / "checks.json"
    old = no_constants(file.read_text())
    for key in ("versions", "date", "machine", "quick"):
        del old["cases"][0][key]
    write_json(file, old)
    run(["derivatives"], tmp_path, quick=True)
    kept = no_constants(file.read_text())["cases"][0]
    assert (kept["name"], kept["date"], kept["quick"]) == ("shear_calibration", old["date"], True)


@pytest.mark.parametrize(
    "content",
    [
        "{",
        "[]",
        "null",
        "{}",
        '{"checks": 3, "cases": [], "versions": {}, "date": "", "machine": {}, "quick": true}',
        '{"checks": [{"case": "cone"}], "cases": [], "versions": {}, "date": "", "machine": {}, "quick": true}',
        '{"checks": [], "cases": [{"name": "cone"}], "versions": {}, "date": "", "machine": {}, "quick": true}',
        '{"checks": [], "cases": [7], "versions": {}, "date": "", "machine": {}, "quick": true}',
    ],
)
def test_a_broken_record_is_begun_anew(tmp_path: Path, content: str) -> None:
    (tmp_path / "checks.json").write_text(content)
    data = run(["shear_calibration"], tmp_path, quick=True)
    assert no_constants((tmp_path / "checks.json").read_text()) == json.loads(json.dumps(data))


@pytest.fixture(autouse=True)
def no_records(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only what a test runs; the kept runs of long cases have tests of their own."""
    monkeypatch.setattr(runner, "RECORDS", tmp_path_factory.mktemp("records"))


def test_environment_and_commit(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert {"python", "pyvista", "matplotlib"} <= set(environment.environment())
    monkeypatch.setattr(environment, "PROJECT", tmp_path)  # no repository
    assert "git commit" not in environment.environment()
    (tmp_path / ".git").write_text("no repository either")
    assert "git commit" not in environment.environment()
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert "git commit" not in environment.environment()


def test_a_run_keeps_the_other_cases(tmp_path: Path) -> None:
    """Cases may be run one by one: the file gathers them, and each of them once."""
    first = run(["shear_calibration"], tmp_path)
    for _ in range(2):
        second = run(["derivatives"], tmp_path, quick=True)
        assert {record["case"] for record in second["checks"]} == {"derivatives"}
        stored = no_constants((tmp_path / "checks.json").read_text())
        assert [info["name"] for info in stored["cases"]] == ["shear_calibration", "derivatives"]
        assert len(stored["checks"]) == len(first["checks"]) + len(second["checks"])
        assert [info["quick"] for info in stored["cases"]] == [False, True]


@pytest.mark.parametrize("broken", ["", "{", "[]", '{"checks": 3}', '{"checks": [{}], "cases": [{}]}'])
def test_a_broken_file_is_replaced(broken: str, tmp_path: Path) -> None:
    (tmp_path / "checks.json").write_text(broken)
    data = run(["shear_calibration"], tmp_path)
    stored = no_constants((tmp_path / "checks.json").read_text())
    assert len(stored["checks"]) == len(data["checks"])


# --------------------------------------------------------------------------------------- a case that fails


def disagreeing(context: Context) -> CaseResult:
    context.tell("disagreeing: thinking")
    return CaseResult("bad", "t", "q", "s", checks=[check(case="bad"), check(case="bad", value=math.nan)])


@pytest.fixture
def bad_case(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys
    import types

    module = types.ModuleType("verification.studies.solver.bad_for_tests")
    module.run = disagreeing  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setitem(registry.BY_NAME, "bad", registry.Study("bad_for_tests", "solver"))


@pytest.mark.usefixtures("bad_case")
def test_failures_are_told(tmp_path: Path) -> None:
    told: list[str] = []
    data = run(["bad"], tmp_path, report=told.append)
    assert data["cases"][0]["verdict"] == "differs"
    assert any("differs" in text and "1 of 2" in text for text in told)


@pytest.mark.usefixtures("bad_case")
def test_command_exits_with_one(tmp_path: Path) -> None:
    import typer

    app = typer.Typer()
    app.command()(command.verify)
    arguments = ["bad", "--results", str(tmp_path), "--json", str(tmp_path / "out.json")]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 1
    assert "failed" in done.output
    assert "1 of 2" in done.output
    stored = no_constants((tmp_path / "out.json").read_text())
    assert set(stored) == {"checks", "versions"}
    assert [record["passed"] for record in stored["checks"]] == [True, False]


def test_command_that_holds(tmp_path: Path) -> None:
    import typer

    app = typer.Typer()
    app.command()(command.verify)
    done = CliRunner().invoke(app, ["shear_calibration", "--results", str(tmp_path), "--quick"])
    assert done.exit_code == 0, done.output
    listed = [line.split(":")[0] for line in CliRunner().invoke(app, ["--list"]).output.splitlines()]
    assert listed == [*CASES, *LONG_CASES]


# --------------------------------------------------------------------------------------- judges that can see


def test_derivatives_case_sees_a_wrong_hessian(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A Hessian that is wrong by 1e-6 of itself, and only where the hinge is flat or closed, is found."""
    from bh.mechanics.shared import kinematics

    right = kinematics.dihedral_hessians
    monkeypatch.setattr(kinematics, "dihedral_hessians", lambda x, hinges: (1.0 + 1e-6) * right(x, hinges))
    data = run(["derivatives"], tmp_path, quick=True)
    failed = {r["quantity"] for r in data["checks"] if r["passed"] is False}
    assert failed == {"dihedral Hessian, relative error"}
    assert data["cases"][0]["verdict"] == "differs"


def test_cone_case_sees_a_wrong_stiffness(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Bending hinges 10 % too stiff."""
    from bh.mechanics.bars_and_hinges import elements, stiffness

    right = stiffness.bending_hinge_stiffness
    monkeypatch.setattr(elements, "bending_hinge_stiffness", lambda *args: 1.1 * right(*args))
    data = run(["cone"], tmp_path, quick=True)
    assert data["cases"][0]["verdict"] == "differs"
    wrong = [r for r in data["checks"] if r["quantity"] == "energy ratio" and r["passed"] is False]
    assert wrong
    right_radius = [r["passed"] for r in data["checks"] if r["quantity"] == "crease radius"]
    assert False not in right_radius  # the shape does not depend on it


def test_strips_case_sees_a_wrong_stiffness(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Diagonals by Eq. 3.3 without the factor of Eq. 3.4 are as good in tension; hinges of half the area are not."""
    from bh.mechanics.bars_and_hinges import elements, stiffness

    right = stiffness.bending_hinge_stiffness
    monkeypatch.setattr(elements, "bending_hinge_stiffness", lambda E, t, L, A: right(E, t, L, 0.5 * A))
    data = run(["strips"], tmp_path, quick=True)
    failed = {r["quantity"] for r in data["checks"] if r["passed"] is False}
    assert failed == {"torsion", "bending_out_of_plane"}


# --------------------------------------------------------------------------------------- long cases


TITLE = "1 random scenes by both formulations"


@pytest.fixture
def played_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scenes of the campaign are reached at once, in this process: how they are played has tests of its own."""
    monkeypatch.setattr(campaign, "Workers", lambda _: ThreadPoolExecutor(1))
    monkeypatch.setattr(
        campaign, "play", lambda scene: campaign.Result(scene, "reached", "", 0.0, 7, 99, 0.1)
    )


@pytest.mark.usefixtures("played_at_once")
def test_campaign_goes_on_where_it_was_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Results that are stored are not played again; a half-written line and those of other versions are."""
    monkeypatch.setattr(campaign, "environment", lambda: {"python": "x"})
    few = campaign.scenes(3)
    store = tmp_path / "campaign.jsonl"
    told: list[str] = []
    whole = campaign.play_all(few, store, told.append)
    assert [r.outcome for r in whole] == ["reached"] * 6
    assert [scene.formulation for scene in few] == ["bars-and-hinges"] * 3 + ["consistent"] * 3
    assert told == []
    lines = store.read_text().splitlines()
    assert len(lines) == 7
    marked = json.dumps({**json.loads(lines[1]), "iterations": 12345})
    store.write_text("\n".join([lines[0], marked, lines[2][:20]]))
    again = campaign.play_all(few, store, told.append)
    assert sorted(r.iterations for r in again)[-1] == 12345
    assert sorted(r.outcome for r in again) == ["reached"] * 6
    assert "1 of 6 scenes are known" in told[0]
    monkeypatch.setattr(campaign, "environment", lambda: {"python": "y"})
    anew = campaign.play_all(few, store, told.append)
    assert [r.iterations for r in anew] == [r.iterations for r in whole]


@pytest.mark.usefixtures("played_at_once")
def test_long_cases_come_from_the_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run without them shows the kept run, with its own date; a run of them replaces it."""
    monkeypatch.setattr(campaign, "QUICK_SCENES", 1)
    run(["campaign"], tmp_path / "long", quick=True)
    (tmp_path / "records").mkdir()
    kept = tmp_path / "records" / "campaign.json"
    kept.write_text((tmp_path / "long" / "checks.json").read_text().replace(f'"{TITLE}"', '"kept"'))
    monkeypatch.setattr(runner, "RECORDS", tmp_path / "records")
    data = run(["shear_calibration"], tmp_path / "short")
    assert [info["name"] for info in data["cases"]] == ["shear_calibration"]
    stored = json.loads((tmp_path / "short" / "checks.json").read_text())
    titles = {info["name"]: info["title"] for info in stored["cases"]}
    assert titles["campaign"] == "kept"
    run(["campaign"], tmp_path / "short", quick=True)
    stored = json.loads((tmp_path / "short" / "checks.json").read_text())
    assert [i["title"] for i in stored["cases"] if i["name"] == "campaign"] == [TITLE]
