"""Joints of many strips at once, compiled: the motions of their pieces one after another, none of them kept.

Arrays of all motions (`Converged.motions`) are what most of a search for designs was spent on.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.applications.inverse.motions import SMALL
from bh.runtime.kernel_options import INNER, KERNEL

Array = NDArray[np.float64]


def joints(ends: Array, arcs: Array, pinches: Array, jumps: Array) -> tuple[Array, Array]:
    """Points (s, n + 1, 3), mm, and frames (s, n + 1, 3, 3) of strips: start, where segments meet, and end.

    Args:
        ends: (s, 2, 6) vectors of both free ends, see `bh.applications.inverse.motions`.
        arcs: (s, n, 2) turns of half segments, rad, and their lengths in the plane of the crease, mm.
        pinches: (s, n, 6) vectors, zero where there is none.
        jumps: (s, n - 1, 6) vectors of the joints between segments.
    """
    found = np.empty((len(arcs), arcs.shape[1] + 1, 3)), np.empty((len(arcs), arcs.shape[1] + 1, 3, 3))
    _joints(*(np.ascontiguousarray(each) for each in (ends, arcs, pinches, jumps)), *found)
    return found


@njit(**KERNEL)
def _joints(ends, arcs, pinches, jumps, points, frames):  # type: ignore[no-untyped-def]
    """The same, into points and frames."""
    p, f, r, t = np.empty(3), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    n = arcs.shape[1]
    for s in range(len(arcs)):
        p[:], f[:] = 0.0, np.eye(3)
        points[s, 0], frames[s, 0] = p, f
        _screw(ends[s, 0], p, f, r, t)
        for i in range(n):
            _arc(arcs[s, i, 0], arcs[s, i, 1], p, f, r, t)
            _screw(pinches[s, i], p, f, r, t)
            _arc(arcs[s, i, 0], arcs[s, i, 1], p, f, r, t)
            if i < n - 1:
                points[s, i + 1], frames[s, i + 1] = p, f
                _screw(jumps[s, i], p, f, r, t)
        _screw(ends[s, 1], p, f, r, t)
        points[s, n], frames[s, n] = p, f


@njit(**INNER)
def _screw(v, p, f, r, t):  # type: ignore[no-untyped-def]
    """Move a place and a frame by the motion of a vector (6,), as `motions.exponential`; r and t are to work in."""
    x, y, z = v[3], v[4], v[5]
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    if angle < SMALL:
        if angle == 0.0 and v[0] == 0.0 and v[1] == 0.0 and v[2] == 0.0:
            return
        a, b, c = 1.0 - square / 6.0, 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    else:
        sine, half = math.sin(angle), math.sin(0.5 * angle)
        a, b, c = sine / angle, 2.0 * half * half / square, (angle - sine) / (square * angle)
    r[0, 0], r[0, 1], r[0, 2] = 1.0 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y
    r[1, 0], r[1, 1], r[1, 2] = b * x * y + a * z, 1.0 - b * (x * x + z * z), b * y * z - a * x
    r[2, 0], r[2, 1], r[2, 2] = b * x * z - a * y, b * y * z + a * x, 1.0 - b * (x * x + y * y)
    # w x m and w x (w x m)
    m0, m1, m2 = y * v[2] - z * v[1], z * v[0] - x * v[2], x * v[1] - y * v[0]
    t[0] = v[0] + b * m0 + c * (y * m2 - z * m1)
    t[1] = v[1] + b * m1 + c * (z * m0 - x * m2)
    t[2] = v[2] + b * m2 + c * (x * m1 - y * m0)
    _onward(p, f, r, t)


@njit(**INNER)
def _arc(turn, size, p, f, r, t):  # type: ignore[no-untyped-def]
    """Move a place and a frame along an arc in the plane of the frame's first two axes."""
    half = 0.5 * turn
    part = 1.0 - half * half / 6.0 if abs(half) < SMALL else math.sin(half) / half
    t[0], t[1], t[2] = size * part * math.cos(half), size * part * math.sin(half), 0.0
    r[0, 0], r[0, 1], r[0, 2] = math.cos(turn), -math.sin(turn), 0.0
    r[1, 0], r[1, 1], r[1, 2] = -r[0, 1], r[0, 0], 0.0
    r[2, 0], r[2, 1], r[2, 2] = 0.0, 0.0, 1.0
    _onward(p, f, r, t)


@njit(**INNER)
def _onward(p, f, r, t):  # type: ignore[no-untyped-def]
    """A place and a frame behind a motion that begins there."""
    for i in range(3):
        a, b, c = f[i, 0], f[i, 1], f[i, 2]
        p[i] += a * t[0] + b * t[1] + c * t[2]
        for j in range(3):
            f[i, j] = a * r[0, j] + b * r[1, j] + c * r[2, j]
