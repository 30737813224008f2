"""Folded family of parallel sine creases (Karami, Reddy and Nassar 2024, PRL 132, 108201, "curved-crease Miura").

Creases y = i b + a sin(q x), mountain and valley in turn, panels isometric. Every ruling stays parallel to y
in the flat sheet and is turned to (0, cos th, +-sin th), alike for all rulings. With s = dy/dx the tangent of
a crease keeps its length, 1 + s^2, and its product s with both rulings, so it is (sqrt(1 - s^2 tan^2 th), s /
cos th, 0): creases stay plane. The family ends at tan Theta = 1 / (a q). Everything below follows by
integration; B is the bending stiffness a width.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ellipe

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SineFold:
    """One member of the family.

    Attributes:
        amplitude: a of the sines, mm.
        wave: length of a wave in the flat sheet, mm.
        pitch: b, distance of the creases along y, mm.
        share: inclination over the steepest one, th / Theta, in (0, 1).
    """

    amplitude: float
    wave: float
    pitch: float
    share: float

    @property
    def q(self) -> float:
        """Wave number, 1 / mm."""
        return 2.0 * math.pi / self.wave

    @property
    def incline(self) -> float:
        """Th of the rulings, rad."""
        return self.share * math.atan(1.0 / (self.amplitude * self.q))

    @property
    def parameter(self) -> float:
        """M = (tan th / tan Theta)^2, of the elliptic integrals."""
        return (math.tan(self.incline) * self.amplitude * self.q) ** 2

    @property
    def length(self) -> float:
        """Length of a folded wave along x, mm: int sqrt(1 - m cos^2) dx = (4 / q) E(m)."""
        return float(4.0 / self.q * ellipe(self.parameter))

    def energy(self, stiffness: float) -> float:
        """Bending energy of one panel over one wave, N mm.

        The curvature across rulings is y'' tan th / sqrt(1 - s^2 tan^2 th), and int cos^2 / (1 - m sin^2)
        over a turn is 2 pi (1 - sqrt(1 - m)) / m, so U = pi B b q (1 - sqrt(1 - m)).

        Args:
            stiffness: B, N mm.
        """
        return math.pi * stiffness * self.pitch * self.q * (1.0 - math.sqrt(1.0 - self.parameter))

    def fold_angle(self, x: Array) -> Array:
        """Fold angles of a crease at x, rad: sin(g / 2) = sin th sqrt(1 + s^2).

        Args:
            x: (k,) in the flat sheet, mm.
        """
        slope = self.amplitude * self.q * np.cos(self.q * x)
        return np.asarray(2.0 * np.arcsin(math.sin(self.incline) * np.sqrt(1.0 + slope**2)))
