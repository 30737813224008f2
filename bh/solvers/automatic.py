"""The default strategy: load control, and arc length where a limit point stops it."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, field, replace

from bh.solvers.arc_length import MODE, ArcLength
from bh.solvers.continuation import LoadControl
from bh.solvers.increments import Increment, Point
from bh.solvers.system import System


@dataclass(frozen=True)
class Automatic:
    """Load control until it cannot go on; then arc length over the limit point; then, if need be, tiny increments.

    Attributes:
        load: the way that nearly every step goes. Its smallest increment here is only where arc length is tried.
        arc: how limit points are passed. It starts with the last increment that load control had accepted.
        patience: smallest increment of load control, in parts of the step, before arc length is tried.
    """

    load: LoadControl = field(default_factory=LoadControl)
    arc: ArcLength = field(default_factory=lambda: ArcLength(most=200))
    patience: float = 2e-3

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
        points = list(history)
        if points[-1].mode == MODE and points[-1].lam < 1.0:  # a resumed run goes on the way it went
            passed = yield from self._run(self.arc.follow(system, points, increment, origin), points)
            if passed is not None:
                yield passed
            return
        first = replace(self.load, smallest=max(self.patience, self.load.smallest))
        failure = yield from self._run(first.follow(system, points, increment), points)
        if failure is None:
            return
        if len(points) > 1:
            step = max(points[-1].lam - points[-2].lam, self.patience)
            passed = yield from self._run(self.arc.follow(system, points, step, origin), points)
            if passed is None:
                return
            failure = replace(passed, note=f"{failure.note}; by arc length: {passed.note}")
        if points[-1].lam < 1.0 and points[-1].lam >= history[-1].lam:
            last = yield from self._run(self.load.follow(system, points[-3:], self.patience), points)
            if last is None:
                return
            failure = replace(last, note=f"{failure.note}; {last.note}")
        yield failure

    @staticmethod
    def _run(
        increments: Iterator[Increment], points: list[Point]
    ) -> Generator[Increment, None, Increment | None]:
        """Hand on accepted increments and remember their points; returns the failure that ended them, or None."""
        for item in increments:
            if item.outcome != "reached":
                return item
            points.append(item.point)
            yield item
        return None
