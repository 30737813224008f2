"""What a path keeps of every accepted state and of every step, in the solver's terms."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import PathFileError
from bh.model.model import Model
from bh.paths.storage import StateRow
from bh.paths.stored import line, mapping
from bh.solvers.lagging import SETTLED, Lagging
from bh.solvers.outcome import Critical, Outcome
from bh.solvers.points import ARC, LOAD, NOT_STABLE, CriticalPoint, Mode
from bh.solvers.system import Remembering, System
from meshes.mesh import count

if TYPE_CHECKING:
    from bh.formulations.symmetry_reduction import Half

Array = NDArray[np.float64]


def check_rows(
    model: Model,
    provenance: object,
    rows: Sequence[StateRow],
    ends: Mapping[int, tuple[str, str, int]],
) -> None:
    """See that what a path file holds is a path of its model.

    Args:
        model: of the path.
        provenance: of the path.
        rows: its states in order.
        ends: outcome, reason and iterations of the steps that ended.

    Raises:
        ValueError: it is not; one line.
    """
    told = mapping(provenance, "the provenance")
    line(told["input"], "the input")
    for version in mapping(told["versions"], "the versions").values():
        line(version, "a version")
    steps = [row.step for row in rows]
    if steps != sorted(steps) or (steps and not 0 <= steps[0] <= steps[-1] < len(model.steps)):
        raise ValueError("its states are of steps that its model has not")
    if sorted(ends) != list(range(len(ends))) or len(ends) > len(model.steps):
        raise ValueError("it tells of the end of steps that its model has not")
    if any(outcome == Outcome.REACHED and step not in steps for step, (outcome, *_) in ends.items()):
        raise ValueError("it has no state of a step that it calls reached")
    if any(row.points.shape != model.mesh.points.shape for row in rows):
        raise ValueError("its states have other nodes than its model")


@dataclass(frozen=True)
class StepOutcome:
    """How one step ended: "reached", with a clause on what lies beside it, or why not, with one line of reason."""

    outcome: Outcome
    reason: str = ""
    iterations: int = 0  # of the increment that failed

    @property
    def reached(self) -> bool:
        """Was the end of the step reached?"""
        return self.outcome is Outcome.REACHED


@dataclass(frozen=True, eq=False)
class Record:
    """One accepted state in the solver's terms; see `bh.solvers.points.Increment`.

    `negative` counts the negative modes of the tangent, `mode` says how to go on from here, `jumped` that the state
    lies on another branch than the one before, `critical` holds the limit and bifurcation points passed before it.
    `history` is what the system is to remember from here on, None where it remembers nothing
    (`bh.solvers.system.Remembering`).
    """

    step: int
    lam: float
    q: Array
    iterations: int
    imbalance: float
    wall_time_s: float
    next_increment: float
    negative: int | None = None
    mode: Mode = LOAD
    note: str = ""
    cuts: tuple[str, ...] = ()
    jumped: bool = False
    critical: tuple[CriticalPoint, ...] = ()
    history: Array | None = None

    @property
    def telling(self) -> bool:
        """Does its note tell more than how it was found: of a jump, or of an end that is not stable?"""
        return NOT_STABLE in self.note or (self.jumped and not self.note.startswith(ARC))

    @classmethod
    def of_row(cls, row: StateRow) -> Record:
        """The record that a path file has stored as a row."""
        return cls(
            row.step, row.lam, row.q, row.iterations, row.imbalance, row.wall_time_s, row.next_increment,
            negative=row.negative, mode=Mode(row.mode), note=row.note, cuts=row.cuts, jumped=row.jumped,
            critical=tuple(
                CriticalPoint(Critical(c.kind), c.lam, c.q, c.mode, c.negative, c.error) for c in row.critical
            ),
            history=row.history,
        )  # fmt: skip

    def of_whole(self, half: Half) -> Record:
        """This record of a half as one of the whole sheet; of stability it knows only where the half has none."""
        points = tuple(replace(c, q=half.unknowns(c.q, c.lam), mode=half.mode(c.mode)) for c in self.critical)
        return replace(
            self, q=half.unknowns(self.q, self.lam), negative=self.negative or None, critical=points
        )

    def of_half(self, half: Half) -> Record:
        """This record of the whole sheet as one of its half; critical points are left as they are."""
        return replace(self, q=half.part(self.q, self.lam))

    @property
    def stable(self) -> bool | None:
        """True if no mode is negative, None where that was not looked at."""
        return None if self.negative is None else self.negative == 0


def check_sizes(records: Sequence[Record], step: int, system: System) -> None:
    """See that records of a stored path are states of a system; compiled code takes what it is given.

    Args:
        records: of the path.
        step: whose records are looked at.
        system: of the step.

    Raises:
        PathFileError: unknowns, or what is remembered, are of another size.
    """
    for record in records:
        if record.step != step:
            continue
        passed = (len(array) for point in record.critical for array in (point.q, point.mode))
        fits = {len(record.q), *passed} == {system.size}
        if fits and record.history is not None:
            fits = isinstance(system, Remembering) and system.takes(record.history)
        if not fits:
            raise PathFileError(
                f"the path has states of another size than its model in step {step + 1}; solve it again"
            )


def not_settled(records: Sequence[Record], system: Callable[[int], System]) -> list[str]:
    """A line on every step with states whose friction still changed when they were accepted.

    Args:
        records: of a path.
        system: of a step, by its number.

    Returns:
        the lines, in the order of the steps; none where everything has settled.
    """
    lines = []
    for step in dict.fromkeys(record.step for record in records if record.history is not None):
        asked = system(step)
        if not (isinstance(asked, Lagging) and asked.lags):
            continue
        histories = [r.history for r in records if r.step == step and r.history is not None]
        left = [change for change in map(asked.unsettled, histories) if change > SETTLED]
        if left:
            lines.append(
                f"step {step + 1}: friction had not settled in {len(left)} of "
                f"{count(len(histories), 'state')}: its forces still change by up to {max(left):.2%}; "
                "take shorter increments"
            )
    return lines
