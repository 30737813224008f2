"""A strategy for sheets that snap on their way: where a branch ends, the sheet moves downhill to rest.

A net of spring creases has very many branches, and which of them a path turns to says little about the folded sheet.
In place of passing limit points one by one the springs are turned on a little, and the sheet moves, damped, to where
its energy has a minimum, never through a closed hinge: where one is about to close the others go on
(`bh.solvers.stops`). So do sheets of paper, and so do programs that relax bars and hinges in time (Ghassaei et al.
2018).
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bh.solvers.factor import Descent, Factor
from bh.solvers.hardening import Hardening
from bh.solvers.hinged import Hinged
from bh.solvers.load_control import jump
from bh.solvers.modes import NEUTRAL, ROUNDED, count_negative, factorise_shifted
from bh.solvers.newton import NEAR_SADDLE, Newton, Solution, line_search, roll_off
from bh.solvers.outcome import Outcome
from bh.solvers.points import Increment, Point, extrapolate, lambda_after, point
from bh.solvers.stops import KEPT, around
from bh.solvers.system import Evaluation, System

Array = NDArray[np.float64]
NOTE = "settled: moved downhill to rest"
STILL = 1e-10  # relative fall of the energy in a step that no longer moves the sheet
CALM = 1e-6  # imbalance of a state at rest whose energy has stopped falling, in steps as soft as rounding
STUCK = 40  # such steps, after which a face has collapsed and what moves is rounding
TRIED = 14  # lengths of a step downhill, before the shift is raised
MISMATCH = 0.2  # of the energy gained in an increment and the work done, behind which there is a jump
GROWTH = 1.6  # of an increment behind one that Newton's method took
BOLDER = 2.0  # behind a motion to rest, whose steps hardly hang on how far the springs were turned


@dataclass(frozen=True)
class Settling:
    """Load control that never looks back: increments by Newton's method, or by a damped motion to rest.

    Attributes:
        first: increment of lambda.
        largest: increment of lambda.
        smallest: increment of lambda below which it gives up.
        most: steps of a motion to rest.
        shift: at the beginning of a motion, in parts of the tangent's diagonal (1 / time step).
        newton: its tolerance, and how its quick increments go.
    """

    first: float = 0.1
    largest: float = 0.5
    smallest: float = 5e-3
    most: int = 2000
    shift: float = 1e-3
    newton: Newton = field(default_factory=Newton)

    def limits(self, system: System) -> tuple[float, float]:  # noqa: ARG002 - of the protocol
        """First and largest increment of lambda for a system."""
        return self.first, self.largest

    def follow(
        self,
        system: System,
        history: Sequence[Point],
        increment: float | None = None,
        origin: Point | None = None,  # noqa: ARG002 - of the protocol
    ) -> Iterator[Increment]:
        """See `LoadControl.follow`; states that are reached by a motion to rest say so in their note."""
        points = list(history)
        step = self.first if increment is None else increment
        iterations, cuts = 0, []
        while points[-1].lam < 1.0:
            here = points[-1]
            lam = lambda_after(here.lam, step)
            found, note = self._at(system, points, lam)
            iterations += found.iterations
            if not found.converged:
                cuts.append(f"lambda {lam:.6g}: {found.reason}")
                step = 0.5 * (lam - here.lam)
                if step < self.smallest:
                    imbalance = found.evaluation.imbalance
                    yield Increment(
                        here, Outcome.STALLED, iterations, imbalance, step, tuple(cuts), found.reason
                    )
                    return
                continue
            there = point(system, found.q, lam, evaluation=found.evaluation, negative=found.negative)
            points = [there] if note else [*points[-2:], there]
            step = min(self.largest, (1.0 if cuts else BOLDER if note else GROWTH) * (lam - here.lam))
            imbalance = found.evaluation.imbalance
            yield Increment(
                there,
                Outcome.REACHED,
                iterations,
                imbalance,
                step,
                tuple(cuts),
                f"{NOTE} at lambda {lam:.6g}" if note else "",
                jumped=note,
            )
            iterations, cuts = 0, []

    def _at(self, system: System, points: Sequence[Point], lam: float) -> tuple[Solution, bool]:
        """The state at `lam`, by a few steps of Newton's method if it is near, and whether it had to settle."""
        here = points[-1]
        quick = replace(self.newton, globalised=0, hasty=True)
        found = quick.solve(system, *_guess(points, lam))
        if found.converged and found.stable:
            there = point(system, found.q, lam, evaluation=found.evaluation)
            if not jump(system, here, there, MISMATCH):
                return found, False
        spent = found.iterations
        found = self.settle(system, here.q, lam)
        return replace(found, iterations=found.iterations + spent), True

    def settle(self, system: System, q: Array, lam: float) -> Solution:
        """Move downhill from `q` to rest at a fixed lambda; no hinge passes closed, or turns far in one step.

        Args:
            system: whose equilibrium is sought.
            q: (n,) where the motion begins.
            lam: load parameter of the step, 0 to 1.

        Returns:
            the stable state; not converged, with the reason, where the steps were too few.
        """
        motion = self.settling_steps(system, q, lam)
        while True:
            try:
                next(motion)
            except StopIteration as done:
                found: Solution = done.value
                return found

    def settling_steps(self, system: System, q: Array, lam: float) -> Generator[Array, None, Solution]:
        """`settle`, one step at a time.

        Args:
            system: that settles.
            q: (size,) unknowns where it begins.
            lam: load parameter of the step, 0 to 1.

        Returns:
            what came of it; the unknowns before every step are given on the way.
        """
        harder = Hardening(system)
        try:
            return (yield from self._steps(system, q, lam, harder))
        finally:
            harder.end()

    def _steps(
        self, system: System, q: Array, lam: float, harder: Hardening
    ) -> Generator[Array, None, Solution]:
        """The steps of a motion; barriers are the model's again at its end, and `harder` than that on the way."""
        now, shift, still = system.evaluate(q, lam), self.shift, 0
        for step in range(self.most):
            with harder.own():
                yield q
            matrix = system.tangent(q, lam, now.forces).matrix
            if now.imbalance <= self.newton.tolerance or (still > 3 and now.imbalance <= CALM):
                if not harder.ease():
                    return Solution(q, now, step, True, "", count_negative(matrix), True)
                now, still = system.evaluate(q, lam), 0
                continue
            factor, shift = factorise_shifted(matrix, shift, least=NEUTRAL if still else ROUNDED)
            if factor is None:
                return Solution(q, now, step, False, "singular tangent", globalised=True)
            rolled = (
                roll_off(system, q, lam, now, matrix)
                if shift > 1e-9 and now.imbalance < NEAR_SADDLE
                else None
            )
            free = factor.descend(now.residual)
            moved = (*rolled, 1.0) if rolled is not None else _downhill(system, q, lam, now, factor, free)
            if moved is None:
                if shift > 1e3:
                    return Solution(q, now, step, False, "no way downhill", globalised=True)
                shift = max(10.0 * shift, 1e-4)
                continue
            before, came = now, q
            q, now, length = moved
            if rolled is None and harder.mind(q, lam, free.direction, q - came):
                now, still = system.evaluate(q, lam), 0
                continue
            still = still + 1 if abs(now.merit - before.merit) <= STILL * abs(now.merit) else 0
            if still > STUCK:
                return Solution(q, now, step, False, "the energy no longer falls", globalised=True)
            shift *= 0.2 if length > 0.5 else 1.0 if length > 0.2 else 4.0
        return Solution(
            q, now, self.most, False, f"not at rest after {self.most} steps downhill", globalised=True
        )


def _guess(points: Sequence[Point], lam: float) -> tuple[Array, float, Array]:
    q, forces = extrapolate(points, lam)
    return q, lam, forces


def _downhill(
    system: System, q: Array, lam: float, now: Evaluation, factor: Factor, free: Descent
) -> tuple[Array, Evaluation, float] | None:
    """A step along `free` by which the merit falls enough and no hinge turns too far; None if there is none."""
    return line_search(
        system,
        q,
        lam,
        now,
        around(system, q, lam, free, factor, now.residual),
        TRIED,
        lambda trial: _too_far(system, q, trial, lam),
    )


def _too_far(system: System, q: Array, trial: Array, lam: float) -> bool:
    """Whether a hinge turns too far in a step, or takes nearly all of the way that is left to closed.

    The lock of a hinge is a barrier: from a state much too close to closed Newton's steps only double that distance,
    and hold up the whole sheet (the rule of interior-point methods).
    """
    if isinstance(system, Hinged) and system.left_to_close(q, trial, lam) < KEPT:
        return True
    return bool(system.objection(q, lam, trial, lam))
