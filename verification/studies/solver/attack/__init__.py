"""Case `attack`: kills, interrupts, bombs, code in files, full disks, two writers, threads, long runs.

Every attempt is drawn from a seed and stored as it is done, so a run that was stopped goes on. A run stops taking new
attempts of a kind when its share of time is over (half an hour, or BH_ATTACK_SECONDS), and says how many there were;
running it again adds the rest.
"""

from __future__ import annotations

import math
import os
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from meshes.errors import InputError
from verification.framework.checks import CaseResult, Context
from verification.framework.store import Store
from verification.studies.solver.attack import bombs, kills, long_runs, places, strangers
from verification.studies.solver.attack.attempts import Found, Kind
from verification.studies.solver.attack.page import table

CASE, RUNS, SEED = "attack", "attack_runs.json", 17
SECONDS, SHARE = 1800.0, "BH_ATTACK_SECONDS"  # of a kind, and the variable that says otherwise
KEPT = "what is finished is kept, nothing is half-written, the end has the same bits, no process is left"
ENDED = "one line and exit code 130 within 1 s (times the processes that share a core); and as above"
CASES = "finished cases are stored with the same figures, the file is whole, no process is left"
KINDS = (
    Kind("a file names code", "refused in one line, nothing of it is run", strangers.proofs, 1, 1),
    Kind("bombs", "one line within 5 s of processor time and 1 GB", bombs.bomb, 1, 1, "s"),
    Kind("kills of bh run", KEPT, kills.killed_run, 4, 1),
    Kind("Ctrl-C in bh run", ENDED, kills.interrupted_run, 4, 1, "s"),
    Kind("kills of bh sweep, two workers", KEPT, kills.killed_sweep, 4, 1),
    Kind("Ctrl-C in bh sweep, two workers", ENDED, kills.interrupted_sweep, 4, 1, "s"),
    Kind("kills of bh verify, two workers", CASES, kills.killed_verify, 4, 0),
    Kind("Ctrl-C in bh verify, two workers", ENDED, kills.interrupted_verify, 4, 0, "s"),
    Kind("kills of bh report", CASES, kills.killed_report, 4, 0),
    Kind("Ctrl-C in bh report", ENDED, kills.interrupted_report, 4, 0, "s"),
    Kind(
        "two writers of one folder",
        "one is refused, or they take turns; same states",
        places.two_writers,
        5,
        1,
    ),
    Kind("a full disk", "one line; with room it goes on to the same bits", places.full_disk, 10, 2),
    Kind("a home that cannot be written", "works, and says nothing of it", places.no_home, 1, 1),
    Kind("four threads, fork, spawn", "the bits of one alone", places.threads_and_processes, 3, 1),
    Kind("two first imports at once", "both end, with the same bits", places.two_first_imports, 1, 0),
    Kind(
        "300 traces in one process",
        "memory grows by less than 10 MB, no open files",
        long_runs.traces,
        1,
        0,
        "MB",
    ),
    Kind("30 traces in one process", "the same", long_runs.few_traces, 0, 1, "MB"),
)


def attempt(kind: Kind, number: int) -> Found:
    """One attempt of a kind, in a folder of its own.

    Args:
        kind: of the attack.
        number: of the attempt, which draws its random numbers.
    """
    index = [k.name for k in KINDS].index(kind.name)
    with TemporaryDirectory(prefix="bh-attack-", ignore_cleanup_errors=True) as place:
        return kind.play(Path(place), np.random.default_rng([SEED, index, number]))


def run(context: Context) -> CaseResult:
    """All kinds of attack, counted; writes the table of docs/reliability.md beside the results.

    Raises:
        InputError: this system has no /proc, in which processes that were left behind are looked for.
    """
    if not Path("/proc/self/stat").exists():
        raise InputError(
            "the case 'attack' looks for processes in /proc, which this system has not; use Linux"
        )
    result = CaseResult(
        name=CASE,
        title="Attacks",
        question="What do strangers' files, kills, full disks and long runs do?",
        source="what docs/reliability.md promises",
    )
    store = Store.open(context.folder, RUNS, context.quick)
    whole, share = True, float(os.environ.get(SHARE) or SECONDS)
    for kind in KINDS:
        asked = kind.quick if context.quick else kind.attempts
        began = time.monotonic()
        found: list[Found] = []
        for number in range(asked):
            key = f"{kind.name}/{number}"
            if key not in store.runs:
                if time.monotonic() - began > share:
                    whole = False
                    break
                context.tell(f"{CASE}: {kind.name}, {number + 1} of {asked}")
                store.keep(key, attempt(kind, number).plain())
            found.append(Found(**store.runs[key]))
        if found:
            _count(result, kind, found)
    if whole:
        store.file.unlink(missing_ok=True)
    (context.folder / "reliability.md").write_text(table(result.checks), encoding="utf-8")
    return result


def _count(result: CaseResult, kind: Kind, found: list[Found]) -> None:
    """One record of a kind: how many attacks there were, and in how many a promise did not hold."""
    skipped = next((f.skipped for f in found if f.skipped), "")
    before = sum(f.before for f in found)
    worst = [f.worst for f in found if math.isfinite(f.worst)]
    params = {
        "promise": kind.promise,
        "attacks": sum(f.tried for f in found),
        **({"worst": round(max(worst), 2), "unit": kind.unit} if worst and kind.unit else {}),
        **({"before": before} if before else {}),
        **({"skipped": skipped} if skipped else {}),
    }
    broken = [line for f in found for line in f.failures]
    count = len(broken)
    result.check(kind.name, count, unit="failures", reference=0.0, tolerance=0.0, params=params)
    result.notes += [f"{kind.name}: {line}" for line in broken[:5]]
