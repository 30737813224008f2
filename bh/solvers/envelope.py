"""Cholesky's factor of a symmetric band by blocks of columns that end where the rows of their entries do.

The half-bandwidth is that of the widest place. Elsewhere, and in between, the entries of a column end much earlier:
the factor has no entry below the last row that one of the columns up to there reaches. A band of a sheet that is
refined both ways takes less than half of the operations so (a third, for the shell), and the rest is what LAPACK's
dpbtrf multiplies by zero.

Column j of the factor is a row of `L` (n, w), w = b + BLOCK, from its diagonal on. Read with w - 1 in place of w as the
distance of columns it is a dense matrix, column by column, of which blocks go to BLAS: they lie below the diagonal
and less than w rows from it.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.runtime.kernel_options import KERNEL
from bh.solvers.blas import addresses, cholesky, constants, solve_right_scaled, subtract_square

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
BLOCK = 16  # columns eliminated at once; 12 to 32 take the same time within 5 %


def factor_of(ab: Array, reach: Ints, shift: float) -> Array | None:
    """The factor L (n, w) of a band, None where that is not positive definite.

    Args:
        ab: (b + 1, n) lower part, a diagonal in each row, Fortran order; left alone.
        reach: (n,) last row with an entry in any of the columns up to each, rising.
        shift: added to the diagonal, in parts of it.
    """
    added = np.zeros(0)
    if shift:
        size = np.abs(ab[0])
        added = shift * np.maximum(size, 1e-3 * size.mean())
    L = np.empty((ab.shape[1], len(ab) - 1 + BLOCK))
    whole, real = constants()
    return L if _factorise(ab.T, reach, added, L, addresses(), whole, real) else None


def solve(L: Array, reach: Ints, b: Array) -> Array:
    """Solution x of L L^T x = b.

    Args:
        L: (n, w) of `factor_of`.
        reach: (n,) that it was made with.
        b: (n,) or (n, k).

    Returns:
        of the shape of b.
    """
    rows = np.array(b.T, dtype=float, order="C", ndmin=2)
    _solve(L, reach, rows)
    return rows[0] if b.ndim == 1 else rows.T


@njit(**KERNEL)
def _factorise(columns, reach, added, L, blas, whole, real):  # type: ignore[no-untyped-def]
    """Write the factor into L; whether there is one. Of L only what a column's block reaches is written."""
    n, width = columns.shape
    step = L.shape[1] - 1
    base = np.int64(L.ctypes.data)
    for first in range(0, n, BLOCK):
        last = min(first + BLOCK, n)
        for j in range(first, last):
            inside = min(width, reach[j] - j + 1)
            for i in range(inside):
                L[j, i] = columns[j, i]
            for i in range(inside, reach[last - 1] - j + 1):
                L[j, i] = 0.0
            if len(added) > 0:
                L[j, 0] += added[j]
    for first in range(0, n, BLOCK):
        last = min(first + BLOCK, n)
        size, below = last - first, reach[last - 1] - last + 1
        corner = base + 8 * (first + first * step)
        if cholesky(blas, whole, size, corner, step) != 0:
            return False
        if below > 0:
            under = corner + 8 * size
            solve_right_scaled(blas, whole, real, below, size, corner, step, under, step)
            subtract_square(
                blas, whole, real, below, size, under, step, base + 8 * (last + last * step), step
            )
    return True


@njit(fastmath={"reassoc", "contract"}, **KERNEL)
def _solve(L, reach, rows):  # type: ignore[no-untyped-def]
    """Solve in place for every row of `rows` (k, n)."""
    n = len(L)
    for k in range(len(rows)):
        x = rows[k]
        for j in range(n):
            value = x[j] / L[j, 0]
            x[j] = value
            below = x[j + 1 : reach[j] + 1]
            column = L[j, 1 : reach[j] - j + 1]
            for i in range(len(below)):
                below[i] -= value * column[i]
        for j in range(n - 1, -1, -1):
            below = x[j + 1 : reach[j] + 1]
            column = L[j, 1 : reach[j] - j + 1]
            total = 0.0
            for i in range(len(below)):
                total += below[i] * column[i]
            x[j] = (x[j] - total) / L[j, 0]
