"""Closed forms of stepped, heated and curved sheets. mm, N, MPa; curvatures are positive where edges go up.

S. Timoshenko, Analysis of bi-metal thermostats, J. Opt. Soc. Am. 11 (1925); R. M. Jones, Mechanics of Composite
Materials (1999), ch. 4.
"""

from __future__ import annotations

import math

import numpy as np


def stepped_cantilever(
    load: float, E: float, width: float, length: float, step: float, t: tuple[float, float]
) -> float:
    """Deflection of the end of a cantilever that is t[0] thick up to `step` and t[1] beyond, mm, nu = 0.

    Args:
        load: at the end, N.
        E: MPa.
        width: mm.
        length: mm.
        step: where the thickness changes, mm from the clamp.
        t: both thicknesses, mm.
    """
    root, end = (width * each**3 / 12.0 for each in t)
    left = length - step
    return load / (3.0 * E) * ((length**3 - left**3) / root + left**3 / end)


def bimetal(below: tuple[float, float, float], above: tuple[float, float, float], change: float) -> float:
    """Curvature of a heated strip of two metals (Timoshenko 1925, Eq. 4), 1 / mm.

    Args:
        below: E, t and expansion of the metal at the bottom.
        above: of the one at the top.
        change: of the temperature.
    """
    (E1, t1, a1), (E2, t2, a2) = below, above
    m, n, h = t1 / t2, E1 / E2, t1 + t2
    more = (a1 - a2) * change
    return 6.0 * more * (1.0 + m) ** 2 / (h * (3.0 * (1.0 + m) ** 2 + (1.0 + m * n) * (m**2 + 1.0 / (m * n))))


def cross_ply(E1: float, E2: float, nu12: float, a: tuple[float, float], t: float, change: float) -> float:
    """Curvature along x of a small heated [0/90], fibres along x at the bottom; along y it is the opposite, 1 / mm.

    With e_x = e_y = e and k_x = -k_y = k, N_x and M_x vanish: two equations (Jones 1999, 4.3 and 4.4).

    Args:
        E1: along the fibres, MPa.
        E2: across them, MPa.
        nu12: Poisson's ratio.
        a: expansion along and across them.
        t: of either ply, mm.
        change: of the temperature.
    """
    scale = 1.0 - nu12**2 * E2 / E1
    Q11, Q22, Q12 = E1 / scale, E2 / scale, nu12 * E2 / scale
    along, across = Q11 * a[0] + Q12 * a[1], Q12 * a[0] + Q22 * a[1]
    B = 0.5 * t**2 * (Q22 - Q11)
    left = [[t * (Q11 + Q22 + 2.0 * Q12), -B], [-B, t**3 / 3.0 * (Q11 + Q22 - 2.0 * Q12)]]
    right = [t * (along + across), 0.5 * t**2 * (along - across)]
    return float(change * np.linalg.solve(left, right)[1])


def chord(radius: float, length: float) -> float:
    """Distance of the ends of a strip that has rolled to a cylinder, mm."""
    return 2.0 * radius * abs(math.sin(0.5 * length / radius))
