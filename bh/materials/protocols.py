"""What the sheet is made of, as a formulation asks for it: a law of stretching and a law of bending.

A formulation measures strains and curvatures; a law says what they cost. The two are independent: any law goes with any
measure. Strains and curvatures are rows of three components (xx, yy, 2 xy), the last one doubled, so that their product
with the stress (xx, yy, xy) is the work.
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

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


@runtime_checkable
class Directed(Law, Protocol):
    """A law that depends on the direction, in the axes of the drawing: strains are those of each place's own axes."""

    def turned(self, angle: Array) -> Law:
        """The law of k places whose x axes stand at angles (k,) to the drawing's, rad; rows of strains are these k."""
        ...


def in_axes(law: Law, angle: Array) -> Law:
    """The law as it reads in the axes of k places.

    Args:
        law: in the axes of the drawing, or one of no direction, which stays what it is.
        angle: (k,) of the places' x axes to the drawing's, rad.
    """
    if not hasattr(
        law, "turned"
    ):  # asked at every step: `isinstance` with a protocol takes longer than the rest
        return law
    assert isinstance(law, Directed)
    return law.turned(angle)


class Material(Protocol):
    """Makes the two laws of a sheet from its data (E, nu, t and those of a grain). Of a grain they are `Directed`."""

    def stretching(self, sheet: Sheet) -> Law:
        """The law of Green's strain of the middle surface."""
        ...

    def bending(self, sheet: Sheet) -> Law:
        """The law of the change of curvature."""
        ...
