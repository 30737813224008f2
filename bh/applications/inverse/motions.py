"""Rigid motions as vectors (..., 6): translation and rotation of a screw that takes one parameter from 0 to 1.

A motion (t, r) maps a frame to another one as in `transforms`; its vector is its logarithm, first the three of the
translation (mm), then the rotation vector (rad). Two reflections give motions from others: along the strip (a piece
walked from its other end) and across it (a crease curved to the other side).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
ALONG = np.array([1.0, -1.0, -1.0, -1.0, 1.0, 1.0])  # of the vector of a motion walked from its other end
ACROSS = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])  # of the vector where the curvature changes its sign
SMALL = 1e-4  # rad, below which series stand for quotients


def exponential(vector: ArrayLike) -> tuple[Array, Array]:
    """(..., 3) translations, mm, and (..., 3, 3) rotations of vectors (..., 6) (Rodrigues)."""
    v = np.asarray(vector, dtype=float)
    move, turn = v[..., :3], v[..., 3:]
    angle = np.linalg.norm(turn, axis=-1)
    a, b, c = _factors(angle)
    cross = skew(turn)
    square = cross @ cross
    r = np.eye(3) + a[..., None, None] * cross + b[..., None, None] * square
    left = np.eye(3) + b[..., None, None] * cross + c[..., None, None] * square
    return (left @ move[..., None])[..., 0], r


def logarithm(t: ArrayLike, r: ArrayLike) -> Array:
    """(..., 6) vectors of motions that turn by less than pi.

    Args:
        t: (..., 3) translations, mm.
        r: (..., 3, 3) rotations.
    """
    t, r = np.asarray(t, dtype=float), np.asarray(r, dtype=float)
    turn = Rotation.from_matrix(r.reshape(-1, 3, 3)).as_rotvec().reshape(t.shape)
    _, b, c = _factors(np.linalg.norm(turn, axis=-1))
    cross = skew(turn)
    left = np.eye(3) + b[..., None, None] * cross + c[..., None, None] * (cross @ cross)
    return np.concatenate((np.linalg.solve(left, t[..., None])[..., 0], turn), axis=-1)


def _factors(angle: Array) -> tuple[Array, Array, Array]:
    """sin(a) / a, (1 - cos(a)) / a^2 and (a - sin(a)) / a^3."""
    small = angle < SMALL
    safe = np.where(small, 1.0, angle)
    square = angle * angle
    first = np.where(small, 1.0 - square / 6.0, np.sin(safe) / safe)
    second = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    third = np.where(small, 1.0 / 6.0 - square / 120.0, (safe - np.sin(safe)) / safe**3)
    return first, second, third


def skew(w: ArrayLike) -> Array:
    """(..., 3, 3) matrices of the cross product with vectors (..., 3)."""
    w = np.asarray(w, dtype=float)
    found = np.zeros((*w.shape, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[..., i, j], found[..., j, i] = -w[..., k], w[..., k]
    return found


def then(first: tuple[Array, Array], second: tuple[Array, Array]) -> tuple[Array, Array]:
    """The motion that does one, and in the frame where it ends the other.

    Args:
        first: translations (..., 3), mm, and rotations (..., 3, 3).
        second: the same.

    Returns:
        its translation, mm, and rotation.
    """
    t, r = first
    moved: Array = t + (r @ second[0][..., None])[..., 0]
    return moved, r @ second[1]


def inverse(motion: tuple[Array, Array]) -> tuple[Array, Array]:
    """The way back.

    Args:
        motion: translations (..., 3), mm, and rotations (..., 3, 3).

    Returns:
        its translation, mm, and rotation.
    """
    t, r = motion
    back = np.swapaxes(r, -1, -2)
    return -(back @ t[..., None])[..., 0], back
