"""Is an equilibrium stable, and if not, where does it go."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bh.solvers.matrices import IndefiniteError, Matrix
from bh.solvers.newton import Newton, Solution, factorise_shifted
from bh.solvers.saddle import MultiplierMatrix
from bh.solvers.system import System

Array = NDArray[np.float64]


def lowest_mode(
    matrix: Matrix, size: int, primal: int, iterations: int = 60, tolerance: float = 1e-6
) -> tuple[float, Array]:
    """Rayleigh quotient and mode (size,) of the lowest eigenvalue; multipliers (after `primal`) are zero in it.

    Inverse iteration with the shifted matrix K + s D (D = |diag K|), started from a fixed pseudo-random vector so that
    the same input gives the same mode. The mode has unit length and its largest component is positive.
    """
    # the penalty of the augmented matrix keeps its low modes in the null space of the constraints
    matrix = matrix.augmented if isinstance(matrix, MultiplierMatrix) else matrix
    factor, _ = factorise_shifted(matrix, 0.0, least=1e-11)
    if factor is None:
        raise IndefiniteError(1)
    mode = np.random.default_rng(20).normal(size=primal)
    quotient = np.inf
    for _ in range(iterations):
        mode = factor.solve(mode)
        mode /= np.linalg.norm(mode)
        before, quotient = quotient, float(mode @ (matrix @ mode))
        if abs(quotient - before) <= tolerance * abs(quotient):
            break
    whole = np.zeros(size)
    whole[:primal] = mode * np.sign(mode[np.argmax(np.abs(mode))])
    return quotient, whole


def leave_saddle(system: System, saddle: Solution, lam: float, newton: Newton) -> tuple[Solution, str]:
    """From an unstable equilibrium downhill along its lowest mode to a stable one at the same lambda.

    Returns the stable state and a note; if none of lower energy is found, the saddle itself and an empty note.
    """
    tangent = system.tangent(saddle.q, lam, saddle.evaluation.forces)
    _, mode = lowest_mode(tangent, len(saddle.q), system.primal)
    mode /= max(float(np.abs(mode).max()), 1e-300)
    size = float(np.ptp(saddle.q[: system.primal])) or 1.0
    spent = 0
    for amplitude in (1e-2, 5e-2, 2e-1):
        found = newton.solve_carefully(system, saddle.q + amplitude * size * mode, lam)
        spent += found.iterations
        lower = found.evaluation.energy < saddle.evaluation.energy
        if found.converged and found.stable and lower:
            note = f"left an unstable state at lambda {lam:.6g} along its lowest mode"
            return replace(found, iterations=spent), note
    return replace(saddle, iterations=0, reason="unstable and no stable state found nearby"), ""
