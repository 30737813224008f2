"""Along one way of a system, one iteration at a time, to a target that may move meanwhile."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bh.live.keeping import kept_steps
from bh.solvers.hindrance import clear_guess
from bh.solvers.load_control import LoadControl, jump
from bh.solvers.modes import count_negative, lowest_mode
from bh.solvers.newton import Newton, Solution
from bh.solvers.points import Point, extrapolate, point
from bh.solvers.settling import Settling
from bh.solvers.system import System

Array = NDArray[np.float64]
SMALLEST = 1e-3  # part of the first increment from which on the sheet may leave its branch: it snaps
BRISK = 2  # cuts of an increment, after which a net of springs moves to rest downhill
BOLD = 2.0  # such a motion is for, in first increments
MOTION = Settling(most=600)
PUSH = 1e-2  # along the lowest mode of an unstable state, in parts of the size of the sheet


@dataclass
class March:
    """The path of a system behind the hand; `points` holds its last states, three at most.

    Attributes:
        system: of the way; its lambda may go beyond 0 to 1.
        points: states in equilibrium, the newest last.
        target: lambda to go to; it may be changed between two iterations.
        settings: increments and tolerances of the driver.
        settles: it is a net of springs, whose branches are very many: where one ends it moves downhill.
        snapped: the newest state lies on another branch than the one before.
        stuck: why it cannot go on, or an empty string.
        iterations: so far.
        unseen: whether the newest state is stable was not looked at; tangents on its way there were positive definite.
    """

    system: System
    points: list[Point]
    target: float
    settings: LoadControl
    settles: bool = False
    snapped: bool = False
    stuck: str = ""
    iterations: int = 0
    unseen: bool = False

    def __post_init__(self) -> None:
        """Nothing is under way."""
        self._newton = replace(self.settings.newton, hasty=True, transient=None)
        self._run: Generator[Array, None, object] | None = None
        self._increment = self.settings.limits(self.system)[0] if self.system.rotation > 0.0 else 1.0

    @property
    def here(self) -> Point:
        """The newest state."""
        return self.points[-1]

    @property
    def arrived(self) -> bool:
        """Whether the newest state is that of the target."""
        return self.here.lam == self.target

    def advance(self) -> bool:
        """One iteration; False where there is nothing to do: it has arrived or is stuck."""
        if self._run is None:
            if self.arrived or self.stuck:
                return False
            self._run = self._go()
        try:
            next(self._run)
            self.iterations += 1
        except StopIteration:
            self._run = None
        return True

    def look(self) -> bool:
        """Look at the stability of the newest state, or go on from an unstable one; False where that was seen."""
        if self._run is None:
            if not self.unseen or self.stuck:
                return False
            self._run = self._look()
        return self.advance()

    def _look(self) -> Generator[Array, None, bool]:
        """Count negative modes of the newest state; from an unstable one downhill, or stuck. Whether it has moved."""
        here = self.here
        negative = count_negative(self.system.tangent(here.q, here.lam, here.forces).matrix)
        self.points[-1] = replace(here, negative=negative)
        if not negative:
            self.unseen = False
            return False
        evaluation = self.system.evaluate(here.q, here.lam)
        saddle = Solution(here.q, evaluation, 0, True, negative=negative)
        found = yield from self._downhill(saddle, here.lam)
        passed = self.system.penetration(here.q, here.lam, found.q, here.lam)
        if found is saddle or passed:
            if self.settles and (yield from self._to_rest(here.lam)):
                return True
            self.stuck = passed or "no stable state was found nearby"
            return False
        self.points = [
            point(self.system, found.q, here.lam, evaluation=found.evaluation, negative=found.negative)
        ]
        self.snapped, self.unseen = True, False
        return True

    def _go(self) -> Generator[Array, None, None]:
        """One accepted state further, or stuck."""
        size, cuts = self._increment, 0
        while True:
            here = self.here
            left = self.target - here.lam
            if left == 0.0:
                return
            lam = self.target if abs(left) <= size else here.lam + float(np.copysign(size, left))
            free = size < SMALLEST * self.settings.limits(self.system)[0]
            found = yield from self._solve(lam, quick=not cuts, patient=cuts >= self.settings.brisk or free)
            reason = found.reason if not found.converged else ""
            left_saddle = False
            if found.converged and found.stable is False:
                saddle = found
                found = yield from self._downhill(saddle, lam)
                left_saddle = found is not saddle
                reason = "" if left_saddle else "no stable state was found nearby"
            if not reason:
                there = point(self.system, found.q, lam, evaluation=found.evaluation, negative=found.negative)
                reason = (
                    self.system.penetration(here.q, here.lam, there.q, lam)
                    if left_saddle or free
                    else jump(self.system, here, there, self.settings.work_mismatch)
                )
                if not reason:
                    self.snapped = left_saddle or (
                        free and bool(jump(self.system, here, there, self.settings.work_mismatch))
                    )
                    before = [] if self.snapped else [at for at in self.points[-2:] if at.lam != lam]
                    self.points, self.unseen = [*before, there], found.negative is None
                    self._increment = min(
                        self.settings.limits(self.system)[1], 2.0 * size if not cuts else size
                    )
                    return
            if self.unseen and ((yield from self._look()) or self.stuck):  # it had become unstable unseen
                return
            if free or (self.settles and cuts == BRISK):
                far = min(abs(self.target - here.lam), BOLD * self.settings.limits(self.system)[0])
                if (yield from self._to_rest(here.lam + float(np.copysign(far, left)))):
                    return
            if free:
                self.stuck = reason
                return
            size, cuts = 0.5 * min(size, abs(left)), cuts + 1

    def _to_rest(self, lam: float) -> Generator[Array, None, bool]:
        """Downhill from the newest state to rest at `lam`, past any branches; whether it came to rest."""
        found = yield from MOTION.settling_steps(self.system, self.here.q, lam)
        if not found.converged or found.stable is False:
            return False
        self.points = [point(self.system, found.q, lam, evaluation=found.evaluation, negative=found.negative)]
        self.unseen = False
        self.snapped, self._increment = True, self.settings.limits(self.system)[0]
        return True

    def _solve(self, lam: float, quick: bool, patient: bool) -> Generator[Array, None, Solution]:
        """A state at `lam` near the last ones; `patient` goes downhill where full steps do not converge.

        One that was found by `quick` steps is not looked at for stability.
        """
        q, forces = clear_guess(self.system, self.here, lam, extrapolate(self.points, lam), None)
        full = kept_steps if quick else Newton.full_steps
        found = yield from full(self._newton, self.system, q, lam, forces)
        if found.converged or not patient:
            return found
        found = yield from self._newton.globalised_steps(self.system, q, lam)
        return found

    def _downhill(self, saddle: Solution, lam: float) -> Generator[Array, None, Solution]:
        """From an unstable state along its lowest mode, in both senses, to a stable one of lower energy; or itself."""
        matrix = self.system.tangent(saddle.q, lam, saddle.evaluation.forces).matrix
        _, mode = lowest_mode(matrix, len(saddle.q), self.system.primal)
        yield saddle.q
        size = float(np.ptp(saddle.q[: self.system.primal])) or 1.0
        push = PUSH * size / max(float(np.abs(mode).max()), 1e-300) * mode
        best = saddle
        for start in (saddle.q + push, saddle.q - push):
            found = yield from self._newton.globalised_steps(self.system, start, lam)
            if found.converged and found.stable and found.evaluation.energy < best.evaluation.energy:
                best = found
        return best
