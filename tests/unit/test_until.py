"""Steps that end where an observable has a wanted value."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path as FilePath
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh import Model, ModelError, Sheet, Until, trace
from bh.formulations.observables import depth_of, measure
from bh.formulations.state import State
from bh.paths.record import Record
from bh.scene.load import parse_scene
from bh.solvers.outcome import Outcome
from bh.solvers.points import NOT_STABLE, Increment
from bh.solvers.walk import Walk, _until, walk

SHEET = Sheet(E=4000.0, t=0.381)
FORMULATIONS = ["bars-and-hinges", "consistent"]


def corrugation(kind: str = "parabolic-edge", formulation: str = "bars-and-hinges", along: int = 20) -> Model:
    mesh = meshes.structured(meshes.corrugation(kind), along=along)
    return Model(mesh, SHEET, formulation=formulation)


def folded(model: Model, until: Until | None, by: float = 1.4) -> bh.Path:
    return trace(model.fold("all", by=by, Lstar=25.0, until=until))


def height(state: State) -> float:
    return float(np.ptp(state.points[:, 2]))


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("kind", ["straight", "parabolic-edge", "elliptical-edge"])
def test_depth_is_met(kind: str, formulation: str) -> None:
    path = folded(corrugation(kind, formulation), bh.depth(6.0))
    assert path.outcome == "reached"
    assert path.records[-1].lam < 1.0
    assert depth_of(path[-1])[0] == pytest.approx(6.0, abs=1e-4)
    assert path.records[-1].imbalance < 1e-8
    assert path.stable


def test_depth_of_straight_pleats_is_that_of_the_zigzag() -> None:
    """Rigid panels 20 mm wide: depth = 20 sin(psi), with the fold angle 2 psi."""
    path = folded(corrugation("straight"), bh.depth(6.0))
    assert 20.0 * math.sin(0.5 * path[-1].fold_angle("crease-1").mean()) == pytest.approx(6.0, abs=2e-4)


def test_depth_does_not_depend_on_rigid_motion() -> None:
    state = folded(corrugation(), None, by=0.6)[-1]
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moved = State(**{**vars(state), "points": state.points @ turn.T + 7.0})
    (d, up), (e, other) = depth_of(state), depth_of(moved)
    assert e == pytest.approx(d, abs=1e-9)
    assert np.abs(turn @ up - other).max() < 1e-6


@pytest.mark.parametrize(
    ("observable", "of", "value"),
    [
        ("energy", None, 2.0),
        ("fold_angle", "crease-2", -0.4),
        ("bending", None, 1.0),
        (height, None, 4.0),
        ("displacement_z", "corner:inner-start", None),
    ],
)
def test_any_observable_ends_a_step(observable: str, of: str | None, value: float | None) -> None:
    model = corrugation()
    if value is None:
        whole = folded(model, None, by=0.5)
        value = 0.4 * float(whole[-1].displacement(str(of))[0, 2])
    until = Until(observable, value, of, 1e-7)
    path = folded(model, until)
    assert path.outcome == "reached"
    assert measure(until, path[-1]) == pytest.approx(value, abs=1e-7)


def test_what_is_never_met_fails_with_its_reason() -> None:
    path = folded(corrugation(), bh.depth(6.0), by=0.3)
    assert path.outcome == "target-missed"
    assert "missed by" in path.reason


def test_the_next_step_goes_on_from_there(tmp_path: FilePath) -> None:
    """Rest angles stay where the step ended; stored, loaded and resumed paths know it too."""
    model = corrugation().fold("all", by=1.4, Lstar=25.0, until=bh.depth(4.0))
    model = model.fold("all", by=1.4, Lstar=25.0, until=bh.depth(5.0))
    path = trace(model, file=tmp_path / "a.bh")
    ends = [i for i, r in enumerate(path.records) if i + 1 == len(path) or path.records[i + 1].step != r.step]
    assert [depth_of(path[i])[0] for i in ends] == pytest.approx([4.0, 5.0], abs=1e-4)
    direct = folded(corrugation(), bh.depth(5.0))
    assert path[-1].energy.total == pytest.approx(direct[-1].energy.total, rel=1e-4)
    loaded = bh.Path.load(tmp_path / "a.bh")
    assert np.array_equal(loaded[-1].points, path[-1].points)
    assert loaded[-1].energy.total == path[-1].energy.total


def test_held_angles_and_loads_go_on_from_there() -> None:
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.5), along=16)
    model = Model(mesh, Sheet(E=4000.0, t=0.127), formulation="bars-and-hinges").fold(
        "crease", to=1.6, until=Until("fold_angle", 0.7, "crease")
    )
    path = trace(model.fold("crease", to=1.6))
    assert path.outcome == "reached"
    first = max(i for i, r in enumerate(path.records) if r.step == 0)
    assert path[first].dihedral("crease") == pytest.approx(math.pi - 0.7, abs=1e-4)
    assert path[-1].dihedral("crease") == pytest.approx(1.6, abs=1e-9)
    direct = trace(
        Model(mesh, Sheet(E=4000.0, t=0.127), formulation="bars-and-hinges").fold("crease", to=1.6)
    )
    assert path[-1].energy.total == pytest.approx(direct[-1].energy.total, rel=1e-8)
    strip = meshes.structured(meshes.strip(50.0, 5.0), along=20)
    beam = (
        Model(strip, Sheet(E=4000.0, t=0.127), formulation="bars-and-hinges")
        .support("edge:start")
        .support((strip.nodes("edge:start") + 1).tolist())
    )
    pulled = beam.displace("edge:end", "z", 8.0)
    pulled = beam.step(*pulled.steps[0].actuations, until=Until("displacement_z", 3.0, "edge:end"))
    path = trace(pulled.displace("edge:end", "z", 5.0))
    assert path.outcome == "reached"
    assert path[-1].displacement("edge:end")[:, 2] == pytest.approx(5.0, abs=1e-9)


def test_bad_targets_are_one_line() -> None:
    for make, message in (
        (lambda: Until("dept", 1.0), "observable 'dept' is not known"),
        (lambda: Until("energy", float("nan")), "finite number"),
        (lambda: Until("fold_angle", 1.0), "needs `of`, the name of a crease"),
        (lambda: bh.depth(-1.0), "positive length"),
        (lambda: Until(lambda state: 1.0, 1.0), "top of a module"),
        (lambda: corrugation().step(until=bh.depth(1.0)), "at least one actuation"),
        (lambda: corrugation().step(bh.depth(1.0)), "give it by name"),  # type: ignore[arg-type]
        (lambda: corrugation().step("fold"), "takes actuations, not a str"),  # type: ignore[arg-type]
        (lambda: Model(corrugation().mesh, SHEET, steps=((bh.Fold("a", to=1.0),),)), "give bh.Step"),  # type: ignore[arg-type]
    ):
        with pytest.raises(ModelError, match=message):
            make()
    flat = Model(
        meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.5), along=4),
        SHEET,
        formulation="bars-and-hinges",
    )
    with pytest.raises(ModelError, match="the sheet has no valley"):
        trace(flat.fold("crease", to=2.0, until=bh.depth(1.0)))


SCENE = """
[pattern]
kind = "straight"
[sheet]
E = 4000.0
t = 0.381
[mesh]
along = 8
[[steps]]
fold = { crease = "all", by = 1.2, Lstar = 25.0 }
until = { UNTIL }
"""


def test_scene() -> None:
    path = trace(parse_scene(SCENE.replace("UNTIL", "depth = 6.0")).model)
    assert depth_of(path[-1])[0] == pytest.approx(6.0, abs=1e-4)
    path = trace(
        parse_scene(SCENE.replace("UNTIL", 'observable = "fold_angle", of = "crease-1", value = 0.5')).model
    )
    assert path[-1].fold_angle("crease-1").mean() == pytest.approx(0.5, abs=1e-4)
    for text, message in (
        ("depth = -1.0", r"until\.depth = -1"),
        ("value = 1.0", "needs either depth"),
        ('observable = "dept", value = 1.0', "not known"),
    ):
        with pytest.raises(bh.SceneError, match=message):
            parse_scene(SCENE.replace("UNTIL", text))


def test_a_small_value_is_met_as_well_as_a_large_one() -> None:
    """The tolerance is in parts of the value: an energy of 2e-5 N mm once was met with a twentieth of it."""
    model = corrugation().fold("all", by=0.5, Lstar=25.0, until=Until("energy", 2e-5))
    path = trace(model)
    assert path.outcome == "reached"
    assert path[-1].energy.total == pytest.approx(2e-5, rel=1e-5)


def test_a_jump_over_the_value_is_told() -> None:
    """A step whose states jump from one side of the value to the other has passed it, and says where."""

    def goal(at: Any) -> float:
        return float(at.value)

    one: Any = SimpleNamespace(point=SimpleNamespace(lam=0.5, value=1.0), reached=True, jumped=True)
    start = SimpleNamespace(lam=0.0, value=-1.0)
    task = Walk(None, None, (start,), goal=goal)  # type: ignore[arg-type]
    *_, last = _until(task, iter([one]), goal)
    assert last.outcome == "target-missed"
    assert "a jump at lambda 0.5 passed it" in last.note


class Steps:
    """A strategy whose increments are as long as the first one, on a path where lambda is all there is."""

    def __init__(self, at_bifurcation: str = "stable") -> None:
        self.at_bifurcation = at_bifurcation
        self.asked: list[float | None] = []
        self.histories: list[list[float]] = []

    @staticmethod
    def at(lam: float, negative: int = 0) -> Any:
        return SimpleNamespace(lam=lam, negative=negative)

    def follow(self, system: Any, history: Any, increment: Any = None, origin: Any = None) -> Any:
        self.asked.append(increment)
        self.histories.append([each.lam for each in history])
        lam, step = history[-1].lam, increment or 0.5
        while lam < 1.0:
            lam += step
            yield Increment(self.at(lam), Outcome.REACHED, 3, 0.0, step)

    def task(self) -> Walk:
        return Walk(None, self, (self.at(0.0),), goal=lambda p: p.lam - 0.35)  # type: ignore[arg-type]


def test_a_target_whose_path_was_lost_is_walked_to_in_shorter_increments(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The two states beside it may lie on different branches; nearer ones do not."""

    def zero(system: Any, a: Any, b: Any, *_: Any) -> Any:
        return (Steps.at(0.35), 0.0, 2) if b.lam - a.lam < 0.2 else None

    monkeypatch.setattr("bh.solvers.walk.locate_zero", zero)
    steps = Steps()
    found = list(walk(steps.task()))
    assert [each.point.lam for each in found] == pytest.approx([0.125, 0.25, 0.35])
    assert found[-1].reached
    assert steps.asked == [None, 0.125]
    assert [each.iterations for each in found] == [
        6,
        3,
        5,
    ]  # those of the increment that was lost are counted
    monkeypatch.setattr("bh.solvers.walk.locate_zero", lambda *_: None)
    *_, last = walk(Steps().task())
    assert last.outcome == "target-missed"
    assert "path to it was lost" in last.note


def test_shorter_increments_are_not_extrapolated_through_a_jump(monkeypatch: pytest.MonkeyPatch) -> None:
    """States before a jump lie on another branch."""
    steps = Steps()
    jumped = [
        Increment(Steps.at(lam), Outcome.REACHED, 1, 0.0, 0.1, jumped=lam == 0.2)
        for lam in (0.1, 0.2, 0.3, 0.4)
    ]
    monkeypatch.setattr("bh.solvers.walk.locate_zero", lambda *_: None)
    task = steps.task()
    list(_until(task, iter(jumped), task.goal))  # type: ignore[arg-type]
    assert steps.histories[0] == pytest.approx([0.2, 0.3])


@pytest.mark.parametrize(("at_bifurcation", "found"), [("stable", [0.125, 0.25, 0.35]), ("primary", [0.35])])
def test_a_target_that_is_not_stable_is_walked_to_in_shorter_increments(
    at_bifurcation: str, found: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the strategy follows stable branches: a long increment has passed a bifurcation unseen."""

    def zero(system: Any, a: Any, b: Any, *_: Any) -> Any:
        return Steps.at(0.35, negative=int(b.lam - a.lam > 0.2)), 0.0, 2

    monkeypatch.setattr("bh.solvers.walk.locate_zero", zero)
    assert [each.point.lam for each in walk(Steps(at_bifurcation).task())] == pytest.approx(found)


@pytest.mark.parametrize(
    ("shortest", "said"),
    [
        (1.0, "the state at the value that ends the step is not stable (2 negative modes"),
        (0.2, ""),  # stable once it is walked to in shorter increments
    ],
)
def test_a_target_that_stays_unstable_is_told(
    shortest: float, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also of a step that is not the last, of which nothing else tells."""

    def zero(system: Any, a: Any, b: Any, *_: Any) -> Any:
        return Steps.at(0.35, negative=2 if shortest == 1.0 or b.lam - a.lam > shortest else 0), 0.0, 2

    monkeypatch.setattr("bh.solvers.walk.locate_zero", zero)
    *before, last = walk(Steps().task())
    assert all(each.note == "" for each in before)
    assert last.reached
    assert last.note == (f"{said}, also in increments 256 times shorter)" if said else "")
    told = Record(0, 0.35, np.zeros(1), 1, 0.0, 0.0, 0.1, note=last.note)
    assert told.telling == bool(said)


def test_a_path_tells_of_a_step_that_ends_unstable() -> None:
    path = folded(corrugation(), bh.depth(2.0))
    path.records[-1] = replace(path.records[-1], note=f"{NOT_STABLE} (1 negative mode)")
    assert f"step 1: {NOT_STABLE} (1 negative mode)" in path.remarks
