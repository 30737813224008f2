"""Sweeps: many points of one task, run anywhere, into one labelled data set. See docs/scaling.md.

    import bh.sweep
    axes = bh.sweep.grid({"radius": [80.0, 100.0, 120.0], "angle": [2.4, 2.0, 1.6]})
    keys = {"radius": "pattern.radius", "angle": "steps[0].fold.to"}
    data = bh.sweep.run(bh.sweep.scene("annulus.toml", keys), axes, "annulus.nc")

A script that does so with processes of its own must do it under `if __name__ == "__main__":`.
"""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict, Unpack

from bh.errors import PathFileError
from bh.paths.provenance import versions
from bh.runtime.lock import only_writer
from bh.sweep import runner
from bh.sweep.dataset import ABOUT_RUN, Label, dataset, load, save
from bh.sweep.journal import Journal, Meta
from bh.sweep.measures import Measure
from bh.sweep.points import Points, SweepError, grid, read_csv, table
from bh.sweep.pools import Dask, Given, Here, Local, Pool
from bh.sweep.progress import Bar, Silent
from bh.sweep.scenes import SceneTask
from bh.sweep.task import Finished, Measured, Task, identity

if TYPE_CHECKING:
    from xarray import Dataset

__all__ = [
    "ABOUT_RUN",
    "Batches",
    "Dask",
    "Finished",
    "Given",
    "Here",
    "Label",
    "Local",
    "Measure",
    "Measured",
    "Points",
    "SceneTask",
    "SweepError",
    "grid",
    "load",
    "partial",
    "read_csv",
    "run",
    "scene",
    "table",
]


class Batches(TypedDict, total=False):
    """How points are handed to workers.

    Attributes:
        chunk: points a worker does in one go, 1 by default; more where points take milliseconds on far machines.
        retries: how often a point in flight when workers died is tried again, 2 by default.
        warm: of a scene on a grid: each line along the last axis is one task, whose points begin at their neighbours'
            states where that is checked to give the same (`bh.sweep.warm`); bits are equal among warm runs only.
    """

    chunk: int
    retries: int
    warm: bool


@dataclass(frozen=True)
class _Batches:
    chunk: int = 1
    retries: int = 2
    warm: bool = False


def scene(
    file: str | Path,
    keys: Mapping[str, str | Sequence[str]],
    places: Sequence[str] = (),
    shape: bool = False,
    values: Sequence[Measure] = (),
) -> SceneTask:
    """The task of solving a scene file with some of its keys set; see `SceneTask`.

    Args:
        file: of the scene (TOML).
        keys: for every parameter the key or keys of the scene that take its value, such as
            "steps[0].fold.to".
        places: whose node positions are measured, such as "corner:inner-end".
        shape: also measure the positions of all nodes.
        values: numbers to read beside energies and angles, such as
            `Measure("tip", "displacement_z", "corner:inner-end", since=0)`.

    Raises:
        SweepError: the file cannot be read, or the scene has no such key.
    """
    try:
        text = Path(file).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise SweepError(f"the scene '{file}' cannot be read ({why}); check the name") from error
    every = {name: (key,) if isinstance(key, str) else tuple(key) for name, key in keys.items()}
    folder, name = Path(file).parent.resolve(), Path(file).name
    return SceneTask(text, every, folder, tuple(places), shape, values=tuple(values), name=name)


def run(
    task: Task,
    points: Points,
    file: str | Path,
    *,
    pool: Pool | Executor | int | None = None,
    resume: bool = False,
    progress: bool | runner.Meter = False,
    labels: Mapping[str, Label] | None = None,
    attributes: Mapping[str, object] | None = None,
    **batches: Unpack[Batches],
) -> Dataset:
    """Run a task at every point and write the data set `file` (netCDF-4).

    The values do not depend on the order of the points, on where they run or on how often the sweep was resumed: all
    variables but those of `ABOUT_RUN` are equal to the last bit.

    Args:
        task: called with the parameters of a point by name; must be picklable. Returns values by name, or a
            `Measured`.
        points: of `grid`, `table` or `read_csv`.
        file: of the data set; its journal is beside it.
        pool: a number of local processes (0: this process; None: one a core), any `concurrent.futures`
            executor, or a `bh.sweep.Dask`. Given executors and pools stay open.
        resume: go on from the journal `file`.points of a run that was interrupted or killed.
        progress: True for a bar with rate and time left, or an object that is told.
        labels: units and texts of parameters and values, beside those that the task knows.
        attributes: to be written to the data set beside its provenance.
        **batches: chunk, retries and warm, see `Batches`.

    Returns:
        The data set as it was written, see `bh.sweep.dataset.dataset`.

    Raises:
        SweepError: bad input, a place that cannot be written, workers that are gone; what is finished is
            kept.
    """
    file, batch = Path(file), _Batches(**batches)
    if batch.warm:
        if not isinstance(task, SceneTask) or not points.grid:
            raise SweepError("warm starts need a scene and a grid; leave warm out")
        task = replace(task, warm=True)
    began = time.time()
    meta = _meta(task, points, labels, attributes, began)
    if resume and file.is_file() and not _journal(file).is_file():
        before = load(file)
        if before.attrs.get("identity") != meta["identity"]:
            raise SweepError(f"'{file}' is of another sweep; choose another output with -o")
        return before
    check = getattr(task, "check", None)
    if check is not None:
        check([points[i] for i in sorted({0, len(points) // 2, len(points) - 1})])
    try:
        with only_writer(_journal(file)):
            return _run((task, points, file, meta), batch, pool, resume, progress)
    except PathFileError as error:
        raise SweepError(f"{error}; -o names another output") from error


def _run(
    what: tuple[Task, Points, Path, Meta],
    batch: _Batches,
    pool: Pool | Executor | int | None,
    resume: bool,
    progress: bool | runner.Meter,
) -> Dataset:
    """What `run` does where nobody else writes the journal."""
    task, points, file, meta = what
    chunk = len(points.values[-1]) if batch.warm else batch.chunk
    journal = _open(file, meta, resume)
    meter = (Bar() if progress else Silent()) if isinstance(progress, bool) else progress
    with closing(journal):
        todo = _todo(len(points), journal.done(), chunk, batch.warm)
        if todo:
            workers, ours = _pool(pool)
            try:
                count = runner.Count(len(points), journal.failed())
                runner.run(
                    task,
                    points.__getitem__,
                    todo,
                    journal,
                    workers,
                    meter,
                    count=count,
                    retries=batch.retries,
                )
            finally:
                meter.close()
                if ours:
                    workers.close()
        data = _dataset(journal)
    save(data, file)
    _journal(file).unlink()
    return data


def _todo(count: int, done: set[int], chunk: int, lines: bool) -> list[runner.Job]:
    """Jobs for the points that are not done; `lines` are whole or not there: a task is one transaction."""
    if not lines:
        return runner.jobs([i for i in range(count) if i not in done], chunk)
    return [
        runner.Job(tuple(range(i, i + chunk)))
        for i in range(0, count, chunk)
        if not done.issuperset(range(i, i + chunk))
    ]


def partial(file: str | Path) -> Dataset:
    """What there is of a data set: the finished file, or the points in its journal; open ones have the outcome "open".

    Raises:
        SweepError: there is neither.
    """
    file = Path(file)
    if not _journal(file).is_file():
        return load(file)
    with closing(Journal.open(_journal(file))) as journal:
        return _dataset(journal)


def _meta(
    task: Task,
    points: Points,
    labels: Mapping[str, Label] | None,
    attributes: Mapping[str, object] | None,
    began: float,
) -> Meta:
    from hashlib import sha256

    own: dict[str, Label] = getattr(task, "labelled", dict)()
    text = f"{identity(task)} {points.names} {points.values} {points.grid}"
    return {
        "identity": sha256(text.encode()).hexdigest(),
        "names": points.names,
        "values": points.values,
        "grid": points.grid,
        "labels": {name: (v.unit, v.about, v.dims) for name, v in (own | dict(labels or {})).items()},
        "attributes": {
            "task": identity(task),
            "versions": versions(),
            "began": datetime.fromtimestamp(began, UTC).isoformat(timespec="seconds"),
            "host": f"{platform.node()}, {platform.machine()}, {os.cpu_count()} cores",
            **({"scene": task.text} if isinstance(task, SceneTask) else {}),
            **dict(attributes or {}),
        },
    }


def _open(file: Path, meta: Meta, resume: bool) -> Journal:
    """The journal to write to: a new one, or that of a run which goes on."""
    place = _journal(file)
    if not (resume and place.is_file()):
        if resume and not file.is_file():
            raise SweepError(f"there is no '{place}' to go on from; run without --resume")
        return Journal.create(place, meta)
    journal = Journal.open(place)
    if journal.meta.get("identity") != meta["identity"]:
        journal.close()
        raise SweepError(f"'{place}' is of another sweep; run without --resume, or choose another output")
    return journal


def _dataset(journal: Journal) -> Dataset:
    meta = journal.meta
    try:
        points = Points(tuple(meta["names"]), tuple(tuple(v) for v in meta["values"]), meta["grid"])
        labels = {
            name: Label(unit, about, tuple(dims)) for name, (unit, about, dims) in meta["labels"].items()
        }
        attributes: dict[str, object] = {"identity": meta["identity"], **meta["attributes"]}
        return dataset(points, journal, labels, attributes)
    except (TypeError, ValueError, LookupError, AttributeError) as error:
        raise SweepError(f"'{journal.file}' is not a journal of a sweep ({error}); run it anew") from error


def _journal(file: Path) -> Path:
    return file.with_name(file.name + ".points")


def _pool(pool: Pool | Executor | int | None) -> tuple[Pool, bool]:
    """The pool that is asked for, and whether it was made here."""
    if pool is None:
        pool = os.cpu_count() or 1
    if isinstance(pool, int):
        return (Local(pool) if pool else Here()), True
    return (Given(pool) if isinstance(pool, Executor) else pool), False
