"""Modes of a tangent, how many of them are negative, and factors of tangents that have such."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bh.solvers.matrices import Factor, IndefiniteError, Matrix
from bh.solvers.saddle import MultiplierMatrix

Array = NDArray[np.float64]
NEUTRAL = 1e-13  # shift, in parts of the diagonal, at which an eigenvalue is zero but for rounding
ROUNDED = 1e-11  # one that takes off what rounding makes of neutral modes in a badly conditioned matrix


def count_negative(matrix: Matrix) -> int:
    """Number of negative eigenvalues on the null space of the constraints; those that are rounding count as zero.

    Where there are too many constraints for an exact count it is that of the augmented matrix, an upper bound.
    """
    try:
        matrix.factorise(NEUTRAL)
        return 0
    except IndefiniteError:
        try:
            return max(matrix.factorise_any()[1], 1)
        except IndefiniteError as error:
            return max(error.negative, 1)


def factorise_shifted(
    matrix: Matrix, shift: float, largest: float = 1e6, least: float = 0.0
) -> tuple[Factor | None, float]:
    """The factor with the smallest tried shift (in parts of the diagonal) that makes the matrix positive definite.

    Neutral modes, such as the phase of the waves of a buckled ring, are first given a stiffness at the level of
    rounding. Returns None where the shift would exceed `largest`.

    Args:
        matrix: symmetric.
        shift: the first one tried, in parts of the diagonal.
        largest: shift at most.
        least: shift at least.

    Returns:
        the factor and its shift; None for the factor where the shift would exceed `largest`.
    """
    if shift < 1e-9:
        shift = least
    while shift <= largest:
        try:
            return matrix.factorise(shift), shift
        except IndefiniteError:
            # a matrix that is indefinite at zero has been looked at closely; go past what it calls rounding
            shift = ROUNDED if shift < ROUNDED else max(4.0 * shift, 1e-9)
    return None, shift


def lowest_mode(
    matrix: Matrix, size: int, primal: int, iterations: int = 60, tolerance: float = 1e-6
) -> tuple[float, Array]:
    """Rayleigh quotient and mode (size,) of the lowest eigenvalue; multipliers (after `primal`) are zero in it.

    Inverse iteration with the shifted matrix K + s D (D = |diag K|), started from a fixed pseudo-random vector so that
    the same input gives the same mode. The mode has unit length and its largest component is positive.

    Args:
        matrix: symmetric.
        size: number of unknowns.
        primal: number of unknowns that are no multipliers.
        iterations: at most.
        tolerance: relative change of the quotient at which it ends.

    Raises:
        IndefiniteError: no shift makes the matrix definite.
    """
    # the penalty of the augmented matrix keeps its low modes in the null space of the constraints
    matrix = matrix.augmented if isinstance(matrix, MultiplierMatrix) else matrix
    factor, _ = factorise_shifted(matrix, 0.0, least=1e-11)
    if factor is None:
        raise IndefiniteError(1)
    mode = np.random.default_rng(20).normal(size=primal)
    quotient = np.inf
    for _ in range(iterations):
        mode = factor.solve(mode)
        mode /= np.linalg.norm(mode)
        before, quotient = quotient, float(mode @ (matrix @ mode))
        if abs(quotient - before) <= tolerance * abs(quotient):
            break
    return quotient, _signed(mode, size)


def nearest_mode(matrix: Matrix, size: int, primal: int, iterations: int = 6) -> Array:
    """(size,) mode of the eigenvalue nearest to zero, of unit length in its displacements, largest component positive.

    Inverse iteration with the matrix as it is, definite or not: for tangents that are nearly singular.

    Args:
        matrix: symmetric.
        size: number of unknowns.
        primal: number of unknowns that are no multipliers.
        iterations: at most.
    """
    factor, _ = matrix.factorise_any()
    mode = np.zeros(size)
    mode[:primal] = np.random.default_rng(20).normal(size=primal)
    for _ in range(iterations):
        load = np.zeros(size)
        load[:primal] = mode[:primal]
        mode = factor.solve(load)
        mode /= np.linalg.norm(mode[:primal])
    return _signed(mode, size, primal)


def _signed(mode: Array, size: int, primal: int | None = None) -> Array:
    whole = np.zeros(size)
    whole[: len(mode)] = mode * np.sign(mode[np.argmax(np.abs(mode[:primal]))])
    return whole
