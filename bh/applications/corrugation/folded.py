"""A folded corrugation that lies down."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bh.model.model import Sheet
from bh.paths.path import Path
from meshes import SheetMesh

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Folded:
    """A corrugation folded to a depth, free of all loads, and laid down.

    Its mountains touch the plane z = depth from below and its valleys z = 0 from above; the middle of its extent is
    over the origin, and the y axis is that of the pattern.

    Attributes:
        path: the path that folded it; its last state lies as described.
        depth: mm.
    """

    path: Path
    depth: float

    @property
    def mesh(self) -> SheetMesh:
        return self.path.model.mesh

    @property
    def sheet(self) -> Sheet:
        return self.path.model.sheet

    @cached_property
    def points(self) -> Array:
        """(n, 3) nodes of the folded sheet, mm."""
        return self.path[-1].points


def moved_to(path: Path, points: Array) -> Path:
    """The path of a free sheet with its last state moved rigidly to `points` (n, 3)."""
    system, record = path.solved()
    q = record.q.copy()
    q[: system.moving] = system.loads(points - path.model.mesh.points)[: system.moving]
    other = Path(path.model, path.provenance)
    other.records = [*path.records[:-1], replace(record, q=q)]
    other.steps = list(path.steps)
    return other
