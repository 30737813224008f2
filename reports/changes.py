"""What became of the records since the last stored results."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from reports.figures import ReportError
from reports.records import Check, Results, read

PREVIOUS = "previous.json"
FOUND = ("rate", "error_bar", "finest")  # parameters that are results: they do not tell records apart
MOVED = 1e-6  # relative change from which a value counts as moved
MOST = 12  # moves that are listed


@dataclass(frozen=True)
class Changes:
    """Records that passed before and fail now, the other way round, and values that moved, the farthest first."""

    date: str
    broken: list[tuple[int, Check, Check]] = field(default_factory=list)  # number, before, now
    mended: list[tuple[int, Check, Check]] = field(default_factory=list)
    moved: list[tuple[int, Check, Check, float]] = field(default_factory=list)
    new: int = 0
    gone: int = 0
    same: int = 0
    unreadable: str = ""


def changes(folder: Path, results: Results) -> Changes | None:
    """Against the results that the last run replaced; None where there are none."""
    file = folder / PREVIOUS
    if not file.exists():
        return None
    try:
        before = read(file)
    except ReportError as error:
        return Changes("", unreadable=str(error))
    known = _by_key(before)
    found = Changes(before.date, gone=0)
    new = same = 0
    for key, (number, check) in _by_key(results).items():
        old = known.pop(key, None)
        if old is None:
            new += 1
            continue
        if old[1].passed and check.passed is False:
            found.broken.append((number, old[1], check))
        elif old[1].passed is False and check.passed:
            found.mended.append((number, old[1], check))
        move = _move(old[1].value, check.value)
        if move > MOVED:
            found.moved.append((number, old[1], check, move))
        else:
            same += 1
    found.moved.sort(key=lambda row: -row[3])
    return Changes(before.date, found.broken, found.mended, found.moved, new, len(known), same)


def _by_key(results: Results) -> dict[Any, tuple[int, Check]]:
    found: dict[Any, tuple[int, Check]] = {}
    for number, check in enumerate(results.checks, start=1):
        params = {key: value for key, value in check.params.items() if key not in FOUND}
        key = (check.case, check.quantity, check.source, json.dumps(params, sort_keys=True))
        twice = 0
        while (*key, twice) in found:
            twice += 1
        found[(*key, twice)] = (number, check)
    return found


def _move(before: float | None, now: float | None) -> float:
    if before is None or now is None:
        return 0.0 if before is now else math.inf
    largest = max(abs(before), abs(now))
    # errors that should be zero are rounding: a factor between two of them says nothing
    return 0.0 if largest < 1e-9 else abs(now - before) / largest
