"""Step strategies: how far to go in lambda, from which guess, and what to do when a step fails."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bh.solvers.newton import Newton, Solution
from bh.solvers.stability import leave_saddle
from bh.solvers.system import System

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Point:
    """A converged state on the way of one step: lambda, unknowns, element forces and the rate of work there."""

    lam: float
    q: Array
    forces: Array
    energy: float
    power: float


@dataclass(frozen=True)
class Increment:
    """What one increment of lambda came to.

    `outcome` is "reached" for an accepted state; else it names why the step could not go on and `point` is the last
    accepted state. `cuts` tells why the increment was cut before it was accepted.
    """

    point: Point
    outcome: str
    iterations: int
    imbalance: float
    stable: bool | None
    next_increment: float
    cuts: tuple[str, ...] = ()
    note: str = ""


@dataclass(frozen=True)
class LoadControl:
    """Adaptive increments of lambda with extrapolated starts.

    The start from a flat sheet is the hard one, so the first increment is small; after that the guess is the
    polynomial through the last three states and their element forces.

    Attributes:
        first_rotation, largest_rotation: increments where angles are imposed, rad.
        first, largest: increments of lambda where no angle is.
        goal: iterations that an increment should take.
        smallest: part of the step below which an increment gives up.
        work_mismatch: largest relative difference between the energy gained in an increment and the work of the
            actuation (trapezoidal rule); a larger one means that the state jumped to another branch.
    """

    first_rotation: float = math.radians(15.0)
    largest_rotation: float = math.radians(27.0)
    first: float = 0.1
    largest: float = 0.34
    goal: int = 5
    smallest: float = 1e-5
    work_mismatch: float = 0.35
    newton: Newton = field(default_factory=Newton)

    def limits(self, system: System) -> tuple[float, float]:
        """First and largest increment of lambda for a system."""
        if system.rotation > 0.0:
            return min(1.0, self.first_rotation / system.rotation), min(
                1.0, self.largest_rotation / system.rotation
            )
        return self.first, self.largest

    def follow(
        self, system: System, history: Sequence[Point], increment: float | None = None
    ) -> Iterator[Increment]:
        """Go from the last point of `history` to lambda = 1; yields every accepted increment, or one failure last.

        `history` holds one to three accepted points of this step; `increment` is the next one to try, if known.
        """
        points = list(history)
        first, largest = self.limits(system)
        step = first if increment is None else increment
        cuts: list[str] = []
        iterations = 0
        while points[-1].lam < 1.0:
            here = points[-1]
            left = 1.0 - here.lam
            # do not leave a crumb for the end
            lam = 1.0 if step > 0.999 * left else here.lam + (0.5 * left if step > 0.7 * left else step)
            q, forces = extrapolate(points, lam)
            solution = self.newton.solve(system, q, lam, forces)
            iterations += solution.iterations
            note = ""
            if solution.converged and not solution.stable:
                solution, note = leave_saddle(system, solution, lam, self.newton)
                iterations += solution.iterations
            objection = self._objection(system, here, solution, lam, left_saddle=bool(note))
            if objection:
                cuts.append(f"lambda {lam:.6g}: {objection}")
                step = 0.5 * (lam - here.lam)
                if step < self.smallest:
                    outcome = "bifurcation" if solution.converged and solution.stable is False else "stalled"
                    yield Increment(
                        here,
                        outcome,
                        iterations,
                        solution.evaluation.imbalance,
                        None,
                        step,
                        tuple(cuts),
                        objection,
                    )
                    return
                continue
            there = point(system, solution.q, lam)
            taken = lam - here.lam
            points = [there] if note else [*points[-2:], there]
            growth = min(1.7, max(0.5, math.sqrt(self.goal / max(solution.iterations, 1))))
            step = min(largest, growth * taken if not cuts else min(growth, 1.0) * taken)
            yield Increment(
                there,
                "reached",
                iterations,
                solution.evaluation.imbalance,
                solution.stable,
                step,
                tuple(cuts),
                note,
            )
            cuts, iterations = [], 0

    def _objection(
        self, system: System, here: Point, solution: Solution, lam: float, left_saddle: bool
    ) -> str:
        if not solution.converged:
            return solution.reason
        if left_saddle:
            return ""
        if not solution.stable:
            return solution.reason or "unstable"
        turned = system.objection(here.q, here.lam, solution.q, lam)
        if turned:
            return turned
        gained = solution.evaluation.energy - here.energy
        power = system.power(solution.q, lam)
        work = 0.5 * (here.power + power) * (lam - here.lam)
        size = max(abs(here.power), abs(power)) * (lam - here.lam)
        noise = 1e-9 * max(abs(here.energy), abs(solution.evaluation.energy)) + 1e-15 * system.energy_scale
        if abs(gained - work) > self.work_mismatch * size + noise:
            return f"energy gained ({gained:.3g}) is not the work done ({work:.3g} N mm)"
        return ""


def point(system: System, q: Array, lam: float) -> Point:
    """The point of a path at given unknowns."""
    evaluation = system.evaluate(q, lam)
    return Point(lam, q, evaluation.forces, evaluation.energy, system.power(q, lam))


def extrapolate(points: Sequence[Point], lam: float) -> tuple[Array, Array]:
    """Unknowns and element forces at `lam` by the polynomial through up to three points (constant, line, parabola)."""
    q, forces = np.zeros_like(points[-1].q), np.zeros_like(points[-1].forces)
    for i, item in enumerate(points):
        weight = 1.0
        for j, other in enumerate(points):
            if j != i:
                weight *= (lam - other.lam) / (item.lam - other.lam)
        q += weight * item.q
        forces += weight * item.forces
    return q, forces


def with_newton(strategy: LoadControl, newton: Newton) -> LoadControl:
    """A copy of a strategy that solves with another Newton."""
    return replace(strategy, newton=newton)
