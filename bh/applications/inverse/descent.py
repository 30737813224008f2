"""Many candidates polished at once: damped Gauss-Newton steps inside the box, all designs of a step in one batch.

A model of strips takes about as long for one design as for hundreds, so polishing one candidate after another spends
nearly all of its time on the way into the arrays.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
STEP = 1e-7  # of the box, for differences
DAMPING = 1e-3  # of the mean square of the derivatives, at the start
STRAIGHT, BACK = 0.1, 8.0  # what the damping is multiplied by after a step down, and after one that was none
ENOUGH = 1e-6  # of the residuals' length (mm) at which a candidate is done


class Residuals(Protocol):
    """What is brought to zero: m variables in a box, and switches that stay as they are."""

    @property
    def lower(self) -> Array:
        """(m,) least values of the variables."""

    @property
    def upper(self) -> Array:
        """(m,) largest values of the variables."""

    def residuals(self, x: Array, on: Bools) -> Array:
        """(N, k) of candidates.

        Args:
            x: (N, m) variables.
            on: (N, b) switches.
        """
        ...


def descend(problem: Residuals, x: Array, on: Bools, steps: int = 30) -> Array:
    """Local minima of the residuals' lengths next to candidates, each with its own switches.

    Args:
        problem: what is brought to zero.
        x: (N, m) variables of the candidates; what lies outside the box is taken at its side.
        on: (N, b) their switches.
        steps: at most.

    Returns:
        (N, m) variables inside the box, none with longer residuals than its candidate in the box.
    """
    lower, width = problem.lower, np.maximum(problem.upper - problem.lower, 1e-300)
    z = np.clip((np.asarray(x, dtype=float) - lower) / width, 0.0, 1.0)
    r = problem.residuals(lower + width * z, on)
    damping = np.full(len(z), DAMPING)
    for _ in range(steps):
        at = np.flatnonzero((np.linalg.norm(r, axis=1) > ENOUGH) & (damping < 1e12))
        if not len(at):
            break
        trial = np.clip(z[at] + _step(problem, z[at], on[at], r[at], damping[at]), 0.0, 1.0)
        there = problem.residuals(lower + width * trial, on[at])
        down = np.linalg.norm(there, axis=1) < np.linalg.norm(r[at], axis=1)
        z[at[down]], r[at[down]] = trial[down], there[down]
        damping[at] *= np.where(down, STRAIGHT, BACK)
        damping = np.maximum(damping, 1e-12)
    found: Array = lower + width * z
    return found


def _step(problem: Residuals, z: Array, on: Bools, r: Array, damping: Array) -> Array:
    """(N, m) damped Gauss-Newton steps, the shortest ones; variables at a side that would be left stay there."""
    lower, width = problem.lower, np.maximum(problem.upper - problem.lower, 1e-300)
    count, m = z.shape
    inward = np.where(z > 0.5, -STEP, STEP)
    trial = z[:, None, :] + inward[:, None, :] * np.eye(m)
    there = problem.residuals(lower + width * trial.reshape(-1, m), np.repeat(on, m, axis=0))
    # (N, m, k): derivatives to each variable
    slope = (there.reshape(count, m, -1) - r[:, None, :]) / inward[:, :, None]
    gradient = np.einsum("nmk,nk->nm", slope, r)
    stuck = ((z <= 0.0) & (gradient > 0.0)) | ((z >= 1.0) & (gradient < 0.0))
    slope = np.where(stuck[:, :, None], 0.0, slope)
    square = np.einsum("nmk,nml->nkl", slope, slope)
    size = np.maximum(np.trace(square, axis1=1, axis2=2), 1e-300) / square.shape[1]
    square = square + (damping * size)[:, None, None] * np.eye(square.shape[1])
    step: Array = -np.einsum("nmk,nk->nm", slope, np.linalg.solve(square, r[..., None])[..., 0])
    return step
