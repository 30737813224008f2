"""Linear elasticity, isotropic or with a grain: plane stress (St Venant-Kirchhoff), bending of Kirchhoff and Love."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.model import laminate
from bh.model.sheet import Sheet

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Constant:
    """A law of constant moduli C, symmetric: energy 1/2 e.C.e. What is constant is assembled from constants.

    C is (3, 3), or (k, 3, 3) with one for each of k places.
    """

    matrix: Array

    def energy(self, strain: Array) -> Array:
        """(k,) energies of strains (k, 3), a unit area."""
        each = "ki,ij,kj->k" if self.matrix.ndim == 2 else "ki,kij,kj->k"
        return np.asarray(0.5 * np.einsum(each, strain, self.matrix, strain))

    def stress(self, strain: Array) -> Array:
        """(k, 3) gradients of the energy."""
        if self.matrix.ndim == 2:
            return np.asarray(strain @ self.matrix)
        return np.asarray((self.matrix @ strain[:, :, None])[..., 0])

    def moduli(self, strain: Array) -> Array:
        """(k, 3, 3) Hessians of the energy, whatever the strain."""
        return np.broadcast_to(self.matrix, (len(strain), 3, 3))


@dataclass(frozen=True, eq=False)
class Anisotropic(Constant):
    """Constant moduli that depend on the direction, here (3, 3) in the axes of the drawing."""

    def turned(self, angle: Array) -> Constant:
        """The law of k places with axes of their own.

        Args:
            angle: (k,) from the drawing's x axis to that of the place, rad.

        Returns:
            moduli (k, 3, 3).
        """
        return Constant(turned(self.matrix, angle))


@dataclass(frozen=True)
class LinearElastic:
    """Isotropic, or orthotropic in the axes of the sheet's grain.

    Isotropic: 1/2 E t / (1 - nu^2) ((1 - nu) e:e + nu tr(e)^2), and with D = E t^3 / (12 (1 - nu^2)) for curvatures.
    With a grain 1/2 t e.Q.e and 1/2 t^3 / 12 k.Q.k of `orthotropic`; of a laminate A and D (`bh.model.laminate`).
    """

    def stretching(self, sheet: Sheet) -> Constant:
        """Plane stress, N / mm."""
        if sheet.plies is not None:
            return Anisotropic(laminate.matrices(sheet.plies)[0])
        if sheet.grain is not None:
            return Anisotropic(sheet.t * _in_drawing(sheet, sheet.grain))
        return Constant(sheet.E * sheet.t / (1.0 - sheet.nu**2) * isotropic(sheet.nu))

    def bending(self, sheet: Sheet) -> Constant:
        """Plate bending, N mm."""
        if sheet.plies is not None:
            return Anisotropic(laminate.matrices(sheet.plies)[2])
        if sheet.grain is not None:
            return Anisotropic(sheet.t**3 / 12.0 * _in_drawing(sheet, sheet.grain))
        return Constant(sheet.bending_stiffness() * isotropic(sheet.nu))


def isotropic(nu: float) -> Array:
    """(3, 3) isotropic moduli for components (xx, yy, 2 xy), over those of a strain in one direction."""
    return np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])


def orthotropic(E1: float, E2: float, G12: float, nu12: float) -> Array:
    """(3, 3) moduli Q of plane stress in the axes of the grain, components (11, 22, 2 12), MPa.

    Args:
        E1: Young's modulus along the grain, MPa.
        E2: Young's modulus across it, MPa.
        G12: shear modulus, MPa.
        nu12: Poisson's ratio of a pull along the grain.
    """
    scale = 1.0 - nu12**2 * E2 / E1  # 1 - nu12 nu21
    mixed = nu12 * E2 / scale
    return np.array([[E1 / scale, mixed, 0.0], [mixed, E2 / scale, 0.0], [0.0, 0.0, G12]])


def turned(matrix: Array, angle: Array) -> Array:
    """(k, 3, 3) moduli in axes that stand at angles (k,) rad to those in which they are `matrix` (3, 3).

    The energy of a strain stays: C' = T^T C T where T makes a strain (xx, yy, 2 xy) in the old axes of one in the new.

    Args:
        matrix: (3, 3) for components (xx, yy, 2 xy).
        angle: (k,) from the old x axis to the new ones, rad.
    """
    c, s = np.cos(angle), np.sin(angle)
    T = np.empty((len(c), 3, 3))
    T[:, 0] = np.column_stack((c * c, s * s, -c * s))
    T[:, 1] = np.column_stack((s * s, c * c, c * s))
    T[:, 2] = np.column_stack((2.0 * c * s, -2.0 * c * s, c * c - s * s))
    return np.asarray(np.swapaxes(T, 1, 2) @ matrix @ T)


def _in_drawing(sheet: Sheet, grain: float) -> Array:
    assert sheet.E2 is not None
    assert sheet.G12 is not None
    moduli = orthotropic(sheet.E, sheet.E2, sheet.G12, sheet.nu)
    return np.asarray(turned(moduli, np.array([-grain]))[0])
