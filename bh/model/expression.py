"""Fields that are typed as text, such as "0.1 * sin(pi * x / 100)": parsed, never evaluated as Python."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError

Array = NDArray[np.float64]
LONGEST = 300  # characters
BINARY: dict[type[ast.operator], Callable[[Array, Array], Array]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
FUNCTIONS: dict[str, Callable[[Array], Array]] = {
    name: getattr(np, name) for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "abs", "tanh", "sign")
}
ALLOWED = f"numbers, x, y, pi, + - * / **, and {', '.join(FUNCTIONS)}"


def field(text: str, what: str) -> Callable[[Array, Array], Array]:
    """The function of x and y, mm, that a text writes down.

    Args:
        text: an expression.
        what: it is for, for messages.

    Returns:
        what gives (n,) values of (n,) x and (n,) y.

    Raises:
        ModelError: it is no expression, or has something else in it than numbers, x, y, pi and a few functions.
    """
    if len(text) > LONGEST:
        raise ModelError(f"{what} has {len(text)} characters; give at most {LONGEST}")
    try:
        tree = ast.parse(text.strip().replace("^", "**"), mode="eval").body
        _check(tree)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        why = error.args[0] if type(error) is ValueError else "it is no expression"
        raise ModelError(f"{what} = '{text}' is not understood ({why}); use {ALLOWED}") from None

    def at(x: Array, y: Array) -> Array:
        with np.errstate(all="ignore"):
            values = np.broadcast_to(_value(tree, {"x": x, "y": y, "pi": np.array(math.pi)}), x.shape)
        if not np.isfinite(values).all():
            k = int(np.argmin(np.isfinite(values)))
            raise ModelError(f"{what} = '{text}' is not finite at x = {x[k]:g}, y = {y[k]:g} mm")
        return np.array(values, dtype=float)

    return at


def _check(node: ast.expr) -> None:
    """Raises `ValueError` with what is not allowed."""
    match node:
        case ast.Constant(value=int() | float()) if not isinstance(node.value, bool):
            return
        case ast.Name(id="x" | "y" | "pi"):
            return
        case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=inner):
            _check(inner)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in BINARY:
            _check(left)
            _check(right)
        case ast.Call(func=ast.Name(id=name), args=[inner], keywords=[]) if name in FUNCTIONS:
            _check(inner)
        case ast.Name(id=name):
            raise ValueError(f"'{name}' is not known")
        case _:
            raise ValueError(f"'{ast.unparse(node)[:40]}' is not allowed")


def _value(node: ast.expr, names: dict[str, Array]) -> Array:
    match node:
        case ast.Constant(value=int() | float() as value):
            return np.asarray(float(value))
        case ast.Name(id=name):
            return names[name]
        case ast.UnaryOp(op=op, operand=inner):
            return -_value(inner, names) if isinstance(op, ast.USub) else _value(inner, names)
        case ast.BinOp(left=left, op=operation, right=right):
            return BINARY[type(operation)](_value(left, names), _value(right, names))
        case ast.Call(func=ast.Name(id=name), args=[inner]):
            return FUNCTIONS[name](_value(inner, names))
    raise AssertionError(node)  # `_check` has seen it
