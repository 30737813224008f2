"""Newton, the line search, stability and the increments of lambda on small systems whose answers are known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from bh.solvers.creeping import slow
from bh.solvers.factor import Descent
from bh.solvers.linear import linear_response
from bh.solvers.load_control import LoadControl, jump
from bh.solvers.matrices import BandFactor, BandMatrix
from bh.solvers.modes import (
    KNOWN_GAP,
    count_negative,
    factorise_shifted,
    lowest_mode,
    neutral_mode,
    softness,
    without,
)
from bh.solvers.newton import Newton, Solution, line_search
from bh.solvers.points import Increment, Point, extrapolate, point
from bh.solvers.saddle import ConstraintRows, MultiplierMatrix
from bh.solvers.stability import leave_saddle
from bh.solvers.system import Evaluation, Tangent
from bh.solvers.walk import Walk, walk
from verification.studies.solver.benchmark_systems import Silent

Array = NDArray[np.float64]


def band(A: Array) -> BandMatrix:
    n = len(A)
    ab = np.zeros((n, n), order="F")
    for d in range(n):
        ab[d, : n - d] = np.diag(A, -d)
    return BandMatrix(ab, np.arange(n))


class Small(Silent):
    """A system given by its energy, gradient and Hessian in q; lambda is a dead load along `load`."""

    rotation = 0.0
    energy_scale = 1.0

    def __init__(self, size: int, load: Sequence[float]) -> None:
        self.size = self.primal = size
        self.load = np.array(load, dtype=float)
        self.evaluations = 0

    def internal(self, q: Array) -> tuple[float, Array, Array]:
        raise NotImplementedError

    def evaluate(self, q: Array, lam: float) -> Evaluation:
        self.evaluations += 1
        energy, gradient, _ = self.internal(q)
        residual = gradient - lam * self.load
        scale = max(float(np.abs(gradient).max()), lam * float(np.abs(self.load).max()), 1e-12)
        return Evaluation(
            energy - lam * float(self.load @ q), residual, float(np.abs(residual).max()) / scale, gradient
        )

    def tangent(self, q: Array, lam: float, forces: Array) -> Tangent:
        return Tangent(band(self.internal(q)[2]))

    def control_rate(self, q: Array, lam: float) -> Array:
        return -self.load

    def control_stiffness(self, q: Array, lam: float) -> float:
        return 0.0

    def power(self, q: Array, lam: float) -> float:
        return -float(self.load @ q)


class Springs(Small):
    """Linear: a chain of three springs."""

    K = np.array([[3.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])

    def __init__(self) -> None:
        super().__init__(3, [0.0, 0.0, 2.0])

    def internal(self, q: Array) -> tuple[float, Array, Array]:
        return 0.5 * float(q @ self.K @ q), self.K @ q, self.K


class Stiffening(Small):
    """Energy q^2 / 2 + q^4 / 4 under a load of 10: q + q^3 = 10 lambda."""

    def __init__(self) -> None:
        super().__init__(1, [10.0])

    def internal(self, q: Array) -> tuple[float, Array, Array]:
        return float((q**2 / 2 + q**4 / 4).sum()), q + q**3, np.diag(1 + 3 * q**2)


class Arch(Small):
    """A shallow arch: energy (q^2 - 1)^2 / 4 from q = -1; the load path has a limit point at q = -1 / sqrt 3."""

    limit = 2.0 / (3.0 * math.sqrt(3.0))

    def __init__(self, load: float) -> None:
        super().__init__(1, [load])

    def internal(self, q: Array) -> tuple[float, Array, Array]:
        return float(((q**2 - 1) ** 2 / 4).sum()), q**3 - q, np.diag(3 * q**2 - 1)


class Column(Small):
    """A column that buckles: shortening u and sway w, energy u^2 / 2 + (0.3 - u) w^2 + w^4; load 1 along u.

    The straight column u = lambda, w = 0 is stable up to 0.3; beyond, w^2 = (u - 0.3) / 2.
    """

    def __init__(self) -> None:
        super().__init__(2, [1.0, 0.0])

    def internal(self, q: Array) -> tuple[float, Array, Array]:
        u, w = q
        energy = 0.5 * u * u + (0.3 - u) * w * w + w**4
        gradient = np.array([u - w * w, 2 * (0.3 - u) * w + 4 * w**3])
        return float(energy), gradient, np.array([[1.0, -2 * w], [-2 * w, 2 * (0.3 - u) + 12 * w * w]])


def finish(system: Small, strategy: LoadControl, q: Array) -> list[Increment]:
    return list(walk(Walk(system, strategy, (point(system, q, 0.0),))))


# --------------------------------------------------------------------------------------- Newton


def test_linear_system_takes_one_iteration() -> None:
    system = Springs()
    found = Newton().solve(system, np.zeros(3), 0.7)
    assert found.converged
    assert found.iterations == 1
    assert found.stable is True
    assert found.q == pytest.approx(np.linalg.solve(system.K, 0.7 * system.load), rel=1e-14)


@pytest.mark.parametrize("full", [14, 0])
def test_stiffening_spring(full: int) -> None:
    """Both ways find the root of q + q^3 = 10, and count their iterations."""
    found = Newton(full=full).solve(Stiffening(), np.array([0.0]), 1.0)
    assert found.converged
    assert found.globalised is (full == 0)
    assert found.q[0] == pytest.approx(2.0, rel=1e-9)
    assert 3 < found.iterations < 14


def test_quadratic_convergence() -> None:
    """The number of right digits doubles: from 1 % to rounding in three iterations."""
    near = Newton(full=3, globalised=0, tolerance=1e-13).solve(Stiffening(), np.array([2.02]), 1.0)
    assert near.converged
    assert near.q[0] == pytest.approx(2.0, rel=1e-13)


def test_what_does_not_converge_says_so() -> None:
    found = Newton(full=1, globalised=0).solve(Stiffening(), np.array([0.0]), 1.0)
    assert not found.converged
    assert found.reason == "iteration limit"
    assert found.stable is None
    found = Newton(full=1, globalised=2, transient=None).solve(Stiffening(), np.array([0.0]), 1.0)
    assert not found.converged
    assert found.iterations == 3


def test_bold_way_refuses_an_indefinite_tangent() -> None:
    found = Newton(globalised=0).solve(Arch(0.1), np.array([0.1]), 1.0)
    assert not found.converged
    assert found.reason == "indefinite tangent"
    assert found.iterations == 0


@pytest.mark.parametrize("start", [-0.3, -0.01, 0.2])
def test_globalised_way_goes_downhill_from_where_the_tangent_is_indefinite(start: float) -> None:
    system = Arch(0.1)
    before = system.evaluate(np.array([start]), 1.0).energy
    found = Newton(full=0).solve(system, np.array([start]), 1.0)
    assert found.converged
    assert found.stable is True
    assert found.evaluation.energy < before
    q = float(found.q[0])
    assert q**3 - q == pytest.approx(0.1, abs=1e-8)
    assert 3 * q * q > 1.0  # a minimum, not the hill between the two


def test_saddle_is_converged_but_not_stable() -> None:
    found = Newton().solve(Column(), np.array([0.6, 0.0]), 0.6)
    assert found.converged
    assert found.stable is False


def test_energies_that_are_not_finite_are_no_solution() -> None:
    class Poisoned(Stiffening):
        def internal(self, q: Array) -> tuple[float, Array, Array]:
            if abs(q[0]) > 1.0:
                return math.nan, np.full(1, math.nan), np.eye(1)
            return super().internal(q)

    found = Newton(globalised=30).solve(Poisoned(), np.array([0.0]), 1.0)
    assert not found.converged
    assert found.reason


def test_line_search_never_raises_the_energy() -> None:
    system = Arch(0.1)
    for start in np.linspace(-2.0, 2.0, 21):
        q = np.array([start])
        now = system.evaluate(q, 1.0)
        for direction in (-now.residual, -100.0 * now.residual):
            found = line_search(system, q, 1.0, now, Descent(direction, float(now.residual @ direction)))
            if found is None:
                assert np.abs(now.residual).max() < 1e-6
                continue
            q_new, there, length = found
            assert there.energy <= now.energy + 1e-13
            assert 0.0 < length <= 1.0
            assert q_new == pytest.approx(q + length * direction)


def test_line_search_refuses_to_climb() -> None:
    system = Stiffening()
    q = np.array([0.5])
    now = system.evaluate(q, 1.0)
    assert line_search(system, q, 1.0, now, Descent(now.residual, float(now.residual @ now.residual))) is None


# --------------------------------------------------------------------------------------- shift and modes


def test_smallest_shift_that_makes_it_definite() -> None:
    A = np.diag([4.0, 2.0, -1.0])
    factor, shift = factorise_shifted(band(A), 0.0)
    assert factor is not None
    assert 1.0 < shift <= 4.0 * 1.000001  # diagonal -1 needs more than its own size
    definite = np.diag([4.0, 2.0, 1.0])
    assert factorise_shifted(band(definite), 0.0)[1] == 0.0
    assert factorise_shifted(band(definite), 1e-10)[1] == 0.0  # what is left of an old shift is dropped


def test_shift_has_a_limit() -> None:
    factor, shift = factorise_shifted(band(np.diag([1.0, -1.0])), 0.0, largest=1e-5)
    assert factor is None
    assert shift > 1e-5


@pytest.mark.parametrize("lowest", [-1e-10, -3e-9, -2e-7, -9e-7, -0.9e-5, -1e-4])
def test_a_small_limit_costs_few_factorisations(lowest: float) -> None:
    """The shift is the smallest of 0, 1e-11, 1e-9, 4e-9, ... that helps, found by halving, or none at two looks."""
    looks: list[float] = []

    class Counted(BandMatrix):
        def factorise(self, shift: float = 0.0) -> BandFactor:
            looks.append(shift)
            return super().factorise(shift)

    # mean of the diagonal 0.75: the last entry is shifted by 0.75e-3 of the shift
    matrix = band(np.diag([1.0, 1.0, 1.0, lowest * 0.75e-3]))
    tried = [0.0, 1e-11, *(1e-9 * 4.0**k for k in range(7))]
    helps = [s for s in tried if 1.0 * s * 0.75e-3 + lowest * 0.75e-3 > 0.0]
    factor, shift = factorise_shifted(Counted(matrix.ab, matrix.order), 0.0, largest=1e-5)
    if not helps:
        assert factor is None
        assert len(looks) == 2
    else:
        assert factor is not None
        assert shift == pytest.approx(helps[0], rel=1e-12)
        assert len(looks) <= 5


def test_neutral_mode_is_not_indefinite() -> None:
    """An eigenvalue that is zero but for rounding is given a stiffness at the level of rounding."""
    A = np.array([[1.0, -1.0], [-1.0, 1.0 - 1e-16]])
    factor, shift = factorise_shifted(band(A), 0.0)
    assert factor is not None
    assert shift <= 1e-8


@pytest.mark.parametrize("seed", range(5))
def test_lowest_mode(seed: int) -> None:
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.normal(size=(8, 8)))[0]
    values = np.array([-3.0, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 9.0]) if seed % 2 else np.arange(1.0, 9.0)
    A = Q @ np.diag(values) @ Q.T
    quotient, mode = lowest_mode(band(A), 8, 8, iterations=400, tolerance=1e-12)
    exact_values, exact_modes = np.linalg.eigh(A)
    assert quotient == pytest.approx(float(mode @ A @ mode))
    if (
        seed % 2
    ):  # the shift is not a multiple of the identity, so the mode is only near the lowest: downhill it must be
        assert exact_values[0] <= quotient < 0.5 * exact_values[0]
    else:
        assert quotient == pytest.approx(exact_values[0], rel=1e-6)
        assert abs(mode @ exact_modes[:, 0]) > 0.999
    assert np.linalg.norm(mode) == pytest.approx(1.0)
    assert mode[np.argmax(np.abs(mode))] > 0.0
    again, _ = lowest_mode(band(A), 8, 8, iterations=400, tolerance=1e-12)
    assert again == quotient


def test_leaving_a_saddle() -> None:
    """The straight column beyond its load: downhill to the bent one, and only to a stable lower state."""
    system, newton = Column(), Newton()
    saddle = newton.solve(system, np.array([0.6, 0.0]), 0.6)
    found, note = leave_saddle(system, saddle, 0.6, newton)
    assert note
    assert found.converged
    assert found.stable is True
    assert found.evaluation.energy < saddle.evaluation.energy
    u, w = found.q
    assert u - w * w == pytest.approx(0.6, abs=1e-7)
    assert w * w == pytest.approx((u - 0.3) / 2.0, abs=1e-7)


def test_a_saddle_without_a_way_out_is_kept() -> None:
    class Hill(Small):
        def internal(self, q: Array) -> tuple[float, Array, Array]:
            return -0.5 * float(q @ q), -q, -np.eye(1)

    system = Hill(1, [0.0])
    saddle = Solution(np.zeros(1), system.evaluate(np.zeros(1), 0.0), 0, True, negative=1)
    found, note = leave_saddle(system, saddle, 0.0, Newton(globalised=20))
    assert note == ""
    assert "no stable state" in found.reason
    assert found.q == pytest.approx([0.0])


# --------------------------------------------------------------------------------------- increments


@pytest.mark.parametrize("count", [1, 2, 3])
def test_extrapolation_is_exact_for_polynomials(count: int) -> None:
    """Constant, line, parabola through one, two, three points; forces along with the unknowns."""
    coefficients = np.array([[1.0, -2.0], [0.5, 3.0], [-4.0, 1.5]])[:count]

    def value(lam: float) -> Array:
        return np.asarray(sum(c * lam**i for i, c in enumerate(coefficients)))

    points = [Point(lam, value(lam), 3.0 * value(lam), 0.0, 0.0) for lam in (0.1, 0.25, 0.7)[:count]]
    q, forces = extrapolate(points, 1.3)
    assert q == pytest.approx(value(1.3), rel=1e-12)
    assert forces == pytest.approx(3.0 * value(1.3), rel=1e-12)


def test_stiffening_spring_is_followed() -> None:
    found = finish(Stiffening(), LoadControl(), np.zeros(1))
    assert [step.outcome for step in found] == ["reached"] * len(found)
    lambdas = [step.point.lam for step in found]
    assert lambdas == sorted(lambdas)
    assert lambdas[0] == pytest.approx(0.1)
    assert lambdas[-1] == 1.0
    assert np.diff([0.0, *lambdas]).max() <= 0.34 + 1e-12
    for step in found:
        q = float(step.point.q[0])
        assert q + q**3 == pytest.approx(10.0 * step.point.lam, rel=1e-7)
        assert step.imbalance <= 1e-8
        assert step.stable is True


def test_limits_by_rotation_or_by_lambda() -> None:
    system, strategy = Springs(), LoadControl()
    assert strategy.limits(system) == (0.1, 0.34)
    system.rotation = math.radians(90.0)
    assert strategy.limits(system) == (1.0, 1.0)
    assert strategy.cautious(system) == pytest.approx(15.0 / 90.0)
    system.rotation = math.radians(135.0)
    assert strategy.limits(system) == pytest.approx((90.0 / 135.0, 90.0 / 135.0))
    system.rotation = math.radians(5.0)
    assert strategy.limits(system) == (1.0, 1.0)


def test_no_crumb_is_left_for_the_end() -> None:
    steps = [s.point.lam for s in finish(Springs(), LoadControl(first=0.3, largest=0.3), np.zeros(3))]
    gaps = np.diff([0.0, *steps])
    assert gaps.min() > 0.15
    assert steps[-1] == 1.0


@pytest.mark.parametrize("load", [1.0, 3.0])
def test_limit_point_is_not_jumped(load: float) -> None:
    """Under a dead load the arch snaps at lambda = limit / load: the path ends there and says why."""
    system = Arch(load)
    found = finish(system, LoadControl(), np.array([-1.0]))
    assert found[-1].outcome != "reached"
    assert found[-1].note
    critical = Arch.limit / load
    assert found[-1].point.lam <= critical
    assert found[-1].point.lam > 0.9 * critical  # and does not give up long before
    for step in found:
        assert step.point.q[0] <= -1.0 / math.sqrt(3.0) + 1e-3  # still on the branch that it began on
    # the last increment is not counted as an accepted state
    assert found[-1].point.q == pytest.approx(found[-2].point.q)


def test_buckling_is_followed_and_noted() -> None:
    """The column stays straight up to 0.3 and then bends: one note, stable states, lowest energy."""
    found = finish(Column(), LoadControl(), np.zeros(2))
    assert [step.outcome for step in found] == ["reached"] * len(found)
    notes = [step for step in found if step.note]
    assert len(notes) == 1
    assert notes[0].point.lam > 0.3
    for step in found:
        assert step.stable is True
        u, w = step.point.q
        if step.point.lam > 0.3:
            assert w * w == pytest.approx((u - 0.3) / 2.0, abs=1e-7)
        else:
            assert abs(w) < 1e-9


def test_objections_cut_the_increment() -> None:
    """A system that mistrusts steps of more than 0.05 gets small steps, and every cut is kept with its reason."""

    class Wary(Springs):
        def objection(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
            return "too far" if lam_new - lam > 0.05 else ""

    found = finish(Wary(), LoadControl(), np.zeros(3))
    assert found[-1].point.lam == 1.0
    assert np.diff([0.0, *[s.point.lam for s in found]]).max() <= 0.05
    assert "too far" in found[0].cuts[0]


def test_giving_up_keeps_the_last_state() -> None:
    class Stubborn(Springs):
        def objection(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
            return "no further" if lam_new > 0.4 else ""

    found = finish(Stubborn(), LoadControl(smallest=0.01), np.zeros(3))
    assert found[-1].outcome == "stalled"
    assert "no further" in found[-1].note
    assert 0.35 < found[-1].point.lam <= 0.4
    assert all(step.outcome == "reached" for step in found[:-1])


def test_a_history_is_taken_up() -> None:
    """Going on from three points with the stored increment repeats what an unbroken walk does."""
    system, strategy = Stiffening(), LoadControl()
    whole = finish(system, strategy, np.zeros(1))
    assert len(whole) > 4
    points = [point(system, np.zeros(1), 0.0), *[step.point for step in whole]]
    rest = list(walk(Walk(system, strategy, tuple(points[1:4]), whole[2].next_increment)))
    assert [s.point.lam for s in rest] == [s.point.lam for s in whole[3:]]
    assert [s.point.q[0] for s in rest] == [s.point.q[0] for s in whole[3:]]


def test_slow_contraction() -> None:
    """The first four steps say nothing; then each must halve that of two iterations before."""
    assert not slow([1.0, 2.0, 3.0, 4.0])
    assert slow([1.0, 2.0, 3.0, 2.0, 2.0])
    assert not slow([1.0, 2.0, 3.0, 2.0, 1.0])


def test_a_hasty_newton_gives_up_early() -> None:
    """Energy |q|^1.55: every iterate is -0.82 times the one before, and two steps shrink by a third only."""

    class Sharp(Small):
        def internal(self, q: Array) -> tuple[float, Array, Array]:
            size = np.abs(q)
            return float((size**1.55).sum()), 1.55 * np.sign(q) * size**0.55, np.diag(0.8525 * size**-0.45)

    patient, hasty = (
        Newton(globalised=0, hasty=haste).solve(Sharp(1, [0.0]), np.array([1.0]), 1.0)
        for haste in (False, True)
    )
    assert not patient.converged
    assert not hasty.converged
    assert (patient.iterations, hasty.iterations) == (14, 4)
    assert hasty.reason == "slow contraction"


def test_a_long_increment_is_told_from_a_jump_by_the_slopes_of_the_work() -> None:
    """Work lambda^5: the trapezoidal rule is off by 30 % of the last power, with the slopes by 3 %; a jump is seen."""

    class Power(Small):
        def control_rate(self, q: Array, lam: float) -> Array:
            return np.zeros(1)

        def control_stiffness(self, q: Array, lam: float) -> float:
            return 20.0 * lam**3

        def internal(self, q: Array) -> tuple[float, Array, Array]:
            return 0.0, np.zeros(1), np.eye(1)

    system, strategy = Power(1, [0.0]), LoadControl()
    a, b = (Point(lam, np.zeros(1), np.zeros(1), lam**5, 5.0 * lam**4) for lam in (0.0, 1.0))
    assert abs(1.0 - 0.5 * (a.power + b.power)) > strategy.work_mismatch * b.power
    assert jump(system, a, b, strategy.work_mismatch) == ""
    assert "not the work" in jump(system, a, replace(b, energy=4.0), strategy.work_mismatch)


def test_other_newton() -> None:
    strategy = LoadControl(goal=3, newton=Newton(full=2))
    assert strategy.newton.full == 2
    assert strategy.goal == 3


def test_linear_response_of_springs() -> None:
    system = Springs()
    found = linear_response(system, np.zeros(3))
    exact = np.linalg.solve(system.K, system.load)
    assert found.dq == pytest.approx(exact)
    assert found.energy == pytest.approx(-0.5 * float(system.load @ exact))


@pytest.mark.parametrize("seed", range(3))
def test_neutral_mode_is_left_alone(seed: int) -> None:
    """Along a mode without stiffness no state is unstable; Newton's steps keep off it and are exact else."""
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.normal(size=(8, 8)))[0]
    stiffness = np.array([-1e-9, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0])
    matrix = band(Q @ np.diag(stiffness) @ Q.T)
    found = neutral_mode(matrix, 8)
    assert found is not None
    assert found.negative
    assert abs(found.mode @ Q[:, 0]) == pytest.approx(1.0, abs=1e-8)
    assert count_negative(matrix) == 0
    b = rng.normal(size=8)
    factor = matrix.factorise_any()[0]
    x = without(factor, factor.solve(b), found.mode)
    assert x == pytest.approx(Q[:, 1:] @ ((Q[:, 1:].T @ b) / stiffness[1:]), abs=1e-5)


@pytest.mark.parametrize("soft", [1e-12, 1e-6, 1e-3, 0.5])
def test_softness(soft: float) -> None:
    """The ratio of the two softest modes, from solves alone; with multipliers on what the constraints leave."""
    rng = np.random.default_rng(4)
    Q = np.linalg.qr(rng.normal(size=(30, 30)))[0]
    stiffness = np.concatenate(([soft, 1.0], np.linspace(30.0, 1e3, 28)))
    matrix = band(Q @ np.diag(stiffness) @ Q.T)
    assert softness(matrix.factorise(), 30) == pytest.approx(soft, rel=2e-3, abs=1e-13)
    row = ConstraintRows(
        Q[None, :, 0].copy(), np.arange(30)[None], 30
    )  # what holds the soft mode leaves 1 and 30
    augmented = band(Q @ np.diag([1e4, *stiffness[1:]]) @ Q.T)
    held = MultiplierMatrix(augmented, row, np.array([1e4]), np.array([1e-9]))
    assert softness(held.factorise(), 30) == pytest.approx(1.0 / 30.0, rel=0.2)
    assert softness(band(np.eye(1)).factorise(), 1) == 1.0


@pytest.mark.parametrize("stiffness", [-1e-5, -0.5])
def test_soft_modes_are_no_neutral_ones(stiffness: float) -> None:
    rng = np.random.default_rng(1)
    Q = np.linalg.qr(rng.normal(size=(5, 5)))[0]
    matrix = band(Q @ np.diag([stiffness, 1.0, 2.0, 3.0, 4.0]) @ Q.T)
    assert neutral_mode(matrix, 5) is None
    assert count_negative(matrix) == 1
    assert count_negative(matrix, KNOWN_GAP) == (1 if stiffness < -KNOWN_GAP else 0)
