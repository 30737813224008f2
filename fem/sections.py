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
    Q = [np.linalg.inv(grain.compliance_in_drawing(sheet)) for sheet in sheets]
    A = np.array([sheet.t * q for sheet, q in zip(sheets, Q, strict=True)])
    D = np.array([sheet.t**3 / 12.0 * q for sheet, q in zip(sheets, Q, strict=True)])
    return Matrices(A, None, D)


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
