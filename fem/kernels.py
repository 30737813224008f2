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
    edge_angle_hessian,
    edge_rise,
    edge_slopes,
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
    tau, c, t, d = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
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
                turn = edge_rise(tau, c, t, d)
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
    by_p, by_r, y, rate, value = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3 * n)), np.empty(3 * n)
    points = loops.turn.shape[1]
    for e in range(len(loops.nodes)):
        B[e] = 0.0
        _gather(x, loops.nodes[e], xe)
        for k in range(3 * own):
            for i in range(n):
                s0, s1, s2 = 0.0, 0.0, 0.0
                for j in range(n):
                    weight = loops.Q[k, i, j]
                    s0 += weight * xe[j, 0]
                    s1 += weight * xe[j, 1]
                    s2 += weight * xe[j, 2]
                B[e, k, 3 * i], B[e, k, 3 * i + 1], B[e, k, 3 * i + 2] = s0, s1, s2
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
                s0, s1, s2 = loops.S[j, 0], loops.S[j, 1], loops.S[j, 2]
                for i in range(3 * n):
                    value[i] = s0 * rate[0, i] + s1 * rate[1, i] + s2 * rate[2, i]
                for k in range(own):
                    factor = loops.factors[q, j, k]
                    for i in range(3 * n):
                        B[e, first + own * j + k, i] += factor * value[i]
        for j in range(3):
            for q in range(points):
                _edge_point(xe, loops, frames, e, j, q, tau, c, t, d)
                edge_slopes(tau, c, t, g)
                for i in range(n):
                    for b in range(3):
                        value[3 * i + b] = loops.along[j, q, i] * g[0, b] + loops.across[j, q, i] * g[1, b]
                for k in range(turns):
                    part = loops.rim[e, j, q] * loops.turn[k, q]
                    for i in range(3 * n):
                        B[e, first + own * j + k, i] -= part * value[i]
                    for m in range(turns):
                        B[e, first + own * j + k, 3 * n + turns * j + m] += part * loops.turn[m, q]


@njit(**INNER)
def _add_form(block, D, H, scale, half):  # type: ignore[no-untyped-def]
    """Add scale D^T H D to the lower half of `block` (n, n, 9): the Hessian of a function of m vectors.

    Vector a is sum_i D[a, i] x_i; H (m, m, 9) are the second derivatives by any two of them, row by row, symmetric as
    a whole; `half` (m, 9) is room to work in. H is multiplied by D first on one side, then on the other.
    """
    m, n = D.shape
    for j in range(n):
        for a in range(m):
            for k in range(9):
                half[a, k] = 0.0
            for b in range(m):
                weight = scale * D[b, j]
                if weight != 0.0:
                    for k in range(9):
                        half[a, k] += weight * H[a, b, k]
        for i in range(j, n):
            for a in range(m):
                weight = D[a, i]
                if weight != 0.0:
                    for k in range(9):
                        block[i, j, k] += weight * half[a, k]


@njit(**INNER)
def _add_halves(block, K):  # type: ignore[no-untyped-def]
    """K (w, w) += the symmetric matrix whose lower half are the 3 x 3 blocks of `block` (n, n, 9)."""
    for i in range(len(block)):
        for k in range(3):
            for j in range(i):
                for m in range(3):
                    K[3 * i + k, 3 * j + m] += block[i, j, 3 * k + m]
                    K[3 * j + m, 3 * i + k] += block[i, j, 3 * k + m]
            for m in range(3):
                K[3 * i + k, 3 * i + m] += block[i, i, 3 * k + m]


@njit(**KERNEL)
def add_geometric(x, forces, loops, frames, K):  # type: ignore[no-untyped-def]
    """K += sum over the element forces (t, 6 m) of force times second derivatives of its measure by positions."""
    n, own, turns = loops.nodes.shape[1], loops.factors.shape[2], len(loops.turn)
    xe, D, E = np.empty((n, 3)), np.empty((3, n)), np.empty((2, n))
    p, r, y, weights = np.empty(3), np.empty(3), np.empty(3), D[2]
    tau, c, t, d = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    H, G = np.empty((3, 3, 3, 3)), np.empty((2, 2, 3, 3))
    of_face, of_edge = H.reshape((3, 3, 9)), G.reshape((2, 2, 9))
    block, half = np.empty((n, n, 9)), np.empty((3, 9))
    points = loops.turn.shape[1]
    for e in range(len(loops.nodes)):
        _gather(x, loops.nodes[e], xe)
        block[:] = 0.0
        for i in range(n):
            for j in range(i + 1):
                total = 0.0
                for k in range(3 * own):
                    total += forces[e, k] * loops.Q[k, i, j]
                for b in range(3):
                    block[i, j, 4 * b] = total
        for q in range(loops.inside.shape[1]):
            combine(loops.slopes[q, 0], xe, p)
            combine(loops.slopes[q, 1], xe, r)
            for i in range(n):
                D[0, i], D[1, i], D[2, i] = loops.slopes[q, 0, i], loops.slopes[q, 1, i], 0.0
            for j in range(3):
                moment = 0.0
                for k in range(own):
                    moment += forces[e, (3 + j) * own + k] * loops.factors[q, j, k]
                for b in range(3):
                    scale = loops.inside[e, q] * moment * loops.S[j, b]
                    for i in range(n):
                        weights[i] += scale * loops.bend[b, i]
            combine(weights, xe, y)
            curvature_hessian(p, r, y, H)
            _add_form(block, D, of_face, 1.0, half)
        for j in range(3):
            for q in range(points):
                _edge_point(xe, loops, frames, e, j, q, tau, c, t, d)
                edge_angle_hessian(tau, c, t, G)
                force = 0.0
                for k in range(turns):
                    force -= loops.rim[e, j, q] * loops.turn[k, q] * forces[e, (3 + j) * own + k]
                for i in range(n):
                    E[0, i], E[1, i] = loops.along[j, q, i], loops.across[j, q, i]
                _add_form(block, E, of_edge, force, half)
        _add_halves(block, K[e])


@njit(**KERNEL)
def add_material(B, membrane, bending, K):  # type: ignore[no-untyped-def]
    """K += B^T diag(membrane, bending) B with (t, 3 m, 3 m) stiffness of either kind."""
    count, width = membrane.shape[1], K.shape[1]
    CB, half = np.empty((2 * count, width)), np.empty((width, width))
    for e in range(len(B)):
        for k in range(count):
            for j in range(width):
                CB[k, j] = 0.0
                CB[count + k, j] = 0.0
            for m in range(count):
                a, b = membrane[e, k, m], bending[e, k, m]
                for j in range(width):
                    CB[k, j] += a * B[e, m, j]
                    CB[count + k, j] += b * B[e, count + m, j]
        for i in range(width):
            for j in range(i + 1):
                half[i, j] = 0.0
            for k in range(2 * count):
                left = B[e, k, i]
                if left != 0.0:
                    for j in range(i + 1):
                        half[i, j] += left * CB[k, j]
            for j in range(i):
                K[e, i, j] += half[i, j]
                K[e, j, i] += half[i, j]
            K[e, i, i] += half[i, i]
