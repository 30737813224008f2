"""What the hard cases share: a record, the usual sheet, and a second answer by finer increments."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

import meshes
from bh import Model, Path, Sheet
from verification.framework.checks import Check, cost_of

Found = Iterator[Check]
Array = NDArray[np.float64]


def check(
    quantity: str, value: float, unit: str, reference: float | None, source: str, tolerance: float | None,
    path: Path | None = None, **params: Any,
) -> Check:  # fmt: skip
    """A record of this case, with what the path cost that the value was read from."""
    cost = {} if path is None else cost_of(path)
    outcome = "reached" if path is None else path.outcome
    return Check(
        "hard_cases", quantity, params, value, unit, reference, source, tolerance, outcome=outcome, **cost
    )


def located(path: Path, kind: str) -> list[tuple[float, Array]]:
    """Lambda and node positions (n, 3), mm, of every "limit" or "bifurcation" point that the path has passed."""
    return [
        (at.lam, path._system(step).positions(at.q, at.lam))
        for step, at in path.critical_points
        if at.kind == kind
    ]


def annulus(along: int = 48, t: float = 0.127, kind: Any = "staggered", **sector: float) -> Model:
    """A free creased sector: radius 100, width 10 each side, 45 degrees unless said otherwise."""
    size: dict[str, Any] = {"radius": 100.0, "width": 10.0, "angle": math.pi / 4, **sector}
    return Model(
        meshes.structured(meshes.annulus_sector(**size), along=along, kind=kind), Sheet(E=4000.0, t=t)
    )
