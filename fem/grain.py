"""Elements of a sheet with a grain, from strains and moments along the grain a and across it, b (docs/fem.md).

    membrane: t / 2 [ (E1 e_aa^2 + 2 nu12 E2 e_aa e_bb + E2 e_bb^2) / (1 - nu12 nu21) + 4 G12 e_ab^2 ] an area,
    bending: 6 / t^3 [ m_aa^2 / E1 - 2 nu12 / E1 m_aa m_bb + m_bb^2 / E2 + m_ab^2 / G12 ], complementary.

An element's strains are covariant, so e_aa = e_ij a^i a^j with the contravariant components of a; its moments are
contravariant densities, m_aa = (m^ij a_i a_j) / J^2 with the covariant ones.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bh.model.sheet import Sheet

Array = NDArray[np.float64]


def axes(sheet: Sheet) -> Array:
    """(2, 2) unit vectors of the drawing along the grain and across it, one a row."""
    assert sheet.grain is not None
    c, s = math.cos(sheet.grain), math.sin(sheet.grain)
    return np.array([[c, s], [-s, c]])


def moduli(sheet: Sheet) -> Array:
    """(3, 3) of the strains (e_aa, e_bb, 2 e_ab), MPa."""
    return np.asarray(np.linalg.inv(compliance(sheet)))


def compliance(sheet: Sheet) -> Array:
    """(3, 3) strains (e_aa, e_bb, 2 e_ab) of a unit stress (aa, bb, ab), 1 / MPa."""
    assert sheet.E2 is not None
    assert sheet.G12 is not None
    mixed = -sheet.nu / sheet.E
    return np.array([[1.0 / sheet.E, mixed, 0.0], [mixed, 1.0 / sheet.E2, 0.0], [0.0, 0.0, 1.0 / sheet.G12]])


def compliance_in_drawing(sheet: Sheet) -> Array:
    """(3, 3) strains (xx, yy, 2 xy) of a unit stress (xx, yy, xy) in the axes of the drawing, 1 / MPa.

    Args:
        sheet: with a grain or without.
    """
    if sheet.grain is None:
        one, mixed, shear = 1.0 / sheet.E, -sheet.nu / sheet.E, 2.0 * (1.0 + sheet.nu) / sheet.E
        return np.array([[one, mixed, 0.0], [mixed, one, 0.0], [0.0, 0.0, shear]])
    c, s = axes(sheet)[0]
    # stress (xx, yy, xy) to (aa, bb, ab); strains go back by its transpose
    T = np.array([[c * c, s * s, 2.0 * c * s], [s * s, c * c, -2.0 * c * s], [-c * s, c * s, c * c - s * s]])
    return np.asarray(T.T @ compliance(sheet) @ T)


def membrane_stiffness(tensors: Array, weights: Array, F: Array, J: Array, sheet: Sheet) -> Array:
    """Stiffness against generalised strains.

    Args:
        tensors: (q, k, 2, 2) functions of the strain, covariant.
        weights: (q,) of the points.
        F: (t, q, 2, 2) derivatives of the flat position by the element's coordinates, mm.
        J: (t, q) their determinants, mm^2.
        sheet: with a grain.

    Returns:
        (t, k, k) integrals of the products of strains, N mm.
    """
    raised = np.einsum("tqij,aj->tqai", np.linalg.inv(F), axes(sheet))  # contravariant
    return _integral(_components(tensors, raised, 2.0), moduli(sheet), sheet.t * weights * J)


def bending_stiffness(tensors: Array, weights: Array, F: Array, J: Array, sheet: Sheet) -> Array:
    """Stiffness against generalised curvatures, the inverse of a compliance.

    Args:
        tensors: (q, k, 2, 2) functions of the moment, contravariant.
        weights: (q,) of the points.
        F: (t, q, 2, 2) derivatives of the flat position by the element's coordinates, mm.
        J: (t, q) their determinants, mm^2.
        sheet: with a grain.

    Returns:
        (t, k, k).
    """
    lowered = np.einsum("tqji,aj->tqai", F, axes(sheet))  # covariant
    flexibility = _integral(
        _components(tensors, lowered, 1.0), compliance(sheet), 12.0 / sheet.t**3 * weights / J**3
    )
    out = np.linalg.inv(flexibility)
    return np.asarray(0.5 * (out + out.transpose(0, 2, 1)))


def forces(strain: Array, sheet: Sheet) -> Array:
    """Membrane forces (t, 2, 2), N / mm, of strains (t, 2, 2) in the axes of the drawing.

    Args:
        strain: (t, 2, 2), symmetric.
        sheet: with a grain.
    """
    a = axes(sheet)
    e = np.einsum("ai,tij,bj->tab", a, strain, a)
    n = sheet.t * np.column_stack((e[:, 0, 0], e[:, 1, 1], 2.0 * e[:, 0, 1])) @ moduli(sheet)
    along = np.stack((n[:, [0, 2]], n[:, [2, 1]]), axis=1)
    return np.asarray(np.einsum("ai,tab,bj->tij", a, along, a))


def _components(tensors: Array, vectors: Array, twice: float) -> Array:
    """(t, q, k, 3) components aa, bb and `twice` ab along vectors (t, q, 2, 2), of tensors (q, k, 2, 2)."""
    both = np.einsum("tqai,qkij,tqbj->tqkab", vectors, tensors, vectors, optimize=True)
    return np.stack((both[..., 0, 0], both[..., 1, 1], twice * both[..., 0, 1]), axis=-1)


def _integral(components: Array, matrix: Array, weights: Array) -> Array:
    out = np.einsum("tq,tqki,ij,tqlj->tkl", weights, components, matrix, components, optimize=True)
    return np.asarray(0.5 * (out + out.transpose(0, 2, 1)))
