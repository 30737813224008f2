"""Equilibrium from given positions: a known shape as the initial guess of a model's last step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.errors import ModelError
from bh.formulations.registry import formulation
from bh.formulations.state import State
from bh.loading.program import program
from bh.model.model import Model
from bh.runtime.threads import one_blas_thread
from bh.solvers.newton import Newton

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Relaxed:
    """What came of a guess.

    Attributes:
        state: the equilibrium where `converged`, else where the search ended.
        iterations: factorisations that moved the sheet.
        moved: (n,) distances of the nodes from the guess, mm; a free sheet also moves as a rigid body.
        reason: why it did not converge, or an empty string.
    """

    state: State
    converged: bool
    iterations: int
    moved: Array
    reason: str


def relax(model: Model, points: ArrayLike, newton: Newton | None = None) -> Relaxed:
    """The equilibrium at the end of a model's only step, from node positions `points` (n, 3), mm, in one solve.

    Supports and imposed angles are those of the end of the step. Nothing says that the branch is the one that folding
    reaches: compare the energies.

    Raises:
        ModelError: a model of other than one step, or positions that do not fit.
    """
    if len(model.steps) != 1:
        raise ModelError(
            f"relax takes a model of one step, this one has {len(model.steps)}; give the last one alone"
        )
    x = np.asarray(points, dtype=float)
    if x.shape != model.mesh.points.shape or not np.isfinite(x).all():
        raise ModelError(
            f"positions have shape {x.shape}; give a finite array {model.mesh.points.shape} in mm"
        )
    form = formulation(model.formulation)
    system = form.system(model, program(model)[0], None)
    with one_blas_thread():
        # the least-squares displacement of the unknowns, which are components in orthonormal axes
        start = system.positions(np.zeros(system.size), 1.0)
        q = system.loads(x - start) if hasattr(system, "loads") else None
        if q is None:
            raise ModelError(
                f"formulation '{model.formulation}' cannot start from positions; use another one"
            )
        found = (newton or Newton()).solve(system, q, 1.0)
    state = form.observe(model, system, found.q, 1.0, 0, found.stable)
    moved = np.linalg.norm(state.points - x, axis=1)
    return Relaxed(state, found.converged, found.iterations, moved, found.reason)
