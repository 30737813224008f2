"""Energy, forces and tangent of bars and hinges in one compiled pass each, into a fixed pattern.

The pattern is found once for a step: every entry of every element matrix knows its slot in the values of the band or
of the sparse matrix, so that assembling is adding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numba import njit
from numpy.typing import NDArray

from bh.mechanics.hinge_lock import in_zone, lock
from bh.mechanics.kinematics import OPTIONS, add_hinge_hessian, hinge_geometry
from bh.solvers.matrices import BandMatrix, SparseMatrix, reverse_cuthill_mckee

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@njit(inline="always", **OPTIONS)
def elongation(length, rest_length, green):  # type: ignore[no-untyped-def]
    """l - L (Eq. 3.1), or with Green's strain (l^2 - L^2) / (2 L); both in mm, alike to first order."""
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
        geometry = hinge_geometry(x, hinges[i], g)
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


@njit(**OPTIONS)
def _rotate(H, nodes, frame_of, frames):  # type: ignore[no-untyped-def]
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
        for j in range(n):
            for i in range(3):
                row[i] = 0.0
                for c in range(3):
                    row[i] += frames[frame, i, c] * H[3 * p + c, j]
            for i in range(3):
                H[3 * p + i, j] = row[i]
        for j in range(n):
            for i in range(3):
                row[i] = 0.0
                for c in range(3):
                    row[i] += frames[frame, i, c] * H[j, 3 * p + c]
            for i in range(3):
                H[j, 3 * p + i] = row[i]


@njit(**OPTIONS)
def _scatter(H, n, slots, data):  # type: ignore[no-untyped-def]
    at = 0
    for i in range(n):
        for j in range(i + 1):
            slot = slots[at]
            if slot >= 0:
                data[slot] += H[i, j]
            at += 1


@njit(**OPTIONS)
def _bar_matrix(x, a, b, rest_length, k, s, green, H):  # type: ignore[no-untyped-def]
    """k g g^T + s Hessian of one bar into the lower triangle of H (6, 6); returns the gradient g of its elongation.

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
    H = np.zeros((12, 12))
    B = np.zeros((6, 6))
    turned = len(frames) > 0
    for i in range(len(bars)):
        d = _bar_matrix(x, bars[i, 0], bars[i, 1], rest_length[i], k_bar[i], s_bar[i], green, B)
        d_bar[i, 0], d_bar[i, 1], d_bar[i, 2] = d[0], d[1], d[2]
        if turned:
            _rotate(B, bars[i], frame_of, frames)
        _scatter(B, 6, bar_slots[i], data)
    for i in range(len(hinges)):
        g = g_hinge[i]
        geometry = hinge_geometry(x, hinges[i], g)
        k = k_hinge[i]
        if in_zone(geometry[0]):
            k += lock(geometry[0], k_lock[i])[2]
        k_tangent[i] = k
        for p in range(12):
            for q in range(p + 1):
                H[p, q] = k * g[p] * g[q]
        add_hinge_hessian(geometry, s_hinge[i], H)
        if turned:
            _rotate(H, hinges[i], frame_of, frames)
        _scatter(H, 12, hinge_slots[i], data)


@njit(**OPTIONS)
def tangent_times(x, v, bars, rest_length, k_bar, green, s_bar, hinges, k_hinge, k_lock, s_hinge, out):  # type: ignore[no-untyped-def]
    """Add tangent times v (n, 3) to out (n, 3), all in global axes and with no support left out."""
    H = np.zeros((12, 12))
    B = np.zeros((6, 6))
    g = np.empty(12)
    for i in range(len(bars)):
        _bar_matrix(x, bars[i, 0], bars[i, 1], rest_length[i], k_bar[i], s_bar[i], green, B)
        _multiply(B, bars[i], v, out)
    for i in range(len(hinges)):
        geometry = hinge_geometry(x, hinges[i], g)
        k = k_hinge[i]
        if in_zone(geometry[0]):
            k += lock(geometry[0], k_lock[i])[2]
        for p in range(12):
            for q in range(p + 1):
                H[p, q] = k * g[p] * g[q]
        add_hinge_hessian(geometry, s_hinge[i], H)
        _multiply(H, hinges[i], v, out)


@njit(**OPTIONS)
def _multiply(H, nodes, v, out):  # type: ignore[no-untyped-def]
    n = 3 * len(nodes)
    for p in range(n):
        value = 0.0
        for q in range(n):
            value += (H[p, q] if q <= p else H[q, p]) * v[nodes[q // 3], q % 3]
        out[nodes[p // 3], p % 3] += value


@njit(**OPTIONS)
def predicted_forces(bars, k_bar, s_bar, d_bar, hinges, k_tangent, s_hinge, g_hinge, u, out_bar, out_hinge):  # type: ignore[no-untyped-def]
    """Element forces that the last tangent predicts for the displacement increment u (n, 3).

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


@njit(**OPTIONS)
def _element_slots(nodes, number, position, stride, slots):  # type: ignore[no-untyped-def]
    """Keys row + stride * column of the lower entries of every element, or -1 where a unknown is prescribed."""
    for e in range(len(nodes)):
        at = 0
        for i in range(3 * nodes.shape[1]):
            a = number[nodes[e, i // 3], i % 3]
            for j in range(i + 1):
                b = number[nodes[e, j // 3], j % 3]
                if a < 0 or b < 0:
                    slots[e, at] = -1
                else:
                    row, column = position[a], position[b]
                    if row < column:
                        row, column = column, row
                    slots[e, at] = row + stride * column
                at += 1


@dataclass(frozen=True)
class Pattern:
    """Where the entries of all elements go.

    Attributes:
        order: (n,) permutation of the unknowns, order[k] is the unknown in row k.
        bandwidth: of the permuted matrix; used if `banded`.
        slots: one (elements, entries) array for each group of elements.
        size: number of values.
    """

    order: Ints
    bandwidth: int
    banded: bool
    slots: tuple[Ints, ...]
    size: int
    indices: Ints
    indptr: Ints
    both: Ints

    def matrix(self, data: Array) -> BandMatrix | SparseMatrix:
        n = len(self.order)
        if self.banded:
            return BandMatrix(data.reshape((self.bandwidth + 1, n), order="F"), self.order)
        csc = sp.csc_matrix((data[self.both], self.indices, self.indptr), shape=(n, n))
        return SparseMatrix(csc, self.order)


def band_is_cheaper(n: int, bandwidth: int) -> bool:
    """Choice between LAPACK's band and SuperLU by their measured costs, unless the band would not fit into memory.

    Seconds on the developers' machine: 2.6e-11 n (b + 1)^2 for the band, 1.5e-7 n^1.45 for SuperLU with its inertia
    (docs/decisions.md has the table).
    """
    fits = 8 * n * (bandwidth + 1) < 2e9
    return fits and 2.6e-11 * n * (bandwidth + 1.0) ** 2 < 1.5e-7 * n**1.45


def build_pattern(number: Ints, groups: tuple[Ints, ...]) -> Pattern:
    """Pattern of element groups, each (elements, nodes); `number` (n, 3) numbers the unknowns, -1 if prescribed."""
    n = int(number.max(initial=-1)) + 1
    rows, columns = _node_pairs(groups)
    # block pattern of nodes; unknowns of a node stay together
    nodes = len(number)
    order_nodes, _ = reverse_cuthill_mckee(rows, columns, nodes)
    order = number[order_nodes].ravel()
    order = order[order >= 0]
    position = np.empty(n, dtype=np.int64)
    position[order] = np.arange(n)
    keys: list[Ints] = []
    for group in groups:
        width = 3 * group.shape[1]
        slots = np.empty((len(group), width * (width + 1) // 2), dtype=np.int64)
        _element_slots(group, number, position, n, slots)
        keys.append(slots)
    every = np.concatenate([k.ravel() for k in keys]) if keys else np.zeros(0, dtype=np.int64)
    every = every[every >= 0]
    bandwidth = int((every % n - every // n).max(initial=0)) if n else 0
    if band_is_cheaper(n, bandwidth):
        slots_band = tuple(np.where(k >= 0, (k % n - k // n) + (k // n) * (bandwidth + 1), -1) for k in keys)
        empty = np.zeros(0, dtype=np.int64)
        return Pattern(order, bandwidth, True, slots_band, (bandwidth + 1) * n, empty, empty, empty)
    return _sparse_pattern(n, order, position, every, keys, bandwidth)


def _sparse_pattern(
    n: int, order: Ints, position: Ints, every: Ints, keys: list[Ints], bandwidth: int
) -> Pattern:
    """Compressed lower values and the map to both triangles, in SuperLU's minimum-degree order."""
    from scipy.sparse.linalg import splu

    unique = np.unique(every)
    row, column = unique % n, unique // n
    # fill-reducing order once: factorise a diagonally dominant matrix of this pattern
    probe = sp.csc_matrix((np.full(len(unique), -1e-3), (row, column)), shape=(n, n))
    probe = sp.csc_matrix(probe + probe.T + 2.0 * n * sp.eye_array(n))
    permutation = splu(
        probe,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True, "Equil": False},
    ).perm_c.astype(np.int64)
    # perm_c[old] = new
    new_row, new_column = permutation[row], permutation[column]
    new_order = np.empty(n, dtype=np.int64)
    new_order[permutation] = order
    low, high = np.maximum(new_row, new_column), np.minimum(new_row, new_column)
    size = len(unique)
    off = np.flatnonzero(low != high)
    all_rows = np.concatenate((low, high[off]))
    all_columns = np.concatenate((high, low[off]))
    source = np.concatenate((np.arange(size), off))
    sorting = np.lexsort((all_rows, all_columns))
    indptr = np.concatenate(([0], np.cumsum(np.bincount(all_columns, minlength=n))))
    slots = tuple(np.where(k >= 0, np.searchsorted(unique, np.maximum(k, 0)), -1) for k in keys)
    return Pattern(
        new_order, bandwidth, False, slots, size,
        all_rows[sorting].astype(np.int32), indptr.astype(np.int32), source[sorting],
    )  # fmt: skip


def _node_pairs(groups: tuple[Ints, ...]) -> tuple[Ints, Ints]:
    rows: list[Any] = []
    columns: list[Any] = []
    for group in groups:
        for i in range(group.shape[1]):
            for j in range(i):
                rows.append(group[:, i])
                columns.append(group[:, j])
    return np.concatenate(rows), np.concatenate(columns)
