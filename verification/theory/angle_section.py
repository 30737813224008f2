"""Torsional buckling of an angle section compressed along its crease (Timoshenko and Gere, section 9.4).

Two equal legs meet at a straight crease whose angle is kept. Both turn the same way, so neither bends the
other at the crease, and each leg is a plate of width b and length a, simply supported at the crease and at
its ends, free at the outer edge: w = Y(y) sin(pi x / a) with D (Y'''' - 2 m^2 Y'' + m^4 Y) = N m^2 Y, m = pi
/ a.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq


def rayleigh(length: float, leg: float, nu: float) -> float:
    """K in N = k pi^2 D / b^2 for w = y sin(pi x / a), an upper bound: (6 / pi^2)(1 - nu) + (b / a)^2.

    Args:
        length: a, mm.
        leg: b, mm.
        nu: Poisson's ratio.
    """
    return 6.0 * (1.0 - nu) / math.pi**2 + (leg / length) ** 2


def exact(length: float, leg: float, nu: float) -> float:
    """K of the plate equation: the lowest root of the condition at the free edge.

    Y = A sinh(p y) + C sin(r y), p^2 = m^2 + m sqrt(N / D), r^2 = -m^2 + m sqrt(N / D); free of moment and force:
    Y'' - nu m^2 Y = 0 and Y''' - (2 - nu) m^2 Y' = 0.

    Args:
        length: a, mm.
        leg: b, mm.
        nu: Poisson's ratio.
    """
    m = math.pi / length

    def gap(k: float) -> float:
        push = m * math.pi / leg * math.sqrt(k)
        p, r = math.sqrt(push + m * m), math.sqrt(push - m * m)
        rows = (
            (p * p - nu * m * m) * math.sinh(p * leg),
            -(r * r + nu * m * m) * math.sin(r * leg),
            p * (p * p - (2.0 - nu) * m * m) * math.cosh(p * leg),
            -r * (r * r + (2.0 - nu) * m * m) * math.cos(r * leg),
        )
        return rows[0] * rows[3] - rows[1] * rows[2]

    high = rayleigh(length, leg, nu)
    grid = np.linspace(1.0001 * (leg / length) ** 2, 1.01 * high, 400)
    values = [gap(float(k)) for k in grid]
    first = next(i for i in range(len(grid) - 1) if values[i] * values[i + 1] < 0.0)
    return float(brentq(gap, grid[first], grid[first + 1], xtol=1e-14))
