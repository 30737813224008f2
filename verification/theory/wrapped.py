"""A strip on two supports, pressed in its middle by a rigid cylinder that it wraps round: an inextensible elastica.

By symmetry one half of length L counts, from the middle (s = 0) to the support. Up to the lift-off angle phi it lies on
the cylinder, curvature 1 / R; beyond it is free and carries the vertical force Q of its support, which slides without
friction. With theta the slope, EI theta'^2 / 2 + Q sin theta = Q sin theta_e, and theta' = 1 / R at theta = phi, so

    Q = EI / (2 R^2 D),  D = sin theta_e - sin phi,  sin theta = sin theta_e - D u^2,  ds = 2 D R du / cos theta

with u from 1 at lift-off to 0 at the support. The cylinder presses with Q cos phi at the lift-off point and, since the
strip on it is under the tension Q sin phi, with Q sin(phi) / R a length before it. N, mm, rad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(40)


@dataclass(frozen=True)
class Wrapped:
    """Half of a wrapped strip.

    Attributes:
        phi: lift-off angle, rad.
        force: of the cylinder on the whole strip, 2 Q, N.
        deflection: of the middle from the supports, mm.
        arm: mean distance from the middle at which the vertical force of the cylinder on one half acts, mm.
    """

    phi: float
    force: float
    deflection: float
    arm: float


def _free(phi: float, slope: float, R: float) -> tuple[float, float]:
    """Length and rise of the free part that ends with the slope `slope`, rad; mm."""
    drop = math.sin(slope) - math.sin(phi)
    u = 0.5 * (POINTS + 1.0)
    sine = math.sin(slope) - drop * u**2
    cosine = np.sqrt(1.0 - sine**2)
    return float(drop * R * (WEIGHTS / cosine).sum()), float(drop * R * (WEIGHTS * sine / cosine).sum())


def wrapped(phi: float, L: float, R: float, EI: float) -> Wrapped:
    """The strip that lifts off at an angle.

    Args:
        phi: lift-off angle, rad, from 0.
        L: half of the strip between its supports along it, mm.
        R: radius of the cylinder, mm.
        EI: bending stiffness, N mm^2.
    """
    slope = brentq(lambda s: _free(phi, s, R)[0] - (L - R * phi), phi + 1e-9, 0.5 * math.pi - 1e-6)
    Q = EI / (2.0 * R**2 * (math.sin(slope) - math.sin(phi)))
    deflection = R * (1.0 - math.cos(phi)) + _free(phi, slope, R)[1]
    arm = R * math.sin(phi) * (math.cos(phi) ** 2 + 0.5 * math.sin(phi) ** 2)
    return Wrapped(phi, 2.0 * Q, deflection, arm)


def wrapped_by(deflection: float, L: float, R: float, EI: float) -> Wrapped:
    """The strip whose middle is pressed by a deflection, mm; other arguments as for `wrapped`.

    Raises:
        ValueError: it does not wrap round the cylinder yet, or farther than half a radian or nearly to its end.
    """
    most = min(0.5, 0.9 * L / R)
    phi = brentq(lambda angle: wrapped(angle, L, R, EI).deflection - deflection, 0.0, most)
    return wrapped(phi, L, R, EI)
