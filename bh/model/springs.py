"""Springs to the ground: what the sheet rests on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.supports import select
from meshes import SheetMesh

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GroundSpring:
    """Springs along x, y and z from nodes to where they lie in the stress-free sheet, in all steps.

    Exactly one of `each`, `total` and `per_area` is given. Springs that begin at rest where a step finds the sheet are
    `bh.Tether`, which act in the step that names them.

    Attributes:
        at: name of a place, or node indices.
        each: (3,) stiffness of every node, N / mm.
        total: (3,) stiffness that the nodes share, N / mm.
        per_area: (3,) stiffness an area of sheet that belongs to the nodes, N / mm^3: an elastic foundation.
    """

    at: str | Sequence[int]
    each: Sequence[float] | None = None
    total: Sequence[float] | None = None
    per_area: Sequence[float] | None = None

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        given = [key for key in ("each", "total", "per_area") if getattr(self, key) is not None]
        if len(given) != 1:
            raise ModelError(
                f"spring at '{self.at}' needs exactly one of each, total and per_area, but has {given or 'none'}"
            )
        if not isinstance(self.at, str):
            object.__setattr__(self, "at", tuple(int(node) for node in self.at))
        values = getattr(self, given[0])
        good = not isinstance(values, str) and len(values) == 3
        if not (good and all(isinstance(v, int | float) and 0.0 <= v < math.inf for v in values)):
            raise ModelError(
                f"spring at '{self.at}': {given[0]} = {values} cannot be; give three stiffnesses [x, y, z], 0 or more"
            )
        object.__setattr__(self, given[0], tuple(float(value) for value in values))

    def stiffness(self, mesh: SheetMesh) -> Array:
        """(n, 3) stiffness of every node of a mesh along x, y and z, N / mm.

        Args:
            mesh: has the place.

        Raises:
            MeshError: there is no such place.
        """
        nodes = select(mesh, self.at)
        out = np.zeros_like(mesh.points)
        if self.per_area is not None:
            thirds = np.repeat(mesh.areas / 3.0, 3)
            area = np.bincount(mesh.triangles.ravel(), thirds, minlength=len(mesh.points))
            out[nodes] = area[nodes, None] * np.asarray(self.per_area)
        elif self.each is not None:
            out[nodes] = self.each
        else:
            out[nodes] = np.asarray(self.total, dtype=float) / len(nodes)
        return out


def ground_stiffness(springs: Sequence[GroundSpring], mesh: SheetMesh) -> Array:
    """(n, 3) stiffness of all springs together along x, y and z, N / mm.

    Args:
        springs: of a model.
        mesh: of its sheet.
    """
    total = np.zeros_like(mesh.points)
    for spring in springs:
        total += spring.stiffness(mesh)
    return total
