"""Do two triangles in space intersect? Compiled, for many pairs at once.

The test of Moeller (1997): each triangle must reach to the other one's plane, and the parts of the line in which the
planes meet that lie in either triangle must overlap; triangles in one plane are compared there by the separating axis
theorem. Distances up to a tolerance count as zero, and three cases are decided on purpose:

- triangles that share a node or an edge always meet there; only what they have in common beyond it counts;
- an edge along an edge (the banks of a slit, a sheet that is rolled up to a closed tube) and a corner on anything are
  touching, not intersecting; an edge that lies in the other triangle's inside does intersect;
- triangles in one plane intersect if they overlap, such as the panels of a hinge that is closed.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.runtime.kernel_options import INNER, KERNEL

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@njit(**INNER)
def _arrange(points, one, two, A, B):  # type: ignore[no-untyped-def]
    """Copy the corners of two triangles to A and B (3, 3), relative to A[0]: shared nodes first, and exactly alike."""
    shared = 0
    rest_a, rest_b = 2, 2
    for i in range(3):
        common = one[i] == two[0] or one[i] == two[1] or one[i] == two[2]
        at = shared if common else rest_a
        for c in range(3):
            A[at, c] = points[one[i], c]
            if common:
                B[at, c] = points[one[i], c]
        if common:
            shared += 1
        else:
            rest_a -= 1
    for i in range(3):
        if not (two[i] == one[0] or two[i] == one[1] or two[i] == one[2]):
            for c in range(3):
                B[rest_b, c] = points[two[i], c]
            rest_b -= 1
    for c in range(3):
        origin = A[0, c]
        for i in range(3):
            A[i, c] -= origin
            B[i, c] -= origin


@njit(**INNER)
def _normal(T, n):  # type: ignore[no-untyped-def]
    """Unit normal of a triangle into n (3,)."""
    a0, a1, a2 = T[1, 0] - T[0, 0], T[1, 1] - T[0, 1], T[1, 2] - T[0, 2]
    b0, b1, b2 = T[2, 0] - T[0, 0], T[2, 1] - T[0, 1], T[2, 2] - T[0, 2]
    n[0], n[1], n[2] = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    for c in range(3):
        n[c] /= size


@njit(**INNER)
def _distances(T, base, n, tolerance, d):  # type: ignore[no-untyped-def]
    """Signed distances of T's corners to the plane through `base` into d (3,), small ones as zero.

    Returns their number of zeros, or -1 if the triangle lies on one side of the plane.
    """
    zeros, above, below = 0, 0, 0
    for i in range(3):
        d[i] = 0.0
        for c in range(3):
            d[i] += n[c] * (T[i, c] - base[c])
        if abs(d[i]) <= tolerance:
            d[i] = 0.0
            zeros += 1
        elif d[i] > 0.0:
            above += 1
        else:
            below += 1
    return -1 if above == 3 or below == 3 else zeros


@njit(**INNER)
def _interval(T, d, direction):  # type: ignore[no-untyped-def]
    """Where a triangle meets the other's plane, along `direction`: from and to, mm."""
    low, high = math.inf, -math.inf
    for i in range(3):
        j = (i + 1) % 3
        if d[i] == 0.0:
            share = 0.0
        elif d[i] * d[j] < 0.0:
            share = d[i] / (d[i] - d[j])
        else:
            continue
        at = 0.0
        for c in range(3):
            at += direction[c] * (T[i, c] + share * (T[j, c] - T[i, c]))
        low, high = min(low, at), max(high, at)
    return low, high


@njit(**INNER)
def _overlap_in_plane(A, B, n, tolerance):  # type: ignore[no-untyped-def]
    """Whether two triangles in the plane of normal n overlap by more than the tolerance (separating axis theorem)."""
    axis = np.empty(3)
    for which in range(6):
        T = A if which < 3 else B
        i, j = which % 3, (which + 1) % 3
        e0, e1, e2 = T[j, 0] - T[i, 0], T[j, 1] - T[i, 1], T[j, 2] - T[i, 2]
        axis[0], axis[1], axis[2] = n[1] * e2 - n[2] * e1, n[2] * e0 - n[0] * e2, n[0] * e1 - n[1] * e0
        size = math.sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2])
        low_a, high_a, low_b, high_b = math.inf, -math.inf, math.inf, -math.inf
        for k in range(3):
            a = (axis[0] * A[k, 0] + axis[1] * A[k, 1] + axis[2] * A[k, 2]) / size
            b = (axis[0] * B[k, 0] + axis[1] * B[k, 1] + axis[2] * B[k, 2]) / size
            low_a, high_a, low_b, high_b = min(low_a, a), max(high_a, a), min(low_b, b), max(high_b, b)
        if min(high_a, high_b) - max(low_a, low_b) <= tolerance:
            return False
    return True


@njit(**INNER)
def meet(points, one, two, tolerance, room):  # type: ignore[no-untyped-def]
    """Do triangles `one` and `two` (3,), the lower one first, intersect? `room` (11, 3) is to work in.

    Args:
        points: (n, 3) node positions, mm.
        one: (3,) nodes.
        two: (3,) nodes.
        tolerance: mm; distances and overlaps up to this are none.
        room: (11, 3).

    Returns:
        whether they do.
    """
    A, B, n_a, n_b, d_a, d_b, line = room[:3], room[3:6], room[6], room[7], room[8], room[9], room[10]
    _arrange(points, one, two, A, B)
    _normal(A, n_a)
    zeros_b = _distances(B, A[0], n_a, tolerance, d_b)
    if zeros_b < 0:
        return False
    _normal(B, n_b)
    zeros_a = _distances(A, B[0], n_b, tolerance, d_a)
    if zeros_a < 0:
        return False
    if zeros_b == 3 or zeros_a == 3:
        return _overlap_in_plane(A, B, n_a if zeros_b == 3 else n_b, tolerance)
    if zeros_a == 2 and zeros_b == 2:  # both have an edge in the line where the planes meet, shared or not
        return False
    line[0] = n_a[1] * n_b[2] - n_a[2] * n_b[1]
    line[1] = n_a[2] * n_b[0] - n_a[0] * n_b[2]
    line[2] = n_a[0] * n_b[1] - n_a[1] * n_b[0]
    size = math.sqrt(line[0] * line[0] + line[1] * line[1] + line[2] * line[2])
    for c in range(3):
        line[c] /= size
    low_a, high_a = _interval(A, d_a, line)
    low_b, high_b = _interval(B, d_b, line)
    return min(high_a, high_b) - max(low_a, low_b) > tolerance


@njit(**KERNEL)  # type: ignore[untyped-decorator]
def intersecting(points: Array, triangles: Ints, pairs: Ints, tolerance: float) -> NDArray[np.bool_]:
    """(k,) whether the two triangles of each pair (k, 2) intersect.

    Args:
        points: (n, 3) node positions, mm.
        triangles: (t, 3) node indices, none degenerate.
        pairs: (k, 2) rows of `triangles`; the order within a pair does not matter.
        tolerance: mm; distances and overlaps up to this are none.
    """
    found = np.zeros(len(pairs), dtype=np.bool_)
    room = np.empty((11, 3))
    for row in range(len(pairs)):
        i, j = min(pairs[row, 0], pairs[row, 1]), max(pairs[row, 0], pairs[row, 1])
        found[row] = meet(points, triangles[i], triangles[j], tolerance, room)
    return found
