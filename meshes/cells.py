"""How a pattern is cut into cells, as data: made again, made twice as fine or twice as coarse.

A mesh that `structured` or `unstructured` made remembers its cells (`SheetMesh.cells`), so that it can be refined in
the only way from which an error can be told: every cell halved in both directions, the pattern of the triangles kept.
`choices` lists the cells to begin with, in order, where a program chooses the mesh: not every pattern has every mesh.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np

from meshes.curves import Array
from meshes.errors import MeshError
from meshes.pattern import CreasePattern

if TYPE_CHECKING:
    from meshes.mesh import SheetMesh

Kind = Literal["staggered", "alternating", "one-way", "mirrored"]
TURN = (
    0.4  # rad that an edge of level 1 turns at the most: of wide panels cells as wide as high are no curves
)
TAPERED = 16  # columns of level 1 of panels with tips: twice as many as fewer than that are no finer mesh there
FALLBACK: tuple[Kind, ...] = ("staggered", "alternating")  # every pattern with rails has these


@dataclass(frozen=True)
class RuledCells:
    """Cells between rails; see `meshes.structured.structured`.

    Attributes:
        kind: how cells are cut into triangles.
        along: number of cells along a crease.
        rows: of cells between neighbouring rails.
    """

    kind: Kind
    along: int
    rows: int = 1

    def mesh(self, pattern: CreasePattern) -> SheetMesh:
        """The mesh (MeshError where there is none)."""
        from meshes.structured import structured

        return structured(pattern, kind=self.kind, along=self.along, rows=self.rows)

    def refined(self, times: int = 2) -> RuledCells:
        """Cells that are `times` as short and as low."""
        return replace(self, along=times * self.along, rows=times * self.rows)

    def coarsened(self) -> RuledCells | None:
        """Half the rows of cells, or a part where the number is odd, and as much less along; None of one row."""
        if self.rows == 1:
            return None
        rows = self.rows // 2
        return replace(self, along=max(1, round(self.along * rows / self.rows)), rows=rows)

    def __str__(self) -> str:
        return f"{self.along} x {self.rows} {self.kind} cells"


@dataclass(frozen=True)
class GmshCells:
    """Triangles of about one size, smaller near named lines; see `meshes.unstructured.unstructured`.

    Attributes:
        size: length of an edge, mm.
        near: shorter edges at named lines, mm.
        growth: how fast edges grow away from these, mm a mm.
        seed: of gmsh's small random shifts.
    """

    size: float
    near: Mapping[str, float] = field(default_factory=dict)
    growth: float = 0.3
    seed: int = 1

    kind = "gmsh"

    def mesh(self, pattern: CreasePattern) -> SheetMesh:
        """The mesh (MeshError where there is none)."""
        from meshes.unstructured import unstructured

        return unstructured(pattern, size=self.size, near=self.near, growth=self.growth, seed=self.seed)

    def refined(self, times: float = 2) -> GmshCells:
        """Edges that are `times` as short everywhere."""
        near = {name: size / times for name, size in self.near.items()}
        return replace(self, size=self.size / times, near=near)

    def coarsened(self) -> GmshCells:
        """Edges that are twice as long everywhere."""
        return self.refined(0.5)

    def __str__(self) -> str:
        return f"gmsh, {self.size:.3g} mm"


Cells = RuledCells | GmshCells


def choices(pattern: CreasePattern, kind: Kind, level: float) -> Iterator[Cells]:
    """Cells of a level, the best first, for whoever tries them until one can be made.

    Level n has n rows of cells in every panel, about as wide as high, or less where the curves turn by more than
    `TURN` / n along them; a level below one has one row of longer cells. Cells that are shorter along the creases
    come next, then more rows, then other cuts into triangles, then gmsh.
    """
    if pattern.rails:
        rows = max(1, round(level))
        along = _along(pattern, level)
        for cut in dict.fromkeys((kind, *FALLBACK)):
            for more in (1, 2):
                yield from (RuledCells(cut, along * finer * more, rows * more) for finer in (1, 2, 4))
    size = panel_width(pattern) / level
    yield from (GmshCells(size / finer) for finer in (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0))


def first_mesh(pattern: CreasePattern, kind: Kind = "staggered") -> SheetMesh:
    """A coarse mesh of any pattern: to have its places by name before it is solved on others.

    Raises:
        MeshError: there is none.
    """
    first: MeshError | None = None
    for cells in choices(pattern, kind, 1.0):
        try:
            return cells.mesh(pattern)
        except MeshError as error:
            first = first or error
    assert first is not None
    raise first


def _along(pattern: CreasePattern, level: float) -> int:
    """Cells along a crease that are about as wide as the rows of a level are high."""
    from meshes.tapered import tapers

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
    import shapely

    sheet = shapely.Polygon(pattern.rings[0], holes=list(pattern.rings[1:]))
    lines = 0.5 * float(sheet.length) + sum(crease.curve.length for crease in pattern.creases)
    return max(float(sheet.area) / lines, 2.0 * math.sqrt(float(sheet.area)) / 1e3)
