"""Case `drawings`: a table of every drawing; what cannot be folded, hangs or fails has a line there, too."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from meshes.errors import InputError
from verification.framework.checks import Context
from verification.studies.solver import drawings, drawings_folding
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


@pytest.mark.skipif(os.name != "posix", reason="no limit of processor time")
def test_a_process_ends_at_its_limit(tmp_path: Path) -> None:
    row = fold_apart(tmp_path / "a.svg", "a.svg", tmp_path, limit=0.5)  # less than the start of Python takes
    assert row == Row("a.svg", seconds=0.5, why="ended at 0.5 s of processor time")
