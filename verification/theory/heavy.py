"""The heavy elastica: a clamped rod that its own weight bends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_bvp

Array = NDArray[np.float64]


def elastica(parameter: float) -> tuple[float, float]:
    """End (x, y) over the length of a clamped heavy rod: theta'' = p (1 - s) cos theta.

    Args:
        parameter: p = q L^3 / D.

    Returns:
        x and y over the length; y is below the clamp where it is negative.

    Raises:
        RuntimeError: the equation was not solved.
    """

    def rates(s: Array, y: Array) -> Array:
        return np.array([y[1], parameter * (1.0 - s) * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    def ends(a: Array, b: Array) -> Array:
        return np.array([a[0], b[1], a[2], a[3]])

    s = np.linspace(0.0, 1.0, 101)
    found = solve_bvp(rates, ends, s, np.vstack((-s, -np.ones(101), s, -0.5 * s)), tol=1e-9)
    if not found.success:
        raise RuntimeError(f"the heavy elastica of p = {parameter:g}: {found.message}")
    return float(found.y[2, -1]), float(found.y[3, -1])
