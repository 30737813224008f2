"""Records of checks and the cases that make them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path as FilePath
from typing import Any

from bh import Path


@dataclass(frozen=True)
class Check:
    """One figure against its reference.

    `error` is relative to the reference (absolute where the reference is zero). A check with a tolerance is passed if
    the error is within it; one without is reported only (`passed` is None).
    """

    case: str
    quantity: str
    params: dict[str, Any]
    value: float
    unit: str
    reference: float | None
    source: str
    tolerance: float | None = None
    unknowns: int | None = None
    iterations: int | None = None
    wall_time_s: float | None = None
    outcome: str = "reached"

    @property
    def error(self) -> float | None:
        if self.reference is None:
            return None
        scale = abs(self.reference) if self.reference != 0.0 else 1.0
        return abs(self.value - self.reference) / scale

    @property
    def passed(self) -> bool | None:
        if self.outcome != "reached":
            return False
        if self.tolerance is None or self.error is None:
            return None
        return bool(math.isfinite(self.error) and self.error <= self.tolerance)

    def record(self) -> dict[str, Any]:
        """The record of DESIGN.md, section 2, as plain JSON data.

        What did not reach its target has an outcome and no value: nothing of it can enter a table as a figure.
        """
        data = asdict(self)
        data["error"], data["passed"] = self.error, self.passed
        if self.outcome != "reached":
            data["value"] = data["error"] = None
        if not math.isfinite(self.value):
            data["value"] = None
        return data


RECORD = {*Check.__dataclass_fields__, "error", "passed"}  # the keys of a record


@dataclass
class CaseResult:
    """What a case found: checks, and what the report shows of it."""

    name: str
    title: str
    question: str
    source: str
    checks: list[Check] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    plots: list[dict[str, Any]] = field(default_factory=list)
    pictures: list[dict[str, Any]] = field(default_factory=list)
    scenes: list[dict[str, Any]] = field(default_factory=list)  # see `folded_frames.store`
    wall_time_s: float = 0.0

    @property
    def verdict(self) -> str:
        """ "holds" if every check with a tolerance passed, "differs" if one did not, "reported" if none has one."""
        judged = [check.passed for check in self.checks if check.passed is not None]
        if not judged:
            return "reported"
        return "holds" if all(judged) else "differs"

    def summary(self) -> dict[str, Any]:
        told = "name title question source notes plots pictures scenes wall_time_s"
        data = {key: getattr(self, key) for key in told.split()}
        return {**data, "verdict": self.verdict}


@dataclass(frozen=True)
class Context:
    """What a case may use: a folder for pictures, whether to be quick, and a place to tell its progress."""

    folder: FilePath
    quick: bool
    tell: Callable[[str], None]


Case = Callable[[Context], CaseResult]


def reached_energy(path: Path) -> float:
    """Total energy of the last state, N mm; nan where the path did not reach its end: that is no value of a study."""
    return path[-1].energy.total if path.outcome == "reached" else math.nan


def cost_of(path: Path) -> dict[str, Any]:
    """What a solved path cost, as keyword arguments of `Check`."""
    return {"unknowns": path.unknowns, "iterations": path.iterations, "wall_time_s": path.wall_time_s}


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
