"""A strip buckled between two clamps, one or both of which are turned (Gomez, Moulton, Vella 2017, Nat. Phys. 13, 142).

Small slopes, lengths over that of the strip, w over sqrt(dL / L), with dL what its ends are brought nearer
by:

    w'''' + tau^2 w'' = 0,   w = 0 and given slopes at both ends,   1/2 int w'^2 = 1,

tau^2 the compression. The slope of the turned clamp, over sqrt(dL / L), is mu; its largest value is a limit
point, behind which the strip snaps. With both clamps turned alike (mirrored) an unsymmetric state branches
off before, at tan(tau / 2) = tau / 2, where mu = 2. The energy over B dL / L^2 a width is 1/2 int w''^2. At
mu = 0 the arch has tau = 2 pi and the saddle between the two arches the second mode, tau = 8.98682:
energies tau^2, since int w''^2 = tau^2 int w'^2 for modes.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

Array = NDArray[np.float64]


@cache
def second_mode() -> float:
    """Tau of the second mode between clamps: tan(tau / 2) = tau / 2."""
    return float(
        brentq(lambda tau: math.sin(0.5 * tau) - 0.5 * tau * math.cos(0.5 * tau), 7.0, 9.2, xtol=1e-14)
    )


def _unit(tau: float) -> tuple[float, Array]:
    """Int w'^2 for mu = 1, and w = a + b x + c cos(tau x) + d sin(tau x)."""
    c, s = math.cos(tau), math.sin(tau)
    rows = [[1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, tau], [1.0, 1.0, c, s], [0.0, 1.0, -tau * s, tau * c]]
    w = np.linalg.solve(rows, [0.0, 1.0, 0.0, 0.0])
    x = 0.5 * (np.polynomial.legendre.leggauss(40)[0] + 1.0)
    weight = 0.5 * np.polynomial.legendre.leggauss(40)[1]
    slope = w[1] - tau * w[2] * np.sin(tau * x) + tau * w[3] * np.cos(tau * x)
    return float(weight @ slope**2), np.asarray(w)


def turned(tau: float) -> float:
    """|mu| of one turned clamp at a compression.

    Args:
        tau: root of the compression, above 2 pi and below `second_mode` for the arch turned against its sense.
    """
    return math.sqrt(2.0 / _unit(tau)[0])


@cache
def snap() -> tuple[float, float]:
    """Mu at the limit point of one turned clamp, and tau there."""
    low, high = 2.0 * math.pi + 1e-6, second_mode() - 1e-6
    found = minimize_scalar(
        lambda tau: -turned(tau), bounds=(low, high), method="bounded", options={"xatol": 1e-10}
    )
    return turned(float(found.x)), float(found.x)


def energies() -> tuple[float, float]:
    """At mu = 0: of the arch and of the saddle, over B dL / L^2."""
    return 4.0 * math.pi**2, second_mode() ** 2
