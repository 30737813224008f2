"""Frames of a segmented crease: rotation matrices, Tait-Bryan angles, and the chain of segments (source 6.2.2, 6.2.4).

Everything is vectorised: leading axes (...) are any. Lengths in mm, angles in rad.

A frame has the columns (tangent of the crease, direction from the right to the left edge of the sheet, their cross
product). A segment maps the frame at its start to that at its end by (t, r): t (..., 3) in the start's frame, r
(..., 3, 3). Left is the side of +y where the crease runs along +x and a mountain fold points to +z.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
GIMBAL = 1e-9  # cosine of the middle angle below which the first and the third cannot be told apart


def matrix(angles: ArrayLike) -> Array:
    """(..., 3, 3) rotations r = Rz(w) Ry(v) Rx(u) of Tait-Bryan angles (..., 3) = (u, v, w) (Eq. 6.5)."""
    u, v, w = np.moveaxis(np.asarray(angles, dtype=float), -1, 0)
    cu, su, cv, sv, cw, sw = np.cos(u), np.sin(u), np.cos(v), np.sin(v), np.cos(w), np.sin(w)
    rows = (
        (cw * cv, cw * sv * su - sw * cu, cw * sv * cu + sw * su),
        (sw * cv, sw * sv * su + cw * cu, sw * sv * cu - cw * su),
        (-sv, cv * su, cv * cu),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def angles(rotation: ArrayLike) -> Array:
    """(..., 3) Tait-Bryan angles (u, v, w) of rotations (..., 3, 3) (Eq. 6.14 to 6.16).

    v lies in [-pi/2, pi/2], u and w in (-pi, pi]. Where the tangent points straight up or down only u - w or u + w is
    determined; then w = 0, as in the source. The equations as they are printed hold in exact arithmetic; what differs
    here: v comes from atan2, since arcsin loses half of the digits near +-pi/2 and is no number where rounding makes
    its argument exceed 1; and "= +-1" is a cosine of v below 1e-9, since no computed tangent ever is vertical exactly.
    """
    r = np.asarray(rotation, dtype=float)
    cosine = np.hypot(r[..., 0, 0], r[..., 1, 0])
    v = np.arctan2(-r[..., 2, 0], cosine)
    locked = cosine < GIMBAL
    up = np.where(r[..., 2, 0] > 0.0, -1.0, 1.0)
    u = np.where(
        locked,
        np.arctan2(up * r[..., 0, 1], up * r[..., 0, 2]),
        np.arctan2(r[..., 2, 1], r[..., 2, 2]),
    )
    w = np.where(locked, 0.0, np.arctan2(r[..., 1, 0], r[..., 0, 0]))
    return np.stack((u, v, w), axis=-1)


def frame(crease: ArrayLike, left: ArrayLike, right: ArrayLike) -> Array:
    """(..., 3, 3) frame of a cross-section from its three nodes (..., 3) (Eq. 6.10 to 6.13).

    Args:
        crease: (..., 3) node on the crease, mm.
        left: (..., 3) node on the left edge, mm.
        right: (..., 3) node on the right edge, mm.

    Returns:
        the unit vectors of the frame.
    """
    p, p_left, p_right = (np.asarray(x, dtype=float) for x in (crease, left, right))
    x = np.cross(p_right - p, p_left - p)
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    y = p_left - p_right
    y /= np.linalg.norm(y, axis=-1, keepdims=True)
    return np.stack((x, y, np.cross(x, y)), axis=-1)


def relative(start: tuple[ArrayLike, ArrayLike], end: tuple[ArrayLike, ArrayLike]) -> tuple[Array, Array]:
    """Translation (..., 3) and rotation (..., 3, 3) from the (point, frame) of a start to that of an end.

    Args:
        start: point (..., 3) and frame (..., 3, 3).
        end: point (..., 3) and frame (..., 3, 3).
    """
    (p0, r0), (p1, r1) = (tuple(np.asarray(x, dtype=float) for x in pair) for pair in (start, end))
    back = np.swapaxes(r0, -1, -2)
    return (back @ (p1 - p0)[..., None])[..., 0], back @ r1


def chain(
    t: ArrayLike, r: ArrayLike, origin: ArrayLike | None = None, start: ArrayLike | None = None
) -> tuple[Array, Array]:
    """Points and frames along a chain of n segments (Eq. 6.1, 6.2, 6.4).

    Args:
        t: (..., n, 3) local translations, mm.
        r: (..., n, 3, 3) local rotations.
        origin: (3,) P_0, the origin if not given.
        start: (3, 3) R_0, the identity if not given.

    Returns:
        (..., n + 1, 3) points P_0 to P_n and (..., n + 1, 3, 3) frames R_0 to R_n.
    """
    t, r = np.asarray(t, dtype=float), np.asarray(r, dtype=float)
    points, frames = (
        np.empty((*t.shape[:-2], t.shape[-2] + 1, 3)),
        np.empty((*t.shape[:-2], t.shape[-2] + 1, 3, 3)),
    )
    points[..., 0, :] = 0.0 if origin is None else origin
    frames[..., 0, :, :] = np.eye(3) if start is None else start
    for i in range(t.shape[-2]):  # over segments, never over designs
        here = frames[..., i, :, :]
        points[..., i + 1, :] = points[..., i, :] + np.einsum("...ab,...b->...a", here, t[..., i, :])
        frames[..., i + 1, :, :] = here @ r[..., i, :, :]
    return points, frames
