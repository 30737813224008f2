"""Progress as an object: the library reports to it and never prints by itself."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from rich.progress import TaskID


class ProgressMeter(Protocol):
    """Told about every accepted increment; `step` counts from 0."""

    def update(self, step: int, steps: int, lam: float, iterations: int, energy: float) -> None:
        """Report an accepted increment; `step` of `steps` counts from 0, energy in N mm.

        Args:
            step: from 0.
            steps: how many there are.
            lam: load parameter of the step, 0 to 1.
            iterations: of the increment.
            energy: N mm.
        """

    def close(self, outcome: str) -> None:
        """The trace has ended, or was stopped."""


class Silent:
    """No report at all."""

    def update(self, step: int, steps: int, lam: float, iterations: int, energy: float) -> None:
        """Report nothing."""

    def close(self, outcome: str) -> None:
        """Nothing to close."""


class Bar:
    """A bar with lambda, iterations and energy on stderr; where that is no terminal, a plain line now and then.

    Attributes:
        first: seconds until the first plain line.
        every: seconds between two of them.
    """

    first, every = 5.0, 15.0

    def __init__(self) -> None:
        """Nothing is shown before the first increment."""
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        self._progress = Progress(
            TextColumn("{task.fields[stage]}step {task.fields[step]}"),
            BarColumn(),
            TextColumn("lambda {task.completed:.3f}  iterations {task.fields[iterations]}"),
            TextColumn("energy {task.fields[energy]:.4g} N mm"),
            TimeElapsedColumn(),
            console=Console(stderr=True),
            transient=False,
        )
        self._enabled = self._progress.console.is_terminal
        self._task: TaskID | None = None
        self._step = -1
        self._iterations = 0
        self._stage = ""
        self._began = time.monotonic()
        self._due = self._began + self.first

    def stage(self, words: str) -> None:
        """Say what is solved from here on, such as one of several meshes."""
        self._stage, self._step = f"{words}: ", -1

    def note(self, words: str) -> None:
        """Print a line of its own, above the bar if there is one."""
        self._progress.console.print(words, markup=False, highlight=False, soft_wrap=True)

    def update(self, step: int, steps: int, lam: float, iterations: int, energy: float) -> None:
        """Move the bar, or print a line where there is no terminal."""
        new = step != self._step
        self._step, self._iterations = step, iterations + (0 if new else self._iterations)
        if not self._enabled:
            self._tell(step, steps, lam, energy)
            return
        if new:
            self._progress.start()
            self._task = self._progress.add_task(
                "", total=1.0, stage=self._stage, step=f"{step + 1}/{steps}", iterations=0, energy=0.0
            )
        assert self._task is not None
        self._progress.update(self._task, completed=lam, iterations=self._iterations, energy=energy)

    def _tell(self, step: int, steps: int, lam: float, energy: float) -> None:
        now = time.monotonic()
        if now < self._due:
            return
        self._due = now + self.every
        print(
            f"{self._stage}step {step + 1}/{steps}  lambda {lam:.3f}  iterations {self._iterations}  "
            f"energy {energy:.4g} N mm  {now - self._began:.0f} s",
            file=sys.stderr,
            flush=True,
        )

    def close(self, outcome: str) -> None:
        """Leave the bar as it is."""
        del outcome
        if self._enabled:
            self._progress.stop()

    def __enter__(self) -> Bar:
        """The bar itself, to be closed at the end of the block."""
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Close the bar, also after an error."""
        self.close("")


def stage(report: ProgressMeter, words: str) -> None:
    """Tell a meter what is solved from here on, if it has a method `stage` for that.

    Args:
        report: the meter.
        words: what is solved.
    """
    tell = getattr(report, "stage", None)
    if tell is not None:
        tell(words)


def note(report: ProgressMeter, words: str) -> None:
    """Tell a meter something in words, if it has a method `note` for that.

    Args:
        report: the meter.
        words: what it is told.
    """
    tell = getattr(report, "note", None)
    if tell is not None:
        tell(words)


def meter(progress: bool | ProgressMeter) -> ProgressMeter:
    """The meter that a `progress=` argument asks for."""
    if isinstance(progress, bool):
        return Bar() if progress else Silent()
    return progress
