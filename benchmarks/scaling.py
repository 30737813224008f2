"""What sweeps cost beside the solver, and how they scale on this machine: the figures of docs/scaling.md.

.venv/bin/python -m benchmarks.scaling [--points 120] [--record]
"""

from __future__ import annotations

import argparse
import os
import resource
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path

import bh.sweep
from benchmarks.record import Measured, with_option
from bh.applications.inverse.simulate import SegmentTask
from bh.sweep.points import Value
from bh.sweep.pools import Pool
from bh.sweep.task import Task


def nothing(point: Mapping[str, Value]) -> dict[str, float]:
    """A point that takes no time: all that is left is the sweep's own."""
    return {"value": float(point["x"])}


def main(words: Sequence[str] | None = None) -> None:
    """Print what a sweep costs a point, and how it scales from one process to two."""
    parser = with_option(argparse.ArgumentParser(description=__doc__), "scaling")
    parser.add_argument("--points", type=int, default=120, help="segments a run")
    given = parser.parse_args(words)
    count, found = given.points, Measured("scaling", "What sweeps cost beside the solver", words)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "data.nc"
        points = bh.sweep.grid({"x": list(range(3000))})
        for chunk in (1, 50):
            for name, pool in (("this process", 0), ("2 processes", 2)):
                cost = 1e3 * timed(nothing, points, file, pool, chunk)[0] / 3000
                print(f"{name}, chunk {chunk}: {cost:.3f} ms a point")
                found.add("time a point", cost, "ms", {"by": name, "chunk": chunk})
            with closing(bh.sweep.Dask(workers=2)) as cluster:
                seconds, _ = timed(nothing, points, file, cluster, chunk)
            print(f"Dask, 2 processes, chunk {chunk}: {1e3 * seconds / 3000:.3f} ms a point")
            found.add("time a point", 1e3 * seconds / 3000, "ms", {"by": "Dask, 2 processes", "chunk": chunk})
        each = bh.sweep.table(
            {
                "k0": [0.007 * (i + 0.5) / count for i in range(count)],
                "length": [200.0 + 80.0 * (i % 2) for i in range(count)],
            }
        )
        alone, cpu = timed(SegmentTask(), each, file, 1, 1)
        both, cpu_both = timed(SegmentTask(), each, file, 2, 1)
        print(f"load of the machine {os.getloadavg()[0]:.1f}")
        print(
            f"{count} segments: 1 process {alone:.2f} s ({cpu:.2f} s CPU), "
            f"2 processes {both:.2f} s ({cpu_both:.2f} s CPU)"
        )
        print(f"efficiency {alone / (2.0 * both):.2f}; in CPU time {cpu / cpu_both:.2f}")
        for number, clock, spent in ((1, alone, cpu), (2, both, cpu_both)):
            found.add("time of all segments", clock, "s", {"processes": number, "segments": count})
            found.add("processor time of all segments", spent, "s", {"processes": number, "segments": count})
        found.add("efficiency of two processes", alone / (2.0 * both), "", {"segments": count})
        found.add("efficiency of two processes, in processor time", cpu / cpu_both, "", {"segments": count})
    found.write(given.record)


def timed(
    task: Task, points: bh.sweep.Points, file: Path, pool: Pool | int, chunk: int
) -> tuple[float, float]:
    """Wall and CPU seconds from the first point that is finished to the last, so without starting workers."""
    meter = Meter()
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    bh.sweep.run(task, points, file, pool=pool, chunk=chunk, progress=meter)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return meter.seconds, cpu


class Meter:
    """Looks at the clock when the first and the last point are finished."""

    def __init__(self) -> None:
        """No point is finished."""
        self.first = self.last = 0.0

    def update(self, *_: float) -> None:
        """A point is finished."""
        self.last = time.perf_counter()
        self.first = self.first or self.last

    def close(self) -> None:
        """Nothing to close."""
        return

    @property
    def seconds(self) -> float:
        """Time from the first finished point to the last, s."""
        return self.last - self.first


if __name__ == "__main__":
    main()
