"""Energies of a thin strip of length L, width H, thickness t by structural mechanics (Timoshenko and Goodier 1970).

Poisson's ratio is zero (G = E / 2), as in section 3.4.1 of the source. MPa, mm, N mm.
"""

from __future__ import annotations

import math


def tension(E: float, L: float, H: float, t: float, elongation: float) -> float:
    """1/2 E H t / L u^2."""
    return 0.5 * E * H * t / L * elongation**2


def torsion(E: float, L: float, H: float, t: float, end_displacement: float) -> float:
    """1/2 G J theta^2 / L with J = H t^3 / 3 (St Venant, thin) and theta = 2 u / H, +-u at the two corners."""
    twist = 2.0 * end_displacement / H
    return 0.5 * (E / 2.0) * (H * t**3 / 3.0) * twist**2 / L


def four_point_bending(E: float, L: float, H: float, t: float, arm: float, displacement: float) -> float:
    """6 E I u^2 / (a^2 (3 L - 4 a)): simple supports at both ends, u imposed at a distance a from each."""
    inertia = H * t**3 / 12.0
    return 6.0 * E * inertia * displacement**2 / (arm**2 * (3.0 * L - 4.0 * arm))


def four_point_compliance(E: float, L: float, H: float, t: float, arm: float) -> float:
    """Displacement of the loads a unit load (each of the two), mm / N."""
    inertia = H * t**3 / 12.0
    return arm**2 * (3.0 * L - 4.0 * arm) / (6.0 * E * inertia)


def in_plane_bending(E: float, L: float, H: float, t: float, displacement: float) -> float:
    """1/2 (3 E I / L^3) u^2 with I = t H^3 / 12: Euler-Bernoulli cantilever.

    Shear would lower it by 0.6 % at L / H = 10.
    """
    return 0.5 * 3.0 * E * (t * H**3 / 12.0) / L**3 * displacement**2


def twist_ratio(alpha: float) -> float:
    """Energy in uniform twist over St Venant's for one diagonal hinge (Eq. 3.11) a cell W x H, alpha = H / W.

    w = kappa x y at the nodes turns the diagonal by kappa L; 1/2 k_b (kappa L)^2 over E t^3 / 12 kappa^2 W H.
    """
    return (alpha + 1.0 / alpha) ** 2


def twist_ratio_staggered(alpha: float) -> float:
    """The same for isosceles triangles of base W and height H: two slanted hinges a cell, each turned by kappa L."""
    return 2.0 * (alpha + 0.25 / alpha) ** 2


def bending_ratio_alternating(alpha: float) -> float:
    """Out-of-plane bending over beam theory far from the ends: vertical and diagonal hinges in series."""
    return 2.0 / (1.0 + (1.0 + alpha**-2) ** -2)


def uniform_load_work(E: float, L: float, H: float, t: float, pressure: float = 1.0) -> float:
    """1/2 q u integrated over a simply supported beam: (p H)^2 L^5 / (240 E I), I = H t^3 / 12."""
    return (pressure * H) ** 2 * L**5 / (240.0 * E * H * t**3 / 12.0)


def arc_azimuth(angle: float) -> float:
    """Direction in which a flat circular cantilever is stiffest at its tip, rad from the radius (to the centre).

    The arc of radius 1 takes `angle` (rad) and is fixed at its other end. Bending alone: a force along a line through
    the tip has the moment of the distance from that line, so the stiff line is the principal axis of the least second
    moment of the arc about the tip, where s runs from the tip, X = 1 - cos s to the centre and Y = sin s along the arc.
    """
    xx = 1.5 * angle - 2.0 * math.sin(angle) + 0.25 * math.sin(2.0 * angle)
    yy = 0.5 * angle - 0.25 * math.sin(2.0 * angle)
    xy = (1.0 - math.cos(angle)) - 0.5 * math.sin(angle) ** 2
    return 0.5 * math.atan2(2.0 * xy, xx - yy)
