"""The one driver: one step of any system, by any strategy."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from bh.solvers.diagnosis import diagnose
from bh.solvers.goal import locate_zero
from bh.solvers.outcome import Outcome
from bh.solvers.points import NOT_STABLE, Increment, Point
from bh.solvers.system import System
from meshes.mesh import count

SHORTER = 0.25  # of an increment beyond a target, where its path was lost
MOST_SHORTER = 4  # times that it is walked anew


class Strategy(Protocol):
    """How a step is walked: load control, arc length, or one that chooses."""

    def limits(self, system: System) -> tuple[float, float]:
        """First and largest increment of lambda for a system.

        Returns:
            two numbers in (0, 1].
        """
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

        Args:
            system: whose equilibrium is sought.
            history: last points of the path, in order; one to three.
            increment: of lambda, to be tried first; None to choose it.
            origin: point that the step began with; None if it is the last of the history.
        """
        ...


@dataclass(frozen=True)
class Walk:
    """A step to be walked: from the last point of `history` (up to three) to lambda = 1.

    `origin` is the point that the step began with, where `history` no longer has it (a resumed run). With a `goal` the
    step ends where that is zero, to `tolerance`, and has failed if it is not before lambda = 1.
    """

    system: System
    strategy: Strategy
    history: tuple[Point, ...]
    increment: float | None = None
    origin: Point | None = None
    goal: Callable[[Point], float] | None = None
    tolerance: float = 1e-4


def walk(task: Walk) -> Iterator[Increment]:
    """Accepted increments one by one, so that the caller can store each before the next begins.

    The last one has another outcome than Outcome.REACHED if the step could not be finished, and names the reason.
    """
    items = task.strategy.follow(task.system, task.history, task.increment, task.origin)
    if task.goal is not None:
        items = _until(task, items, task.goal)
    for item in items:
        yield (
            item if item.outcome in (Outcome.REACHED, Outcome.TARGET_MISSED) else diagnose(task.system, item)
        )


def _not_stable(target: Point, shorter: int) -> str:
    """A note on a state that ends a step and was to be stable, and how often it was walked to anew."""
    anew = f", also in increments {round(SHORTER**-shorter)} times shorter" if shorter else ""
    return f"{NOT_STABLE} ({count(target.negative or 0, 'negative mode')}{anew})"


def _until(task: Walk, items: Iterator[Increment], goal: Callable[[Point], float]) -> Iterator[Increment]:
    """Increments up to the zero of `goal`; the last one is that state.

    Where the path from one state to the next, beyond the zero, is lost (they may lie on different branches), it is
    walked once more from the former in shorter increments. So it is where the state with the zero is not stable, though
    the strategy is to follow stable ones: a long increment has passed a bifurcation that nothing told of.
    """
    points, begun = list(task.history), False
    stable = getattr(task.strategy, "at_bifurcation", None) == "stable"
    left, passed, shorter, spent = goal(points[-1]), "", 0, 0
    while (item := next(items, None)) is not None:
        if not item.reached:
            yield item
            return
        here, now = points[-1], goal(item.point)
        if not item.jumped and left * now < 0.0 and abs(now) > task.tolerance:
            found = locate_zero(task.system, here, item.point, (left, now), goal, task.tolerance)
            increment = SHORTER * (item.point.lam - here.lam)
            lost = found is None or (stable and bool(found[0].negative))
            if lost and shorter < MOST_SHORTER and increment > 0.0:
                shorter, spent = shorter + 1, spent + item.iterations
                origin = task.origin or (task.history[-1] if begun else None)
                items = task.strategy.follow(task.system, points, increment, origin)
                continue
            note = "the target lies between two states, but the path to it was lost"
            iterations = item.iterations + spent
            if found is None:
                yield Increment(here, Outcome.TARGET_MISSED, iterations, math.nan, 0.0, note=note)
                return
            target, imbalance, more = found
            yield replace(
                item,
                point=target,
                iterations=iterations + more,
                imbalance=imbalance,
                critical=(),
                factorised=None,
                note="; ".join(filter(None, (item.note, _not_stable(target, shorter) if lost else ""))),
            )
            return
        yield replace(item, iterations=item.iterations + spent) if spent else item
        # nothing is extrapolated through a jump
        points = [item.point] if item.jumped else [*points[-2:], item.point]
        begun, spent = True, 0
        if left * now < 0.0:
            passed = f"; a jump at lambda {item.point.lam:.6g} passed it, from {left:+.6g} to {now:+.6g}"
        left = now
        if abs(now) <= task.tolerance:
            return
    note = f"the target is not met before the end of the step (missed by {left:.6g}{passed})"
    yield Increment(points[-1], Outcome.TARGET_MISSED, 0, math.nan, 0.0, note=note)
