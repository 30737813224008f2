"""Where the entries of displacements and edge rotations go in one narrow band."""

from __future__ import annotations

import numpy as np

from bh.mechanics.assembly import Pattern, pattern_of_keys
from bh.mechanics.consistent_elements import ConsistentElements
from bh.mechanics.consistent_setup import element_keys
from bh.solvers.matrices import reverse_cuthill_mckee
from meshes.topology import Ints


def rotation_pattern(
    e: ConsistentElements, hinges: Ints, number: Ints, size: int, ground: Ints | None
) -> Pattern:
    """Pattern of triangles, patches, spring creases, locks and (9,) unknowns of the grounded triangle, if there is one.

    `hinges` (m, 4) are those with locks. `number` (n, 3) numbers the displacements, -1 if prescribed; rotations come
    after them. In the graph that is ordered every rotation is a vertex beside the nodes, so that rotations are numbered
    with their edges.
    """
    n, moving = len(number), size - e.rotations
    past = np.vstack((number, np.full((1, 3), -1)))
    c, a = np.nonzero(e.rotation >= 0)
    rotations = e.rotation[c, a]
    patches = past[e.nodes].reshape(len(e.nodes), -1)
    patches[c, e.column[c, a]] = moving + rotations
    springs = np.hstack((number[e.hinges].reshape(-1, 12), moving + e.turns, np.full((len(e.hinges), 1), -1)))
    groups = [
        (number[e.triangles].reshape(-1, 9), None),
        (patches, e.width),
        (springs, None),
        (number[hinges].reshape(-1, 12), None),
    ]
    if ground is not None:
        groups.append((ground[None, :], None))

    vertices = np.hstack((e.nodes, np.where(e.rotation >= 0, n + e.rotation, -1)))
    rows, columns = _pairs((e.triangles, vertices, np.hstack((e.hinges, n + e.turns))))
    vertex_order, _ = reverse_cuthill_mckee(rows, columns, n + e.rotations)
    unknowns = np.full((n + e.rotations, 3), -1, dtype=np.int64)
    unknowns[:n] = number
    unknowns[n:, 0] = moving + np.arange(e.rotations)
    order = unknowns[vertex_order].ravel()
    order = order[order >= 0]
    position = np.empty(size, dtype=np.int64)
    position[order] = np.arange(size)
    keys = []
    for dofs, width in groups:
        most = dofs.shape[1]
        found = np.full((len(dofs), most * (most + 1) // 2), -1, dtype=np.int64)
        used = np.full(len(dofs), most) if width is None else width
        element_keys(dofs, used, position, size, found)
        keys.append(found)
    return pattern_of_keys(order, position, keys)


def _pairs(groups: tuple[Ints, ...]) -> tuple[Ints, Ints]:
    """Pairs of vertices that share an element; -1 stands for none."""
    rows, columns = [], []
    for group in groups:
        for i in range(group.shape[1]):
            for j in range(i):
                both = (group[:, i] >= 0) & (group[:, j] >= 0)
                rows.append(group[both, i])
                columns.append(group[both, j])
    return np.concatenate(rows), np.concatenate(columns)
