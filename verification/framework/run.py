"""Run verification cases and store what they found."""

from __future__ import annotations

import json
import math
import os
import platform
import shutil
import time
import warnings
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import as_completed
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bh.errors import NotReachedWarning
from bh.runtime.workers import Workers
from meshes.errors import InputError
from verification.framework.cases import BY_NAME, CASES, LONG_CASES, case, longest_first
from verification.framework.checks import CaseResult, Context
from verification.framework.environment import environment
from verification.framework.folder import refuse_links
from verification.framework.records import KEYS

OF_A_RUN = ("versions", "date", "machine", "quick")  # kept for every case, as cases may be run one by one
LATER = ("scenes",)  # lists that records of earlier versions have not
RECORDS = Path(__file__).parents[1] / "records"


def run(
    cases: Sequence[str] | None,
    folder: Path,
    quick: bool = False,
    report: Callable[[str], None] = lambda _text: None,
    jobs: int = 1,
) -> dict[str, Any]:
    """Run the named cases (all if None) and write `folder`/checks.json and the pictures, `jobs` cases at a time.

    The file keeps what it holds of other cases, each with the versions, the date, the machine and the `quick` of its
    own run; those at the top are of this run (`quick` if any case is).

    Returns the part of this run: {"checks": [...], "versions": {...}, "date", "machine", "quick", "cases": [...]}.

    Raises:
        InputError: an unknown case, or a folder that cannot be written.
    """
    names = list(dict.fromkeys(cases or CASES))
    for name in names:
        case(name)  # an unknown one is told before any is run
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot write the folder '{folder}' ({error.strerror}); choose another one"
        ) from error
    refuse_links(folder)
    file, run_by = folder / "checks.json", conditions(quick, jobs)
    found: list[CaseResult] = []
    merged: dict[str, Any] = {}
    with closing(_results(names, folder, quick, report, min(jobs, len(names)))) as results:
        for result in results:
            passed = sum(check.passed is True for check in result.checks)
            judged = sum(check.passed is not None for check in result.checks)
            report(
                f"{result.name}: {result.verdict}, {passed} of {judged} checks passed, {result.wall_time_s:.1f} s"
            )
            if not found:
                _keep(file, folder / "previous.json")
            found.append(result)
            found.sort(key=lambda result: names.index(result.name))
            # at once: what is finished outlives whatever happens to the other cases; in one line, which is quick
            merged = _merged(_known(file), record(found, run_by))
            write_json(file, merged, indent=None)
    write_json(file, merged)
    return record(found, run_by)


def _results(
    names: Sequence[str], folder: Path, quick: bool, report: Callable[[str], None], jobs: int
) -> Generator[CaseResult]:
    """What each case found, as it ends; by several processes if there are jobs for them."""
    if jobs <= 1:
        for name in names:
            yield _timed(name, Context(folder, quick, report))
        return
    report(f"{len(names)} cases, {jobs} at a time; each is told of when it has ended")
    with Workers(jobs) as pool:  # where one fails, or the user breaks off, all end
        for future in as_completed(
            [pool.submit(_silent, name, folder, quick) for name in longest_first(names)]
        ):
            yield future.result()


def _silent(name: str, folder: Path, quick: bool) -> CaseResult:
    """A case in a process of its own; what it tells on the way would mix with what others tell."""
    return _timed(name, Context(folder, quick, lambda _text: None))


def _timed(name: str, context: Context) -> CaseResult:
    began = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotReachedWarning)  # studies look at outcomes themselves
        result = case(name)(context)
    result.wall_time_s = time.perf_counter() - began
    return result


def _keep(file: Path, copy: Path) -> None:
    """Keep the results that are about to be replaced: the report says what changed."""
    if not file.is_file():
        return
    try:
        shutil.copyfile(file, copy)
    except OSError as error:
        raise InputError(f"cannot write '{copy}' ({error.strerror}); choose another folder") from error


def _known(file: Path) -> dict[str, Any]:
    """What an earlier run has left, and of long cases that it has not the run that is kept with the project."""
    known = _stored(file)
    for name in LONG_CASES:
        if all(info["name"] != name for info in known["cases"]):
            record = _stored(RECORDS / f"{name}.json")
            known = {key: known[key] + record[key] for key in known}
    return known


def conditions(quick: bool, jobs: int) -> dict[str, Any]:
    """What a run was made with, and when: versions, date, machine."""
    return {
        "versions": environment(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": {
            "system": platform.system(),
            "processor": platform.machine(),
            "cores": os.cpu_count(),
            "cases at a time": jobs,
        },
        "quick": quick,
    }


def record(found: Sequence[CaseResult], run_by: dict[str, Any]) -> dict[str, Any]:
    """What cases found, as files keep it; `run_by` as of `conditions`."""
    return {
        "checks": [check.record() for result in found for check in result.checks],
        **run_by,
        "cases": [{**result.summary(), **run_by} for result in found],
    }


def _stored(file: Path) -> dict[str, Any]:
    """What an earlier run has left of the cases that there still are; nothing if the file is missing or broken."""
    nothing: dict[str, Any] = {"checks": [], "cases": []}
    try:
        old = json.loads(file.read_text(encoding="utf-8"))
        of_the_run = {key: old[key] for key in OF_A_RUN}
        cases = [{**of_the_run, **dict(info)} for info in old["cases"] if info["name"] in BY_NAME]
        checks = [dict(check) for check in old["checks"] if check["case"] in BY_NAME]
    except (OSError, ValueError, RecursionError, KeyError, TypeError):
        return nothing
    summary = CaseResult("", "", "", "").summary()
    cases = [{**{key: list(summary[key]) for key in LATER}, **info} for info in cases]
    names = [info["name"] for info in cases]
    whole = (
        all(set(info) == {*summary, *OF_A_RUN} for info in cases)
        and all(set(check) >= set(KEYS) and check["case"] in names for check in checks)
        and len(set(names)) == len(names)
    )
    return {"checks": checks, "cases": cases} if whole else nothing


def _merged(old: dict[str, Any], new: dict[str, Any]) -> dict[str, Any]:
    """The new record with what the old one has of other cases, in the order of the cases."""
    ran = {info["name"] for info in new["cases"]}
    order = list(BY_NAME).index
    cases = [info for info in old["cases"] if info["name"] not in ran] + new["cases"]
    checks = [check for check in old["checks"] if check["case"] not in ran] + new["checks"]
    return {
        **new,
        "checks": sorted(checks, key=lambda check: order(check["case"]) if check["case"] in BY_NAME else -1),
        "quick": any(info["quick"] for info in cases),
        "cases": sorted(cases, key=lambda info: order(info["name"])),
    }


def write_json(file: Path, data: Any, indent: int | None = 1) -> None:
    """Write JSON so that a reader sees either the old file or the whole new one.

    Args:
        file: to write.
        data: plain; numbers that are not finite become null.
        indent: spaces a level; None for one line, which takes a fifth of the time.

    Raises:
        InputError: the file cannot be written.
    """
    draft = file.with_name(file.name + ".part")
    try:
        draft.write_text(json.dumps(_finite(data), indent=indent, allow_nan=False) + "\n", encoding="utf-8")
        draft.replace(file)
    except OSError as error:
        raise InputError(f"cannot write '{file}' ({error.strerror}); choose another place") from error


def _finite(data: Any) -> Any:
    """The data with null for every number that is not finite; JSON has no other word for it."""
    if isinstance(data, dict):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    if isinstance(data, float) and not math.isfinite(data):
        return None
    return data
