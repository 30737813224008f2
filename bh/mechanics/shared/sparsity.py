"""Where the entries of all elements go: found once for a step, node by node, so that assembling is adding."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.runtime.kernel_options import INNER, KERNEL
from bh.solvers.matrices import Storage, reverse_cuthill_mckee
from bh.solvers.sparse import SparsePattern, band_is_cheaper

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Slots = NDArray[np.int32]


@dataclass(frozen=True)
class Pattern(Storage):
    """Where the entries of all elements go.

    Attributes:
        slots: one (elements, entries) array for each group of elements: where the lower entries of its matrix, row
            by row, go in the values; -1 where an unknown is prescribed; -2 - slot where the entry stands for two,
            which happens if two nodes of an element have one unknown in common (images of each other).
    """

    slots: tuple[Slots, ...]


def build_pattern(number: Ints, groups: tuple[Ints, ...], places: Array | None = None) -> Pattern:
    """Pattern of element groups, each (elements, nodes).

    Args:
        number: (nodes, 3) numbers of the unknowns, -1 if prescribed.
        groups: nodes (elements, k) of every group of elements of one kind.
        places: (nodes, d) positions, which help to find a good order of a wide sheet.
    """
    sizes = (number >= 0).sum(axis=1)
    used = np.flatnonzero(sizes)  # nodes with unknowns
    vertex = np.full(len(number), -1, dtype=np.int64)
    vertex[used] = np.arange(len(used))
    high, low = _node_pairs(vertex, groups)
    sizes = sizes[used]
    number = np.ascontiguousarray(number[used])
    groups = tuple(vertex[group] for group in groups)
    n = int(sizes.sum())
    order, _ = reverse_cuthill_mckee(high, low, len(used))
    place, first = _places(order, sizes)
    before, behind = np.minimum(place[high], place[low]), np.maximum(place[high], place[low])
    wide = first[behind + 1] - first[before]
    bandwidth = int(max(wide.max(initial=0), sizes.max(initial=0))) - 1 if n else 0
    if band_is_cheaper(n, bandwidth):
        starts = np.arange(n, dtype=np.int64) * (bandwidth + 1)
        slots = tuple(_band_slots(group, number, place, first, starts, *_room(group)) for group in groups)
        last = np.arange(len(order))
        np.maximum.at(last, before, behind)
        reach = np.repeat(first[np.maximum.accumulate(last) + 1] - 1, np.diff(first))
        return Pattern(_unknowns(number, order), bandwidth, (bandwidth + 1) * n, None, reach, slots)
    sparse, tree_order = SparsePattern.dissected(
        high, low, sizes, None if places is None else places[used], lambda order: _unknowns(number, order)
    )
    place, first = _places(tree_order, sizes)
    slots = tuple(
        _sparse_slots(group, number, place, first, sparse.indptr, sparse.indices, *_room(group))
        for group in groups
    )
    return Pattern(sparse.order, bandwidth, len(sparse.indices), sparse, None, slots)


def _unknowns(number: Ints, order: Ints) -> Ints:
    """Unknowns in the order of their nodes."""
    flat = number[order].ravel()
    return flat[flat >= 0]


def _places(order: Ints, sizes: Ints) -> tuple[Ints, Ints]:
    """Place of every node in the order, and the first row of the node at every place (and the number of rows)."""
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    return place, np.concatenate(([0], np.cumsum(sizes[order])))


def _node_pairs(vertex: Ints, groups: tuple[Ints, ...]) -> tuple[Ints, Ints]:
    """Every pair of nodes that share an element, once, as (high, low)."""
    keys = []
    for group in groups:
        first, second = np.tril_indices(group.shape[1], -1)
        nodes = vertex[group]
        a, b = nodes[:, first], nodes[:, second]
        both = (a >= 0) & (b >= 0) & (a != b)
        a, b = a[both], b[both]
        keys.append(np.maximum(a, b) * len(vertex) + np.minimum(a, b))
    unique = np.unique(np.concatenate(keys)) if keys else np.zeros(0, dtype=np.int64)
    return unique // len(vertex), unique % len(vertex)


@njit(**INNER)
def _rows(nodes, number, place, first, rows):  # type: ignore[no-untyped-def]
    """Rows (3 p,) of the unknowns of an element, -1 if prescribed."""
    for p in range(len(nodes)):
        v = nodes[p]
        row = first[place[v]] if v >= 0 else 0
        for c in range(3):
            if v >= 0 and number[v, c] >= 0:
                rows[3 * p + c] = row
                row += 1
            else:
                rows[3 * p + c] = -1


def _room(group: Ints) -> tuple[Slots, Ints]:
    """Room for the slots (elements, entries) of a group, and for the rows (3 p,) of an element."""
    width = 3 * group.shape[1]
    return np.empty((len(group), width * (width + 1) // 2), dtype=np.int32), np.empty(width, dtype=np.int64)


@njit(**KERNEL)
def _band_slots(group, number, place, first, starts, slots, rows):  # type: ignore[no-untyped-def]
    width = len(rows)
    for e in range(len(group)):
        _rows(group[e], number, place, first, rows)
        at = 0
        for i in range(width):
            for j in range(i + 1):
                if rows[i] < 0 or rows[j] < 0:
                    slots[e, at] = -1
                else:
                    low = min(rows[i], rows[j])
                    slots[e, at] = starts[low] + max(rows[i], rows[j]) - low
                    if i != j and rows[i] == rows[j]:
                        slots[e, at] = -2 - slots[e, at]
                at += 1
    return slots


@njit(**KERNEL)
def _sparse_slots(group, number, place, first, indptr, indices, slots, rows):  # type: ignore[no-untyped-def]
    nodes = group.shape[1]
    for e in range(len(group)):
        _rows(group[e], number, place, first, rows)
        for p in range(nodes):
            for q in range(p + 1):
                for j in range(3 * q, 3 * q + 3):
                    # the entries of one node lie together in a column, so one search serves all three
                    base_row, base = -1, 0
                    for i in range(max(3 * p, j), 3 * p + 3):
                        at = i * (i + 1) // 2 + j
                        r, c = rows[i], rows[j]
                        if r < 0 or c < 0:
                            slots[e, at] = -1
                            continue
                        if r < c:  # the other node's column: no run to follow
                            slots[e, at] = _find(indices, indptr[r], indptr[r + 1], c)
                        else:
                            if base_row < 0:
                                base_row, base = r, _find(indices, indptr[c], indptr[c + 1], r)
                            slots[e, at] = base + r - base_row
                            if i != j and r == c:
                                slots[e, at] = -2 - slots[e, at]
    return slots


@njit(**INNER)
def _find(indices, low, high, row):  # type: ignore[no-untyped-def]
    while high - low > 1:
        middle = (low + high) // 2
        if indices[middle] <= row:
            low = middle
        else:
            high = middle
    return low
