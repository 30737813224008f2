"""What became of the records since the last stored results, and since those that are kept with the project."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from reports.figures import ReportError
from reports.records import Check, Results, read
from verification.framework.run import RECORDS

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
    return _compared(before.date, before.checks, results)


def since_kept(results: Results, records: Path = RECORDS) -> tuple[Changes, list[str]] | None:
    """Against the records that are kept with the project, which a release makes anew, of the cases that were run since.

    Args:
        results: of this report.
        records: folder of the kept ones, a file a case.

    Returns:
        the changes and the names of the cases; None where no case that has a record was run anew.
    """
    ran = {info.name: info for info in results.cases if not info.quick}
    checks: list[Check] = []
    names: list[str] = []
    dates: list[str] = []
    for file in sorted(records.glob("*.json")):
        try:
            kept = read(file)
        except ReportError as error:
            return Changes("", unreadable=str(error)), []
        for info in kept.cases:
            now = ran.get(info.name)
            if now is None or (now.date, now.versions) == (info.date, info.versions):
                continue
            names.append(info.name)
            dates.append(info.date or "")
            checks += [check for check in kept.checks if check.case == info.name]
    if not names:
        return None
    return _compared(min(dates), checks, results, frozenset(names)), names


def _compared(
    date: str, before: Sequence[Check], results: Results, only: frozenset[str] | None = None
) -> Changes:
    """What became of the records `before`; of some cases only, where they are named."""
    known = _by_key(before)
    found = Changes(date, gone=0)
    new = same = 0
    for key, (number, check) in _by_key(results.checks).items():
        if only is not None and check.case not in only:
            continue
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
    return Changes(date, found.broken, found.mended, found.moved, new, len(known), same)


def _by_key(checks: Sequence[Check]) -> dict[Any, tuple[int, Check]]:
    found: dict[Any, tuple[int, Check]] = {}
    for number, check in enumerate(checks, start=1):
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
