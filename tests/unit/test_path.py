"""Paths: followed, and honest about what could not be reached."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh import (
    ArcLength,
    Fold,
    LoadControl,
    Model,
    ModelError,
    Newton,
    Sheet,
    trace,
)
from tests.unit.sample_paths import (
    CORNERS,
    FREE,
    MESH,
    MODELS,
    SHEET,
    D,
    Meter,
    Refusing,
    every,
    reached,
)

# --------------------------------------------------------------------------------------- what a path says


@every
def test_what_a_path_says(name: str) -> None:
    model = MODELS[name]
    path = reached(model)
    assert path.reason == ""
    assert [step.outcome for step in path.steps] == ["reached"] * len(model.steps)
    assert path.lambdas[0] == 0.0
    assert path.lambdas[-1] == len(model.steps)
    assert (np.diff(path.lambdas) > 0.0).all()
    assert path.iterations == sum(record.iterations for record in path.records) > 0
    assert path.wall_time_s > 0.0
    assert path.unknowns == len(path.records[-1].q)
    assert path.provenance["formulation"] == "bars-and-hinges"
    versions, input_hash = path.provenance["versions"], path.provenance["input"]
    assert isinstance(versions, dict)
    assert {"python", "numpy", "scipy", "numba", "curved-crease-workbench"} <= set(versions)
    assert len(str(input_hash)) == 64
    for record, state in zip(path.records, path, strict=True):
        assert (state.step, state.lam, state.stable) == (record.step, record.lam, record.stable)
        assert record.imbalance <= 1e-6
    for step in range(len(model.steps)):
        assert step + 1.0 in path.lambdas  # every step ends on its target


def test_indexing() -> None:
    path = reached(MODELS["held"])
    assert path[-1] is path[len(path) - 1]
    assert [state.lam for state in path[1:]] == [state.lam for state in path][1:]
    with pytest.raises(IndexError):
        path[len(path)]


def test_target_is_met_exactly() -> None:
    """An imposed angle is imposed, edge by edge, in every state (not by a stiff spring)."""
    path = reached(FREE.fold("crease", to=[1.2 + 0.02 * i for i in range(8)]))
    for state, record in zip(path, path.records, strict=True):
        goal = (1.0 - record.lam) * math.pi + record.lam * (1.2 + 0.02 * np.arange(8))
        assert np.abs(state.dihedral("crease") - goal).max() < 1e-9
    assert path[-1].energy.folding == 0.0
    assert np.abs(path[-1].crease_moment("crease")).min() > 1e-4  # N mm / mm: somebody has to hold it


def test_a_model_without_steps_is_refused() -> None:
    with pytest.raises(ModelError, match="no steps"):
        trace(FREE)


# --------------------------------------------------------------------------------------- steps run on


def test_two_folds_are_one() -> None:
    """To 3/4 pi and then to 1/2 pi, or at once: the same state."""
    for start in (FREE, CORNERS):
        once = reached(start.fold("crease", to=math.pi / 2))
        twice = reached(start.fold("crease", to=0.75 * math.pi).fold("crease", to=math.pi / 2))
        assert twice[-1].energy.total == pytest.approx(once[-1].energy.total, rel=1e-8)
        assert twice[-1].energy.stretching == pytest.approx(once[-1].energy.stretching, rel=1e-6)
        assert np.abs(twice[-1].dihedral_angles - once[-1].dihedral_angles).max() < 1e-7


def test_steps_begin_where_the_last_one_ended() -> None:
    """No jump between steps: the start of a step is the last state of the one before."""
    path = reached(MODELS["several steps"])
    ends = [max(i for i, r in enumerate(path.records) if r.step == step) for step in range(4)]
    for step in (1, 2, 3):
        system = path.system(step)
        before = path[ends[step - 1]]
        assert np.abs(system.positions(system.start(), 0.0) - before.points).max() < 1e-12
        if step != 2:  # in step 2 the spring is replaced by an exact angle, its moment by a multiplier
            assert system.evaluate(system.start(), 0.0).imbalance < 1e-6


def test_spring_that_becomes_a_held_crease() -> None:
    """The prescribed crease begins at the angle and the moment that the spring had: still in balance."""
    path = reached(FREE.fold("crease", rest=1.5, Lstar=20.0).fold("crease", to=2.0))
    system = path.system(1)
    first = system.evaluate(system.start(), 0.0)
    assert first.imbalance < 1e-6
    last = max(i for i, r in enumerate(path.records) if r.step == 0)
    moment = path[last].crease_moment("crease")
    law = D / 20.0 * (path[last].dihedral("crease") - 1.5)
    assert moment == pytest.approx(law, rel=1e-9)


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
def test_held_crease_with_a_couple_that_is_released(formulation: str) -> None:
    """The spring takes what the crease carried less the couple that goes on: nothing jumps."""
    model = Model(MESH, SHEET, formulation=formulation).step(
        Fold("crease", to=2.4), bh.Moment("crease", 0.05)
    )
    path = reached(model.fold("crease", rest=2.4, stiffness=0.5))
    begin = path.system(1)
    assert begin.evaluate(begin.start(), 0.0).imbalance <= 1e-7
    assert path.iterations < 60


def test_held_crease_that_is_released() -> None:
    """It keeps angle and moment at first, and ends as the spring alone would have."""
    held = FREE.fold("crease", to=2.0)
    path = reached(held.fold("crease", rest=1.5, Lstar=20.0))
    system = path.system(1)
    assert system.evaluate(system.start(), 0.0).imbalance < 1e-6
    alone = reached(FREE.fold("crease", rest=1.5, Lstar=20.0))
    assert path[-1].energy.total == pytest.approx(alone[-1].energy.total, rel=1e-8)
    assert path[-1].energy.folding == pytest.approx(alone[-1].energy.folding, rel=1e-6)


def test_fold_and_unfold() -> None:
    """Back to flat: what is left is below 1e-10 of the peak."""
    cases: list[tuple[Model, dict[str, Any], dict[str, Any]]] = [
        (FREE, {"to": math.pi / 2}, {"to": math.pi}),
        (CORNERS, {"rest": 1.2, "Lstar": 20.0}, {"rest": math.pi, "Lstar": 20.0}),
    ]
    for start, down, up in cases:
        path = reached(start.fold("crease", **down).fold("crease", **up))
        energies = [state.energy.total for state in path]
        assert max(energies) > 1e-3
        assert path[-1].energy.total < 1e-10 * max(energies)
        assert np.abs(path[-1].dihedral("crease") - math.pi).max() < 1e-6


def test_mountain_to_valley_through_flat() -> None:
    """Folded up, then straight through the flat state down: the mirror image of the first."""
    path = reached(FREE.fold("crease", to=2.0).fold("crease", to=2.0 * math.pi - 2.0))
    first = max(i for i, r in enumerate(path.records) if r.step == 0)
    assert path[-1].energy.total == pytest.approx(path[first].energy.total, rel=1e-8)


def test_loading_and_unloading_is_reversible() -> None:
    force = (0.0, 0.0, 2e-4)
    path = reached(
        CORNERS.force("corner:outer-end", each=force).force("corner:outer-end", each=(0.0, 0.0, 0.0))
    )
    assert max(s.energy.total for s in path) > 1e-6
    assert path[-1].energy.total < 1e-10 * max(s.energy.total for s in path)


def test_displacement_after_a_fold_begins_where_the_node_is() -> None:
    first = reached(CORNERS.fold("crease", to=math.pi / 2))
    there = float(first[-1].displacement("corner:outer-end")[0, 0])
    assert there < -1.0  # mm: folding has moved it
    model = CORNERS.fold("crease", to=math.pi / 2).displace("corner:outer-end", "x", there + 0.1)
    path = reached(model)
    moved = [float(s.displacement("corner:outer-end")[0, 0]) for s in path if s.step == 1]
    assert np.diff([there, *moved]).max() <= 0.1 + 1e-9


def test_crease_that_is_not_flat_at_rest() -> None:
    """A sheet made with a folded crease: the path begins in equilibrium, or says that it cannot."""
    path = trace(FREE.crease("crease", stiffness=0.01, rest=2.9).moment("crease", 1e-3))
    assert path.outcome == "reached"
    assert path.records[0].imbalance <= 1e-6


# --------------------------------------------------------------------------------------- progress


def test_progress_is_told() -> None:
    meter = Meter()
    path = reached(MODELS["several steps"], progress=meter)
    assert [(u[0], u[2]) for u in meter.updates] == [(r.step, r.lam) for r in path.records[1:]]
    assert {u[1] for u in meter.updates} == {4}
    assert sum(u[3] for u in meter.updates) == path.iterations
    assert meter.closed == ["reached"]


def test_progress_is_told_of_failure_and_of_errors() -> None:
    meter = Meter()
    path = trace(
        MODELS["held"],
        progress=meter,
        strategy=LoadControl(smallest=0.3, newton=Newton(full=1, globalised=0, transient=None)),
    )
    assert meter.closed == [path.outcome] == ["stalled"]

    class Broken(Meter):
        def update(self, *_: Any) -> None:
            raise KeyboardInterrupt

    broken = Broken()
    with pytest.raises(KeyboardInterrupt):
        trace(MODELS["held"], progress=broken)
    assert broken.closed == ["unfinished"]


def test_silence(capsys: pytest.CaptureFixture[str]) -> None:
    """The library prints nothing; a bar is silent where there is no terminal."""
    trace(MODELS["held"])
    trace(MODELS["held"], progress=True)
    out = capsys.readouterr()
    assert out.out == ""
    assert out.err == ""


# --------------------------------------------------------------------------------------- what cannot go on


def test_path_that_cannot_go_on_says_so() -> None:
    path = trace(
        MODELS["held"],
        strategy=LoadControl(smallest=0.3, newton=Newton(full=1, globalised=0, transient=None)),
    )
    assert path.outcome == "stalled"
    assert path.reason
    assert len(path) == 1  # the flat state is kept
    assert path[-1].energy.total < 1e-20


def test_failure_in_the_middle_keeps_what_was_reached() -> None:
    path = trace(MODELS["held"], strategy=LoadControl(smallest=0.1, newton=Refusing()))
    assert path.outcome == "stalled"
    assert path.reason == "no more"
    assert len(path) > 1
    full = reached(MODELS["held"])
    for record, state in zip(path.records[1:], path[1:], strict=True):
        assert record.imbalance <= 1e-8
        goal = (1.0 - record.lam) * math.pi + record.lam * 1.2
        assert np.abs(state.dihedral("crease") - goal).max() < 1e-9
        assert state.energy.total < full[-1].energy.total
    assert 0.25 < path[-1].lam <= 0.5


def test_a_failed_step_is_the_end() -> None:
    impatient = LoadControl(smallest=0.5, newton=Newton(full=1, globalised=0, transient=None))
    path = trace(FREE.fold("crease", to=1.2).fold("crease", to=2.0), strategy=impatient)
    assert path.outcome == "stalled"
    assert len(path.steps) == 1
    assert max(r.step for r in path.records) == 0


@pytest.mark.parametrize("fix", ["z", "xyz"])
def test_angle_that_supports_forbid(fix: str) -> None:
    """No unknown can fold this crease: no crash and nothing that looks like success."""
    model = FREE.support("all", fix).support("rigid-body").fold("crease", to=2.5)
    try:
        path = trace(model)
    except ModelError as refused:
        assert "\n" not in str(refused)  # noqa: PT017 - either answer will do
        return
    assert path.outcome != "reached"
    assert path.reason
    assert len(path) >= 1
    assert np.isfinite(path[-1].points).all()


def test_angle_that_bars_forbid() -> None:
    """A hinge whose wings and end lie on a line that is held cannot turn: its crease is half as long there."""
    mesh = meshes.structured(meshes.annulus_sector((40.0, 50.0), 8.0, 0.6), along=5)
    model = (
        Model(mesh, SHEET, formulation="bars-and-hinges")
        .support("edge:start", "xyz")
        .support("corner:inner-end", "z")
    )
    strategy = LoadControl(smallest=0.02, newton=Newton(globalised=30))
    path = trace(model.fold("crease-2", to=3.6), strategy=strategy)
    assert path.outcome != "reached"
    assert path.reason
    for record in path.records:
        assert record.imbalance <= 1e-6


def shallow_arch(force: float) -> tuple[Model, int]:
    """A sheet that is made as a shallow arch, 2 mm high over 40 mm, pushed down in the middle; snaps at about 0.6 N."""
    mesh = meshes.structured(meshes.strip(40.0, 8.0), along=10, kind="alternating")
    points = mesh.points.copy()
    points[:, 2] = 2.0 * np.sin(math.pi * points[:, 0] / 40.0)
    middle = np.flatnonzero(np.isclose(points[:, 0], 20.0)).tolist()
    model = (
        Model(replace(mesh, points=points), Sheet(E=1000.0, t=0.5), formulation="bars-and-hinges")
        .support("edge:start")
        .support("edge:end")
    )
    return model.support("all", "y").force(middle, total=(0.0, 0.0, -force)), middle[0]


@pytest.mark.parametrize(
    "force",
    [
        0.4,
        0.7,
        1.0,
        5.0,
        20.0,
    ],
)
def test_snap_through_is_told(force: float) -> None:
    """A dead load beyond the limit: either the path stops, or a note says that it left its branch. Never silently."""
    model, middle = shallow_arch(force)
    path = trace(model)
    w = np.array([state.displacement(f"node:{middle}")[0, 2] for state in path])
    if force < 0.5:
        assert path.outcome == "reached"
        assert abs(w).max() < 0.5
        return
    jumps = np.flatnonzero(np.abs(np.diff(w)) > 2.0) + 1
    if path.outcome == "reached":
        assert len(jumps) == 1
    for index in jumps:
        assert path.records[index].note


def test_arc_length_passes_the_limit_point() -> None:
    """The same arch by arc length: down, and the load falls beyond the limit; unstable states are marked so."""
    model, middle = shallow_arch(1.0)
    path = trace(model, strategy=ArcLength(most=60))
    loads = path.lambdas
    w = np.array([state.displacement(f"node:{middle}")[0, 2] for state in path])
    top = int(np.argmax(loads))
    assert 0.55 < loads[top] < 0.8
    assert top < len(loads) - 5
    assert (np.diff(w) < 0.0).all()
    assert np.abs(np.diff(w)).max() < 0.1
    stable = [record.stable for record in path.records[1:]]
    assert stable[0] is True
    assert stable[-1] is False
    assert sum(a is not b for a, b in itertools.pairwise(stable)) == 1  # unstable from one point on
    for record in path.records:
        assert record.imbalance <= 1e-8
