"""Loops over all elements of the shell: measures, their gradients, and tangents. Compiled; see `fem.points`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.runtime.kernel_options import INNER, KERNEL
from fem.points import (
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
    """Arrays of the element loops.

    t triangles of n nodes, q points inside, p points on an edge. The tables are those of `fem.spaces.Tables`; q is zero
    where the shapes are linear, which do not bend inside.

    Attributes:
        nodes: (t, n) of every triangle.
        edges: (t, 3) edge of the topology opposite each corner.
        sides: (t, 3) +1. where it runs counter-clockwise, else -1.
        inside: (t, q) weight over Jacobian.
        rim: (t, 3, p) weight over length of the edge's tangent.
    """

    nodes: Ints
    edges: Ints
    sides: Array
    inside: Array
    rim: Array
    Q: Array
    factors: Array
    slopes: Array
    bend: Array
    S: Array
    along: Array
    across: Array
    turn: Array


@njit(**INNER)
def _gather(x, nodes, out):  # type: ignore[no-untyped-def]
    """Positions of an element relative to its first node, which keeps rounding off large coordinates."""
    for i in range(len(nodes)):
        for c in range(3):
            out[i, c] = x[nodes[i], c] - x[nodes[0], c]


@njit(**INNER)
def _edge_point(xe, loops, frames, e, j, q, tau, c, t, d):  # type: ignore[no-untyped-def]
    """Tangent, transversal and frame of point q on edge j of element e, as this side of the edge sees them."""
    sign, edge = loops.sides[e, j], loops.edges[e, j]
    at = q if sign > 0.0 else loops.turn.shape[1] - 1 - q
    combine(loops.along[j, q], xe, tau)
    combine(loops.across[j, q], xe, c)
    for i in range(3):
        t[i] = sign * frames.t0[edge, at, i]
        d[i] = frames.d0[edge, at, i]


@njit(**KERNEL)
def measures(x, gamma, loops, frames, strain, curvature):  # type: ignore[no-untyped-def]
    """Generalised strains (t, 3 m) and curvatures (t, 3 m) of all elements; see `fem.shell` for the arguments."""
    n, own, turns = loops.nodes.shape[1], loops.factors.shape[2], len(loops.turn)
    xe, gram = np.empty((n, 3)), np.empty((n, n))
    p, r, N, second = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    tau, c, t, d, g = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty((2, 3))
    points = loops.turn.shape[1]
    for e in range(len(loops.nodes)):
        _gather(x, loops.nodes[e], xe)
        for i in range(n):
            for j in range(n):
                gram[i, j] = dot(xe[i], xe[j])
        for k in range(3 * own):
            total = 0.0
            for i in range(n):
                for j in range(n):
                    total += loops.Q[k, i, j] * gram[i, j]
            strain[e, k] = 0.5 * total
            curvature[e, k] = 0.0
        for b in range(3):
            combine(loops.bend[b], xe, second[b])
        for q in range(loops.inside.shape[1]):
            combine(loops.slopes[q, 0], xe, p)
            combine(loops.slopes[q, 1], xe, r)
            cross(p, r, N)
            scale = loops.inside[e, q] / math.sqrt(dot(N, N))
            for j in range(3):
                bent = 0.0
                for b in range(3):
                    bent += loops.S[j, b] * dot(N, second[b])
                for k in range(own):
                    curvature[e, own * j + k] += scale * bent * loops.factors[q, j, k]
        for j in range(3):
            for q in range(points):
                _edge_point(xe, loops, frames, e, j, q, tau, c, t, d)
                turn = edge_angle(tau, c, t, d, g)
                for k in range(turns):
                    turn -= loops.turn[k, q] * gamma[e, j, k]
                for k in range(turns):
                    curvature[e, own * j + k] -= loops.rim[e, j, q] * loops.turn[k, q] * turn


@njit(**KERNEL)
def gradients(x, loops, frames, B):  # type: ignore[no-untyped-def]
    """B (t, 6 m, 3 n + 3 r): derivatives of strains, then curvatures, by positions and side rotations gamma."""
    n, own, turns = loops.nodes.shape[1], loops.factors.shape[2], len(loops.turn)
    first = 3 * own
    xe = np.empty((n, 3))
    p, r, N, second = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    tau, c, t, d, g = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty((2, 3))
    by_p, by_r, y, rate = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3 * n))
    points = loops.turn.shape[1]
    for e in range(len(loops.nodes)):
        B[e] = 0.0
        _gather(x, loops.nodes[e], xe)
        for k in range(3 * own):
            for i in range(n):
                for j in range(n):
                    for b in range(3):
                        B[e, k, 3 * i + b] += loops.Q[k, i, j] * xe[j, b]
        for b in range(3):
            combine(loops.bend[b], xe, second[b])
        for q in range(loops.inside.shape[1]):
            combine(loops.slopes[q, 0], xe, p)
            combine(loops.slopes[q, 1], xe, r)
            cross(p, r, N)
            size = math.sqrt(dot(N, N))
            for b in range(3):
                lift = dot(N, second[b]) / (size * size)
                for i in range(3):
                    y[i] = (second[b, i] - lift * N[i]) / size
                cross(r, y, by_p)  # y . (dp x r) = dp . (r x y)
                cross(y, p, by_r)
                for i in range(n):
                    for k in range(3):
                        rate[b, 3 * i + k] = loops.inside[e, q] * (
                            loops.bend[b, i] * N[k] / size
                            + loops.slopes[q, 0, i] * by_p[k]
                            + loops.slopes[q, 1, i] * by_r[k]
                        )
            for j in range(3):
                for i in range(3 * n):
                    value = (
                        loops.S[j, 0] * rate[0, i] + loops.S[j, 1] * rate[1, i] + loops.S[j, 2] * rate[2, i]
                    )
                    for k in range(own):
                        B[e, first + own * j + k, i] += loops.factors[q, j, k] * value
        for j in range(3):
            for q in range(points):
                _edge_point(xe, loops, frames, e, j, q, tau, c, t, d)
                edge_angle(tau, c, t, d, g)
                for k in range(turns):
                    part = loops.rim[e, j, q] * loops.turn[k, q]
                    for i in range(n):
                        for b in range(3):
                            B[e, first + own * j + k, 3 * i + b] -= part * (
                                loops.along[j, q, i] * g[0, b] + loops.across[j, q, i] * g[1, b]
                            )
                    for m in range(turns):
                        B[e, first + own * j + k, 3 * n + turns * j + m] += part * loops.turn[m, q]


@njit(**INNER)
def _add_block(K, a, b, H, symmetric_pair):  # type: ignore[no-untyped-def]
    """K (3 n, 3 n) += a_i b_j H, and its transposed if the pair of arguments is not the same."""
    for i in range(len(a)):
        for j in range(len(b)):
            w = a[i] * b[j]
            if w != 0.0:
                for k in range(3):
                    for m in range(3):
                        K[3 * i + k, 3 * j + m] += w * H[k, m]
                        if symmetric_pair:
                            K[3 * j + m, 3 * i + k] += w * H[k, m]


@njit(**KERNEL)
def add_geometric(x, forces, loops, frames, K):  # type: ignore[no-untyped-def]
    """K += sum over the element forces (t, 6 m) of force times second derivatives of its measure by positions."""
    n, own, turns = loops.nodes.shape[1], loops.factors.shape[2], len(loops.turn)
    xe = np.empty((n, 3))
    p, r, y, weights = np.empty(3), np.empty(3), np.empty(3), np.empty(n)
    tau, c, t, d = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    H, G, T = np.empty((3, 3, 3, 3)), np.empty((2, 2, 3, 3)), np.empty((3, 3))
    block = np.empty((3 * n, 3 * n))
    points = loops.turn.shape[1]
    for e in range(len(loops.nodes)):
        _gather(x, loops.nodes[e], xe)
        block[:] = 0.0
        for i in range(n):
            for j in range(n):
                total = 0.0
                for k in range(3 * own):
                    total += forces[e, k] * loops.Q[k, i, j]
                for b in range(3):
                    block[3 * i + b, 3 * j + b] += total
        for q in range(loops.inside.shape[1]):
            combine(loops.slopes[q, 0], xe, p)
            combine(loops.slopes[q, 1], xe, r)
            for i in range(n):
                weights[i] = 0.0
            for j in range(3):
                moment = 0.0
                for k in range(own):
                    moment += forces[e, (3 + j) * own + k] * loops.factors[q, j, k]
                for b in range(3):
                    for i in range(n):
                        weights[i] += loops.inside[e, q] * moment * loops.S[j, b] * loops.bend[b, i]
            combine(weights, xe, y)
            curvature_hessian(p, r, y, H)
            first, second = loops.slopes[q, 0], loops.slopes[q, 1]
            _add_block(block, first, first, H[0, 0], False)
            _add_block(block, second, second, H[1, 1], False)
            _add_block(block, first, second, H[0, 1], True)
            _add_block(block, first, weights, H[0, 2], True)
            _add_block(block, second, weights, H[1, 2], True)
        for j in range(3):
            for q in range(points):
                _edge_point(xe, loops, frames, e, j, q, tau, c, t, d)
                edge_angle_hessian(tau, c, t, G)
                force = 0.0
                for k in range(turns):
                    force -= loops.rim[e, j, q] * loops.turn[k, q] * forces[e, (3 + j) * own + k]
                for a in range(2):
                    for b in range(a, 2):
                        for i in range(3):
                            for k in range(3):
                                T[i, k] = force * G[a, b, i, k]
                        left = loops.along[j, q] if a == 0 else loops.across[j, q]
                        right = loops.along[j, q] if b == 0 else loops.across[j, q]
                        _add_block(block, left, right, T, a != b)
        for i in range(3 * n):
            for j in range(3 * n):
                K[e, i, j] += block[i, j]


@njit(**KERNEL)
def add_material(B, membrane, bending, K):  # type: ignore[no-untyped-def]
    """K += B^T diag(membrane, bending) B with (t, 3 m, 3 m) stiffness of either kind."""
    count, width = membrane.shape[1], K.shape[1]
    CB = np.empty((2 * count, width))
    for e in range(len(B)):
        for k in range(count):
            for j in range(width):
                a, b = 0.0, 0.0
                for m in range(count):
                    a += membrane[e, k, m] * B[e, m, j]
                    b += bending[e, k, m] * B[e, count + m, j]
                CB[k, j] = a
                CB[count + k, j] = b
        for i in range(width):
            for k in range(2 * count):
                left = B[e, k, i]
                if left != 0.0:
                    for j in range(width):
                        K[e, i, j] += left * CB[k, j]
