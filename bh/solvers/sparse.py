"""Symmetric sparse matrices in a fill-reducing order, and who factorises them.

A pattern is analysed once; every matrix of that pattern is then factorised without looking at the pattern again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numba import njit
from numpy.typing import NDArray

from bh.runtime.kernel_options import KERNEL
from bh.solvers import multifrontal, pardiso
from bh.solvers.dissection import Dissection, dissect
from bh.solvers.factor import Factor, IndefiniteError, SignedFactor, unpermuted

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Index = NDArray[np.int32]


WIDEST = 180  # half-bandwidth up to which a band is faster than a sparse factor (docs/performance.md)


def band_is_cheaper(n: int, bandwidth: int) -> bool:
    """Choice between a band and a sparse factor by measurement, unless the band would not fit into memory.

    Per unknown the band costs 3e-11 (b + 1)^2 s and more for narrow ones, the sparse factor about 1e-6 s on sheets of
    that width, whatever their length; on sheets of 1,000 to 50,000 unknowns the two meet at b = 140 to 220.

    Args:
        n: number of unknowns.
        bandwidth: half-bandwidth b.
    """
    return bandwidth <= WIDEST and 8 * n * (bandwidth + 1) < 2e9


@dataclass(frozen=True, eq=False)
class SparsePattern:
    """The lower triangle in compressed columns, rows ascending, unknowns in order of elimination.

    Attributes:
        order: (n,) order[k] is the unknown in row k.
        indptr, indices: of the lower triangle, diagonal included.
        tree: dissection of the nodes, `graph` (indptr, indices) their neighbours, `first` (nodes + 1,) the first row
            of the node at every place of `tree.order`.
    """

    order: Ints
    indptr: Index
    indices: Index
    tree: Dissection
    graph: tuple[Ints, Ints]
    first: Ints

    @classmethod
    def dissected(
        cls,
        high: Ints,
        low: Ints,
        sizes: Ints,
        places: Array | None,
        unknowns: Callable[[Ints], Ints],
    ) -> tuple[SparsePattern, Ints]:
        """Pattern of nodes with `sizes` (v,) unknowns each, coupled in pairs (high, low); and the order of the nodes.

        Args:
            high: (pairs,) node of every coupled pair, the one of higher number.
            low: (pairs,) the other one.
            sizes: (v,) number of unknowns of every node.
            places: (v, d) positions of the nodes, or None.
            unknowns: gives the unknowns of nodes in a given order.
        """
        count = len(sizes)
        ones = np.ones(2 * len(high), dtype=np.int8)
        both = sp.csr_array((ones, (np.r_[high, low], np.r_[low, high])), shape=(count, count))
        graph = both.indptr.astype(np.int64), both.indices.astype(np.int64)
        tree = dissect(*graph, places)
        first = np.concatenate(([0], np.cumsum(sizes[tree.order])))
        later = both[tree.order][:, tree.order]
        later.sort_indices()
        indptr, indices = _lower(later.indptr.astype(np.int64), later.indices.astype(np.int64), first)
        return cls(unknowns(tree.order), indptr, indices, tree, graph, first), tree.order

    @cached_property
    def fronts(self) -> multifrontal.Fronts:
        """Symbolic factor of the pattern."""
        return multifrontal.fronts(self.tree, *self.graph, self.first, (self.indptr, self.indices))

    @cached_property
    def pardiso(self) -> pardiso.Analysis:
        """The pattern as PARDISO knows it."""
        return pardiso.Analysis(self.indptr, self.indices)


@dataclass(frozen=True)
class SparseMatrix:
    """Symmetric sparse matrix with the lower values `data` of a pattern."""

    data: Array
    pattern: SparsePattern

    @classmethod
    def of(cls, matrix: sp.sparray, pattern: SparsePattern | None = None) -> SparseMatrix:
        """From any symmetric matrix (n, n), both triangles given; `pattern` is that of an earlier one with its entries.

        Args:
            matrix: (n, n), symmetric.
            pattern: of an earlier matrix with the same entries; None to find one.

        Raises:
            ValueError: the matrix has other entries than the pattern.
        """
        n = matrix.shape[0]
        entries = sp.coo_array(matrix)
        if pattern is None:
            off = entries.row > entries.col
            keys = np.unique(entries.row[off].astype(np.int64) * n + entries.col[off])
            one_each = np.ones(n, dtype=np.int64)
            pattern, _ = SparsePattern.dissected(keys // n, keys % n, one_each, None, lambda order: order)
        place = np.empty(n, dtype=np.int64)
        place[pattern.order] = np.arange(n)
        rows, columns = place[entries.row], place[entries.col]
        low = rows >= columns
        diagonal = np.arange(n)  # always there, if only as a zero
        lower = sp.coo_array(
            (
                np.r_[entries.data[low], np.zeros(n)],
                (np.r_[rows[low], diagonal], np.r_[columns[low], diagonal]),
            ),
            shape=(n, n),
        ).tocsc()
        lower.sort_indices()
        if not np.array_equal(lower.indices, pattern.indices):
            raise ValueError("the matrix has other entries than its pattern")
        return cls(np.asarray(lower.data, dtype=float), pattern)

    def factorise(self, shift: float = 0.0) -> Factor:
        """Factor of A + shift * diag(|A|); raises `IndefiniteError`."""
        factor, negative = self._factorise(shift)
        if negative:
            raise IndefiniteError(negative)
        return factor

    def factorise_any(self) -> tuple[Factor, int]:
        """Factor of A, definite or not, and its number of negative eigenvalues."""
        return self._factorise(0.0)

    def _factorise(self, shift: float) -> tuple[Factor, int]:
        data = self.data
        if shift:
            data = data.copy()
            diagonal = np.abs(data[self.pattern.indptr[:-1]])
            data[self.pattern.indptr[:-1]] += shift * np.maximum(diagonal, 1e-3 * diagonal.mean())
        if pardiso.pays(len(self.pattern.order)):
            return self.pattern.pardiso.factorise(data, self.pattern.order)
        L, negative = multifrontal.factorise(data, self.pattern.fronts)
        if negative < 0:
            raise IndefiniteError(1)
        return MultifrontalFactor(L, self.pattern, negative), negative

    def __matmul__(self, x: Array) -> Array:
        """A x for x (n,), in the order of the unknowns."""
        p = self.pattern
        out = np.zeros(len(x))
        _multiply(p.indptr, p.indices, self.data, x[p.order], out)
        return unpermuted(out, p.order)

    def diagonal(self) -> Array:
        """(n,) diagonal, in the order of the unknowns."""
        return unpermuted(self.data[self.pattern.indptr[:-1]], self.pattern.order)


@dataclass(frozen=True)
class MultifrontalFactor(SignedFactor):
    """L D L^T of a sparse matrix, front by front."""

    L: Array
    pattern: SparsePattern
    negative: int

    def solve(self, b: Array) -> Array:
        """Solution x of A x = b, b (n,) or (n, k)."""
        order = self.pattern.order
        return unpermuted(multifrontal.solve(self.L, self.pattern.fronts, b[order]), order)


@njit(**KERNEL)
def _multiply(indptr, indices, data, x, out):  # type: ignore[no-untyped-def]
    for j in range(len(x)):
        at = indptr[j]
        total = data[at] * x[j]
        for e in range(at + 1, indptr[j + 1]):
            i = indices[e]
            out[i] += data[e] * x[j]
            total += data[e] * x[i]
        out[j] += total


@njit(**KERNEL)
def _lower(indptr, indices, first):  # type: ignore[no-untyped-def]
    """Compressed columns of the lower triangle, unknown by unknown, of a graph of places with ascending neighbours."""
    count = len(first) - 1
    n = first[count]
    starts = np.zeros(n + 1, dtype=np.int32)
    for p in range(count):
        rows = 0
        for e in range(indptr[p], indptr[p + 1]):
            q = indices[e]
            if q > p:
                rows += first[q + 1] - first[q]
        for c in range(first[p], first[p + 1]):
            starts[c + 1] = starts[c] + first[p + 1] - c + rows
    found = np.empty(starts[n], dtype=np.int32)
    for p in range(count):
        for c in range(first[p], first[p + 1]):
            at = starts[c]
            for r in range(c, first[p + 1]):
                found[at] = r
                at += 1
            for e in range(indptr[p], indptr[p + 1]):
                q = indices[e]
                if q > p:
                    for r in range(first[q], first[q + 1]):
                        found[at] = r
                        at += 1
    return starts, found
