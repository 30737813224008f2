"""Energy, forces and tangent of bars and hinges in one compiled pass each, into a fixed pattern (`pattern`)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.mechanics.shared.hinge_lock import in_zone, lock
from bh.mechanics.shared.kinematics import INNER_OPTIONS, OPTIONS, add_hinge_hessian, hinge_geometry
from bh.mechanics.shared.sparsity import Pattern as Pattern
from bh.mechanics.shared.sparsity import build_pattern as build_pattern

Array = NDArray[np.float64]


@njit(inline="always", **INNER_OPTIONS)
def elongation(length, rest_length, green):  # type: ignore[no-untyped-def]
    """Elongation l - L (Eq. 3.1), or with Green's strain (l^2 - L^2) / (2 L); both in mm, alike to first order."""
    if green:
        return 0.5 * (length * length - rest_length * rest_length) / rest_length
    return length - rest_length


@njit(**OPTIONS)
def nodal_forces(  # type: ignore[no-untyped-def]
    x, bars, rest_length, k_bar, green, hinges, k_hinge, k_lock, rest, couple, f, s_bar, s_hinge, turns
):
    """Energy (N mm) and the mean size of element forces (N); adds the gradient of the energy to `f` (n, 3).

    Writes the force of each bar, k times its elongation (see `elongation`), and the moment of each hinge,
    k (phi - rest) + couple, with that of its lock of stiffness `k_lock` (see `hinge_lock`), and its turn phi - rest.
    """
    g = np.empty(12)
    energy, size, count = 0.0, 0.0, 0
    for i in range(len(bars)):
        a, b = bars[i, 0], bars[i, 1]
        d0, d1, d2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        length = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        stretch = elongation(length, rest_length[i], green)
        s = k_bar[i] * stretch
        s_bar[i] = s
        energy += 0.5 * s * stretch
        size += s * s
        s /= rest_length[i] if green else length
        f[a, 0] -= s * d0
        f[a, 1] -= s * d1
        f[a, 2] -= s * d2
        f[b, 0] += s * d0
        f[b, 1] += s * d1
        f[b, 2] += s * d2
    count += len(bars)
    for i in range(len(hinges)):
        geometry = hinge_geometry(x, hinges[i, 0], hinges[i, 1], hinges[i, 2], hinges[i, 3], g)
        turn = geometry[0] - rest[i]
        s = k_hinge[i] * turn + couple[i]
        turns[i] = turn
        energy += (0.5 * k_hinge[i] * turn + couple[i]) * turn
        if in_zone(geometry[0]):
            more, moment, _ = lock(geometry[0], k_lock[i])
            energy += more
            s += moment
        s_hinge[i] = s
        size += s * s * (g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
        for p in range(4):
            node = hinges[i, p]
            f[node, 0] += s * g[3 * p]
            f[node, 1] += s * g[3 * p + 1]
            f[node, 2] += s * g[3 * p + 2]
    count += len(hinges)
    return energy, math.sqrt(size / max(count, 1))


@njit(**INNER_OPTIONS)
def rotate(H, nodes, frame_of, frames):  # type: ignore[no-untyped-def]
    """Turn the rows and columns of nodes with local axes; H (3 p, 3 p) with its lower triangle filled."""
    n = 3 * len(nodes)
    any_turned = False
    for p in range(len(nodes)):
        any_turned = any_turned or frame_of[nodes[p]] >= 0
    if not any_turned:
        return
    for i in range(n):
        for j in range(i):
            H[j, i] = H[i, j]
    row = np.empty(3)
    for p in range(len(nodes)):
        frame = frame_of[nodes[p]]
        if frame < 0:
            continue
        for of_columns in range(2):  # rows, then columns
            for j in range(n):
                for i in range(3):
                    value = 0.0
                    for c in range(3):
                        k = 3 * p + c
                        value += frames[frame, i, c] * (H[j, k] if of_columns else H[k, j])
                    row[i] = value
                for i in range(3):
                    if of_columns:
                        H[j, 3 * p + i] = row[i]
                    else:
                        H[3 * p + i, j] = row[i]


@njit(**INNER_OPTIONS)
def add_lower(H, n, slots, data):  # type: ignore[no-untyped-def]
    """Add the lower triangle of an element matrix H (n, n) to the values `data`; see `Pattern.slots`."""
    at = 0
    for i in range(n):
        for j in range(i + 1):
            slot = slots[at]
            if slot >= 0:
                data[slot] += H[i, j]
            elif slot < -1:
                data[-2 - slot] += 2.0 * H[i, j]
            at += 1


@njit(**OPTIONS)
def add_blocks(nodes, blocks, frame_of, frames, slots, data):  # type: ignore[no-untyped-def]
    """Add element matrices (e, n, n) of nodes (e, n / 3) to the values `data`, turned into the axes of supports."""
    for e in range(len(blocks)):
        if len(frames) > 0:
            rotate(blocks[e], nodes[e], frame_of, frames)
        add_lower(blocks[e], blocks.shape[1], slots[e], data)


@njit(**INNER_OPTIONS)
def _bar_matrix(x, a, b, rest_length, k, s, green, H):  # type: ignore[no-untyped-def]
    """Write k g g^T + s Hessian of one bar into the lower half of H (6, 6); returns the gradient g of its elongation.

    With d the unit vector along the bar: g = d and Hessian (1 - d d^T) / l; with Green's strain g = d l / L and 1 / L.
    """
    d0, d1, d2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    length = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    across = s / (rest_length if green else length)
    scale = 1.0 / (rest_length if green else length)
    d = (d0 * scale, d1 * scale, d2 * scale)
    along = k if green else k - across
    for i in range(3):
        for j in range(3):
            value = along * d[i] * d[j]
            if i == j:
                value += across
            H[3 + i, j] = -value
            if j <= i:
                H[i, j] = value
                H[3 + i, 3 + j] = value
    return d


@njit(**OPTIONS)
def tangent_values(  # type: ignore[no-untyped-def]
    x,
    bars,
    rest_length,
    k_bar,
    green,
    s_bar,
    bar_slots,
    hinges,
    k_hinge,
    k_lock,
    s_hinge,
    hinge_slots,
    frame_of,
    frames,
    data,
    d_bar,
    g_hinge,
    k_tangent,
):
    """Add the tangent, k g g^T + s Hessian of every element, to `data`.

    Writes the gradients of all measures, and the stiffness of every hinge with that of its lock to `k_tangent`.
    """
    H, B = np.empty((12, 12)), np.empty((6, 6))  # of which the lower triangles are used
    turned = len(frames) > 0
    for i in range(len(bars)):
        d = _bar_matrix(x, bars[i, 0], bars[i, 1], rest_length[i], k_bar[i], s_bar[i], green, B)
        d_bar[i, 0], d_bar[i, 1], d_bar[i, 2] = d[0], d[1], d[2]
        if turned:
            rotate(B, bars[i], frame_of, frames)
        add_lower(B, np.int64(6), bar_slots[i], data)
    for i in range(len(hinges)):
        g = g_hinge[i]
        geometry = hinge_geometry(x, hinges[i, 0], hinges[i, 1], hinges[i, 2], hinges[i, 3], g)
        k = k_hinge[i]
        if in_zone(geometry[0]):
            k += lock(geometry[0], k_lock[i])[2]
        k_tangent[i] = k
        for p in range(12):
            for q in range(p + 1):
                H[p, q] = k * g[p] * g[q]
        add_hinge_hessian(geometry, s_hinge[i], H)
        if turned:
            rotate(H, hinges[i], frame_of, frames)
        add_lower(H, np.int64(12), hinge_slots[i], data)


@njit(**OPTIONS)
def tangent_times(x, v, bars, rest_length, k_bar, green, s_bar, hinges, k_hinge, k_lock, s_hinge, out):  # type: ignore[no-untyped-def]
    """Add tangent times v (n, 3) to out (n, 3), all in global axes and with no support left out."""
    H, B = np.empty((12, 12)), np.empty((6, 6))  # of which the lower triangles are used
    g = np.empty(12)
    for i in range(len(bars)):
        _bar_matrix(x, bars[i, 0], bars[i, 1], rest_length[i], k_bar[i], s_bar[i], green, B)
        add_product(B, bars[i], v, out)
    for i in range(len(hinges)):
        geometry = hinge_geometry(x, hinges[i, 0], hinges[i, 1], hinges[i, 2], hinges[i, 3], g)
        k = k_hinge[i]
        if in_zone(geometry[0]):
            k += lock(geometry[0], k_lock[i])[2]
        for p in range(12):
            for q in range(p + 1):
                H[p, q] = k * g[p] * g[q]
        add_hinge_hessian(geometry, s_hinge[i], H)
        add_product(H, hinges[i], v, out)


@njit(**INNER_OPTIONS)
def add_product(H, nodes, v, out):  # type: ignore[no-untyped-def]
    """Add a symmetric element matrix, whose lower triangle is in H, times v (n, 3) to out (n, 3)."""
    n = 3 * len(nodes)
    for p in range(n):
        value = 0.0
        for q in range(n):
            value += (H[p, q] if q <= p else H[q, p]) * v[nodes[q // 3], q % 3]
        out[nodes[p // 3], p % 3] += value


@njit(**OPTIONS)
def predicted_forces(bars, k_bar, s_bar, d_bar, hinges, k_tangent, s_hinge, g_hinge, u, out_bar, out_hinge):  # type: ignore[no-untyped-def]
    """Element forces that a tangent predicts for the displacement increment u (n, 3).

    `d_bar`, `g_hinge` and `k_tangent` are what `tangent_values` wrote.
    """
    for i in range(len(bars)):
        a, b = bars[i, 0], bars[i, 1]
        stretch = 0.0
        for c in range(3):
            stretch += d_bar[i, c] * (u[b, c] - u[a, c])
        out_bar[i] = s_bar[i] + k_bar[i] * stretch
    for i in range(len(hinges)):
        turn = 0.0
        for p in range(12):
            turn += g_hinge[i, p] * u[hinges[i, p // 3], p % 3]
        out_hinge[i] = s_hinge[i] + k_tangent[i] * turn
