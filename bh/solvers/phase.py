"""The neutral mode of a state that a solve has come next to: what moves along it costs next to nothing.

The waves of a buckled ring may turn round it. Only the cells of the mesh hold them, so Newton's method first finds
everything but their phase, and then creeps round the ring. Here the phase is walked to where the mesh holds it, in
steps of bounded length, each corrected by Newton's method that leaves the mode alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bh.solvers.factor import Matrix
from bh.solvers.modes import neutral_mode
from bh.solvers.newton import ALONG, NEAR_SADDLE, Newton, Solution
from bh.solvers.saddle import MultiplierMatrix
from bh.solvers.system import System

Array = NDArray[np.float64]
SOFT = 0.1  # of the next stiffness: a mode that the mesh holds, and nothing else
TURNS = 20  # steps round the ring at most
LENGTH = 0.03  # of a step, in parts of the displacements: a wave that turns by so much


def settle(system: System, found: Solution, lam: float, newton: Newton) -> Solution:
    """A solve that has stopped next to an equilibrium, gone on to it along the neutral mode there, if it has one.

    Args:
        system: whose equilibrium is sought.
        found: what has stopped; returned as it is where it has converged, is far off, or has no such mode.
        lam: load parameter of the step, 0 to 1.
        newton: settings.

    Returns:
        the equilibrium, or what was given, with the iterations spent.
    """
    if found.converged or not found.evaluation.imbalance < NEAR_SADDLE:
        return found
    p, q, now, spent = system.primal, found.q, found.evaluation, found.iterations
    method = replace(newton, hasty=False)
    for turn in range(TURNS):
        tangent = system.tangent(q, lam, now.forces)
        soft = neutral_mode(tangent.matrix, p, SOFT)
        if soft is None:
            break
        dq = np.zeros_like(q)
        if turn or found.reason == ALONG:
            dq[:p] = _step(tangent.matrix, soft.mode, now.residual[:p], float(np.linalg.norm(q[:p])))
        forces = tangent.predicted_forces(now.forces, dq)
        there = replace(method, held=soft.mode).solve_full(system, q + dq, lam, forces)
        spent += there.iterations
        if there.converged:
            return replace(there, iterations=spent)
        if not there.evaluation.imbalance < NEAR_SADDLE:
            break
        q, now = there.q, there.evaluation
    return replace(found, iterations=spent)


def _step(matrix: Matrix, mode: Array, residual: Array, size: float) -> Array:
    """(primal,) along the mode: Newton's own where that goes down, of bounded length."""
    matrix = matrix.augmented if isinstance(matrix, MultiplierMatrix) else matrix
    force, stiffness = float(mode @ residual), float(mode @ (matrix @ mode))
    length = LENGTH * size
    if stiffness > 0.0:
        length = min(length, abs(force) / stiffness)
    return np.asarray(-np.sign(force) * length * mode)
