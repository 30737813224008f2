"""A shallow sinusoidal arch with hinged ends that cannot part, under a sinusoidal dead load (Fung and Kaplan 1952).

Stress-free shape h sin(pi x / L); the load a length q sin(pi x / L) points down and the deflected shape is
b sin(pi x / L) + c sin(2 pi x / L) exactly, in the theory of shallow arches (strain averaged along the arch). With
EI and EA of the section the energies of these two modes give

    symmetric (c = 0):  q = EI (pi / L)^4 (h - b) + EA pi^4 / (4 L^4) (h^2 - b^2) b
    antisymmetric:      h^2 - b^2 - 4 c^2 = 16 EI / EA,    q = EI (pi / L)^4 (h + 3 b)

N, mm, MPa. Timoshenko and Gere (1961), Theory of Elastic Stability, section 7.9, treats the same arch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SineArch:
    """Span `L`, rise `h`, bending stiffness `EI` (N mm^2), axial stiffness `EA` (N)."""

    L: float
    h: float
    EI: float
    EA: float

    def load(self, b: Array | float) -> Array:
        """(k,) load a length q, N/mm, of the symmetric equilibria with amplitude `b` (mm)."""
        b = np.asarray(b, dtype=float)
        bend = self.EI * (self.h - b)
        thrust = 0.25 * self.EA * (self.h**2 - b**2) * b
        found: Array = (math.pi / self.L) ** 4 * (bend + thrust)
        return found

    def limits(self) -> tuple[float, float]:
        """Amplitudes b of the two limit points, the one of snap-through first, mm; nan if the arch is too flat."""
        squared = (self.h**2 - 4.0 * self.EI / self.EA) / 3.0
        b = math.sqrt(squared) if squared > 0.0 else math.nan
        return b, -b

    def bifurcation(self) -> float:
        """Amplitude b at which the arch begins to sway, mm; nan if it does not."""
        squared = self.h**2 - 16.0 * self.EI / self.EA
        return math.sqrt(squared) if squared > 0.0 else math.nan
