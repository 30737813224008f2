"""What a solve costs: wall time and peak memory."""

from __future__ import annotations

import math
import statistics
import time
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")
# (seconds, repetitions): a solve that takes less is repeated so often
REPEATS = ((1.0, 5), (3.0, 3), (math.inf, 1))
CLEAR, STATUS = Path("/proc/self/clear_refs"), Path("/proc/self/status")


@dataclass(frozen=True)
class Cost:
    """Median wall time of `repeats` solves after one that is not counted, s, and the peak memory of a solve, MB."""

    wall_time_s: float
    repeats: int
    memory_mb: float


def measure(solve: Callable[[], T], quick: bool = False) -> tuple[T, Cost]:
    """Solve once for the result and the memory, then for the time.

    Memory is the peak of what Python and NumPy have allocated during the first solve (tracemalloc). Compiled code that
    takes memory of its own is not seen there; where the highest resident size of the process (Linux: VmHWM, set back
    before) rises by more, that counts. `quick` times one solve.
    """
    before = _peak(reset=True)
    tracemalloc.start()
    try:
        began = time.perf_counter()
        result = solve()
        first = time.perf_counter() - began
        traced = tracemalloc.get_traced_memory()[1] / 2**20
    finally:
        tracemalloc.stop()
    grown = _peak(reset=False) - before
    repeats = 1 if quick else next(n for limit, n in REPEATS if first < limit)
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        solve()
        times.append(time.perf_counter() - began)
    return result, Cost(
        statistics.median(times), repeats, max(traced, grown) if math.isfinite(grown) else traced
    )


def _peak(reset: bool) -> float:
    """Highest resident size of this process, MB; with `reset` from now on, which is what it has now."""
    try:
        if reset:
            CLEAR.write_text("5")
        lines = STATUS.read_text().splitlines()
        return next(float(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024.0
    except (OSError, StopIteration):
        return math.nan
