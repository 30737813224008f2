"""An annulus sector folded along its concentric crease is a pair of cones (source 3.4.2, B.4; Eq. 3.13)."""

from __future__ import annotations

import math


def bending_energy(D: float, angle: float, inner: float, outer: float, dihedral: float) -> float:
    """U = 1/2 D theta_a ln(r_o / r_i) cot^2(phi / 2), N mm; `D` N mm, radii in mm, angles in rad.

    From kappa_2 of Eq. 3.13, which is cot(phi / 2) / r in terms of the flat radius r, integrated over the sector.
    """
    return 0.5 * D * angle * math.log(outer / inner) / math.tan(0.5 * dihedral) ** 2


def crease_radius(radius: float, dihedral: float) -> float:
    """Radius r_f sin(phi / 2) of the folded crease, mm (Fuchs and Tabachnikov 1999)."""
    return radius * math.sin(0.5 * dihedral)
