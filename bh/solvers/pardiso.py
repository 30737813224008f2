"""MKL's PARDISO for large sparse tangents, if pypardiso is installed (the extra `fast`).

pypardiso finds and loads MKL; its solver class is not used, because it copies both triangles, compares matrices before
each solve, and keeps one factor. Here the lower triangle is factorised as L D L^T (matrix type -2) in our own order,
the symbolic phase is done once a pattern, and every factor that is alive has a handle of its own.
"""

from __future__ import annotations

import ctypes
import logging
import threading
import weakref
from collections import deque
from functools import cache
from importlib.util import find_spec
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bh.solvers.factor import IndefiniteError, SignedFactor, unpermuted

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Index = NDArray[np.int32]

FEWEST = 60_000  # unknowns from which it is not slower than our own factor (docs/performance.md)
SPARE = (
    2  # handles of a pattern that wait for the next factor: Newton's method holds one while it makes another
)
ANALYSE, FACTORISE, SOLVE, RELEASE = 11, 22, 33, -1
ZERO_PIVOT = -4
_log = logging.getLogger(__name__)


@cache
def available() -> bool:
    """Whether pypardiso is installed and its MKL can be loaded."""
    if find_spec("pypardiso") is None:
        return False
    try:
        _library()
    except (ImportError, OSError, AttributeError) as error:
        _log.warning("pypardiso is installed but cannot be used (%s); our own sparse factor serves", error)
        return False
    return True


def pays(n: int) -> bool:
    """Whether a matrix of n unknowns goes to PARDISO."""
    return n >= FEWEST and available()


class _Routine(Protocol):
    """A routine of MKL; its arguments are pointers."""

    def __call__(self, *arguments: object) -> int: ...


@cache
def _library() -> tuple[_Routine, _Routine, int]:
    """PARDISO, the routine that sets its threads, and how many it was meant to have when it was loaded."""
    from pypardiso import PyPardisoSolver

    mkl = PyPardisoSolver().libmkl
    routine, set_threads = mkl["pardiso"], mkl["MKL_Set_Num_Threads_Local"]
    routine.restype = None
    return routine, set_threads, int(mkl["MKL_Get_Max_Threads"]())


def _options() -> NDArray[np.int32]:
    options = np.zeros(64, dtype=np.int32)
    options[0] = 1  # nothing by default
    options[1] = options[4] = 1  # the order is given
    options[9] = 16  # pivots below 1e-16 of the norm are replaced, and counted in [13]
    options[20] = 1  # pivots of 1 x 1 and 2 x 2
    options[34] = 1  # indices from 0
    return options


class Handle:
    """PARDISO's memory of one factor; it is freed when this object is."""

    def __init__(self, indptr: Index, indices: Index) -> None:
        """Look at a pattern, the lower triangle in compressed columns.

        Raises:
            MemoryError: PARDISO could not.
        """
        self.indptr, self.indices = indptr, indices
        self.options = _options()
        self.memory = np.zeros(64, dtype=np.int64)
        self.lock = threading.Lock()
        # PARDISO may write into the order that it is given
        self.order = np.arange(len(indptr) - 1, dtype=np.int32)
        error = self.call(ANALYSE, np.zeros(len(indices)))
        if error:
            raise MemoryError(f"PARDISO could not analyse the tangent (error {error})")
        weakref.finalize(self, _release, self.memory, len(indptr) - 1, self.options).atexit = False

    def call(self, phase: int, data: Array, b: Array | None = None, x: Array | None = None) -> int:
        """Run one phase; PARDISO's error, 0 if there was none.

        Args:
            phase: as PARDISO counts them.
            data: (k,) values of the matrix.
            b: (n,) or (n, k) right-hand sides.
            x: of the shape of `b`; the solution is written there.
        """
        return _call(self.memory, self.options, phase, len(self.indptr) - 1, data, self.indptr, self.indices,
                     self.order, b, x)  # fmt: skip


def _call(
    memory: Ints, options: Index, phase: int, n: int, data: Array | None = None, indptr: Index | None = None,
    indices: Index | None = None, order: Index | None = None, b: Array | None = None, x: Array | None = None,
) -> int:  # fmt: skip
    routine, set_threads, threads = _library()

    def whole(value: int) -> object:
        return ctypes.byref(ctypes.c_int32(value))

    def pointer(array: Array | Index | Ints | None) -> ctypes.c_void_p:
        return ctypes.c_void_p(None if array is None else array.ctypes.data)

    error = ctypes.c_int32(0)
    columns = 1 if b is None or b.ndim == 1 else b.shape[1]
    before = set_threads(threads)
    routine(
        pointer(memory), whole(1), whole(1), whole(-2), whole(phase), whole(n), pointer(data), pointer(indptr),
        pointer(indices), pointer(order), whole(columns), pointer(options), whole(0), pointer(b), pointer(x),
        ctypes.byref(error),
    )  # fmt: skip
    set_threads(before)
    return error.value


def _release(memory: Ints, n: int, options: Index) -> None:
    _call(memory, options, RELEASE, n)


class Analysis:
    """A pattern (lower triangle in compressed columns, in the order of elimination) that PARDISO has looked at."""

    def __init__(self, indptr: Index, indices: Index) -> None:
        """Keep the pattern; PARDISO looks at it when a matrix is factorised."""
        self.indptr, self.indices = indptr, indices
        self._spare: deque[Handle] = deque(maxlen=SPARE)

    def factorise(self, data: Array, order: Ints) -> tuple[PardisoFactor, int]:
        """Factor of the matrix with the lower values `data`, and its number of negative eigenvalues.

        Raises `IndefiniteError` where it is singular to rounding.

        Args:
            data: (k,) values of the lower triangle.
            order: (n,) unknown of each row.

        Returns:
            the factor, and the number.

        Raises:
            IndefiniteError: the matrix is singular to rounding.
        """
        try:
            handle = self._spare.pop()
        except IndexError:
            handle = Handle(self.indptr, self.indices)
        factor = PardisoFactor(handle, data, order, self._spare)
        error = handle.call(FACTORISE, data)
        if error not in (0, ZERO_PIVOT):
            raise MemoryError(f"PARDISO could not factorise the tangent (error {error})")
        replaced, negative = int(handle.options[13]), int(handle.options[22])
        # a pivot that had to be replaced has no sign of its own: the inertia would be a guess
        if error or replaced or int(handle.options[21]) + negative != len(order):
            raise IndefiniteError(max(negative, 1))
        factor.negative = negative
        return factor, negative


class PardisoFactor(SignedFactor):
    """A factor; when it is garbage its handle waits for the next one of the same pattern, or is freed."""

    def __init__(self, handle: Handle, data: Array, order: Ints, spare: deque[Handle]) -> None:
        """Hold a handle that has factorised the values `data`, rows in `order`; `spare` takes it back."""
        self._handle, self._data, self._order = handle, data, order
        self.negative = 0
        weakref.finalize(self, spare.append, handle).atexit = False

    def solve(self, b: Array) -> Array:
        """Solution x of A x = b, b (n,) or (n, k).

        Raises:
            ArithmeticError: PARDISO could not.
        """
        rows = np.asfortranarray(b[self._order], dtype=float)
        x = np.empty_like(rows)
        with self._handle.lock:
            error = self._handle.call(SOLVE, self._data, rows, x)
        if error:
            raise ArithmeticError(f"PARDISO could not solve (error {error})")
        return unpermuted(x, self._order)
