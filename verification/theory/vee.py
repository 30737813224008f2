"""A folded strip pulled open: hinge and elastica in series (Lechenault, Thiria and Adda-Bedia 2014, PRL 112, 244301).

Two panels of length l meet at a crease of stiffness k a length; at rest they lie at an angle `incline` to the line of
load, on which their free ends are. The panels have bending stiffness B a width, and L* = B / k.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


def opened(force: float, ratio: float, incline: float) -> float:
    """Span of the free ends over 2 l.

    With theta the angle to the line of load, B theta'' = F sin(theta), no moment at the free end, and at the crease
    B theta' = k (2 incline - 2 theta).

    Args:
        force: F l^2 / B, F a width.
        ratio: l / L*.
        incline: at rest, rad.
    """

    def panel(start: float) -> tuple[float, float, float]:
        found = solve_ivp(
            lambda _s, y: [y[1], force * math.sin(y[0]), math.cos(y[0])],
            (0.0, 1.0),
            [start, 0.0, 0.0],
            method="DOP853",
            rtol=1e-12,
            atol=1e-14,
        )
        angle, rate, span = found.y[:, -1]
        return float(angle), float(rate), float(span)

    def gap(start: float) -> float:
        angle, rate, _ = panel(start)
        return rate - ratio * 2.0 * (incline - angle)

    return panel(float(brentq(gap, 0.0, incline, xtol=1e-15)))[2]


def compliance(ratio: float, incline: float) -> float:
    """Opening over force for small forces, (delta / l) / (F l^2 / B).

    From M(s) = F s sin(incline): delta / F = (l^2 sin^2 / k) (1 + 2 l / (3 L*)).
    """
    return float(np.sin(incline) ** 2 * (1.0 + 2.0 / 3.0 * ratio) / ratio)
