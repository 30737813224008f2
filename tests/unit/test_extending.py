"""docs/extending.md: its module runs, passes the type checker, and works in the API, in scenes and in stored paths."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module, invalidate_caches
from pathlib import Path as FilePath
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh.errors import InputError
from verification.framework import cases
from verification.framework.run import run

ROOT = FilePath(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
SHEET = bh.Sheet(E=4000.0, t=0.127)
SECTOR = meshes.structured(meshes.annulus_sector(100.0, 10.0, math.pi / 4), along=12)


def write_page(folder: FilePath, text: str = PAGE) -> FilePath:
    """The page's code as a module."""
    blocks = [part.split("```")[0] for part in text.split("```python\n")[1:]]
    file = folder / "mine.py"
    file.write_text("\n\n".join(blocks), encoding="utf-8")
    return file


@pytest.fixture
def mine(tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    write_page(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("BH_ALLOW_PLUGINS", "mine,mime,math")
    invalidate_caches()
    yield import_module("mine")
    sys.modules.pop("mine", None)


def scene(folder: FilePath, text: str) -> Any:
    file = folder / "scene.toml"
    file.write_text(text, encoding="utf-8")
    return bh.load_scene(file)


SCENE = """
[pattern]
kind = "mine:wave"
rise = 4.0
[sheet]
E = 4000.0
t = 0.127
[mesh]
along = 16
[[supports]]
kind = "mine:Radial"
at = "corner:inner-end"
[[supports]]
at = "rigid-body"
[[steps]]
fold = { crease = "crease", by = 0.5 }
"""


def test_pattern_and_support_in_a_scene(mine: ModuleType, tmp_path: FilePath) -> None:
    model = scene(tmp_path, SCENE).model
    assert model.supports[0] == mine.Radial("corner:inner-end")
    crease = model.mesh.points[model.mesh.nodes("crease:crease")]
    assert crease[:, 1].max() == pytest.approx(24.0, abs=0.1)
    path = bh.trace(model, file=tmp_path / "path.bh")
    assert path.outcome == "reached"
    move = path[-1].displacement("corner:inner-end")[0]
    assert abs(move[1]) < 1e-9 < np.abs(move).max()  # it lies on the x axis and slides along it
    assert bh.Path.load(tmp_path / "path.bh").model.supports == model.supports


def test_support_holds_along_its_direction(mine: ModuleType) -> None:
    held = (
        bh.Model(SECTOR, SHEET, formulation="bars-and-hinges")
        .support(mine.Radial("edge:end"))
        .support("edge:end", "z")
    )
    held = held.support("edge:start", "xyz")
    state = bh.trace(held.fold("crease", rest=2.0, Lstar=25.0))[-1]
    nodes = SECTOR.nodes("edge:end")
    x, y = SECTOR.points[nodes, 0], SECTOR.points[nodes, 1]
    move = state.displacement("edge:end")
    assert np.abs(move[:, 0] * -y + move[:, 1] * x).max() < 1e-8
    assert np.abs(move).max() > 0.01


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent", "shell"])
def test_actuation_in_every_formulation(mine: ModuleType, formulation: str, tmp_path: FilePath) -> None:
    """A strip that hangs by its own weight: the tip of a cantilever, w L^4 / (8 E I), within some percent."""
    strip = meshes.structured(meshes.strip(40.0, 8.0), along=40, rows=4)
    bars = formulation == "bars-and-hinges"
    model = bh.Model(strip, SHEET, formulation=formulation).support("edge:start", "xyz", clamp=not bars)
    if bars:
        model = model.support(np.flatnonzero(strip.points[:, 0] < 1.5).tolist(), "xyz")
    path = bh.trace(model.step(mine.Weight(1390.0)), file=tmp_path / "path.bh")
    length = 39.0 if bars else 40.0
    load = 9.81e-9 * 1390.0 * SHEET.t
    exact = load * length**4 / (8.0 * SHEET.E * SHEET.t**3 / 12.0)
    tip = -path[-1].displacement("edge:end")[:, 2].mean()
    assert tip == pytest.approx(exact, rel=0.25 if bars else 0.05)
    weight = path[-1].reactions[:, 2].sum()
    assert weight == pytest.approx(load * 320.0, rel=1e-6)
    assert bh.Path.load(tmp_path / "path.bh").model.steps == (bh.Step((mine.Weight(1390.0),)),)


def test_actuation_in_a_scene(mine: ModuleType, tmp_path: FilePath) -> None:
    text = SCENE.replace('at = "rigid-body"', 'at = "crease:crease"')
    text = text.replace('fold = { crease = "crease", by = 0.5 }', '"mine:Weight" = { density = 1390.0 }')
    assert scene(tmp_path, text).model.steps == (bh.Step((mine.Weight(1390.0),)),)


@pytest.mark.usefixtures("mine")
def test_formulation() -> None:
    """Without the stiffer diagonals a sheet stretches more easily; folded, both are the same but for a little."""
    energies = []
    for name in ("mine:PlainBars", "bars-and-hinges"):
        model = bh.Model(SECTOR, SHEET, formulation=name).fold("crease", to=math.pi / 2)
        energies.append(bh.trace(model)[-1].energy.total)
    assert energies[0] < energies[1]
    assert energies[0] == pytest.approx(energies[1], rel=0.05)


FRESH = """
import mine, math
import bh, meshes
mesh = meshes.structured(mine.wave(), along=12)
model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), formulation="mine:PlainBars")
model = model.support(mine.Radial("corner:inner-end")).support("rigid-body")
assert bh.trace(model.fold("crease", by=0.5)).outcome == "reached"
assert bh.remarks(model) == ()
"""


def test_the_page_needs_nothing_imported_before(tmp_path: FilePath) -> None:
    """In a fresh interpreter, as a reader runs it."""
    write_page(tmp_path)
    done = subprocess.run([sys.executable, "-c", FRESH], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


def type_check(file: FilePath) -> tuple[int, str]:
    options = ["--strict", "--follow-imports=silent", f"--config-file={ROOT / 'pyproject.toml'}"]
    options.append(f"--cache-dir={ROOT / '.mypy_cache' / 'extending'}")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *options, str(file)], capture_output=True, text=True, cwd=ROOT
    )
    return done.returncode, done.stdout + done.stderr


def test_the_page_passes_the_type_checker(tmp_path: FilePath) -> None:
    code, said = type_check(write_page(tmp_path))
    assert code == 0, said


def test_the_type_checker_names_a_missing_member(tmp_path: FilePath) -> None:
    """A formulation whose states are made by another name, and one whose system lacks something."""
    code, said = type_check(write_page(tmp_path, PAGE.replace("def observe(", "def look(")))
    assert code == 1
    assert "PlainBars" in said
    assert "observe" in said


@pytest.mark.usefixtures("mine")
def test_rubber() -> None:
    """A strip at one and a half times its length: mu t / 2 (l^2 + 2 / l - 3) an area."""
    mesh = meshes.structured(meshes.strip(10.0, 2.0), along=10, rows=2)
    model = bh.Model(mesh, bh.Sheet(E=3.0, nu=0.5, t=0.2), formulation="mine:RubberSheet").support("all", "z")
    model = model.support("edge:start", "x").support("corner:inner-start", "y")
    path = bh.trace(model.displace("edge:end", "x", 5.0))
    assert path.outcome == "reached"
    assert path[-1].energy.total == pytest.approx(0.5 * 0.2 * (1.5**2 + 2.0 / 1.5 - 3.0) * 20.0, rel=1e-8)


def test_study(mine: ModuleType, tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "verification.studies.ch3.mine", mine)
    monkeypatch.setitem(cases.BY_NAME, "mine", cases.Study("mine", "3"))
    assert run(["mine"], tmp_path)["cases"][0]["verdict"] == "holds"


@pytest.mark.usefixtures("mine")
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mine:wave", "mine:waves", ["pattern", "'mine:waves'", "module:name"]),
        ("mine:wave", "mime:wave", ["pattern", "'mime:wave'", "module:name"]),
        ("rise = 4.0", "raise = 4.0", ["pattern", "raise"]),
        ("mine:wave", "math:sqrt", ["pattern", "math:sqrt"]),
        ("mine:Radial", "mine:Weight", ["supports[0]", "at"]),
        ('fold = { crease = "crease", by = 0.5 }', '"mine:Weight" = { mass = 1.0 }', ["steps[0]", "mass"]),
        (
            'fold = { crease = "crease", by = 0.5 }',
            '"mine:Radial" = { at = "all" }',
            ["steps[0]", "no Actuation"],
        ),
    ],
)
def test_bad_input_is_one_line(tmp_path: FilePath, old: str, new: str, words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        scene(tmp_path, SCENE.replace(old, new))
    message = str(caught.value)
    assert "\n" not in message
    assert all(word in message for word in words)
