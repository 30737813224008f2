"""The equilibrium path of a model: solved, kept, saved, loaded and resumed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import closing
from dataclasses import astuple, replace
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError, NotReachedError
from bh.formulations.protocols import Formulation, SheetSystem
from bh.formulations.registry import checked_system, formulation, remarks
from bh.formulations.state import State
from bh.loading.builder import load_steps
from bh.loading.load_step import LoadStep, StepEnd, open_ends
from bh.model.model import Model
from bh.model.serialise import describe, rebuild
from bh.paths.advice import advice
from bh.paths.provenance import provenance_of
from bh.paths.record import Record, StepOutcome, check_rows, check_sizes, not_settled
from bh.paths.storage import CriticalRow, PathFile, StateRow, reading
from bh.paths.stored import line, mapping
from bh.runtime import viewer
from bh.solvers.outcome import Outcome
from bh.solvers.points import ARC, CriticalPoint
from bh.solvers.system import Limited, Remembering, Rounded, remembering
from meshes.mesh import count

if TYPE_CHECKING:
    from bh.formulations.symmetry_reduction import Half, Halves
    from bh.loading.symmetry import Plane
    from bh.paths.estimate import Accuracy

Array = NDArray[np.float64]
LARGE_STRAIN = 0.05  # of an edge; what is beyond gets a remark
# forces of rounding over the typical one and energy of rounding over that of the state, which together hide it (of 56
# sheets); a sheet that folds as a mechanism moves farther than tiny loads would
HIDDEN, NOISY, TINY = 0.3, 0.5, 1e-2


class Path:
    """The accepted states of a model, in order, and how each step ended.

    `path[i]` is the i-th `State` (read when asked for); `path[0]` is the state that the first step begins with.

    Attributes:
        accuracy: the estimate of its error (`bh.Accuracy`), where an accuracy or an estimate was asked for, else None.
    """

    def __init__(
        self, model: Model, provenance: dict[str, object] | None = None, symmetry: Plane | None = None
    ) -> None:
        """An empty path of a model.

        Args:
            model: the model; its formulation is looked up here.
            provenance: of a path that was stored; None makes it anew.
            symmetry: plane of a model that is solved by one half (`bh.loading.symmetry`), or None.

        Raises:
            ModelError: the model cannot be solved as described.
        """
        self.model = model
        self.provenance = provenance or provenance_of(model)
        self.records: list[Record] = []
        self.steps: list[StepOutcome] = []
        self.accuracy: Accuracy | None = None
        self._estimate_reason = ""
        self._formulation: Formulation[SheetSystem] = formulation(model.formulation)
        self._load_steps: tuple[LoadStep, ...] = load_steps(model)
        self._halves: Halves | None = None
        if symmetry is not None:
            from bh.formulations.symmetry_reduction import Halves

            self._halves = Halves(self._formulation, model, self._load_steps, symmetry)
        self._systems: dict[int, SheetSystem] = {}
        self._states: dict[int, State] = {}

    # ------------------------------------------------------------------------------- reading

    @property
    def outcome(self) -> Outcome:
        """Outcome.REACHED if every step was; else the outcome of the first step that was not."""
        for step in self.steps:
            if not step.reached:
                return step.outcome
        return Outcome.REACHED if len(self.steps) == len(self.model.steps) else Outcome.UNFINISHED

    @property
    def reached(self) -> bool:
        """Was every step reached?"""
        return self.outcome is Outcome.REACHED

    @property
    def reason(self) -> str:
        """Why the path ended early, or an empty string."""
        return next((step.reason for step in self.steps if not step.reached), "")

    @property
    def ended_early(self) -> bool:
        """Did a step end before its actuations were complete, so that the last state is not what was asked for?"""
        return any(not step.reached for step in self.steps)

    @property
    def early_end(self) -> str:
        """Outcome, place, reason and advice of a path that did not reach its end, one line; empty where it did."""
        if self.reached:
            return ""
        number = min(max(len(self.steps), 1), len(self.model.steps))
        last = self.records[-1] if self.records else None
        lam = last.lam if last is not None and last.step == number - 1 else 0.0
        reason = f" ({self.reason})" if self.reason else ""
        mend = advice(self.outcome, lam == 0.0 and bool(self.model.steps[number - 1].release))
        return (
            f"the path ended early, {self.outcome}, in step {number} of {len(self.model.steps)} at lambda {lam:.3g}"
            f"{reason}" + (f"; {mend}" if mend else "")
        )

    def require(self) -> Path:
        """The path itself, if every step was reached: `bh.trace(model).require()[-1]`.

        Raises:
            NotReachedError: one was not; reason and advice in one line.
        """
        if not self.reached:
            raise NotReachedError(self.early_end)
        return self

    @property
    def stable(self) -> bool | None:
        """Is the last state stable? None where that was not looked at."""
        self._look_at_whole()
        return self.records[-1].stable if self.records else None

    def _look_at_whole(self) -> None:
        """Of a sheet solved by halves, count the negative modes of the last state, symmetric or not, when asked."""
        if self._halves is not None and self.records and self.records[-1].negative is None:
            last = self.records[-1]
            self.records[-1] = replace(
                last, negative=self._halves.negative(self.system(last.step), last.q, last.lam)
            )
            self._states.pop(len(self.records) - 1, None)

    @property
    def critical_points(self) -> list[tuple[int, CriticalPoint]]:
        """(step, point) of every limit and bifurcation point that was passed, in order."""
        return [(record.step, point) for record in self.records for point in record.critical]

    @property
    def estimate_reason(self) -> str:
        """Why there is no estimate of the error, one line; empty where `accuracy` has one."""
        if self.accuracy is not None:
            ends = [note for note in self.accuracy.notes if note.startswith("ended")]
            known = math.isfinite(self.accuracy.estimate)
            return "" if known else (ends or ["fewer than three meshes could be solved"])[-1]
        return (
            self._estimate_reason
            or "none was asked for; bh.trace(..., estimate=True) solves a coarser mesh, too"
        )

    @estimate_reason.setter
    def estimate_reason(self, why: str) -> None:
        self._estimate_reason = why

    @property
    def remarks(self) -> list[str]:
        """What happened on the way that a reader of the last state should know, one line each."""
        found = []
        for step, passed in self.critical_points:
            found.append(f"step {step + 1}: {passed.kind} point passed at lambda {passed.lam:.6g}")
        arc = [record for record in self.records if record.note.startswith(ARC)]
        if arc:
            found.append(f"{count(len(arc), 'state')} found by arc length")
        found += [f"step {r.step + 1}: {r.note}" for r in self.records if r.telling]
        found += [
            f"step {n + 1}: {end.reason}" for n, end in enumerate(self.steps) if end.reached and end.reason
        ]
        if self.records:
            strain = float(np.abs(self[-1].strain).max())
            if strain > LARGE_STRAIN:
                found.append(f"strains reach {strain:.0%}: the law of the sheet is one of small strains")
            found += self._hidden() + not_settled(self.records, self.system)
        ends = [line for step in self._load_steps for line in open_ends(self.model.mesh, step)]
        found += dict.fromkeys(ends)
        if self.accuracy is not None:
            if not self.accuracy.met:
                found.append(f"the accuracy that was asked for is not met: {self.accuracy}")
            found += self.accuracy.notes
        self._look_at_whole()
        modes = self.records[-1].negative if self.records else None
        if modes:
            found.append(f"the last state is not stable ({count(modes, 'negative mode')})")
        return found + [f"{remark.code}: {remark}" for remark in remarks(self.model)]

    def _hidden(self) -> list[str]:
        """A line where the last state hardly moved, and rounding of the coordinates is as large as its forces."""
        last, mesh = self.records[-1], self.model.mesh
        if float(np.abs(self[-1].points - mesh.points).max()) > TINY * mesh.size:
            return []
        system = self.system(last.step)
        if not isinstance(system, Rounded):
            return []
        noise, energy = system.noise(last.q, last.lam), self[-1].energy.total
        if system.rounding(last.q, last.lam) < HIDDEN or noise < NOISY * energy:
            return []
        return [
            f"loads so small that rounding hides them (it makes an energy of {noise:.1g} N mm of {energy:.1g}): "
            "energy and shape of the last state may be wrong; solve it for larger loads and scale it down"
        ]

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
        """Number of unknowns of the last state."""
        return len(self.records[-1].q) if self.records else 0

    @property
    def lambdas(self) -> Array:
        """(states,) step + lambda of every state: 1.25 is a quarter of the second step."""
        return np.array([record.step + record.lam for record in self.records])

    def __repr__(self) -> str:
        """One line: "Path(reached, 6 states, 16 iterations, 1 of 1 step)"."""
        reached = sum(step.reached for step in self.steps)
        return (
            f"Path({self.outcome}, {count(len(self), 'state')}, {count(self.iterations, 'iteration')}, "
            f"{reached} of {count(len(self.model.steps), 'step')})"
        )

    def __len__(self) -> int:
        """Number of states."""
        return len(self.records)

    @overload
    def __getitem__(self, index: int) -> State: ...
    @overload
    def __getitem__(self, index: slice) -> list[State]: ...

    def __getitem__(self, index: int | slice) -> State | list[State]:
        """The state of an index, or a list of those of a slice; read when it is first asked for."""
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        index = range(len(self))[index]
        if index not in self._states:
            record = self.records[index]
            with remembering(self.system(record.step), record.history):
                self._states[index] = self.observe(record.step, record.q, record.lam, record.stable)
        ended = str(self.outcome) if index == len(self) - 1 and self.ended_early else ""
        if self._states[index].ended != ended:
            self._states[index] = replace(self._states[index], ended=ended)
        return self._states[index]

    def observe(self, step: int, q: Array, lam: float, stable: bool | None = None) -> State:
        """What is to be read from unknowns q (n,) of a step at `lam`; of the whole sheet where halves are solved.

        Args:
            step: number of the step, from 0.
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
            stable: what is known of it.
        """
        return self._formulation.observe(self.model, self.system(step), q, lam, step, stable)

    def take_over(self, other: Path) -> None:
        """Begin with all that a path of the same model with fewer steps has; its states are not read anew."""
        self.records, self.steps = list(other.records), list(other.steps)
        self._states = dict(other._states)

    def __iter__(self) -> Iterator[State]:
        """States in order."""
        return (self[i] for i in range(len(self)))

    def solved(self, index: int = -1) -> tuple[SheetSystem, Record]:
        """The system of the step that a state belongs to, and its record: what analyses of a state begin with.

        Returns:
            the system and the record.
        """
        record = self.records[range(len(self))[index]]
        system = self.system(record.step)
        if record.history is not None and isinstance(system, Remembering):
            system.remember(record.history)
        return system, record

    def plot(self, **options: Any) -> Any:
        """Show the last state as a picture; options of `bh.plotting.show`."""
        return viewer.show(self, **options)

    # ------------------------------------------------------------------------------- files

    def save(self, file: str | FilePath) -> None:
        """Write everything to one file; see `bh.paths.storage`. Replaces an older file of that name.

        Raises:
            PathFileError: the file cannot be written.
        """
        rewritten(self, FilePath(file)).close()
        self.save_accuracy(file)

    def save_accuracy(self, file: str | FilePath) -> None:
        """Write what is known of the error into the file of this path.

        Raises:
            PathFileError: there is no such file, or it cannot be written.
        """
        told = None if self.accuracy is None else self.accuracy.as_dict()
        with closing(PathFile.open(FilePath(file))) as target:
            target.note("accuracy", {"told": told, "reason": self._estimate_reason})

    def save_steps(self, file: str | FilePath) -> None:
        """Write how steps ended into the file of this path.

        Args:
            file: the path file.

        Raises:
            PathFileError: there is no such file, or it cannot be written.
        """
        with closing(PathFile.open(FilePath(file))) as target:
            for step, end in enumerate(self.steps):
                target.finish_step(step, *astuple(end))

    @classmethod
    def load(cls, file: str | FilePath) -> Path:
        """Read a saved path, also one of a run that was killed.

        Raises:
            PathFileError: no such file, or not a path file.
        """
        with closing(PathFile.open(FilePath(file))) as source, reading(FilePath(file)):
            meta = source.meta()
            path = cls(rebuild(mapping(meta["model"], "the model"), source.arrays()), meta["provenance"])
            rows = list(source.states())
            ends = source.steps()
            check_rows(path.model, path.provenance, rows, ends)
            path.records = [Record.of_row(row) for row in rows]
            path.steps = [
                StepOutcome(Outcome(end), reason, lost) for _, (end, reason, lost) in sorted(ends.items())
            ]
            error = meta.get("accuracy", {"told": None, "reason": ""})  # files of versions that had none
            if error["told"] is not None:
                from bh.paths.estimate import stored

                path.accuracy = stored(error["told"])
            path.estimate_reason = line(error["reason"], "reason")
        return path

    def row(self, index: int) -> StateRow:
        """A state as a path file stores it."""
        record = self.records[index]
        energy = self[index].energy
        critical = tuple(
            CriticalRow(record.step, c.kind, c.lam, c.error, c.negative, c.q, c.mode) for c in record.critical
        )
        return StateRow(
            record.step, record.lam, record.iterations, record.imbalance, record.negative, record.mode, record.jumped,
            record.wall_time_s, record.next_increment, (energy.stretching, energy.bending, energy.folding),
            record.note, record.cuts, record.q, self[index].points, critical, record.history,
        )  # fmt: skip

    def system(self, step: int) -> SheetSystem:
        """The system of a step, made when it is first needed; the step begins at the last state of the one before.

        Args:
            step: its index, from 0.

        Returns:
            the same system each time.

        Raises:
            ModelError: the formulation cannot take the step, or the model has contact and the formulation has none.
        """
        if step not in self._systems:
            before = self.model.steps[:step]
            if any(each.until is not None for each in before) or self._looks_back(step):
                self._load_steps = load_steps(self.model, self._ended(step))
            made = self._formulation.system(self.model, self._load_steps[step], self._start(step))
            if self.model.stops_itself and not isinstance(made, Limited):
                raise ModelError(
                    f"formulation '{self.model.formulation}' has no contact; take 'consistent', or contact = False"
                )
            check_sizes(self.records, step, made)
            self._systems[step] = checked_system(made, self.model.formulation)
        return self._systems[step]

    def half(self, step: int) -> Half | None:
        """The half that solves a step, or None where the whole sheet is solved."""
        if self._halves is None:
            return None
        return self._halves.of(step, self.system(step), self._start(step), self._ended(step))

    def _looks_back(self, step: int) -> bool:
        """Does what a step asks for depend on the state that it, or one before it, begins with?"""
        return any(each.looks_back for each in self.model.steps[: step + 1])

    def _start(self, step: int) -> State | None:
        """The state that a step begins at; None is the stress-free sheet."""
        last = max((i for i, r in enumerate(self.records) if r.step < step), default=None)
        return None if last is None else self[last]

    def _ended(self, before: int) -> dict[int, StepEnd]:
        """Ends of steps before `before`: where an `Until` ended them early, and the last where supports changed."""
        last = {record.step: index for index, record in enumerate(self.records) if record.step < before}
        found = {}
        for step, index in last.items():
            early = self.model.steps[step].until is not None and self.records[index].lam < 1.0
            if early or (step == before - 1 and self._looks_back(before)):
                state = self[index]
                found[step] = StepEnd(state.lam, state.points, state.dihedral_angles)
        return found


def new_file(path: Path, file: FilePath) -> PathFile:
    """An empty path file for a path, which replaces an older one.

    Args:
        path: whose model and provenance are written.
        file: place of the path file.
    """
    data, arrays = describe(path.model)
    return PathFile.create(file, {"model": data, "provenance": path.provenance}, arrays)


def rewritten(path: Path, file: FilePath) -> PathFile:
    """A new file, still open, that has all that a path has, in place of an older one.

    Args:
        path: whose states and ends of steps are written.
        file: place of the path file.
    """
    target = new_file(path, file)
    for index in range(len(path)):
        target.add(path.row(index))
    for step, end in enumerate(path.steps):
        target.finish_step(step, *astuple(end))
    return target
