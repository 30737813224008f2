"""What became of the records since the last release, the last stored results, and those kept with the project."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from reports.figures import ReportError
from reports.records import Check, Results, read
from verification.framework.release import RELEASE, Key, digest, keys
from verification.framework.run import RECORDS

PREVIOUS = "previous.json"
TIMES = ("s", "ms")
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


@dataclass(frozen=True)
class Release:
    """Changes since a release.

    Attributes:
        version: that was released.
        changes: of the cases that it had.
        cases: how many it had.
        later: cases of now that it had not.
    """

    version: str
    changes: Changes
    cases: int
    later: list[str]


def since_release(results: Results, file: Path = RELEASE) -> Release | None:
    """Against the records of the last release; None where there are none, or all cases were run with fewer points.

    Args:
        results: of this report.
        file: what the release has kept (`verification.framework.release`).
    """
    try:
        kept = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    whole = [i.name for i in results.cases if not (results.quick if i.quick is None else i.quick)]
    had = frozenset(name for name in whole if name in kept["cases"])
    if not had:
        return None
    known = {key: value for name in had for key, value in kept["cases"][name].items()}
    pairs: list[tuple[int, Check | None, Check]] = []
    for key, (number, check) in _by_key(results.checks).items():
        if check.case in had:
            old = known.pop(digest(key), None)
            # what tells a record is the same then and now; the error is not kept
            then = None if old is None else replace(check, value=old[0], passed=old[1], error=None)
            pairs.append((number, then, check))
    found = _sorted(kept["date"], pairs, gone=len(known))
    return Release(kept["version"], found, len(kept["cases"]), [name for name in whole if name not in had])


def _compared(
    date: str, before: Sequence[Check], results: Results, only: frozenset[str] | None = None
) -> Changes:
    """What became of the records `before`; of some cases only, where they are named."""
    known = _by_key(before)
    pairs: list[tuple[int, Check | None, Check]] = []
    for key, (number, check) in _by_key(results.checks).items():
        if only is None or check.case in only:
            old = known.pop(key, None)
            pairs.append((number, None if old is None else old[1], check))
    return _sorted(date, pairs, gone=len(known))


def _sorted(date: str, pairs: Sequence[tuple[int, Check | None, Check]], gone: int) -> Changes:
    """Changes of records, each with its number and what it was; times are measured anew and are no changes."""
    found = Changes(date, gone=gone)
    new = same = 0
    for number, old, check in pairs:
        if old is None:
            new += 1
            continue
        if old.passed and check.passed is False:
            found.broken.append((number, old, check))
        elif old.passed is False and check.passed:
            found.mended.append((number, old, check))
        move = 0.0 if check.unit in TIMES else _move(old.value, check.value)
        if move > MOVED:
            found.moved.append((number, old, check, move))
        else:
            same += 1
    found.moved.sort(key=lambda row: -row[3])
    return replace(found, new=new, same=same)


def _by_key(checks: Sequence[Check]) -> dict[Key, tuple[int, Check]]:
    plain = [
        {name: getattr(check, name) for name in ("case", "quantity", "source", "params")} for check in checks
    ]
    return {key: (n, check) for n, (key, check) in enumerate(zip(keys(plain), checks, strict=True), start=1)}


def _move(before: float | None, now: float | None) -> float:
    if before is None or now is None:
        return 0.0 if before is now else math.inf
    largest = max(abs(before), abs(now))
    # errors that should be zero are rounding: a factor between two of them says nothing
    return 0.0 if largest < 1e-9 else abs(now - before) / largest
