"""Symmetric matrices that factorise themselves: banded, of a free body (`bh.solvers.sparse`, `bh.solvers.saddle`).

A matrix knows how to solve with itself; the driver does not care how. `factorise` either returns a factor or raises
`IndefiniteError`, which says how many eigenvalues are negative, so that the driver can shift or turn back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import lapack

from bh.runtime.kernel_options import KERNEL
from bh.solvers import envelope
from bh.solvers.factor import Descent, unpermuted
from bh.solvers.factor import Factor as Factor
from bh.solvers.factor import IndefiniteError as IndefiniteError
from bh.solvers.factor import Matrix as Matrix
from bh.solvers.sparse import SparseMatrix as SparseMatrix
from bh.solvers.sparse import SparsePattern

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


# ---------------------------------------------------------------------------------------------- banded


@dataclass(frozen=True)
class BandMatrix:
    """Symmetric band, lower part in LAPACK form `ab` (b + 1, n) Fortran order, rows permuted by `order`.

    `reach` (n,) is the last row with an entry in any of the columns up to each; None where only the band is known.
    """

    ab: Array
    order: Ints
    reach: Ints | None = None

    def factorise(self, shift: float = 0.0) -> BandFactor:
        """Cholesky factor of A + shift * diag(|A|); raises `IndefiniteError`."""
        n, reach = len(self.order), self.reach
        if reach is None:
            reach = np.minimum(np.arange(n) + len(self.ab) - 1, n - 1)
        factor = envelope.factor_of(self.ab, reach, shift)
        if factor is None:
            raise IndefiniteError(1)
        return BandFactor(factor, reach, self.order)

    def factorise_any(self) -> tuple[Factor, int]:
        """Cholesky or L D L^T factor of A and its number of negative eigenvalues; see `Matrix.factorise_any`."""
        try:
            return self.factorise(), 0
        except IndefiniteError:
            ab = self.ab.copy(order="F")
            negative = band_ldl(ab)
            if negative < 0:
                raise IndefiniteError(1) from None
            return BandLDLFactor(ab, self.order), negative

    def __matmul__(self, x: Array) -> Array:
        """A x for x (n,), in the order of the unknowns."""
        y = x[self.order]
        out = self.ab[0] * y
        n = len(y)
        for d in range(1, len(self.ab)):
            row = self.ab[d, : n - d]
            out[d:] += row * y[: n - d]
            out[: n - d] += row * y[d:]
        return unpermuted(out, self.order)

    def diagonal(self) -> Array:
        """(n,) diagonal, in the order of the unknowns."""
        return unpermuted(self.ab[0], self.order)


@dataclass(frozen=True)
class BandFactor(Factor):
    """Cholesky factor of a band (`bh.solvers.envelope`)."""

    L: Array
    reach: Ints
    order: Ints

    def solve(self, b: Array) -> Array:
        """Solution x of A x = b, b (n,) or (n, k)."""
        return unpermuted(envelope.solve(self.L, self.reach, b[self.order]), self.order)


@njit(**KERNEL)
def band_ldl(ab):  # type: ignore[no-untyped-def]
    """L D L^T of a symmetric band in place (unit L below, D in the first row), without pivoting.

    Returns the number of negative pivots, which is the number of negative eigenvalues (Sylvester), or -1 where a pivot
    vanishes beside its column. LAPACK has no such routine; its pivoting ones destroy the band.
    """
    width, n = ab.shape
    negative = 0
    for j in range(n):
        pivot = ab[0, j]
        largest = 0.0
        rows = min(width, n - j)
        for i in range(1, rows):
            largest = max(largest, abs(ab[i, j]))
        if abs(pivot) <= 1e-15 * largest or pivot == 0.0:
            return -1
        if pivot < 0.0:
            negative += 1
        for i in range(1, rows):
            scaled = ab[i, j] / pivot
            for k in range(i, rows):
                ab[k - i, j + i] -= scaled * ab[k, j]
        for i in range(1, rows):
            ab[i, j] /= pivot
    return negative


@dataclass(frozen=True)
class BandLDLFactor(Factor):
    """Factor of an indefinite band."""

    ab: Array
    order: Ints

    def solve(self, b: Array) -> Array:
        """Solution x of A x = b, b (n,) or (n, k)."""
        unit = {"uplo": "L", "diag": "U"}
        x, _ = lapack.dtbtrs(self.ab, b[self.order], trans="N", **unit)
        pivots = self.ab[0] if x.ndim == 1 else self.ab[0][:, None]
        x, _ = lapack.dtbtrs(self.ab, x / pivots, trans="T", **unit)
        return unpermuted(x, self.order)

    def descend(self, residual: Array) -> Descent:
        """Raises `IndefiniteError`: nothing says where down is."""
        raise IndefiniteError(1)


# ---------------------------------------------------------------------------------------------- either


@dataclass(frozen=True)
class Storage:
    """How the values of a symmetric matrix are stored, in a band or sparse: found once, filled many times.

    Attributes:
        order: (n,) permutation of the unknowns, order[k] is the unknown in row k.
        bandwidth: of the permuted matrix; used if `banded`.
        size: number of values.
        sparse: the pattern of the sparse matrix, None if banded.
        reach: (n,) of a band, see `BandMatrix`; None if sparse.
    """

    order: Ints
    bandwidth: int
    size: int
    sparse: SparsePattern | None
    reach: Ints | None

    @property
    def banded(self) -> bool:
        """Whether the values are those of a band."""
        return self.sparse is None

    def diagonal(self, unknowns: Ints) -> Ints:
        """(k,) where the values of some unknowns (k,) on the diagonal are."""
        row = np.empty(len(self.order), dtype=np.int64)
        row[self.order] = np.arange(len(row))
        if self.sparse is None:
            return row[unknowns] * (self.bandwidth + 1)
        return self.sparse.indptr[row[unknowns]].astype(np.int64)

    def matrix(self, data: Array) -> BandMatrix | SparseMatrix:
        """The matrix of values data (size,), which it keeps without a copy."""
        if self.sparse is None:
            ab = data.reshape((self.bandwidth + 1, len(self.order)), order="F")
            return BandMatrix(ab, self.order, self.reach)
        return SparseMatrix(data, self.sparse)


# ---------------------------------------------------------------------------------------------- composed


@dataclass(frozen=True)
class FreeBodyMatrix:
    """Tangent of a body with free rigid motions, of which `grounded` is the tangent plus a stiffness against them.

    Loads that are in equilibrium do no work on the rigid motions Z (n, r), so the stiffness that holds them carries
    no force: the solution is the exact one plus some rigid motion, and the rigid part is then taken out. What is left
    is the solution of least displacement; the rigid-body support is r conditions Z^T dq = 0 and nothing else.

    Where unknowns stand for several displacements (half of a symmetric sheet), `weight` (n,) says for how many; then
    the conditions are Z^T W dq = 0 and Z^T W Z = 1.
    """

    grounded: BandMatrix | SparseMatrix
    Z: Array
    ground_rows: Ints
    ground: Array
    weight: Array | None = None

    def factorise(self, shift: float = 0.0) -> FreeBodyFactor:
        """Factor of A + shift * diag(|A|) without rigid motions; raises `IndefiniteError`."""
        return FreeBodyFactor(self.grounded.factorise(shift), self.Z, self._weighted)

    def factorise_any(self) -> tuple[Factor, int]:
        """Factor of A without rigid motions, definite or not, and its number of negative eigenvalues."""
        factor, negative = self.grounded.factorise_any()
        return FreeBodyFactor(factor, self.Z, self._weighted), negative

    @property
    def _weighted(self) -> Array:
        return self.Z if self.weight is None else self.weight[:, None] * self.Z

    def __matmul__(self, x: Array) -> Array:
        """A x for x (n,), with the stiffness of the ground taken out."""
        out = self.grounded @ x
        out[self.ground_rows] -= self.ground @ x[self.ground_rows]
        return out

    def diagonal(self) -> Array:
        """(n,) diagonal, with the stiffness of the ground."""
        return self.grounded.diagonal()


@dataclass(frozen=True)
class FreeBodyFactor(Factor):
    """Factor of a free body: loads and solutions are without rigid motions."""

    factor: Factor
    Z: Array  # orthonormal columns
    weighted: Array  # W Z, which is Z itself without weights

    def solve(self, b: Array) -> Array:
        """Solution x of A x = b for the part of b (n,) that is in equilibrium, of least displacement."""
        x = self.factor.solve(b - self.weighted @ (self.Z.T @ b))
        return x - self.Z @ (self.weighted.T @ x)


def reverse_cuthill_mckee(rows: Ints, columns: Ints, n: int) -> tuple[Ints, int]:
    """Order (n,) of small bandwidth for a symmetric pattern, and that bandwidth (order[k] is the old index).

    Args:
        rows: of the entries, 0 to n - 1.
        columns: of the entries, 0 to n - 1.
        n: number of unknowns.
    """
    from scipy.sparse.csgraph import reverse_cuthill_mckee as rcm

    both = np.concatenate((rows, columns)), np.concatenate((columns, rows))
    pattern = sp.csr_matrix((np.ones(2 * len(rows)), both), shape=(n, n))
    order = rcm(pattern, symmetric_mode=True).astype(np.int64)
    position = np.empty(n, dtype=np.int64)
    position[order] = np.arange(n)
    bandwidth = int(np.abs(position[rows] - position[columns]).max(initial=0))
    return order, bandwidth
