"""`bh bend`: the bending test of a corrugation as a command."""

from __future__ import annotations

import json
import math
from functools import partial
from pathlib import Path

import pytest

from bh.applications.corrugation import Rig, fold, report, three_point
from bh.applications.corrugation.report import folded_by
from bh.commands.cli import main
from bh.scene.load import load_scene

SCENE = """
[pattern]
kind = "straight"
[sheet]
E = 4000.0
nu = 0.38
t = 0.381
[mesh]
along = 12
rows = 1
[[steps]]
fold = { crease = "all", by = "149deg", Lstar = 25.0 }
until = { depth = 6.0 }
"""


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "straight.toml"
    file.write_text(SCENE)
    return file


def test_the_command_is_the_test_of_the_library(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["bend", str(scene), "--travel", "2mm", "--json", "b.json", "--picture", "b.svg"]
    assert main(words) == 0
    table = capsys.readouterr().out.splitlines()
    about_x, about_y = json.loads(Path("b.json").read_text())["tests"]
    test = three_point(folded_by(load_scene(scene).model), math.pi / 2, Rig(travel=2.0))
    assert about_y["stiffness"] == pytest.approx(test.stiffness, rel=1e-9)
    assert about_y["stiffness"] == pytest.approx(1.51, abs=0.05)
    assert f"{test.stiffness:.4g}" in table[2]
    # about x it is so soft that the bar does not come to a stage: no number is made up
    assert about_x["stiffness"] is None
    assert "press further" in table[3]
    assert b"<svg" in Path("b.svg").read_bytes()


def test_names_are_folded_to_a_depth(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(report, "fold", partial(fold, along=12, rows=1))  # the default has 36 x 2 cells
    (test,) = report.tests("straight", 6.0, [math.pi / 2], Rig(travel=1.0))
    assert test.path.model.sheet.t == 0.381
    assert 1.0 < test.stiffness < 3.0
    assert report.lines([test])[1].split()[0] == "90"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["straight", "--set", "sheet.t=1"], "--set is for scenes; write straight into a scene"),
        (["nothing"], "'nothing' is no scene file and none of straight, "),
        (["none.toml"], "there is no scene file 'none.toml'"),
        (["straight.toml", "--depth", "6mm"], "--depth is for names; a scene says it itself"),
        (["straight.toml", "--span", "5mm"], "a bar of 10 mm does not fit between supports 5 mm apart"),
        (["straight.toml", "--span", "300mm"], "does not reach both supports 300 mm apart"),
        (["straight.toml", "--azimuth", "3mm"], '"3mm" is no angle'),
        (["straight.toml", "--travel=-1mm"], "travel = -1.0 of a bending test cannot be"),
        (["straight.toml", "--tape=-1"], "tape = -1.0 cannot be"),
        (["straight.toml", "--picture", "b.gif"], "picture 'b.gif' is no .png, .svg or .pdf file"),
        (["straight.toml", "--set", "pattern.fold=mountain"], "this sheet has no valley"),
        (
            ["straight.toml", "--azimuth", "90"],
            '--azimuth 90 is more than a turn; angles are radians, not degrees: write "90deg"',
        ),
        (["straight.toml", "--set", "accuracy=0.05"], "bars press on one mesh; give it a [mesh]"),
        (["straight.toml", "--set", "accuracy=0.05"], "and no accuracy"),
        (
            ["straight.toml", "--set", "steps[0].until.depth=30"],
            "fold less than to where the sheet is as deep as wide",
        ),
    ],
)
def test_what_cannot_be_is_one_line(
    words: list[str], told: str, scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bend", *words]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1
