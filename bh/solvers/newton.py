"""Newton's method for one value of lambda: full steps with independent forces, or globalised by a line search.

Where both stop, a pseudo-transient motion to rest is the last resort (`bh.solvers.pseudo_transient`).
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bh.solvers.creeping import CREEPS, creeping, diverged, slow
from bh.solvers.factor import Descent, Factor, IndefiniteError, Matrix
from bh.solvers.lagging import Guess, lagged
from bh.solvers.modes import (
    GAP,
    KNOWN_GAP,
    NEUTRAL,
    ROUNDED,
    count_and_factor,
    factorise_shifted,
    lowest_mode,
    without,
)
from bh.solvers.points import Factorised
from bh.solvers.pseudo_transient import PseudoTransient
from bh.solvers.system import Evaluation, Rounded, System, limited

Array = NDArray[np.float64]
INDEFINITE = "indefinite tangent"  # why full Newton gave up
ALONG = "out of balance along the neutral mode"
NEUTRAL_IMBALANCE = 100.0  # of the tolerance: what a neutral mode may have
HIDING = 1e-3  # forces of rounding over the typical one, above which a guess in balance may only look so
FALL = 1e-9  # part of the energy that a step has to gain to show it
NO_STEP = 1e-10  # of the unknowns: a step that changes nothing
ENDLESS = 1e100  # size of a step that a singular tangent has made
NEAR_SADDLE = 1e-3  # imbalance below which an indefinite tangent is that of a saddle


@dataclass(frozen=True)
class Solution:
    """What came of one solve; `q` is only an equilibrium where `converged`.

    `iterations` counts factorisations that moved the state; `negative` the negative eigenvalues of the Hessian there
    (on the null space of the constraints; 0: stable), None where that was not looked at. `factorised` is what they
    were counted from, if it was to be kept.
    """

    q: Array
    evaluation: Evaluation
    iterations: int
    converged: bool
    reason: str = ""
    negative: int | None = None
    globalised: bool = False
    factorised: Factorised | None = field(default=None, compare=False)

    @property
    def stable(self) -> bool | None:
        """True if no mode is negative, None where that was not looked at."""
        return None if self.negative is None else not self.negative

    def after(self, iterations: int) -> Solution:
        """The same with iterations that were spent before."""
        return replace(self, iterations=iterations + self.iterations)


@dataclass(frozen=True)
class Newton:
    """Solve residual(q) = 0 at a fixed lambda.

    First full Newton: whole steps with the tangent of independent element forces, which takes the large rotations of
    thin sheets in a few iterations though the energy rises on the way. If that does not converge, once more from the
    start and globalised: the exact Hessian, shifted until it is positive definite, and a line search on the energy,
    which can only go downhill.

    Attributes:
        tolerance: on `Evaluation.imbalance`.
        full, globalised: most iterations of either way.
        full_shift: largest shift of full Newton; a tangent that is more indefinite asks for the globalised way.
        transient: the last resort; None to do without.
        hasty: give full Newton up where its steps contract too slowly; for increments that are cheaper cut than saved.
        held: (primal,) a neutral mode that full steps leave alone (`bh.solvers.modes.neutral_mode`), None without one.
        unstable: take indefinite tangents as they are and take full steps only, to stay on a branch that is not stable.
        impatient: give the globalised way up where it creeps next to a state: what is left is along a mode that hardly
            resists, and `bh.solvers.phase.settle` may go there at once.
        keep: hand on the tangent and the factor of the state that is found (`Solution.factorised`); they take memory.
    """

    tolerance: float = 1e-8
    full: int = 14
    globalised: int = 150
    full_shift: float = 1e-5
    transient: PseudoTransient | None = field(default_factory=PseudoTransient)
    hasty: bool = False
    held: Array | None = None
    unstable: bool = False
    impatient: bool = False
    keep: bool = False

    def solve(
        self,
        system: System,
        q: Array,
        lam: float,
        forces: Array | None = None,
        second_guess: Guess | None = None,
    ) -> Solution:
        """Equilibrium at `lam` from the guess `q`; `forces` are the element forces that go with the guess.

        Args:
            system: whose equilibrium is sought.
            q: (n,) guess.
            lam: load parameter of the step, 0 to 1.
            forces: (f,) element forces that go with the guess; None for those of the system there.
            second_guess: makes unknowns and forces of another guess, for full Newton before the globalised way.
        """
        return lagged(self._solve, system, q, lam, forces, second_guess)

    def _solve(
        self, system: System, q: Array, lam: float, forces: Array | None, second_guess: Guess | None
    ) -> Solution:
        first = self.solve_full(system, q, lam, forces)
        if first.reason == ALONG:
            return first
        if not first.converged and second_guess is not None:
            spent = first.iterations
            other, other_forces = second_guess()
            first = self.solve_full(system, other, lam, other_forces)
            first = replace(first, iterations=first.iterations + spent)
        if first.converged or first.reason == ALONG or self.globalised == 0 or self.unstable:
            return first
        second = self.solve_globalised(system, q, lam)
        second = replace(second, iterations=first.iterations + second.iterations)
        if second.converged or self.transient is None:
            return second
        q, now, steps = self.transient.relax(system, second.q, lam, self.tolerance)
        if now.imbalance > self.tolerance:
            return replace(second, iterations=second.iterations + steps)
        return self._finish(system, q, lam, now, second.iterations + steps, globalised=True)

    def solve_full(self, system: System, q: Array, lam: float, forces: Array | None = None) -> Solution:
        """Full steps with independent forces; gives up on an indefinite tangent or when it runs away.

        Args:
            system: whose equilibrium is sought.
            q: (n,) guess.
            lam: load parameter of the step, 0 to 1.
            forces: (f,) element forces that go with the guess; None for those of the system there.
        """
        return exhaust(self.full_steps(system, q, lam, forces))

    def full_steps(
        self, system: System, q: Array, lam: float, forces: Array | None = None
    ) -> Generator[Array, None, Solution]:
        """`solve_full` one step at a time, for who has other things to do in between.

        Args:
            system: whose equilibrium is sought.
            q: (n,) guess.
            lam: load parameter of the step, 0 to 1.
            forces: (f,) element forces that go with the guess; None for those of the system there.

        Yields:
            (n,) unknowns after every step.

        Returns:
            what came of it.
        """
        now = system.evaluate(q, lam)
        if not np.isfinite(now.energy):
            return Solution(q, now, 0, False, "the guess has no energy")
        forces = now.forces if forces is None else forces
        least, before = now.imbalance, np.inf
        sizes: list[float] = []  # of the steps taken
        for iteration in range(self.full):
            if now.imbalance <= self.tolerance:
                return self._finish(system, q, lam, now, iteration, globalised=False)
            tangent = system.tangent(q, lam, forces)
            factor = self._full_factor(tangent.matrix)
            if factor is None:
                return Solution(q, now, iteration, False, INDEFINITE)
            dq = self._full_step(factor, now.residual)
            if not float(np.abs(dq).max(initial=0.0)) < ENDLESS:
                return Solution(q, now, iteration, False, "singular tangent")
            if self._exhausted(system, now, before, dq) or self._is_no_step(q, dq):
                if now.imbalance <= NEUTRAL_IMBALANCE * self.tolerance:
                    return self._finish(system, q, lam, now, iteration, globalised=False)
                return Solution(q, now, iteration, False, ALONG)
            dq = limited(system, q, dq, lam)
            sizes.append(float(np.linalg.norm(dq[: system.primal])))
            if self.hasty and now.imbalance > NEAR_SADDLE and slow(sizes):
                return Solution(q, now, iteration, False, "slow contraction")
            forces = tangent.predicted_forces(now.forces, dq)
            q, before = q + dq, now.imbalance
            now = system.evaluate(q, lam)
            if diverged(now, least):
                return Solution(q, now, iteration + 1, False, "diverged")
            least = min(least, now.imbalance)
            yield q
        if now.imbalance <= self.tolerance:
            return self._finish(system, q, lam, now, self.full, globalised=False)
        return Solution(q, now, self.full, False, "iteration limit")

    def _full_step(self, factor: Factor, residual: Array) -> Array:
        dq = -factor.solve(residual)
        return dq if self.held is None else without(factor, dq, self.held)

    def _is_no_step(self, q: Array, dq: Array) -> bool:
        """Whether all but the neutral mode that is left alone is in balance."""
        return self.held is not None and float(np.linalg.norm(dq)) < NO_STEP * float(np.linalg.norm(q))

    def _full_factor(self, matrix: Matrix) -> Factor | None:
        if not self.unstable:
            return factorise_shifted(matrix, 0.0, self.full_shift)[0]
        try:
            return matrix.factorise_any()[0]
        except IndefiniteError:
            return None

    def solve_globalised(self, system: System, q: Array, lam: float) -> Solution:
        """Minimise the energy: shifted Newton with an Armijo line search in the primal unknowns.

        Args:
            system: whose equilibrium is sought.
            q: (n,) guess.
            lam: load parameter of the step, 0 to 1.
        """
        return exhaust(self.globalised_steps(system, q, lam))

    def globalised_steps(self, system: System, q: Array, lam: float) -> Generator[Array, None, Solution]:
        """`solve_globalised` one step at a time.

        Args:
            system: whose equilibrium is sought.
            q: (n,) guess.
            lam: load parameter of the step, 0 to 1.

        Yields:
            (n,) unknowns after every step.

        Returns:
            what came of it.
        """
        now = system.evaluate(q, lam)
        shift, least, before = 0.0, ROUNDED, np.inf
        merits: list[float] = []
        for iteration in range(self.globalised):
            if now.imbalance <= self.tolerance:
                return self._finish(system, q, lam, now, iteration, globalised=True)
            merits.append(now.merit)
            if self.impatient and now.imbalance < NEAR_SADDLE and creeping(merits):
                return Solution(q, now, iteration, False, CREEPS, globalised=True)
            matrix = system.tangent(q, lam, now.forces).matrix
            if shift < 1e-9 and 0.5 * before < now.imbalance < 0.1:
                least = NEUTRAL  # modes as soft as the shift converge no better than linearly with it
            factor, shift = factorise_shifted(matrix, shift, least=least)
            if factor is None:
                return Solution(q, now, iteration, False, "singular tangent", globalised=True)
            descent = factor.descend(now.residual)
            dq = descent.direction
            if self._exhausted(system, now, before, dq):
                return self._finish(system, q, lam, now, iteration, globalised=True)
            if shift > 1e-9 and now.imbalance < NEAR_SADDLE:
                # nearly at rest where the tangent is indefinite: without a push it would take for ever to roll off
                rolled = roll_off(system, q, lam, now, matrix)
                if rolled is not None:
                    q, now = rolled
                    continue
            near = shift < 1e-9 and now.imbalance < 0.1
            step = full_step(system, q, lam, now, -factor.solve(now.residual)) if near else None
            step = step or line_search(system, q, lam, now, descent)
            if step is None:
                if shift > 1e3:
                    return Solution(q, now, iteration, False, "no descent", globalised=True)
                shift = max(10.0 * shift, 1e-4)
                continue
            before = now.imbalance
            q, now, length = step
            shift = 0.1 * shift if length > 0.5 else shift
            yield q
        if now.imbalance <= self.tolerance:
            return self._finish(system, q, lam, now, self.globalised, globalised=True)
        return Solution(q, now, self.globalised, False, "iteration limit", globalised=True)

    def _exhausted(self, system: System, now: Evaluation, before: float, dq: Array) -> bool:
        """Nearly balanced, getting no better, and what energy the step could still gain is rounding.

        So it is along a neutral mode, such as the phase of the waves of a buckled ring, whose tiny residual no step
        can remove.
        """
        p = system.primal
        gain = abs(float(now.residual[:p] @ dq[:p]))
        stuck = 0.5 * before <= now.imbalance <= NEUTRAL_IMBALANCE * self.tolerance
        return stuck and gain <= 1e-13 * abs(now.energy)

    def _finish(
        self, system: System, q: Array, lam: float, now: Evaluation, iterations: int, globalised: bool
    ) -> Solution:
        if iterations == 0 and not self.unstable:
            q, now, iterations = self._past_rounding(system, q, lam, now)
        tangent = system.tangent(q, lam, now.forces)
        negative, factor = count_and_factor(tangent.matrix, GAP if self.held is None else KNOWN_GAP)
        kept = Factorised(tangent, factor) if self.keep else None
        return Solution(q, now, iterations, True, "", negative, globalised, kept)

    def _past_rounding(
        self, system: System, q: Array, lam: float, now: Evaluation
    ) -> tuple[Array, Evaluation, int]:
        """A step from a guess that was in balance as it was, where rounding hides the forces under tiny loads.

        They are sums of large ones along stiff directions; what bends the sheet is known much better, so the step is
        good where the balance says nothing. It is kept where the energy falls by it.
        """
        if not isinstance(system, Rounded) or system.rounding(q, lam) < HIDING:
            return q, now, 0
        factor = self._full_factor(system.tangent(q, lam, now.forces).matrix)
        if factor is None:
            return q, now, 0
        there = q + limited(system, q, self._full_step(factor, now.residual), lam)
        then = system.evaluate(there, lam)
        if then.imbalance > self.tolerance or not now.energy - then.energy > FALL * abs(then.energy):
            return q, now, 0
        return there, then, 1


def exhaust(steps: Generator[Array, None, Solution]) -> Solution:
    """All steps of a solve, one after another.

    Args:
        steps: of `Newton.full_steps` or `Newton.globalised_steps`.

    Returns:
        what came of it.
    """
    while True:
        try:
            next(steps)
        except StopIteration as end:
            found: Solution = end.value
            return found


def roll_off(
    system: System, q: Array, lam: float, now: Evaluation, matrix: Matrix
) -> tuple[Array, Evaluation] | None:
    """From next to a saddle down along the direction of most negative curvature, as far as the merit falls.

    None where no curvature is negative but for rounding (More and Sorensen 1979 use such steps).

    Args:
        system: whose equilibrium is sought.
        q: (n,) unknowns.
        lam: load parameter of the step, 0 to 1.
        now: the system's evaluation there.
        matrix: its tangent.

    Returns:
        (n,) unknowns and their evaluation, or None.
    """
    p = system.primal
    try:
        curvature, mode = lowest_mode(matrix, len(q), p, tolerance=1e-3)
    except IndefiniteError:
        return None
    if curvature >= 0.0:
        return None
    sense = -1.0 if float(now.residual[:p] @ mode[:p]) > 0.0 else 1.0
    step = sense * 1e-3 * (float(np.ptp(q[:p])) or 1.0) / float(np.abs(mode).max()) * mode
    best, found = now.merit, None
    for _ in range(12):
        there = system.evaluate(q + step, lam)
        if not (np.isfinite(there.merit) and there.merit < best):
            break
        best, found = there.merit, (q + step, there)
        step = 2.0 * step
    return found


def full_step(
    system: System, q: Array, lam: float, now: Evaluation, dq: Array
) -> tuple[Array, Evaluation, float] | None:
    """Newton's whole step where it at least halves the imbalance; close to a solution it does far better.

    Args:
        system: whose equilibrium is sought.
        q: (n,) unknowns.
        lam: load parameter of the step, 0 to 1.
        now: the system's evaluation there.
        dq: (n,) Newton's step.

    Returns:
        (n,) unknowns, their evaluation and the part of the step that was taken; None where the imbalance does not
        halve.
    """
    there = system.evaluate(q + dq, lam)
    return (q + dq, there, 1.0) if there.imbalance < 0.5 * now.imbalance else None


def line_search(
    system: System,
    q: Array,
    lam: float,
    now: Evaluation,
    descent: Descent,
    most: int = 30,
    refused: Callable[[Array], bool] | None = None,
) -> tuple[Array, Evaluation, float] | None:
    """Step along a direction that lowers the merit enough (Armijo); None if there is none.

    Multipliers are changed before and held while looking.

    Args:
        system: whose equilibrium is sought.
        q: (n,) unknowns.
        lam: load parameter of the step, 0 to 1.
        now: the system's evaluation there.
        descent: the direction and its slopes.
        most: steps tried, each shorter than the one before.
        refused: whether unknowns (n,) are none to step to, however low; None where all are.

    Returns:
        (n,) unknowns, their evaluation and the part of the step that was taken, or None.
    """
    p = system.primal
    dq, slope = descent.direction, descent.slope
    start = q
    if len(q) > p:
        start = q.copy()
        start[p:] += dq[p:]
        now = system.evaluate(start, lam)
    dq = limited(system, start, dq, lam)
    noise = 1e-13 * max(abs(now.merit), abs(slope))
    if slope > noise:
        return None
    length = 1.0
    for _ in range(most):
        trial = start.copy()
        trial[:p] += length * dq[:p]
        there = system.evaluate(trial, lam)
        low = there.merit <= now.merit + 1e-4 * length * min(slope, 0.0) + noise
        if np.isfinite(there.energy) and low and not (refused and refused(trial)):
            return trial, there, length
        gain = there.merit - now.merit - length * slope
        best = -0.5 * slope * length**2 / gain if np.isfinite(gain) and gain > 0.0 else 0.0
        length = min(max(best, 0.1 * length), 0.5 * length)
    return None
