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

from bh.runtime.kernel_options import INNER

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


@njit(**INNER)
def edge_rise(tau, c, t0, d0):  # type: ignore[no-untyped-def]
    """Angle theta of one edge point alone; in scalars, since an array that is made here costs more than the angle."""
    N0 = tau[1] * c[2] - tau[2] * c[1]
    N1 = tau[2] * c[0] - tau[0] * c[2]
    N2 = tau[0] * c[1] - tau[1] * c[0]
    length = math.sqrt(dot(tau, tau))
    k = dot(d0, tau) / (length + dot(t0, tau))
    x = d0[0] - k * (t0[0] + tau[0] / length)
    y = d0[1] - k * (t0[1] + tau[1] / length)
    z = d0[2] - k * (t0[2] + tau[2] / length)
    m0, m1, m2 = tau[1] * N2 - tau[2] * N1, tau[2] * N0 - tau[0] * N2, tau[0] * N1 - tau[1] * N0
    return math.atan2((x * m0 + y * m1 + z * m2) / length, x * N0 + y * N1 + z * N2)


@njit(**INNER)
def edge_slopes(tau, c, t0, g):  # type: ignore[no-untyped-def]
    """Write d theta / d tau and d theta / d c of one edge point into the rows of `g` (2, 3)."""
    N0 = tau[1] * c[2] - tau[2] * c[1]
    N1 = tau[2] * c[0] - tau[0] * c[2]
    N2 = tau[0] * c[1] - tau[1] * c[0]
    length = math.sqrt(dot(tau, tau))
    NN = N0 * N0 + N1 * N1 + N2 * N2
    spin = 1.0 / (length * (length + dot(t0, tau)))
    lean, fall = dot(c, tau) / (length * NN), -length / NN
    g[0, 0] = lean * N0 + spin * (tau[1] * t0[2] - tau[2] * t0[1])
    g[0, 1] = lean * N1 + spin * (tau[2] * t0[0] - tau[0] * t0[2])
    g[0, 2] = lean * N2 + spin * (tau[0] * t0[1] - tau[1] * t0[0])
    g[1, 0], g[1, 1], g[1, 2] = fall * N0, fall * N1, fall * N2


@njit(**INNER)
def edge_angle(tau, c, t0, d0, g):  # type: ignore[no-untyped-def]
    """Angle theta of one edge point; writes d theta / d tau and d theta / d c into the rows of `g` (2, 3)."""
    edge_slopes(tau, c, t0, g)
    return edge_rise(tau, c, t0, d0)


@njit(**INNER)
def edge_angle_hessian(tau, c, t0, H):  # type: ignore[no-untyped-def]
    """Second derivatives of theta with respect to (tau, c) into H (2, 2, 3, 3)."""
    room = np.empty((5, 3))  # made at once: it costs as much as the arithmetic
    N, hol, W = room[0], room[1], room[2:5]
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


@njit(**INNER)
def curvature_hessian(p, r, y, H):  # type: ignore[no-untyped-def]
    """Second derivatives of nu . y with respect to (p, r, y) into H (3, 3, 3, 3), y linear."""
    room = np.empty((12, 3))
    N, nu, Py, P, A, half = room[0], room[1], room[2], room[3:6], room[6:9], room[9:12]
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
