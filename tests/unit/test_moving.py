"""Places that are moved along a path: in Python, in scenes, and what cannot be."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import bh
import meshes
from bh.commands.cli import main
from bh.scene.load import parse_scene

SHEET = bh.Sheet(E=4000.0, nu=0.3, t=0.2)
STRIP = meshes.structured(meshes.strip(60.0, 10.0, [5.0]), along=6, rows=1)
SCENE = """
[pattern]
kind = "strip"
length = 60.0
width = 10.0
creases = [5.0]
[sheet]
E = 4000.0
t = 0.2
[mesh]
along = 6
[[supports]]
at = "edge:start"
fix = "xyz"
clamp = true
[[steps]]
force = { at = "edge:end", total = [0.0, 0.0, 0.001] }
[[steps]]
support = { at = "edge:start", fix = "z" }
move = { at = "edge:end", along = [[0, 0, 2], [-0.2, 0, 4]] }
[[steps]]
"""
FREE = 'release = "edge:end"\n'


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
def test_a_path_is_walked_from_where_the_place_is(formulation: str) -> None:
    """And to and fro is nowhere: the sheet is elastic."""
    free = bh.Model(STRIP, SHEET, formulation=formulation).fold("crease", by=0.5)
    folded = free.step(support=bh.Support("edge:start", "xyz"))
    corners = [(0.0, 0.0, 0.3), (-0.02, 0.1, 0.6), (0.0, 0.0, 0.0)]
    path = bh.trace(folded.move("corner:outer-end", corners), estimate=False).require()
    ends = {state.step: state for state in path}
    node = STRIP.nodes("corner:outer-end")
    begin = ends[1].points[node]
    for step, corner in enumerate(corners, start=2):
        assert ends[step].points[node] - begin == pytest.approx(np.array([corner]), abs=1e-7)
    assert ends[3].energy.total > ends[1].energy.total + 1e-3
    assert ends[4].energy.total == pytest.approx(ends[1].energy.total, abs=1e-9)


def test_in_a_scene_every_leg_is_a_step(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = parse_scene(SCENE + FREE).model
    assert len(model.steps) == 4
    assert [len(step.support) for step in model.steps] == [0, 1, 0, 0]
    assert [item.further for item in model.steps[2].actuations if isinstance(item, bh.Displace)] == [
        -0.2,
        0.0,
        2.0,
    ]
    (tmp_path / "scene.toml").write_text(SCENE + FREE)
    assert main(["run", str(tmp_path / "scene.toml"), "-o", str(tmp_path / "out"), "-q"]) == 0
    path = bh.read(tmp_path / "out").path
    ends = {state.step: state.points[path.model.mesh.nodes("edge:end")].mean(axis=0) for state in path}
    assert ends[2] - ends[0] == pytest.approx([-0.2, 0.0, 4.0], abs=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("along = [[0, 0, 2], [-0.2, 0, 4]]", "along = []", "steps[1].move.along"),
        ("[0, 0, 2]", "[0, 0]", "steps[1].move.along"),
        (
            "[0, 0, 2]",
            "[0, 0, 0]",
            "steps[1].move: move of 'edge:end': along[0] is where the move is already",
        ),
        ("[0, 0, 2]", '[0, 0, "2kg"]', "steps[1].move.along"),
        ("along = [[0, 0, 2]", "by = [[0, 0, 2]", "steps[1].move"),
        ('"edge:end", along', '"edge:nowhere", along', "steps[1].displace.at"),
        (
            'support = { at = "edge:start", fix = "z" }\n',
            "pull = { node = 1, to = [0, 0, 0], stiffness = 1 }\n",
            "give 'pull' a step of its own",
        ),
        ('support = { at = "edge:start", fix = "z" }', 'hold = "edge:end"', "steps[1]: "),
    ],
)
def test_what_cannot_be_is_one_line(old: str, new: str, told: str) -> None:
    assert old in SCENE + FREE
    with pytest.raises(bh.SceneError) as error:
        parse_scene((SCENE + FREE).replace(old, new))
    assert told in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("along", "told"),
    [
        ([], "along 0 corners cannot be"),
        ([(0.0, 0.0, float("nan"))], "along[0] = (0.0, 0.0, nan) is no point"),
        ([(0.0, 1.0, 0.0), (0.0, 1.0, 0.0)], "along[1] is where the move is already"),
        ((0.0, 0.0, 5.0), "along[0] = 0.0 is no point [x, y, z] in mm; give a list of such corners"),
        ("up", "along[0] = 'u' is no point"),
    ],
)
def test_what_cannot_be_in_python(along: Sequence[Sequence[float]], told: str) -> None:
    with pytest.raises(bh.ModelError) as error:
        bh.Model(STRIP, SHEET).move("edge:end", along)
    assert told in str(error.value)
