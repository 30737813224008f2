"""An annulus sector folded along its concentric crease is a pair of cones (source 3.4.2, B.4; Eq. 3.13)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray


def bending_energy(D: float, angle: float, inner: float, outer: float, dihedral: float) -> float:
    """U = 1/2 D theta_a ln(r_o / r_i) cot^2(phi / 2), N mm; `D` N mm, radii in mm, angles in rad.

    From kappa_2 of Eq. 3.13, which is cot(phi / 2) / r in terms of the flat radius r, integrated over the sector.
    """
    return 0.5 * D * angle * math.log(outer / inner) / math.tan(0.5 * dihedral) ** 2


def crease_radius(radius: float, dihedral: float) -> float:
    """Radius r_f sin(phi / 2) of the folded crease, mm (Fuchs and Tabachnikov 1999)."""
    return radius * math.sin(0.5 * dihedral)


def folded_points(
    radius: NDArray[np.float64], azimuth: NDArray[np.float64], crease: float, dihedral: float
) -> NDArray[np.float64]:
    """(k, 3) places of flat polar points after the fold, mm; the crease is the highest line, in z = 0.

    A generator keeps its length: the distance from the apex is the flat radius. The half angle of the cones has the
    sine R / r_f = sin(phi / 2), and the part outside the crease is mirrored in its plane.
    """
    sine = math.sin(0.5 * dihedral)
    turn = azimuth / sine
    height = -np.abs(radius - crease) * math.cos(0.5 * dihedral)
    return np.column_stack((radius * sine * np.cos(turn), radius * sine * np.sin(turn), height))
