"""Sweeps: the same values wherever and in whatever order points run; nothing finished is lost."""

from __future__ import annotations

import json
import random
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("xarray")
import bh.sweep
from bh.commands.cli import main
from bh.sweep.file import load_sweep
from bh.sweep.progress import duration, line

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "examples"


@pytest.fixture(autouse=True)
def tasks(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The module of tasks; spawned workers get this process's path."""
    monkeypatch.syspath_prepend(str(HERE))
    return import_module("sweep_tasks")


def same(one: Any, other: Any) -> bool:
    """Equal to the last bit but for what tells of the run."""
    rest = list(bh.sweep.ABOUT_RUN)
    one, other = one.drop_vars(rest), other.drop_vars(rest)
    return bool(
        list(one.variables) == list(other.variables)
        and all(one[n].dims == other[n].dims for n in one.variables)
        and all(one[n].values.tobytes() == other[n].values.tobytes() for n in one.variables)
    )


GRID = bh.sweep.grid({"x": [0.1, 0.2, 0.7, 1.3], "n": [2, 0, 1]})

# --- points -------------------------------------------------------------------------------------------------


def test_grid_runs_the_last_axis_fastest() -> None:
    points = bh.sweep.grid({"a": [1, 2], "b": ["x", "y", "z"]})
    assert points.shape == (2, 3)
    assert [points[i] for i in (0, 1, 3)] == [{"a": 1, "b": "x"}, {"a": 1, "b": "y"}, {"a": 2, "b": "x"}]


def test_csv_keeps_whole_numbers_and_words(tmp_path: Path) -> None:
    file = tmp_path / "points.csv"
    file.write_text("radius, along ,kind\n80,32,staggered\n1e2,48,mirrored\n")
    points = bh.sweep.read_csv(file)
    assert points[1] == {"radius": 100.0, "along": 48, "kind": "mirrored"}
    assert isinstance(points[1]["along"], int)


@pytest.mark.parametrize(
    ("axes", "told"),
    [
        ({}, "at least one"),
        ({"a": []}, "at least one"),
        ({"a": [1, 1]}, "twice"),
        ({"a": [1, "b"]}, "mixes"),
        ({"a": [float("nan")]}, "finite"),
        ({"a": [[1]]}, "no number"),
        ({c: range(1000) for c in "abc"}, "split"),
    ],
)
def test_bad_axes(axes: dict[str, Any], told: str) -> None:
    with pytest.raises(bh.sweep.SweepError, match=told):
        bh.sweep.grid(axes)


def test_bad_tables(tmp_path: Path) -> None:
    with pytest.raises(bh.sweep.SweepError, match="a 2, b 1"):
        bh.sweep.table({"a": [1, 2], "b": [1]})
    file = tmp_path / "points.csv"
    file.write_text("a,b\n1,2\n3\n")
    with pytest.raises(bh.sweep.SweepError, match="row 3 has 1"):
        bh.sweep.read_csv(file)
    with pytest.raises(bh.sweep.SweepError, match="cannot be read"):
        bh.sweep.read_csv(tmp_path / "none.csv")


# --- the same values everywhere -----------------------------------------------------------------------------


def test_same_bits_in_every_pool(tmp_path: Path, tasks: Any) -> None:
    """This process, threads, one and two processes in tasks of one and of five points, forwards and backwards."""
    here = bh.sweep.run(tasks.waves, GRID, tmp_path / "here.nc", pool=0)
    assert here["sine"].sel(x=0.7, n=1).item() == np.sin(0.7) / 3.0
    assert here["powers"].dims == ("x", "n", "powers_0")
    assert np.isnan(here["powers"].sel(x=0.2, n=0).values[1:]).all()
    assert here["word"].sel(x=1.3, n=2).item() == "at 1.3"
    with ThreadPoolExecutor(3) as threads:
        assert same(here, bh.sweep.run(tasks.waves, GRID, tmp_path / "threads.nc", pool=threads))
    assert same(here, bh.sweep.run(tasks.waves, GRID, tmp_path / "two.nc", pool=2, chunk=5))
    assert same(here, bh.sweep.load(tmp_path / "two.nc"))
    back = bh.sweep.grid({"x": GRID.values[0][::-1], "n": GRID.values[1]})
    turned = bh.sweep.run(tasks.waves, back, tmp_path / "back.nc", pool=0)
    assert turned["sine"].sortby("x").identical(here["sine"].sortby("x"))


def test_table_has_one_dimension(tmp_path: Path, tasks: Any) -> None:
    points = bh.sweep.table({"x": [0.5, 0.5, 0.25], "n": [1, 2, 0]})
    data = bh.sweep.run(
        tasks.waves, points, tmp_path / "t.nc", pool=0, labels={"sine": bh.sweep.Label("mm", "s")}
    )
    assert data["sine"].dims == ("point",)
    assert data["x"].values.tolist() == [0.5, 0.5, 0.25]
    assert bh.sweep.load(tmp_path / "t.nc")["sine"].attrs == {"units": "mm", "long_name": "s"}


def test_provenance(tmp_path: Path, tasks: Any) -> None:
    data = bh.sweep.run(tasks.waves, GRID, tmp_path / "p.nc", pool=0, attributes={"why": "a test"})
    assert data.attrs["task"] == "sweep_tasks.waves"
    assert data.attrs["why"] == "a test"
    assert json.loads(data.attrs["versions"])["numpy"] == np.__version__


@contextmanager
def cluster(tmp_path: Path) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A real scheduler and two real workers, as processes of their own: (address, scheduler)."""
    pytest.importorskip("distributed")
    told = tmp_path / "scheduler.json"
    log = (tmp_path / "log").open("w")
    module = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    worker = [sys.executable, "-m", "distributed.cli.dask_worker"]
    rest = {"stdout": log, "stderr": log, "env": {"PYTHONPATH": str(HERE), "PATH": "/usr/bin:/bin"}}
    quiet = ["--scheduler-file", str(told), "--no-dashboard"]
    started = [subprocess.Popen([*module, *quiet, "--port", "0"], **rest)]  # type: ignore[call-overload]
    try:
        for _ in range(2):
            started.append(
                subprocess.Popen([*worker, *quiet, "--nthreads", "1", "--no-nanny"], **rest)  # type: ignore[call-overload]
            )
        yield _address(told), started[0]
    finally:
        for process in started:
            process.kill()
            process.wait()
        log.close()


def test_dask_by_address(tmp_path: Path, tasks: Any) -> None:
    with cluster(tmp_path) as (address, _), closing(bh.sweep.Dask(address)) as pool:
        data = bh.sweep.run(tasks.waves, GRID, tmp_path / "dask.nc", pool=pool, chunk=2)
    assert same(data, bh.sweep.run(tasks.waves, GRID, tmp_path / "here.nc", pool=0))
    assert "" not in data["worker"].values.ravel().tolist()


def test_a_scheduler_that_goes_away(tmp_path: Path, tasks: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """One line, and what was finished is kept for another run."""
    monkeypatch.setattr("bh.sweep.runner.QUIET_S", 2.0)
    points, file = bh.sweep.grid({"x": list(range(300))}), tmp_path / "gone.nc"

    class Killer:
        def update(self, done: int, *_: Any) -> None:
            if done > 20:
                scheduler.kill()

        def close(self) -> None:
            return

    with (
        cluster(tmp_path) as (address, scheduler),
        closing(bh.sweep.Dask(address)) as pool,
        pytest.raises(bh.sweep.SweepError, match="kept") as told,
    ):
        bh.sweep.run(tasks.slow, points, file, pool=pool, progress=Killer())
    assert "\n" not in str(told.value)
    assert 20 < int((bh.sweep.partial(file)["outcome"] == "reached").sum()) < 300
    whole = bh.sweep.run(tasks.slow, points, tmp_path / "whole.nc", pool=0)
    assert same(whole, bh.sweep.run(tasks.slow, points, file, pool=0, resume=True))


def _address(file: Path) -> str:
    until = time.monotonic() + 60.0
    while time.monotonic() < until:
        if file.is_file() and file.read_text():
            return str(json.loads(file.read_text())["address"])
        time.sleep(0.1)
    raise AssertionError("the scheduler did not start")


def test_a_silent_scheduler_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """And no client was made, whose end can wait for ever for the start of another."""
    pytest.importorskip("distributed")
    monkeypatch.setattr("bh.sweep.pools.ANSWER_S", 0.5)
    monkeypatch.setattr("distributed.Client.__init__", lambda *_, **__: pytest.fail("a client was made"))
    with pytest.raises(bh.sweep.SweepError, match="does not answer") as told:
        bh.sweep.Dask("tcp://127.0.0.1:9")
    assert "\n" not in str(told.value)


# --- points that fail, workers that die, sweeps that are killed ---------------------------------------------


def test_a_failed_point_stops_nothing(tmp_path: Path, tasks: Any) -> None:
    data = bh.sweep.run(tasks.moody, bh.sweep.grid({"x": [1, 2, 3]}), tmp_path / "m.nc", pool=0)
    assert data["outcome"].values.tolist() == ["reached", "failed", "reached"]
    assert data["reason"].values[1] == "ZeroDivisionError: no value at two"
    assert data["inverse"].values.tolist()[::2] == [-1.0, 1.0]
    assert np.isnan(data["inverse"].values[1])


@pytest.mark.parametrize("chunk", [1, 4])
def test_a_dead_worker_is_replaced(tmp_path: Path, tasks: Any, chunk: int) -> None:
    points = bh.sweep.grid({"x": list(range(9))})
    task = tasks.Deadly(str(tmp_path), always=False)
    data = bh.sweep.run(task, points, tmp_path / "d.nc", pool=2, chunk=chunk)
    assert (data["outcome"] == "reached").all()
    assert data["double"].values.tolist() == [2.0 * i for i in range(9)]
    assert data["attempts"].values[3] > 1


def test_a_deadly_point_is_recorded(tmp_path: Path, tasks: Any) -> None:
    points = bh.sweep.grid({"x": list(range(9))})
    data = bh.sweep.run(
        tasks.Deadly(str(tmp_path), always=True), points, tmp_path / "d.nc", pool=2, retries=1
    )
    assert data["outcome"].values.tolist() == ["reached"] * 3 + ["died"] + ["reached"] * 5
    assert "died" in data["reason"].values[3]


def test_a_killed_sweep_goes_on(tmp_path: Path, tasks: Any) -> None:
    """Killed at random (SIGKILL) again and again; every point that was finished stays, the data set is the same."""
    whole = bh.sweep.run(tasks.slow, bh.sweep.grid({"x": list(range(150))}), tmp_path / "whole.nc", pool=0)
    file = tmp_path / "killed.nc"
    script = (
        f"import sys; sys.path.insert(0, {str(HERE)!r}); import bh.sweep, sweep_tasks, os\n"
        f"if __name__ == '__main__':\n    bh.sweep.run(sweep_tasks.slow, bh.sweep.grid({{'x': list(range(150))}}), "
        f"{str(file)!r}, pool=0, resume=os.path.exists({str(file)!r} + '.points'))\n"
    )
    rng, kept, kills = random.Random(4), 0, 0
    while not file.is_file():
        child = subprocess.Popen([sys.executable, "-c", script])
        if kills < 3:
            _wait_for_points(file, kept + rng.randrange(5, 30), child)
            child.send_signal(signal.SIGKILL)
            kills += 1
        child.wait()
        if kills < 3 or not file.is_file():
            now = int((bh.sweep.partial(file)["outcome"] == "reached").sum())
            assert kept < now < 150
            kept = now
    assert kills == 3
    assert same(whole, bh.sweep.load(file))
    assert not Path(f"{file}.points").exists()


def _wait_for_points(file: Path, count: int, child: subprocess.Popen[bytes]) -> None:
    journal = Path(f"{file}.points")
    while child.poll() is None:
        if journal.is_file():
            try:
                with closing(sqlite3.connect(f"file:{journal}?mode=ro", uri=True)) as db:
                    if db.execute("SELECT count(*) FROM points").fetchone()[0] >= count:
                        return
            except sqlite3.Error:
                pass
        time.sleep(0.01)


def test_no_going_on_with_another_sweep(tmp_path: Path, tasks: Any) -> None:
    with pytest.raises(bh.sweep.SweepError, match="to go on from"):
        bh.sweep.run(tasks.waves, GRID, tmp_path / "a.nc", pool=0, resume=True)
    bh.sweep.run(tasks.waves, GRID, tmp_path / "a.nc", pool=0)
    assert same(
        bh.sweep.run(tasks.waves, GRID, tmp_path / "a.nc", resume=True), bh.sweep.load(tmp_path / "a.nc")
    )
    with pytest.raises(bh.sweep.SweepError, match="another sweep"):
        bh.sweep.run(tasks.moody, GRID, tmp_path / "a.nc", pool=0, resume=True)


# --- scenes and the command ---------------------------------------------------------------------------------

SWEEP = """
scene = "{scene}"
[axes.angle]
key = "steps[0].fold.to"
start = 2.5
stop = 1.5
count = 2
unit = "rad"
[axes.width]
key = "pattern.width"
values = [10.0, 120.0]
[measure]
places = ["corner:inner-end"]
"""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("BH_ALLOW_OUTSIDE", "1")  # the scene is one of the examples
    place = tmp_path / "folds.toml"
    place.write_text(SWEEP.format(scene=(EXAMPLES / "appendix_b_a.toml").as_posix()))
    return place


def test_scene(file: Path, tmp_path: Path) -> None:
    import bh

    asked = load_sweep(file)
    data = bh.sweep.run(asked.task, asked.points, tmp_path / "s.nc", pool=0, labels=asked.labels)
    alone = bh.trace(asked.task.scene({"angle": 1.5, "width": 10.0}).model)
    at = data.sel(angle=1.5, width=10.0)
    assert at["energy_total"].item() == alone[-1].energy.total
    np.testing.assert_allclose(at["dihedral_crease"], 1.5, atol=1e-9)
    assert at["points_corner_inner_end"].shape == (1, 3)
    assert data["outcome"].sel(width=120.0).values.tolist() == ["refused"] * 2
    assert "reaches the centre" in data["reason"].sel(width=120.0).values[0]
    assert data["angle"].attrs["units"] == "rad"


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "pattern.width",
            "pattern.widht",
            "appendix_b_a.toml: unknown key pattern.widht = 10.0 (did you mean 'width'?)",
        ),
        (
            "pattern.width",
            "patern.width",
            "appendix_b_a.toml: unknown key patern = {...} (did you mean 'pattern'?)",
        ),
        ("pattern.width", "steps[7].fold.to", "parameter 'width': the scene has no 'steps[7].fold.to'"),
        ("[10.0, 120.0]", '["2furlong"]', 'appendix_b_a.toml: pattern.width = "2furlong" is no length'),
        ("corner:inner-end", "corner:nowhere", "the sheet has no place 'corner:nowhere'"),
        ("[measure]", "[measures]", "unknown key measures = {...} (did you mean 'measure'?)"),
    ],
)
def test_a_wrong_key_names_the_file(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, says: str
) -> None:
    file.write_text(file.read_text().replace(old, new))
    assert main(["sweep", str(file), "-o", str(tmp_path / "out.nc"), "-w", "0"]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"bh: {file}: {says}")
    assert error.count("\n") == 1


def test_command(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = tmp_path / "out.nc"
    assert main(["sweep", str(file), "-o", str(place), "-w", "0"]) == 1
    out, err = capsys.readouterr()
    assert "2 of 4 points reached" in out
    assert "2 points have no values (2 refused); the first: " in err
    assert "see 'reason' in" in err
    assert "4 of 4 points, 2 failed" in err
    assert main(["sweep", str(file), "-o", str(place), "-w", "0", "--dask-workers", "2"]) == 2


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("steps[0].fold.to", "steps[3].fold.to", "the scene has no 'steps[3].fold.to'"),
        ("steps[0].fold.to", "steps[0]fold", "not understood"),
        ("steps[0].fold.to", "steps[0].fold.too", "too"),
        ("pattern.width", "pattern.kind.deep", "the scene has no"),
        ("start = 2.5\n", "", "either values, or start, stop and count"),
        ("[axes.angle]", "[axis.angle]", "axis"),
        ("scene =", "model =", "model"),
        ("corner:inner-end", "corner:nowhere", "nowhere"),
    ],
)
def test_bad_sweep_files(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, told: str
) -> None:
    file.write_text(file.read_text().replace(old, new))
    assert main(["sweep", str(file), "-o", str(tmp_path / "bad.nc"), "-w", "0", "-q"]) == 2
    err = capsys.readouterr().err
    assert told in err
    assert err.count("\n") == 1


def test_progress_tells_rate_and_time_left() -> None:
    assert line(120, 400, 2, 60, 30.0) == "120 of 400 points, 2 failed, 2 a second, 2 min 20 s left"
    assert line(2, 10, 0, 2, 10.0) == "2 of 10 points, 5 s a point, 40 s left"
    assert [duration(s) for s in (9.4, 3600 * 3 + 300, 86400 * 2 + 4 * 3600)] == [
        "9 s",
        "3 h 5 min",
        "2 d 4 h",
    ]


# --- warm starts --------------------------------------------------------------------------------------------


def pinching(angles: Sequence[float]) -> tuple[Any, Any]:
    """A folded sector whose end angle is swept in small steps, on two widths."""
    keys = {"width": "pattern.width", "angle": "steps[0].fold.to"}
    task = bh.sweep.scene(EXAMPLES / "appendix_b_a.toml", keys, places=["corner:inner-end"])
    return task, bh.sweep.grid({"width": [9.0, 10.0], "angle": list(angles)})


def test_warm_starts_give_the_same_states(tmp_path: Path) -> None:
    """To a millionth of the sheet, in fewer iterations, and the same bits with other workers."""
    task, points = pinching(np.linspace(1.8, 1.5, 7).tolist())
    cold = bh.sweep.run(task, points, tmp_path / "cold.nc", pool=0)
    warm = bh.sweep.run(task, points, tmp_path / "warm.nc", pool=0, warm=True)
    assert (warm["outcome"] == "reached").all()
    assert int(warm["iterations"].sum()) < 0.6 * int(cold["iterations"].sum())
    place = "points_corner_inner_end"
    assert np.abs(warm[place].values - cold[place].values).max() < 1e-4
    np.testing.assert_allclose(warm["energy_total"], cold["energy_total"], rtol=1e-7)
    assert same(warm, bh.sweep.run(task, points, tmp_path / "two.nc", pool=2, warm=True))


def test_warm_starts_are_given_up_where_states_differ(monkeypatch: pytest.MonkeyPatch) -> None:
    """A line whose check fails is that of cold starts to the last bit."""
    from bh.sweep import warm

    task, points = pinching([1.8, 1.7, 1.6])
    models = [task.scene(points[i]).model for i in range(3)]
    monkeypatch.setattr(warm, "same", lambda *_: False)
    from bh.solving.trace import trace

    for path, model in zip(warm.line(models), models, strict=True):
        assert path[-1].points.tobytes() == trace(model)[-1].points.tobytes()


def test_warm_starts_need_a_scene(tmp_path: Path, tasks: Any) -> None:
    with pytest.raises(bh.sweep.SweepError, match="need a scene and a grid"):
        bh.sweep.run(tasks.waves, GRID, tmp_path / "w.nc", pool=0, warm=True)


# --- measures -----------------------------------------------------------------------------------------------

STRIP = """
[pattern]
kind = "strip"
length = 40.0
width = 20.0
creases = [10.0]
[sheet]
E = 4000.0
t = 0.2
[mesh]
along = 8
[[supports]]
at = "edge:start"
fix = "xyz"
clamp = true
[[steps]]
force = { at = "edge:end", total = [0.0, 0.0, 0.001] }
[[steps]]
force = { at = "edge:end", total = [0.0, 0.0, 0.003] }
"""
MEASURES = """
scene = "strip.toml"
[axes.t]
key = "sheet.t"
values = [0.2, 0.4]
[measure.values.tip]
observable = "displacement_z"
of = "edge:end"
[measure.values.further]
observable = "displacement_z"
of = "edge:end"
since = 0
[measure.values.first]
observable = "displacement_z"
of = "edge:end"
step = 0
[measure.values.held]
observable = "reaction_z"
of = "edge:start"
[measure.values.k]
observable = "stiffness_z"
of = "edge:end"
"""


@pytest.fixture
def measured(tmp_path: Path) -> Path:
    (tmp_path / "strip.toml").write_text(STRIP)
    (tmp_path / "m.toml").write_text(MEASURES)
    return tmp_path / "m.toml"


def test_any_observable_changes_forces_and_stiffness(measured: Path, tmp_path: Path) -> None:
    asked = load_sweep(measured)
    data = bh.sweep.run(asked.task, asked.points, tmp_path / "m.nc", pool=0, labels=asked.labels)
    np.testing.assert_allclose(data["held"], -0.003, rtol=1e-6)
    np.testing.assert_allclose(data["further"], data["tip"] - data["first"], rtol=1e-12)
    np.testing.assert_allclose(0.003 / data["tip"], data["k"], rtol=0.02)  # nearly linear
    assert data["k"][1] / data["k"][0] == pytest.approx(8.0, rel=0.02)  # with t^3
    assert data["k"].attrs["units"] == "N/mm"
    assert data["retried"].values.tolist() == [0, 0]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('"displacement_z"', '"displacment_z"', "displacement_z"),
        ("since = 0", "since = 1", "does not lie before"),
        ("step = 0", "step = 2", "no step"),
        ('of = "edge:end"\nsince', "since", "name the place"),
        ("[measure.values.k]", "[measure.values.energy_total]", "name of something else"),
    ],
)
def test_measures_that_no_scene_has(
    measured: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, told: str
) -> None:
    measured.write_text(measured.read_text().replace(old, new, 1))
    assert main(["sweep", str(measured), "-o", str(tmp_path / "bad.nc"), "-w", "0", "-q"]) == 2
    assert told in capsys.readouterr().err


def test_a_point_that_ends_early_is_retried_finer(measured: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first try is made to end at a limit point; the second one is the real one."""
    from bh.solvers.outcome import Outcome
    from bh.solving.trace import trace as solve
    from bh.sweep import scenes

    task = load_sweep(measured).task
    tried: list[Any] = []

    class Early:
        outcome, reached, reason, steps = Outcome.LIMIT_POINT, False, "the load turns back", (1,)
        records = (type("R", (), {"lam": 0.5}),)

    def first_fails(model: Any, **options: Any) -> Any:
        tried.append(options["strategy"])
        return Early() if len(tried) == 1 else solve(model, **options)

    monkeypatch.setattr(scenes, "trace", first_fails)
    found = task({"t": 0.2})
    assert tried == [None, scenes.FINER]
    assert found.values["retried"] == 1
    assert found.reason == "by finer increments, after limit-point at step 1, lambda 0.5"
