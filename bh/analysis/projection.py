"""Proofs that a sheet does not meet itself, compiled.

From some direction every point of it is seen, and only once (`seen_once`); or no two triangles whose boxes meet
intersect, but for those round a node whose fan is seen once from some direction (`meets_itself`).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.analysis.triangles import meet
from bh.runtime.kernel_options import INNER, KERNEL

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
STEEP = 1e-6  # of its area: a triangle is seen from the side
FACING = 0.01  # cosine: folded by less than 1.1 degrees from shut, a fan is looked at triangle by triangle
CLOSED = 1e-6  # rad: a fan that turns by 2 pi
TOUCHING = 1e-9  # of the size: boundary edges nearer than this touch


@njit(**KERNEL)  # type: ignore[untyped-decorator]
def outline(triangles: Ints) -> Ints:
    """(b, 2) edges of one triangle only, in its sense.

    Args:
        triangles: (t, 3) nodes.
    """
    count = 3 * len(triangles)
    flat = triangles.ravel()
    starts = np.zeros(flat.max() + 2, dtype=np.int64)
    for k in range(count):
        starts[flat[k] + 1] += 1
    for node in range(len(starts) - 1):
        starts[node + 1] += starts[node]
    ends, at = np.empty(count, dtype=np.int64), starts.copy()
    for k in range(count):
        ends[at[flat[k]]] = flat[k + 1 if k % 3 < 2 else k - 2]
        at[flat[k]] += 1
    found, alone = np.empty((count, 2), dtype=np.int64), 0
    for k in range(count):
        a, b = flat[k], flat[k + 1 if k % 3 < 2 else k - 2]
        back = False
        for place in range(starts[b], starts[b + 1]):
            back |= ends[place] == a
        if not back:
            found[alone, 0], found[alone, 1] = a, b
            alone += 1
    return found[:alone]


@njit(**INNER)
def _side(x, y, a, b, p):  # type: ignore[no-untyped-def]
    """Twice the area of the triangle a, b, p in the plane."""
    return (x[b] - x[a]) * (y[p] - y[a]) - (y[b] - y[a]) * (x[p] - x[a])


@njit(**INNER)
def _touch(x, y, a, b, c, d, tolerance):  # type: ignore[no-untyped-def]
    """Do the edges a-b and c-d of an outline touch, beside in a node that they share?"""
    if b == c or d == a:  # one follows the other: it must not turn back on it
        first, corner, last = (a, b, d) if b == c else (c, d, b)
        forward = (x[corner] - x[first]) * (x[last] - x[corner]) + (y[corner] - y[first]) * (
            y[last] - y[corner]
        )
        return forward < 0.0 and abs(_side(x, y, first, corner, last)) <= tolerance
    one, two = _side(x, y, a, b, c), _side(x, y, a, b, d)
    if min(one, two) > tolerance or max(one, two) < -tolerance:
        return False
    one, two = _side(x, y, c, d, a), _side(x, y, c, d, b)
    return not (min(one, two) > tolerance or max(one, two) < -tolerance)


@njit(**INNER)
def _doubled(points, triangle, out):  # type: ignore[no-untyped-def]
    """Normal of a triangle into out (3,), as long as twice its area."""
    i, j, k = triangle
    for c in range(3):
        a, b = (c + 1) % 3, (c + 2) % 3
        out[c] = (points[j, a] - points[i, a]) * (points[k, b] - points[i, b]) - (
            points[j, b] - points[i, b]
        ) * (points[k, a] - points[i, a])


@njit(**INNER)
def _axes(points, triangles, u, v):  # type: ignore[no-untyped-def]
    """Axes across the mean normal into u, v (3,); False where a triangle does not face along it."""
    doubled = np.empty((len(triangles), 3))
    n = np.zeros(3)
    for t in range(len(triangles)):
        _doubled(points, triangles[t], doubled[t])
        for c in range(3):
            n[c] += doubled[t, c]
    size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    area = 0.0
    for t in range(len(triangles)):
        d = doubled[t]
        own = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        area += own
        if d[0] * n[0] + d[1] * n[1] + d[2] * n[2] <= STEEP * own * size:
            return False
    if size <= STEEP * area:
        return False
    least = 0
    for c in range(3):
        n[c] /= size
        if abs(n[c]) < abs(n[least]):
            least = c
    a, b = (least + 1) % 3, (least + 2) % 3
    across = math.sqrt(n[a] * n[a] + n[b] * n[b])
    u[least], u[a], u[b] = 0.0, n[b] / across, -n[a] / across
    v[0], v[1], v[2] = n[1] * u[2] - n[2] * u[1], n[2] * u[0] - n[0] * u[2], n[0] * u[1] - n[1] * u[0]
    return True


@njit(**INNER)
def _one_outer(edges, x, y, follows):  # type: ignore[no-untyped-def]
    """Is the outline made of loops, of which one runs round its inside to the left?"""
    for e in range(len(edges)):
        follows[edges[e, 0]] = -1
    for e in range(len(edges)):
        if follows[edges[e, 0]] >= 0:  # it touches itself in a node
            return False
        follows[edges[e, 0]] = edges[e, 1]
    outer = 0
    for e in range(len(edges)):
        first = edges[e, 0]
        node, area = first, 0.0
        while follows[node] >= 0:
            after = follows[node]
            area += (x[node] - x[first]) * (y[after] - y[first]) - (x[after] - x[first]) * (
                y[node] - y[first]
            )
            follows[node] = -1
            node = after
        if node != first:
            return False
        if area > 0.0:
            outer += 1
    return outer == 1


@njit(**KERNEL)  # type: ignore[untyped-decorator]
def seen_once(points: Array, triangles: Ints, edges: Ints) -> bool:
    """Proof that a sheet does not meet itself: from some direction every point of it is seen, and only once.

    If all triangles turn the same side towards the direction (here their mean normal), the projection of the sheet
    covers every point of the plane as often as its boundary winds round it. If the boundary is made of loops that do
    not touch, and only one of them runs round its inside to the left, that is once or never. The same idea as for the
    self-collision of cloth (Volino and Magnenat Thalmann 1994).

    Args:
        points: (n, 3), mm.
        triangles: (t, 3).
        edges: (b, 2) of the boundary, as `outline` gives them.

    Returns:
        True for a sheet that is proven free of self-contact; False means nothing.
    """
    u, v = np.zeros(3), np.zeros(3)
    if len(edges) == 0 or not _axes(points, triangles, u, v):
        return False
    count = len(edges)
    x, y = np.zeros(len(points)), np.zeros(len(points))
    left, right = np.inf, -np.inf
    for e in range(count):
        node = edges[e, 0]
        for c in range(3):
            x[node] += u[c] * points[node, c]
            y[node] += v[c] * points[node, c]
        left, right = min(left, x[node]), max(right, x[node])
    if not _one_outer(edges, x, y, np.empty(len(points), dtype=np.int64)):
        return False
    # edges by the strip that their left end lies in, so that each is compared with what begins where it is
    strip = np.empty(count, dtype=np.int64)
    starts = np.zeros(count + 1, dtype=np.int64)
    scale = (count - 1) / max(right - left, 1e-300)
    for e in range(count):
        strip[e] = int((min(x[edges[e, 0]], x[edges[e, 1]]) - left) * scale)
        starts[strip[e] + 1] += 1
    for k in range(count):
        starts[k + 1] += starts[k]
    order, at = np.empty(count, dtype=np.int64), starts.copy()
    for e in range(count):
        order[at[strip[e]]] = e
        at[strip[e]] += 1
    tolerance = TOUCHING * (right - left) ** 2
    for place in range(count):
        e = order[place]
        a, b = edges[e]
        last = min(int((max(x[a], x[b]) - left) * scale), count - 1)
        low, high = min(y[a], y[b]), max(y[a], y[b])
        for other in range(place + 1, starts[last + 1]):
            c, d = edges[order[other]]
            if min(y[c], y[d]) > high or max(y[c], y[d]) < low:
                continue
            if _touch(x, y, a, b, c, d, tolerance):
                return False
    return True


@njit(**INNER)
def _in_order(low, edge, count, order):  # type: ignore[no-untyped-def]
    """Numbers into `order` by strips of low[:, 0], each as wide as `edge` needs for `count` of them; their starts."""
    left, right = low[:, 0].min(), low[:, 0].max()
    scale = (count - 1) / max(right - left, edge)
    strip, starts = np.empty(count, dtype=np.int64), np.zeros(count + 1, dtype=np.int64)
    for k in range(count):
        strip[k] = int((low[k, 0] - left) * scale)
        starts[strip[k] + 1] += 1
    for k in range(count):
        starts[k + 1] += starts[k]
    at = starts.copy()
    for k in range(count):
        order[at[strip[k]]] = k
        at[strip[k]] += 1
    return left, scale, starts


@njit(**INNER)
def _plain_nodes(points, triangles, edges):  # type: ignore[no-untyped-def]
    """(n,) nodes whose triangles are seen from some direction, and only once, so that none of them meet."""
    count = len(points)
    normals, total = np.zeros((len(triangles), 3)), np.zeros((count, 3))
    for t in range(len(triangles)):
        _doubled(points, triangles[t], normals[t])
        own = math.sqrt(normals[t, 0] ** 2 + normals[t, 1] ** 2 + normals[t, 2] ** 2)
        for c in range(3):
            normals[t, c] /= max(own, 1e-300)
            for corner in range(3):
                total[triangles[t, corner], c] += normals[t, c]
    plain, turned = np.ones(count, dtype=np.bool_), np.zeros(count)
    for t in range(len(triangles)):
        for corner in range(3):
            node, one, two = (
                triangles[t, corner],
                triangles[t, (corner + 1) % 3],
                triangles[t, (corner + 2) % 3],
            )
            n = total[node]
            size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
            facing = (n[0] * normals[t, 0] + n[1] * normals[t, 1] + n[2] * normals[t, 2]) / max(size, 1e-300)
            if facing <= FACING:
                plain[node] = False
                continue
            # the corner's angle as it is seen along the mean normal
            a_n, b_n, dot, aa, bb = 0.0, 0.0, 0.0, 0.0, 0.0
            for c in range(3):
                a, b = points[one, c] - points[node, c], points[two, c] - points[node, c]
                a_n, b_n, dot = a_n + a * n[c] / size, b_n + b * n[c] / size, dot + a * b
                aa, bb = aa + a * a, bb + b * b
            area = math.sqrt(max(aa * bb - dot * dot, 0.0)) * facing
            turned[node] += math.atan2(area, dot - a_n * b_n)
    banks = np.zeros(count, dtype=np.int64)
    for e in range(len(edges)):
        banks[edges[e, 0]] += 1
    for node in range(count):
        most = 2.0 * math.pi + (CLOSED if banks[node] == 0 else -CLOSED)
        plain[node] &= banks[node] <= 1 and turned[node] < most
    return plain


@njit(**KERNEL)  # type: ignore[untyped-decorator]
def meets_itself(points: Array, triangles: Ints, edges: Ints, tolerance: float) -> bool:
    """Do any two triangles intersect? The pairs whose boxes meet are looked at, in the order of the longest axis.

    Args:
        points: (n, 3) node positions, mm.
        triangles: (t, 3) node indices, none degenerate.
        edges: (b, 2) of the boundary, as `outline` gives them.
        tolerance: mm; distances and overlaps up to this are none, and boxes are wider by it.

    Returns:
        whether any do.
    """
    count = len(triangles)
    longest, most = 0, -1.0
    for c in range(3):
        extent = points[:, c].max() - points[:, c].min()
        if extent > most:
            longest, most = c, extent
    low, high = np.empty((count, 3)), np.empty((count, 3))
    for t in range(count):
        for k in range(3):
            c = (longest + k) % 3
            a, b, d = points[triangles[t, 0], c], points[triangles[t, 1], c], points[triangles[t, 2], c]
            low[t, k], high[t, k] = min(a, b, d), max(a, b, d) + tolerance
    order = np.empty(count, dtype=np.int64)
    left, scale, starts = _in_order(low, tolerance, count, order)
    plain = _plain_nodes(points, triangles, edges)
    room = np.empty((11, 3))
    for place in range(count):
        i = order[place]
        last = min(int((high[i, 0] - left) * scale), count - 1)
        for other in range(place + 1, starts[last + 1]):
            j = order[other]
            if (
                low[j, 0] > high[i, 0]
                or low[j, 1] > high[i, 1]
                or low[i, 1] > high[j, 1]
                or low[j, 2] > high[i, 2]
                or low[i, 2] > high[j, 2]
            ):
                continue
            apart = False
            for k in range(3):
                node = triangles[i, k]
                shared = node == triangles[j, 0] or node == triangles[j, 1] or node == triangles[j, 2]
                apart |= shared and plain[node]
            if not apart and meet(points, triangles[min(i, j)], triangles[max(i, j)], tolerance, room):
                return True
    return False
