"""Chebyshev sums of one or two arguments, compiled: a search for designs asks for very many of a few places each."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.runtime.kernel_options import INNER, KERNEL

Array = NDArray[np.float64]
BLOCK = 8  # places at a time


def summed(coefficients: Array, *x: Array) -> Array:
    """Values (..., 6) of a sum at one or two arguments (...) in [-1, 1], of the same shape or broadcast to one.

    Args:
        coefficients: (d + 1, 6) of one argument, (d + 1, d + 1, 6) of two.
        x: the arguments.
    """
    at = np.broadcast_arrays(*x)
    flat = [np.ascontiguousarray(each, dtype=float).ravel() for each in at]
    found = np.empty((flat[0].size, 6))
    (_of_one if len(flat) == 1 else _of_two)(*flat, np.ascontiguousarray(coefficients), found)
    return found.reshape(*at[0].shape, 6)


@njit(**INNER)
def _terms(x, found):  # type: ignore[no-untyped-def]
    """Chebyshev polynomials (d + 1, k) at x (k,): several at once, as each waits for the two before it."""
    for i in range(len(found)):
        for k in range(len(x)):
            if i > 1:
                found[i, k] = 2.0 * x[k] * found[i - 1, k] - found[i - 2, k]
            else:
                found[i, k] = x[k] if i else 1.0


@njit(**KERNEL)
def _of_one(x, coefficients, found):  # type: ignore[no-untyped-def]
    """Sums at x (k,), into found (k, 6)."""
    terms = np.empty((len(coefficients), BLOCK))
    for start in range(0, len(x), BLOCK):
        here = x[start : start + BLOCK]
        _terms(here, terms)
        for k in range(len(here)):
            found[start + k] = _row(terms[:, k], coefficients)


@njit(**KERNEL)
def _of_two(x, y, coefficients, found):  # type: ignore[no-untyped-def]
    """Sums at x and y (k,), into found (k, 6)."""
    rows, count, _ = coefficients.shape
    first, second, inner = np.empty((rows, BLOCK)), np.empty((count, BLOCK)), np.empty((rows, 6))
    for start in range(0, len(x), BLOCK):
        here = x[start : start + BLOCK]
        _terms(here, first)
        _terms(y[start : start + BLOCK], second)
        for k in range(len(here)):
            for i in range(rows):
                inner[i] = _row(second[:, k], coefficients[i])
            found[start + k] = _row(first[:, k], inner)


@njit(**INNER)
def _row(terms, coefficients):  # type: ignore[no-untyped-def]
    """The six sums of terms (d + 1,) times coefficients (d + 1, 6): in registers, which a loop over six is not."""
    a, b, c, d, e, f = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(terms)):
        t = terms[i]
        a += t * coefficients[i, 0]
        b += t * coefficients[i, 1]
        c += t * coefficients[i, 2]
        d += t * coefficients[i, 3]
        e += t * coefficients[i, 4]
        f += t * coefficients[i, 5]
    return a, b, c, d, e, f
