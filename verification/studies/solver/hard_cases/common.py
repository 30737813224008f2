"""What the hard cases share: a record, the usual sheet, and a second answer by finer increments."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

import meshes
from bh import Model, Path, Sheet

Array = NDArray[np.float64]


def located(path: Path, kind: str) -> list[tuple[float, Array]]:
    """Lambda and node positions (n, 3), mm, of every "limit" or "bifurcation" point that the path has passed."""
    systems = {record.step: path.solved(index)[0] for index, record in enumerate(path.records)}
    return [
        (at.lam, systems[step].positions(at.q, at.lam))
        for step, at in path.critical_points
        if at.kind == kind
    ]


def annulus(along: int = 48, t: float = 0.127, kind: Any = "staggered", **sector: float) -> Model:
    """A free creased sector: radius 100, width 10 each side, 45 degrees unless said otherwise."""
    size: dict[str, Any] = {"radius": 100.0, "width": 10.0, "angle": math.pi / 4, **sector}
    return Model(
        meshes.structured(meshes.annulus_sector(**size), along=along, kind=kind),
        Sheet(E=4000.0, t=t),
        formulation="bars-and-hinges",
        contact=False,
    )
