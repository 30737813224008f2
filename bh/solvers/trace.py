"""The one driver: one step of any system, by any strategy."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from bh.solvers.diagnosis import diagnose
from bh.solvers.increments import Increment, Point
from bh.solvers.system import System


class Strategy(Protocol):
    """How a step is walked: load control, arc length, or one that chooses."""

    def limits(self, system: System) -> tuple[float, float]:
        """First and largest increment of lambda for a system."""
        ...

    def follow(
        self,
        system: System,
        history: Sequence[Point],
        increment: float | None = None,
        origin: Point | None = None,
    ) -> Iterator[Increment]:
        """Accepted increments from the last of up to three points to lambda = 1, or one failure last.

        `increment` is the next one to try, `origin` the point that the step began with, where they are known.
        """
        ...


@dataclass(frozen=True)
class Walk:
    """A step to be walked: from the last point of `history` (up to three) to lambda = 1.

    `origin` is the point that the step began with, where `history` no longer has it (a resumed run).
    """

    system: System
    strategy: Strategy
    history: tuple[Point, ...]
    increment: float | None = None
    origin: Point | None = None


def walk(task: Walk) -> Iterator[Increment]:
    """Accepted increments one by one, so that the caller can store each before the next begins.

    The last one has another outcome than "reached" if the step could not be finished, and names the reason.
    """
    for item in task.strategy.follow(task.system, task.history, task.increment, task.origin):
        yield item if item.outcome == "reached" else diagnose(task.system, item)
