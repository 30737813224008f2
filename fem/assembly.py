"""The fixed pattern that element matrices of the shell are added into; see `fem.components` for their 30 components."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numba import njit
from numpy.typing import NDArray

from bh.solvers.matrices import BandMatrix, SparseMatrix, reverse_cuthill_mckee
from fem.points import OPTIONS
from meshes.curved import QuadraticMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
LOWER = np.tril_indices(30)


@njit(**OPTIONS)
def turn_blocks(K, nodes, frame_of, frames):  # type: ignore[no-untyped-def]
    """Rows and columns of nodes with local axes into those axes; K (t, 24, 24)."""
    row = np.empty(3)
    for e in range(len(nodes)):
        for i in range(6):
            f = frame_of[nodes[e, i]]
            if f < 0:
                continue
            for j in range(24):
                for a in range(3):
                    row[a] = 0.0
                    for b in range(3):
                        row[a] += frames[f, a, b] * K[e, 3 * i + b, j]
                for a in range(3):
                    K[e, 3 * i + a, j] = row[a]
            for j in range(24):
                for a in range(3):
                    row[a] = 0.0
                    for b in range(3):
                        row[a] += frames[f, a, b] * K[e, j, 3 * i + b]
                for a in range(3):
                    K[e, j, 3 * i + a] = row[a]


@njit(**OPTIONS)
def scatter(K, sides, slots, data):  # type: ignore[no-untyped-def]
    """Add element matrices (t, 24, 24) by positions and gamma = +-alpha + beta / 2 to the values `data`."""
    source = np.empty(30, dtype=np.int64)
    factor = np.ones(30)
    for i in range(30):
        source[i] = i if i < 24 else i - 6
    for e in range(len(K)):
        for i in range(6):
            factor[18 + i] = sides[e, i // 2]
            factor[24 + i] = 0.5
        at = 0
        for i in range(30):
            for j in range(i + 1):
                slot = slots[e, at]
                if slot >= 0:
                    data[slot] += factor[i] * factor[j] * K[e, source[i], source[j]]
                at += 1


@dataclass(frozen=True)
class Pattern:
    """Where the lower entries of all element matrices (t, 465) go; -1 where a component is prescribed.

    Attributes:
        order: (n,) permutation of the unknowns, order[k] is the unknown in row k.
        size: number of values. A band has `bandwidth`, a sparse matrix `indices`, `indptr` and `both`, else empty.
    """

    order: Ints
    slots: Ints
    size: int
    bandwidth: int
    indices: Ints
    indptr: Ints
    both: Ints

    @property
    def banded(self) -> bool:
        return len(self.indptr) == 0

    def matrix(self, data: Array) -> BandMatrix | SparseMatrix:
        n = len(self.order)
        if self.banded:
            return BandMatrix(data.reshape((self.bandwidth + 1, n), order="F"), self.order)
        csc = sp.csc_matrix((data[self.both], self.indices, self.indptr), shape=(n, n))
        return SparseMatrix(csc, self.order)


def build_pattern(mesh: QuadraticMesh, components: Ints, number: Ints, banded: bool | None = None) -> Pattern:
    """Pattern of the unknowns `number` (all components, -1 if prescribed); unknowns of a node and its edge stay
    together.

    A band where LAPACK's factorisation is expected to be cheaper than SuperLU's, by their measured costs
    (docs/decisions.md), unless `banded` says which.
    """
    n = int(number.max(initial=-1)) + 1
    position, order = _order(mesh, components, number, n)
    element = np.where(components >= 0, number[components], -1)
    a, b = element[:, LOWER[0]], element[:, LOWER[1]]
    free = (a >= 0) & (b >= 0)
    row, column = position[np.maximum(a, 0)], position[np.maximum(b, 0)]
    row, column = np.maximum(row, column), np.minimum(row, column)
    bandwidth = int((row - column)[free].max(initial=0))
    fits = 8 * n * (bandwidth + 1) < 2e9
    cheaper = fits and 2.6e-11 * n * (bandwidth + 1.0) ** 2 < 1.5e-7 * n**1.45
    if cheaper if banded is None else banded:
        slots = np.where(free, (row - column) + column * (bandwidth + 1), -1)
        empty = np.zeros(0, dtype=np.int64)
        return Pattern(order, slots, (bandwidth + 1) * n, bandwidth, empty, empty, empty)
    return _sparse(n, order, np.where(free, row + n * column, -1), bandwidth)


def _order(mesh: QuadraticMesh, components: Ints, number: Ints, n: int) -> tuple[Ints, Ints]:
    """Row of every unknown and unknown of every row, narrow by reverse Cuthill-McKee on the nodes."""
    nodes = mesh.triangles
    i, j = np.tril_indices(6, -1)
    order_nodes, _ = reverse_cuthill_mckee(nodes[:, i].ravel(), nodes[:, j].ravel(), len(mesh.nodes))
    rank = np.empty(len(mesh.nodes), dtype=np.int64)
    rank[order_nodes] = np.arange(len(rank))
    # the node that each component belongs to: rotations go with the middle node of their edge
    owner = np.zeros(len(number), dtype=np.int64)
    local = np.concatenate((np.repeat(np.arange(6), 3), np.tile(np.repeat([3, 4, 5], 2), 2)))
    used = components >= 0
    owner[components[used]] = nodes[:, local][used]
    free = np.flatnonzero(number >= 0)
    sequence = free[np.argsort(rank[owner[free]], kind="stable")]
    order = number[sequence]
    position = np.empty(n, dtype=np.int64)
    position[order] = np.arange(n)
    return position, order


def _sparse(n: int, order: Ints, keys: Ints, bandwidth: int) -> Pattern:
    """Compressed lower values and the map to both triangles, in SuperLU's minimum-degree order."""
    from scipy.sparse.linalg import splu

    unique = np.unique(keys[keys >= 0])
    row, column = unique % n, unique // n
    # fill-reducing order once: factorise a diagonally dominant matrix of this pattern
    probe = sp.csc_matrix((np.full(len(unique), -1e-3), (row, column)), shape=(n, n))
    probe = sp.csc_matrix(probe + probe.T + 2.0 * n * sp.eye_array(n))
    options = {"SymmetricMode": True, "Equil": False}
    new = splu(probe, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options).perm_c.astype(
        np.int64
    )
    new_order = np.empty(n, dtype=np.int64)
    new_order[new] = order
    low, high = np.maximum(new[row], new[column]), np.minimum(new[row], new[column])
    size = len(unique)
    off = np.flatnonzero(low != high)
    rows, columns = np.concatenate((low, high[off])), np.concatenate((high, low[off]))
    source = np.concatenate((np.arange(size), off))
    sorting = np.lexsort((rows, columns))
    indptr = np.concatenate(([0], np.cumsum(np.bincount(columns, minlength=n))))
    slots = np.where(keys >= 0, np.searchsorted(unique, np.maximum(keys, 0)), -1)
    return Pattern(
        new_order, slots, size, bandwidth, rows[sorting].astype(np.int32), indptr.astype(np.int32),
        source[sorting],
    )  # fmt: skip
