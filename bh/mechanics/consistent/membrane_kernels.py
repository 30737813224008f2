"""Forces and tangent of stretching (see `membrane`): compiled passes over bars and cells. mm, N.

Bars have gamma = (l^2 - L^2) / 2 with the gradient -+d at their ends; N (b,) are forces over lengths, N / mm, the
derivatives of the energy by gamma, summed over cells. A cell adds G^T K G of its bars to the tangent, and N times the
constant Hessian of the bars that it owns.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.mechanics.shared.assembly import add_lower, rotate
from bh.mechanics.shared.kinematics import INNER_OPTIONS, OPTIONS
from meshes.topology import Ints

Array = NDArray[np.float64]

# ------------------------------------------------------------------------------------------- once a step


@njit(**INNER_OPTIONS)
def _add_strain_map(d, part, second, out):  # type: ignore[no-untyped-def]
    """Add to out (3, k) a part of the strain (xx, yy, 2 xy) that bars 0, 1, 2 with plane vectors d (k, 2) measure.

    `second` (0 or 1): bars 0, 3, 4 instead. The strain for which one bar alone has gamma is the symmetric product of
    the normals of the two others.
    """
    for k in range(3):
        K, i, j = k, (k + 1) % 3, (k + 2) % 3
        K, i, j = K + 2 * second * (K > 0), i + 2 * second * (i > 0), j + 2 * second * (j > 0)
        scale = part / ((d[i, 0] * d[K, 1] - d[i, 1] * d[K, 0]) * (d[j, 0] * d[K, 1] - d[j, 1] * d[K, 0]))
        out[0, K] += scale * d[i, 1] * d[j, 1]
        out[1, K] += scale * d[i, 0] * d[j, 0]
        out[2, K] -= scale * (d[i, 0] * d[j, 1] + d[i, 1] * d[j, 0])


@njit(**INNER_OPTIONS)
def _beside(x, tail, head, wing, out):  # type: ignore[no-untyped-def]
    """Writes the place (2,) of a wing from the tail, along the edge and off it; returns the edge's length."""
    edge2 = arm2 = along = 0.0
    for i in range(3):
        e, w = x[head, i] - x[tail, i], x[wing, i] - x[tail, i]
        edge2 += e * e
        arm2 += w * w
        along += e * w
    length = np.sqrt(edge2)
    cross2 = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        c = (x[head, j] - x[tail, j]) * (x[wing, k] - x[tail, k])
        c -= (x[head, k] - x[tail, k]) * (x[wing, j] - x[tail, j])
        cross2 += c * c
    out[0], out[1] = along / length, np.sqrt(cross2) / length
    return length


def triangle_strains(x: Array, triangles: Ints) -> tuple[Array, Array]:
    """(c, 3, 3) maps from gamma of the bars opposite the corners to the strain, x along bar 0; areas (c,), mm^2.

    Args:
        x: (n, 3) stress-free positions, mm.
        triangles: (c, 3) corners.
    """
    strain, areas = np.zeros((len(triangles), 3, 3)), np.empty(len(triangles))
    _triangle_strains(x, triangles, strain, areas)
    return strain, areas


@njit(**OPTIONS)
def _triangle_strains(x, triangles, strain, areas):  # type: ignore[no-untyped-def]
    d, wing = np.empty((3, 2)), np.empty(2)
    for c in range(len(triangles)):
        length = _beside(x, triangles[c, 1], triangles[c, 2], triangles[c, 0], wing)
        areas[c] = 0.5 * length * wing[1]
        d[0, 0], d[0, 1] = length, 0.0
        d[1, 0], d[1, 1] = wing[0] - length, wing[1]
        d[2, 0], d[2, 1] = wing[0], wing[1]
        _add_strain_map(d, 1.0, np.int64(0), strain[c])


def edge_strains(x: Array, hinges: Ints) -> tuple[Array, Array]:
    """(c, 3, 5) maps from gamma of five bars to the mean strain, x along the edge; areas (c, 2) of the triangles, mm^2.

    Both triangles lie in one plane, unfolded about the edge: the first wing above it, the other one below.

    Args:
        x: (n, 3) stress-free positions, mm.
        hinges: (c, 4) wing, edge, edge, wing.
    """
    strain, areas = np.zeros((len(hinges), 3, 5)), np.empty((len(hinges), 2))
    _edge_strains(x, hinges, strain, areas)
    return strain, areas


@njit(**OPTIONS)
def _edge_strains(x, hinges, strain, areas):  # type: ignore[no-untyped-def]
    d, one, two = np.empty((5, 2)), np.empty(2), np.empty(2)
    for c in range(len(hinges)):
        length = _beside(x, hinges[c, 1], hinges[c, 2], hinges[c, 0], one)
        _beside(x, hinges[c, 1], hinges[c, 2], hinges[c, 3], two)
        areas[c, 0], areas[c, 1] = 0.5 * length * one[1], 0.5 * length * two[1]
        d[0, 0], d[0, 1] = length, 0.0
        d[1, 0], d[1, 1] = one[0], one[1]
        d[2, 0], d[2, 1] = one[0] - length, one[1]
        d[3, 0], d[3, 1] = two[0], -two[1]
        d[4, 0], d[4, 1] = two[0] - length, -two[1]
        part = one[1] / (one[1] + two[1])
        _add_strain_map(d, part, np.int64(0), strain[c])
        _add_strain_map(d, 1.0 - part, np.int64(1), strain[c])


# ------------------------------------------------------------------------------------------- every iteration


@njit(**OPTIONS)
def bar_strains(x, bars, rest_square, gamma):  # type: ignore[no-untyped-def]
    """Writes gamma (b,), mm^2."""
    for b in range(len(bars)):
        square = 0.0
        for i in range(3):
            d = x[bars[b, 1], i] - x[bars[b, 0], i]
            square += d * d
        gamma[b] = 0.5 * (square - rest_square[b])


@njit(**OPTIONS)
def bar_rates(x, v, bars, rate):  # type: ignore[no-untyped-def]
    """Writes the rates of gamma (b,) for velocities v (n, 3)."""
    for b in range(len(bars)):
        rate[b] = 0.0
        for i in range(3):
            rate[b] += (x[bars[b, 1], i] - x[bars[b, 0], i]) * (v[bars[b, 1], i] - v[bars[b, 0], i])


@njit(**OPTIONS)
def cell_forces(triangles, K3, edges, K5, gamma, N):  # type: ignore[no-untyped-def]
    """Writes the sums N (b,) of K gamma over the cells with bars `triangles` (c, 3) and `edges` (c, 5)."""
    for b in range(len(N)):
        N[b] = 0.0
    for c in range(len(triangles)):
        g0, g1, g2 = gamma[triangles[c, 0]], gamma[triangles[c, 1]], gamma[triangles[c, 2]]
        for k in range(3):
            N[triangles[c, k]] += K3[c, k, 0] * g0 + K3[c, k, 1] * g1 + K3[c, k, 2] * g2
    for c in range(len(edges)):
        g0, g1, g2 = gamma[edges[c, 0]], gamma[edges[c, 1]], gamma[edges[c, 2]]
        g3, g4 = gamma[edges[c, 3]], gamma[edges[c, 4]]
        for k in range(5):
            N[edges[c, k]] += (
                K5[c, k, 0] * g0 + K5[c, k, 1] * g1 + K5[c, k, 2] * g2 + K5[c, k, 3] * g3 + K5[c, k, 4] * g4
            )


@njit(**OPTIONS)
def bar_forces(x, bars, rest_square, N, f):  # type: ignore[no-untyped-def]
    """Sum of squared bar forces (N^2); adds the gradient to f (n, 3)."""
    size = 0.0
    for b in range(len(bars)):
        size += N[b] * N[b] * rest_square[b]
        for i in range(3):
            s = N[b] * (x[bars[b, 1], i] - x[bars[b, 0], i])
            f[bars[b, 0], i] -= s
            f[bars[b, 1], i] += s
    return size


@njit(**OPTIONS)
def bar_force_rates(x, v, bars, N, dN, f):  # type: ignore[no-untyped-def]
    """Add the rate of the gradient to f (n, 3): rates dN at these positions, and N where the nodes move by v (n, 3)."""
    for b in range(len(bars)):
        for i in range(3):
            s = dN[b] * (x[bars[b, 1], i] - x[bars[b, 0], i])
            s += N[b] * (v[bars[b, 1], i] - v[bars[b, 0], i])
            f[bars[b, 0], i] -= s
            f[bars[b, 1], i] += s


@njit(**OPTIONS)
def triangle_tangent(x, nodes, bars, owned, K, N, frame_of, frames, source, slots, data):  # type: ignore[no-untyped-def]
    """Add the tangent of triangle cells to `data`; edge k is opposite corner k."""
    H, d, W, own = np.empty((9, 9)), np.empty((3, 3)), np.empty(3), np.empty(3)
    for c in range(len(nodes)):
        for k in range(3):
            own[k] = N[bars[c, k]] if owned[c, k] else 0.0
            for i in range(3):
                d[k, i] = x[nodes[c, (k + 2) % 3], i] - x[nodes[c, (k + 1) % 3], i]
        # corner p ends edge p + 1 and begins edge p + 2: gradient of gamma at p is d_(p+1) - d_(p+2)
        for p in range(3):
            p1, p2 = (p + 1) % 3, (p + 2) % 3
            for q in range(p + 1):
                q1, q2 = (q + 1) % 3, (q + 2) % 3
                geometric = own[p1] + own[p2] if p == q else -own[3 - p - q]
                for i in range(3):
                    for k in range(3):
                        W[k] = K[c, k, p1] * d[p1, i] - K[c, k, p2] * d[p2, i]
                    for j in range(i + 1 if p == q else 3):
                        H[3 * p + i, 3 * q + j] = W[q1] * d[q1, j] - W[q2] * d[q2, j]
                    H[3 * p + i, 3 * q + i] += geometric
        if len(frames) > 0:
            rotate(H, nodes[c], frame_of, frames)
        add_lower(H, np.int64(9), slots[source[c]], data)


@njit(**OPTIONS)
def edge_tangent(x, nodes, bars, owned, K, N, frame_of, frames, source, slots, data):  # type: ignore[no-untyped-def]
    """Add the tangent of edge cells to `data`. Nodes (wing, edge, edge, wing) = 0..3; bars 1-2, 1-0, 2-0, 1-3, 2-3."""
    H, d, own = np.empty((12, 12)), np.empty((5, 3)), np.empty(5)
    W = np.empty((5, 12))  # K G
    for c in range(len(nodes)):
        a, j = nodes[c, 0], nodes[c, 1]
        k, b = nodes[c, 2], nodes[c, 3]
        for i in range(3):
            xa, xj, xk = x[a, i], x[j, i], x[k, i]
            xb = x[b, i]
            d[0, i] = xk - xj
            d[1, i] = xa - xj
            d[2, i] = xa - xk
            d[3, i] = xb - xj
            d[4, i] = xb - xk
        for m in range(5):
            own[m] = N[bars[c, m]] if owned[c, m] else 0.0
            k0, k1, k2 = K[c, m, 0], K[c, m, 1], K[c, m, 2]
            k3, k4 = K[c, m, 3], K[c, m, 4]
            for i in range(3):
                kd0, kd1, kd2 = k0 * d[0, i], k1 * d[1, i], k2 * d[2, i]
                kd3, kd4 = k3 * d[3, i], k4 * d[4, i]
                W[m, i] = kd1 + kd2
                W[m, 3 + i] = -kd0 - kd1 - kd3
                W[m, 6 + i] = kd0 - kd2 - kd4
                W[m, 9 + i] = kd3 + kd4
        own0, own1, own2 = own[0], own[1], own[2]
        own3, own4 = own[3], own[4]
        for i in range(3):
            d0, d1, d2 = d[0, i], d[1, i], d[2, i]
            d3, d4 = d[3, i], d[4, i]
            for q in range(i + 1):
                H[i, q] = d1 * W[1, q] + d2 * W[2, q]
            for q in range(4 + i):
                H[3 + i, q] = -d0 * W[0, q] - d1 * W[1, q] - d3 * W[3, q]
            for q in range(7 + i):
                H[6 + i, q] = d0 * W[0, q] - d2 * W[2, q] - d4 * W[4, q]
            for q in range(10 + i):
                H[9 + i, q] = d3 * W[3, q] + d4 * W[4, q]
            H[i, i] += own1 + own2
            H[3 + i, 3 + i] += own0 + own1 + own3
            H[6 + i, 6 + i] += own0 + own2 + own4
            H[9 + i, 9 + i] += own3 + own4
            H[3 + i, i] -= own1
            H[6 + i, i] -= own2
            H[6 + i, 3 + i] -= own0
            H[9 + i, 3 + i] -= own3
            H[9 + i, 6 + i] -= own4
        if len(frames) > 0:
            rotate(H, nodes[c], frame_of, frames)
        add_lower(H, np.int64(12), slots[source[c]], data)
