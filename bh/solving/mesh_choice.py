"""The meshes of a run to an accuracy: a first one that can be made and solved, and its cells halved again and again.

Not every pattern has the mesh that a formulation would begin with: chords of coarse cells cross, a curved edge turns a
triangle of the shell inside out, tapered panels have no mirrored cells, a pinched zone is shorter than two edges. Then
finer cells along are tried, more rows, other cuts and gmsh, in the order of `meshes.choices.choices`, and what was
taken is noted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from bh.errors import TooCoarseError
from bh.paths.path import Path
from meshes import CreasePattern, MeshError, SheetMesh
from meshes.cells import Cells, Kind
from meshes.choices import choices, cut

Solve = Callable[[SheetMesh, Cells], Path]


@dataclass
class Ladder:
    """Meshes of one formulation, each with cells half as large as the one before.

    Attributes:
        pattern: of the sheet.
        kind: the mesh pattern that the formulation asks for.
        level: of the first mesh.
        notes: what could not be made, and what was taken; one line each.
    """

    pattern: CreasePattern
    kind: Kind
    level: float
    notes: list[str] = field(default_factory=list)
    _cells: Cells | None = None

    def solve(self, step: int, how: Solve) -> tuple[Path, Cells]:
        """Solve mesh number `step` of the ladder, from 0.

        Where the mesh cannot be made for the formulation, the next choice is taken. All meshes of a ladder that was
        begun are of one choice, as an estimate needs them.

        Args:
            step: number of the mesh.
            how: solves a model on it.

        Returns:
            the path and the cells of its mesh.

        Raises:
            MeshError: no mesh of this pattern can be made for the formulation (what was wrong with the first), or the
                ladder was begun and its next mesh cannot be made.
            TooCoarseError: what is asked of the sheet needs a finer mesh than any that was tried.
        """
        if self._cells is not None:
            cells = self._cells.refined(2**step)
            return how(cut(self.pattern, cells), cells), cells
        first: MeshError | TooCoarseError | None = None
        for cells in choices(self.pattern, self.kind, self.level):
            try:
                path = how(cut(self.pattern, cells), cells)
            except (MeshError, TooCoarseError) as error:
                first = first or error
                continue
            self._cells = cells
            if first is not None:
                self.notes.append(f"the mesh to begin with could not be made ({_why(first)}); took {cells}")
            return path, cells
        assert first is not None
        raise first


def _why(error: MeshError | TooCoarseError) -> str:
    return str(error).split(";")[0]
