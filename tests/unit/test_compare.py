"""`bh compare`, and keys that are set from the command line."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

import bh
from bh.applications.comparison import Stiff, compare, lines, picture
from bh.commands.cli import main
from bh.scene.changes import value_of
from bh.scene.load import load_scene

SCENE = """
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.4
[sheet]
E = 4000.0
nu = 0.38
t = 0.127
[mesh]
along = 12
rows = 2
[[supports]]
at = "edge:start"
fix = "xyz"
[[supports]]
at = "corner:inner-end"
fix = "z"
[[steps]]
fold = { crease = "crease", to = 2.4 }
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    file = tmp_path / "scene.toml"
    file.write_text(SCENE)
    return file


def test_members_are_what_each_formulation_says_alone(scene: Path) -> None:
    model = load_scene(scene).model
    wanted = ("consistent", "linear-shell")
    found = compare(model, formulations=wanted, stiffness=Stiff("corner:outer-end", (0.0, 0.0, 1.0)))
    assert [member.formulation for member in found.members] == list(wanted)
    assert found.reference == "linear-shell"
    alone = [bh.trace(bh.Model(**{**vars(model), "formulation": name}))[-1] for name in wanted]
    for member, state in zip(found.members, alone, strict=True):
        assert member.path is not None
        assert member.path[-1].energy.total == pytest.approx(state.energy.total, rel=1e-9)
        assert member.stiffness > 0.0
    far = found.of("consistent").distance
    assert far is not None
    assert 0.0 < far.largest < 0.5
    assert found.of("linear-shell").distance is None
    told = lines(found)
    assert any("reference" in line and "linear-shell" in line for line in told)
    assert len(picture(found).axes) == 3  # energies, the distance, its colours


def test_stiffness_of_a_sheet_that_nothing_holds_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It yields to any force: 0 was told, and looked like a result."""
    file = tmp_path / "free.toml"
    file.write_text(SCENE[: SCENE.index("[[supports]]")] + SCENE[SCENE.index("[[steps]]") :])
    assert main(["compare", str(file), "--stiffness", "corner:outer-end:z"]) == 2
    assert (
        "nothing holds the sheet, so that it yields to any force at corner:outer-end"
        in capsys.readouterr().err
    )


def test_command_writes_table_json_and_picture(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["compare", str(scene), "--formulation", "consistent", "--formulation", "bars-and-hinges"]
    assert main([*words, "--json", str(tmp_path / "a.json"), "--picture", str(tmp_path / "a.png")]) == 0
    out = capsys.readouterr().out
    assert "largest / mm" in out
    data = json.loads((tmp_path / "a.json").read_text())
    assert data["reference"] == "consistent"
    by_name = {each["formulation"]: each for each in data["formulations"]}
    assert by_name["consistent"]["fold_angle"]["crease"] == pytest.approx(math.pi - 2.4, rel=1e-6)
    assert by_name["bars-and-hinges"]["largest_distance"] > 0.0
    assert by_name["consistent"]["stiffness"] is None
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--formulation", "shel"], "formulation 'shel' is not known"),
        (["--formulation", "shell", "--formulation", "shell"], "each can be compared once"),
        (["--stiffness", "tip"], "no place and axis"),
        (
            ["--stiffness", "edge:end:z", "--stiffness", "edge:end:y"],
            "one place and axis can be compared at a time",
        ),
        (["--set", "mesh.rows"], "sets nothing; write it as --set mesh.rows=4"),
        (["--set", "mesh.rows=none"], "mesh.rows"),
        (["--set", "steps[3].fold.to=2.0"], r"the scene has no 'steps[3].fold.to'"),
        (["--picture", "a.gif"], "is no .png, .svg or .pdf"),
    ],
)
def test_bad_input_is_one_line(
    scene: Path, words: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["compare", str(scene), *words]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1


def test_run_takes_keys_and_a_formulation(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sets = ["--set", "sheet.t=0.2mm", "--set", "steps[0].fold.to=150deg", "--no-estimate", "-q"]
    assert main(["run", str(scene), "-o", str(tmp_path / "out"), "--formulation", "linear-shell", *sets]) == 0
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert result["formulation"] == "linear-shell"
    assert result["fold_angle"]["crease"]["mean"] == pytest.approx(math.radians(30.0), rel=1e-6)
    path = bh.Path.load(tmp_path / "out" / "path.bh")
    assert path.model.sheet.t == 0.2
    free = tmp_path / "free.toml"
    free.write_text(SCENE.replace("[mesh]\nalong = 12\nrows = 2\n", ""))
    assert main(["run", str(free), "-o", str(tmp_path / "no"), "--formulation", "shell"]) == 2
    assert "which chooses the formulation" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2", 2),
        ("0.5", 0.5),
        ("true", True),
        ("[0, 1]", [0, 1]),
        ("shell", "shell"),
        ("60deg", "60deg"),
        ('"a"', "a"),
    ],
)
def test_values_are_toml_or_words(text: str, value: object) -> None:
    assert value_of(text) == value
    assert type(value_of(text)) is type(value)


def test_what_one_cannot_do_is_no_failure_unless_it_was_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Bars and hinges have no slope to clamp."""
    file = tmp_path / "held.toml"
    file.write_text(
        '[pattern]\nkind = "strip"\nlength = 20.0\nwidth = 10.0\ncreases = [5.0]\n[sheet]\nE = 4000.0\nt = 0.2\n'
        '[mesh]\nalong = 2\n[[steps]]\nfold = { crease = "crease", by = "30deg" }\n[[steps]]\nhold = "edge:start"\n'
    )
    assert main(["compare", str(file), "--json", str(tmp_path / "all.json"), "-q"]) == 0
    members = json.loads((tmp_path / "all.json").read_text())["formulations"]
    assert {m["formulation"]: m["outcome"] for m in members}["bars-and-hinges"] == "refused"
    pair = ["--formulation", "consistent", "--formulation", "bars-and-hinges"]
    assert main(["compare", str(file), "-q", *pair]) == 1
    assert "not reached by bars-and-hinges" in capsys.readouterr().err
