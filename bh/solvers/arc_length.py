"""Lambda as an unknown too, so that limit points are passed, backwards where the path turns back.

Every iterate stays on a hyperplane through the predictor: normal to the first tangent for arc length (Riks 1979;
Wempner 1971), normal to one unknown for displacement control (Batoz and Dhatt 1979). With the increment of lambda
scaled by the generalised stiffness parameter arc length is the generalised displacement control of Leon et al. (2012,
"MGDCM"), in which the same orthogonality is written the other way round.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bh.solvers.hyperplane import correct
from bh.solvers.matrices import IndefiniteError
from bh.solvers.newton import Newton
from bh.solvers.outcome import Outcome
from bh.solvers.points import ARC, DISPLACEMENT, CriticalPoint, Increment, Mode, Point, point
from bh.solvers.stability import locate
from bh.solvers.system import Evaluation, System, Tangent

Array = NDArray[np.float64]


class Control(Protocol):
    """What is prescribed in place of lambda: a hyperplane, and how far an increment goes."""

    @property
    def mode(self) -> Mode:
        """How states found so are marked in the path."""
        ...

    def normal(self, system: System, tangent: Array) -> Array:
        """(primal,) normal of the hyperplane, from the tangent dq / dlambda of the path.

        Args:
            system: whose equilibrium is sought.
            tangent: (n,) dq / dlambda of the path.
        """
        ...

    def scale(self, length: float, measure: float, first: float, first_measure: float) -> float:
        """Increment of lambda for a given length; `measure` is |normal . tangent| / |normal|, also at the start.

        Args:
            length: of the increment along the path, by the measure of the control.
            measure: |normal . tangent| / |normal| here.
            first: first increment of lambda.
            first_measure: `measure` where the path began.
        """
        ...


@dataclass(frozen=True)
class Cylindrical:
    """A constant arc in the unknowns, lambda left out of its length."""

    mode = ARC

    def normal(self, system: System, tangent: Array) -> Array:
        """(primal,) the tangent itself."""
        return tangent[: system.primal]

    def scale(self, length: float, measure: float, first: float, first_measure: float) -> float:
        """Increment of lambda whose arc has the given length."""
        return length / measure


@dataclass(frozen=True)
class Generalised(Cylindrical):
    """Increments of lambda scaled by the root of the generalised stiffness parameter (MGDCM).

    They shorten where the path softens and never exceed the first one.
    """

    def scale(self, length: float, measure: float, first: float, first_measure: float) -> float:
        """Increment of lambda for a given length; no larger one than the first."""
        return min(length, first * first_measure) / measure


@dataclass(frozen=True)
class Displacement:
    """One displacement grows by a given amount in every increment.

    `along` gives weights (primal,) of the unknowns for a system; None takes, anew in each increment, the unknown
    that moves most.
    """

    along: Callable[[System], Array] | None = None
    mode = DISPLACEMENT

    def normal(self, system: System, tangent: Array) -> Array:
        """(primal,) weights of the displacement that grows."""
        if self.along is not None:
            return self.along(system)
        normal = np.zeros(system.primal)
        normal[int(np.argmax(np.abs(tangent[: system.primal])))] = 1.0
        return normal

    def scale(self, length: float, measure: float, first: float, first_measure: float) -> float:
        """Increment of lambda in which the displacement grows by the given length."""
        return length / measure


@dataclass(frozen=True)
class _Direction:
    """The path's own direction dq / dlambda at an accepted state, its hyperplane and number of negative modes."""

    tangent: Tangent
    rate: Array
    normal: Array
    measure: float
    negative: int


@dataclass(frozen=True)
class _Arrival:
    """An accepted increment, or why there is none."""

    point: Point | None
    evaluation: Evaluation | None
    iterations: int
    reason: str = ""


@dataclass(frozen=True)
class ArcLength:
    """Increments of arc length in the unknowns (multipliers left out).

    Attributes:
        first: increment of lambda that sets the first arc.
        control: what is prescribed in place of lambda.
        goal: iterations that an increment should take; `iterations` the most.
        growth: largest arc, in parts of the one that `first` makes at the start of the step.
        most: increments before giving up.
        lowest: lambda at which a path that runs backwards is given up.
        newton: tolerance, and the solver for the last point at lambda = 1.
        locate: find limit and bifurcation points by bisection where the number of negative modes changes.
    """

    first: float = 0.05
    control: Control = field(default_factory=Cylindrical)
    goal: int = 5
    iterations: int = 14
    growth: float = 3.0
    smallest: float = 1e-7
    most: int = 1000
    lowest: float = -2.0
    newton: Newton = field(default_factory=Newton)
    locate: bool = True

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
            yield Increment(last, Outcome.STALLED, 0, math.nan, 0.0, note=reason)

    def _follow(
        self, system: System, history: Sequence[Point], increment: float | None, origin: Point | None
    ) -> Iterator[Increment]:
        here = history[-1]
        direction = here.q - history[-2].q if len(history) > 1 else None
        p = system.primal
        start = self._direction(system, origin or history[0])
        largest = self.growth * self.first * start.measure
        path = self._direction(system, here)
        length = increment if here.mode == self.control.mode else None
        length = (increment or self.first) * path.measure if length is None else length
        shortest = self.smallest * length
        iterations = 0
        for _ in range(self.most):
            sign = 1.0 if direction is None else math.copysign(1.0, float(path.rate[:p] @ direction[:p]))
            scale = self.control.scale(length, max(path.measure, 1e-300), self.first, start.measure)
            found = self._increment(system, here, path, sign * scale)
            iterations += found.iterations
            there = found.point
            if there is None or found.evaluation is None:
                length *= 0.4
                if length < shortest:
                    yield Increment(here, Outcome.STALLED, iterations, math.nan, length, note=found.reason)
                    return
                continue
            if there.lam < self.lowest:
                note = f"the path runs back below lambda {self.lowest:g}"
                yield Increment(here, Outcome.LIMIT_POINT, iterations, math.nan, length, note=note)
                return
            before = path.negative
            direction = there.q - here.q
            length = min(largest, length * min(1.8, math.sqrt(self.goal / max(found.iterations, 1))))
            critical: tuple[CriticalPoint, ...] = ()
            path = self._direction(system, there)
            if self.locate and path.negative != before:
                critical = locate(system, here, there, (before, path.negative), self.newton.tolerance)
            here = replace(there, negative=path.negative)
            imbalance = found.evaluation.imbalance
            yield Increment(
                here,
                Outcome.REACHED,
                iterations,
                imbalance,
                length,
                note=self.control.mode,
                critical=critical,
            )
            iterations = 0
            if here.lam >= 1.0:
                return
        yield Increment(
            here, Outcome.STALLED, 0, math.nan, 0.0, note=f"{self.most} increments of {self.control.mode}"
        )

    def _direction(self, system: System, here: Point) -> _Direction:
        tangent = system.tangent(here.q, here.lam, here.forces)
        factor, negative = tangent.matrix.factorise_any()
        rate = -factor.solve(system.control_rate(here.q, here.lam))
        normal = self.control.normal(system, rate)
        measure = abs(float(normal @ rate[: system.primal])) / max(float(np.linalg.norm(normal)), 1e-300)
        return _Direction(tangent, rate, normal, measure, negative)

    def _increment(self, system: System, here: Point, path: _Direction, step: float) -> _Arrival:
        """One predictor of size `step` in lambda and its corrections; the last one ends at lambda = 1 exactly."""
        p = system.primal
        lam = here.lam + step
        if lam > 1.0:
            return self._arrive(system, here, path, (1.0 - here.lam) * path.rate)
        guess = here.q + step * path.rate
        forces = path.tangent.predicted_forces(here.forces, step * path.rate)
        found = correct(system, guess, lam, forces, path.normal, self.newton.tolerance, self.iterations)
        if found.reason:
            return _Arrival(None, None, found.iterations, found.reason)
        turned = system.objection(here.q, here.lam, found.q, found.lam)
        # off the tangent by more than 34 degrees: the path turns sharply, and could be followed backwards
        sharp = np.linalg.norm((found.q - here.q)[:p]) > 1.2 * abs(step) * np.linalg.norm(path.rate[:p])
        if turned or sharp:
            return _Arrival(None, None, found.iterations, turned or "sharp turn")
        if found.lam > 1.0:
            part = (1.0 - here.lam) / (found.lam - here.lam)
            return self._arrive(system, here, path, part * (found.q - here.q))
        there = point(system, found.q, found.lam, self.control.mode, found.evaluation)
        return _Arrival(there, found.evaluation, found.iterations)

    def _arrive(self, system: System, here: Point, path: _Direction, change: Array) -> _Arrival:
        """The state at lambda = 1 from a guess, if it lies ahead on the path and not on another branch."""
        q = here.q + change
        newton = replace(self.newton, unstable=True)
        forces = path.tangent.predicted_forces(here.forces, change)
        solution = newton.solve_full(system, q, 1.0, forces)
        if not solution.converged:
            return _Arrival(None, None, solution.iterations, solution.reason)
        p = system.primal
        expected, moved = (q - here.q)[:p], (solution.q - here.q)[:p]
        far = np.linalg.norm(moved - expected) > 0.5 * np.linalg.norm(expected)
        turned = system.objection(here.q, here.lam, solution.q, 1.0)
        if turned or far:
            return _Arrival(None, None, solution.iterations, turned or "jumped to another branch")
        there = point(system, solution.q, 1.0, self.control.mode, solution.evaluation)
        return _Arrival(there, solution.evaluation, solution.iterations)


@dataclass(frozen=True)
class DisplacementControl(ArcLength):
    """Increments of one displacement (see `Displacement`): passes limit points of lambda, not those of its own."""

    control: Control = field(default_factory=Displacement)
