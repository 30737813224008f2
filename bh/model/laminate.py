"""Classical lamination theory: stiffness of a stack of plies, and what it does when its plies expand.

With the strain e - z k at the height z above the middle surface (k positive where the edges go up) and Q of each ply,

    1/2 e.A.e - e.B.k + 1/2 k.D.k an area,   A = int Q dz,  B = int z Q dz,  D = int z^2 Q dz

(Jones 1999, Eqs. 4.22-4.24, whose curvature has the other sign).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.sheet import Sheet

Array = NDArray[np.float64]
NO_COUPLING = 1e-12  # of sqrt(A D): rounding


def plane_stress(sheet: Sheet) -> Array:
    """(3, 3) moduli Q of a ply in the axes of the drawing, components (xx, yy, 2 xy), MPa.

    Args:
        sheet: of one material.
    """
    E2 = sheet.E if sheet.E2 is None else sheet.E2
    G = 0.5 * sheet.E / (1.0 + sheet.nu) if sheet.G12 is None else sheet.G12
    scale = 1.0 - sheet.nu**2 * E2 / sheet.E
    mixed = sheet.nu * E2 / scale
    Q = np.array([[sheet.E / scale, mixed, 0.0], [mixed, E2 / scale, 0.0], [0.0, 0.0, G]])
    c, s = math.cos(sheet.grain or 0.0), math.sin(sheet.grain or 0.0)
    # strains (xx, yy, 2 xy) of the drawing in the axes of the grain
    T = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2.0 * c * s, 2.0 * c * s, c * c - s * s]])
    return np.asarray(T.T @ Q @ T)


def heights(plies: Sequence[Sheet]) -> Array:
    """(p + 1,) heights of the faces of plies above the middle surface, mm, from the bottom."""
    z = np.concatenate(([0.0], np.cumsum([ply.t for ply in plies])))
    return np.asarray(z - 0.5 * z[-1])


def matrices(plies: Sequence[Sheet]) -> tuple[Array, Array | None, Array]:
    """A (N / mm), B (N; None for a stack that does not couple) and D (N mm) in the axes of the drawing.

    Args:
        plies: from the bottom.
    """
    z = heights(plies)
    A, B, D = np.zeros((3, 3, 3))
    for ply, low, high in zip(plies, z[:-1], z[1:], strict=True):
        Q = plane_stress(ply)
        A += (high - low) * Q
        B += (high**2 - low**2) / 2.0 * Q
        D += (high**3 - low**3) / 3.0 * Q
    scale = math.sqrt(float(np.abs(A).max()) * float(np.abs(D).max()))
    return A, (None if np.abs(B).max() <= NO_COUPLING * scale else B), D


def free_shape(plies: Sequence[Sheet], strains: Sequence[Array]) -> tuple[Array, Array]:
    """Strain (3,) and curvature (3,), 1 / mm, of a free stack whose plies want strains (3,) each.

    Args:
        plies: from the bottom.
        strains: of each, components xx, yy, 2 xy in the drawing.

    Returns:
        strain of the middle surface, and curvature, positive where the edges go up.
    """
    A, B, D = matrices(plies)
    B = np.zeros((3, 3)) if B is None else B
    z = heights(plies)
    N, M = np.zeros((2, 3))
    for ply, strain, low, high in zip(plies, strains, z[:-1], z[1:], strict=True):
        stress = plane_stress(ply) @ strain
        N += (high - low) * stress
        M -= (high**2 - low**2) / 2.0 * stress
    both = np.linalg.solve(np.block([[A, -B], [-B, D]]), np.concatenate((N, M)))
    return both[:3], both[3:]


def equivalent(plies: Sequence[Sheet]) -> tuple[float, float, float]:
    """E (MPa), nu and t (mm) of a sheet that bends, on average over both directions, as a stack does when it is free.

    E t^3 / (12 (1 - nu^2)) is sqrt(D11 D22) of D - B A^-1 B, nu is D12 over that: what L* of creases refers to.

    Args:
        plies: from the bottom.

    Returns:
        E, nu, t.
    """
    A, B, D = matrices(plies)
    if B is not None:
        D = D - B @ np.linalg.solve(A, B)
    t = float(sum(ply.t for ply in plies))
    mean = math.sqrt(D[0, 0] * D[1, 1])
    nu = min(max(float(D[0, 1]) / mean, -0.99), 0.5)
    return 12.0 * mean * (1.0 - nu**2) / t**3, nu, t


def laminate(plies: Sequence[Sheet]) -> Sheet:
    """A sheet of plies: `bh.laminate([bh.Sheet(E=70000, nu=0.3, t=0.1), bh.Sheet(E=200000, nu=0.3, t=0.1)])`.

    Args:
        plies: from the bottom to the top (the side that faces +z in the drawing), each with its own thickness.

    Returns:
        a sheet whose E, nu and t are those of an equivalent one; it has a density if all plies have one.

    Raises:
        ModelError: no plies, or something that is none.
    """
    if not plies or not all(isinstance(ply, Sheet) and ply.plies is None for ply in plies):
        raise ModelError(
            "a laminate is made of sheets, one or more, and of no laminates; give bh.Sheet for each ply"
        )
    E, nu, t = equivalent(plies)
    known = [ply.density * ply.t for ply in plies if ply.density is not None]
    density = sum(known) / t if len(known) == len(plies) else None
    return Sheet(E=E, nu=nu, t=t, density=density, plies=plies)


def free_strain(sheet: Sheet, change: float) -> tuple[Array, Array]:
    """Strain (xx, yy, 2 xy) and curvature (3,) of a free sheet whose temperature or moisture changes.

    Args:
        sheet: with an expansion of its own, or of its plies.
        change: in the unit of that.

    Returns:
        strain, and curvature in 1 / mm, in the axes of the drawing.

    Raises:
        ModelError: it has no expansion.
    """
    plies = (sheet,) if sheet.plies is None else sheet.plies
    wanted = [
        change * in_drawing(np.array([[*coefficients(ply), 0.0]]), ply.grain or 0.0)[0] for ply in plies
    ]
    return (wanted[0], np.zeros(3)) if sheet.plies is None else free_shape(plies, wanted)


def coefficients(sheet: Sheet) -> tuple[float, float]:
    """Expansion along and across the grain, a unit of change.

    Args:
        sheet: of which it is.

    Returns:
        both.

    Raises:
        ModelError: it has none.
    """
    if sheet.expansion is None:
        raise ModelError(
            "expand change: the sheet has no expansion; give expansion (strain a kelvin or a percent) with it, or by"
        )
    return sheet.expansion if isinstance(sheet.expansion, tuple) else (sheet.expansion, sheet.expansion)


def in_drawing(rows: Array, angle: float) -> Array:
    """(k, 3) components xx, yy, 2 xy in the drawing of strains (11, 22, 2 12) in axes at an angle to it.

    Args:
        rows: (k, 3).
        angle: from the drawing's x axis to the first of theirs, rad.
    """
    c, s = math.cos(angle), math.sin(angle)
    one, two, shear = rows.T
    return np.column_stack(
        (
            c * c * one + s * s * two - c * s * shear,
            s * s * one + c * c * two + c * s * shear,
            2.0 * c * s * (one - two) + (c * c - s * s) * shear,
        )
    )
