"""Records of what a benchmark measured, in the form of those of `bh verify`: the option `--record [FILE]`.

Figures of docs lead to them (`verification/framework/printed.py`). A record is named `bench_` and then as the module
that measures, and its source is the command that was typed; without a FILE it goes where such records are kept.
"""

from __future__ import annotations

import argparse
import os
import platform
import shlex
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bh.runtime.terminal import say
from verification.framework.checks import CaseResult, Cost
from verification.framework.run import RECORDS, conditions, record, write_json

Params = Mapping[str, str | float | bool]


class Measured:
    """What a benchmark has measured until now, and the commit, date and load of the machine when it began."""

    def __init__(self, name: str, title: str, words: Sequence[str] | None = None) -> None:
        """Nothing is measured yet.

        Args:
            name: of the module in `benchmarks`.
            title: a few words.
            words: of the command behind the module; None for those of this process.
        """
        typed = shlex.join(sys.argv[1:] if words is None else words)
        command = f"python -m benchmarks.{name} {typed}".strip()
        self.result = CaseResult(f"bench_{name}", title, "How long does it take?", f"measured by `{command}`")
        self.run_by = conditions(quick=False, jobs=1)  # now: records that are written later change the commit
        self.run_by["machine"] |= {"model": processor(), "load at the start": round(os.getloadavg()[0], 2)}
        self.began = time.perf_counter()

    def add(self, quantity: str, value: float, unit: str, params: Params, cost: Cost | None = None) -> None:
        """One figure; nothing judges it.

        Args:
            quantity: what was measured, in words.
            value: the figure, in `unit`.
            unit: "" for plain numbers.
            params: what tells figures of the same quantity apart.
            cost: size of the system and seconds of the measurement, where they are known.
        """
        self.result.check(quantity, value, unit=unit, params=dict(params), path=cost)

    def spread(
        self, quantity: str, times: Sequence[float], unit: str, params: Params, unknowns: int | None = None
    ) -> None:
        """Median and 95th percentile of times that are in `unit` ("ms" or "s")."""
        spent = sum(times) * (1e-3 if unit == "ms" else 1.0)
        for words, percent in (("median", 50.0), ("95th percentile", 95.0)):
            value = float(np.percentile(times, percent))
            most = {**params, "events": len(times)}
            self.add(f"{quantity}, {words}", value, unit, most, Cost(unknowns=unknowns, wall_time_s=spent))

    def data(self) -> dict[str, Any]:
        """The record, with versions, date and machine."""
        self.result.wall_time_s = time.perf_counter() - self.began
        return record([self.result], self.run_by)

    def write(self, file: Path | None) -> None:
        """Write the record, and say where; nothing without a file.

        Args:
            file: as `with_option` gives it.
        """
        if file is not None:
            write_json(file, self.data())
            say(f"wrote {file}")


def with_option(parser: argparse.ArgumentParser, name: str) -> argparse.ArgumentParser:
    """The parser with `--record [FILE]`; `name` is the module's."""
    file = RECORDS / f"bench_{name}.json"
    words = f"write what was measured to FILE, a record as those of bh verify (alone: {file.name}, where docs look)"
    parser.add_argument("--record", nargs="?", type=Path, const=file, metavar="FILE", help=words)
    return parser


def link(words: str, name: str, title: str) -> str:
    """A figure in a table of docs, as a link to its record; `title` says which (`verification.framework.printed`)."""
    shown = title.replace("|", "\\|")
    return f'[{words}](../verification/records/bench_{name}.json "{shown}")'


def processor() -> str:
    """Name of the machine's processor."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.is_file() else []
    names = [line.split(":")[1].strip() for line in lines if "model name" in line]
    return names[0] if names else platform.processor() or platform.machine()
