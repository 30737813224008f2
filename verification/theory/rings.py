"""Rings that are closed but want to be more curved, by Kirchhoff's rods. mm, N, MPa.

P.-O. Mouthuy, M. Coulombier, T. Pardoen, J.-P. Raskin, A. M. Jonas, Overcurvature describes the buckling and folding of
rings from curved origami to foldable tents, Nature Communications 3 (2012) 1290.
"""

from __future__ import annotations

import math


def overcurved(nu: float, radius: float, width: float, t: float, waves: int = 2) -> float:
    """Curvature beyond 1 / R that a flat closed ring may want in its plane before it leaves it, 1 / mm.

    The ring carries the moment -m alike all over, m = B2 (k0 - 1 / R), about the axis of its plane, and no force.
    Beside it the tangent's tilt a and the twist b change the curvature out of the plane by q = a' + b / R and the
    torsion by p = b' - a / R, whose moments B1 q and C p are in balance where C p' = (B1 / R + m) q and
    B1 q' = -(C / R + m) p. Waves cos(n s / R) ask for

        (1 + m R / B1) (1 + m R / C) = n^2,   n = 2 first (n = 1 turns the whole ring).

    A strip has B1 = E w t^3 / 12, B2 = E t w^3 / 12 and C = G w t^3 / 3.

    Args:
        nu: Poisson's ratio.
        radius: R, mm.
        width: w in the plane, mm; narrow beside R.
        t: mm; thin beside w.
        waves: n.
    """
    twist = 2.0 / (1.0 + nu)  # C / B1
    a, b, c = 1.0 / twist, 1.0 + 1.0 / twist, 1.0 - waves**2
    x = (-b + math.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)
    return x * (t / width) ** 2 / radius
