"""What isometry asks of a folded crease: Eq. 5.3-5.6 and A.12, both ways. Angles in rad, curvatures in 1/mm.

Signs. Seen from above (mountain creases push up, dihedral angle phi measured below the sheet), n points to the left
of the tangent t and b = t x n up; a curvature is positive where the crease turns to the left. Generator angles
gamma go from t to the generator, in (0, pi) on either side. With the fold rate phi' = d phi / du and the speed s =
|c'|, the normals

    N_L = cos(phi / 2) n + sin(phi / 2) b,        N_R = -cos(phi / 2) n + sin(phi / 2) b                 (A.10)

do not turn about the generators (dN . g = 0) if

    cot gamma_L = -(tau + phi' / (2 s)) / (kappa cos(phi / 2)),
    cot gamma_R = -(tau - phi' / (2 s)) / (kappa cos(phi / 2)).

Eq. A.12 of the source has tau with the opposite sign in both, and so do 5.4 and 5.6, which follow from it; 5.3 and
5.5 are the same. With the source's own frames (A.5, A.7, A.10) its signs do not give a developable surface;
docs/isometric.md shows it. They hold if phi is measured on the side of b. Everything here uses the signs above.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
VANISHING = 1e-9  # of the largest: smaller ones count as zero


def folded_curvature(flat: ArrayLike, dihedral: ArrayLike) -> Array:
    """Curvature of the folded crease, kappa = kappa_0 / sin(phi / 2) (Eq. 5.3), 1/mm.

    Args:
        flat: kappa_0, 1/mm.
        dihedral: phi, rad.

    Returns:
        broadcast from the arguments.
    """
    return np.asarray(flat, dtype=float) / np.sin(0.5 * np.asarray(dihedral, dtype=float))


def flat_curvature(folded: ArrayLike, dihedral: ArrayLike) -> Array:
    """Geodesic curvature kappa_0 = kappa sin(phi / 2) of the crease, which folding keeps (Eq. 5.3), 1/mm.

    Args:
        folded: kappa, 1/mm.
        dihedral: phi, rad.

    Returns:
        broadcast from the arguments.
    """
    return np.asarray(folded, dtype=float) * np.sin(0.5 * np.asarray(dihedral, dtype=float))


def dihedral_of(flat: ArrayLike, folded: ArrayLike, valley: bool = False) -> Array:
    """Dihedral angle phi from the curvatures before and after (Eq. 5.3), rad.

    Args:
        flat: kappa_0, 1/mm.
        folded: kappa, 1/mm.
        valley: phi in [pi, 2 pi) in place of (0, pi].

    Returns:
        broadcast from the arguments.
    """
    half = np.arcsin(np.asarray(flat, dtype=float) / np.asarray(folded, dtype=float))
    return np.asarray(2.0 * (np.pi - half) if valley else 2.0 * half)


def torsion_of(flat: ArrayLike, dihedral: ArrayLike, left: ArrayLike, right: ArrayLike) -> Array:
    """Torsion tau = -1/2 kappa_0 cot(phi / 2) (cot gamma_L + cot gamma_R) (Eq. 5.4 with the signs above), 1/mm.

    Args:
        flat: kappa_0, 1/mm.
        dihedral: phi, rad.
        left: gamma_L, rad.
        right: gamma_R, rad.

    Returns:
        broadcast from the arguments.
    """
    return -0.5 * _bending(flat, dihedral) * (_cot(left) + _cot(right))


def fold_rate_of(
    flat: ArrayLike, dihedral: ArrayLike, left: ArrayLike, right: ArrayLike, speed: ArrayLike = 1.0
) -> Array:
    """Fold rate phi' = -s kappa_0 cot(phi / 2) (cot gamma_L - cot gamma_R) (Eq. 5.5, signs above), rad a unit of u.

    Args:
        flat: kappa_0, 1/mm.
        dihedral: phi, rad.
        left: gamma_L, rad.
        right: gamma_R, rad.
        speed: s, mm a unit of u.

    Returns:
        broadcast from the arguments.
    """
    return -np.asarray(speed, dtype=float) * _bending(flat, dihedral) * (_cot(left) - _cot(right))


def torsion_from_fold_rate(
    fold_rate: ArrayLike, left: ArrayLike, right: ArrayLike, speed: ArrayLike = 1.0
) -> Array:
    """Torsion tau = phi' (cot gamma_L + cot gamma_R) / (2 s (cot gamma_L - cot gamma_R)) (Eq. 5.6, signs above), 1/mm.

    Where the generator angles are equal the fold rate is zero and says nothing of the torsion: nan.

    Args:
        fold_rate: phi', rad a unit of u.
        left: gamma_L, rad.
        right: gamma_R, rad.
        speed: s, mm a unit of u.

    Returns:
        broadcast from the arguments.
    """
    total, difference = _cot(left) + _cot(right), _cot(left) - _cot(right)
    none = np.abs(difference) <= VANISHING * (1.0 + np.abs(total))
    ratio = np.divide(total, np.where(none, 1.0, 2.0 * np.asarray(speed, dtype=float) * difference))
    return np.where(none, np.nan, np.asarray(fold_rate, dtype=float) * ratio)


def generator_angles(
    curvature: ArrayLike,
    torsion: ArrayLike,
    dihedral: ArrayLike,
    fold_rate: ArrayLike,
    speed: ArrayLike = 1.0,
    smallest: float = 0.0,
) -> tuple[Array, Array]:
    """(gamma_L, gamma_R) of a folded crease (Eq. A.12, signs above), (k,) each, rad in [0, pi].

    Where a side neither bends along the crease nor twists (straight parts, inflections, unfolded parts) 0 / 0 has
    no value of its own: the angle is interpolated between the nearest ones that have one, and is pi / 2 where none
    has. Where a side twists without bending along the crease its generators run along the crease: 0 or pi.

    Args:
        curvature: (k,) signed, 1/mm.
        torsion: (k,), 1/mm.
        dihedral: (k,), rad.
        fold_rate: (k,), rad a unit of u.
        speed: |c'|, mm a unit of u.
        smallest: curvatures and torsions up to this one count as zero, 1/mm.
    """
    bend, twist, half_rate = np.broadcast_arrays(
        np.asarray(curvature, dtype=float) * np.cos(0.5 * np.asarray(dihedral, dtype=float)),
        np.asarray(torsion, dtype=float),
        0.5 * np.asarray(fold_rate, dtype=float) / np.asarray(speed, dtype=float),
    )
    largest = max(float(np.abs(part).max(initial=0.0)) for part in (curvature, bend, twist, half_rate))
    none = max(VANISHING * largest, smallest, 1e-300)
    return _angle(bend, twist + half_rate, none), _angle(bend, twist - half_rate, none)


def _angle(bend: Array, twist: Array, none: float) -> Array:
    """arccot(-twist / bend) with 0 / 0 interpolated."""
    sign = np.where(bend < 0.0, -1.0, 1.0)
    angle = np.arctan2(np.abs(bend), -sign * twist)
    known = np.hypot(bend, twist) > none
    if not known.any():
        return np.full_like(angle, 0.5 * np.pi)
    places = np.arange(len(angle))
    angle[~known] = np.interp(places[~known], places[known], angle[known])
    return np.asarray(angle)


def _bending(flat: ArrayLike, dihedral: ArrayLike) -> Array:
    """kappa_0 cot(phi / 2) = kappa cos(phi / 2), 1/mm: the normal curvature of either side along the crease."""
    half = 0.5 * np.asarray(dihedral, dtype=float)
    return np.asarray(flat, dtype=float) * np.cos(half) / np.sin(half)


def _cot(angle: ArrayLike) -> Array:
    """cot, exactly zero at pi / 2."""
    return np.tan(0.5 * np.pi - np.asarray(angle, dtype=float))
