"""The fixed pattern that element matrices of the shell are added into; see `fem.components` for theirs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.runtime.kernel_options import KERNEL
from bh.solvers.matrices import Storage, reverse_cuthill_mckee
from bh.solvers.sparse import SparsePattern, band_is_cheaper
from meshes.curved import ElementMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
NO_PAIRS: Ints = np.zeros((0, 2), dtype=np.int64)


@njit(**KERNEL)
def turn_blocks(K, nodes, frame_of, frames):  # type: ignore[no-untyped-def]
    """Rows and columns of nodes with local axes into those axes; K (t, w, w)."""
    row = np.empty(3)
    width = K.shape[1]
    for e in range(len(nodes)):
        for i in range(nodes.shape[1]):
            f = frame_of[nodes[e, i]]
            if f < 0:
                continue
            for j in range(width):
                for a in range(3):
                    row[a] = 0.0
                    for b in range(3):
                        row[a] += frames[f, a, b] * K[e, 3 * i + b, j]
                for a in range(3):
                    K[e, 3 * i + a, j] = row[a]
            for j in range(width):
                for a in range(3):
                    row[a] = 0.0
                    for b in range(3):
                        row[a] += frames[f, a, b] * K[e, j, 3 * i + b]
                for a in range(3):
                    K[e, j, 3 * i + a] = row[a]


@njit(**KERNEL)
def scatter(K, sides, slots, data):  # type: ignore[no-untyped-def]
    """Add element matrices (t, w, w) by positions and gamma = +-alpha + beta / 2 to `data`; sides (t, 3 r)."""
    width, turns = K.shape[1], sides.shape[1]
    moves = width - turns
    source = np.empty(width + turns, dtype=np.int64)
    factor = np.ones(width + turns)
    for i in range(width + turns):
        source[i] = i if i < width else i - turns
    for e in range(len(K)):
        for i in range(moves):
            at = i * (i + 1) // 2
            for j in range(i + 1):
                slot = slots[e, at + j]
                if slot >= 0:
                    data[slot] += K[e, i, j]
        for i in range(turns):
            factor[moves + i] = sides[e, i]
            factor[width + i] = 0.5
        for i in range(moves, width + turns):
            at = i * (i + 1) // 2
            if slots[e, at + i] < 0:  # prescribed, or no fold angle there, which is so in most triangles
                continue
            for j in range(i + 1):
                slot = slots[e, at + j]
                if slot >= 0:
                    data[slot] += factor[i] * factor[j] * K[e, source[i], source[j]]


@dataclass(frozen=True)
class Pattern(Storage):
    """Where the lower entries of all element matrices go; -1 in `slots` where a component is prescribed.

    `touching` has the same for the matrices (6, 6) of pairs of nodes in contact.
    """

    slots: NDArray[np.int32]
    touching: NDArray[np.int32]


def build_pattern(
    mesh: ElementMesh,
    components: Ints,
    number: Ints,
    banded: bool | None = None,
    touching: Ints = NO_PAIRS,
) -> Pattern:
    """Where the element matrices go in the matrix of the unknowns.

    Unknowns of a node and of its edge stay together.

    Args:
        mesh: places that unknowns belong to.
        components: (t, w) components of every element, -1 where it has none.
        number: (k,) unknown of each component, -1 if prescribed.
        banded: a band or a sparse matrix; None for whichever is factorised faster.
        touching: (p, 2) nodes, the lower number second, that are in contact and so in the matrix, which is sparse then.
    """
    owner = _owners(mesh, components, number)
    free = np.flatnonzero(number >= 0)
    sizes = np.bincount(owner[free], minlength=len(mesh.places))
    used = np.flatnonzero(sizes)  # places with unknowns
    vertex = np.full(len(sizes), -1, dtype=np.int64)
    vertex[used] = np.arange(len(used))
    by_node = free[np.argsort(owner[free], kind="stable")]  # components node by node
    starts = np.concatenate(([0], np.cumsum(sizes[used])))

    def unknowns(nodes: Ints) -> Ints:
        """Unknowns in the order of their nodes (rows of `used`)."""
        length = sizes[used][nodes]
        inside = np.arange(length.sum()) - np.repeat(np.cumsum(length) - length, length)
        return np.asarray(number[by_node[np.repeat(starts[nodes], length) + inside]])

    high, low = _pairs(vertex[mesh.carriers], len(used))
    met = (3 * touching[:, :, None] + np.arange(3)).reshape(-1, 6)
    if len(met):
        banded = False
        ends = np.sort(vertex[touching], axis=1)
        keys = np.unique(
            np.concatenate((high * len(used) + low, (ends[:, 1] * len(used) + ends[:, 0])[ends[:, 0] >= 0]))
        )
        high, low = keys // len(used), keys % len(used)
    order = unknowns(reverse_cuthill_mckee(high, low, len(used))[0])
    rows = _rows(components, number, order)
    last = rows.max(axis=1)
    bandwidth = int((last - np.where(rows >= 0, rows, len(order)).min(axis=1)).max(initial=0))
    if band_is_cheaper(len(order), bandwidth) if banded is None else banded:
        lower = np.tril_indices(rows.shape[1])
        a, b = rows[:, lower[0]], rows[:, lower[1]]
        column = np.minimum(a, b)
        places = np.where(column >= 0, np.abs(a - b) + column * (bandwidth + 1), -1)
        slots = places.astype(np.int32, order="C")  # as of a sparse matrix, for which `scatter` is compiled
        reach = np.arange(len(order))
        np.maximum.at(reach, rows[rows >= 0], np.repeat(last, (rows >= 0).sum(axis=1)))
        reach = np.maximum.accumulate(reach)
        return Pattern(order, bandwidth, (bandwidth + 1) * len(order), None, reach, slots, slots[:0])
    sparse, _ = SparsePattern.dissected(high, low, sizes[used], mesh.places[used, :2], unknowns)
    slots, more = (
        _sparse_slots(_rows(each, number, sparse.order), sparse.indptr, sparse.indices)
        for each in (components, met)
    )
    return Pattern(sparse.order, bandwidth, len(sparse.indices), sparse, None, slots, more)


def _owners(mesh: ElementMesh, components: Ints, number: Ints) -> Ints:
    """Place that each component belongs to, which is a node or, for rotations, an edge."""
    owner = np.zeros(len(number), dtype=np.int64)
    nodes = mesh.triangles.shape[1]
    turns = (components.shape[1] - 3 * nodes) // 6
    local = np.concatenate((np.repeat(np.arange(nodes), 3), np.tile(np.repeat([3, 4, 5], turns), 2)))
    used = components >= 0
    owner[components[used]] = mesh.carriers[:, local][used]
    return owner


def _pairs(triangles: Ints, count: int) -> tuple[Ints, Ints]:
    """Every pair of nodes with unknowns that share a triangle, once, as (high, low); -1 are nodes without."""
    i, j = np.tril_indices(6, -1)
    a, b = triangles[:, i].ravel(), triangles[:, j].ravel()
    both = (a >= 0) & (b >= 0)
    keys = np.unique(np.maximum(a, b)[both] * count + np.minimum(a, b)[both])
    return keys // count, keys % count


def _rows(components: Ints, number: Ints, order: Ints) -> Ints:
    """(t, 3 n + 6 r) row of every component of an element, -1 if it is prescribed or missing."""
    position = np.empty(len(order) + 1, dtype=np.int64)
    position[order], position[-1] = np.arange(len(order)), -1
    return position[np.where(components >= 0, number[components], -1)]


@njit(**KERNEL)
def _sparse_slots(rows, indptr, indices):  # type: ignore[no-untyped-def]
    """Slots of the lower entries of all elements in compressed columns, by bisection."""
    width = rows.shape[1]
    slots = np.full((len(rows), width * (width + 1) // 2), -1, dtype=np.int32)
    for e in range(len(rows)):
        at = -1
        for i in range(width):
            for j in range(i + 1):
                at += 1
                row, column = max(rows[e, i], rows[e, j]), min(rows[e, i], rows[e, j])
                if column < 0:
                    continue
                low, high = indptr[column], indptr[column + 1]
                while high - low > 1:
                    middle = (low + high) // 2
                    if indices[middle] <= row:
                        low = middle
                    else:
                        high = middle
                slots[e, at] = low
    return slots
