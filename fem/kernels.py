"""Loops over all elements of the shell: measures, their gradients, and tangents. Compiled; see `fem.points`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fem.points import (
    OPTIONS,
    combine,
    cross,
    curvature_hessian,
    dot,
    edge_angle,
    edge_angle_hessian,
)

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class Frames(NamedTuple):
    """Unit tangents and frame vectors at the p points of every edge (e, p, 3), from its lower to its higher node."""

    t0: Array
    d0: Array


class Loops(NamedTuple):
    """Arrays of the element loops; t triangles, q points inside, p points on an edge (tables: `fem.spaces.Tables`).

    Attributes:
        nodes: (t, 6); edges: (t, 3) edge of the topology opposite each corner; sides: +1. where it runs
            counter-clockwise, else -1.
        inside: (t, q) weight over Jacobian; rim: (t, 3, p) weight over length of the edge's tangent.
    """

    nodes: Ints
    edges: Ints
    sides: Array
    inside: Array
    rim: Array
    Q: Array
    bary: Array
    slopes: Array
    bend: Array
    S: Array
    along: Array
    across: Array
    s: Array


@njit(**OPTIONS)
def _gather(x, nodes, out):  # type: ignore[no-untyped-def]
    """Positions of an element relative to its first node, which keeps rounding off large coordinates."""
    for i in range(6):
        for c in range(3):
            out[i, c] = x[nodes[i], c] - x[nodes[0], c]


@njit(**OPTIONS)
def _edge_point(xe, loops, frames, e, j, q, tau, c, t, d):  # type: ignore[no-untyped-def]
    """Tangent, transversal and frame of point q on edge j of element e, as this side of the edge sees them."""
    sign, edge = loops.sides[e, j], loops.edges[e, j]
    at = q if sign > 0.0 else len(loops.s) - 1 - q
    combine(loops.along[j, q], xe, tau)
    combine(loops.across[j, q], xe, c)
    for i in range(3):
        t[i] = sign * frames.t0[edge, at, i]
        d[i] = frames.d0[edge, at, i]


@njit(**OPTIONS)
def measures(x, gamma, loops, frames, strain, curvature):  # type: ignore[no-untyped-def]
    """Generalised strains (t, 9) and curvatures (t, 9) of all elements; see `fem.shell` for the arguments."""
    xe, gram = np.empty((6, 3)), np.empty((6, 6))
    p, r, N, second = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    tau, c, t, d, g = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty((2, 3))
    s = loops.s
    points = len(s)
    for e in range(len(loops.nodes)):
        _gather(x, loops.nodes[e], xe)
        for i in range(6):
            for j in range(6):
                gram[i, j] = dot(xe[i], xe[j])
        for k in range(9):
            total = 0.0
            for i in range(6):
                for j in range(6):
                    total += loops.Q[k, i, j] * gram[i, j]
            strain[e, k] = 0.5 * total
            curvature[e, k] = 0.0
        for b in range(3):
            combine(loops.bend[:, b], xe, second[b])
        for q in range(len(loops.bary)):
            combine(loops.slopes[q, :, 0], xe, p)
            combine(loops.slopes[q, :, 1], xe, r)
            cross(p, r, N)
            scale = loops.inside[e, q] / math.sqrt(dot(N, N))
            for j in range(3):
                bent = 0.0
                for b in range(3):
                    bent += loops.S[j, b] * dot(N, second[b])
                for k in range(3):
                    curvature[e, 3 * j + k] += scale * bent * loops.bary[q, (j + 1 + k) % 3]
        for j in range(3):
            for q in range(points):
                _edge_point(xe, loops, frames, e, j, q, tau, c, t, d)
                turn = edge_angle(tau, c, t, d, g) - (1.0 - s[q]) * gamma[e, j, 0] - s[q] * gamma[e, j, 1]
                curvature[e, 3 * j] -= loops.rim[e, j, q] * (1.0 - s[q]) * turn
                curvature[e, 3 * j + 1] -= loops.rim[e, j, q] * s[q] * turn


@njit(**OPTIONS)
def gradients(x, loops, frames, B):  # type: ignore[no-untyped-def]
    """B (t, 18, 24): derivatives of strains, then curvatures, by 18 positions and 6 side rotations gamma."""
    xe = np.empty((6, 3))
    p, r, N, second = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    tau, c, t, d, g = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty((2, 3))
    by_p, by_r, y, rate = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 18))
    s = loops.s
    points = len(s)
    for e in range(len(loops.nodes)):
        B[e] = 0.0
        _gather(x, loops.nodes[e], xe)
        for k in range(9):
            for i in range(6):
                for j in range(6):
                    for b in range(3):
                        B[e, k, 3 * i + b] += loops.Q[k, i, j] * xe[j, b]
        for b in range(3):
            combine(loops.bend[:, b], xe, second[b])
        for q in range(len(loops.bary)):
            combine(loops.slopes[q, :, 0], xe, p)
            combine(loops.slopes[q, :, 1], xe, r)
            cross(p, r, N)
            size = math.sqrt(dot(N, N))
            for b in range(3):
                lift = dot(N, second[b]) / (size * size)
                for i in range(3):
                    y[i] = (second[b, i] - lift * N[i]) / size
                cross(r, y, by_p)  # y . (dp x r) = dp . (r x y)
                cross(y, p, by_r)
                for i in range(6):
                    for k in range(3):
                        rate[b, 3 * i + k] = loops.inside[e, q] * (
                            loops.bend[i, b] * N[k] / size
                            + loops.slopes[q, i, 0] * by_p[k]
                            + loops.slopes[q, i, 1] * by_r[k]
                        )
            for j in range(3):
                for i in range(18):
                    value = (
                        loops.S[j, 0] * rate[0, i] + loops.S[j, 1] * rate[1, i] + loops.S[j, 2] * rate[2, i]
                    )
                    for k in range(3):
                        B[e, 9 + 3 * j + k, i] += loops.bary[q, (j + 1 + k) % 3] * value
        for j in range(3):
            for q in range(points):
                _edge_point(xe, loops, frames, e, j, q, tau, c, t, d)
                edge_angle(tau, c, t, d, g)
                for k in range(2):
                    part = loops.rim[e, j, q] * (s[q] if k else 1.0 - s[q])
                    for i in range(6):
                        for b in range(3):
                            B[e, 9 + 3 * j + k, 3 * i + b] -= part * (
                                loops.along[j, q, i] * g[0, b] + loops.across[j, q, i] * g[1, b]
                            )
                    B[e, 9 + 3 * j + k, 18 + 2 * j] += part * (1.0 - s[q])
                    B[e, 9 + 3 * j + k, 19 + 2 * j] += part * s[q]


@njit(inline="always", **OPTIONS)
def _add_block(K, a, b, H, symmetric_pair):  # type: ignore[no-untyped-def]
    """K (18, 18) += a_i b_j H, and its transposed if the pair of arguments is not the same."""
    for i in range(6):
        for j in range(6):
            w = a[i] * b[j]
            if w != 0.0:
                for k in range(3):
                    for m in range(3):
                        K[3 * i + k, 3 * j + m] += w * H[k, m]
                        if symmetric_pair:
                            K[3 * j + m, 3 * i + k] += w * H[k, m]


@njit(**OPTIONS)
def add_geometric(x, forces, loops, frames, K):  # type: ignore[no-untyped-def]
    """K (t, 24, 24) += sum over the 18 element forces (t, 18) of force times second derivatives of its measure."""
    xe = np.empty((6, 3))
    p, r, y, weights = np.empty(3), np.empty(3), np.empty(3), np.empty(6)
    tau, c, t, d = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    H, G, T = np.empty((3, 3, 3, 3)), np.empty((2, 2, 3, 3)), np.empty((3, 3))
    block = np.empty((18, 18))
    s = loops.s
    points = len(s)
    for e in range(len(loops.nodes)):
        _gather(x, loops.nodes[e], xe)
        block[:] = 0.0
        for i in range(6):
            for j in range(6):
                total = 0.0
                for k in range(9):
                    total += forces[e, k] * loops.Q[k, i, j]
                for b in range(3):
                    block[3 * i + b, 3 * j + b] += total
        for q in range(len(loops.bary)):
            combine(loops.slopes[q, :, 0], xe, p)
            combine(loops.slopes[q, :, 1], xe, r)
            for i in range(6):
                weights[i] = 0.0
            for j in range(3):
                moment = 0.0
                for k in range(3):
                    moment += forces[e, 9 + 3 * j + k] * loops.bary[q, (j + 1 + k) % 3]
                for b in range(3):
                    for i in range(6):
                        weights[i] += loops.inside[e, q] * moment * loops.S[j, b] * loops.bend[i, b]
            combine(weights, xe, y)
            curvature_hessian(p, r, y, H)
            first, second = loops.slopes[q, :, 0], loops.slopes[q, :, 1]
            _add_block(block, first, first, H[0, 0], False)
            _add_block(block, second, second, H[1, 1], False)
            _add_block(block, first, second, H[0, 1], True)
            _add_block(block, first, weights, H[0, 2], True)
            _add_block(block, second, weights, H[1, 2], True)
        for j in range(3):
            for q in range(points):
                _edge_point(xe, loops, frames, e, j, q, tau, c, t, d)
                edge_angle_hessian(tau, c, t, G)
                force = -loops.rim[e, j, q] * (
                    (1.0 - s[q]) * forces[e, 9 + 3 * j] + s[q] * forces[e, 10 + 3 * j]
                )
                for a in range(2):
                    for b in range(a, 2):
                        for i in range(3):
                            for k in range(3):
                                T[i, k] = force * G[a, b, i, k]
                        left = loops.along[j, q] if a == 0 else loops.across[j, q]
                        right = loops.along[j, q] if b == 0 else loops.across[j, q]
                        _add_block(block, left, right, T, a != b)
        for i in range(18):
            for j in range(18):
                K[e, i, j] += block[i, j]


@njit(**OPTIONS)
def add_material(B, membrane, bending, K):  # type: ignore[no-untyped-def]
    """K (t, 24, 24) += B^T diag(membrane, bending) B with (t, 9, 9) stiffness of either kind."""
    CB = np.empty((18, 24))
    for e in range(len(B)):
        for k in range(9):
            for j in range(24):
                a, b = 0.0, 0.0
                for m in range(9):
                    a += membrane[e, k, m] * B[e, m, j]
                    b += bending[e, k, m] * B[e, 9 + m, j]
                CB[k, j] = a
                CB[9 + k, j] = b
        for i in range(24):
            for k in range(18):
                left = B[e, k, i]
                if left != 0.0:
                    for j in range(24):
                        K[e, i, j] += left * CB[k, j]
