"""The equilibrium path of a model: solved, kept, saved, loaded and resumed."""

from __future__ import annotations

import platform
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import astuple, dataclass, replace
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from bh.describe import describe, fingerprint, rebuild
from bh.errors import ModelError, PathFileError
from bh.formulations import Formulation, formulation
from bh.halves import Halves
from bh.model import Model
from bh.program import StepProgram, open_ends, program
from bh.progress import ProgressMeter, meter
from bh.refinement import Goal
from bh.solvers.automatic import Automatic
from bh.solvers.increments import ARC, LOAD, CriticalPoint, point
from bh.solvers.trace import Strategy, Walk, walk
from bh.state import State
from bh.storage import CriticalRow, PathFile, StateRow, reading
from bh.symmetry import Plane
from bh.threads import one_blas_thread
from meshes.mesh import count

if TYPE_CHECKING:
    from bh.accuracy import Accuracy

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StepOutcome:
    """How one step ended: "reached", or why not, with one line of reason."""

    outcome: str
    reason: str = ""
    iterations: int = 0  # of the increment that failed


@dataclass(frozen=True, eq=False)
class Record:
    """One accepted state in the solver's terms; see `bh.solvers.increments.Increment`.

    `negative` counts the negative modes of the tangent, `mode` says how to go on from here, `jumped` that the state
    lies on another branch than the one before, `critical` holds the limit and bifurcation points passed before it.
    """

    step: int
    lam: float
    q: Array
    iterations: int
    imbalance: float
    wall_time_s: float
    next_increment: float
    negative: int | None = None
    mode: str = LOAD
    note: str = ""
    cuts: tuple[str, ...] = ()
    jumped: bool = False
    critical: tuple[CriticalPoint, ...] = ()

    @property
    def stable(self) -> bool | None:
        """True if no mode is negative, None where that was not looked at."""
        return None if self.negative is None else self.negative == 0


class Path:
    """The accepted states of a model, in order, and how each step ended.

    `path[i]` is the i-th `State` (read when asked for); `path[0]` is the state that the first step begins with.

    Attributes:
        accuracy: the estimate of its error, where an accuracy was asked for (`bh.accuracy.Accuracy`), else None.
    """

    def __init__(
        self, model: Model, provenance: dict[str, Any] | None = None, symmetry: Plane | None = None
    ) -> None:
        self.model = model
        self.provenance = provenance or _provenance(model)
        self.records: list[Record] = []
        self.steps: list[StepOutcome] = []
        self.accuracy: Accuracy | None = None
        self._formulation: Formulation = formulation(model.formulation)
        self._programs: tuple[StepProgram, ...] = program(model)
        self._halves = (
            None if symmetry is None else Halves(self._formulation, model, self._programs, symmetry)
        )
        self._systems: dict[int, Any] = {}
        self._states: dict[int, State] = {}

    # ------------------------------------------------------------------------------- reading

    @property
    def outcome(self) -> str:
        """ "reached" if every step was; else the outcome of the first step that was not."""
        for step in self.steps:
            if step.outcome != "reached":
                return step.outcome
        return "reached" if len(self.steps) == len(self.model.steps) else "unfinished"

    @property
    def reason(self) -> str:
        """Why the path ended early, or an empty string."""
        return next((step.reason for step in self.steps if step.outcome != "reached"), "")

    @property
    def stable(self) -> bool | None:
        """Is the last state stable? None where that was not looked at."""
        self._look_at_whole()
        return self.records[-1].stable if self.records else None

    def _look_at_whole(self) -> None:
        """Of a sheet solved by halves, count the negative modes of the last state, symmetric or not, when asked."""
        if self._halves is not None and self.records and self.records[-1].negative is None:
            last = self.records[-1]
            self.records[-1] = replace(last, negative=self._halves.negative(self._system(last.step), last))
            self._states.pop(len(self.records) - 1, None)

    @property
    def critical_points(self) -> list[tuple[int, CriticalPoint]]:
        """(step, point) of every limit and bifurcation point that was passed, in order."""
        return [(record.step, point) for record in self.records for point in record.critical]

    @property
    def remarks(self) -> list[str]:
        """What happened on the way that a reader of the last state should know, one line each."""
        found = []
        for step, passed in self.critical_points:
            found.append(f"step {step + 1}: {passed.kind} point passed at lambda {passed.lam:.6g}")
        arc = [record for record in self.records if record.note.startswith(ARC)]
        if arc:
            found.append(f"{count(len(arc), 'state')} found by arc length")
        found += [f"step {r.step + 1}: {r.note}" for r in self.records if r.jumped and r not in arc]
        ends = [line for step in self._programs for line in open_ends(self.model.mesh, step)]
        found += dict.fromkeys(ends)
        if self.accuracy is not None and not self.accuracy.met:
            found.append(f"the accuracy that was asked for is not met: {self.accuracy}")
        self._look_at_whole()
        modes = self.records[-1].negative if self.records else None
        if modes:
            found.append(f"the last state is not stable ({count(modes, 'negative mode')})")
        return found

    @property
    def iterations(self) -> int:
        """Iterations of all increments, the one that failed included."""
        return sum(record.iterations for record in self.records) + sum(end.iterations for end in self.steps)

    @property
    def wall_time_s(self) -> float:
        """Time spent in the solver, s."""
        return sum(record.wall_time_s for record in self.records)

    @property
    def unknowns(self) -> int:
        return len(self.records[-1].q) if self.records else 0

    @property
    def lambdas(self) -> Array:
        """(states,) step + lambda of every state: 1.25 is a quarter of the second step."""
        return np.array([record.step + record.lam for record in self.records])

    def __repr__(self) -> str:
        """One line: "Path(reached, 6 states, 16 iterations, 1 of 1 step)"."""
        reached = sum(step.outcome == "reached" for step in self.steps)
        return (
            f"Path({self.outcome}, {count(len(self), 'state')}, {count(self.iterations, 'iteration')}, "
            f"{reached} of {count(len(self.model.steps), 'step')})"
        )

    def __len__(self) -> int:
        return len(self.records)

    @overload
    def __getitem__(self, index: int) -> State: ...
    @overload
    def __getitem__(self, index: slice) -> list[State]: ...

    def __getitem__(self, index: int | slice) -> State | list[State]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        index = range(len(self))[index]
        if index not in self._states:
            record = self.records[index]
            self._states[index] = self._formulation.observe(
                self.model, self._system(record.step), record.q, record.lam, record.step, record.stable
            )
        return self._states[index]

    def __iter__(self) -> Iterator[State]:
        return (self[i] for i in range(len(self)))

    def solved(self, index: int = -1) -> tuple[Any, Record]:
        """The system of the step that a state belongs to, and its record: what analyses of a state begin with."""
        record = self.records[range(len(self))[index]]
        return self._system(record.step), record

    def plot(self, **options: Any) -> Any:
        """Show the last state as a picture; options of `bh.plotting.show`."""
        from bh.plotting import show

        return show(self[-1], **options)

    # ------------------------------------------------------------------------------- files

    def save(self, file: str | FilePath) -> None:
        """Write everything to one file; see `bh.storage`. Replaces an older file of that name.

        Raises:
            PathFileError: the file cannot be written.
        """
        target = _new_file(self, FilePath(file))
        for index, record in enumerate(self.records):
            target.add(self._row(index, record))
        for step, end in enumerate(self.steps):
            target.finish_step(step, *astuple(end))
        target.close()

    @classmethod
    def load(cls, file: str | FilePath) -> Path:
        """Read a saved path, also one of a run that was killed.

        Raises:
            PathFileError: no such file, or not a path file.
        """
        source = PathFile.open(FilePath(file))
        with closing(source), reading(FilePath(file)):
            meta = source.meta()
            path = cls(rebuild(meta["model"], source.arrays()), meta["provenance"])
            for row in source.states():
                path.records.append(_record(row))
            ends = source.steps()
            path.steps = [StepOutcome(*ends[step]) for step in sorted(ends)]
        return path

    def _row(self, index: int, record: Record) -> StateRow:
        energy = self[index].energy
        critical = tuple(
            CriticalRow(record.step, c.kind, c.lam, c.error, c.negative, c.q, c.mode) for c in record.critical
        )
        return StateRow(
            record.step, record.lam, record.iterations, record.imbalance, record.negative, record.mode, record.jumped,
            record.wall_time_s, record.next_increment, (energy.stretching, energy.bending, energy.folding),
            record.note, record.cuts, record.q, self[index].points, critical,
        )  # fmt: skip

    def _system(self, step: int) -> Any:
        """The system of a step, made when it is first needed; the step begins at the last state of the one before."""
        if step not in self._systems:
            self._systems[step] = self._formulation.system(
                self.model, self._programs[step], self._start(step)
            )
        return self._systems[step]

    def _start(self, step: int) -> State | None:
        """The state that a step begins at; None is the stress-free sheet."""
        last = max((i for i, r in enumerate(self.records) if r.step < step), default=None)
        return None if last is None else self[last]


def trace(
    model: Model,
    *,
    symmetry: Plane | None = None,
    progress: bool | ProgressMeter = False,
    strategy: Strategy | None = None,
    file: str | FilePath | None = None,
    resume: bool = False,
    accuracy: float | Goal | None = None,
) -> Path:
    """Follow the equilibrium of `model` through all its steps.

    Args:
        symmetry: "x", "y" or a normal [x, y, 0]: solve one half of a mirror-symmetric model (`bh.symmetry`). States are
            of the whole sheet; what leaves the symmetry is only looked for in the last state (`path.stable`).
        progress: True for a bar in the terminal, or an object that is told about every increment.
        strategy: how increments are chosen; the default suits all scenes.
        file: write every accepted state to this file before the next increment begins.
        resume: go on from the states in `file` (which must be of the same model) instead of starting anew.
        accuracy: wanted relative error of the energy, such as 0.02, or a `bh.Goal`. Formulation and mesh are then
            chosen (those of the model only say what the sheet is) and refined until an estimate of the error holds;
            see `bh.accuracy` and `path.accuracy`. The file is written when that is done.

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
        from bh.accuracy import trace_to

        return trace_to(
            model, accuracy, file, resume, progress=progress, strategy=strategy, symmetry=symmetry
        )
    strategy = strategy or Automatic()
    path = Path(model, symmetry=symmetry)
    target: PathFile | None = None
    if file is not None:
        if resume:
            path, target = _resume(model, FilePath(file), symmetry)
        else:
            path._system(0)  # a model that cannot be solved must not replace the file of one that was
            target = _new_file(path, FilePath(file))
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
    return path


def _run_step(
    path: Path, step: int, strategy: Strategy, report: ProgressMeter, target: PathFile | None
) -> StepOutcome:
    whole = path._system(step)
    halves = path._halves
    system = whole if halves is None else halves.system(step, path._start(step))
    began = time.perf_counter()

    def accept(record: Record) -> None:
        if halves is not None:
            record = halves.whole(step, whole, record)
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
        recent = _recent(done)
        if halves is not None:
            recent = [halves.part(step, whole, record) for record in recent]
        history = [point(system, r.q, r.lam, r.mode, negative=r.negative) for r in recent]
        increment = done[-1].next_increment
        if (
            len(history) < 3 and step > 0 and not any(r.jumped for r in done)
        ):  # later steps do not store their start
            history.insert(0, origin)
    for item in walk(Walk(system, strategy, tuple(history), increment, origin)):
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


def _recent(done: list[Record]) -> list[Record]:
    """Records that a resumed step needs: three since the last jump, and all of a run by arc length that goes on."""
    jumps = [index for index, record in enumerate(done) if record.jumped]
    arc = len(done)
    while arc > 0 and done[arc - 1].mode != LOAD:
        arc -= 1
    return done[max(arc - 3, jumps[-1] if jumps else 0, 0) :]


def _new_file(path: Path, file: FilePath) -> PathFile:
    data, arrays = describe(path.model)
    return PathFile.create(file, {"model": data, "provenance": path.provenance}, arrays)


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
    return other


def _record(row: StateRow) -> Record:
    return Record(
        row.step, row.lam, row.q, row.iterations, row.imbalance, row.wall_time_s, row.next_increment,
        negative=row.negative, mode=row.mode, note=row.note, cuts=row.cuts, jumped=row.jumped,
        critical=tuple(CriticalPoint(c.kind, c.lam, c.q, c.mode, c.negative, c.error) for c in row.critical),
    )  # fmt: skip


@lru_cache(maxsize=1)
def versions() -> dict[str, str]:
    """Versions of the project and of what its numbers depend on."""
    found = {"python": platform.python_version()}
    for name in ("curved-crease-workbench", "numpy", "scipy", "numba"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "unknown"
    return found


def _provenance(model: Model) -> dict[str, Any]:
    return {"input": fingerprint(model), "versions": versions(), "formulation": model.formulation}
