"""What a folded crease can be given as: a function, symbolic expressions or samples over its parameter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.analysis.differences import Differentiation
from bh.errors import ModelError

Array = NDArray[np.float64]
Function = Callable[[Array], ArrayLike]


@runtime_checkable
class Symbolic(Protocol):
    """An expression of sympy, which is only loaded by who uses it."""

    @property
    def free_symbols(self) -> object:
        """The symbols in it."""


Given = Function | ArrayLike | Symbolic | Sequence[Symbolic]


def parameters(u: ArrayLike | None, interval: tuple[float, float] | None, samples: int) -> Array:
    """(k,) rising parameters: those that are given, or even ones on the interval.

    Args:
        u: (k,) parameters that are given, or None.
        interval: first and last parameter, where they are not.
        samples: how many are taken on the interval.

    Raises:
        ModelError: too few, not rising or not finite, or neither of the two is given.
    """
    if u is not None:
        at = np.asarray(u, dtype=float)
        if at.ndim != 1 or len(at) < 8 or not np.isfinite(at).all() or not (np.diff(at) > 0.0).all():
            raise ModelError("the parameters u of a crease must be at least 8 finite numbers that rise")
        return at
    if interval is None:
        raise ModelError("a crease needs its parameters u, or the interval (first, last) of its parameter")
    first, last = (float(end) for end in interval)
    if not (np.isfinite([first, last]).all() and first < last):
        raise ModelError(
            f"the interval ({first:g}, {last:g}) of a crease is empty; give its ends in rising order"
        )
    if samples < 8:
        raise ModelError(f"samples = {samples} are too few for the derivatives of a crease; give 8 or more")
    return np.linspace(first, last, samples)


def derivatives(
    what: str, given: Given, u: Array, columns: int, method: Differentiation, highest: int
) -> Array:
    """(highest + 1, k, columns) values and derivatives at u of what is given in any form.

    Symbolic expressions (sympy's) are differentiated exactly; functions and samples by `method`.

    Args:
        what: is given, for messages.
        given: function of u (k,), expressions of sympy, or samples.
        u: (k,) rising parameters.
        columns: numbers for each of them.
        method: differentiates functions and samples.
        highest: order of the derivatives.

    Returns:
        the values first, then derivatives by u of rising order.

    Raises:
        ModelError: values that are not finite or do not fit.
    """
    symbols = _expressions(given)
    if symbols is not None:
        if len(symbols) != columns:
            raise ModelError(f"{what} needs {columns} expressions, but has {len(symbols)}")
        return _symbolic(what, symbols, u, highest)
    values = np.asarray(given(u) if callable(given) else given, dtype=float)
    if values.ndim <= 1 and columns == 1:
        values = np.broadcast_to(values, u.shape)[:, None] if values.shape in ((), u.shape) else values
    if values.shape != (len(u), columns):
        raise ModelError(
            f"{what} has shape {values.shape}; give {columns} number{'s' * (columns > 1)} for each of the {len(u)} "
            "parameters u"
        )
    if not np.isfinite(values).all():
        raise ModelError(
            f"{what} is not finite at u = {u[int(np.argmin(np.isfinite(values).all(axis=1)))]:g}"
        )
    return method.derivatives(u, values, u, highest)


def _expressions(given: Given) -> list[object] | None:
    """The single expressions of something symbolic, or None."""
    if isinstance(given, Symbolic):
        return [given]
    if not isinstance(given, Sequence) or not any(isinstance(item, Symbolic) for item in given):
        return None
    return list(given)


def _symbolic(what: str, items: list[object], u: Array, highest: int) -> Array:
    from sympy import Symbol, lambdify, sympify

    # strict: a text among them would be evaluated
    expressions = [sympify(item, strict=True) for item in items]
    symbols = set().union(*(item.free_symbols for item in expressions))
    if len(symbols) != 1:
        names = ", ".join(sorted(map(str, symbols)))
        raise ModelError(f"{what} must be an expression of one symbol, but has {len(symbols)}: {names}")
    (symbol,) = symbols
    assert isinstance(symbol, Symbol)
    out = np.empty((highest + 1, len(u), len(expressions)))
    for column, expression in enumerate(expressions):
        for order in range(highest + 1):
            out[order, :, column] = lambdify(symbol, expression.diff(symbol, order), "numpy")(u)
    if not np.isfinite(out).all():
        raise ModelError(f"{what} or a derivative of it is not finite on the interval; choose another one")
    return out
