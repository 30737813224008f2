"""What an element of the shell measures, with first and second derivatives. Compiled, one pass over all elements.

Two kinds of point functions of the deformed position x(xi):

curvature inside, with tangents p = x_,1 and r = x_,2, N = p x r, nu = N / |N|: kappa_ab = nu . x_,ab;

angle on an edge, with the tangent tau along the edge (counter-clockwise), c = derivative of x toward the opposite
corner, N = tau x c, t = tau / |tau|: theta is the angle by which the outward conormal t x nu rises above the plane
normal to the edge's frame vector d,

    theta = atan2(d . (t x nu), d . nu),   d = d0 - (d0 . t) / (1 + t0 . t) (t0 + t),

where (t0, d0) are unit tangent and frame at the start of the step and d is d0 carried by the smallest rotation that
takes t0 to t (parallel transport, as of a Bishop frame; Bergou et al. 2008). Its derivatives need no d at all:

    d theta / d c   = -|tau| N / |N|^2
    d theta / d tau = (c . t) N / |N|^2 - (t0 x tau) / (|tau|^2 + |tau| t0 . tau)

the last term being the holonomy of the transport (the rate of area swept on the sphere of tangents).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.runtime.kernel_options import INNER, KERNEL

Array = NDArray[np.float64]


@njit(**INNER)
def cross(a, b, out):  # type: ignore[no-untyped-def]
    """Write the cross product a x b of two vectors (3,) into `out`."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(**INNER)
def dot(a, b):  # type: ignore[no-untyped-def]
    """Scalar product a . b of two vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(**INNER)
def combine(weights, x, out):  # type: ignore[no-untyped-def]
    """Write sum_i weights[i] x[i] into `out` (3,); weights (n,), x (n, 3)."""
    for c in range(3):
        total = 0.0
        for i in range(len(x)):
            total += weights[i] * x[i, c]
        out[c] = total


@njit(**INNER)
def skew_times(v, A, sign, out):  # type: ignore[no-untyped-def]
    """Write sign A [v]x into `out`, with ([v]x w) = v x w, so that row i of it is sign (row i of A) x v."""
    for i in range(3):
        out[i, 0] = sign * (A[i, 1] * v[2] - A[i, 2] * v[1])
        out[i, 1] = sign * (A[i, 2] * v[0] - A[i, 0] * v[2])
        out[i, 2] = sign * (A[i, 0] * v[1] - A[i, 1] * v[0])


@njit(**KERNEL)
def edge_angle(tau, c, t0, d0, g):  # type: ignore[no-untyped-def]
    """Angle theta of one edge point; writes d theta / d tau and d theta / d c into the rows of `g` (2, 3)."""
    N, d, m = np.empty(3), np.empty(3), np.empty(3)
    cross(tau, c, N)
    length = math.sqrt(dot(tau, tau))
    NN = dot(N, N)
    along = dot(t0, tau)
    k = dot(d0, tau) / (length + along)
    for i in range(3):
        d[i] = d0[i] - k * (t0[i] + tau[i] / length)
    cross(tau, N, m)
    theta = math.atan2(dot(d, m) / length, dot(d, N))
    cross(tau, t0, d)
    spin = 1.0 / (length * (length + along))
    lean = dot(c, tau) / (length * NN)
    for i in range(3):
        g[0, i] = lean * N[i] + spin * d[i]
        g[1, i] = -length / NN * N[i]
    return theta


@njit(**KERNEL)
def edge_angle_hessian(tau, c, t0, H):  # type: ignore[no-untyped-def]
    """Second derivatives of theta with respect to (tau, c) into H (2, 2, 3, 3)."""
    N, hol = np.empty(3), np.empty(3)
    W = np.empty((3, 3))
    cross(tau, c, N)
    NN = dot(N, N)
    length = math.sqrt(dot(tau, tau))
    lean = dot(c, tau) / length
    for i in range(3):
        for j in range(3):
            W[i, j] = -2.0 * N[i] * N[j] / (NN * NN)
        W[i, i] += 1.0 / NN
    # N depends on c by [tau]x and on tau by -[c]x; W = d (N / |N|^2) / d N
    skew_times(tau, W, -length, H[1, 1])
    skew_times(c, W, length, H[1, 0])
    skew_times(c, W, -lean, H[0, 0])
    for i in range(3):
        for j in range(3):
            H[1, 0, i, j] -= N[i] * tau[j] / (NN * length)
            H[0, 0, i, j] += N[i] * (c[j] - lean * tau[j] / length) / (NN * length)
    along = dot(t0, tau)
    spin = 1.0 / (length * (length + along))
    cross(tau, t0, hol)
    for j in range(3):
        rate = -spin * spin * (2.0 * tau[j] + along * tau[j] / length + length * t0[j])
        for i in range(3):
            H[0, 0, i, j] += hol[i] * rate
    H[0, 0, 0, 1] += spin * t0[2]  # the derivative of tau x t0 is -[t0]x
    H[0, 0, 0, 2] -= spin * t0[1]
    H[0, 0, 1, 0] -= spin * t0[2]
    H[0, 0, 1, 2] += spin * t0[0]
    H[0, 0, 2, 0] += spin * t0[1]
    H[0, 0, 2, 1] -= spin * t0[0]
    for i in range(3):  # exact up to rounding: symmetric diagonal blocks, transposed off-diagonal ones
        for j in range(i):
            for b in range(2):
                mean = 0.5 * (H[b, b, i, j] + H[b, b, j, i])
                H[b, b, i, j] = mean
                H[b, b, j, i] = mean
    for i in range(3):
        for j in range(3):
            H[0, 1, j, i] = H[1, 0, i, j]


@njit(**KERNEL)
def curvature_hessian(p, r, y, H):  # type: ignore[no-untyped-def]
    """Second derivatives of nu . y with respect to (p, r, y) into H (3, 3, 3, 3), y linear."""
    N, nu, Py = np.empty(3), np.empty(3), np.empty(3)
    P, A = np.empty((3, 3)), np.empty((3, 3))
    cross(p, r, N)
    size = math.sqrt(dot(N, N))
    for i in range(3):
        nu[i] = N[i] / size
    lift = dot(nu, y)
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
        skew_times(left, A, sign, half)
        for other in range(2):
            right, turn = (r, -1.0) if other == 0 else (p, 1.0)
            skew_times(right, half.T, turn, H[b, other])
        skew_times(left, P, sign, H[2, b])
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
