"""Linearised buckling: at which multiple of a load a solved state loses its stability, and how it moves away.

The load's first-order response dq and the rate of change of the tangent along it, K' = dK(q + s dq, s)/ds at s = 0,
give (K + f K') u = 0: the factors f are the loads in parts of the one given, their u the modes. That is exact where the
sheet answers the load along a straight line up to there, as a plate or a column pressed in its plane; where it bends
beforehand it is a first guess, and `bh.trace` follows the path itself and tells where it loses its stability.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.protocols import SheetSystem
from bh.model.step import Actuation
from bh.paths.path import Path
from bh.runtime.one_line import OneLine
from bh.runtime.threads import one_blas_thread
from bh.solvers.factor import Factor, Matrix
from bh.solvers.matrices import FreeBodyMatrix, IndefiniteError
from bh.solvers.saddle import MultiplierMatrix
from bh.solvers.system import hessian

Array = NDArray[np.float64]
SMALL = 1e-5  # response at which the tangent is differenced, in parts of the sheet's extent
NONE = 1e-6  # inverse factors below this part of the largest, of either sign, are rounding
DENSE = 40  # unknowns a mode up to which all modes are found at once


@dataclass(frozen=True, eq=False, repr=False)
class BucklingMode(OneLine):
    """A way in which a sheet leaves its state.

    Attributes:
        factor: by what the load is multiplied when it does, > 0.
        shape: (n, 3) displacements; the largest component is 1.
    """

    factor: float
    shape: Array


def buckling_modes(path: Path, *load: Actuation, count: int = 3) -> list[BucklingMode]:
    """The lowest buckling loads of a state under a load, by the tangent and its rate of change along the load.

    Args:
        path: solved up to the state that the load is put on; `bh.Path(model)` for the stress-free sheet of a model
            without steps.
        load: what comes on: forces, displacements, weight.
        count: how many modes at most.

    Returns:
        by rising factor; fewer, or none, where the load does not make the sheet buckle this way.

    Raises:
        ModelError: nothing is to come on, the state is not stable or hangs free, or bars and hinges impose creases.
    """
    if not load:
        raise ModelError("buckling needs a load; give bh.Force(...), bh.Displace(...) or bh.Weight(...)")
    if count < 1:
        raise ModelError(f"count = {count} cannot be; give 1 or more")
    if path.records and not path.reached:
        raise ModelError(f"the path ended early ({path.outcome}); there is no state to put the load on")
    loaded = Path(path.model.step(*load))
    loaded.take_over(path)
    system = loaded.system(len(path.model.steps))
    with one_blas_thread():
        q = system.start()
        found = _modes(system, q, count, loaded.model.mesh.size)
        return [BucklingMode(factor, _shape(system, u)) for factor, u in found]


def _modes(system: SheetSystem, q: Array, count: int, extent: float) -> list[tuple[float, Array]]:
    """Factors and motions (n,) of a sheet of some extent (mm), found in the metric of the tangent."""
    matrix = hessian(system, q, 0.0)
    if isinstance(matrix, FreeBodyMatrix):
        raise ModelError("a sheet that hangs free has no buckling load; add supports that carry the load")
    if isinstance(matrix, MultiplierMatrix):
        raise ModelError(
            "bars and hinges whose creases are imposed exactly have no buckling load here; fold by springs "
            "(Lstar = ...), or take formulation = 'consistent'"
        )
    try:
        factor = matrix.factorise()
    except IndefiniteError:
        raise ModelError(
            "the state is not stable, so it cannot buckle; put the load on a stable one"
        ) from None
    dq = -factor.solve(system.control_rate(q, 0.0))
    size = float(np.abs(dq).max(initial=0.0))
    if size == 0.0:
        raise ModelError(
            "the load does nothing to this sheet; give one that its supports do not carry at once"
        )
    s = SMALL * extent / size
    near, far = (hessian(system, q + part * dq, part) for part in (0.5 * s, s))

    def softens(u: Array) -> Array:
        # minus K' u, by one-sided differences of second order: a step has no load before it
        return np.asarray(-(4.0 * (near @ u) - far @ u - 3.0 * (matrix @ u)) / s)

    return _softest(matrix, factor, softens, len(q), count)


def _softest(
    matrix: Matrix, factor: Factor, softens: Callable[[Array], Array], size: int, count: int
) -> list[tuple[float, Array]]:
    """The largest eigenvalues mu = 1 / f > 0 of `softens`(u) = mu K u, as factors f with their motions."""
    if size <= DENSE * count:
        units = np.eye(size)
        soft, stiff = (np.column_stack([times(u) for u in units]) for times in (softens, matrix.__matmul__))
        triangular = np.linalg.cholesky(0.5 * (stiff + stiff.T))
        half = np.linalg.solve(triangular, 0.5 * (soft + soft.T))
        mu, Y = np.linalg.eigh(np.linalg.solve(triangular, half.T))
        U = np.linalg.solve(triangular.T, Y)
    else:
        from scipy.sparse.linalg import LinearOperator, eigsh

        whole = partial(LinearOperator, (size, size), dtype=float)
        mu, U = eigsh(
            whole(matvec=lambda u: softens(np.ravel(u))),
            k=count,
            M=whole(matvec=lambda u: matrix @ np.ravel(u)),
            Minv=whole(matvec=lambda b: factor.solve(np.ravel(b))),
            which="LA",
            v0=np.random.default_rng(20).normal(size=size),  # the same input gives the same modes
        )
    best = np.argsort(-mu)[:count]
    least = NONE * max(float(np.abs(mu).max()), _size(factor, softens, size))
    return [(1.0 / float(mu[k]), U[:, k]) for k in best if mu[k] > least]


def _size(factor: Factor, softens: Callable[[Array], Array], size: int) -> float:
    """About the largest eigenvalue, whatever its sign, by the power method."""
    u = np.random.default_rng(21).normal(size=size)
    growth = 0.0
    for _ in range(8):
        u /= np.linalg.norm(u)
        u = factor.solve(softens(u))
        growth = float(np.linalg.norm(u))
        if growth == 0.0:
            break
    return growth


def _shape(system: SheetSystem, u: Array) -> Array:
    """(n, 3) displacements of the nodes, the largest component 1."""
    moved = system.vectors(u)
    return np.asarray(moved / moved.ravel()[np.abs(moved).argmax()])
