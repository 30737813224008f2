"""Elements of a sheet whose matrices differ from triangle to triangle: zones, laminates (docs/fem.md).

Strains and moments of the flat sheet are components in the axes of the drawing, (xx, yy, 2 xy) and (xx, yy, xy), and

    1/2 e.A.e - e.B.k + 1/2 k.D.k an area

with A, B, D of every triangle. With m = D k - B e the mixed form of an element has k = D^-1 (m + B e); what is left
of the strain is A - B D^-1 B.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.model.sheet import Sheet
from bh.model.zones import Sections
from fem import grain

Array = NDArray[np.float64]


class Matrices(NamedTuple):
    """Of the sheets, (s, 3, 3): A in N / mm, B in N, D in N mm; B is None where no sheet couples."""

    A: Array
    B: Array | None
    D: Array


def matrices(sheets: tuple[Sheet, ...]) -> Matrices:
    """Matrices of sheets in the axes of the drawing.

    Args:
        sheets: of any kind.
    """
    out = np.zeros((3, len(sheets), 3, 3))
    for number, sheet in enumerate(sheets):
        plies = (sheet,) if sheet.plies is None else sheet.plies
        top = 0.5 * sheet.t
        for ply in reversed(plies):  # Simpson's rule is exact for z^2
            Q = np.linalg.inv(grain.compliance_in_drawing(ply))
            z = np.array([top - ply.t, top - 0.5 * ply.t, top])
            weight = ply.t / 6.0 * np.array([1.0, 4.0, 1.0])
            out[:, number] += np.einsum("p,pk,ij->kij", weight, z[:, None] ** np.arange(3), Q)
            top -= ply.t
    A, B, D = out
    couples = any(sheet.plies is not None for sheet in sheets)
    couples = couples and bool(np.abs(B).max() > 1e-12 * np.sqrt(np.abs(A).max() * np.abs(D).max()))
    return Matrices(A, B if couples else None, D)


def needed(sections: Sections) -> bool:
    """Do matrices differ, or are they those of a laminate?"""
    return sections.of is not None or sections.sheets[0].plies is not None


def strains(found: Matrices, sections: Sections, forces: Array, moments: Array) -> tuple[Array, Array]:
    """Strains and curvatures (t, 3) that membrane forces and moments (t, 3) belong to.

    Args:
        found: of the sheets.
        sections: which of them a triangle is of.
        forces: (t, 3) N / mm.
        moments: (t, 3) N.

    Returns:
        both.
    """
    B = np.zeros_like(found.A) if found.B is None else found.B
    whole = np.block([[found.A, -B], [-B, found.D]])
    inverse = _each(np.asarray(np.linalg.inv(whole), dtype=float), sections)
    both = np.einsum(
        "tij,tj->ti", np.broadcast_to(inverse, (len(forces), 6, 6)), np.hstack((forces, moments))
    )
    return both[:, :3], both[:, 3:]


def membrane_forces(found: Matrices, sections: Sections, strain: Array, moments: Array) -> Array:
    """(t, 3) membrane forces, N / mm, of strains (t, 3) where the moments are (t, 3): (A - B D^-1 B) e - B D^-1 m.

    Args:
        found: of the sheets.
        sections: which of them a triangle is of.
        strain: (t, 3).
        moments: (t, 3) N.
    """
    left, mixed = found.A, np.zeros_like(found.A)
    if found.B is not None:
        mixed = found.B @ np.linalg.inv(found.D)
        left = found.A - mixed @ found.B
    shape = (len(strain), 3, 3)
    S, P = (np.broadcast_to(_each(each, sections), shape) for each in (left, mixed))
    return np.asarray(np.einsum("tij,tj->ti", S, strain) - np.einsum("tij,tj->ti", P, moments))


def in_drawing(F: Array, tensors: Array, covariant: bool) -> Array:
    """(t, q, k, 3) components in the axes of the drawing of tensors (q, k, 2, 2) of the elements.

    Args:
        F: (t, q, 2, 2) derivatives of the flat position by the element's coordinates, mm.
        tensors: covariant ones (strains) as (xx, yy, 2 xy), contravariant ones (moments) as (xx, yy, xy).
        covariant: which of them they are.
    """
    vectors = np.swapaxes(np.linalg.inv(F), 2, 3) if covariant else F
    both = np.einsum("tqai,qkij,tqbj->tqkab", vectors, tensors, vectors, optimize=True)
    return np.stack(
        (both[..., 0, 0], both[..., 1, 1], (2.0 if covariant else 1.0) * both[..., 0, 1]), axis=-1
    )


def stiffness(
    strains: Array, moments: Array, weights: Array, F: Array, J: Array, found: Matrices, sections: Sections
) -> tuple[Array, Array, Array | None]:
    """Stiffness against generalised strains, curvatures, and of both together.

    Args:
        strains: (q, k, 2, 2) functions of the strain, covariant.
        moments: (q, k, 2, 2) functions of the moment, contravariant densities.
        weights: (q,) of the points.
        F: (t, q, 2, 2) derivatives of the flat position by the element's coordinates, mm.
        J: (t, q) their determinants, mm^2.
        found: of the sheets.
        sections: which of them a triangle is of.

    Returns:
        (t, k, k) each; None where nothing couples. Energy 1/2 e.S.e + e.C.k + 1/2 k.T.k of the third as C.
    """
    e = in_drawing(F, strains, covariant=True)
    m = in_drawing(F, moments, covariant=False) / (J**2)[..., None, None]
    area = weights * J
    flexible = np.asarray(np.linalg.inv(_each(found.D, sections)), dtype=float)
    T = np.asarray(np.linalg.inv(_integral(m, flexible, m, area)), dtype=float)
    if found.B is None:
        return _symmetric(_integral(e, _each(found.A, sections), e, area)), _symmetric(T), None
    B = _each(found.B, sections)
    left = _each(found.A, sections) - np.swapaxes(B, 1, 2) @ flexible @ B
    P = _integral(m, flexible @ B, e, area)
    S = _integral(e, left, e, area) + np.swapaxes(P, 1, 2) @ T @ P
    return _symmetric(S), _symmetric(T), -np.swapaxes(P, 1, 2) @ T


def _each(values: Array, sections: Sections) -> Array:
    return values[:1] if sections.of is None else np.asarray(values[sections.of])


def _integral(one: Array, matrix: Array, other: Array, area: Array) -> Array:
    matrix = np.broadcast_to(matrix, (len(one), 3, 3))
    return np.asarray(np.einsum("tq,tqki,tij,tqlj->tkl", area, one, matrix, other, optimize=True))


def _symmetric(values: Array) -> Array:
    return 0.5 * (values + values.transpose(0, 2, 1))
