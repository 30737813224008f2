"""Run verification cases and store what they found."""

from __future__ import annotations

import json
import math
import os
import platform
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bh.path import versions
from meshes.errors import InputError
from verification.cases import CASES, case
from verification.checks import Context


def run(
    cases: Sequence[str] | None,
    folder: Path,
    quick: bool = False,
    report: Callable[[str], None] = lambda text: None,
) -> dict[str, Any]:
    """Run the named cases (all if None) and write `folder`/checks.json and the pictures.

    Returns what was written: {"checks": [...], "versions": {...}, "date", "machine", "cases": [...]}.

    Raises:
        InputError: an unknown case, or a folder that cannot be written.
    """
    functions = {name: case(name) for name in (cases or CASES)}
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot write the folder '{folder}' ({error.strerror}); choose another one"
        ) from error
    context = Context(folder, quick, report)
    found = []
    for name, function in functions.items():
        began = time.perf_counter()
        result = function(context)
        result.wall_time_s = time.perf_counter() - began
        passed = sum(check.passed is True for check in result.checks)
        judged = sum(check.passed is not None for check in result.checks)
        report(f"{name}: {result.verdict}, {passed} of {judged} checks passed, {result.wall_time_s:.1f} s")
        found.append(result)
    data = {
        "checks": [check.record() for result in found for check in result.checks],
        "versions": versions(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": {
            "system": platform.system(),
            "processor": platform.machine(),
            "cores": os.cpu_count(),
        },
        "quick": quick,
        "cases": [result.summary() for result in found],
    }
    write_json(folder / "checks.json", data)
    return data


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
