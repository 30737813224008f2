"""Checks, and the cases that make them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path as FilePath
from typing import Any, Protocol, SupportsFloat

from bh import Path
from bh.solvers.outcome import Outcome
from verification.framework.records import Record


class Solved(Protocol):
    """What a figure took: a solved path (`bh.Path`), or a `Cost` where it took something else than one path."""

    @property
    def unknowns(self) -> int | None:
        """Size of the system."""

    @property
    def iterations(self) -> int | None:
        """Newton iterations in all."""

    @property
    def wall_time_s(self) -> float | None:
        """Time, s."""

    @property
    def outcome(self) -> str:
        """How it ended; "reached" for the target."""


@dataclass(frozen=True)
class Cost:
    """What a figure took that is not read from one solved path; None for what is not known.

    Attributes:
        unknowns: size of the system.
        iterations: Newton iterations in all.
        wall_time_s: time, s.
        outcome: how it ended; "reached" for the target.
    """

    unknowns: int | None = None
    iterations: int | None = None
    wall_time_s: float | None = None
    outcome: str = Outcome.REACHED

    @classmethod
    def of(cls, path: Solved, *, wall_time_s: float | None = None, outcome: str | None = None) -> Cost:
        """What a path took, but for the time (s) or the outcome where they are given."""
        return cls(
            unknowns=path.unknowns,
            iterations=path.iterations,
            wall_time_s=path.wall_time_s if wall_time_s is None else wall_time_s,
            outcome=path.outcome if outcome is None else outcome,
        )


@dataclass(frozen=True, kw_only=True)
class Check(Record):
    """One figure of a case against its reference; `error` and `passed` follow from the others.

    A check with a tolerance is passed if the error is within it; one without is reported only (`passed` is None). What
    did not reach its target is not passed, whatever its value.
    """

    value: float
    error: float | None = field(init=False)
    passed: bool | None = field(init=False)

    def __post_init__(self) -> None:
        """Error and verdict follow from the figures."""
        object.__setattr__(self, "error", self._error())
        object.__setattr__(self, "passed", self._passed())

    def _error(self) -> float | None:
        if self.reference is None:
            return None
        scale = abs(self.reference) if self.reference != 0.0 else 1.0
        return abs(self.value - self.reference) / scale

    def _passed(self) -> bool | None:
        if self.outcome != Outcome.REACHED:
            return False
        if self.tolerance is None or self.error is None:
            return None
        return bool(math.isfinite(self.error) and self.error <= self.tolerance)

    def record(self) -> dict[str, Any]:
        """The record as plain JSON data, with the keys of `verification.framework.records.KEYS` in their order.

        What did not reach its target has an outcome and no value: nothing of it can enter a table as a figure.
        """
        data = asdict(self)
        if self.outcome != Outcome.REACHED:
            data["value"] = data["error"] = None
        if not math.isfinite(self.value):
            data["value"] = None
        return data


@dataclass
class CaseResult:
    """What a case found: checks, and what the report shows of it.

    Attributes:
        name: of the case, as `bh verify` takes it.
        title: a few words for the heading.
        question: what the case answers.
        source: what it is compared with; the source of every check that names none.
        checks: in the order of the report.
        notes: paragraphs below the figures.
        plots: see `plot`.
        pictures: {"file", "alt", "caption"} of files in the folder of the context.
        scenes: see `verification.framework.folded_frames.store`.
        wall_time_s: time of the whole case, s.
    """

    name: str
    title: str
    question: str
    source: str
    checks: list[Check] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    plots: list[dict[str, Any]] = field(default_factory=list)
    pictures: list[dict[str, Any]] = field(default_factory=list)
    scenes: list[dict[str, Any]] = field(default_factory=list)
    wall_time_s: float = 0.0

    def check(
        self,
        quantity: str,
        value: SupportsFloat,
        *,
        unit: str = "",
        reference: float | None = None,
        source: str | None = None,
        tolerance: float | None = None,
        params: Mapping[str, Any] | None = None,
        path: Solved | None = None,
    ) -> Check:
        """Add one figure to the checks of the case.

        Args:
            quantity: what was measured, in words.
            value: the figure, in `unit`; True and False count as 1 and 0.
            unit: "" for plain numbers.
            reference: what it should be, in `unit`; None where there is nothing to compare with.
            source: where the reference comes from; None for the source of the case.
            tolerance: largest error, relative or absolute to a zero reference, that passes; None only reports.
            params: what tells checks of the same quantity apart, as plain JSON data.
            path: the solved path that the value was read from, or what it took instead (`Cost`).

        Returns:
            the check, which is in `checks` already.
        """
        took = Cost() if path is None else path
        made = Check(
            case=self.name,
            quantity=quantity,
            params=dict(params or {}),
            value=float(value),
            unit=unit,
            reference=reference,
            source=self.source if source is None else source,
            tolerance=tolerance,
            unknowns=took.unknowns,
            iterations=took.iterations,
            wall_time_s=took.wall_time_s,
            outcome=took.outcome,
        )
        self.checks.append(made)
        return made

    @property
    def verdict(self) -> str:
        """One of "holds" (every check with a tolerance passed), "differs" (one did not), "reported" (none has one)."""
        judged = [check.passed for check in self.checks if check.passed is not None]
        if not judged:
            return "reported"
        return "holds" if all(judged) else "differs"

    def summary(self) -> dict[str, Any]:
        """What the case says of itself beside its checks, as plain JSON data."""
        keys = "name title question source notes plots pictures scenes wall_time_s"
        data = {key: getattr(self, key) for key in keys.split()}
        return {**data, "verdict": self.verdict}


@dataclass(frozen=True)
class Context:
    """What a case may use.

    Attributes:
        folder: where pictures and frames are written; it exists.
        quick: fewer points in every study.
        tell: called with a line of text for every stage.
    """

    folder: FilePath
    quick: bool
    tell: Callable[[str], None]


Case = Callable[[Context], CaseResult]


def reached_energy(path: Path) -> float:
    """Total energy of the last state, N mm; nan where the path did not reach its end: that is no value of a study."""
    return path[-1].energy.total if path.reached else math.nan


def line(label: str, x: list[float], y: list[float], style: str = "line") -> dict[str, Any]:
    """One series of a plot; style is "line", "points" or "reference"."""
    return {"label": label, "x": [float(v) for v in x], "y": [float(v) for v in y], "style": style}


def plot(
    name: str, title: str, x: str, y: str, series: list[dict[str, Any]], caption: str, log: str = ""
) -> dict[str, Any]:
    """A plot as data; `log` names the logarithmic axes ("x", "y", "xy")."""
    return {
        "id": name,
        "title": title,
        "kind": "line",
        "x": {"label": x, "log": "x" in log},
        "y": {"label": y, "log": "y" in log},
        "series": series,
        "caption": caption,
    }
