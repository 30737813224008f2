"""Where stiffness between nodes that touch goes in the tangent: as pairs of nodes, whatever stencils it comes from."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.mechanics.shared.assembly import add_lower, rotate
from bh.mechanics.shared.kinematics import OPTIONS
from bh.mechanics.shared.sparsity import Slots
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
MOST_KEPT = 2  # times as many pairs as there are now, for those of before to be kept in the pattern


class ContactBlocks:
    """Where the Hessian of contact goes in the tangent: pairs of nodes, a new set only where a pair is new."""

    def __init__(self) -> None:
        """No pairs."""
        self.pairs: Ints = np.zeros((0, 2), dtype=np.int64)
        self._keys: Ints = np.zeros(0, dtype=np.int64)

    def known(self, pairs: Ints) -> bool:
        """Are all of these (p, 2) among the pairs? If not, they are now, with those of before unless they are many."""
        keys = _keys(pairs)
        if np.isin(keys, self._keys).all():
            return True
        few = len(self.pairs) <= MOST_KEPT * len(pairs)  # pairs come and go: what was near will be near again
        self._keys = np.union1d(self._keys, keys) if few else np.unique(keys)
        self.pairs = np.column_stack((self._keys >> 31, self._keys & (2**31 - 1)))
        return False

    def rows(self, pairs: Ints) -> Ints:
        """(p,) where pairs (p, 2) that are known stand among `pairs`.

        Args:
            pairs: (p, 2) nodes.
        """
        return np.searchsorted(self._keys, _keys(pairs))

    def add(
        self, pairs: Ints, blocks: Array, frame_of: Ints, frames: Array, slots: Slots, data: Array
    ) -> None:
        """Adds the blocks (p, 6, 6) of pairs (p, 2) to the values `data`; `slots` are those of `self.pairs`.

        Args:
            pairs: (p, 2) nodes.
            blocks: (p, 6, 6) N / mm.
            frame_of: (nodes,) row of `frames` of each node, -1 where axes are global.
            frames: (k, 3, 3) axes of oblique supports.
            slots: of `self.pairs`.
            data: values of the matrix, N / mm; added to.
        """
        if len(pairs):
            _add_blocks(pairs, blocks, self.rows(pairs), frame_of, frames, slots, data)


def _keys(pairs: Ints) -> Ints:
    return np.asarray(pairs[:, 0] * 2**31 + pairs[:, 1])


@njit(**OPTIONS)
def _add_blocks(pairs, blocks, rows, frame_of, frames, slots, data):  # type: ignore[no-untyped-def]
    for k in range(len(pairs)):
        if len(frames) > 0:
            rotate(blocks[k], pairs[k], frame_of, frames)
        add_lower(blocks[k], np.int64(6), slots[rows[k]], data)


def no_blocks() -> tuple[Ints, Array]:
    """No pairs (0, 2), and no blocks (0, 6, 6)."""
    return np.zeros((0, 2), dtype=np.int64), np.zeros((0, 6, 6))


def partners(mesh: SheetMesh) -> Ints:
    """(n,) another node on an edge of every node, to make a pair of a node that is touched alone.

    Args:
        mesh: of the sheet.
    """
    found = np.zeros(len(mesh.points), dtype=np.int64)
    a, b = mesh.topology.edges.T
    found[a], found[b] = b, a
    return found


def in_pairs(row: Ints, column: Ints, blocks: Array, partner: Ints) -> tuple[Ints, Array]:
    """A symmetric matrix of blocks as pairs of nodes (p, 2), first one higher, and their matrices (p, 6, 6).

    Args:
        row: (k,) nodes; a place may come several times, its blocks are summed.
        column: (k,) nodes; of a pair both orders are given.
        blocks: (k, 3, 3) N / mm.
        partner: of every node (`partners`).
    """
    if len(row) == 0:
        return no_blocks()
    below, own = row > column, row == column
    other = partner[row[own]]
    high = np.concatenate((row[below], np.maximum(row[own], other)))
    low = np.concatenate((column[below], np.minimum(row[own], other)))
    keys, number = np.unique(high * 2**31 + low, return_inverse=True)
    pairs = np.column_stack((keys // 2**31, keys % 2**31))
    out = np.zeros((len(pairs), 6, 6))
    count = int(below.sum())
    np.add.at(out[:, 3:, :3], number[:count], blocks[below].transpose(0, 2, 1))
    np.add.at(out[:, :3, 3:], number[:count], blocks[below])
    first = pairs[number[count:], 0] == row[own]
    for is_first, part in ((True, out[:, :3, :3]), (False, out[:, 3:, 3:])):
        np.add.at(part, number[count:][first == is_first], blocks[own][first == is_first])
    return pairs, out
