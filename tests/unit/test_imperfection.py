"""Sheets that are not flat: texts that are fields, random fields, modes, an imperfect column, seeds in sweeps."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import bh
import meshes
from bh import Model, ModelError, RandomField, SceneError, Sheet
from bh.model.expression import field
from bh.scene.load import parse_scene
from bh.sweep.file import load_sweep

LENGTH, WIDTH = 60.0, 4.0
SHEET = Sheet(E=1000.0, nu=0.0, t=0.5)
EULER = math.pi**2 * SHEET.E * WIDTH * SHEET.t**3 / 12.0 / LENGTH**2  # N


def column(name: str, along: int = 20) -> Model:
    mesh = meshes.structured(meshes.strip(LENGTH, WIDTH, [0.5 * WIDTH], "flat"), along=along, rows=1)
    return Model(mesh, SHEET, formulation=name).support("edge:start", "xyz").support("edge:end", "yz")


def test_an_imperfect_column() -> None:
    """A bow of 0.1 mm grows to w0 / (1 - P / P_Euler); Southwell's line gives the Euler load, limit 2 %."""
    model = bh.imperfect(column("consistent"), f"0.1 * sin(pi * x / {LENGTH})")
    loads = np.array([0.3, 0.5, 0.7]) * EULER
    for load in loads:
        model = model.force("edge:end", total=(-float(load), 0.0, 0.0))
    path = bh.trace(model, estimate=False).require()
    ends = {state.step: state for state in path}
    middle = np.flatnonzero(np.isclose(model.mesh.points[:, 0], 0.5 * LENGTH))
    bows = np.array([(ends[k].points - model.mesh.points)[middle, 2].mean() for k in range(3)])
    expected = 0.1 * (loads / EULER) / (1.0 - loads / EULER)
    assert bows == pytest.approx(expected, rel=0.03)
    slope = np.polyfit(bows, bows / loads, 1)[0]
    assert 1.0 / slope == pytest.approx(EULER, rel=0.02)
    assert model.mesh.points[:, 2].max() == pytest.approx(0.1, rel=1e-9)
    assert ends[0].energy.total > 0.0


def test_stress_free_as_it_is() -> None:
    """Nothing acts, nothing is stored; and a mode of buckling is a shape, whose sense the load follows."""
    flat = column("consistent")
    push = bh.Force("edge:end", total=(-1.0, 0.0, 0.0))
    mode = bh.buckling.buckling_modes(bh.Path(flat), push, count=1)[0]
    assert mode.factor == pytest.approx(EULER, rel=0.02)
    for sense in (0.05, -0.05):
        model = bh.imperfect(flat, mode.shape, amplitude=sense)
        assert np.abs(model.mesh.points - flat.mesh.points).max() == pytest.approx(0.05)
        path = bh.trace(model.force("edge:end", total=(-0.8 * EULER, 0.0, 0.0)), estimate=False)
        assert path[0].energy.total < 1e-15
        moved = path[-1].points - model.mesh.points
        began = model.mesh.points - flat.mesh.points
        assert float(np.vdot(moved, began)) > 0.0


def test_random_fields() -> None:
    """Of the standard deviation that is asked for (within 10 % over 2,000 seeds' points), smooth, the same anywhere."""
    x, y = np.random.default_rng(1).uniform(0.0, 500.0, size=(2, 400))
    values = np.array([RandomField(0.2, 30.0, seed)(x, y) for seed in range(50)])
    assert values.std() == pytest.approx(0.2, rel=0.1)
    assert abs(values.mean()) < 0.02
    assert np.array_equal(RandomField(0.2, 30.0, 7)(x[:3], y[:3]), values[7][:3])
    slopes = (RandomField(0.2, 30.0, 7)(x + 1e-4, y) - values[7]) / 1e-4
    assert slopes.std() == pytest.approx(0.2 * 2.0 * math.pi / 30.0 * 0.8, rel=0.3)
    coarse, fine = (column("consistent", along) for along in (10, 20))
    both = [bh.imperfect(model, RandomField(0.1, 20.0, 3)).mesh.points for model in (coarse, fine)]
    corner = [model.mesh.nodes("corner:inner-start")[0] for model in (coarse, fine)]
    assert both[0][corner[0], 2] == both[1][corner[1], 2] != 0.0


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.1*sin(pi*x/2) - y^2", 0.1 - 4.0),
        ("-2e-1 * x ** 0.5", -0.2),
        ("abs(-y) / (1 + x)", 1.0),
        ("3", 3.0),
    ],
)
def test_fields(text: str, value: float) -> None:
    assert field(text, "z")(np.array([1.0]), np.array([2.0])) == pytest.approx([value])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("__import__('os').getcwd()", "is not allowed"),
        ("z + 1", "'z' is not known"),
        ("x if y else 1", "is not allowed"),
        ("x.real", "is not allowed"),
        ("(lambda: 1)()", "is not allowed"),
        ("[1][0]", "is not allowed"),
        ("True", "is not allowed"),
        ("sin(x", "it is no expression"),
        ("1 / (x - x)", "is not finite"),
        ("9**9**9**9", "is not finite"),
        ("x" * 301, "give at most 300"),
    ],
)
def test_what_is_no_field(text: str, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        field(text, "z")(np.array([1.0]), np.array([2.0]))


SCENE = """
[pattern]
kind = "strip"
length = 60.0
width = 4.0
creases = [2.0]
fold = "flat"
[sheet]
E = 1000.0
t = 0.5
{mesh}
[imperfection]
{how}
[[supports]]
at = "edge:start"
fix = "xyz"
clamp = true
[[steps]]
force = {{ at = "edge:end", total = [-0.1, 0.0, 0.0] }}
"""
MESH = "[mesh]\nalong = 10"


def test_scenes_and_seeds_of_a_sweep(tmp_path: Path) -> None:
    bowed = parse_scene(SCENE.format(mesh=MESH, how='z = "0.1 * x / 60"')).model
    assert bowed.mesh.points[:, 2].max() == pytest.approx(0.1)
    text = SCENE.format(mesh=MESH, how='amplitude = "0.05mm"\nwavelength = 20.0')
    (tmp_path / "strip.toml").write_text(text, encoding="utf-8")
    sweep = 'scene = "strip.toml"\n[axes.seed]\nkey = "imperfection.seed"\nstart = 1\nstop = 3\ncount = 3\n'
    (tmp_path / "seeds.toml").write_text(sweep, encoding="utf-8")
    task = load_sweep(tmp_path / "seeds.toml").task
    heights = [task.scene({"seed": float(seed)}).model.mesh.points[:, 2] for seed in (1, 2, 3)]
    assert np.abs(heights[0] - heights[1]).max() > 0.01
    assert np.array_equal(heights[1], task.scene({"seed": 2}).model.mesh.points[:, 2])


@pytest.mark.parametrize(
    ("mesh", "how", "words"),
    [
        (MESH, "seed = 1", "needs either z, or amplitude and wavelength"),
        (MESH, "amplitude = 0.1", "needs either z, or amplitude and wavelength"),
        (MESH, 'z = "q"', "'q' is not known"),
        ("", 'z = "x"', r"give a \[mesh\]"),
    ],
)
def test_bad_scenes(mesh: str, how: str, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        parse_scene(SCENE.format(mesh=mesh, how=how))


def test_bad_arrays() -> None:
    model = column("consistent")
    with pytest.raises(ModelError, match="cannot be; give"):
        bh.imperfect(model, np.zeros(3))
    with pytest.raises(ModelError, match="amplitude = nan"):
        bh.imperfect(model, "x", amplitude=math.nan)
    with pytest.raises(ModelError, match="wavelength = 0"):
        RandomField(0.1, 0.0)
    shell = bh.imperfect(column("shell"), "0.1 * sin(x / 20)").force("edge:end", total=(-0.1, 0.0, 0.0))
    with pytest.raises(bh.InputError, match="flat"):
        bh.trace(shell)
