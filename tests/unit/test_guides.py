"""Pages that lead a user through a job: their Python runs and prints what they say, their scenes are read."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import bh
import meshes
from bh.commands.cli import main
from bh.scene.load import parse_scene

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PYTHON = re.compile(r"```python\n(.*?)```", re.DOTALL)
MESH = meshes.structured(meshes.annulus_sector(60.0, 12.0, 0.8), along=6, rows=2)
SHEET = bh.Sheet(E=4000.0, nu=0.3, t=0.2)
GRAIN = bh.Sheet.orthotropic(E1=4000.0, E2=2000.0, G12=1000.0, nu12=0.3, grain=0.0, t=0.2)


def page(name: str) -> str:
    return (DOCS / name).read_text(encoding="utf-8")


def test_a_test_in_the_lab_becomes_a_scene() -> None:
    text = page("from_a_test.md")
    names: dict[str, Any] = {}
    for code in PYTHON.findall(text):
        exec(compile(code, "docs/from_a_test.md", "exec"), names)
    printed = re.findall(r"print\((\w+)\)  # \S+ = ([\d.]+) \+- ([\d.]+)", text)
    assert [name for name, *_ in printed] == ["modulus", "crease"]
    for name, value, error in printed:
        assert names[name].values[0] == pytest.approx(float(value), rel=2e-3)
        assert names[name].errors[0] == pytest.approx(float(error), rel=0.05)
    (scene,) = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    model = parse_scene(scene).model
    assert names["modulus"].values[0] == pytest.approx(model.sheet.E, rel=2e-3)
    assert bh.trace(model, estimate=False).outcome == "reached"


def test_results_are_read_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", str(ROOT / "examples" / "appendix_b_a.toml"), "-o", "out"]) == 0
    capsys.readouterr()
    (code,) = PYTHON.findall(page("results.md"))
    exec(compile(code, "docs/results.md", "exec"), {})
    run, energy, result, _ = capsys.readouterr().out.splitlines()
    assert f"# {run}" in code
    assert float(energy.split()[0]) == pytest.approx(0.05298, rel=1e-3)
    assert result.startswith("True ")


TRIALS: dict[str, Callable[[str], bh.Model]] = {
    "sheets with a grain, stress and yield": lambda how: bh.Model(MESH, GRAIN, formulation=how).fold(
        "crease", by=0.05
    ),
    "clamped slopes, `hold`": lambda how: (
        bh.Model(MESH, SHEET, formulation=how).fold("crease", by=0.05).step(hold="edge:start")
    ),
    "creases with laws of their own": lambda how: (
        bh.Model(MESH, SHEET, formulation=how)
        .crease("crease", stiffness=0.3, law=bh.Softening(peak=1.0))
        .moment("crease", to=0.01)
    ),
    "panels that stop each other (`contact`)": lambda how: bh.Model(
        MESH, SHEET, formulation=how, contact="thickness"
    ).fold("crease", by=0.05),
}


@pytest.mark.parametrize("row", TRIALS)
def test_what_only_some_can_do(row: str) -> None:
    (said,) = re.findall(rf"^\| {re.escape(row)} \| (.*) \|$", page("which_model.md"), re.MULTILINE)
    for how, word in zip(("bars-and-hinges", "consistent", "shell"), said.split(" | "), strict=True):
        try:
            can = bh.trace(TRIALS[row](how), estimate=False, warn=False).outcome == "reached"
        except bh.ModelError:
            can = False
        assert can == (word == "yes"), how
