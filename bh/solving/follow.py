"""Follow the equilibrium of a model through its steps, to a file that a killed run goes on from."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import astuple, replace
from pathlib import Path as FilePath
from typing import TYPE_CHECKING

from bh.errors import ModelError, NotHeldError, PathFileError
from bh.formulations.observables import measure
from bh.loading.builder import load_steps
from bh.loading.load_step import same_until_here
from bh.model.compare import differing_keys, first_differing_step, in_words
from bh.model.model import Model
from bh.model.serialise import describe, fingerprint
from bh.paths.path import Path, new_file, rewritten
from bh.paths.record import Record, StepOutcome
from bh.paths.storage import PathFile
from bh.runtime.lock import only_writer
from bh.runtime.progress import ProgressMeter, meter
from bh.runtime.threads import one_blas_thread
from bh.solvers.automatic import Automatic
from bh.solvers.neighbours import look_around
from bh.solvers.newton import Newton
from bh.solvers.outcome import Outcome
from bh.solvers.points import LOAD, Increment, Point, point
from bh.solvers.system import Remembering, remembering
from bh.solvers.walk import Strategy, Walk, walk
from bh.solving.coarser import Coarser
from meshes.mesh import count

if TYPE_CHECKING:
    from bh.formulations.protocols import SheetSystem
    from bh.formulations.symmetry_reduction import Half
    from bh.loading.symmetry import Plane

HARD = 10  # iterations of an increment that found its state with difficulty


def follow(  # noqa: PLR0913 - the options of `bh.trace`, all by name
    model: Model,
    *,
    symmetry: Plane | None = None,
    progress: bool | ProgressMeter = False,
    strategy: Strategy | None = None,
    file: str | FilePath | None = None,
    resume: bool = False,
    after: Path | None = None,
    coarser: Path | None = None,
    neighbours: bool | None = None,
    begun: Path | None = None,
) -> Path:
    """Follow the equilibrium of a model on its own mesh through all its steps; arguments as of `bh.trace`.

    Args:
        model: sheet, supports and steps.
        symmetry: "x" or "y" to solve one half.
        progress: True for a line on stderr, or a meter.
        strategy: chooses increments.
        file: path file that every state is written to.
        resume: go on from what the file has.
        after: path whose end this one begins at.
        coarser: path of the same sheet and formulation on a coarser mesh (`bh.solving.coarser`).
        neighbours: whether to look for other stable states at the end of steps; None where there is reason to.
        begun: path of this model with states to go on from, also within a step.

    Returns:
        the path up to where it got.

    Raises:
        ModelError: the model cannot be solved as described.
        PathFileError: the file cannot be written, or is of another model.
    """
    strategy = strategy or Automatic()
    report = meter(progress)
    with nullcontext() if file is None else only_writer(FilePath(file)):
        if begun is not None:
            path, target = begun, None if file is None else rewritten(begun, FilePath(file))
        else:
            path, target = _opened(model, symmetry, file, resume, after)
        _walk(path, target, strategy, report, None if coarser is None else Coarser(coarser), neighbours)
    return path


def _walk(
    path: Path,
    target: PathFile | None,
    strategy: Strategy,
    report: ProgressMeter,
    coarser: Coarser | None,
    neighbours: bool | None,
) -> None:
    """Solve the steps that are left."""
    model = path.model
    try:
        for step in range(len(path.steps), len(model.steps)):
            with one_blas_thread():
                way = strategy if coarser is None else coarser.guiding(strategy, model.mesh, step)
                end, last = _run_step(path, step, way, report, target)
                if end.reached and step == len(model.steps) - 1:
                    end = _stable_end(path, strategy)
                if end.reached and neighbours is not False:
                    end = StepOutcome(end.outcome, _beside(path, step, bool(neighbours), last))
                del last  # its factor takes memory, which the next step may need
            path.steps.append(end)
            if target is not None:
                target.finish_step(step, *astuple(end))
            if not end.reached:
                break
    finally:
        report.close(path.outcome)
        if target is not None:
            target.close()


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
    path.system(0)  # a model that cannot be solved must not replace the file of one that was
    return path, new_file(path, FilePath(file))


def _run_step(
    path: Path, step: int, strategy: Strategy, report: ProgressMeter, target: PathFile | None
) -> tuple[StepOutcome, Increment | None]:
    """How a step ended, and its last increment; None where nothing was left to solve."""
    began = time.perf_counter()
    try:
        half = path.half(step)
        system = path.system(step) if half is None else half.system
    except NotHeldError as error:  # in a state that nobody knew before
        if not path.records:
            raise
        return StepOutcome(Outcome.MECHANISM, str(error)), None

    memory = system if isinstance(system, Remembering) and system.remembers else None

    def accept(record: Record) -> None:
        if memory is not None:
            memory.remember(memory.history_at(record.q, record.lam))
            record = replace(record, history=memory.history)
        record = record if half is None else record.of_whole(half)
        path.records.append(record)
        if target is not None:
            target.add(path.row(-1))

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
        recent = [record if half is None else record.of_half(half) for record in _recent(done)]
        history = _points(system, memory, done, recent)
        increment = done[-1].next_increment
        if (
            len(history) < 3 and step > 0 and not any(r.jumped for r in done)
        ):  # later steps do not store their start
            history.insert(0, origin)
    goal, tolerance = _goal(path, step, half)
    item: Increment | None = None
    for item in walk(Walk(system, strategy, tuple(history), increment, origin, goal, tolerance)):
        now = time.perf_counter()
        if not item.reached:
            return StepOutcome(item.outcome, item.note, item.iterations), item
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
    # a tangent made before the end was remembered is not that of the end
    return StepOutcome(Outcome.REACHED), item if memory is None else None


def _points(
    system: SheetSystem, memory: Remembering | None, done: list[Record], recent: list[Record]
) -> list[Point]:
    """The last records of a step as the run has seen them: each with what was remembered before it was accepted."""
    found = []
    for r, behind in zip(recent, [None, *done][len(done) - len(recent) :], strict=False):
        if memory is not None and behind is not None and behind.history is not None:
            memory.remember(behind.history)
        found.append(point(system, r.q, r.lam, r.mode, negative=r.negative))
    if memory is not None and done[-1].history is not None:
        memory.remember(done[-1].history)
    return found


def _beside(path: Path, step: int, asked: bool, item: Increment | None) -> str:
    """A clause on another stable state beside the end of a step, or an empty string.

    It is looked for where it is `asked`, where an increment of the path was cut or took many iterations, where it has
    jumped or passed a critical point, and where a mode hardly resists; the look's iterations are not the path's.
    """
    half = path.half(step)
    system = path.system(step) if half is None else half.system
    done = [record for record in path.records if record.step <= step]
    doubtful = asked or any(r.cuts or r.jumped or r.critical or r.iterations >= HARD for r in done)
    if not asked and path.model.hindered:
        return ""  # pushed states would have to find ways round all that presses, which takes longer than the path
    if item is not None:
        return look_around(system, item.point, doubtful, Newton(), item.factorised)
    record = done[-1] if half is None else done[-1].of_half(half)
    with remembering(system, record.history):
        here = point(system, record.q, record.lam, negative=record.negative)
        return look_around(system, here, doubtful, Newton())


def look_beside(path: Path, coarser: Path | None = None, *, asked: bool = False) -> None:
    """Look for other stable states beside the ends of steps that were followed with `neighbours=False`.

    Args:
        path: its reached steps are told what lies beside their ends, as `follow` does where there is reason to look.
        coarser: the same steps on a coarser mesh, where a look takes a fraction of the time; None to look on its own.
        asked: look beside every step.
    """
    on, where = (path, "") if coarser is None else (coarser, ", on the coarser mesh before this one")
    with one_blas_thread():
        for step, end in enumerate(path.steps):
            if end.reached and (seen := _beside(on, step, asked, None)):
                path.steps[step] = replace(end, reason=seen + where)


def _stable_end(path: Path, strategy: Strategy) -> StepOutcome:
    """The last step's outcome: "unstable" where the sheet would leave the end state.

    A strategy that was told to stay on such a branch (`at_bifurcation`), or knows no other, is taken at its word.
    """
    if getattr(strategy, "at_bifurcation", None) != "stable" or path.stable is not False:
        return StepOutcome(Outcome.REACHED)
    modes = count(path.records[-1].negative or 0, "negative mode")
    why = "" if path.half(len(path.steps)) is None else "; the whole sheet would leave the symmetry"
    return StepOutcome(Outcome.UNSTABLE, f"the end state is not stable ({modes}){why}")


def _goal(path: Path, step: int, half: Half | None) -> tuple[Callable[[Point], float] | None, float]:
    """What is zero where the step ends early, and to which tolerance; None if nothing ends it early."""
    until = path.model.steps[step].until
    if until is None:
        return None, 0.0

    def missed(at: Point) -> float:
        q = at.q if half is None else half.unknowns(at.q, at.lam)
        state = path.observe(step, q, at.lam)
        return measure(until, state) - until.value

    return missed, until.margin


def _recent(done: list[Record]) -> list[Record]:
    """Records that a resumed step needs: three since the last jump, and all of a run by arc length that goes on."""
    jumps = [index for index, record in enumerate(done) if record.jumped]
    arc = len(done)
    while arc > 0 and done[arc - 1].mode != LOAD:
        arc -= 1
    return done[max(arc - 3, jumps[-1] if jumps else 0, 0) :]


def _continued(after: Path, model: Model, symmetry: Plane | None) -> Path:
    """A path of `model` that begins with all that `after` has."""
    if not after.reached:
        raise ModelError(f"the path to go on from ended early ({after.outcome}); solve it first")
    if fingerprint(replace(model, steps=model.steps[: len(after.steps)])) != after.provenance["input"]:
        raise ModelError(
            "the path to go on from is of another model; add steps to its own: path.model.step(...)"
        )
    path = Path(model, symmetry=symmetry)
    path.take_over(after)
    return path


def _resume(model: Model, file: FilePath, symmetry: Plane | None) -> tuple[Path, PathFile]:
    path = Path.load(file)
    if path.provenance.get("input") != fingerprint(model):
        return _resume_before(path, _kept_steps(path, model, file), model, file, symmetry)
    path = _with_model(path, model, symmetry)
    target = PathFile.open(file)
    target.forget_failed_steps()
    path.steps = [step for step in path.steps if step.reached]
    return path, target


def check_resumable(file: FilePath, model: Model) -> int:
    """See that a path file has steps that a model can go on from.

    Args:
        file: the path file.
        model: to be solved.

    Returns:
        how many.

    Raises:
        PathFileError: it has none; one line that names what differs.
    """
    return _kept_steps(Path.load(file), model, file)


def _kept_steps(path: Path, model: Model, file: FilePath) -> int:
    """How many steps of a stored path are steps of the model, too.

    Raises:
        PathFileError: more than later steps differ, or no step is left to go on from; one line that names the keys.
    """
    data, arrays = describe(path.model)
    keys = differing_keys(json.loads(json.dumps(data)), arrays, model)
    first = first_differing_step(keys)
    done = sum(step.reached for step in path.steps)
    kept = min(first or 0, done)
    if kept > 0 and all(
        same_until_here(one, other)
        for one, other in zip(load_steps(path.model)[:kept], load_steps(model)[:kept], strict=True)
    ):
        return kept
    raise PathFileError(
        f"'{file}' holds another model: it differs in {in_words(keys)}; run with --force (without resume), or "
        "choose another output folder"
    )


def _resume_before(
    path: Path, kept: int, model: Model, file: FilePath, symmetry: Plane | None
) -> tuple[Path, PathFile]:
    """Go on from the last state of the first `kept` steps, in a file that holds these only."""
    fresh = Path(model, symmetry=symmetry)
    fresh.records = [record for record in path.records if record.step < kept]
    fresh.steps = path.steps[:kept]
    return fresh, rewritten(fresh, file)


def _with_model(path: Path, model: Model, symmetry: Plane | None) -> Path:
    other = Path(model, path.provenance, symmetry)
    other.records, other.steps = path.records, path.steps
    return other
