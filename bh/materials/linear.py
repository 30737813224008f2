"""Linear elasticity: plane stress of the St Venant-Kirchhoff kind, and the bending of Kirchhoff and Love."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.model.sheet import Sheet

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Constant:
    """A law of constant moduli C (3, 3), symmetric: energy 1/2 e.C.e. What is constant is assembled from constants."""

    matrix: Array

    def energy(self, strain: Array) -> Array:
        """(k,) energies of strains (k, 3), a unit area."""
        return np.asarray(0.5 * np.einsum("ki,ij,kj->k", strain, self.matrix, strain))

    def stress(self, strain: Array) -> Array:
        """(k, 3) gradients of the energy."""
        return np.asarray(strain @ self.matrix)

    def moduli(self, strain: Array) -> Array:
        """(k, 3, 3) Hessians of the energy: the same for all."""
        return np.broadcast_to(self.matrix, (len(strain), 3, 3))


@dataclass(frozen=True)
class LinearElastic:
    """Isotropic.

    1/2 E t / (1 - nu^2) ((1 - nu) e:e + nu tr(e)^2), and with D = E t^3 / (12 (1 - nu^2)) for curvatures.
    """

    def stretching(self, sheet: Sheet) -> Constant:
        """Plane stress, N / mm."""
        return Constant(sheet.E * sheet.t / (1.0 - sheet.nu**2) * isotropic(sheet.nu))

    def bending(self, sheet: Sheet) -> Constant:
        """Plate bending, N mm."""
        return Constant(sheet.bending_stiffness() * isotropic(sheet.nu))


def isotropic(nu: float) -> Array:
    """(3, 3) isotropic moduli for components (xx, yy, 2 xy), over those of a strain in one direction."""
    return np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])
