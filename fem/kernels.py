"""What an element of the shell measures, with first and second derivatives. Compiled, one pass over all elements.

Two kinds of point functions of the deformed position x(xi):

curvature inside, with tangents p = x_,1 and r = x_,2, N = p x r, nu = N / |N|: kappa_ab = nu . x_,ab;

angle on an edge, with the tangent tau along the edge (counter-clockwise), c = derivative of x toward the opposite corner,
N = tau x c, t = tau / |tau|: theta is the angle by which the outward conormal t x nu rises above the plane normal to the
edge's frame vector d,

    theta = atan2(d . (t x nu), d . nu),   d = d0 - (d0 . t) / (1 + t0 . t) (t0 + t),

where (t0, d0) are unit tangent and frame at the start of the step and d is d0 carried by the smallest rotation that takes t0
to t (parallel transport, as of a Bishop frame; Bergou et al. 2008). Its derivatives need no d at all:

    d theta / d c   = -|tau| N / |N|^2
    d theta / d tau = (c . t) N / |N|^2 - (t0 x tau) / (|tau|^2 + |tau| t0 . tau)

the last term being the holonomy of the transport (the rate of area swept on the sphere of tangents).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(inline="always", **OPTIONS)
def _cross(a, b, out):  # type: ignore[no-untyped-def]
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(inline="always", **OPTIONS)
def _dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(inline="always", **OPTIONS)
def _combine(weights, x, out):  # type: ignore[no-untyped-def]
    """out = sum_i weights[i] x[i]."""
    for c in range(3):
        total = 0.0
        for i in range(6):
            total += weights[i] * x[i, c]
        out[c] = total


@njit(inline="always", **OPTIONS)
def _skew_times(v, A, sign, out):  # type: ignore[no-untyped-def]
    """out = sign A [v]x with ([v]x w) = v x w, so that row i of out is sign (row i of A) x v."""
    for i in range(3):
        out[i, 0] = sign * (A[i, 1] * v[2] - A[i, 2] * v[1])
        out[i, 1] = sign * (A[i, 2] * v[0] - A[i, 0] * v[2])
        out[i, 2] = sign * (A[i, 0] * v[1] - A[i, 1] * v[0])


@njit(**OPTIONS)
def edge_angle(tau, c, t0, d0, g):  # type: ignore[no-untyped-def]
    """Angle theta of one edge point; writes d theta / d tau and d theta / d c into the rows of `g` (2, 3)."""
    N, d, m = np.empty(3), np.empty(3), np.empty(3)
    _cross(tau, c, N)
    length = math.sqrt(_dot(tau, tau))
    NN = _dot(N, N)
    along = _dot(t0, tau)
    k = _dot(d0, tau) / (length + along)
    for i in range(3):
        d[i] = d0[i] - k * (t0[i] + tau[i] / length)
    _cross(tau, N, m)
    theta = math.atan2(_dot(d, m) / length, _dot(d, N))
    _cross(tau, t0, d)
    spin = 1.0 / (length * (length + along))
    lean = _dot(c, tau) / (length * NN)
    for i in range(3):
        g[0, i] = lean * N[i] + spin * d[i]
        g[1, i] = -length / NN * N[i]
    return theta


@njit(**OPTIONS)
def edge_angle_hessian(tau, c, t0, H):  # type: ignore[no-untyped-def]
    """Second derivatives of theta with respect to (tau, c) into H (2, 2, 3, 3)."""
    N, hol = np.empty(3), np.empty(3)
    W, X = np.empty((3, 3)), np.empty((3, 3))
    _cross(tau, c, N)
    NN = _dot(N, N)
    length = math.sqrt(_dot(tau, tau))
    lean = _dot(c, tau) / length
    for i in range(3):
        for j in range(3):
            W[i, j] = -2.0 * N[i] * N[j] / (NN * NN)
        W[i, i] += 1.0 / NN
    # N depends on c by [tau]x and on tau by -[c]x; W = d (N / |N|^2) / d N
    _skew_times(tau, W, -length, H[1, 1])
    _skew_times(c, W, length, H[1, 0])
    _skew_times(c, W, -lean, H[0, 0])
    for i in range(3):
        for j in range(3):
            H[1, 0, i, j] -= N[i] * tau[j] / (NN * length)
            H[0, 0, i, j] += N[i] * (c[j] - lean * tau[j] / length) / (NN * length)
    along = _dot(t0, tau)
    spin = 1.0 / (length * (length + along))
    _cross(tau, t0, hol)
    for j in range(3):
        rate = -spin * spin * (2.0 * tau[j] + along * tau[j] / length + length * t0[j])
        for i in range(3):
            H[0, 0, i, j] += hol[i] * rate
    for i in range(3):
        for j in range(3):
            X[i, j] = 0.0
        X[i, i] = spin
    _skew_times(t0, X, -1.0, W)
    for i in range(3):
        for j in range(3):
            H[0, 0, i, j] += W[i, j]
    for i in range(3):  # exact up to rounding: symmetric diagonal blocks, transposed off-diagonal ones
        for j in range(i):
            for b in range(2):
                mean = 0.5 * (H[b, b, i, j] + H[b, b, j, i])
                H[b, b, i, j] = mean
                H[b, b, j, i] = mean
    for i in range(3):
        for j in range(3):
            H[0, 1, j, i] = H[1, 0, i, j]


@njit(**OPTIONS)
def _gather(x, nodes, out):  # type: ignore[no-untyped-def]
    """Positions of an element relative to its first node, which keeps rounding off large coordinates."""
    for i in range(6):
        for c in range(3):
            out[i, c] = x[nodes[i], c] - x[nodes[0], c]


@njit(inline="always", **OPTIONS)
def _edge_point(xe, along, across, t0, d0, sign, tau, c, t, d):  # type: ignore[no-untyped-def]
    """Tangent, transversal and the frame of an edge point as this side of the edge sees them."""
    _combine(along, xe, tau)
    _combine(across, xe, c)
    for i in range(3):
        t[i] = sign * t0[i]
        d[i] = d0[i]


@njit(**OPTIONS)
def measures(x, gamma, nodes, edges, sides, t0, d0, Q, bary, slopes, bend, S, along, across, s,
             inside, rim, strain, curvature):  # type: ignore[no-untyped-def]  # fmt: skip
    """Generalised strains (t, 9) and curvatures (t, 9) of all elements; see `fem.shell` for the arguments."""
    xe, dot = np.empty((6, 3)), np.empty((6, 6))
    p, r, N, second = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    tau, c, t, d, g = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty((2, 3))
    points = len(s)
    for e in range(len(nodes)):
        _gather(x, nodes[e], xe)
        for i in range(6):
            for j in range(6):
                dot[i, j] = _dot(xe[i], xe[j])
        for k in range(9):
            total = 0.0
            for i in range(6):
                for j in range(6):
                    total += Q[k, i, j] * dot[i, j]
            strain[e, k] = 0.5 * total
            curvature[e, k] = 0.0
        for b in range(3):
            _combine(bend[:, b], xe, second[b])
        for q in range(len(bary)):
            _combine(slopes[q, :, 0], xe, p)
            _combine(slopes[q, :, 1], xe, r)
            _cross(p, r, N)
            scale = inside[e, q] / math.sqrt(_dot(N, N))
            for j in range(3):
                bent = 0.0
                for b in range(3):
                    bent += S[j, b] * _dot(N, second[b])
                for k in range(3):
                    curvature[e, 3 * j + k] += scale * bent * bary[q, (j + 1 + k) % 3]
        for j in range(3):
            sign = sides[e, j]
            for q in range(points):
                at = q if sign > 0 else points - 1 - q
                _edge_point(xe, along[j, q], across[j, q], t0[edges[e, j], at], d0[edges[e, j], at], sign, tau, c, t, d)
                turn = edge_angle(tau, c, t, d, g) - (1.0 - s[q]) * gamma[e, j, 0] - s[q] * gamma[e, j, 1]
                curvature[e, 3 * j] -= rim[e, j, q] * (1.0 - s[q]) * turn
                curvature[e, 3 * j + 1] -= rim[e, j, q] * s[q] * turn


@njit(**OPTIONS)
def gradients(x, nodes, edges, sides, t0, d0, Q, bary, slopes, bend, S, along, across, s,
              inside, rim, B):  # type: ignore[no-untyped-def]  # fmt: skip
    """B (t, 18, 24): derivatives of strains, then curvatures, by 18 positions and 6 side rotations gamma."""
    xe = np.empty((6, 3))
    p, r, N, second = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    tau, c, t, d, g = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty((2, 3))
    by_p, by_r, y, rate = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 18))
    points = len(s)
    for e in range(len(nodes)):
        B[e] = 0.0
        _gather(x, nodes[e], xe)
        for k in range(9):
            for i in range(6):
                for j in range(6):
                    for b in range(3):
                        B[e, k, 3 * i + b] += Q[k, i, j] * xe[j, b]
        for b in range(3):
            _combine(bend[:, b], xe, second[b])
        for q in range(len(bary)):
            _combine(slopes[q, :, 0], xe, p)
            _combine(slopes[q, :, 1], xe, r)
            _cross(p, r, N)
            size = math.sqrt(_dot(N, N))
            for b in range(3):
                lift = _dot(N, second[b]) / (size * size)
                for i in range(3):
                    y[i] = (second[b, i] - lift * N[i]) / size
                _cross(r, y, by_p)  # y . (dp x r) = dp . (r x y)
                _cross(y, p, by_r)
                for i in range(6):
                    for k in range(3):
                        rate[b, 3 * i + k] = inside[e, q] * (
                            bend[i, b] * N[k] / size + slopes[q, i, 0] * by_p[k] + slopes[q, i, 1] * by_r[k]
                        )
            for j in range(3):
                for i in range(18):
                    value = S[j, 0] * rate[0, i] + S[j, 1] * rate[1, i] + S[j, 2] * rate[2, i]
                    for k in range(3):
                        B[e, 9 + 3 * j + k, i] += bary[q, (j + 1 + k) % 3] * value
        for j in range(3):
            sign = sides[e, j]
            for q in range(points):
                at = q if sign > 0 else points - 1 - q
                _edge_point(xe, along[j, q], across[j, q], t0[edges[e, j], at], d0[edges[e, j], at], sign, tau, c, t, d)
                edge_angle(tau, c, t, d, g)
                for k in range(2):
                    part = rim[e, j, q] * (s[q] if k else 1.0 - s[q])
                    for i in range(6):
                        for b in range(3):
                            B[e, 9 + 3 * j + k, 3 * i + b] -= part * (
                                along[j, q, i] * g[0, b] + across[j, q, i] * g[1, b]
                            )
                    B[e, 9 + 3 * j + k, 18 + 2 * j] += part * (1.0 - s[q])
                    B[e, 9 + 3 * j + k, 19 + 2 * j] += part * s[q]


@njit(**OPTIONS)
def _curvature_hessian(p, r, y, H):  # type: ignore[no-untyped-def]
    """Second derivatives of nu . y with respect to (p, r, y) into H (3, 3, 3, 3), y linear."""
    N, nu, Py = np.empty(3), np.empty(3), np.empty(3)
    P, A = np.empty((3, 3)), np.empty((3, 3))
    _cross(p, r, N)
    size = math.sqrt(_dot(N, N))
    for i in range(3):
        nu[i] = N[i] / size
    lift = _dot(nu, y)
    for i in range(3):
        Py[i] = y[i] - lift * nu[i]
        for j in range(3):
            P[i, j] = (1.0 if i == j else 0.0) - nu[i] * nu[j]
    for i in range(3):
        for j in range(3):
            A[i, j] = -(nu[i] * Py[j] + Py[i] * nu[j] + lift * P[i, j]) / (size * size)
            P[i, j] /= size
    # dN = [p]x dr - [r]x dp; B^T A B with B one of the skew matrices, [v]x^T = -[v]x
    half = np.empty((3, 3))
    for b in range(2):
        left, sign = (r, -1.0) if b == 0 else (p, 1.0)
        # half = B_b^T A, row by row the transposed of A B_b (A symmetric)
        _skew_times(left, A, sign, half)
        for other in range(2):
            right, turn = (r, -1.0) if other == 0 else (p, 1.0)
            _skew_times(right, half.T, turn, H[b, other])
        _skew_times(left, P, sign, H[2, b])
        for i in range(3):
            for j in range(3):
                H[b, 2, i, j] = H[2, b, j, i]
    for i in range(3):
        for j in range(3):
            H[2, 2, i, j] = 0.0
        Py[i] /= size
    # g . (dp x dr) = dp . (dr x g) = -dp . [g]x dr
    H[0, 1, 0, 1] += Py[2]
    H[0, 1, 0, 2] -= Py[1]
    H[0, 1, 1, 0] -= Py[2]
    H[0, 1, 1, 2] += Py[0]
    H[0, 1, 2, 0] += Py[1]
    H[0, 1, 2, 1] -= Py[0]
    for i in range(3):
        for j in range(3):
            H[1, 0, i, j] = H[0, 1, j, i]


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
def add_geometric(x, forces, nodes, edges, sides, t0, d0, Q, bary, slopes, bend, S, along, across, s,
                  inside, rim, K):  # type: ignore[no-untyped-def]  # fmt: skip
    """K (t, 24, 24) += sum over the 18 element forces (t, 18) of force times second derivatives of its measure."""
    xe = np.empty((6, 3))
    p, r, y, weights = np.empty(3), np.empty(3), np.empty(3), np.empty(6)
    tau, c, t, d = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    H, G, T = np.empty((3, 3, 3, 3)), np.empty((2, 2, 3, 3)), np.empty((3, 3))
    block = np.empty((18, 18))
    points = len(s)
    for e in range(len(nodes)):
        _gather(x, nodes[e], xe)
        block[:] = 0.0
        for i in range(6):
            for j in range(6):
                total = 0.0
                for k in range(9):
                    total += forces[e, k] * Q[k, i, j]
                for b in range(3):
                    block[3 * i + b, 3 * j + b] += total
        for q in range(len(bary)):
            _combine(slopes[q, :, 0], xe, p)
            _combine(slopes[q, :, 1], xe, r)
            for i in range(6):
                weights[i] = 0.0
            for j in range(3):
                moment = 0.0
                for k in range(3):
                    moment += forces[e, 9 + 3 * j + k] * bary[q, (j + 1 + k) % 3]
                for b in range(3):
                    for i in range(6):
                        weights[i] += inside[e, q] * moment * S[j, b] * bend[i, b]
            _combine(weights, xe, y)
            _curvature_hessian(p, r, y, H)
            first, second = slopes[q, :, 0], slopes[q, :, 1]
            _add_block(block, first, first, H[0, 0], False)
            _add_block(block, second, second, H[1, 1], False)
            _add_block(block, first, second, H[0, 1], True)
            _add_block(block, first, weights, H[0, 2], True)
            _add_block(block, second, weights, H[1, 2], True)
        for j in range(3):
            sign = sides[e, j]
            for q in range(points):
                at = q if sign > 0 else points - 1 - q
                _edge_point(xe, along[j, q], across[j, q], t0[edges[e, j], at], d0[edges[e, j], at], sign, tau, c, t, d)
                edge_angle_hessian(tau, c, t, G)
                force = -rim[e, j, q] * ((1.0 - s[q]) * forces[e, 9 + 3 * j] + s[q] * forces[e, 10 + 3 * j])
                for a in range(2):
                    for b in range(a, 2):
                        for i in range(3):
                            for k in range(3):
                                T[i, k] = force * G[a, b, i, k]
                        left = along[j, q] if a == 0 else across[j, q]
                        right = along[j, q] if b == 0 else across[j, q]
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
