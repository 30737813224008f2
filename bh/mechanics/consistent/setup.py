"""Compiled passes that are needed once a step: patches, sides, places of matrix entries."""

from __future__ import annotations

import numpy as np
from numba import njit

from bh.mechanics.shared.kinematics import OPTIONS
from meshes.topology import Ints


def join_pairs(sides: Ints, order: Ints, patch_of: Ints, patches: int) -> tuple[Ints, int]:
    """Join patches by twos across hinges.

    Args:
        sides: (m, 2) triangles of the hinges.
        order: (k,) hinges that are tried, in this order.
        patch_of: (t,) patches of the triangles.
        patches: number of patches.

    Returns:
        the new patch of every triangle, and the number of patches.
    """
    partner, new = np.full((2, patches), -1, dtype=np.int64)
    out = np.empty_like(patch_of)
    return out, int(_join(sides, order, patch_of, partner, new, out))


@njit(**OPTIONS)
def _join(sides, order, patch_of, partner, new, out):  # type: ignore[no-untyped-def]
    for i in range(len(order)):
        h = order[i]
        one, two = patch_of[sides[h, 0]], patch_of[sides[h, 1]]
        if one != two and partner[one] < 0 and partner[two] < 0:
            partner[one], partner[two] = two, one
    count = 0
    for patch in range(len(partner)):
        if new[patch] < 0:
            new[patch] = count
            if partner[patch] >= 0:
                new[partner[patch]] = count
            count += 1
    for t in range(len(patch_of)):
        out[t] = new[patch_of[t]]
    return count


@njit(**OPTIONS)
def rotation_matrix(rotation, kind, B, turns, stiffness, rows, columns, values):  # type: ignore[no-untyped-def]
    """Entries of the constant Hessian of the energy in the rotations alone; returns how many."""
    at = 0
    for t in range(len(rotation)):
        for k in range(rotation.shape[1]):
            for j in range(rotation.shape[1]):
                if rotation[t, k] >= 0 and rotation[t, j] >= 0:
                    rows[at], columns[at] = rotation[t, k], rotation[t, j]
                    values[at] = B[t, k, j] if kind[t, k] == kind[t, j] else -B[t, k, j]
                    at += 1
    for h in range(len(turns)):
        for k in range(2):
            for j in range(2):
                rows[at], columns[at], values[at] = turns[h, k], turns[h, j], stiffness[h]
                at += 1
    return at
