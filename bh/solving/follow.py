"""`trace`: follow the equilibrium of a model through its steps, to a file that a killed run goes on from."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import astuple, replace
from pathlib import Path as FilePath
from typing import TYPE_CHECKING

from bh.errors import ModelError, PathFileError
from bh.formulations.observables import until_of
from bh.model.model import Model
from bh.model.serialise import fingerprint
from bh.paths.path import Path, Record, StepOutcome, new_file
from bh.paths.storage import PathFile
from bh.runtime.progress import ProgressMeter, meter
from bh.runtime.threads import one_blas_thread
from bh.solvers.automatic import Automatic
from bh.solvers.increments import LOAD, Point, point
from bh.solvers.trace import Strategy, Walk, walk

if TYPE_CHECKING:
    from bh.formulations.symmetry_reduction import Half
    from bh.loading.symmetry import Plane
    from bh.model.refinement import Goal


def trace(
    model: Model,
    *,
    symmetry: Plane | None = None,
    progress: bool | ProgressMeter = False,
    strategy: Strategy | None = None,
    file: str | FilePath | None = None,
    resume: bool = False,
    accuracy: float | Goal | None = None,
    estimate: bool = False,
    after: Path | None = None,
) -> Path:
    """Follow the equilibrium of `model` through all its steps.

    Args:
        symmetry: "x", "y" or a normal [x, y, 0]: solve one half of a mirror-symmetric model (`bh.loading.symmetry`). States are
            of the whole sheet; what leaves the symmetry is only looked for in the last state (`path.stable`).
        progress: True for a bar in the terminal, or an object that is told about every increment.
        strategy: how increments are chosen; the default suits all scenes.
        file: write every accepted state to this file before the next increment begins.
        resume: go on from the states in `file` (which must be of the same model) instead of starting anew.
        accuracy: wanted relative error of the energy, such as 0.02, or a `bh.Goal`. Formulation and mesh are then
            chosen (those of the model only say what the sheet is) and refined until an estimate of the error holds;
            see `bh.solving.accuracy` and `path.accuracy`. With a file, every mesh has one of its own in a folder
            beside it (`path-levels` beside `path.bh`), and `resume` goes on from these.
        estimate: solve one coarser mesh, too, for an estimate of the error (`path.accuracy`), at about a quarter of the
            cost; where it cannot be had, `path.estimate_reason` says why.
        after: a solved path of the same model with fewer steps, whose states this one begins with.

    Returns:
        the path; `path.outcome` is "reached" only if every step was. A step that cannot go on ends the path with
        its reason and keeps everything up to there.

    Raises:
        ModelError: the model has no steps, or cannot be solved as described.
        PathFileError: the file cannot be written, or is of another model.
    """
    if not isinstance(model, Model):
        what = "give scene.model" if hasattr(model, "model") else "give a bh.Model"
        raise ModelError(f"trace takes a model, not a {type(model).__name__}; {what}")
    if not model.steps:
        raise ModelError("the model has no steps; add one, for example model.fold('crease', to=1.57)")
    if accuracy is not None:
        if after is not None or (resume and file is None):
            raise ModelError(
                "a run to a wanted accuracy begins anew on every mesh; leave out after, and resume it with its file"
            )
        return _to_accuracy(model, accuracy, symmetry, progress, strategy, file, resume)
    strategy = strategy or Automatic()
    path, target = _opened(model, symmetry, file, resume, after)
    report = meter(progress)
    try:
        for step in range(len(path.steps), len(model.steps)):
            with one_blas_thread():
                end = _run_step(path, step, strategy, report, target)
            path.steps.append(end)
            if target is not None:
                target.finish_step(step, *astuple(end))
            if end.outcome != "reached":
                break
    finally:
        report.close(path.outcome)
        if target is not None:
            target.close()
    if estimate and path.accuracy is None:
        from bh.solving.given_mesh import add_estimate

        add_estimate(path, progress=report, strategy=strategy, symmetry=symmetry)
        if file is not None:
            path.save_accuracy(file)
    return path


def _to_accuracy(
    model: Model,
    accuracy: float | Goal,
    symmetry: Plane | None,
    progress: bool | ProgressMeter,
    strategy: Strategy | None,
    file: str | FilePath | None,
    resume: bool,
) -> Path:
    from bh.solving.accuracy import Goal, solve
    from bh.solving.levels import Levels

    goal = accuracy if isinstance(accuracy, Goal) else Goal(accuracy)
    levels = None if file is None else Levels(file, resume)
    path = solve(model, goal, progress=progress, strategy=strategy, symmetry=symmetry, levels=levels)
    if file is not None:
        path.save(file)
    return path


def _opened(
    model: Model, symmetry: Plane | None, file: str | FilePath | None, resume: bool, after: Path | None
) -> tuple[Path, PathFile | None]:
    """The path to go on with, and its file."""
    path = Path(model, symmetry=symmetry) if after is None else _continued(after, model, symmetry)
    if file is None:
        return path, None
    if after is not None:
        raise ModelError("a path that goes on from another one cannot have a file; save it when it is solved")
    if resume:
        return _resume(model, FilePath(file), symmetry)
    path._system(0)  # a model that cannot be solved must not replace the file of one that was
    return path, new_file(path, FilePath(file))


def _run_step(
    path: Path, step: int, strategy: Strategy, report: ProgressMeter, target: PathFile | None
) -> StepOutcome:
    half = path._half(step)
    system = path._system(step) if half is None else half.system
    began = time.perf_counter()

    def accept(record: Record) -> None:
        record = record if half is None else half.whole(record)
        path.records.append(record)
        if target is not None:
            target.add(path._row(len(path.records) - 1, record))

    increment: float | None = None
    done = [record for record in path.records if record.step == step]
    origin = point(system, system.start(), 0.0)
    if not done:
        history = [origin]
        if step == 0:
            imbalance = system.evaluate(origin.q, 0.0).imbalance
            accept(
                Record(
                    0, 0.0, origin.q, 0, imbalance, time.perf_counter() - began, strategy.limits(system)[0]
                )
            )
            began = time.perf_counter()
    else:
        recent = [record if half is None else half.part(record) for record in _recent(done)]
        history = [point(system, r.q, r.lam, r.mode, negative=r.negative) for r in recent]
        increment = done[-1].next_increment
        if (
            len(history) < 3 and step > 0 and not any(r.jumped for r in done)
        ):  # later steps do not store their start
            history.insert(0, origin)
    goal, tolerance = _goal(path, step, half)
    for item in walk(Walk(system, strategy, tuple(history), increment, origin, goal, tolerance)):
        now = time.perf_counter()
        if item.outcome != "reached":
            return StepOutcome(item.outcome, item.note, item.iterations)
        at = item.point
        accept(
            Record(
                step, at.lam, at.q, item.iterations, item.imbalance, now - began, item.next_increment,
                negative=at.negative, mode=at.mode, note=item.note, cuts=item.cuts, jumped=item.jumped,
                critical=item.critical,
            )
        )  # fmt: skip
        report.update(step, len(path.model.steps), at.lam, item.iterations, at.energy)
        began = time.perf_counter()
    return StepOutcome("reached")


def _goal(path: Path, step: int, half: Half | None) -> tuple[Callable[[Point], float] | None, float]:
    """What is zero where the step ends early, and to which tolerance; None if nothing ends it early."""
    until = until_of(path.model.steps[step])
    if until is None:
        return None, 0.0

    def missed(at: Point) -> float:
        q = at.q if half is None else half.unknowns(at.q, at.lam)
        state = path._formulation.observe(path.model, path._system(step), q, at.lam, step)
        return until.measure(state) - until.value

    return missed, until.tolerance


def _recent(done: list[Record]) -> list[Record]:
    """Records that a resumed step needs: three since the last jump, and all of a run by arc length that goes on."""
    jumps = [index for index, record in enumerate(done) if record.jumped]
    arc = len(done)
    while arc > 0 and done[arc - 1].mode != LOAD:
        arc -= 1
    return done[max(arc - 3, jumps[-1] if jumps else 0, 0) :]


def _continued(after: Path, model: Model, symmetry: Plane | None) -> Path:
    """A path of `model` that begins with all that `after` has."""
    if after.outcome != "reached":
        raise ModelError(f"the path to go on from ended early ({after.outcome}); solve it first")
    if fingerprint(replace(model, steps=model.steps[: len(after.steps)])) != after.provenance["input"]:
        raise ModelError(
            "the path to go on from is of another model; add steps to its own: path.model.step(...)"
        )
    path = Path(model, symmetry=symmetry)
    path.records, path.steps = list(after.records), list(after.steps)
    path._states = dict(after._states)
    return path


def _resume(model: Model, file: FilePath, symmetry: Plane | None) -> tuple[Path, PathFile]:
    path = Path.load(file)
    if path.provenance.get("input") != fingerprint(model):
        raise PathFileError(
            f"'{file}' holds another model; run without --resume, or choose another output folder"
        )
    path = _with_model(path, model, symmetry)
    target = PathFile.open(file)
    target.forget_failed_steps()
    path.steps = [step for step in path.steps if step.outcome == "reached"]
    return path, target


def _with_model(path: Path, model: Model, symmetry: Plane | None) -> Path:
    other = Path(model, path.provenance, symmetry)
    other.records, other.steps = path.records, path.steps
    other.accuracy, other.estimate_reason = path.accuracy, path.estimate_reason
    return other
