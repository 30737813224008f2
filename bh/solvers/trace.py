"""The one driver: one step of any system, by any strategy."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from bh.solvers.continuation import Increment, LoadControl, Point
from bh.solvers.system import System


@dataclass(frozen=True)
class Walk:
    """A step to be walked: from the last point of `history` (up to three) to lambda = 1."""

    system: System
    strategy: LoadControl
    history: tuple[Point, ...]
    increment: float | None = None


def walk(task: Walk) -> Iterator[Increment]:
    """Accepted increments one by one, so that the caller can store each before the next begins.

    The last one has another outcome than "reached" if the step could not be finished.
    """
    yield from task.strategy.follow(task.system, task.history, task.increment)
