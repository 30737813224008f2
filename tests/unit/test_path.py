"""Paths: followed, stored, loaded, resumed, and honest about what could not be reached."""

from __future__ import annotations

import itertools
import json
import math
import shutil
import sqlite3
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh import (
    ArcLength,
    Automatic,
    Displace,
    Fold,
    Force,
    LoadControl,
    Model,
    ModelError,
    Moment,
    Newton,
    Path,
    PathFileError,
    Sheet,
    trace,
)
from bh.loading.load_step import crease_hinges
from bh.model.serialise import describe, fingerprint, rebuild
from bh.solvers.newton import Solution

SHEET = Sheet(E=4000.0, t=0.127)
D = SHEET.bending_stiffness(nu=0.0)
MESH = meshes.structured(meshes.annulus_sector(100.0, 10.0, math.pi / 4), along=8)
FREE = Model(MESH, SHEET, formulation="bars-and-hinges")
CORNERS = (
    FREE.support("corner:inner-start", "xyz")
    .support("corner:outer-start", "yz")
    .support("corner:inner-end", "z")
)


def column() -> Model:
    """A strip that is shortened beyond its buckling load: the path leaves an unstable state on the way."""
    strip = meshes.structured(meshes.strip(40.0, 8.0), along=20)
    model = (
        Model(strip, Sheet(E=1000.0, t=0.2), formulation="bars-and-hinges")
        .support("edge:start", "xyz")
        .support("edge:end", "yz")
    )
    return model.displace("edge:end", "x", -0.02)


def several_steps() -> Model:
    model = CORNERS.crease("crease", Lstar=30.0).fold("crease", rest=2.4, Lstar=30.0)
    model = model.step(Force("corner:outer-end", each=(0.0, 0.0, 1e-4)), Moment("crease", 1e-4))
    return model.fold("crease", to=2.6).fold("crease", to=2.0)


MODELS = {
    "held": FREE.fold("crease", to=1.2),
    "spring, supported": CORNERS.fold("crease", rest=1.2, Lstar=20.0),
    "several steps": several_steps(),
    "column that buckles": column(),
}
every = pytest.mark.parametrize("name", MODELS)


def reached(model: Model, **how: Any) -> Path:
    path = trace(model, **how)
    assert path.outcome == "reached", path.reason
    return path


def assert_same_records(one: Path, two: Path) -> None:
    """Bit for bit, but for the time that it took."""
    assert len(one) == len(two)
    for a, b in zip(one.records, two.records, strict=True):
        assert np.array_equal(a.q, b.q)
        same = [f.name for f in fields(a) if f.name not in ("q", "wall_time_s", "critical")]
        assert [getattr(a, name) for name in same] == [getattr(b, name) for name in same]
        for c, d in zip(a.critical, b.critical, strict=True):
            assert all(np.array_equal(getattr(c, f.name), getattr(d, f.name)) for f in fields(c))


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


class Meter:
    def __init__(self) -> None:
        self.updates: list[tuple[int, int, float, int, float]] = []
        self.closed: list[str] = []

    def update(self, step: int, steps: int, lam: float, iterations: int, energy: float) -> None:
        self.updates.append((step, steps, lam, iterations, energy))

    def close(self, outcome: str) -> None:
        self.closed.append(outcome)


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


class Refusing(Newton):
    """Solves up to lambda = 0.5 and then gives up."""

    def solve(self, system: Any, q: Any, lam: float, *rest: Any, **more: Any) -> Solution:
        if lam > 0.5:
            return Solution(q, system.evaluate(q, lam), 1, False, "no more")
        return super().solve(system, q, lam, *rest, **more)


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


# --------------------------------------------------------------------------------------- files


@every
def test_saved_and_loaded(name: str, tmp_path: FilePath) -> None:
    path = reached(MODELS[name])
    path.save(tmp_path / "path.bh")
    loaded = Path.load(tmp_path / "path.bh")
    assert_same_records(path, loaded)
    assert [r.wall_time_s for r in loaded.records] == [r.wall_time_s for r in path.records]
    assert loaded.outcome == "reached"
    assert loaded.steps == path.steps
    assert loaded.provenance == path.provenance
    for a, b in zip(path, loaded, strict=True):
        assert a.energy == b.energy
        for field in ("points", "dihedral_angles", "reactions", "crease_moments"):
            assert np.array_equal(getattr(a, field), getattr(b, field), equal_nan=True), field
        for kind in a.energy_density:
            assert np.array_equal(a.energy_density[kind], b.energy_density[kind])
    assert list(tmp_path.iterdir()) == [tmp_path / "path.bh"]  # no drafts, no journals


@every
def test_written_while_it_runs_is_what_is_saved(name: str, tmp_path: FilePath) -> None:
    path = reached(MODELS[name], file=tmp_path / "run.bh")
    loaded = Path.load(tmp_path / "run.bh")
    assert_same_records(path, loaded)
    assert loaded.steps == path.steps


def test_file_is_plain_sqlite(tmp_path: FilePath) -> None:
    """Positions and energies can be read without this library."""
    path = reached(MODELS["held"], file=tmp_path / "run.bh")
    db = sqlite3.connect(tmp_path / "run.bh")
    rows = db.execute(
        "SELECT step, lambda, stretching, bending, folding, points FROM states ORDER BY id"
    ).fetchall()
    db.close()
    assert len(rows) == len(path)
    for (step, lam, stretching, bending, folding, points), state in zip(rows, path, strict=True):
        assert (step, lam) == (state.step, state.lam)
        assert (stretching, bending, folding) == (
            state.energy.stretching,
            state.energy.bending,
            state.energy.folding,
        )
        assert np.array_equal(np.frombuffer(points, "<f8").reshape(-1, 3), state.points)


class Copier(Meter):
    """Copies the path file after every accepted state, as a kill at that moment would leave it."""

    def __init__(self, file: FilePath) -> None:
        super().__init__()
        self.file = file
        self.copies: list[FilePath] = []

    def update(self, *what: Any) -> None:
        super().update(*what)
        copy = self.file.with_name(f"killed-{len(self.copies)}.bh")
        shutil.copy(self.file, copy)
        self.copies.append(copy)


@every
def test_resumed_after_a_kill(name: str, tmp_path: FilePath) -> None:
    """From any moment of the run: nothing is lost, and the rest is bit for bit the same."""
    copier = Copier(tmp_path / "run.bh")
    path = reached(MODELS[name], file=copier.file, progress=copier)
    assert len(copier.copies) == len(path) - 1
    for k, copy in enumerate(copier.copies, start=2):
        assert len(Path.load(copy)) == k
        if k < len(path):
            assert Path.load(copy).outcome == "unfinished"
        resumed = reached(MODELS[name], file=copy, resume=True)
        assert_same_records(path, resumed)
        assert_same_records(path, Path.load(copy))
        assert Path.load(copy).outcome == "reached"


@pytest.mark.parametrize("states", [3, 5, 7])
@pytest.mark.parametrize(
    "strategy", [Automatic(arc=ArcLength(most=20)), ArcLength(most=20)], ids=["automatic", "arc"]
)
def test_resumed_while_following_by_arc_length(
    strategy: Automatic | ArcLength, states: int, tmp_path: FilePath
) -> None:
    """A column under a dead load far beyond buckling, through itself: killed anywhere, it goes on in the same way."""
    strip = meshes.structured(meshes.strip(40.0, 8.0), along=20)
    model = (
        Model(strip, Sheet(E=1000.0, t=0.2), formulation="bars-and-hinges", contact=False)
        .support("edge:start")
        .support("edge:end", "yz")
    )
    model = model.force("edge:end", total=(-0.2, 0.0, 0.0))
    copier = Copier(tmp_path / "run.bh")
    path = trace(model, file=copier.file, progress=copier, strategy=strategy)
    assert sum(record.note == "arc length" for record in path.records) >= 8
    resumed = trace(model, file=copier.copies[states - 2], resume=True, strategy=strategy)
    for a, b in zip(path.records[: states + 2], resumed.records[: states + 2], strict=True):
        assert (a.lam, a.note) == (b.lam, b.note)
        assert np.array_equal(a.q, b.q)


def test_resumed_before_the_first_state(tmp_path: FilePath) -> None:
    file = tmp_path / "run.bh"
    path = reached(MODELS["held"], file=file)
    db = sqlite3.connect(file)
    with db:
        db.execute("DELETE FROM states")
        db.execute("DELETE FROM steps")
    db.close()
    assert_same_records(path, reached(MODELS["held"], file=file, resume=True))


def test_resuming_a_finished_run_does_nothing(tmp_path: FilePath) -> None:
    file = tmp_path / "run.bh"
    path = reached(MODELS["several steps"], file=file)
    meter = Meter()
    again = reached(MODELS["several steps"], file=file, resume=True, progress=meter)
    assert meter.updates == []
    assert_same_records(path, again)


def test_resuming_a_failed_run_tries_again(tmp_path: FilePath) -> None:
    file = tmp_path / "run.bh"
    failed = trace(MODELS["held"], file=file, strategy=LoadControl(smallest=0.1, newton=Refusing()))
    assert failed.outcome == "stalled"
    assert Path.load(file).outcome == "stalled"
    assert Path.load(file).reason == failed.reason
    resumed = reached(MODELS["held"], file=file, resume=True)
    assert len(resumed) > len(failed)
    assert_same_records_up_to(failed, resumed)
    assert Path.load(file).outcome == "reached"
    assert resumed[-1].energy.total == pytest.approx(reached(MODELS["held"])[-1].energy.total, rel=1e-8)


def assert_same_records_up_to(short: Path, long: Path) -> None:
    for a, b in zip(short.records, long.records, strict=False):
        assert np.array_equal(a.q, b.q)


def test_resuming_another_model_is_refused(tmp_path: FilePath) -> None:
    file = tmp_path / "run.bh"
    reached(MODELS["held"], file=file)
    before = file.read_bytes()
    for other in (
        FREE.fold("crease", to=1.3),
        Model(MESH, Sheet(E=4000.0, t=0.1), formulation="bars-and-hinges").fold("crease", to=1.2),
    ):
        with pytest.raises(PathFileError, match="another model"):
            trace(other, file=file, resume=True)
    assert file.read_bytes() == before


def test_errors_of_files(tmp_path: FilePath) -> None:
    """One line each, that names the file."""
    text = tmp_path / "notes.txt"
    text.write_text("not a data base, but long enough to be taken for one: " + "x" * 4096)
    empty = tmp_path / "empty.bh"
    empty.touch()
    other = tmp_path / "other.db"
    db = sqlite3.connect(other)
    db.execute("CREATE TABLE states (id INTEGER)")
    db.commit()
    db.close()
    whole = tmp_path / "whole.bh"
    reached(MODELS["held"], file=whole)
    half = tmp_path / "half.bh"
    half.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    wrong: dict[str, Callable[[], object]] = {
        "load missing": lambda: Path.load(tmp_path / "none.bh"),
        "load text": lambda: Path.load(text),
        "load empty": lambda: Path.load(empty),
        "load other": lambda: Path.load(other),
        "load half": lambda: Path.load(half)[-1],
        "load folder": lambda: Path.load(tmp_path),
        "resume missing": lambda: trace(MODELS["held"], file=tmp_path / "none.bh", resume=True),
        "resume text": lambda: trace(MODELS["held"], file=text, resume=True),
        "folder missing": lambda: trace(MODELS["held"], file=tmp_path / "nowhere" / "run.bh"),
        "save in no folder": lambda: Path.load(whole).save(tmp_path / "nowhere" / "run.bh"),
        "file is a folder": lambda: trace(MODELS["held"], file=tmp_path),
    }
    for name, act in wrong.items():
        with pytest.raises(PathFileError) as caught:
            act()
        assert "\n" not in str(caught.value), name
        assert str(tmp_path) in str(caught.value), name
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "empty.bh",
        "half.bh",
        "notes.txt",
        "other.db",
        "whole.bh",
    ]
    assert not tmp_path.with_name(tmp_path.name + ".part").exists()


@pytest.mark.parametrize(
    "damage",
    [
        "UPDATE meta SET value = '{' WHERE key = 'model'",
        "DELETE FROM arrays WHERE name = 'points'",
        "UPDATE states SET unknowns = x'0011'",
        "DELETE FROM meta WHERE key = 'provenance'",
        "DROP TABLE steps",
        "UPDATE meta SET value = replace(value, 'bars-and-hinges', 'wishes')",
        "UPDATE arrays SET shape = '[7]'",
        "UPDATE states SET cuts = 'no'",
    ],
)
def test_damaged_files(damage: str, tmp_path: FilePath) -> None:
    file = tmp_path / "run.bh"
    reached(MODELS["held"], file=file)
    db = sqlite3.connect(file)
    with db:
        db.execute(damage)
    db.close()
    with pytest.raises(PathFileError, match=r"run\.bh") as caught:
        Path.load(file)
    assert "\n" not in str(caught.value)


def test_a_model_that_cannot_be_solved_leaves_the_old_file(tmp_path: FilePath) -> None:
    file = tmp_path / "run.bh"
    path = reached(MODELS["held"], file=file)
    with pytest.raises(ModelError):
        trace(FREE.force("corner:inner-start", each=(0.0, 0.0, 1.0)), file=file)
    assert_same_records(path, Path.load(file))


# --------------------------------------------------------------------------------------- describing models


def described() -> dict[str, Model]:
    polyline = meshes.Polyline(np.array([[0.0, 5.0], [10.0, 5.5], [20.0, 5.0]]))
    odd = replace(
        meshes.structured(meshes.strip(20.0, 10.0, [5.0]), along=4),
        curves={"crease:crease": polyline},
        fold_angles={"crease": np.full(4, 0.3)},
        spans=None,
    )
    return {
        **MODELS,
        "all kinds": Model(odd, Sheet(E=4000, t=0.1, nu=0.3), formulation="bars-and-hinges")
        .support([0, 1], [[1.0, 2.0, 0.0]])
        .support("edge:start", "yz")
        .support("rigid-body")
        .crease("crease", stiffness=0.2, rest=3.0)
        .step(
            Fold("crease", rest=np.full(4, 2.9).tolist()),
            Force(np.array([3, 4]), total=np.array([1e-3, 0, 0])),  # type: ignore[arg-type]
        )
        .displace((5, 6), np.array([0.0, 0.0, 2.0]), 0.1),  # type: ignore[arg-type]
        "full annulus": Model(
            meshes.structured(meshes.full_annulus(20.0, 5.0), along=12), SHEET, formulation="bars-and-hinges"
        ).fold("all", by=0.1),
    }


@pytest.mark.parametrize("name", described())
def test_description_is_complete(name: str) -> None:
    """Through JSON and back: the same fingerprint; nothing is lost and nothing depends on the process."""
    model = described()[name]
    data, arrays = describe(model)
    back = rebuild(json.loads(json.dumps(data)), {key: value.copy() for key, value in arrays.items()})
    assert fingerprint(back) == fingerprint(model) == fingerprint(described()[name])
    assert len(back.steps) == len(model.steps)


def test_fingerprint_sees_every_change() -> None:
    base = several_steps()
    moved = MESH.points.copy()
    moved[3, 2] += 1e-13
    changed = [
        replace(base, sheet=Sheet(E=4000.0, t=0.127, nu=0.1)),
        replace(base, mesh=replace(MESH, points=moved)),
        replace(base, mesh=replace(MESH, folds={"crease": "valley"})),
        replace(base, supports=base.supports[:-1]),
        replace(base, steps=base.steps[:-1]),
        base.crease("crease", Lstar=31.0),
        base.moment("crease", 1e-5),
        replace(base, formulation="other"),
    ]
    prints = {fingerprint(model) for model in (base, *changed)}
    assert len(prints) == len(changed) + 1


def test_numpy_corner_indices() -> None:
    corners = {name: np.int64(node) for name, node in MESH.corners.items()}
    mesh = replace(MESH, corners=corners)  # type: ignore[arg-type]
    assert fingerprint(Model(mesh, SHEET, formulation="bars-and-hinges")) == fingerprint(FREE)


# --------------------------------------------------------------------------------------- states


@every
def test_energy_density_integrates_to_the_energies(name: str) -> None:
    for state in reached(MODELS[name]):
        areas = state.mesh.areas
        for kind in ("stretching", "bending", "folding"):
            total = getattr(state.energy, kind)
            assert float(areas @ state.energy_density[kind]) == pytest.approx(total, rel=1e-12, abs=1e-18)
            nodal = state.nodal_energy_density(kind)
            assert nodal.shape == (len(state.points),)
            lumped = np.bincount(state.mesh.triangles.ravel(), np.repeat(areas / 3.0, 3), len(nodal))
            assert float(lumped @ nodal) == pytest.approx(total, rel=1e-12, abs=1e-18)
            assert nodal.max() <= state.energy_density[kind].max() + 1e-18
            assert nodal.min() >= 0.0


def test_folding_energy_lies_at_the_crease() -> None:
    state = reached(MODELS["spring, supported"])[-1]
    hinges = MESH.topology.hinges[crease_hinges(MESH, "crease")]
    pairs = {frozenset(row[1:3]) for row in hinges.tolist()}
    at_crease = np.array(
        [any(frozenset(p) in pairs for p in ((a, b), (b, c), (c, a))) for a, b, c in MESH.triangles.tolist()]
    )
    density = state.energy_density["folding"]
    assert (density[at_crease] > 0.0).all()
    assert (density[~at_crease] == 0.0).all()
    law = D / 20.0
    lengths = np.linalg.norm(MESH.points[hinges[:, 2]] - MESH.points[hinges[:, 1]], axis=1)
    by_hand = 0.5 * law * float(lengths @ (state.dihedral("crease") - 1.2) ** 2)
    assert state.energy.folding == pytest.approx(by_hand, rel=1e-12)


def test_reactions_balance_the_forces() -> None:
    """Sum of forces and of moments over supports, prescribed displacements and dead loads; zero at free nodes."""
    model = CORNERS.step(
        Fold("crease", to=2.3),
        Force("edge:outer", each=(1e-4, -2e-4, 3e-4)),
        Displace("corner:outer-end", (1.0, 0.0, 2.0), 1.0),
    )
    for state in reached(model)[1:]:
        applied = np.zeros_like(state.points)
        applied[MESH.nodes("edge:outer")] = state.lam * np.array([1e-4, -2e-4, 3e-4])
        assert np.abs(state.reactions).max() > 1e-5
        total = state.reactions + applied
        assert np.abs(total.sum(axis=0)).max() < 1e-8
        assert np.abs(np.cross(state.points, total).sum(axis=0)).max() < 1e-6
        free = np.ones(len(state.points), dtype=bool)
        for place in ("corner:inner-start", "corner:outer-start", "corner:inner-end", "corner:outer-end"):
            free[MESH.corners[place]] = False
        assert np.abs(state.reactions[free]).max() == 0.0
        assert state.reaction("corner:inner-end")[:2] == pytest.approx([0.0, 0.0], abs=1e-14)
        pull = state.reaction("corner:outer-end")
        assert np.linalg.norm(np.cross(pull, [1.0, 0.0, 2.0])) < 1e-12  # only along the prescribed direction


def test_displacements_are_met() -> None:
    direction = np.array([1.0, 0.0, 2.0]) / math.sqrt(5.0)
    path = reached(CORNERS.displace("corner:outer-end", (1.0, 0.0, 2.0), 1.5).fold("crease", to=2.8))
    for state in path:
        u = state.displacement("corner:outer-end")[0]
        assert u @ direction == pytest.approx(1.5 * min(1.0, state.step + state.lam), abs=1e-12)
    assert state.displacement("corner:inner-start") == pytest.approx(np.zeros((1, 3)), abs=0.0)


def test_reaction_is_the_slope_of_the_energy() -> None:
    """Castigliano: the reaction at a displaced node is dU / du, by central differences over three paths."""

    def solved(by: float) -> bh.State:
        return reached(
            CORNERS.fold("crease", to=2.5).fold("crease", to=2.5)
            if by is None
            else CORNERS.step(Fold("crease", to=2.5), Displace("corner:outer-end", "z", by))
        )[-1]

    by, h = 0.8, 1e-3
    slope = (solved(by + h).energy.total - solved(by - h).energy.total) / (2.0 * h)
    assert solved(by).reaction("corner:outer-end")[2] == pytest.approx(slope, rel=1e-5)


def test_moment_of_a_held_crease_is_the_slope_of_the_energy() -> None:
    """dU / d(angle) = moment a length times the length of the crease."""
    h = 1e-4
    low, mid, high = (reached(FREE.fold("crease", to=2.0 + d))[-1] for d in (-h, 0.0, h))
    slope = (high.energy.total - low.energy.total) / (2.0 * h)
    edges = MESH.crease_edges("crease")
    lengths = np.linalg.norm(MESH.points[edges[:, 1]] - MESH.points[edges[:, 0]], axis=1)
    # U falls as the crease opens; the multiplier is the moment that the holder must add
    assert float(lengths @ mid.crease_moment("crease")) == pytest.approx(-slope, rel=1e-5)


def test_a_file_of_version_0_1_is_refused_in_one_line(tmp_path: FilePath) -> None:
    """Its steps were tuples that hid what ends them; the line says how to make it anew."""
    file = tmp_path / "old.bh"
    db = sqlite3.connect(file)
    db.executescript(
        """
        CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
        CREATE TABLE arrays (name TEXT PRIMARY KEY, dtype TEXT NOT NULL, shape TEXT NOT NULL, data BLOB NOT NULL);
        CREATE TABLE states (id INTEGER PRIMARY KEY, step INTEGER NOT NULL, lambda REAL NOT NULL);
        CREATE TABLE steps (step INTEGER PRIMARY KEY, outcome TEXT NOT NULL, reason TEXT NOT NULL);
        INSERT INTO meta VALUES ('model', '{"format": 1, "steps": [[{"kind": "fold", "crease": "a", "to": 1.2}]]}');
        INSERT INTO states VALUES (1, 0, 0.0);
        PRAGMA user_version = 2;
        """
    )
    db.close()
    before = file.read_bytes()
    uses: tuple[Callable[[], Path], ...] = (
        lambda: Path.load(file),
        lambda: trace(MODELS["held"], file=file, resume=True),
    )
    for use in uses:
        with pytest.raises(
            PathFileError, match=r"format 2, this one reads 3\); make it anew from its scene"
        ) as told:
            use()
        assert "\n" not in str(told.value)
        assert "old.bh" in str(told.value)
    assert file.read_bytes() == before


# --- loads that rounding hides -------------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
def test_loads_that_rounding_hides_are_told(formulation: str) -> None:
    """Ten thousand times smaller than what still is right to 1e-3."""
    model = replace(CORNERS, formulation=formulation)

    def pushed(force: float) -> Path:
        return trace(model.step(Force("corner:outer-end", total=(0.0, 0.0, force))))

    right, small, lost = pushed(1e-5), pushed(1e-10), pushed(1e-14)
    wanted = right[-1].energy.total / 1e-10
    assert small[-1].energy.total / 1e-20 == pytest.approx(wanted, rel=1e-3)
    assert lost[-1].energy.total / 1e-28 != pytest.approx(wanted, rel=1e-3)  # what there is to tell of
    told = [any("rounding hides" in line for line in path.remarks) for path in (right, small, lost)]
    assert told == [False, False, True]


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
@pytest.mark.parametrize("size", [1e-7, 1e-9, 1e-11])
def test_tiny_motions_are_solved(formulation: str, size: float) -> None:
    """Guesses that look balanced, since rounding hides their forces, were taken as they were: 25 times the energy."""
    model = replace(CORNERS, formulation=formulation)

    def energy(by: float) -> float:
        return trace(model.fold("crease", by=by, Lstar=25.0))[-1].energy.total / by**2

    assert energy(size) == pytest.approx(energy(1e-4), rel=1e-2)


def test_a_sheet_that_folds_without_forces_is_not_hidden_by_rounding() -> None:
    strip = meshes.structured(meshes.strip(40.0, 8.0, creases=[4.0]), along=4)
    path = trace(Model(strip, SHEET, formulation="bars-and-hinges").fold("all", by=1.0))
    assert path.reached
    assert path[-1].energy.total < 1e-12
    assert not any("rounding hides" in line for line in path.remarks)
