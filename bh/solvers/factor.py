"""What every matrix and factor of the driver can do, and the error of a matrix that is not positive definite."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class IndefiniteError(ArithmeticError):
    """The matrix is not positive definite (for multipliers: not so on the constraint's null space).

    `negative` is the number of negative eigenvalues, or 1 where only their presence is known.
    """

    def __init__(self, negative: int) -> None:
        """An error that knows how many eigenvalues are negative, at least."""
        super().__init__(f"{negative} negative eigenvalue(s)")
        self.negative = negative


class Descent(NamedTuple):
    """A direction in which the merit falls.

    Attributes:
        direction: (n,) of the unknowns.
        slope: rate of change of the merit along its primal part (N mm, negative) once the multipliers have been changed
            as it says.
    """

    direction: Array
    slope: float


class Factor(Protocol):
    """A factorised matrix (n, n)."""

    def solve(self, b: Array) -> Array:
        """Solution x of A x = b, b (n,) or (n, k)."""
        ...

    def descend(self, residual: Array) -> Descent:
        """A direction in which the primal unknowns lower the merit, with the change of multipliers to it."""
        direction = -self.solve(residual)
        return Descent(direction, float(residual @ direction))


class SignedFactor(Factor):
    """A factor that may be of an indefinite matrix, with `negative` eigenvalues below zero."""

    negative: int

    def descend(self, residual: Array) -> Descent:
        """See `Factor.descend`.

        Raises:
            IndefiniteError: the matrix has negative eigenvalues, so nothing says where down is.
        """
        if self.negative:
            raise IndefiniteError(self.negative)
        return super().descend(residual)


class Matrix(Protocol):
    """A symmetric matrix (n, n) that can be factorised and multiplied with."""

    def factorise(self, shift: float = 0.0) -> Factor:
        """Factor of A + shift * diag(|A|); raises `IndefiniteError`."""
        ...

    def factorise_any(self) -> tuple[Factor, int]:
        """Factor of A, definite or not, and its number of negative eigenvalues (on the constraints' null space).

        Raises `IndefiniteError` only where A is singular to rounding.

        Returns:
            the factor, and the number.

        Raises:
            IndefiniteError: A is singular to rounding.
        """
        ...

    def __matmul__(self, x: Array) -> Array:
        """A x for x (n,)."""
        ...

    def diagonal(self) -> Array:
        """(n,) diagonal, in the order of the unknowns; without multipliers where there are some."""
        ...


def unpermuted(rows: Array, order: Ints) -> Array:
    """Rows in the order of the unknowns again; `order[k]` is the unknown in row k.

    Args:
        rows: (n,) or (n, k), in the order of elimination.
        order: (n,) unknown of each row.

    Returns:
        of the shape of `rows`.
    """
    out = np.empty_like(rows)
    out[order] = rows
    return out
