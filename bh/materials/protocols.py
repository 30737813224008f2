"""What the sheet is made of, as a formulation asks for it: a law of stretching and a law of bending.

A formulation measures strains and curvatures; a law says what they cost. The two are independent: any law goes with any
measure. Strains and curvatures are rows of three components (xx, yy, 2 xy), the last one doubled, so that their product
with the stress (xx, yy, xy) is the work.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bh.model.sheet import Sheet

Array = NDArray[np.float64]


class Law(Protocol):
    """Elastic energy of an area of the sheet as a function of three strains, or of three curvatures.

    Of stretching: Green's strain of the middle surface (no unit); energy in N mm / mm^2, stress (second
    Piola-Kirchhoff, through the thickness) and moduli in N / mm. Of bending: the change of curvature, 1 / mm; stress
    is the moment a length, N mm / mm, and moduli are in N mm.
    """

    def energy(self, strain: Array) -> Array:
        """(k,) energies a stress-free area of strains (k, 3)."""
        ...

    def stress(self, strain: Array) -> Array:
        """(k, 3) their gradients."""
        ...

    def moduli(self, strain: Array) -> Array:
        """(k, 3, 3) their Hessians."""
        ...


class Material(Protocol):
    """Makes the two laws of a sheet from its data (E, nu, t)."""

    def stretching(self, sheet: Sheet) -> Law:
        """The law of Green's strain of the middle surface."""
        ...

    def bending(self, sheet: Sheet) -> Law:
        """The law of the change of curvature."""
        ...
