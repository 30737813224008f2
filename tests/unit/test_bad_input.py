"""Input that cannot be: one line that names the thing and the mend, exit code 2, nothing half-written."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from bh.commands.cli import main
from bh.errors import InputError
from bh.scene.load import load_scene, parse_scene

BASE = {
    "pattern": '[pattern]\nkind = "annulus_sector"\nradius = 100.0\nwidth = 10.0\nangle = 0.5\n',
    "sheet": "[sheet]\nE = 4000.0\nnu = 0.3\nt = 0.1\n",
    "mesh": "[mesh]\nalong = 4\n",
    "supports": "",
    "creases": "",
    "steps": '[[steps]]\nfold = { crease = "crease", to = 2.5 }\n',
}
STRIP = '[pattern]\nkind = "strip"\nlength = 50.0\nwidth = 20.0\n'
FREE = '[[supports]]\nat = "corner:inner-start"\n'
HELD = '[[supports]]\nat = "edge:inner"\n'


def text_of(**sections: Any) -> Any:
    return "\n".join({**BASE, **sections}.values())


def step(how: Any) -> Any:
    return f"[[steps]]\n{how}\n"


def refused(text: Any, folder: Any = ".") -> Any:
    with pytest.raises(InputError) as caught:
        parse_scene(text, folder)
    message = str(caught.value)
    assert message.startswith("scene: ")
    assert "\n" not in message
    assert message.isprintable()
    assert len(message) < 700
    return message


CASES = [
    # --- keys
    ("unknown table", {"sheet": BASE["sheet"] + "[outptus]\n"}, ["unknown key outptus", "'outputs'"]),
    ("unknown top key", {"pattern": "title = 1\n" + BASE["pattern"]}, ["unknown key title = 1", "pattern, sheet"]),
    ("unknown pattern key", {"pattern": BASE["pattern"] + "raduis = 3\n"}, ["pattern.raduis = 3", "'radius'"]),
    ("unknown sheet key", {"sheet": BASE["sheet"] + "T = 0.1\n"}, ["sheet.T", "did you mean 't'", "E, nu, t"]),
    ("unknown mesh key", {"mesh": BASE["mesh"] + "row = 2\n"}, ["mesh.row", "'rows'"]),
    ("unknown model key", {"creases": '[model]\nformulaton = "shell"\n'}, ["model.formulaton", "'formulation'"]),
    ("unknown output", {"creases": "[outputs]\npicture = true\n"}, ["outputs.picture", "'pictures'"]),
    ("unknown support key", {"supports": HELD + 'fixed = "x"\n'}, ["supports[0].fixed", "'fix'"]),
    ("unknown crease key", {"creases": "[creases.crease]\nlstar = 25\n"}, ["creases.crease.lstar", "'Lstar'"]),
    ("unknown actuation", {"steps": step("folds = {}")}, ["steps[0].folds", "'fold'"]),
    ("unknown fold key", {"steps": BASE["steps"] + step("fold = { crease = 'crease', angle = 1 }")},
     ["steps[1].fold.angle = 1", "crease, to, by"]),
    ("pinch without a crease", {"steps": step("pinch = { by = 0.1 }")}, ["steps[0].pinch.crease is missing"]),
    # --- tables and types
    ("no pattern", {"pattern": ""}, ["pattern is missing", "[pattern]"]),
    ("no sheet", {"sheet": ""}, ["sheet is missing"]),
    ("no steps", {"steps": ""}, ["steps is missing", "[[steps]]"]),
    ("no mesh", {"mesh": '[model]\nformulation = "bars-and-hinges"\n'}, ["no estimate", "table [mesh]"]),
    ("single steps", {"steps": '[steps]\nfold = { crease = "crease", to = 2.5 }\n'}, ["[[steps]]", "double"]),
    ("empty step", {"steps": "[[steps]]\n"}, ["steps[0] is empty", "fold"]),
    ("empty steps", {"pattern": "steps = []\n" + BASE["pattern"], "steps": ""}, ["steps is empty"]),
    ("empty list", {"steps": step("fold = []")}, ["steps[0].fold is an empty list"]),
    ("no table", {"pattern": "sheet = 3\n" + BASE["pattern"], "sheet": ""}, ["sheet = 3 is not a table", "[sheet]"]),
    ("no list", {"pattern": "supports = 3\n" + BASE["pattern"]}, ["supports = 3", "[[supports]]"]),
    ("bool for a number", {"sheet": "[sheet]\nE = true\nt = 0.1\n"}, ["sheet.E = true", "MPa"]),
    ("text for a number", {"sheet": '[sheet]\nE = "4000"\nt = 0.1\n'}, ['sheet.E = "4000"', "MPa"]),
    ("nan", {"sheet": "[sheet]\nE = nan\nt = 0.1\n"}, ["sheet.E = nan"]),
    ("infinite", {"pattern": BASE["pattern"].replace("100.0", "inf")}, ["pattern.radius = inf", "mm"]),
    ("huge integer", {"sheet": f"[sheet]\nE = 1{'0' * 400}\nt = 0.1\n"}, ["sheet.E", "many digits"]),
    ("fraction for a count", {"mesh": "[mesh]\nalong = 4.5\n"}, ["mesh.along = 4.5", "whole number"]),
    ("date", {"sheet": "[sheet]\nE = 1979-05-27\nt = 0.1\n"}, ["sheet.E = 1979-05-27"]),
    ("missing value", {"sheet": "[sheet]\nE = 4000.0\n"}, ["sheet.t is missing", "mm"]),
    ("missing crease", {"steps": step("fold = { to = 1.5 }")}, ["steps[0].fold.crease is missing"]),
    # --- pattern
    ("pattern kind", {"pattern": '[pattern]\nkind = "annulus-sector"\n'}, ["pattern.kind", "annulus_sector", "strip"]),
    ("no pattern kind", {"pattern": "[pattern]\nradius = 3\n"}, ["pattern.kind is missing", "file"]),
    ("negative radius", {"pattern": BASE["pattern"].replace("100.0", "-100.0")}, ["pattern.radius = -100.0"]),
    ("wide panel", {"pattern": BASE["pattern"].replace("10.0\n", "120.0\n", 2).replace("1120.0", "100.0")},
     ["pattern", "width 120 mm", "radius 100"]),
    ("falling radii", {"pattern": BASE["pattern"].replace("100.0", "[110.0, 100.0]")}, ["pattern", "do not rise"]),
    ("whole turn", {"pattern": BASE["pattern"].replace("0.5", "6.2832")}, ["pattern.angle", "full_annulus"]),
    ("angle in degrees", {"pattern": BASE["pattern"].replace("0.5", "45")}, ["pattern.angle = 45", "not degrees"]),
    ("crease off the sheet", {"pattern": STRIP + "creases = [25.0]\n"}, ["pattern", "[25.0] leave the sheet"]),
    ("two creases in one place", {"pattern": STRIP + "creases = [5.0, 5.0]\n"}, ["pattern", "[5.0, 5.0]"]),
    ("fold word", {"pattern": BASE["pattern"] + 'fold = "up"\n'}, ['pattern.fold = "up"', "mountain"]),
    ("folds too many", {"pattern": BASE["pattern"] + 'fold = ["mountain", "valley"]\n'}, ["pattern", "2 folds for 1"]),
    # --- sheet
    ("negative thickness", {"sheet": "[sheet]\nE = 4000.0\nt = -0.1\n"}, ["sheet.t = -0.1", "positive", "mm"]),
    ("no thickness at all", {"sheet": "[sheet]\nE = 4000.0\nt = 0\n"}, ["sheet.t = 0"]),
    ("negative modulus", {"sheet": "[sheet]\nE = -1.0\nt = 0.1\n"}, ["sheet.E = -1.0", "MPa"]),
    ("nu too large", {"sheet": BASE["sheet"].replace("0.3", "0.51")}, ["sheet.nu = 0.51", "(-1, 0.5]"]),
    ("nu too small", {"sheet": BASE["sheet"].replace("0.3", "-1")}, ["sheet.nu = -1", "(-1, 0.5]"]),
    # --- mesh, model
    ("mesh kind", {"mesh": '[mesh]\nkind = "stagered"\nalong = 4\n'}, ['mesh.kind = "stagered"', "staggered"]),
    ("gmsh without size", {"mesh": '[mesh]\nkind = "gmsh"\n'}, ["mesh.size", "missing"]),
    ("gmsh with cells", {"mesh": '[mesh]\nkind = "gmsh"\nsize = 2.5\nalong = 4\n'}, ["mesh.along"]),
    ("gmsh, no size", {"mesh": '[mesh]\nkind = "gmsh"\nsize = 0\n'}, ["mesh.size = 0"]),
    ("gmsh, huge mesh", {"mesh": '[mesh]\nkind = "gmsh"\nsize = 1e-4\n'}, ["mesh", "triangles", "fewer"]),
    ("gmsh size", {"mesh": "[mesh]\nsize = 2.5\n"}, ["mesh.size = 2.5", "along"]),
    ("two densities", {"mesh": "[mesh]\nalong = 4\naspect_ratio = 8\n"}, ["mesh", "either along", "both"]),
    ("no density", {"mesh": "[mesh]\nrows = 1\n"}, ["mesh", "either along", "neither"]),
    ("no rows", {"mesh": "[mesh]\nalong = 4\nrows = 0\n"}, ["mesh.rows = 0"]),
    ("negative density", {"mesh": "[mesh]\naspect_ratio = -3\n"}, ["mesh.aspect_ratio = -3"]),
    ("huge mesh", {"mesh": "[mesh]\nalong = 1000000\nrows = 100\n"}, ["mesh", "triangles", "fewer"]),
    ("crossing chords", {"pattern": '[pattern]\nkind = "full_annulus"\nradius = 100\nwidth = 10\n'},
     ["mesh", "chords", "more than 4"]),
    ("few cells round", {"pattern": '[pattern]\nkind = "full_annulus"\nradius = 9\nwidth = 1\n',
                         "mesh": "[mesh]\nalong = 2\n"}, ["mesh", "along = 2", "from 3"]),
    ("formulation", {"creases": '[model]\nformulation = "bars"\n'}, ["model.formulation", "bars-and-hinges"]),
    # --- supports
    ("free motions", {"supports": FREE}, ["rigid motion", "rotation about x", "rigid-body"]),
    ("support place", {"supports": '[[supports]]\nat = "edge:left"\n'},
     ["supports[0].at", "'edge:left'", "edge:start"]),
    ("support letters", {"supports": HELD + 'fix = "xyw"\n'}, ["supports[0].fix", "'xyw'"]),
    ("no letters", {"supports": HELD + 'fix = ""\n'}, ["supports[0].fix"]),
    ("zero direction", {"supports": HELD + "fix = [0, 0, 0]\n"}, ["supports[0].fix = [0", "zero vector"]),
    ("short direction", {"supports": HELD + "fix = [0, 1]\n"}, ["supports[0].fix = [0, 1]", "direction [x, y, z]"]),
    ("rigid body with fix", {"supports": '[[supports]]\nat = "rigid-body"\nfix = "z"\n'},
     ["supports[0]", "remove fix"]),
    ("node number", {"supports": '[[supports]]\nat = "node:999"\n'}, ["supports[0].at", "node:999", "node:0 to"]),
    ("odd node number", {"supports": '[[supports]]\nat = "node:²"\n'}, ["supports[0].at", "node:²"]),
    ("node in a list", {"supports": "[[supports]]\nat = [0, 999]\n"}, ["supports[0].at", "999"]),
    ("negative node", {"supports": "[[supports]]\nat = [-1]\n"}, ["supports[0].at = [-1]"]),
    # --- creases
    ("spring on no crease", {"creases": "[creases.rim]\nLstar = 25\n"}, ["creases.rim", "no crease 'rim'"]),
    ("two springs", {"creases": "[creases.crease]\nLstar = 25\nstiffness = 1\n"}, ["creases.crease", "either Lstar"]),
    ("no spring", {"creases": "[creases.crease]\nrest = 3\n"}, ["creases.crease", "either Lstar"]),
    ("rest in degrees", {"creases": "[creases.crease]\nLstar = 25\nrest = 90\n"},
     ["creases.crease.rest = 90", "not degrees"]),
    # --- steps
    ("unknown crease", {"steps": step("fold = { crease = 'rim', to = 2 }")},
     ["steps[0].fold.crease", "no crease 'rim'", "crease"]),
    ("degrees", {"steps": step("fold = { crease = 'crease', to = 90 }")},
     ["steps[0].fold.to = 90", "radians, not degrees"]),
    ("closed", {"steps": step("fold = { crease = 'crease', to = 0.0 }")}, ["steps[0].fold.to = 0.0"]),
    ("to and rest", {"steps": step("fold = { crease = 'crease', to = 2.0, rest = 2.0 }")},
     ["steps[0].fold", "exactly one of to, by and rest"]),
    ("nothing to fold to", {"steps": step("fold = { crease = 'crease', Lstar = 25 }")},
     ["steps[0].fold", "exactly one of to, by and rest"]),
    ("to with a spring", {"steps": step("fold = { crease = 'crease', to = 2.0, Lstar = 25 }")},
     ["steps[0].fold", "takes no stiffness"]),
    ("rest without a spring", {"steps": step("fold = { crease = 'crease', rest = 2.0 }")},
     ["steps[0]", "'crease'", "Lstar or stiffness"]),
    ("no angles drawn", {"steps": step("fold = { crease = 'crease', by = 'drawn' }")}, ["steps[0]", "no fold angles"]),
    ("by a word", {"steps": step("fold = { crease = 'crease', by = 'half' }")}, ['steps[0].fold.by = "half"', "drawn"]),
    ("angles an edge", {"steps": step("fold = { crease = 'crease', to = [3.0, 2.9] }")},
     ["steps[0]", "2 angles for 4 edges"]),
    ("second step", {"steps": BASE["steps"] + step("moment = { crease = 'crease', to = 'large' }")},
     ['steps[1].moment.to = "large"', "N mm / mm"]),
    ("second of two folds", {"steps": step("fold = [{ crease = 'crease', to = 2 }, { crease = 'crease' }]")},
     ["steps[0].fold[1]", "exactly one"]),
    ("force place", {"supports": HELD, "steps": step("force = { at = 'tip', each = [0, 0, 1] }")},
     ["steps[0].force.at", "'tip'"]),
    ("force twice", {"supports": HELD, "steps": step("force = { at = 'all', each = [0, 0, 1], total = [0, 0, 1] }")},
     ["steps[0].force", "either each or total"]),
    ("force in a plane", {"supports": HELD, "steps": step("force = { at = 'all', each = [0, 1] }")},
     ["steps[0].force.each = [0, 1]", "three numbers"]),
    ("force on a free sheet", {"steps": BASE["steps"] + step("force = { at = 'edge:end', each = [0, 0, 1] }")},
     ["steps[1]", "equilibrium", "supports"]),
    ("displaced support", {"supports": HELD,
                           "steps": step("displace = { at = 'edge:inner', direction = 'z', by = 1 }")},
     ["steps[0]", "fixed and displaced", "remove"]),
    ("displaced nowhere", {"supports": HELD,
                           "steps": step("displace = { at = 'edge:end', direction = [0, 0, 0], by = 1 }")},
     ["steps[0].displace.direction = [0", "zero vector"]),
    ("displaced by a word", {"supports": HELD,
                             "steps": step("displace = { at = 'edge:end', direction = 'up', by = 1 }")},
     ['steps[0].displace.direction = "up"', '"z"']),
    # --- TOML
    ("not TOML", {"sheet": "[sheet]\nE : 4000\n"}, ["not TOML", "line"]),
    ("key twice", {"sheet": BASE["sheet"] + "E = 1.0\n"}, ["not TOML", "line"]),
    ("deep brackets", {"sheet": "a = " + "[" * 3000 + "]" * 3000}, ["nested too deeply"]),
    ("endless integer", {"sheet": f"[sheet]\nE = {'9' * 5000}\n"}, ["not TOML", "4300"]),
    ("control characters", {"steps": step(r'fold = { crease = "a\u0007\nb", to = 2 }')}, [r"a\x07 b"]),
]  # fmt: skip


@pytest.mark.parametrize(("sections", "words"), [case[1:] for case in CASES], ids=[case[0] for case in CASES])
def test_scene_is_refused(sections: Any, words: Any) -> None:
    message = refused(text_of(**sections))
    for word in words:
        assert word in message


def test_the_base_scene_is_right() -> None:
    assert parse_scene(text_of()).model.steps


SQUARE: dict[str, Any] = {
    "file_spec": 1.2,
    "vertices_coords": [[0, 0], [10, 0], [10, 10], [0, 10]],
    "faces_vertices": [[0, 1, 2], [0, 2, 3]],
    "edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 2]],
    "edges_assignment": ["B", "B", "B", "B", "M"],
}


FOLD_CASES = [
    ("no JSON", "{", ["sheet.fold", "not JSON"]),
    ("empty", "", ["sheet.fold", "empty"]),
    ("no object", "[1, 2]", ["sheet.fold", "a list"]),
    ("index", {**SQUARE, "faces_vertices": [[0, 1, 2], [0, 2, 4]]}, ["faces_vertices[1]", "4", "0 to 3"]),
    ("coordinates", {**SQUARE, "vertices_coords": [[0, 0], [10, 0], [10, None], [0, 10]]}, ["vertices_coords[2]"]),
    ("letters", {**SQUARE, "edges_assignment": ["B", "B", "B", "B", "X"]}, ["edges_assignment[4]", '"X"']),
    ("three faces an edge",
     {**SQUARE, "vertices_coords": [*SQUARE["vertices_coords"], [5, 5, 5]],
      "faces_vertices": [[0, 1, 2], [0, 2, 3], [0, 2, 4]]}, ["edge 0-2", "non-manifold"]),
    ("creases that cross",
     {**SQUARE, "faces_vertices": [], "edges_vertices": [*SQUARE["edges_vertices"], [1, 3]],
      "edges_assignment": [*SQUARE["edges_assignment"], "V"]}, ["edges 4 and 5 cross"]),
    ("crease off the sheet",
     {**SQUARE, "faces_vertices": [], "vertices_coords": [*SQUARE["vertices_coords"], [20, 5]],
      "edges_vertices": [*SQUARE["edges_vertices"], [1, 4]],
      "edges_assignment": [*SQUARE["edges_assignment"], "V"]}, ["edge 5", "hangs loose"]),
    ("no area", {**SQUARE, "vertices_coords": [[0, 0], [5, 5], [10, 10], [0, 10]]}, ["sheet.fold", "area"]),
]  # fmt: skip


@pytest.mark.parametrize(
    ("content", "words"), [case[1:] for case in FOLD_CASES], ids=[case[0] for case in FOLD_CASES]
)
def test_fold_file_is_refused(tmp_path: Path, content: Any, words: Any) -> None:
    text = content if isinstance(content, str) else json.dumps(content)
    (tmp_path / "sheet.fold").write_text(text)
    message = refused(text_of(pattern='[pattern]\nfile = "sheet.fold"\n', mesh=""), tmp_path)
    for word in ["pattern.file", *words]:
        assert word in message


FILE_CASES = [
    ("missing", 'file = "other.fold"', "", ["pattern.file", "other.fold", "cannot be read"]),
    ("folder", 'file = "sub.fold"', "", ["pattern.file", "sub.fold", "folder"]),
    ("other format", 'file = "sheet.stl"', "", ["pattern.file", "sheet.stl", ".svg", ".dxf", ".opx, .fold"]),
    ("no name", 'file = ""', "", ['pattern.file = ""']),
    ("frame", 'file = "sheet.fold"\nframe = 3', "", ["no frame 3"]),
    ("odd frame", 'file = "sheet.fold"\nframe = -1', "", ["pattern.frame = -1"]),
    ("no rails", 'file = "sheet.fold"', BASE["mesh"], ["mesh.kind", 'use kind = "gmsh" with size']),
    ("null character", 'file = "a\\u0000.fold"', "", ["pattern.file"]),
    ("crease", 'file = "sheet.fold"', "", ["no crease 'crease'", "mountain"]),
]


@pytest.mark.parametrize(
    ("pattern", "mesh", "words"), [c[1:] for c in FILE_CASES], ids=[c[0] for c in FILE_CASES]
)
def test_pattern_file_is_refused(tmp_path: Path, pattern: Any, mesh: Any, words: Any) -> None:
    (tmp_path / "sheet.fold").write_text(json.dumps(SQUARE))
    (tmp_path / "sub.fold").mkdir()
    message = refused(text_of(pattern=f"[pattern]\n{pattern}\n", mesh=mesh), tmp_path)
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("content", "words"),
    [(b"", "is empty"), (b"a = '\xff'", "UTF-8"), (b"x" * 20_000_001, "longer than"), (None, "is a folder")],
    ids=["empty", "latin", "endless", "folder"],
)
def test_scene_file_is_refused(tmp_path: Path, content: Any, words: str) -> None:
    file = tmp_path / "odd.toml"
    file.mkdir() if content is None else file.write_bytes(content)
    with pytest.raises(InputError, match=words) as caught:
        load_scene(file)
    assert "odd.toml" in str(caught.value)


def test_missing_scene_file() -> None:
    with pytest.raises(InputError, match=r"no scene file 'nowhere\.toml'"):
        load_scene("nowhere.toml")
    with pytest.raises(InputError, match="cannot be read"):
        load_scene("a\0b.toml")


# --- the command line -------------------------------------------------------------------------------------------


def command(capsys: pytest.CaptureFixture[str], *words: Any) -> Any:
    """Exit code, and the one line on stderr."""
    code = main([str(word) for word in words])
    out, err = capsys.readouterr()
    assert err.count("\n") == 1
    assert err.startswith("bh: ")
    assert "Traceback" not in err
    return code, err, out


@pytest.mark.parametrize("case", [0, 44, 58, 75], ids=lambda number: CASES[number][0])
def test_bad_scene_exits_with_2_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], case: int
) -> None:
    (tmp_path / "bad.toml").write_text(text_of(**CASES[case][1]))
    code, err, out = command(capsys, "run", tmp_path / "bad.toml", "-o", tmp_path / "out")
    assert (code, out) == (2, "")
    assert "bad.toml" in err
    assert all(word in err for word in CASES[case][2])
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "place", ["taken", "taken/below", "linked"], ids=["file", "below a file", "dead link"]
)
def test_output_folder_that_cannot_be(tmp_path: Path, capsys: pytest.CaptureFixture[str], place: str) -> None:
    (tmp_path / "scene.toml").write_text(text_of())
    (tmp_path / "taken").write_text("mine")
    (tmp_path / "linked").symlink_to(tmp_path / "nowhere" / "at" / "all")
    code, err, _ = command(capsys, "run", tmp_path / "scene.toml", "-o", f"{tmp_path}/{place}")
    assert code == 2
    assert "output folder" in err
    assert "choose another" in err
    assert sorted(os.listdir(tmp_path)) == ["linked", "scene.toml", "taken"]
    assert (tmp_path / "taken").read_text() == "mine"


def test_path_file_that_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(text_of())
    (tmp_path / "out" / "path.bh").mkdir(parents=True)
    code, err, _ = command(capsys, "run", tmp_path / "scene.toml", "-o", tmp_path / "out")
    assert code == 2
    assert "path.bh" in err
    assert os.listdir(tmp_path / "out") == ["path.bh"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["run"], "SCENE"),
        (["run", "a.toml", "--output"], "--output"),
        (["run", "a.toml", "b.toml"], "b.toml"),
        (["run", "a.toml", "--resum"], "--resum"),
        (["fold"], "fold"),
        (["--version-of"], "--version-of"),
        (["view", "nowhere.bh"], "nowhere.bh"),
        (["view", ".", "--state", "last"], "--state"),
        (["run", "a.toml", "-o", "a\0b"], "--output"),
        (["view", "tests"], "path.bh"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_wrong_command_lines(capsys: pytest.CaptureFixture[str], words: Any, told: str) -> None:
    code, err, _ = command(capsys, *words)
    assert code == 2
    assert told in err


def test_a_name_of_any_length_is_told_in_a_short_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name = "z" * 1_000_000
    (tmp_path / "bad.toml").write_text(text_of(model=f'[model]\nformulation = "{name}"'))
    code, err, _ = command(capsys, "check", tmp_path / "bad.toml", "--no-picture")
    assert code == 2
    assert "model.formulation" in err
    assert "use one of" in err
    assert len(err) < 2500


def test_traceback_only_with_debug(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bad.toml").write_text("[sheet")
    assert main(["run", str(tmp_path / "bad.toml"), "--debug"]) == 2
    err = capsys.readouterr().err
    assert "Traceback" in err
    assert err.splitlines()[-1].startswith("bh: ")


def test_whole_program(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text(text_of(sheet="[sheet]\nE = 1\nt = -1\n"))
    program = [sys.executable, "-m", "bh.commands.cli", "run", "bad.toml"]
    done = subprocess.run(program, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert "bad.toml: sheet.t = -1" in done.stderr
    assert os.listdir(tmp_path) == ["bad.toml"]
