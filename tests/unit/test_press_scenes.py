"""Bars that press, and tethers, in scenes: the same bits as in Python, and one line for what cannot be."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import bh
from bh.commands.cli import main
from bh.errors import SceneError
from bh.model.serialise import describe
from bh.scene.json_schema import schema
from bh.scene.load import parse_scene

SCENE = """
[pattern]
kind = "strip"
length = 40.0
width = 5.0
creases = [2.5]
fold = "flat"
[sheet]
E = 4000.0
t = 0.381
[mesh]
along = 16
[[steps]]
press = [
    { name = "left", at = [5.0, 2.5, -0.52], direction = [0, 1, 0], radius = 0.5, gap = 0.02 },
    { name = "right", at = [35.0, 2.5, -0.52], direction = [0, 1, 0], radius = 0.5, gap = 0.02 },
    { name = "top", at = [20.0, 2.5, 0.52], direction = [0, 2, 0], radius = 0.5, gap = 0.02, travel = [0, 0, -0.5] },
]
tether = { at = "all", total = [1e-6, 1e-6, 1e-6] }
"""
BAR = 'press = { name = "b", at = [0, 0, 1], direction = [1, 0, 0], radius = 0.5'
HEAD = SCENE.split("[[steps]]")[0] + "[[steps]]\n"


def in_python(scene: bh.Model) -> bh.Model:
    """The scene's model with its step in Python."""

    def bar(name: str, x: float, z: float, by: float = 0.0) -> bh.Indenter:
        return bh.Indenter(name, (x, 2.5, z), 0.5 * math.pi, 1.0, 1.0, 0.5, by=(0.0, 0.0, by), gap=0.02)

    bars = bar("left", 5.0, -0.52), bar("right", 35.0, -0.52), bar("top", 20.0, 0.52, -0.5)
    model = bh.Model(scene.mesh, scene.sheet, formulation=scene.formulation)
    return model.step(*bars, bh.Tether("all", (1e-6, 1e-6, 1e-6)))


def test_scene_and_python_give_the_same_bits(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    assert main(["run", str(tmp_path / "scene.toml"), "-o", str(tmp_path / "out")]) == 0
    stored = bh.Path.load(tmp_path / "out" / "path.bh")
    model = in_python(stored.model)
    assert describe(model)[0] == describe(stored.model)[0]
    path = bh.trace(model)
    assert np.array_equal(path[-1].points, stored[-1].points)
    told = json.loads((tmp_path / "out" / "result.json").read_text())["press"]
    assert {name: force.tolist() for name, force in path[-1].contact_forces.items()} == told
    assert told["left"][2] + told["right"][2] == pytest.approx(-told["top"][2], rel=1e-3)
    inertia = 5.0 * 0.381**3 / 12.0  # the barriers give way by some hundredths of a millimetre
    assert -told["top"][2] == pytest.approx(48.0 * 4000.0 * inertia * 0.5 / 30.0**3, rel=0.15)


def test_a_scene_with_a_bar_needs_a_mesh() -> None:
    with pytest.raises(SceneError, match="the surface of a bar is as stiff as the edges of one mesh"):
        parse_scene(SCENE.replace("[mesh]\nalong = 16\n", ""))


def test_the_summary_tells_every_force(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    main(["run", str(tmp_path / "scene.toml"), "-o", str(tmp_path / "out")])
    printed = capsys.readouterr().out
    for name in ("left", "right", "top"):
        assert f"force of {name} on the sheet: " in printed


def test_axis_and_section_of_a_bar() -> None:
    text = BAR.replace("[1, 0, 0]", "[1, 1, 1]") + ', width = "3mm", height = 2.0 }'
    (bar,) = parse_scene(HEAD + text).model.steps[0].actuations
    assert isinstance(bar, bh.Indenter)
    assert (bar.width, bar.height, bar.radius) == (3.0, 2.0, 0.5)
    axis = np.cross(bar.across, bar.up)
    assert axis == pytest.approx(np.ones(3) / math.sqrt(3.0))
    (round_one,) = parse_scene(HEAD + BAR + " }").model.steps[0].actuations
    assert isinstance(round_one, bh.Indenter)
    assert round_one.half == (0.0, 0.0)


@pytest.mark.parametrize(
    ("step", "message"),
    [
        (BAR + ", width = 0.9 }", r"steps\[0\]\.press: indenter 'b': its radius 0.5 mm is more than half"),
        (BAR + ", travel = [0, 0] }", r"steps\[0\]\.press\.travel = \[0, 0\] cannot be; give three numbers"),
        (BAR + ", gap = 0 }", r"steps\[0\]\.press\.gap = 0 cannot be; give the distance in mm"),
        (BAR + ", by = 1 }", r"unknown key steps\[0\]\.press\.by"),
        (BAR.replace("[1, 0, 0]", "[0, 0, 1]") + " }", r"steps\[0\]\.press: has an axis that stands upright"),
        ("press = { radius = 1.0 }", r"steps\[0\]\.press\.at is missing"),
        (f"press = [{BAR[8:]} }}, {BAR[8:]} }}]", r"steps\[0\]: two indenters of a step are named 'b'"),
        (
            'tether = { at = "all", total = [-1, 0, 0] }',
            r"steps\[0\]\.tether\.total = \[-1, 0, 0\] cannot be",
        ),
        ('tether = { at = "edge:nowhere", total = [1, 1, 1] }', r"steps\[0\]\.tether\.at: "),
    ],
)
def test_what_cannot_be_is_told_in_one_line(step: str, message: str) -> None:
    with pytest.raises(SceneError, match=message) as told:
        parse_scene(HEAD + step)
    assert "\n" not in str(told.value)


def test_the_schema_has_both() -> None:
    defined = schema()["$defs"]
    assert isinstance(defined, dict)
    assert {"PressTable", "MouldTable", "TetherTable"} <= set(defined)
