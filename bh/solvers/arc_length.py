"""Arc length: lambda is an unknown too, so that limit points are passed, backwards where the path turns back.

Every iterate stays on the hyperplane through the predictor, normal to the first tangent (Riks 1979; Wempner 1971).
With the increment of lambda scaled by the generalised stiffness parameter this is the generalised displacement
control of Leon et al. (2012, "MGDCM"), in which the same orthogonality is written the other way round.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bh.solvers.increments import Increment, Point, point
from bh.solvers.matrices import IndefiniteError
from bh.solvers.newton import Newton
from bh.solvers.system import System

Array = NDArray[np.float64]
MODE = "arc length"


@dataclass(frozen=True)
class ArcLength:
    """Increments of arc length in the unknowns (multipliers left out).

    Attributes:
        first: increment of lambda that sets the first arc.
        generalised: scale the increment of lambda by the root of the generalised stiffness parameter (MGDCM) in place
            of keeping the arc; it shortens where the path stiffens and needs no length of its own.
        goal: iterations that an increment should take; `iterations` the most.
        growth: largest arc, in parts of the one that `first` makes at the start of the step.
        most: increments before giving up.
        lowest: lambda at which a path that runs backwards is given up.
        newton: tolerance, and the solver for the last point at lambda = 1.
    """

    first: float = 0.05
    generalised: bool = False
    goal: int = 5
    iterations: int = 14
    growth: float = 3.0
    smallest: float = 1e-7
    most: int = 1000
    lowest: float = -2.0
    newton: Newton = field(default_factory=Newton)

    def limits(self, system: System) -> tuple[float, float]:
        """First and largest increment of lambda for a system; arcs have no largest one in lambda."""
        return self.first, 1.0

    def follow(
        self,
        system: System,
        history: Sequence[Point],
        increment: float | None = None,
        origin: Point | None = None,
    ) -> Iterator[Increment]:
        """Follow the path from the last point of `history` until lambda = 1; see `LoadControl.follow`."""
        last = history[-1]
        try:
            for item in self._follow(system, history, increment, origin):
                last = item.point
                yield item
        except IndefiniteError:
            reason = "the tangent is singular, or has too many constraints to count its modes"
            yield Increment(last, "stalled", 0, math.nan, None, 0.0, (), reason)

    def _follow(
        self, system: System, history: Sequence[Point], increment: float | None, origin: Point | None
    ) -> Iterator[Increment]:
        here = history[-1]
        direction = here.q - history[-2].q if len(history) > 1 else None
        p = system.primal
        start, _ = self._tangent(system, origin or history[0])
        largest = self.growth * self.first * float(np.linalg.norm(start[:p]))
        length: float | None = increment if here.mode == MODE else None
        shortest: float | None = None
        first_tangent: Array | None = None
        for _ in range(self.most):
            tangent, negative = self._tangent(system, here)
            size = float(np.linalg.norm(tangent[:p]))
            if length is None:
                length = (increment or self.first) * size
            if shortest is None or first_tangent is None:
                shortest, first_tangent = self.smallest * length, tangent
            sign = 1.0 if direction is None else math.copysign(1.0, float(tangent[:p] @ direction[:p]))
            scale = length / max(size, 1e-300)
            if self.generalised and first_tangent is not None:
                scale = min(scale, self.first * float(np.linalg.norm(first_tangent[:p])) / max(size, 1e-300))
            there, iterations, reason = self._increment(system, here, tangent, sign * scale)
            if there is None:
                length *= 0.4
                if length < shortest:
                    yield Increment(here, "stalled", iterations, math.nan, None, length, (), reason)
                    return
                continue
            direction = there.q - here.q
            done = there.lam >= 1.0
            if there.lam < self.lowest:
                note = f"the path runs back below lambda {self.lowest:g}"
                yield Increment(here, "limit-point", iterations, math.nan, None, length, (), note)
                return
            length = min(largest, length * min(1.8, math.sqrt(self.goal / max(iterations, 1))))
            here = there
            _, negative = self._tangent(system, here)
            evaluation = system.evaluate(here.q, here.lam)
            yield Increment(
                here, "reached", iterations, evaluation.imbalance, negative == 0, length, (),
                MODE, negative,
            )  # fmt: skip
            if done:
                return
        yield Increment(here, "stalled", 0, math.nan, None, 0.0, (), f"{self.most} increments of arc length")

    @staticmethod
    def _tangent(system: System, here: Point) -> tuple[Array, int]:
        """d q / d lambda along the path and the number of negative modes there."""
        factor, negative = system.tangent(here.q, here.lam, here.forces).factorise_any()
        return -factor.solve(system.control_rate(here.q, here.lam)), negative

    def _increment(
        self, system: System, here: Point, tangent: Array, step: float
    ) -> tuple[Point | None, int, str]:
        """One predictor of size `step` in lambda and its corrections; the last one ends at lambda = 1 exactly."""
        p = system.primal
        normal = tangent[:p]
        q, lam = here.q + step * tangent, here.lam + step
        if lam > 1.0:
            part = (1.0 - here.lam) / step
            return self._arrive(system, here, part * step * tangent)
        forces = system.predicted_forces(here.forces, step * tangent)
        for iteration in range(self.iterations):
            now = system.evaluate(q, lam)
            if not np.isfinite(now.energy):
                return None, iteration, "diverged"
            if now.imbalance <= self.newton.tolerance:
                turned = system.objection(here.q, here.lam, q, lam)
                # off the tangent by more than 34 degrees: the path turns sharply, and could be followed backwards
                sharp = np.linalg.norm((q - here.q)[:p]) > 1.2 * abs(step) * np.linalg.norm(normal)
                if turned or sharp:
                    return None, iteration, turned or "sharp turn"
                if lam > 1.0:
                    part = (1.0 - here.lam) / (lam - here.lam)
                    system.tangent(here.q, here.lam, here.forces)  # predictions are from the last tangent
                    return self._arrive(system, here, part * (q - here.q))
                return point(system, q, lam, MODE, now), iteration, ""
            try:
                factor, _ = system.tangent(q, lam, forces).factorise_any()
            except IndefiniteError:
                return None, iteration, "singular tangent"
            a = -factor.solve(now.residual)
            b = -factor.solve(system.control_rate(q, lam))
            slope = float(normal @ b[:p])
            if slope == 0.0:
                return None, iteration, "singular tangent"
            change = -float(normal @ a[:p]) / slope
            dq = a + change * b
            forces = system.predicted_forces(now.forces, dq)
            q, lam = q + dq, lam + change
        return None, self.iterations, "iteration limit"

    def _arrive(self, system: System, here: Point, change: Array) -> tuple[Point | None, int, str]:
        """The state at lambda = 1 from a guess, if it lies ahead on the path and not on another branch."""
        q = here.q + change
        solution = self.newton.solve_boldly(system, q, 1.0, system.predicted_forces(here.forces, change))
        if not solution.converged:
            return None, solution.iterations, solution.reason
        p = system.primal
        expected, moved = (q - here.q)[:p], (solution.q - here.q)[:p]
        far = np.linalg.norm(moved - expected) > 0.5 * np.linalg.norm(expected)
        turned = system.objection(here.q, here.lam, solution.q, 1.0)
        if turned or far:
            return None, solution.iterations, turned or "jumped to another branch"
        return point(system, solution.q, 1.0, MODE, solution.evaluation), solution.iterations, ""
