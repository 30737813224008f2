"""A disc folded along n radial creases: a cone with two states (Lechenault and Adda-Bedia 2015, PRL 115, 235501).

Isometric sheets with generators through the middle meet the unit sphere in a curve of length 2 pi, its geodesic
curvature kappa(s) being r times that of the sheet; with equal fold angles psi at the creases
E = B ln(R / r0) n int_0^alpha kappa^2 ds, alpha = pi / n. With r the place on the sphere, t the tangent and n = r x t,
rotations conserve J = kappa r + kappa' t + (c - kappa^2 / 2) n, which is the spherical elastica

    kappa'' + (1 - c) kappa + kappa^3 / 2 = 0,

c the multiplier of the length. J is one vector on both sides of every crease, so for n equal panels it lies along the
axis. A panel is shot from its middle, where the elevation and kappa are unknown, to its crease, where the azimuth is
alpha and the tangent rises by psi / 2. Small slopes give the guess: f'' + f = g, g'' = (lambda - 1) g, f = g / lambda,
int f'^2 - f^2 = 0, from which (k^2 - 1) alpha = (k^2 + 1) sin(2 k alpha) / (2 k) with lambda = 1 - k^2 at rest, and
(k^2 - 1) sinh(2 k alpha) / (2 k) = (k^2 + 1) alpha with lambda = 1 + k^2 where it has snapped through.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root

Array = NDArray[np.float64]
STEP = math.radians(30.0)  # of the continuation in psi


@dataclass(frozen=True)
class ConeState:
    """One state.

    Attributes:
        middle: elevation of the middle of a panel, rad; `crease` that of a crease.
        crease: see `middle`.
        energy: over B ln(R / r0).
    """

    middle: float
    crease: float
    energy: float


def small(creases: int, snapped: bool) -> tuple[float, float, float]:
    """Small slopes: f(0), f(alpha) and the energy over B ln(R / r0) psi^2, the first two over psi.

    Args:
        creases: n, from 3 (at rest) or 2 (snapped).
        snapped: which of the two states.
    """
    alpha = math.pi / creases
    if snapped:
        k = _root(
            lambda k: (k * k - 1.0) * math.sinh(2.0 * k * alpha) / (2.0 * k) - (k * k + 1.0) * alpha,
            1.001,
            6.0,
        )
        slope, top, square = (
            k * math.sinh(k * alpha),
            math.cosh(k * alpha),
            0.5 * alpha + math.sinh(2 * k * alpha) / (4 * k),
        )
        factor = 1.0 + k * k
    else:
        k = _root(
            lambda k: (k * k - 1.0) * alpha - (k * k + 1.0) * math.sin(2.0 * k * alpha) / (2.0 * k),
            1.001,
            0.999 * creases,
        )
        slope, top, square = (
            -k * math.sin(k * alpha),
            math.cos(k * alpha),
            0.5 * alpha + math.sin(2 * k * alpha) / (4 * k),
        )
        factor = 1.0 - k * k
    size = 0.5 / slope
    return size, size * top, creases * (factor * size) ** 2 * square


def _root(gap: Callable[[float], float], low: float, high: float) -> float:
    return float(brentq(gap, low, high, xtol=1e-14))


def cone_state(creases: int, psi: float, snapped: bool) -> ConeState:
    """The state at any fold angle.

    Args:
        creases: n, from 3 (at rest) or 2 (snapped).
        psi: fold angle of every crease, rad.
        snapped: which of the two states.
    """
    alpha = math.pi / creases
    middle, _, _ = small(creases, snapped)
    k_squared = _factor(creases, snapped)
    at, unknown = (
        0.0,
        np.array([middle, k_squared * middle]),
    )  # elevation and curvature in the middle, over psi
    while at < psi:
        at = min(at + STEP, psi)
        found = root(lambda x, at=at: _gap(alpha, at, x), unknown, tol=1e-13)
        if not np.abs(_gap(alpha, at, found.x)).max() < 1e-9:
            raise ArithmeticError(f"the cone at {at:g} rad was not found")
        unknown = found.x
    end = _panel(alpha, psi * unknown)
    return ConeState(float(psi * unknown[0]), float(math.asin(end[4])), creases * float(end[11]))


def _factor(creases: int, snapped: bool) -> float:
    """Lambda of small slopes, the ratio of g and f."""
    middle, crease, _ = small(creases, snapped)
    alpha, ratio = math.pi / creases, crease / middle
    k = math.acosh(ratio) / alpha if snapped else math.acos(ratio) / alpha
    return 1.0 + k * k if snapped else 1.0 - k * k


def _panel(alpha: float, start: Array) -> Array:
    """(12,) kappa, kappa', r, t, n, int kappa^2 at the crease."""
    elevation, kappa = float(start[0]), float(start[1])
    c = 0.5 * kappa**2 + kappa / math.tan(elevation)  # J along the axis

    def rates(_s: float, y: Array) -> Array:
        r, t, n = y[2:5], y[5:8], y[8:11]
        bend = [y[1], -(1.0 - c) * y[0] - 0.5 * y[0] ** 3]
        return np.concatenate((bend, t, y[0] * n - r, -y[0] * t, [y[0] ** 2]))

    place = [math.cos(elevation), 0.0, math.sin(elevation)]
    normal = [-math.sin(elevation), 0.0, math.cos(elevation)]
    first = np.array([kappa, 0.0, *place, 0.0, 1.0, 0.0, *normal, 0.0])
    return np.asarray(solve_ivp(rates, (0.0, alpha), first, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1])


def _gap(alpha: float, psi: float, unknown: Array) -> Array:
    end = _panel(alpha, psi * unknown)
    r, t = end[2:5], end[5:8]
    azimuth = math.atan2(r[1], r[0]) - alpha
    across = (-r[1] * t[0] + r[0] * t[1]) / math.hypot(r[0], r[1])
    level = math.hypot(r[0], r[1])
    along = (-r[2] * (r[0] * t[0] + r[1] * t[1])) / level + level * t[2]  # tangent to the sphere, upwards
    return np.array([azimuth / psi, math.atan2(along, across) / psi - 0.5])
