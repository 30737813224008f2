"""Work of the actuation along a solved path, against the energy that the sheet gained."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bh import Path
from bh.solvers.load_control import LoadControl
from bh.solvers.points import Point, extrapolate, point, power_rate

PARTS = 8  # of an increment of the whole step


@dataclass(frozen=True)
class Balance:
    """Work and energy over the increments of a path that stay on one branch.

    Attributes:
        work: done by the actuation, N mm, by Hermite's rule of fourth order on all states.
        gained: energy, N mm.
        bar: difference between the work by all states and by every second one, N mm.
        covered: part of lambda that these increments cover.
        lost: energy that the increments in between gave away in jumps and buckling, N mm.
    """

    work: float
    gained: float
    bar: float
    covered: float
    lost: float

    @property
    def off(self) -> float:
        """|work - energy gained| over the energy gained."""
        return abs(self.work - self.gained) / max(abs(self.gained), 1e-300)

    @property
    def allowed(self) -> float:
        """The bar over the energy gained, and a ten-thousandth for what both halves of the rule miss near flat."""
        return self.bar / max(abs(self.gained), 1e-300) + 1e-4


def balance(path: Path) -> Balance:
    """Follow every increment of a path of one step in small parts, and integrate the power of its actuation.

    An increment that cannot be followed so, because the sheet buckles or jumps within it, is left out of work and
    energy; what it covers and gives away is told.

    Args:
        path: of one step, solved to its end.
    """
    system, _ = path.solved()
    work = gained = bar = covered = lost = 0.0
    for i in range(len(path.records) - 1):
        ends = [path.records[k] for k in (i, i + 1)]
        here, there = (point(system, record.q, record.lam) for record in ends)
        states = None if ends[1].jumped or ends[1].critical else _between(path, here, there)
        change = path[i + 1].energy.total - path[i].energy.total
        if states is None:
            lost += 0.5 * (here.power + there.power) * (there.lam - here.lam) - change
            continue
        rates = [power_rate(system, state) for state in states]
        fine, coarse = _hermite(states, rates), _hermite(states[::2], rates[::2])
        work, bar = work + fine, bar + abs(fine - coarse)
        gained, covered = gained + change, covered + there.lam - here.lam
    return Balance(work, gained, bar, covered, lost)


def _between(path: Path, here: Point, there: Point) -> list[Point] | None:
    """States from `here` to `there`, both among them, on one branch; None where they do not join."""
    system, newton = path.solved()[0], LoadControl().newton
    count = 2 * max(1, round(0.5 * PARTS * (there.lam - here.lam)))
    states = [here]
    for lam in np.linspace(here.lam, there.lam, count + 1)[1:]:
        if len(states) == 1:  # towards the end: a flat sheet has no tangent that leads to it
            share = (lam - here.lam) / (there.lam - here.lam)
            q, forces = here.q + share * (there.q - here.q), None
        else:
            q, forces = extrapolate(states[-3:], float(lam))
        found = newton.solve(system, q, float(lam), forces)
        if not found.converged:
            return None
        states.append(point(system, found.q, float(lam)))
    size = max(abs(there.energy), abs(here.energy), 1e-15 * system.energy_scale)
    return states if abs(states[-1].energy - there.energy) <= 1e-6 * size else None


def _hermite(states: list[Point], rates: list[float]) -> float:
    """Integral of the power over lambda, N mm: the trapezoidal rule and its correction by the slopes at both ends."""
    total = 0.0
    for a, b, slope_a, slope_b in zip(states, states[1:], rates, rates[1:], strict=False):
        taken = b.lam - a.lam
        correction = taken**2 / 12.0 * (slope_a - slope_b)
        total += 0.5 * (a.power + b.power) * taken + (correction if np.isfinite(correction) else 0.0)
    return total
