"""Lowest modes K u = eigenvalue M u of a factorised tangent, with free motions, fixed directions, massless unknowns.

The eigenvalues are those of W R W, inverted, where R is the response to loads and W the root of the mass: unknowns
without mass (rotations, multipliers) follow statically, and the spectral transformation is at zero (Ericsson and Ruhe
1980), so that the lowest modes come out first whatever their sign.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.runtime.one_line import OneLine

Array = NDArray[np.float64]
FREE = 1e-13  # eigenvalues below this part of a typical one are rounding
DENSE = 150  # unknowns up to which modes are found from a dense matrix


@dataclass(frozen=True, eq=False, repr=False)
class Mode(OneLine):
    """A mode of small motion about a state.

    Attributes:
        eigenvalue: omega^2, 1/s^2, with a density; else stiffness against the displacements of all nodes, N/mm.
        shape: (n, 3) displacements; their squares, times the masses (t) if there is a density, add up to 1.
        name: what moves, in words.
        free: it costs no energy (a rigid motion that the supports leave, or a mechanism).
        frequency: Hz; nan without a density and where the eigenvalue is negative (the state is not stable).
    """

    eigenvalue: float
    shape: Array
    name: str
    free: bool
    frequency: float = math.nan


class Response:
    """Displacements that loads cause while some directions are fixed.

    Args:
        solve: response (size, m) to loads (size, m) in equilibrium, the pseudo-inverse of the tangent.
        fixed: (size, h) unit loads along fixed directions.
        rigid: (size, r) orthonormal motions that cost nothing.
    """

    def __init__(self, solve: Callable[[Array], Array], fixed: Array, rigid: Array) -> None:
        """Take over what the tangent and the supports say.

        Args:
            solve: response (size, m) to loads (size, m) in equilibrium.
            fixed: (size, h) unit loads along fixed directions.
            rigid: (size, r) orthonormal motions that cost nothing.
        """
        self._solve, self._fixed, self._rigid = solve, fixed, rigid
        h, r = fixed.shape[1], rigid.shape[1]
        self.free = rigid
        if not h:
            return
        A = rigid.T @ fixed
        if r:
            left, sizes, _ = np.linalg.svd(A)
            self.free = rigid @ left[:, int((sizes > 1e-9).sum()) :]
        self._influence = solve(fixed)
        C = fixed.T @ self._influence
        self._unit = float(np.abs(C).max())  # both kinds of rows alike
        saddle = np.block([[C / self._unit, A.T], [A, np.zeros((r, r))]])
        self._inverse = np.linalg.pinv(saddle, rcond=1e-14, hermitian=True)

    def __call__(self, load: Array) -> Array:
        """(size,) u = K^+ (b - H g) + Z a with H.u = 0 and Z.(b - H g) = 0; any part along `free` may be in it."""
        u = self._solve(load[:, None])[:, 0]
        h = self._fixed.shape[1]
        if not h:
            return u
        found = self._inverse @ np.concatenate((self._fixed.T @ u / self._unit, self._rigid.T @ load))
        return np.asarray(u - self._influence @ found[:h] - self._unit * (self._rigid @ found[h:]))


def lowest(
    response: Response,
    stiffness: Callable[[Array], Array],
    weigh: Callable[[Array], Array],
    count: int,
    typical: float,
) -> list[tuple[float, Array, bool]]:
    """(eigenvalue, motion (size,), free) of the `count` lowest modes by size, free motions first, of unit mass.

    Args:
        response: K^+ with supports and free motions taken care of.
        stiffness: K u, the tangent times a motion.
        weigh: W u, the root of the (lumped) mass times a motion.
        count: how many modes.
        typical: size of an eigenvalue of the tangent; rounding is measured in it.
    """
    free = response.free
    weighed = np.column_stack([weigh(u) for u in free.T]) if free.shape[1] else free
    if free.shape[1]:
        triangular = np.linalg.cholesky(weighed.T @ weighed)
        free, weighed = (np.linalg.solve(triangular, each.T).T for each in (free, weighed))

    def motion(y: Array) -> Array:
        # loads without mass times rigid acceleration are in equilibrium; motions are without rigid momentum
        u = response(weigh(y - weighed @ (weighed.T @ y)))
        return np.asarray(u - free @ (weighed.T @ weigh(u)))

    found = [(0.0, u, True) for u in free.T][:count]
    wanted = count - len(found)
    if wanted > 0:
        mu, Y = _largest(lambda y: weigh(motion(y)), free.shape[0], wanted, weigh)
        U = np.column_stack([motion(y) / m for m, y in zip(mu, Y.T, strict=True)])
        # Rayleigh and Ritz: what rounding and iteration left in them is of second order in the eigenvalues
        masses = np.column_stack([weigh(u) for u in U.T])
        stiff = U.T @ np.column_stack([stiffness(u) for u in U.T])
        triangular = np.linalg.cholesky(masses.T @ masses)
        half = np.linalg.solve(triangular, 0.5 * (stiff + stiff.T))
        values, turn = np.linalg.eigh(np.linalg.solve(triangular, half.T))
        U = U @ np.linalg.solve(triangular.T, turn)
        flexible = sorted(zip(values.tolist(), U.T, strict=True), key=lambda mode: abs(mode[0]))
        found += [(value, u, abs(value) <= FREE * typical) for value, u in flexible]
    return found


def _largest(
    times: Callable[[Array], Array], size: int, count: int, weigh: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """The `count` eigenvalues of largest size of a symmetric operator, and their vectors (size, count)."""
    if size <= DENSE or count > size // 4:
        A = np.column_stack([times(unit) for unit in np.eye(size)])
        mu, Y = np.linalg.eigh(0.5 * (A + A.T))
        best = np.argsort(-np.abs(mu))[:count]
        return mu[best], Y[:, best]
    from scipy.sparse.linalg import LinearOperator, eigsh

    start = weigh(np.random.default_rng(20).normal(size=size))  # the same input gives the same modes
    operator = LinearOperator((size, size), matvec=lambda y: times(np.ravel(y)), dtype=float)
    mu, Y = eigsh(operator, k=count, which="LM", v0=start)
    return np.asarray(mu), np.asarray(Y)
