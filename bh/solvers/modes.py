"""Modes of a tangent, how many of them are negative, and factors of tangents that have such."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.solvers.matrices import Factor, IndefiniteError, Matrix
from bh.solvers.saddle import DenseSchurFactor, MultiplierFactor, MultiplierMatrix

Array = NDArray[np.float64]
NEUTRAL = 1e-13  # shift, in parts of the diagonal, at which an eigenvalue is zero but for rounding
FEW = 12  # shifts among which the smallest that helps is sought by halving
ROUNDED = 1e-11  # one that takes off what rounding makes of neutral modes in a badly conditioned matrix
GAP = 1e-6  # a mode whose stiffness is less than this part of the next one's is neutral
KNOWN_GAP = 1e-3  # of a mode that was so before: what is left of the imbalance gives it some stiffness


def count_negative(matrix: Matrix, gap: float = GAP) -> int:
    """Number of negative eigenvalues on the null space of the constraints; neutral ones count as zero.

    Where there are too many constraints for an exact count it is that of the augmented matrix, an upper bound.

    Args:
        matrix: symmetric.
        gap: see `neutral_mode`.
    """
    return count_and_factor(matrix, gap)[0]


def count_and_factor(matrix: Matrix, gap: float = GAP) -> tuple[int, Factor | None]:
    """`count_negative`, and the factor that it was seen from.

    Args:
        matrix: symmetric.
        gap: see `neutral_mode`.

    Returns:
        the number, and the factor of a matrix that is positive definite, but for a shift at the level of rounding;
        None of one that is not.
    """
    try:
        return 0, matrix.factorise(NEUTRAL)
    except IndefiniteError:
        try:
            counted = max(matrix.factorise_any()[1], 1)
        except IndefiniteError as error:
            counted = max(error.negative, 1)
    lowest = neutral_mode(matrix, len(matrix.diagonal()), gap)
    return counted - 1 if lowest is not None and lowest.negative else counted, None


class NeutralMode(NamedTuple):
    """A mode without a stiffness of its own, such as the phase of the waves of a buckled ring.

    Attributes:
        negative: whether rounding, or the mesh, makes its stiffness a negative one.
        mode: (primal,) of unit length.
    """

    negative: bool
    mode: Array


def neutral_mode(matrix: Matrix, primal: int, gap: float = GAP, iterations: int = 8) -> NeutralMode | None:
    """The mode whose stiffness is nothing beside that of all others, if there is one.

    A ring that has buckled may turn its waves round itself: only the cells of the mesh tell one place from another, so
    the energy hardly changes, and Newton's steps along that mode are rounding divided by next to nothing.

    Args:
        matrix: symmetric.
        primal: number of unknowns that are no multipliers.
        gap: part of the next mode's stiffness that is nothing.
        iterations: of inverse iteration with two vectors.

    Returns:
        None where no mode is so much softer than the next one.
    """
    matrix = matrix.augmented if isinstance(matrix, MultiplierMatrix) else matrix
    factor: Factor | None
    try:
        factor, _ = matrix.factorise_any()
    except IndefiniteError:
        factor, _ = factorise_shifted(matrix, 0.0, least=ROUNDED)
    if factor is None or primal < 2:
        return None
    modes = np.random.default_rng(20).normal(size=(primal, 2))
    for _ in range(iterations):
        modes = np.linalg.qr(np.column_stack([factor.solve(mode) for mode in modes.T]))[0]
    stiffnesses, turns = np.linalg.eigh(modes.T @ np.column_stack([matrix @ mode for mode in modes.T]))
    soft, following = np.argsort(np.abs(stiffnesses))
    if not abs(stiffnesses[soft]) < gap * stiffnesses[following]:
        return None
    return NeutralMode(bool(stiffnesses[soft] < 0.0), modes @ turns[:, soft])


def softness(factor: Factor, primal: int) -> float:
    """Stiffness of the softest mode in parts of the next one's, by two steps of inverse iteration with two vectors.

    Only solves are needed: for Y = K^-1 V the matrix projected on the modes is Y^T K Y = V^T Y.

    Args:
        factor: of a positive definite matrix K; of one with multipliers it is the augmented one that is looked at.
        primal: number of unknowns that are no multipliers.

    Returns:
        0 to 1; 1 where there is but one mode.
    """
    if isinstance(factor, MultiplierFactor | DenseSchurFactor):
        factor = factor.factor
    if primal < 2:
        return 1.0
    start = np.random.default_rng(20).normal(size=(primal, 2))
    modes, _ = _orthonormal(factor.solve(start[:, 0]), factor.solve(start[:, 1]))
    solved = np.array([factor.solve(mode) for mode in modes])
    compliances, turns = np.linalg.eigh(modes @ solved.T)
    # the softer one first: then the triangle R of Y = Q R is graded, and the stiff one is not lost beside the soft one
    order = np.argsort(-np.abs(compliances))
    _, triangle = _orthonormal(*(turns[:, order].T @ solved))
    inverse = np.linalg.inv(triangle)
    stiffnesses = np.abs(np.linalg.eigvalsh((inverse.T * compliances[order]) @ inverse))
    return float(stiffnesses.min() / stiffnesses.max())


def _orthonormal(first: Array, second: Array) -> tuple[Array, Array]:
    """Two vectors (n,) made orthonormal (Gram-Schmidt, twice), as rows, and the triangle (2, 2) that was taken out."""
    size = float(np.sqrt(first @ first))
    first = first / size
    share = 0.0
    for _ in range(2):
        more = float(first @ second)
        second, share = second - more * first, share + more
    rest = float(np.sqrt(second @ second))
    return np.array([first, second / rest]), np.array([[size, share], [0.0, rest]])


def without(factor: Factor, x: Array, mode: Array) -> Array:
    """The solution x of K x = b once it may not move along a mode: K x + v mu = b, v . x = 0.

    Args:
        factor: of K.
        x: (n,) solution without that.
        mode: v, (primal,).

    Returns:
        (n,) the solution with that.
    """
    p = len(mode)
    v = np.zeros_like(x)
    v[:p] = mode
    along = factor.solve(v)
    return x - along * float(mode @ x[:p]) / float(mode @ along[:p])


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
        the factor and its shift; None and infinity where the shift would exceed `largest`.
    """
    shift = least if shift < 1e-9 else shift
    if shift > largest:
        return None, math.inf
    try:
        return matrix.factorise(shift), shift
    except IndefiniteError:
        ladder = _ladder(shift, largest)
    return _halving(matrix, ladder) if 0 < len(ladder) <= FEW else _in_turn(matrix, ladder)


def _ladder(shift: float, largest: float) -> list[float]:
    """Shifts to try behind one that was too small, up to `largest`."""
    steps: list[float] = []
    while True:
        # a matrix that is indefinite at zero has been looked at closely; go past what it calls rounding
        shift = ROUNDED if shift < ROUNDED else max(4.0 * shift, 1e-9)
        if shift > largest:
            return steps
        steps.append(shift)


def _in_turn(matrix: Matrix, ladder: Sequence[float]) -> tuple[Factor | None, float]:
    """The first shift that helps."""
    for shift in ladder:
        try:
            return matrix.factorise(shift), shift
        except IndefiniteError:
            continue
    return None, math.inf


def _halving(matrix: Matrix, ladder: Sequence[float]) -> tuple[Factor | None, float]:
    """The same for few shifts: where the largest does not help none does, else the least is found by halving."""
    try:
        found, low, high = matrix.factorise(ladder[-1]), 0, len(ladder) - 1
    except IndefiniteError:
        return None, math.inf
    while low < high:
        middle = (low + high) // 2
        try:
            found, high = matrix.factorise(ladder[middle]), middle
        except IndefiniteError:
            low = middle + 1
    return found, ladder[high]


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
