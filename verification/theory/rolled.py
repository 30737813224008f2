"""A straight elastica under equal and opposite end moments is an arc of a circle (Love 1927, section 262)."""

from __future__ import annotations

import math


def curvature(EI: float, moment: float) -> float:
    """M / (E I), 1/mm; `EI` N mm^2, `moment` N mm."""
    return moment / EI


def chord(L: float, kappa: float) -> float:
    """Signed distance between the ends along the line that they stay on: sin(kappa L / 2) / (kappa / 2), mm."""
    return L * _sinc(0.5 * kappa * L)


def sag(L: float, kappa: float) -> float:
    """Distance of the middle from the chord: (1 - cos(kappa L / 2)) / kappa, mm."""
    half = 0.25 * kappa * L
    return 0.5 * L * math.sin(half) * _sinc(half)


def _sinc(x: float) -> float:
    return math.sin(x) / x if x != 0.0 else 1.0
