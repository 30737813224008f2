"""Newton's method with lambda as an unknown: every iterate stays on a hyperplane through the guess."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.solvers.matrices import IndefiniteError
from bh.solvers.system import Evaluation, System

Array = NDArray[np.float64]


class Correction(NamedTuple):
    """What came of it; an equilibrium only where `reason` is empty."""

    q: Array
    lam: float
    evaluation: Evaluation
    iterations: int
    reason: str


def correct(
    system: System, q: Array, lam: float, forces: Array, normal: Array, tolerance: float, most: int = 14
) -> Correction:
    """Equilibrium (q, lambda) nearest to the guess with normal . dq = 0, by full steps with independent forces.

    `normal` (primal,) is that of the hyperplane in the primal unknowns. Stable or not: the tangent may be indefinite
    (Riks 1979; Wempner 1971; Batoz and Dhatt 1979 for a normal along one unknown).

    Args:
        system: whose equilibrium is sought.
        q: (n,) guess of the unknowns.
        lam: guess of the load parameter.
        forces: (f,) element forces that go with the guess.
        normal: (primal,) of the hyperplane, in the primal unknowns.
        tolerance: relative imbalance that is asked for.
        most: steps at most.
    """
    p = system.primal
    for iteration in range(most):
        now = system.evaluate(q, lam)
        if not np.isfinite(now.energy):
            return Correction(q, lam, now, iteration, "diverged")
        if now.imbalance <= tolerance:
            return Correction(q, lam, now, iteration, "")
        tangent = system.tangent(q, lam, forces)
        try:
            factor, _ = tangent.matrix.factorise_any()
        except IndefiniteError:
            return Correction(q, lam, now, iteration, "singular tangent")
        a = -factor.solve(now.residual)
        b = -factor.solve(system.control_rate(q, lam))
        slope = float(normal @ b[:p])
        if slope == 0.0:
            return Correction(q, lam, now, iteration, "singular tangent")
        change = -float(normal @ a[:p]) / slope
        dq = a + change * b
        forces = tangent.predicted_forces(now.forces, dq)
        q, lam = q + dq, lam + change
    return Correction(q, lam, system.evaluate(q, lam), most, "iteration limit")
