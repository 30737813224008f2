"""Element stiffness of the source's bar-and-hinge model (Eq. 3.2-3.4, 3.11, 3.12). MPa, mm, N, rad."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def bar_stiffness(E: float, t: float, lengths: Array, areas: Array) -> Array:
    """(b,) axial stiffness k_s = E A_T t / L^2, N/mm (Eq. 3.3); `areas` (b,) mm^2 of the triangles a bar stands for.

    A bar between two triangles takes the area of both.

    Args:
        E: Young's modulus, N/mm^2.
        t: thickness, mm.
        lengths: (b,) mm.
        areas: (b,) of the triangles that each bar stands for, mm^2.
    """
    return E * areas * t / lengths**2


def diagonal_factor(alpha: ArrayLike) -> Array:
    """Factor alpha^2 / 2 + 5/4 by which diagonal bars are stiffened in shear (Eq. 3.4); alpha = H / W of its cell.

    Returns:
        of the shape of `alpha`, no unit.
    """
    return 0.5 * np.asarray(alpha, dtype=float) ** 2 + 1.25


def shear_exact_factor(alpha: ArrayLike) -> Array:
    """(alpha + 1 / alpha)^2 / 2: the factor with which a rectangle's diagonal has just the shear stiffness G = E / 2.

    Shear by gamma stretches the diagonal of a W x H cell by gamma W H / L; equating 1/2 k (gamma W H / L)^2 to
    1/2 G gamma^2 t W H gives k = E t L^2 / (2 W H), which is Eq. 3.3 times this factor.

    Returns:
        of the shape of `alpha`, no unit.
    """
    alpha = np.asarray(alpha, dtype=float)
    return 0.5 * (alpha + 1.0 / alpha) ** 2


def sheet_bars(E: float, t: float, lengths: Array, areas: Array, spans: Array | None) -> Array:
    """(b,) stiffness of all bars of a sheet by Eq. 3.4, N/mm.

    `spans` (b, 2) are the extents of every edge along and across the crease, or None for a mesh without such
    directions: then no bar is a diagonal and Eq. 3.3 holds for all. Eq. 3.4 calibrates the diagonal of a rectangle
    W x H; a diagonal is therefore stiffened with the aspect ratio of the rectangle that it spans, and stands for the
    area of that rectangle. With right triangles these are the aspect ratio and the area of the cell, as in the
    source; a slanted edge of an isosceles mesh spans half a cell.

    Args:
        E: Young's modulus, N/mm^2.
        t: thickness, mm.
        lengths: (b,) mm.
        areas: (b,) of the triangles on both sides, mm^2.
        spans: (b, 2) extents along and across the crease, mm, or None.
    """
    k = bar_stiffness(E, t, lengths, areas)
    if spans is None:
        return k
    along, across = spans[:, 0], spans[:, 1]
    diagonal = (along > 1e-6 * lengths) & (across > 1e-6 * lengths)
    W, H = along[diagonal], across[diagonal]
    share = np.minimum(areas[diagonal], W * H)
    k[diagonal] = diagonal_factor(H / W) * bar_stiffness(E, t, lengths[diagonal], share)
    return k


def bending_hinge_stiffness(E: float, t: float, lengths: Array, areas: Array) -> Array:
    """(m,) k_b = E t^3 / 6 * L^2 / (A_1 + A_2), N mm / rad (Eq. 3.11); `areas` (m,) is A_1 + A_2, mm^2.

    Args:
        E: Young's modulus, N/mm^2.
        t: thickness, mm.
        lengths: (m,) of the hinges, mm.
        areas: (m,) of both triangles, mm^2.
    """
    return E * t**3 / 6.0 * lengths**2 / areas


def folding_hinge_stiffness(per_length: Array, lengths: Array) -> Array:
    """(m,) k_f = stiffness a length times L_f, N mm / rad (Eq. 3.12).

    Args:
        per_length: (m,) N mm / (mm rad).
        lengths: (m,) of the hinges, mm.
    """
    return per_length * lengths
