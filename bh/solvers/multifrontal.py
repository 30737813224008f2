"""Sparse L D L^T by the multifrontal method (Duff and Reid 1983; Liu 1992) on the tree of a nested dissection.

A front is a dense symmetric matrix: first the unknowns that it eliminates, then those of its ancestors that they touch
(its border). It gathers the entries of its own columns and the updates of its children, eliminates by blocks (level-3
BLAS), and hands what is left of the border to its parent. Pivots are 1 x 1 and stay on the diagonal, so their signs are
the inertia (Sylvester) and the pattern never changes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.runtime.kernel_options import INNER, KERNEL
from bh.solvers.blas import (
    add_times,
    addresses,
    constants,
    solve_lower,
    solve_right,
    solve_upper,
    subtract_product,
    subtract_transpose_times,
)
from bh.solvers.dissection import Dissection

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Index = NDArray[np.int32]
BLOCK = 32  # columns eliminated at once
STRIP = 128  # columns of an update made by one product: below the diagonal it makes little that is not needed


@dataclass(frozen=True)
class Fronts:
    """What the pattern alone decides about a factorisation.

    Attributes:
        start: (f + 1,) front k eliminates the unknowns start[k] to start[k + 1] of the order.
        border_start: (f + 1,) bounds of the border of front k in `border` and `to_parent`.
        border: unknowns (places in the order) of the borders, ascending.
        to_parent: their rows in the parent's front.
        panel: (f + 1,) where the columns of front k begin in the factor, rows first.
        children: (f,) number of children.
        entries: place in the factor of every value of the lower triangle.
        updates: (f,) where the update of every front is kept while its parent waits for it.
        stack: most values that updates take at a time.
    """

    start: Ints
    border_start: Ints
    border: NDArray[np.int32]
    to_parent: NDArray[np.int32]
    panel: Ints
    children: Ints
    entries: Ints
    updates: Ints
    stack: int

    @property
    def rows(self) -> Ints:
        """(f,) size of every front."""
        return np.diff(self.start) + np.diff(self.border_start)

    @property
    def operations(self) -> float:
        """Multiplications of one factorisation."""
        columns, rows = np.diff(self.start).astype(float), self.rows.astype(float)
        border = rows - columns
        return float((columns * border**2 / 2 + columns**2 * border / 2 + columns**3 / 6).sum())


def fronts(tree: Dissection, indptr: Ints, indices: Ints, first: Ints, lower: tuple[Index, Index]) -> Fronts:
    """Symbolic factorisation.

    Args:
        tree: dissection of the graph; its vertices are nodes with a few unknowns each.
        indptr: (v + 1,) where the neighbours of every node begin.
        indices: neighbours of all nodes.
        first: (v + 1,) first unknown (place in the order) of the node at every place of the order.
        lower: (indptr, indices) of the lower triangle in compressed columns, in the order.
    """
    place = np.empty(len(tree.order), dtype=np.int64)
    place[tree.order] = np.arange(len(tree.order))
    count = len(tree.parent)
    border_start = np.zeros(count + 1, dtype=np.int64)
    unseen, none = np.full(len(place), -1, dtype=np.int64), np.full((2, count), -1, dtype=np.int64)
    nodes = _borders(
        tree.order, place, tree.start, tree.parent, indptr, indices, border_start, unseen, none[0], none[1]
    )
    nodes = nodes[: border_start[-1]]
    sizes = np.diff(first)[nodes]
    bounds = np.concatenate(([0], np.cumsum(sizes)))
    border = (np.repeat(first[nodes] - bounds[:-1], sizes) + np.arange(bounds[-1])).astype(np.int32)
    border_start = bounds[border_start]
    start = first[tree.start]
    columns = np.diff(start)
    panel = np.concatenate(([0], np.cumsum(columns * (columns + np.diff(border_start)))))
    to_parent = np.zeros(len(border), dtype=np.int32)
    _rows_in_parent(start, border_start, border, tree.parent, to_parent)
    children = np.bincount(tree.parent[tree.parent >= 0], minlength=len(tree.parent))
    entries = _entry_places(lower[0], lower[1], start, border_start, border, panel)
    updates = np.zeros(count, dtype=np.int64)
    room = _update_places(
        np.diff(border_start),
        tree.parent,
        updates,
        np.zeros((2, count), dtype=np.int64),
        np.zeros((2, 2), np.int64),
    )
    return Fronts(start, border_start, border, to_parent, panel, children, entries, updates, int(room))


@njit(**KERNEL)
def _borders(order, place, start, parent, indptr, indices, bounds, seen, head, following):  # type: ignore[no-untyped-def]
    """Places of the nodes in the border of every front: neighbours and children's borders that come later.

    Writes their `bounds` (f + 1,), which are zero on entry; `seen` (v,), `head` and `following` (f,) are -1.
    """
    found = np.empty(16 * len(order) + 16, dtype=np.int64)
    for k in range(len(parent)):
        at = begin = bounds[k]
        end = start[k + 1]
        room = len(order) - end
        if at + room > len(found):
            larger = np.empty(2 * len(found) + room, dtype=np.int64)
            for i in range(at):
                larger[i] = found[i]
            found = larger
        for p in range(start[k], end):
            v = order[p]
            for e in range(indptr[v], indptr[v + 1]):
                w = place[indices[e]]
                if w >= end and seen[w] != k:
                    seen[w] = k
                    found[at] = w
                    at += 1
        child = head[k]
        while child >= 0:
            for e in range(bounds[child], bounds[child + 1]):
                w = found[e]
                if w >= end and seen[w] != k:
                    seen[w] = k
                    found[at] = w
                    at += 1
            child = following[child]
        _sort(found, begin, at)
        bounds[k + 1] = at
        if parent[k] >= 0:
            following[k] = head[parent[k]]
            head[parent[k]] = k
    return found


@njit(**INNER)
def _sort(values, begin, end):  # type: ignore[no-untyped-def]
    """Sort values[begin:end], whole numbers, in place (Shell 1959); numba's own sort takes long to compile."""
    gap = 1
    while gap < (end - begin) // 9:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(begin + gap, end):
            value, at = values[i], i
            while at >= begin + gap and values[at - gap] > value:
                values[at] = values[at - gap]
                at -= gap
            values[at] = value
        gap //= 3


@njit(**KERNEL)
def _rows_in_parent(start, border_start, border, parent, rows):  # type: ignore[no-untyped-def]
    for k in range(len(parent)):
        up = parent[k]
        if up < 0:
            continue
        own_end = start[up + 1]
        at = border_start[up]
        for e in range(border_start[k], border_start[k + 1]):
            if border[e] < own_end:
                rows[e] = border[e] - start[up]
            else:
                while border[at] != border[e]:
                    at += 1
                rows[e] = own_end - start[up] + at - border_start[up]


@njit(**KERNEL)
def _entry_places(indptr, indices, start, border_start, border, panel):  # type: ignore[no-untyped-def]
    places = np.empty(len(indices), dtype=np.int64)
    for k in range(len(start) - 1):
        columns, own_end = start[k + 1] - start[k], start[k + 1]
        rows = columns + border_start[k + 1] - border_start[k]
        for c in range(start[k], own_end):
            at = border_start[k]
            column = panel[k] + (c - start[k]) * rows
            for e in range(indptr[c], indptr[c + 1]):
                r = indices[e]
                if r < own_end:
                    places[e] = column + r - start[k]
                else:
                    while border[at] != r:
                        at += 1
                    places[e] = column + columns + at - border_start[k]
    return places


@njit(**KERNEL)
def _update_places(borders, parent, places, room, sizes):  # type: ignore[no-untyped-def]
    """Write to `places` (f,) where the update of every front is kept; returns how much room all of them need.

    `room` (2, f) and `sizes` (2, 2), zero on entry, hold what is needed on the way. Fronts at even and at odd depth
    have a stack each, one growing up and one growing down: a front is made on one while its children are taken off the
    other, so that nothing needs to be moved.
    """
    count = len(borders)
    odd, freed = room[0], room[1]  # at odd depth; what the children of a front take
    used, most = sizes[0], sizes[1]
    for k in range(count - 1, -1, -1):
        if parent[k] >= 0:
            odd[k] = 1 - odd[parent[k]]
    for k in range(count):
        own, mine = borders[k] * borders[k], odd[k]
        places[k] = used[mine]
        used[mine] += own
        if used[mine] > most[mine]:
            most[mine] = used[mine]
        used[1 - mine] -= freed[k]
        if parent[k] >= 0:
            freed[parent[k]] += own
    for k in range(count):
        if odd[k] == 1:
            places[k] += most[0]
    return most[0] + most[1]


@njit(**INNER)
def _eliminate_block(L, at, rows, size):  # type: ignore[no-untyped-def]
    """L D L^T in place of the (size, size) block at `at`; the number of negative pivots, -1 if one is zero."""
    negative = 0
    for j in range(size):
        column = at + j * rows
        pivot = L[column + j]
        if not abs(pivot) > 0.0 or not np.isfinite(pivot):
            return -1
        if pivot < 0.0:
            negative += 1
        for k in range(j + 1, size):
            scaled = L[column + k] / pivot
            target = at + k * rows
            for i in range(k, size):
                L[target + i] -= scaled * L[column + i]
        for i in range(j + 1, size):
            L[column + i] /= pivot
    return negative


@njit(**INNER)
def _eliminate(L, at, rows, columns, U, u_at, W, blas, whole, real):  # type: ignore[no-untyped-def]
    """Eliminate the columns of one front; U has its border's update at `u_at`. Negative pivots, -1 if one is zero."""
    negative = 0
    base, work, ublas = np.int64(L.ctypes.data), np.int64(W.ctypes.data), np.int64(U.ctypes.data)
    for j in range(0, columns, BLOCK):
        size = min(BLOCK, columns - j)
        corner = at + j * rows + j
        found = _eliminate_block(L, corner, rows, size)
        if found < 0:
            return -1
        negative += found
        below = rows - j - size
        if below == 0:
            continue
        solve_right(blas, whole, real, below, size, base + 8 * corner, rows, base + 8 * (corner + size), rows)
        # W keeps L D of this block, the panel L
        for c in range(size):
            pivot = 1.0 / L[corner + c * rows + c]
            source, target = corner + size + c * rows, j * rows + c * rows + j + size
            for i in range(below):
                W[target + i] = L[source + i]
                L[source + i] *= pivot
        for c in range(j + size, columns, STRIP):
            width = min(STRIP, columns - c)
            subtract_product(
                blas, whole, real, rows - c, width, size,
                base + 8 * (at + j * rows + c), rows, work + 8 * (j * rows + c), rows,
                base + 8 * (at + c * rows + c), rows,
            )  # fmt: skip
    border = rows - columns
    for c in range(0, border, STRIP):
        width = min(STRIP, border - c)
        subtract_product(
            blas, whole, real, border - c, width, columns,
            base + 8 * (at + columns + c), rows, work + 8 * (columns + c), rows,
            ublas + 8 * (u_at + c * border + c), border,
        )  # fmt: skip
    return negative


@njit(**INNER)
def _add_child(child, to_parent, runs, L, at, rows, columns, U, u_at):  # type: ignore[no-untyped-def]
    """Add a child's update, at `child` of U, to its parent's front, by runs of rows that stay neighbours there."""
    size, border, count = len(to_parent), rows - columns, 0
    for i in range(size):
        if i == 0 or to_parent[i] != to_parent[i - 1] + 1 or to_parent[i] == columns:
            runs[count] = i
            count += 1
    runs[count] = size
    for run in range(count):
        for j in range(runs[run], runs[run + 1]):
            column = to_parent[j]
            if column < columns:
                V, target = L, at + column * rows
            else:
                V, target = U, u_at + (column - columns) * border - columns
            source = child + j * size
            for other in range(run, count):
                first = max(runs[other], j)
                shift = target + to_parent[first] - first
                for i in range(first, runs[other + 1]):
                    V[shift + i] += U[source + i]


@njit(**KERNEL)
def _factorise(  # type: ignore[no-untyped-def]
    data,
    start,
    border_start,
    to_parent,
    panel,
    children,
    entries,
    updates,
    stack,
    widest,
    L,
    blas,
    whole,
    real,
):
    """Numerical factorisation into L, which is zero on entry; number of negative pivots, -1 if one is zero."""
    count = len(start) - 1
    for e in range(len(data)):
        L[entries[e]] = data[e]
    U = np.empty(max(stack, 1))
    W = np.empty(max(widest, 1))
    waiting = np.empty(count + 1, dtype=np.int64)
    runs = np.empty(start[count] + 1, dtype=np.int64)
    depth, negative = 0, 0
    for k in range(count):
        columns = start[k + 1] - start[k]
        border = border_start[k + 1] - border_start[k]
        rows = columns + border
        for j in range(border):
            begin = updates[k] + j * border
            for i in range(begin + j, begin + border):
                U[i] = 0.0
        for _ in range(children[k]):
            depth -= 1
            child = waiting[depth]
            first, last = border_start[child], border_start[child + 1]
            _add_child(updates[child], to_parent[first:last], runs, L, panel[k], rows, columns, U, updates[k])
        found = _eliminate(L, panel[k], rows, columns, U, updates[k], W, blas, whole, real)
        if found < 0:
            return -1
        negative += found
        waiting[depth] = k
        depth += 1
    return negative


@njit(**KERNEL)
def _solve(L, start, border_start, border, panel, x, y, blas, whole, real):  # type: ignore[no-untyped-def]
    """Solve in place, x <- (L D L^T)^-1 x, in the order; y is room for the tallest border."""
    base, at_x, at_y = np.int64(L.ctypes.data), np.int64(x.ctypes.data), np.int64(y.ctypes.data)
    for k in range(len(start) - 1):
        s, columns = start[k], start[k + 1] - start[k]
        first, below = border_start[k], border_start[k + 1] - border_start[k]
        rows, own = columns + below, base + 8 * panel[k]
        if columns == 0:
            continue
        solve_lower(blas, whole, columns, own, rows, at_x + 8 * s)
        for i in range(below):
            y[i] = 0.0
        add_times(blas, whole, real, below, columns, own + 8 * columns, rows, at_x + 8 * s, at_y)
        for i in range(below):
            x[border[first + i]] -= y[i]
        for j in range(columns):
            x[s + j] /= L[panel[k] + j * rows + j]
    for k in range(len(start) - 2, -1, -1):
        s, columns = start[k], start[k + 1] - start[k]
        first, below = border_start[k], border_start[k + 1] - border_start[k]
        rows, own = columns + below, base + 8 * panel[k]
        if columns == 0:
            continue
        for i in range(below):
            y[i] = x[border[first + i]]
        subtract_transpose_times(
            blas, whole, real, below, columns, own + 8 * columns, rows, at_y, at_x + 8 * s
        )
        solve_upper(blas, whole, columns, own, rows, at_x + 8 * s)


def factorise(data: Array, f: Fronts) -> tuple[Array, int]:
    """Factor of the lower values `data`, and its number of negative pivots (-1: a pivot is zero).

    Args:
        data: (k,) values of the lower triangle, in the order of elimination.
        f: fronts of the pattern.

    Returns:
        (l,) the factor, front by front; and the number.
    """
    L = np.zeros(int(f.panel[-1]))
    rows = f.rows
    widest = int((rows * np.diff(f.start)).max(initial=1))
    negative = _factorise(
        data, f.start, f.border_start, f.to_parent, f.panel, f.children, f.entries, f.updates, f.stack, widest, L,
        addresses(), *constants(),
    )  # fmt: skip
    return L, int(negative)


def solve(L: Array, f: Fronts, b: Array) -> Array:
    """Solution (n,) or (n, k) in the order of elimination.

    Args:
        L: (l,) from `factorise`.
        f: fronts of the pattern.
        b: (n,) or (n, k) right-hand sides, in the order of elimination.
    """
    room = np.empty(int(f.rows.max(initial=1)))
    x = np.array(b, dtype=float, order="F")
    for column in x.T if x.ndim == 2 else (x,):
        _solve(L, f.start, f.border_start, f.border, f.panel, column, room, addresses(), *constants())
    return x
