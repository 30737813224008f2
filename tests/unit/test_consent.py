"""Files of strangers run no code and name no files outside their folder; what the user allows, works."""

from __future__ import annotations

import json
import os
import shlex
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from importlib import invalidate_caches
from importlib.metadata import EntryPoint
from pathlib import Path as FilePath
from typing import Any

import pytest

import bh
from bh.commands.cli import main
from bh.errors import InputError
from bh.formulations.registry import formulation
from bh.runtime import consent
from bh.runtime.terminal import plain

SCENE = """
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.7
[sheet]
E = 4000.0
t = 0.127
[mesh]
along = 6
[model]
formulation = "bars-and-hinges"
[[supports]]
at = "rigid-body"
[[steps]]
fold = { crease = "crease", by = 0.2 }
"""
FOLD = 'fold = { crease = "crease", by = 0.2 }'


@pytest.fixture(autouse=True)
def nothing_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(consent.PLUGINS, raising=False)
    monkeypatch.delenv(consent.OUTSIDE, raising=False)
    monkeypatch.setattr(consent, "_SAID", set())


@pytest.fixture
def trap(tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> Iterator[FilePath]:
    """A module `trap` that leaves a mark when it is imported; the mark."""
    mark = tmp_path / "it-ran"
    (tmp_path / "trap.py").write_text(
        f"open({str(mark)!r}, 'w').close()\nfrom bh.mechanics.consistent.formulation import Consistent as Shell\n"
        "def value(state):\n    return state.energy.total\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    invalidate_caches()
    formulation.cache_clear()
    yield mark
    formulation.cache_clear()
    sys.modules.pop("trap", None)


def write(folder: FilePath, text: str, name: str = "scene.toml") -> FilePath:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def refused(capsys: pytest.CaptureFixture[str], arguments: list[str], *words: str) -> None:
    """One line with these words, exit 2."""
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert said.err.count("\n") == 1, said.err
    for word in (*words, "--allow-plugins"):
        assert word in said.err


def in_scenes(mark: FilePath) -> dict[str, tuple[str, str]]:
    """Kind of attack: the scene, and the name in it."""
    command = json.dumps(f"touch {shlex.quote(str(mark))}")
    opened = json.dumps(f"open({str(mark)!r}, 'w')")
    return {
        "support": (
            SCENE.replace("[[steps]]", f'[[supports]]\nkind = "os:system"\ncommand = {command}\n[[steps]]'),
            "os:system",
        ),
        "pattern": (
            SCENE.replace(
                'kind = "annulus_sector"\nradius = 100.0\nwidth = 10.0\nangle = 0.7',
                f'kind = "timeit:timeit"\nstmt = {opened}\nnumber = 1',
            ),
            "timeit:timeit",
        ),
        "step": (SCENE.replace(FOLD, f'"os:system" = {{ command = {command} }}'), "os:system"),
        "until": (SCENE + 'until = { observable = "trap:value", value = 1.0 }\n', "trap:value"),
        "formulation": (SCENE.replace('"bars-and-hinges"', '"trap:Shell"'), "trap:Shell"),
    }


@pytest.mark.parametrize("kind", ["support", "pattern", "step", "until", "formulation"])
@pytest.mark.parametrize("command", ["check", "run", "export"])
def test_a_scene_runs_no_code(
    kind: str, command: str, trap: FilePath, tmp_path: FilePath, capsys: pytest.CaptureFixture[str]
) -> None:
    text, name = in_scenes(trap)[kind]
    more = {
        "check": ["--no-picture"],
        "run": ["-o", str(tmp_path / "out"), "-q"],
        "export": [str(tmp_path / "a.svg")],
    }
    refused(capsys, [command, str(write(tmp_path, text)), *more[command]], name)
    assert not trap.exists()
    assert "trap" not in sys.modules


def attacked(file: FilePath, change: Any) -> None:
    """Change the model in a path file, as a stranger can."""
    with sqlite3.connect(file) as db:
        meta = json.loads(db.execute("SELECT value FROM meta WHERE key = 'model'").fetchone()[0])
        change(meta)
        db.execute("UPDATE meta SET value = ? WHERE key = 'model'", (json.dumps(meta),))


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> FilePath:
    folder = tmp_path_factory.mktemp("solved")
    assert main(["run", str(write(folder, SCENE)), "-o", str(folder / "out"), "-q", "--no-estimate"]) == 0
    return folder


@pytest.mark.parametrize("what", ["support", "step", "curve", "until", "formulation"])
@pytest.mark.parametrize("command", ["view", "resume", "export"])
def test_a_stored_path_runs_no_code(
    what: str,
    command: str,
    trap: FilePath,
    solved: FilePath,
    tmp_path: FilePath,
    capsys: pytest.CaptureFixture[str],
) -> None:
    shell = {"kind": "os:system", "command": f"touch {shlex.quote(str(trap))}"}

    def change(model: dict[str, Any]) -> None:
        if what == "support":
            model["supports"].append(shell)
        elif what == "step":
            model["steps"][0]["actuations"].append(shell)
        elif what == "curve":
            model["mesh"]["curves"]["crease:crease"] = shell
        elif what == "until":
            model["steps"][0]["until"] = {
                "observable": "trap:value",
                "value": 1.0,
                "of": None,
                "tolerance": 1e-4,
            }
        else:
            model["formulation"] = "trap:Shell"

    folder = tmp_path / "out"
    folder.mkdir()
    file = folder / "path.bh"
    file.write_bytes((solved / "out" / "path.bh").read_bytes())
    attacked(file, change)
    with sqlite3.connect(file) as db:  # so that there is something to go on with
        db.execute("DELETE FROM steps")
    scene = solved / "scene.toml"
    words = {
        "view": ["view", str(file), "--picture", str(tmp_path / "a.png")],
        "resume": ["run", str(scene), "-o", str(folder), "--resume", "-q"],
        "export": ["export", str(file), str(tmp_path / "a.svg")],
    }[command]
    refused(capsys, words, {"until": "trap:value", "formulation": "trap:Shell"}.get(what, "os:system"))
    assert not trap.exists()
    assert "trap" not in sys.modules


@pytest.mark.parametrize("how", ["option", "variable", "listed", "module", "entry point", "python"])
def test_with_consent_it_runs(
    how: str, trap: FilePath, tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ["check", str(write(tmp_path, in_scenes(trap)["formulation"][0])), "--no-picture"]
    if how == "option":
        words.insert(0, "--allow-plugins")
    elif how == "entry point":
        found = (EntryPoint("trap", "trap:Shell", consent.GROUP),)
        monkeypatch.setattr(consent, "entry_points", lambda group: found if group == consent.GROUP else ())
    elif how == "python":
        bh.allow_plugins("trap:Shell")
    else:
        monkeypatch.setenv(
            consent.PLUGINS, {"variable": "1", "listed": "other, trap:Shell", "module": "trap"}[how]
        )
    assert main(words) == 0
    assert trap.exists()
    if how == "option":  # it held for that command only
        assert consent.PLUGINS not in os.environ
        assert not consent.plugin_allowed("trap:Shell")


@pytest.mark.usefixtures("trap")
def test_another_name_is_still_refused(tmp_path: FilePath) -> None:
    bh.allow_plugins("trap:value")
    with pytest.raises(InputError, match="os:system"):
        bh.load_scene(write(tmp_path, in_scenes(tmp_path / "mark")["support"][0]))
    assert not consent.plugin_allowed("trapped:value")


def test_what_python_says_needs_no_consent(trap: FilePath, tmp_path: FilePath) -> None:
    """Traced, stored, read again and resumed, also in a fresh process that was told nothing."""
    program = f"""
import sys
sys.path.insert(0, {str(tmp_path)!r})
import bh, meshes
mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.7), along=6)
model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), formulation="trap:Shell").support("rigid-body")
model = model.step(bh.Fold("crease", by=0.2), until=bh.Until("trap:value", 1e-3))
path = bh.trace(model, file="path.bh")
assert bh.Path.load("path.bh").model.formulation == "trap:Shell"
assert bh.trace(model, file="path.bh", resume=True).outcome == path.outcome
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert trap.exists()


# ------------------------------------------------------------------------------------------ files beside


SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="20mm" viewBox="0 0 40 20">
<rect width="40" height="20" fill="none" stroke="black"/><path d="M0 10 L40 10" fill="none" stroke="red"/></svg>"""
DRAWN = (
    SCENE.replace('kind = "annulus_sector"\nradius = 100.0\nwidth = 10.0\nangle = 0.7', 'file = "FILE"')
    .replace("along = 6", 'kind = "gmsh"\nsize = 8.0')
    .replace('"crease"', '"all"')
)


@pytest.mark.parametrize("way", ["above", "absolute", "link"])
def test_drawings_lie_below_the_scene(
    way: str, tmp_path: FilePath, capsys: pytest.CaptureFixture[str]
) -> None:
    drawing = write(tmp_path, SVG, "sheet.svg")
    folder = tmp_path / "scenes"
    folder.mkdir()
    name = {"above": "../sheet.svg", "absolute": str(drawing), "link": "link.svg"}[way]
    if way == "link":
        (folder / name).symlink_to(drawing)
    scene = write(folder, DRAWN.replace("FILE", name))
    assert main(["check", str(scene), "--no-picture"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "pattern.file" in said
    assert "--allow-outside" in said
    assert main(["check", str(scene), "--no-picture", "--allow-outside"]) == 0


@pytest.mark.parametrize("name", ["sheet.svg", "drawings/../sheet.svg", "ABSOLUTE"])
def test_below_the_folder_every_way_is_fine(name: str, tmp_path: FilePath) -> None:
    drawing = write(tmp_path, SVG, "sheet.svg")
    (tmp_path / "drawings").mkdir()
    text = DRAWN.replace("FILE", str(drawing) if name == "ABSOLUTE" else name)
    assert main(["check", str(write(tmp_path, text)), "--no-picture"]) == 0


def test_init_says_what_a_drawing_elsewhere_needs(
    tmp_path: FilePath, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path, SVG, "sheet.svg")
    (tmp_path / "scenes").mkdir()
    scene = tmp_path / "scenes" / "scene.toml"
    assert main(["init", str(scene), "--drawing", str(tmp_path / "sheet.svg")]) == 0
    command = capsys.readouterr().out.split("next: bh ")[1]
    assert main([*shlex.split(command), "--no-picture"]) == 0


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ('scene = "../scene.toml"\n[axes.a]\nkey = "sheet.t"\nvalues = [0.1]', "scene"),
        ('scene = "here.toml"\n[table]\nfile = "../points.csv"\nkeys = { a = "sheet.t" }', "table.file"),
    ],
)
def test_sweeps_stay_in_their_folder(
    text: str, key: str, tmp_path: FilePath, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "sweeps"
    folder.mkdir()
    write(tmp_path, SCENE)
    write(tmp_path, "a\n0.1\n", "points.csv")
    write(folder, SCENE, "here.toml")
    assert main(["sweep", str(write(folder, text, "sweep.toml")), "--workers", "0", "-o", "x.nc"]) == 2
    said = capsys.readouterr().err
    assert f"{key} = " in said
    assert "--allow-outside" in said


def test_targets_stay_in_their_folder(tmp_path: FilePath, capsys: pytest.CaptureFixture[str]) -> None:
    target = write(tmp_path, '[target]\ncurve = "/etc/passwd"\n', "target.toml")
    assert main(["design", str(target)]) == 2
    said = capsys.readouterr().err
    assert "--allow-outside" in said
    assert ":x:" not in said


# ------------------------------------------------------------------------------------------ names


def test_names_do_not_act_on_the_terminal(tmp_path: FilePath, capsys: pytest.CaptureFixture[str]) -> None:
    """A crease whose name clears the screen, and one that turns the direction of reading."""
    rough = SCENE.replace("[model]", '[creases."\\u001b[2J\\u202ex"]\nLstar = 5.0\n[model]')
    assert main(["check", str(write(tmp_path, rough)), "--no-picture"]) == 2
    said = capsys.readouterr().err
    assert "\\x1b[2J\\u202ex" in said
    assert said.strip().isprintable()
    assert plain("a\x1b]0;title\x07\n\u202eb\tc") == "a\\x1b]0;title\\x07\n\\u202eb\tc"


def test_a_drawn_name_is_printed_plainly(tmp_path: FilePath, capsys: pytest.CaptureFixture[str]) -> None:
    named = SVG.replace("<path ", '<path id="a&#x9b;2J&#x202e;b" ')
    write(tmp_path, named, "sheet.svg")
    scene = write(tmp_path, DRAWN.replace("FILE", "sheet.svg"))
    assert main(["check", str(scene), "--no-picture"]) == 0
    assert all(line.isprintable() for line in capsys.readouterr().out.splitlines())


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="has no pipes with names")
@pytest.mark.parametrize("name", ["scene.toml", "sheet.svg", "sheet.dxf"])
def test_a_pipe_is_refused_at_once(name: str, tmp_path: FilePath, capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(tmp_path / name)
    scene = tmp_path / "scene.toml"
    if name != "scene.toml":
        write(tmp_path, DRAWN.replace("FILE", name))
    assert main(["check", str(scene), "--no-picture"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "is a pipe" in said
