"""Pseudo-transient continuation: follow a damped motion to rest, in ever longer steps (Kelley and Keyes 1998)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.solvers.matrices import IndefiniteError
from bh.solvers.system import Evaluation, System

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PseudoTransient:
    """Implicit Euler steps of D dq/dt = - d merit / dq, with D the diagonal of the tangent.

    A long step is one of Newton's method, a short one follows the steepest descent in the norm of D. The step grows as
    the residual falls (switched evolution relaxation) and is halved where the merit rises or the shifted tangent is
    not definite; so it creeps through narrow curved valleys in which a line search comes to a stop.

    Attributes:
        shift: first 1 / time step.
        most: steps before giving up.
    """

    shift: float = 1.0
    most: int = 100
    largest: float = 1e8

    def relax(self, system: System, q: Array, lam: float, tolerance: float) -> tuple[Array, Evaluation, int]:
        """State, its evaluation and the number of steps taken; at rest where the imbalance is within `tolerance`.

        Args:
            system: whose equilibrium is sought.
            q: (n,) unknowns to begin with.
            lam: load parameter of the step, 0 to 1.
            tolerance: relative imbalance of a state at rest.

        Returns:
            (n,) unknowns, their evaluation, and the steps.
        """
        p = system.primal
        now = system.evaluate(q, lam)
        shift, steps = self.shift, 0
        for _ in range(4 * self.most):
            if now.imbalance <= tolerance or steps >= self.most or shift > self.largest:
                break
            try:
                # below rounding there is nothing to damp, and the last steps are Newton's
                matrix = system.tangent(q, lam, now.forces).matrix
                factor = matrix.factorise(shift if shift > 1e-11 else 0.0)
            except IndefiniteError:
                shift = max(4.0 * shift, 1e-9)
                continue
            descent = factor.descend(now.residual)
            base, start = now, q.copy()
            if len(q) > p:
                start[p:] += descent.direction[p:]
                base = system.evaluate(start, lam)
            trial = start.copy()
            trial[:p] += descent.direction[:p]
            there = system.evaluate(trial, lam)
            noise = 1e-12 * max(abs(base.merit), abs(there.merit))
            if not (np.isfinite(there.energy) and there.merit <= base.merit + noise):
                shift = max(4.0 * shift, 1e-9)
                continue
            steps += 1
            ratio = there.imbalance / now.imbalance
            shift *= min(2.0, max(0.1, ratio))
            q, now = trial, there
        return q, now, steps
