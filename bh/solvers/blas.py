"""A few BLAS routines for compiled kernels: those that SciPy carries, called at their address.

numba's own matrix product neither accumulates nor writes into a part of an array, and it has no triangular solve.
The address is an argument, so kernels that use it can be cached. All matrices are column-major, float64.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import get_cython_function_address, intrinsic
from numpy.typing import NDArray

Addresses = NDArray[np.int64]


@cache
def addresses() -> Addresses:
    """(6,) addresses of dgemm, dtrsm, dtrsv, dgemv and dsyrk of SciPy's BLAS, and of its LAPACK's dpotrf."""
    names = ("dgemm", "dtrsm", "dtrsv", "dgemv", "dsyrk")
    blas = [get_cython_function_address("scipy.linalg.cython_blas", name) for name in names]
    return np.array([*blas, get_cython_function_address("scipy.linalg.cython_lapack", "dpotrf")])


def _code_of_call(_typing, address, arguments):  # type: ignore[no-untyped-def]
    """Call the void C function at `address` with pointers, given as a tuple of integers."""

    def codegen(context, builder, _signature, values):  # type: ignore[no-untyped-def]
        pointer = ir.IntType(8).as_pointer()
        pointers = [builder.inttoptr(v, pointer) for v in cgutils.unpack_tuple(builder, values[1])]
        kind = ir.FunctionType(ir.VoidType(), [pointer] * len(pointers))
        builder.call(builder.inttoptr(values[0], kind.as_pointer()), pointers)
        return context.get_dummy_value()

    return types.void(address, arguments), codegen


_call = intrinsic(_code_of_call)


# What BLAS is told through pointers lives in two arrays of the caller, so that it outlives the call:
# `whole` (16,) int32: characters N, T, R, L, U as words of their own, the number 1, then sizes; `real` (2,): -1 and 1.


def constants() -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """The two arrays (see above) that the calls below need.

    Returns:
        integers and floats, both constant.
    """
    whole = np.zeros(16, dtype=np.int32)
    whole[:5] = [ord(letter) for letter in "NTRLU"]  # little endian: the first byte is the letter
    whole[5] = 1  # step between the entries of a vector
    return whole, np.array([-1.0, 1.0])


@njit(inline="always")
def subtract_product(blas, whole, real, m, n, k, a, lda, b, ldb, c, ldc):  # type: ignore[no-untyped-def]
    """C -= A B^T with A (m, k), B (n, k), C (m, n); a, b, c are the addresses of their first entries."""
    whole[8] = m
    whole[9] = n
    whole[10] = k
    whole[11] = lda
    whole[12] = ldb
    whole[13] = ldc
    w, r = np.int64(whole.ctypes.data), np.int64(real.ctypes.data)
    _call(
        blas[0],
        (w, w + 4, w + 32, w + 36, w + 40, r, a, w + 44, b, w + 48, r + 8, c, w + 52),
    )


@njit(inline="always")
def solve_right(blas, whole, real, m, n, a, lda, b, ldb):  # type: ignore[no-untyped-def]
    """B <- B L^-T with L (n, n) the unit lower triangle at address a, B (m, n) at address b."""
    whole[8] = m
    whole[9] = n
    whole[10] = lda
    whole[11] = ldb
    w, r = np.int64(whole.ctypes.data), np.int64(real.ctypes.data)
    _call(
        blas[1],
        (w + 8, w + 12, w + 4, w + 16, w + 32, w + 36, r + 8, a, w + 40, b, w + 44),
    )


@njit(inline="always")
def solve_lower(blas, whole, n, a, lda, x):  # type: ignore[no-untyped-def]
    """Solve in place, x <- L^-1 x, with L the unit lower triangle at address a."""
    whole[8], whole[9] = n, lda
    w = np.int64(whole.ctypes.data)
    _call(blas[2], (w + 12, w, w + 16, w + 32, a, w + 36, x, w + 20))


@njit(inline="always")
def solve_upper(blas, whole, n, a, lda, x):  # type: ignore[no-untyped-def]
    """Solve in place, x <- L^-T x, with L the unit lower triangle at address a."""
    whole[8], whole[9] = n, lda
    w = np.int64(whole.ctypes.data)
    _call(blas[2], (w + 12, w + 4, w + 16, w + 32, a, w + 36, x, w + 20))


@njit(inline="always")
def add_times(blas, whole, real, m, n, a, lda, x, y):  # type: ignore[no-untyped-def]
    """Add y += A x with A (m, n)."""
    whole[8], whole[9], whole[10] = m, n, lda
    w, r = np.int64(whole.ctypes.data), np.int64(real.ctypes.data)
    _call(blas[3], (w, w + 32, w + 36, r + 8, a, w + 40, x, w + 20, r + 8, y, w + 20))


@njit(inline="always")
def subtract_transpose_times(blas, whole, real, m, n, a, lda, x, y):  # type: ignore[no-untyped-def]
    """Subtract y -= A^T x with A (m, n)."""
    whole[8], whole[9], whole[10] = m, n, lda
    w, r = np.int64(whole.ctypes.data), np.int64(real.ctypes.data)
    _call(blas[3], (w + 4, w + 32, w + 36, r, a, w + 40, x, w + 20, r + 8, y, w + 20))


@njit(inline="always")
def cholesky(blas, whole, n, a, lda):  # type: ignore[no-untyped-def]
    """Cholesky's factor in place of the lower triangle of A (n, n) at address a; 0 where A is positive definite."""
    whole[8], whole[9] = n, lda
    w = np.int64(whole.ctypes.data)
    _call(blas[5], (w + 12, w + 32, a, w + 36, w + 56))
    return whole[14]


@njit(inline="always")
def solve_right_scaled(blas, whole, real, m, n, a, lda, b, ldb):  # type: ignore[no-untyped-def]
    """B <- B L^-T with L (n, n) the lower triangle at address a, its diagonal included, B (m, n) at address b."""
    whole[8], whole[9], whole[10], whole[11] = m, n, lda, ldb
    w, r = np.int64(whole.ctypes.data), np.int64(real.ctypes.data)
    _call(
        blas[1],
        (w + 8, w + 12, w + 4, w, w + 32, w + 36, r + 8, a, w + 40, b, w + 44),
    )


@njit(inline="always")
def subtract_square(blas, whole, real, n, k, a, lda, c, ldc):  # type: ignore[no-untyped-def]
    """C -= A A^T in the lower triangle of C (n, n), with A (n, k)."""
    whole[8], whole[9], whole[10], whole[11] = n, k, lda, ldc
    w, r = np.int64(whole.ctypes.data), np.int64(real.ctypes.data)
    _call(blas[4], (w + 12, w, w + 32, w + 36, r, a, w + 40, r + 8, c, w + 44))
