"""How a pattern is cut into cells, as data: made again, made twice as fine or twice as coarse.

A mesh that `structured` or `unstructured` made remembers its cells (`SheetMesh.cells`), so that it can be refined in
the only way from which an error can be told: every cell halved in both directions, the pattern of the triangles kept.
`meshes.choices` makes meshes of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

Kind = Literal["staggered", "alternating", "one-way", "mirrored"]


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
        """In words: "64 x 4 staggered cells"."""
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

    def refined(self, times: float = 2) -> GmshCells:
        """Edges that are `times` as short everywhere."""
        near = {name: size / times for name, size in self.near.items()}
        return replace(self, size=self.size / times, near=near)

    def coarsened(self) -> GmshCells:
        """Edges that are twice as long everywhere."""
        return self.refined(0.5)

    def __str__(self) -> str:
        """In words: "gmsh, 4 mm"."""
        return f"gmsh, {self.size:.3g} mm"


Cells = RuledCells | GmshCells
