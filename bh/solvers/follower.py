"""Tangents of loads that follow a sheet with free edges: a symmetric matrix beside a skew one of a few entries.

Pressure has a potential only where the edges of the sheet cannot move to do work of their own (Schweizerhof and Ramm
1984). Elsewhere its tangent is S + W with W = -W^T on free edges. Newton's steps are solved with both, by GMRES
preconditioned with the factor of S, whose steps are few since W has few entries. What is counted as negative modes is
that of S: while S is positive definite S + W is not singular and no motion, however small, gains energy (Hill 1958), so
a state that is called stable is stable; one that is not called so may still be held by W.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bh.solvers.factor import Descent, Factor, Matrix

Array = NDArray[np.float64]
PRECISION = 1e-12  # of a solution, relative
MOST = 60  # vectors of GMRES


@runtime_checkable
class Following(Protocol):
    """Ability of a system: it knows whether what acts on it has a potential."""

    @property
    def conservative(self) -> bool:
        """Is the residual the gradient of the energy?"""
        ...


def conservative(system: object) -> bool:
    """Whether the residual of a system is the gradient of its energy; a system that does not say so has one.

    Args:
        system: of a step.
    """
    return system.conservative if isinstance(system, Following) else True


@dataclass(frozen=True, eq=False)
class FollowerMatrix:
    """S + W. Products and diagonals are those of the symmetric part, solutions those of the whole."""

    symmetric: Matrix
    skew: sp.csr_matrix  # (n, n), W = -W^T

    def factorise(self, shift: float = 0.0) -> FollowerFactor:
        """Factor with S + shift * diag(|S|); raises `IndefiniteError` where that is not positive definite."""
        return FollowerFactor(self.symmetric.factorise(shift), self.skew)

    def factorise_any(self) -> tuple[Factor, int]:
        """Factor, and the number of negative eigenvalues of S."""
        factor, negative = self.symmetric.factorise_any()
        return FollowerFactor(factor, self.skew), negative

    def __matmul__(self, x: Array) -> Array:
        """S x for x (n,)."""
        return self.symmetric @ x

    def diagonal(self) -> Array:
        """(n,) diagonal of S, which is that of the whole."""
        return self.symmetric.diagonal()


@dataclass(frozen=True, eq=False)
class FollowerFactor(Factor):
    """Factor of S + W by the one of S."""

    factor: Factor
    skew: sp.csr_matrix

    def solve(self, b: Array) -> Array:
        """Solution x of (S + W) x = b, b (n,) or (n, k); of S x = b where GMRES does not come to an end."""
        if b.ndim > 1:
            return np.column_stack([self.solve(column) for column in b.T])
        from scipy.sparse.linalg import LinearOperator, gmres

        first = self.factor.solve(b)
        if not (np.isfinite(first).all() and first.any()):
            return first
        whole = LinearOperator(
            (len(b), len(b)),
            matvec=lambda x: np.ravel(x) + self.factor.solve(self.skew @ np.ravel(x)),
            dtype=float,
        )
        x, failed = gmres(whole, first, x0=first, rtol=PRECISION, atol=0.0, restart=MOST, maxiter=2)
        return first if failed and not np.isfinite(x).all() else np.asarray(x)

    def descend(self, residual: Array) -> Descent:
        """A direction in which the energy falls: that of S alone."""
        return self.factor.descend(residual)
