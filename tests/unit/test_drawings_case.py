"""Case `drawings`: a table of every drawing; what cannot be folded, hangs or fails has a line there, too."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from meshes.errors import InputError
from verification.framework.checks import CaseResult, Context
from verification.framework.store import Store
from verification.studies.solver import drawings, drawings_folding
from verification.studies.solver import drawings_mutations as mutations
from verification.studies.solver.drawings_folding import Row, fold_apart, fold_here

SHEET = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="60mm" viewBox="0 0 80 60" fill="none">'
    '<rect width="80" height="60" stroke="black"/>{}</svg>'
)


def context(folder: Path, told: list[str] | None = None) -> Context:
    return Context(folder, False, (told if told is not None else []).append)


@pytest.fixture
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two own drawings and one of others, folded without processes."""
    own, others = tmp_path / "own", tmp_path / "others" / "deep"
    own.mkdir()
    others.mkdir(parents=True)
    (own / "four_sheets.svg").touch()
    (own / "fan.svg").touch()
    (own / "README.md").touch()
    (others / "x.FOLD").touch()
    monkeypatch.setattr(drawings, "OWN", own)
    monkeypatch.delenv(drawings.FOLDER, raising=False)
    monkeypatch.setattr(drawings, "_mutated", lambda *_: None)
    rows = {
        "four_sheets.svg": Row("four_sheets.svg", True, (60.0, 40.0), 2, 1.0, 144.0, seconds=3.0),
        "fan.svg": Row("fan.svg", True, (950.0, 370.0), 2, 0.5, 72.0, seconds=59.0, why="stalled"),
        "deep/x.FOLD": Row("deep/x.FOLD", seconds=1.0, why="a frame that is folded"),
    }
    monkeypatch.setattr(drawings, "fold_apart", lambda file, name, folder: rows[name])
    return tmp_path


def test_own_drawings_are_checked(folders: Path) -> None:
    told: list[str] = []
    result = drawings.run(context(folders, told))
    passed = {(c.quantity, c.params.get("drawing")): c.passed for c in result.checks}
    assert passed["longer side of the sheet", "four_sheets.svg"] is True
    assert passed["longer side of the sheet", "fan.svg"] is False  # 952.5 mm
    assert passed["part of the wanted angles that is reached", "four_sheets.svg"] is True
    assert passed["part of the wanted angles that is reached", "fan.svg"] is False
    values = {c.quantity: c.value for c in result.checks if "drawing" not in c.params}
    assert values == {
        "drawings that are read": 2.0,
        "drawings folded within 60 s each": 1.0,
        "median of the processor times": 59.0,
        "longest processor time": 59.0,
    }
    assert told == ["drawings: fan.svg: stalled, 59.0 s", "drawings: four_sheets.svg: 144 degrees, 3.0 s"]


def test_drawings_of_others_are_reported(folders: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(drawings.FOLDER, str(folders / "others"))
    checks = drawings.run(context(folders)).checks
    others = [c for c in checks if c.params.get("of") == drawings.FOLDER]
    assert all(c.passed is None for c in others)
    (row,) = [c.params for c in others if "drawing" in c.params]
    assert (row["drawing"], row["read"], row["why not"]) == ("deep/x.FOLD", False, "a frame that is folded")
    monkeypatch.setenv(drawings.FOLDER, str(folders / "none"))
    with pytest.raises(InputError, match=r"BH_DRAWINGS = .* has no drawings"):
        drawings.run(context(folders))


def test_a_run_that_was_stopped_goes_on(folders: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = [c.record() for c in drawings.run(context(folders)).checks]
    monkeypatch.setattr(drawings, "fold_apart", None)
    assert json.dumps([c.record() for c in drawings.run(context(folders)).checks]) == json.dumps(before)


def test_a_drawing_in_this_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawings_folding, "_end_after", lambda seconds: None)
    file = tmp_path / "a.svg"
    file.write_text(SHEET.format('<path d="M0 30H80" stroke="red"/>'))
    row = fold_here(file, "a.svg", tmp_path / "out")
    assert (row.size, row.creases, row.way, row.why) == ((80.0, 60.0), 1, 1.0, "")
    assert row.angle == pytest.approx(144.0, abs=0.01)
    file.write_text(SHEET.format('<path d="M0 30H80" stroke="var(--ink)"/>'))
    row = fold_here(file, "a.svg", tmp_path / "out")
    assert not row.read
    assert row.why.startswith("a.svg: line 2 (path) has the colour")
    monkeypatch.setattr(drawings_folding, "fold_file", lambda *_, **__: 1 / 0)
    assert (
        fold_here(file, "a.svg", tmp_path).why == "fault of the program: ZeroDivisionError: division by zero"
    )


@pytest.fixture(scope="module")
def seeded(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[str, bytes]]:
    return mutations.seeds(drawings.OWN, tmp_path_factory.mktemp("seeds"))


def test_what_is_mutated_is_read_before(seeded: list[tuple[str, bytes]]) -> None:
    assert {Path(name).suffix for name, _ in seeded} == {".svg", ".dxf", ".fold", ".cp", ".opx"}
    for name, content in seeded:
        row = mutations.read(name, content)
        assert (row.sheet or name in ("four_sheets.svg", "no_outline.svg"), row.fault) == (True, ""), name


def test_a_mutation_is_the_same_wherever_it_is_made(seeded: list[tuple[str, bytes]]) -> None:
    one, two = (mutations.mutant(seeded, 31) for _ in range(2))
    assert one == two
    assert one != mutations.mutant(seeded, 31 + len(seeded))
    assert one[0] == seeded[31 % len(seeded)][0]


def test_mutations_are_sheets_or_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seeded: list[tuple[str, bytes]]
) -> None:
    monkeypatch.setattr(drawings, "MUTATIONS", 40)
    monkeypatch.setattr(drawings, "BLOCK", 20)
    result = CaseResult("drawings", "", "", "")
    told: list[str] = []
    store = Store.open(tmp_path, "runs.json", False)
    drawings._mutated(result, context(tmp_path, told), store)
    values = {check.quantity: (check.value, check.passed) for check in result.checks}
    assert values["mutations that end neither in a sheet nor in one clear line"] == (0.0, True)
    assert values["mutations that keep a reader busy for more than 20 s"] == (0.0, True)
    assert told == ["drawings: 20 mutations from 0: 0 faults", "drawings: 20 mutations from 20: 0 faults"]
    # a fault is found, and a run that was stopped goes on
    monkeypatch.setattr(mutations, "read_pattern", lambda file: [][file])
    monkeypatch.setattr(drawings, "MUTATIONS", 60)
    again = CaseResult("drawings", "", "", "")
    drawings._mutated(again, context(tmp_path, told), store)
    (faults,) = (check for check in again.checks if "clear line" in check.quantity)
    assert (faults.value, faults.passed) == (20.0, False)
    assert "TypeError" in str(faults.params["first"])


@pytest.mark.skipif(os.name != "posix", reason="no limit of processor time")
def test_a_process_ends_at_its_limit(tmp_path: Path) -> None:
    wave = (
        Path(__file__).parents[2] / "examples" / "wave.svg"
    )  # takes some seconds, and the system counts whole ones
    row = fold_apart(wave, "a.svg", tmp_path, limit=0.5)
    assert row == Row("a.svg", seconds=0.5, why="ended at 0.5 s of processor time")
