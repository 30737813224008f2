"""Where the entries of displacements and edge rotations go: rotations are numbered with their edges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numba import njit

from bh.mechanics.consistent.elements import ConsistentElements
from bh.mechanics.shared.displacements import Displacements
from bh.mechanics.shared.kinematics import OPTIONS
from bh.mechanics.shared.sparsity import Pattern, Slots, build_pattern
from meshes import SheetMesh
from meshes.topology import Ints


def rotation_pattern(
    mesh: SheetMesh,
    e: ConsistentElements,
    displacements: Displacements,
    ground: int | None,
    contact: Ints | None = None,
) -> Pattern:
    """Pattern of triangles, patches, spring creases, locks and the triangle `ground`, if there is one.

    Rotations are numbered after the displacements. To the order of the unknowns
    every rotation is a node of its own, in the middle of its edge, with a single unknown.

    Args:
        mesh: of the sheet.
        e: its elements.
        displacements: their unknowns.
        ground: triangle that is held against rigid motions, or None.
        contact: (p, 2) pairs of nodes in contact, whose slots come last but for those of a coupling, or None.
    """
    number, _ = displacements.pattern_nodes(())
    n, moving = len(number), int(number.max()) + 1
    none = n + e.rotations
    table = np.full((none + 1, 3), -1, dtype=np.int64)
    table[:n] = number
    table[n:none, 0] = moving + np.arange(e.rotations)
    places = np.zeros((none + 1, 3))
    places[:n] = mesh.points
    has = e.rotation >= 0
    topology, hinges = mesh.topology, mesh.topology.hinges
    edge = topology.triangle_edges.ravel()[e.patches.half_edge[has]]
    ends = np.vstack((topology.edges[edge], np.repeat(e.hinges[:, 1:3], 2, axis=0)))
    at = np.concatenate((e.rotation[has], e.turns.ravel()))
    places[n + at] = mesh.points[ends].mean(axis=1)

    corners = e.nodes[:, (e.nodes >= 0).any(axis=0)]
    patches = np.hstack((np.where(corners >= 0, corners, none), np.where(has, n + e.rotation, none)))
    springs = np.hstack((e.hinges, n + e.turns))
    groups: tuple[Ints, ...] = (mesh.triangles, patches, springs, hinges)
    if ground is not None:
        groups += (mesh.triangles[[ground]],)
    if contact is not None:
        groups += (contact,)
    if e.coupling is not None:
        six = e.coupling.nodes
        groups += (np.hstack((np.where(six >= 0, six, none), np.where(has, n + e.rotation, none))),)
    pattern = build_pattern(table, displacements.pattern_nodes(groups)[1], places)
    triangles, wide, wide_springs, *rest = pattern.slots
    # of a rotation's three rows there only the first exists
    rows = np.zeros((len(patches), int(e.width.max())), dtype=np.int64)
    first = 3 * (corners >= 0).sum(axis=1)
    column = np.arange(rows.shape[1])
    rows[:] = np.where(column < first[:, None], column, 0)
    c, a = np.nonzero(has)
    rows[c, e.column[c, a]] = 3 * (corners.shape[1] + a)
    of_spring = np.tile(np.append(np.arange(13), 15), (len(springs), 1))
    if e.coupling is not None:
        twenty_one = np.tile(np.append(np.arange(19), [21, 24]), (len(e.rotation), 1))
        rest[-1] = _some_rows(rest[-1], twenty_one, np.full(len(twenty_one), 21))
    slots = (
        triangles,
        _some_rows(wide, rows, e.width),
        _some_rows(wide_springs, of_spring, np.full(len(springs), 14)),
        *rest,
    )
    return replace(pattern, slots=slots)


def _some_rows(slots: Slots, rows: Ints, width: Ints) -> Slots:
    """Slots of the lower entries of every element between `width` (e,) rising rows (e, w) of its matrix alone."""
    most = rows.shape[1]
    out = np.full((len(rows), most * (most + 1) // 2), -1, dtype=slots.dtype)
    _pick(slots, rows, width, out)
    return out


@njit(**OPTIONS)
def _pick(slots, rows, width, out):  # type: ignore[no-untyped-def]
    for e in range(len(rows)):
        at = 0
        for i in range(width[e]):
            for j in range(i + 1):
                out[e, at] = slots[e, rows[e, i] * (rows[e, i] + 1) // 2 + rows[e, j]]
                at += 1
