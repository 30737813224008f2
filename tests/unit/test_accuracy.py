"""Solving to a wanted accuracy: levels of refinement, the estimate, what cannot be refined, scenes and the command."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bh
import bh.solving.accuracy
import bh.solving.follow
import meshes
from bh.commands.cli import main
from bh.errors import ModelError, SceneError
from bh.model.refinement import Goal, Refinement, mesh_at, pattern_of
from bh.paths.estimate import Trial
from bh.scene.load import parse_scene
from bh.solvers.outcome import Outcome
from bh.solving.accuracy import candidates, estimate
from bh.solving.race import Race
from verification.studies.solver.honesty import TRAINING, examine

SHEET = bh.Sheet(E=4000.0, nu=0.38, t=0.127)
SECTOR = meshes.annulus_sector(100.0, 10.0, math.pi / 4)
SCENE = """
accuracy = {accuracy}
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.4
[sheet]
E = 4000.0
nu = 0.38
t = 0.127
[[supports]]
at = "corner:inner-start"
fix = "xyz"
[[supports]]
at = "corner:outer-start"
fix = "yz"
[[supports]]
at = "corner:inner-end"
fix = "z"
[[steps]]
fold = {{ crease = "crease", to = 2.0 }}
"""


def model(pattern: meshes.CreasePattern = SECTOR) -> bh.Model:
    return bh.Model(meshes.structured(pattern, along=4), SHEET)


# --- levels ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "pattern", [SECTOR, meshes.strip(80.0, 12.0, [5.0]), meshes.full_annulus(60.0, 10.0)]
)
def test_levels_have_cells_as_wide_as_high(pattern: meshes.CreasePattern) -> None:
    """Twice the level: twice the rows and, to rounding, twice the cells along."""
    for level, rows in ((1.0, 1), (2.0, 2), (4.0, 4)):
        mesh = mesh_at(pattern, "staggered", level)
        assert mesh.aspect_ratio == pytest.approx(1.0, rel=0.2)
        along = len(mesh.crease_edges("crease"))
        assert len(mesh.triangles) == pytest.approx(2 * 2 * along * rows, rel=0.35)
    assert mesh_at(pattern, "mirrored", 0.5).aspect_ratio == pytest.approx(0.5, rel=0.2)


def test_a_changed_mesh_has_no_pattern() -> None:
    """What is bent or scaled by hand must not come back flat."""
    mesh = meshes.structured(SECTOR, along=8)
    assert mesh.pattern is SECTOR
    assert meshes.unstructured(SECTOR, size=8.0).pattern is SECTOR
    for points in (2.0 * mesh.points, mesh.points + np.outer(np.sin(mesh.points[:, 0]), [0.0, 0.0, 1.0])):
        assert replace(mesh, points=points, spans=None).pattern is None


def test_choice_knows_what_was_measured() -> None:
    option = Refinement("staggered", ((1.0, 0.1), (2.0, 0.05), (4.0, 0.01), (8.0, 0.004)), 1.0, 2.0)
    assert [option.level(error) for error in (0.2, 0.02, 0.005)] == [4.0, 4.0, 8.0]
    assert option.level(0.001) == 8.0 * 2.0  # second order
    assert set(candidates()) == {"consistent", "shell"}


# --- the estimate ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [1.0, 1.5, 2.0])
def test_estimate_of_a_power_law(order: float) -> None:
    """The error of the last value, times the safety, and the order that the values have."""
    values = [np.array([2.0 + 0.1 * 2.0 ** (-order * k)]) for k in range(3)]
    told, found = estimate(values)
    assert found == pytest.approx(order)
    error = abs(float(values[-1][0]) - 2.0) / float(values[-1][0])
    assert told == pytest.approx(bh.solving.accuracy.SAFETY * error)


def test_values_that_turn_back_are_not_trusted() -> None:
    """1.00, 1.10, 1.099 are close to each other at the turn; the last change alone says nothing."""
    told, order = estimate([np.array([v]) for v in (1.0, 1.1, 1.099)])
    assert math.isnan(order)
    assert told > 0.02
    told, order = estimate([np.array([1.0]), np.array([1.1])])
    assert told == math.inf
    assert math.isnan(order)
    assert estimate([np.array([v]) for v in (1.0, math.nan, 1.1)])[0] == math.inf


def test_errors_beyond_second_order_are_not_claimed() -> None:
    """Values that happen to agree to all digits are off by what second order would leave."""
    told, _ = estimate([np.array([v]) for v in (1.0, 1.1, 1.1)])
    assert told > 5e-3


# --- trace ----------------------------------------------------------------------------------------------------


def test_trace_to_an_accuracy() -> None:
    """The estimate holds against a fine shell, and the path is on the mesh that was chosen."""
    held = model().support("corner:inner-start", "xyz").support("corner:outer-start", "yz")
    folded = held.support("corner:inner-end", "z").fold("crease", to=math.pi / 2)
    path = bh.trace(folded, accuracy=0.05)
    told = path.accuracy
    assert told is not None
    assert (path.outcome, told.met, told.formulation) == ("reached", True, path.model.formulation)
    assert told.trials[-1].triangles == len(path.model.mesh.triangles) > 100
    assert told.estimate <= 0.05
    truth = bh.trace(replace(folded, mesh=mesh_at(SECTOR, "mirrored", 4.0), formulation="shell"))[
        -1
    ].energy.total
    error = abs(path[-1].energy.total - truth) / truth
    assert 1e-5 < error < 1.5 * told.estimate
    assert "energy to" in str(told)
    assert json.loads(json.dumps(told.as_dict()))["met"] is True


def test_it_looks_once_for_other_states_on_the_mesh_before_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    looked: list[int] = []

    def beside(path: bh.Path, *_: object) -> str:
        looked.append(path.unknowns)
        return "another stable state is within reach"

    monkeypatch.setattr(bh.solving.follow, "_beside", beside)
    path = bh.trace(model().fold("crease", to=1.571), accuracy=0.05)
    assert path.accuracy is not None
    assert looked == [path.accuracy.trials[-2].unknowns]
    assert (
        path.steps[-1].reason == "another stable state is within reach, on the coarser mesh before this one"
    )


def test_a_finer_accuracy_costs_more() -> None:
    """It goes on refining, and may change the formulation."""
    folded = model().fold("crease", rest=1.57, Lstar=25.0)
    coarse, fine = (bh.trace(folded, accuracy=within).accuracy for within in (0.1, 0.005))
    assert coarse is not None
    assert fine is not None
    assert fine.met
    assert fine.estimate <= 0.005 < coarse.estimate
    assert fine.trials[-1].unknowns > 2 * coarse.trials[-1].unknowns


@pytest.mark.parametrize(
    "goal",
    [
        bh.Goal(0.05, "tip", "corner:outer-end"),
        bh.Goal(0.2, "stiffness", "corner:outer-start", (1.0, 0.0, 0.0)),
    ],
)
def test_goals(goal: bh.Goal) -> None:
    held = model().support("corner:inner-start", "xyz").support("corner:outer-start", "yz")
    path = bh.trace(held.support("corner:inner-end", "z").fold("crease", by=0.8), accuracy=goal)
    told = path.accuracy
    assert told is not None
    assert told.met
    value = bh.solving.accuracy.reading(path, goal)
    np.testing.assert_array_equal(value, told.trials[-1].value)
    assert value.shape == ((3,) if goal.of == "tip" else (1,))


def test_what_is_not_met_is_said() -> None:
    """A cost that is stated ends the run; the best path is kept, and why it ended is said."""
    path = bh.trace(model().fold("crease", by=1.0), accuracy=Goal(1e-4, most_triangles=100))
    assert path.accuracy is not None
    assert path.outcome == "reached"
    assert not path.accuracy.met
    assert any("not met" in remark for remark in path.remarks)
    assert "more than 100" in path.accuracy.notes[-1]
    assert path.accuracy.notes[-1] == path.estimate_reason
    short = bh.trace(model().fold("crease", by=1.0), accuracy=Goal(1e-4, seconds=1e-6)).accuracy
    assert short is not None
    assert "more than is left of 1e-06 s" in short.notes[-1]
    assert len(short.trials) == 1


@pytest.mark.parametrize("clock", [1e-6, 1e6])
def test_what_is_begun_depends_on_work_and_not_on_the_clock(clock: float) -> None:
    """A next level of twice the cells takes eight times as long here: 44 s after 5.5 s."""
    option = Refinement("staggered", ((1.0, 0.1),) * 4, 1.0, 3.0)
    mesh = Trial("one", 1.0, "", 10, 1000, 1000, clock, Outcome.REACHED, np.zeros(1))
    for seconds, begun in ((49.0, False), (50.0, True)):
        race = Race(Goal(0.05, seconds=seconds), {"one": option}, {"one": [1.0, 2.0]})
        why = race.too_long([mesh])
        assert (why == "") is begun
        assert begun or why == "the next mesh takes some 44 s, more than is left of 49 s"


def test_a_path_that_ends_early_has_no_estimate() -> None:
    """Forces far beyond what the sheet bears: three meshes are tried, none is taken for an answer."""
    held = model(meshes.strip(40.0, 10.0, [5.0])).support("edge:start", "xyz").support("edge:outer", "xyz")
    path = bh.trace(
        held.crease("crease", stiffness=1e-9).force("edge:end", total=(0.0, 0.0, 1e7)), accuracy=0.1
    )
    assert path.outcome != "reached"
    assert path.accuracy is not None
    assert math.isinf(path.accuracy.estimate)
    assert not path.accuracy.met


def test_a_pinch_is_at_the_same_place_of_every_mesh() -> None:
    """Its place is a part of the crease's length, and names no node."""
    folded = model(meshes.annulus_sector(60.0, 10.0, 0.8)).fold("crease", by=1.0)
    path = bh.trace(folded.step(bh.Pinch("crease", at=0.5, by=1.6, length=12.0)), accuracy=bh.Goal(0.3))
    assert path.reached
    assert path.accuracy is not None
    assert len(path.accuracy.trials) > 1
    assert any("is shorter than two edges" in note for note in path.accuracy.notes)


def test_scene_of_the_training_seed_is_honest() -> None:
    assert examine(TRAINING, 1).honest


# --- what cannot be ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (lambda m: replace(m, mesh=meshes.SheetMesh(m.mesh.points, m.mesh.triangles)), "read from a file"),
        (lambda m: m.support([0, 1], "z"), r"supports\[0\].at"),
        (lambda m: m.support("node:0", "xyz"), "one mesh"),
        (lambda m: m.force("edge:end", each=(0.0, 0.0, 1.0)), "give total"),
        (lambda m: m.fold("crease", to=[2.0, 2.0, 2.1, 2.0]), "give one angle"),
    ],
)
def test_what_belongs_to_one_mesh_is_named(changed: Any, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        pattern_of(changed(model()))


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        ({"within": 2.0}, "0.02 is 2 %"),
        ({"within": True}, "0.02 is 2 %"),
        ({"within": 0.1, "of": "colour"}, "energy, tip, stiffness"),
        ({"within": 0.1, "of": "tip"}, "needs a place"),
        ({"within": 0.1, "at": "edge:end"}, "no place"),
        ({"within": 0.1, "of": "stiffness", "at": "edge:end"}, "direction"),
    ],
)
def test_bad_goals(goal: dict[str, object], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        bh.Goal(**goal)  # type: ignore[arg-type]


def test_bad_uses() -> None:
    folded = model().fold("crease", by=0.5)
    with pytest.raises(ModelError, match="free to move"):
        bh.trace(folded, accuracy=bh.Goal(0.1, "tip", "corner:outer-end"))
    with pytest.raises(ModelError, match="begins anew"):
        bh.trace(folded, accuracy=0.1, resume=True)
    with pytest.raises(ModelError, match="begins anew"):
        bh.trace(folded, accuracy=0.1, after=bh.trace(folded))
    held = folded.support("edge:start", "xyz").support("edge:end", "xyz")
    with pytest.raises(ModelError, match="held in that direction"):
        bh.trace(held, accuracy=bh.Goal(0.1, "stiffness", "corner:outer-start", (0.0, 0.0, 1.0)))


# --- scenes ---------------------------------------------------------------------------------------------------


def test_scenes() -> None:
    scene = parse_scene(SCENE.format(accuracy=0.05))
    assert scene.accuracy == bh.Goal(0.05)
    scene = parse_scene(SCENE.format(accuracy='{ within = 0.05, of = "tip", at = "corner:outer-end" }'))
    assert scene.accuracy == bh.Goal(0.05, "tip", "corner:outer-end")
    for value, words in (
        ("2", "accuracy = 2 cannot be"),
        ("true", "accuracy = True cannot be"),
        ("{ within = 3.0 }", "accuracy.within = 3.0 cannot be"),
        ('{ within = 0.1, of = "tip", at = "corner:nowhere" }', "corner:nowhere"),
        ("{ with = 0.1 }", "unknown key accuracy.with"),
    ):
        with pytest.raises(SceneError, match=words):
            parse_scene(SCENE.format(accuracy=value))
    with pytest.raises(SceneError, match=r"supports\[0\].at names nodes"):
        parse_scene(SCENE.format(accuracy=0.1).replace('"corner:inner-start"', '"node:0"'))


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """`bh run` says what was chosen and stores it; what is not met is an exit code of 1."""
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(SCENE.format(accuracy=0.1))
    assert main(["run", "scene.toml", "-o", "out"]) == 0
    assert "energy to" in capsys.readouterr().out
    found = json.loads(Path("out/result.json").read_text())
    assert found["accuracy"]["met"]
    assert found["accuracy"]["trials"][-1]["unknowns"] == found["unknowns"]
    assert found["formulation"] == found["accuracy"]["formulation"]
    assert bh.Path.load("out/path.bh")[-1].energy.total == pytest.approx(found["energy"]["total"])
    Path("scene.toml").write_text(SCENE.format(accuracy="{ within = 0.0001, most_triangles = 10 }"))
    assert main(["run", "scene.toml", "-o", "other", "-q"]) == 1
    told = capsys.readouterr().err
    assert "not met" in told
    assert "more than 10" in told
    assert len(told.splitlines()) == 1
    assert bh.Path.load("other/path.bh").outcome == "reached"
