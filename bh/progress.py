"""Progress as an object: the library reports to it and never prints by itself."""

from __future__ import annotations

from types import TracebackType
from typing import Any, Protocol


class ProgressMeter(Protocol):
    """Told about every accepted increment; `step` counts from 0."""

    def update(self, step: int, steps: int, lam: float, iterations: int, energy: float) -> None: ...

    def close(self, outcome: str) -> None: ...


class Silent:
    """No report at all."""

    def update(self, step: int, steps: int, lam: float, iterations: int, energy: float) -> None:
        return

    def close(self, outcome: str) -> None:
        return


class Bar:
    """A bar in the terminal with lambda, iterations and energy; silent where the output is not a terminal."""

    def __init__(self) -> None:
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        self._progress = Progress(
            TextColumn("step {task.fields[step]}"),
            BarColumn(),
            TextColumn("lambda {task.completed:.3f}  iterations {task.fields[iterations]}"),
            TextColumn("energy {task.fields[energy]:.4g} N mm"),
            TimeElapsedColumn(),
            transient=False,
        )
        self._enabled = self._progress.console.is_terminal
        self._task: Any = None
        self._step = -1
        self._iterations = 0

    def update(self, step: int, steps: int, lam: float, iterations: int, energy: float) -> None:
        if not self._enabled:
            return
        if step != self._step:
            self._progress.start()
            self._task = self._progress.add_task(
                "", total=1.0, step=f"{step + 1}/{steps}", iterations=0, energy=0.0
            )
            self._step, self._iterations = step, 0
        self._iterations += iterations
        self._progress.update(self._task, completed=lam, iterations=self._iterations, energy=energy)

    def close(self, outcome: str) -> None:
        if self._enabled:
            self._progress.stop()

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close("")


def meter(progress: bool | ProgressMeter) -> ProgressMeter:
    """The meter that a `progress=` argument asks for."""
    if isinstance(progress, bool):
        return Bar() if progress else Silent()
    return progress
