"""Progress of a sweep: points done and failed, rate and time left, on stderr."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import TaskID


class Silent:
    """No report at all."""

    def update(self, done: int, total: int, failed: int, now: int, seconds: float) -> None:
        """Report nothing."""

    def close(self) -> None:
        """Nothing to close."""


class Bar:
    """A bar in a terminal; elsewhere a plain line now and then.

    Attributes:
        every: seconds between two plain lines.
    """

    every = 10.0

    def __init__(self) -> None:
        """Nothing is shown before the first task is finished."""
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn

        self._progress = Progress(
            BarColumn(), TextColumn("{task.description}"), console=Console(stderr=True), transient=False
        )
        self._terminal = self._progress.console.is_terminal
        self._task: TaskID | None = None
        self._due = 0.0

    def update(self, done: int, total: int, failed: int, now: int, seconds: float) -> None:
        """Move the bar, or print a line where there is no terminal."""
        text = line(done, total, failed, now, seconds)
        if not self._terminal:
            if time.monotonic() >= self._due or done == total:
                self._due = time.monotonic() + self.every
                print(text, file=sys.stderr, flush=True)
            return
        if self._task is None:
            self._progress.start()
            self._task = self._progress.add_task("", total=total)
        self._progress.update(self._task, completed=done, description=text)

    def close(self) -> None:
        """Leave the bar as it is."""
        if self._task is not None:
            self._progress.stop()


def line(done: int, total: int, failed: int, now: int, seconds: float) -> str:
    """Text such as "120 of 400 points, 2 failed, 31 a second, 9 s left".

    Args:
        done: points that are stored.
        total: points of the sweep.
        failed: how many of those stored were not reached.
        now: points stored in this run.
        seconds: that this run has taken; rate and time left follow from these two.
    """
    rate = now / seconds if seconds > 0.0 else 0.0
    text = f"{done:,} of {total:,} points" + (f", {failed:,} failed" if failed else "")
    if rate > 0.0:
        speed = f"{rate:.3g} a second" if rate >= 1.0 else f"{1.0 / rate:.3g} s a point"
        text += f", {speed}, {duration((total - done) / rate)} left"
    return text


def duration(seconds: float) -> str:
    """Seconds as "9 s", "4 min 10 s", "3 h 5 min" or "2 d 4 h"."""
    whole = round(seconds)
    for unit, size, small, part in (("d", 86400, "h", 3600), ("h", 3600, "min", 60), ("min", 60, "s", 1)):
        if whole >= size:
            return f"{whole // size} {unit} {whole % size // part} {small}"
    return f"{whole} s"
