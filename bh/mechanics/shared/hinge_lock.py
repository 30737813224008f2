"""The lock that keeps panels from passing through each other at a hinge. Compiled; a law, not a measure.

With d = min(phi, 2 pi - phi) the angle that is left until the hinge is closed, w = `ZONE`, y = pi d / (2 w) and
x = pi / 2 - y, a hinge with d < w has in addition

    energy      k (2 w / pi)^2 (-ln sin y - x^2 / 2)                  N mm
    moment      -+ k (2 w / pi) (cot y - x)                           N mm, - next to 0 and + next to 2 pi
    stiffness   k cot^2 y                                             N mm / rad

and outside of the zone nothing at all. It is the enhanced law of Liu and Paulino (2017) against local penetration
(moment k times the turn up to the zone, then k (2 w / pi) tan x more), less the part k times the turn that the hinge
has in any case; so it begins with the fourth power of x and the potential has four continuous derivatives. Moment and
energy grow without bound towards d = 0.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.mechanics.shared.kinematics import INNER_OPTIONS, compiled

Array = NDArray[np.float64]
ZONE = math.radians(2.0)  # rad next to 0 and 2 pi
CLOSEST = 1e-12  # rad; angles are no better than that, and a closed hinge must not give infinite numbers
_OPEN, _WIDTH = 2.0 * math.pi - ZONE, 2.0 * ZONE / math.pi


def until_closed(phi: Array) -> Array:
    """Angle that is left until hinges at dihedral angles `phi` are closed one way or the other, rad.

    Returns:
        of the shape of `phi`, not negative.
    """
    return np.minimum(phi, 2.0 * math.pi - phi)


@njit(inline="always", **INNER_OPTIONS)
def in_zone(phi):  # type: ignore[no-untyped-def]
    """True for a dihedral angle (rad) that is so near to 0 or 2 pi that the lock acts."""
    return phi < ZONE or phi > _OPEN


@njit(**INNER_OPTIONS)
def lock(phi, k):  # type: ignore[no-untyped-def]
    """Energy (N mm), its derivative (N mm) and second derivative (N mm / rad) at an angle in the zone (`in_zone`)."""
    left = phi if phi < math.pi else 2.0 * math.pi - phi
    y = max(left, CLOSEST) / _WIDTH
    sine, x = math.sin(y), 0.5 * math.pi - y
    cotangent = math.cos(y) / sine
    moment = k * _WIDTH * (cotangent - x)
    return (
        k * _WIDTH * _WIDTH * (-math.log(sine) - 0.5 * x * x),
        -moment if phi < math.pi else moment,
        k * cotangent * cotangent,
    )


@compiled
def lock_terms(phi: Array, k: Array) -> Array:
    """(h, 3) energy, moment and stiffness of the locks of hinges at dihedral angles phi (h,), zero off the zone.

    Args:
        phi: (h,) dihedral angles, rad.
        k: (h,) stiffness of the locks, N mm / rad.
    """
    out = np.empty((len(phi), 3))
    for i in range(len(phi)):
        energy = moment = stiffness = 0.0
        if in_zone(phi[i]):
            energy, moment, stiffness = lock(phi[i], k[i])
        out[i, 0], out[i, 1], out[i, 2] = energy, moment, stiffness
    return out
