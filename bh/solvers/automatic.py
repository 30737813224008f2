"""The default strategy: load control, arc length over limit points, and load control again behind them."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

from bh.solvers.arc_length import ArcLength
from bh.solvers.load_control import AtBifurcation, LoadControl
from bh.solvers.newton import Solution
from bh.solvers.outcome import Critical, Outcome
from bh.solvers.points import ARC, LOAD, Increment, Point, point
from bh.solvers.settled_ahead import FALLS, settled_ahead, snaps
from bh.solvers.snapping import lets_go
from bh.solvers.stability import leave_saddle
from bh.solvers.system import System

NEVER = 10**6  # cuts before globalised Newton: arc length comes first
FAR = 8  # states by arc length that rise steadily: there is no limit point


@dataclass(frozen=True)
class Automatic:
    """Load control until it cannot go on; then arc length over the limit point; then, if need be, tiny increments.

    Attributes:
        load: the way that nearly every step goes. Its smallest increment here is only where arc length is tried.
        arc: how limit points are passed. It starts with the last increment that load control had accepted.
        patience: smallest increment of load control, in parts of the step, before arc length is tried.
        at_bifurcation: see `LoadControl`.
    """

    load: LoadControl = field(default_factory=LoadControl)
    arc: ArcLength = field(default_factory=lambda: ArcLength(most=200))
    patience: float = 2e-3
    at_bifurcation: AtBifurcation = "stable"

    def limits(self, system: System) -> tuple[float, float]:
        """First and largest increment of lambda for a system."""
        return self.load.limits(system)

    def follow(
        self,
        system: System,
        history: Sequence[Point],
        increment: float | None = None,
        origin: Point | None = None,
    ) -> Iterator[Increment]:
        """See `LoadControl.follow`; increments by arc length say so in their note."""
        load = replace(self.load, at_bifurcation=self.at_bifurcation)
        if lets_go(system) and self.at_bifurcation == "stable":  # no branch is of use that turns back
            yield from load.follow(system, history[-3:], increment)
            return
        seen, falls = list(history), 0
        ways = self._on_branches(system, history, increment, origin)
        while True:
            failure: Increment | None = None
            for item in ways:
                if not item.reached:
                    failure = item
                    break
                seen = [item.point] if item.jumped else [*seen, item.point]
                yield item
            if failure is None:
                return
            may = self.at_bifurcation == "stable" and falls < FALLS and seen[-1].lam < 1.0 and snaps(system)
            fallen = settled_ahead(system, seen, load) if may else None
            if fallen is None:
                yield failure
                return
            falls += 1
            fallen = replace(
                fallen, iterations=fallen.iterations + failure.iterations, cuts=(*failure.cuts, failure.note)
            )
            seen = [fallen.point]
            yield fallen
            ways = self._on_branches(system, [fallen.point], fallen.next_increment, None)

    def _on_branches(
        self, system: System, history: Sequence[Point], increment: float | None, origin: Point | None
    ) -> Iterator[Increment]:
        """The increments as far as branches of the path lead, and a failure where they do not lead to the end."""
        points = list(history)
        load = replace(self.load, at_bifurcation=self.at_bifurcation)
        hasty = replace(load, smallest=max(self.patience, load.smallest), foresee=True, brisk=NEVER)
        failure: Increment | None = None
        while True:
            if points[-1].mode != ARC:
                failure = yield from self._run(hasty.follow(system, points[-3:], increment), points)
                if failure is None:
                    return
                if failure.outcome is Outcome.BIFURCATION and self.at_bifurcation == "stop":
                    yield failure
                    return
                if len(points) < 2:
                    break
                increment = max(points[-1].lam - points[-2].lam, self.patience)
            passed = yield from self._pass(
                self.arc.follow(system, points, increment, origin), points, load, system
            )
            if passed is None and points[-1].lam >= 1.0:
                return
            if passed is not None:
                note = f"by arc length: {passed.note}"
                failure = replace(passed, note=f"{failure.note}; {note}" if failure else note)
                break
            increment = self.load.cautious(system)  # load control takes over again
        if points[-1].mode != ARC and points[-1].lam < 1.0:
            last = yield from self._run(load.follow(system, points[-3:], self.patience), points)
            if last is None:
                return
            failure = replace(last, note=f"{failure.note}; {last.note}" if failure else last.note)
        if failure is not None:
            yield failure

    @staticmethod
    def _run(
        increments: Iterator[Increment], points: list[Point]
    ) -> Generator[Increment, None, Increment | None]:
        """Hand on accepted increments and remember their points; returns the failure that ended them, or None."""
        for item in increments:
            if not item.reached:
                return item
            if item.jumped:
                points.clear()
            points.append(item.point)
            yield item
        return None

    def _pass(
        self, increments: Iterator[Increment], points: list[Point], load: LoadControl, system: System
    ) -> Generator[Increment, None, Increment | None]:
        """As `_run`, but stops where load control can take over again, and marks that state so."""
        for item in increments:
            if not item.reached:
                return item
            points.append(item.point)
            if self.at_bifurcation == "stable":
                left = self._leave(system, item, load)
                if left is not None:
                    points[:] = [left.point]
                    yield left
                    return None
                if item.point.lam >= 1.0 and item.point.negative:
                    yield item
                    note = "the end state is not stable, and no stable one was found nearby"
                    return replace(item, outcome=Outcome.UNSTABLE, iterations=0, note=note)
            if behind_limit(points) and item.point.lam < 1.0:
                points[:] = [replace(item.point, mode=LOAD)]
                note = f"{item.note}; load control from here on"
                first = load.cautious(system)
                yield replace(item, point=points[0], next_increment=first, note=note, jumped=True)
                return None
            yield item
        return None

    @staticmethod
    def _leave(system: System, item: Increment, load: LoadControl) -> Increment | None:
        """The stable state below one behind a bifurcation of a stable branch, or below an unstable end; or None."""
        first = item.critical[0] if item.critical else None
        here = item.point
        branches = first is not None and first.kind is Critical.BIFURCATION and first.negative[0] == 0
        if not (bool(here.negative) if here.lam >= 1.0 else branches):
            return None
        saddle = Solution(here.q, system.evaluate(here.q, here.lam), 0, True, negative=here.negative)
        found, note = leave_saddle(system, saddle, here.lam, load.newton)
        if not note:
            return None
        there = point(system, found.q, here.lam, LOAD, found.evaluation, found.negative)
        return replace(
            item, point=there, iterations=item.iterations + found.iterations, imbalance=found.evaluation.imbalance,
            next_increment=load.cautious(system), note=f"arc length; {note}", jumped=True,
        )  # fmt: skip


def behind_limit(points: Sequence[Point]) -> bool:
    """Is the last state stable, rising, and above all that load control had reached before arc length took over?

    Arc length begins below the limit point, so it must have fallen or been unstable on the way, or have come far
    without: then there was no limit point.
    """
    arc = next((i for i in range(len(points), 0, -1) if points[i - 1].mode != ARC), 0)
    run = points[max(arc - 1, 0) :]
    if len(run) < 3 or run[-1].negative != 0:
        return False
    passed = len(run) > FAR or any(b.lam < a.lam or bool(b.negative) for a, b in pairwise(run))
    top = max(p.lam for p in points[:arc]) if arc else run[0].lam
    return passed and run[-1].lam > max(run[-2].lam, top)
