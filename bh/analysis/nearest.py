"""Nearest points of a surface of triangles to many points at once: boxes round halves of it, halved again; compiled.

The nearest point of a triangle is that of Ericson, Real-Time Collision Detection (2005), 5.1.5. Exact but for rounding;
where several triangles are equally near, as at an edge that they share, any of them is named.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.runtime.kernel_options import INNER, KERNEL

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
LEAF = 4  # triangles that are looked at one by one


@dataclass(frozen=True, eq=False)
class Boxes:
    """A binary tree of boxes: the children of box k are 2 k + 1 and 2 k + 2, the last level has the triangles.

    Attributes:
        corners: (t, 3, 3) of the triangles in the order of the last level, mm.
        order: (t,) which triangle each is.
        starts: (m + 1,) where those of each box of the last level begin.
        low: (2 m - 1, 3) of each box, mm.
        high: (2 m - 1, 3) of each box, mm.
    """

    corners: Array
    order: Ints
    starts: Ints
    low: Array
    high: Array

    def nearest(self, points: Array) -> tuple[Array, Ints]:
        """(k, 3) nearest points of the surface, and the triangles (k,) that they lie on.

        Args:
            points: (k, 3), mm.
        """
        at = np.ascontiguousarray(points, dtype=float)
        found, cells = _nearest(at, self.corners, self.starts, self.low, self.high)
        return found, self.order[cells]


def boxes(points: Array, triangles: Ints) -> Boxes:
    """The tree of a surface; each box is halved by number across its longest side.

    Args:
        points: (n, 3) nodes, mm.
        triangles: (t, 3) nodes, one at least.
    """
    corners = np.asarray(points, dtype=float)[triangles]
    middle = corners.mean(axis=1)
    order = np.arange(len(corners))
    levels = max(0, (len(corners) - 1) // LEAF).bit_length()
    low, high = np.empty((2 ** (levels + 1) - 1, 3)), np.empty((2 ** (levels + 1) - 1, 3))
    for level in range(levels + 1):
        count = 2**level
        starts = np.arange(count + 1) * len(corners) // count
        here = corners[order]
        first = count - 1
        low[first : first + count] = np.minimum.reduceat(here.min(axis=1), starts[:-1])
        high[first : first + count] = np.maximum.reduceat(here.max(axis=1), starts[:-1])
        if level < levels:
            longest = (high - low)[first : first + count].argmax(axis=1)
            box = np.repeat(np.arange(count), np.diff(starts))
            order = order[np.lexsort((middle[order, longest[box]], box))]
    return Boxes(corners[order], order, starts, low, high)


@njit(**INNER)
def _apart(p, low, high):  # type: ignore[no-untyped-def]
    """Squared distance of a point from a box."""
    total = 0.0
    for c in range(3):
        d = max(low[c] - p[c], 0.0, p[c] - high[c])
        total += d * d
    return total


@njit(**INNER)
def _on_triangle(p, T, out):  # type: ignore[no-untyped-def]
    """Nearest point of a triangle T (3, 3) into out (3,); returns the squared distance."""
    d1, d2, d3, d4, d5, d6 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for c in range(3):
        ab, ac = T[1, c] - T[0, c], T[2, c] - T[0, c]
        d1, d2 = d1 + ab * (p[c] - T[0, c]), d2 + ac * (p[c] - T[0, c])
        d3, d4 = d3 + ab * (p[c] - T[1, c]), d4 + ac * (p[c] - T[1, c])
        d5, d6 = d5 + ab * (p[c] - T[2, c]), d6 + ac * (p[c] - T[2, c])
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        v, w = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        v, w = 1.0, 0.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v, w = d1 / (d1 - d3), 0.0
    elif d6 >= 0.0 and d5 <= d6:
        v, w = 0.0, 1.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        v, w = 0.0, d2 / (d2 - d6)
    elif va <= 0.0 and d4 >= d3 and d5 >= d6:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - w
    else:
        v, w = vb / (va + vb + vc), vc / (va + vb + vc)
    total = 0.0
    for c in range(3):
        out[c] = T[0, c] + v * (T[1, c] - T[0, c]) + w * (T[2, c] - T[0, c])
        total += (p[c] - out[c]) ** 2
    return total


@njit(**KERNEL)
def _nearest(queries, corners, starts, low, high):  # type: ignore[no-untyped-def]
    """Nearest points (k, 3) and their triangles (k,), in the order of the tree."""
    leaves = len(starts) - 1
    found, cells = np.empty((len(queries), 3)), np.zeros(len(queries), dtype=np.int64)
    stack, bound, here = np.empty(64, dtype=np.int64), np.empty(64), np.empty(3)
    last = 0
    for k in range(len(queries)):
        p = queries[k]
        best = _on_triangle(p, corners[last], found[k])  # points come in some order: often near the last one
        cells[k] = last
        stack[0], bound[0], size = 0, 0.0, 1
        while size > 0:
            size -= 1
            box = stack[size]
            if bound[size] >= best:
                continue
            if box >= leaves - 1:
                for t in range(starts[box - leaves + 1], starts[box - leaves + 2]):
                    apart = _on_triangle(p, corners[t], here)
                    if apart < best:
                        best, cells[k] = apart, t
                        for c in range(3):
                            found[k, c] = here[c]
                continue
            one, two = 2 * box + 1, 2 * box + 2
            near, far = _apart(p, low[one], high[one]), _apart(p, low[two], high[two])
            if far < near:
                one, two, near, far = two, one, far, near
            stack[size], bound[size] = two, far
            stack[size + 1], bound[size + 1] = one, near
            size += 2
        last = cells[k]
    return found, cells
