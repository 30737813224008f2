"""Sheets with a grain: moduli at an angle, plates, cones (Lekhnitskii 1968; Timoshenko and Woinowsky-Krieger 1959)."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from scipy.integrate import quad

Moduli = Mapping[str, float]


def off_axis(card: Moduli, degrees: float) -> tuple[float, float, float]:
    """Compliances of a sheet whose grain stands at an angle to x (Jones 1999, Eqs. 2.88-2.97).

    Args:
        card: E1, E2, G12 (MPa) and nu12.
        degrees: angle of the grain.

    Returns:
        S11, S16 and S66 in the axes of the drawing, 1 / MPa.
    """
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    along, across = 1.0 / card["E1"], 1.0 / card["E2"]
    mixed, shear = -card["nu12"] / card["E1"], 1.0 / card["G12"]
    s11 = along * c**4 + (2.0 * mixed + shear) * s**2 * c**2 + across * s**4
    s16 = (2.0 * along - 2.0 * mixed - shear) * s * c**3 - (2.0 * across - 2.0 * mixed - shear) * s**3 * c
    s66 = 2.0 * (2.0 * along + 2.0 * across - 4.0 * mixed - shear) * s**2 * c**2 + shear * (s**4 + c**4)
    return s11, s16, s66


def rigidities(card: Moduli) -> tuple[float, float, float]:
    """D1, D2 and H = D12 + 2 D66 of a sheet in the axes of its grain, N mm.

    Args:
        card: E1, E2, G12 (MPa), nu12 and t (mm).

    Returns:
        the three, as Timoshenko and Woinowsky-Krieger (1959), article 85, have them.
    """
    cube = card["t"] ** 3 / 12.0
    definite = 1.0 - card["nu12"] ** 2 * card["E2"] / card["E1"]
    d1, d2 = cube * card["E1"] / definite, cube * card["E2"] / definite
    return d1, d2, card["nu12"] * d2 + 2.0 * cube * card["G12"]


def navier(card: Moduli, a: float, b: float, q: float, terms: int = 99) -> float:
    """Deflection of the middle of a simply supported plate under a load q an area, mm; the grain runs along a.

    Args:
        card: as `rigidities`.
        a: side along x, mm.
        b: side along y, mm.
        q: load, MPa.
        terms: of the series, each way.

    Returns:
        mm.
    """
    d1, d2, h = rigidities(card)
    m, n = np.meshgrid(np.arange(1, terms + 1, 2), np.arange(1, terms + 1, 2))
    stiff = d1 * (m / a) ** 4 + 2.0 * h * (m * n / (a * b)) ** 2 + d2 * (n / b) ** 4
    sign = np.sin(0.5 * np.pi * m) * np.sin(0.5 * np.pi * n)
    return float(16.0 * q / np.pi**6 * (sign / (m * n * stiff)).sum())


def twisted(card: Moduli, a: float, b: float, load: float, degrees: float) -> float:
    """Deflection of the loaded corner of a plate that rests on the other three, 3 P a b S66 / t^3, mm.

    Args:
        card: E1, E2, G12, nu12, t.
        a: side, mm.
        b: other side, mm.
        load: P, N.
        degrees: angle of the grain.

    Returns:
        mm.
    """
    return 3.0 * load * a * b * off_axis(card, degrees)[2] / card["t"] ** 3


def cone_energy(
    card: Moduli, radii: tuple[float, float], sector: float, half: float, degrees: float
) -> float:
    """Bending energy of a flat sector that is laid round a cone: 1/2 D(phi) (cot alpha / r)^2 an area.

    D(phi) is t^3 / 12 times the plane-stress stiffness in the direction round the cone, phi + 90 degrees.

    Args:
        card: E1, E2, G12, nu12, t.
        radii: of the inner and the outer edge from the apex, mm.
        sector: angle of the flat sector, rad, which begins at the x axis.
        half: alpha, between the axis of the cone and its rulings, rad.
        degrees: angle of the grain.

    Returns:
        N mm.
    """
    d1, d2, h = rigidities(card)

    def round_the_cone(phi: float) -> float:
        to_grain = phi + 0.5 * math.pi - math.radians(degrees)
        c, s = math.cos(to_grain), math.sin(to_grain)
        return d1 * c**4 + 2.0 * h * s**2 * c**2 + d2 * s**4

    turned = quad(round_the_cone, 0.0, sector)[0]
    return float(0.5 / math.tan(half) ** 2 * math.log(radii[1] / radii[0]) * turned)
