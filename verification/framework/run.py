"""Run verification cases and store what they found."""

from __future__ import annotations

import json
import math
import multiprocessing
import os
import platform
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from meshes.errors import InputError
from verification.framework.cases import BY_NAME, CASES, LONG_CASES, case
from verification.framework.checks import RECORD, CaseResult, Context
from verification.framework.environment import environment

OF_A_RUN = ("versions", "date", "machine", "quick")  # kept for every case, as cases may be run one by one
LATER = ("scenes",)  # lists that records of earlier versions have not
RECORDS = Path(__file__).parents[1] / "records"


def run(
    cases: Sequence[str] | None,
    folder: Path,
    quick: bool = False,
    report: Callable[[str], None] = lambda text: None,
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
    found = []
    for result in _results(names, folder, quick, report, min(jobs, len(names))):
        passed = sum(check.passed is True for check in result.checks)
        judged = sum(check.passed is not None for check in result.checks)
        report(
            f"{result.name}: {result.verdict}, {passed} of {judged} checks passed, {result.wall_time_s:.1f} s"
        )
        found.append(result)
    found.sort(key=lambda result: names.index(result.name))
    data = _record(found, quick, jobs)
    merged = _merged(_known(folder / "checks.json"), data)
    _keep(folder / "checks.json", folder / "previous.json")
    write_json(folder / "checks.json", merged)
    return data


def _results(
    names: Sequence[str], folder: Path, quick: bool, report: Callable[[str], None], jobs: int
) -> Iterator[CaseResult]:
    """What each case found, as it ends; by several processes if there are jobs for them."""
    if jobs <= 1:
        for name in names:
            yield _timed(name, Context(folder, quick, report))
        return
    report(f"{len(names)} cases, {jobs} at a time; each is told of when it has ended")
    # fresh processes: forked ones would share what libraries of threads hold
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=context) as pool:
        futures = [pool.submit(_silent, name, folder, quick) for name in names]
        try:
            for future in as_completed(futures):
                yield future.result()
        except BaseException:  # one failed, or the user broke off: what has not begun is not begun
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _silent(name: str, folder: Path, quick: bool) -> CaseResult:
    """A case in a process of its own; what it tells on the way would mix with what others tell."""
    return _timed(name, Context(folder, quick, lambda text: None))


def _timed(name: str, context: Context) -> CaseResult:
    began = time.perf_counter()
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


def _record(found: Sequence[CaseResult], quick: bool, jobs: int) -> dict[str, Any]:
    run_by = {
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
        and all(set(check) >= RECORD and check["case"] in names for check in checks)
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


def write_json(file: Path, data: Any) -> None:
    """Write JSON so that a reader sees either the old file or the whole new one.

    Raises:
        InputError: the file cannot be written.
    """
    draft = file.with_name(file.name + ".part")
    try:
        draft.write_text(json.dumps(_finite(data), indent=1, allow_nan=False) + "\n", encoding="utf-8")
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
