"""Meshes of cells: one mesh of given cells, and the cells to begin with where a program chooses the mesh.

Not every pattern has every mesh, so `choices` lists cells in order, for whoever tries them until one can be made.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from meshes.cells import Cells, GmshCells, Kind, RuledCells
from meshes.curves import Array
from meshes.errors import MeshError
from meshes.mesh import SheetMesh
from meshes.pattern import CreasePattern, sheet_polygon
from meshes.structured import structured
from meshes.tapered import tapers

# rad that an edge of level 1 turns at the most: of wide panels cells as wide as high are no curves
TURN = 0.4
TAPERED = (
    16  # columns of level 1 of panels with tips: twice as many as fewer than that are no finer mesh there
)
FALLBACK: tuple[Kind, ...] = ("staggered", "alternating")  # every pattern with rails has these


def cut(pattern: CreasePattern, cells: Cells) -> SheetMesh:
    """The mesh of a pattern that has these cells.

    Args:
        pattern: of the sheet.
        cells: as data.

    Raises:
        MeshError: the pattern has no such mesh.
    """
    if isinstance(cells, RuledCells):
        return structured(pattern, kind=cells.kind, along=cells.along, rows=cells.rows)
    from meshes.unstructured import unstructured

    return unstructured(pattern, size=cells.size, near=cells.near, growth=cells.growth, seed=cells.seed)


def choices(pattern: CreasePattern, kind: Kind, level: float) -> Iterator[Cells]:
    """Cells of a level, the best first, for whoever tries them until one can be made.

    Level n has n rows of cells in every panel, about as wide as high, or less where the curves turn by more than
    `TURN` / n along them; a level below one has one row of longer cells. Cells that are shorter along the creases
    come next, then more rows, then other cuts into triangles, then gmsh.

    Args:
        pattern: of the sheet.
        kind: the way of cutting cells into triangles that is wanted.
        level: of refinement.
    """
    if pattern.rails:
        rows = max(1, round(level))
        along = _along(pattern, level)
        for way in dict.fromkeys((kind, *FALLBACK)):
            for more in (1, 2):
                yield from (RuledCells(way, along * finer * more, rows * more) for finer in (1, 2, 4))
    size = panel_width(pattern) / level
    yield from (GmshCells(size / finer) for finer in (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0))


def first_mesh(pattern: CreasePattern, kind: Kind = "staggered") -> SheetMesh:
    """A coarse mesh of any pattern: to have its places by name before it is solved on others.

    Args:
        pattern: of the sheet.
        kind: the way of cutting cells into triangles that is tried first.

    Raises:
        MeshError: there is none.
    """
    first: MeshError | None = None
    for cells in choices(pattern, kind, 1.0):
        try:
            return cut(pattern, cells)
        except MeshError as error:
            first = first or error
    assert first is not None
    raise first


def _along(pattern: CreasePattern, level: float) -> int:
    """Cells along a crease that are about as wide as the rows of a level are high."""
    u = np.linspace(0.0, 1.0, 65)
    rails = pattern.rails
    lengths = np.array([rail.length for rail in rails])
    heights = np.array([np.linalg.norm(b.point(u) - a.point(u), axis=1).mean() for a, b in pairwise(rails)])
    shape = float(np.mean(heights / (0.5 * (lengths[:-1] + lengths[1:]))))
    turning = max((_turning(rail.point(np.linspace(0.0, 1.0, 257))) for rail in rails), default=0.0)
    least = math.ceil(max(level * turning / TURN, max(level, 1.0) * TAPERED if tapers(pattern) else 0.0))
    return max(3 if pattern.closed else 1, least, round(min(level / shape, 1e6)))


def _turning(points: Array) -> float:
    """By how much a curve of (n, 2) points turns, left and right added up, rad."""
    angles = np.unwrap(np.arctan2(*np.diff(points, axis=0).T[::-1]))
    return float(np.abs(np.diff(angles)).sum())


def panel_width(pattern: CreasePattern) -> float:
    """Width of a typical panel, mm: of the sheet's area over its creases and half of its rim."""
    sheet = sheet_polygon(pattern.rings)
    lines = 0.5 * float(sheet.length) + sum(crease.curve.length for crease in pattern.creases)
    return max(float(sheet.area) / lines, 2.0 * math.sqrt(float(sheet.area)) / 1e3)
