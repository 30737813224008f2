"""The phase of waves round a ring, which next to nothing holds, is walked to where it is held."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from bh.solvers.creeping import CREEPS, creeping
from bh.solvers.load_control import downhill
from bh.solvers.matrices import BandMatrix
from bh.solvers.newton import ALONG, Newton
from bh.solvers.phase import settle
from bh.solvers.system import Evaluation, Tangent
from verification.studies.solver.benchmark_systems import Silent

Array = NDArray[np.float64]
CELLS, HELD = 5, 4e-7


class Ring(Silent):
    """A round valley in the plane, whose floor has a hollow in each of `CELLS` cells: (r - 1)^2 / 2."""

    rotation = 0.0
    energy_scale = 1.0
    size = primal = 2

    def evaluate(self, q: Array, lam: float) -> Evaluation:
        r, angle = float(np.hypot(*q)), math.atan2(q[1], q[0])
        energy = 0.5 * (r - 1.0) ** 2 + HELD * math.cos(CELLS * angle)
        out, along = q / r, np.array([-q[1], q[0]]) / r
        residual = (r - 1.0) * out - HELD * CELLS * math.sin(CELLS * angle) / r * along
        return Evaluation(energy, residual, float(np.abs(residual).max()), residual)

    def tangent(self, q: Array, lam: float, forces: Array) -> Tangent:
        step = 1e-5
        columns = [
            (self.evaluate(q + d, lam).residual - self.evaluate(q - d, lam).residual)
            for d in step * np.eye(2)
        ]
        K = np.array(columns) / (2.0 * step)
        K = 0.5 * (K + K.T)
        matrix = BandMatrix(np.array([np.diag(K), [K[1, 0], 0.0]], order="F"), np.arange(2))
        return Tangent(matrix)

    def control_rate(self, q: Array, lam: float) -> Array:
        return np.zeros(2)

    def power(self, q: Array, lam: float) -> float:
        return 0.0


def at(angle: float) -> Array:
    return np.array([math.cos(angle), math.sin(angle)])


@pytest.mark.parametrize("angle", [0.33, 0.5, 0.9])
def test_the_phase_goes_down_to_where_the_cells_hold_it(angle: float) -> None:
    system, newton = Ring(), Newton(tolerance=1e-10)
    along = np.array([-math.sin(angle), math.cos(angle)])
    found = replace(newton, held=along).solve_full(system, at(angle), 0.0)
    assert not found.converged
    assert found.reason == ALONG
    settled = settle(system, found, 0.0, newton)
    assert settled.converged
    assert settled.stable
    assert math.atan2(settled.q[1], settled.q[0]) == pytest.approx(math.pi / CELLS, abs=2e-3)
    assert settled.iterations < 60


def test_what_is_far_off_or_found_is_left_as_it_is() -> None:
    system, newton = Ring(), Newton(full=1)
    far = newton.solve_full(system, 2.0 * at(0.1), 0.0)
    near = replace(far, evaluation=system.evaluate(1.1 * at(0.1), 0.0), converged=False)
    assert settle(system, near, 0.0, newton) is near
    done = replace(near, converged=True)
    assert settle(system, done, 0.0, newton) is done


class High(Ring):
    """The same valley, whose hollows are nothing beside its energy."""

    def evaluate(self, q: Array, lam: float) -> Evaluation:
        found = super().evaluate(q, lam)
        return Evaluation(found.energy + 1.0, found.residual, found.imbalance, found.forces)


def test_creeping_along_the_valley_is_given_up_and_settled() -> None:
    system, start = High(), 1.3 * at(0.9)
    newton = Newton(tolerance=1e-13, transient=None)
    alone = newton.solve_globalised(system, start, 0.0)
    given_up = replace(newton, impatient=True).solve_globalised(system, start, 0.0)
    assert given_up.reason == CREEPS
    assert given_up.iterations < 0.5 * alone.iterations
    found = downhill(system, start, 0.0, newton)
    assert found.converged
    assert found.stable


def test_creeping_is_to_gain_nothing_in_many_steps() -> None:
    assert creeping([1.0 + 1e-9 * k for k in range(9, 0, -1)])
    assert not creeping([1.0 + 1e-9 * k for k in range(8, 0, -1)])  # too few
    assert not creeping([1.0 + 1e-6 * k for k in range(9, 0, -1)])
