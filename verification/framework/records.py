"""The record of a check, as `checks.json` keeps it: the one place that says which figures a record has.

`verification.framework.checks.Check` is a record that a case makes; `reports.records.Check` one that the report reads,
and the JSON schema that is written beside the results follows from it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Record:
    """One figure against its reference; the order of the fields is the order in the file.

    Attributes:
        case: name of the case that made it.
        quantity: what was measured, in words.
        params: what tells records of the same quantity apart, as plain JSON data.
        value: the figure, in `unit`; None where the solve did not reach its target or the figure is not finite.
        unit: "" for plain numbers.
        reference: what it should be, in `unit`; None where there is nothing to compare with.
        source: where the reference comes from.
        tolerance: largest `error` with which the check is passed; None where it is only reported.
        unknowns: size of the system that was solved.
        iterations: Newton iterations of the whole path.
        wall_time_s: time of the solve, s.
        outcome: how the solved path ended; "reached" for the target.
        error: |value - reference| over |reference|, absolute where the reference is zero.
        passed: whether the error is within the tolerance; None where there is no tolerance.
    """

    case: str
    quantity: str
    params: dict[str, Any] = field(default_factory=dict)
    value: float | None
    unit: str = ""
    reference: float | None = None
    source: str | None = None
    tolerance: float | None = None
    unknowns: float | None = None
    iterations: float | None = None
    wall_time_s: float | None = None
    outcome: str = "reached"
    error: float | None = None
    passed: bool | None


KEYS = tuple(item.name for item in fields(Record))
