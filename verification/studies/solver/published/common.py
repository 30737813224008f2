"""What the studies of closed forms share: values on finer and finer meshes against one reference."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bh.analysis.richardson import judged
from meshes import SheetMesh
from verification.framework.checks import CaseResult, Cost, Solved


def strip_mesh(lines: Sequence[float], breadth: float, along: int, creases: Mapping[str, float]) -> SheetMesh:
    """A strip along y, cut across at any heights: cells as long as it pleases, diagonals in turn.

    Args:
        lines: rising heights y of the node lines, mm.
        breadth: along x, mm.
        along: cells along x.
        creases: heights of node lines that are creases, by name.
    """
    x = np.linspace(0.0, breadth, along + 1)
    points = np.array([(a, b) for b in lines for a in x])
    node = np.arange(len(points)).reshape(len(lines), along + 1)
    triangles = []
    for j in range(len(lines) - 1):
        for i in range(along):
            a, b, c, d = node[j, i], node[j, i + 1], node[j + 1, i + 1], node[j + 1, i]
            triangles += [(a, b, c), (a, c, d)] if (i + j) % 2 == 0 else [(a, b, d), (b, c, d)]
    at = {name: int(np.argmin(np.abs(np.asarray(lines) - y))) for name, y in creases.items()}
    sets = {f"crease:{name}": np.column_stack((node[k, :-1], node[k, 1:])) for name, k in at.items()}
    sets |= {
        f"edge:{name}": np.column_stack((node[k, :-1], node[k, 1:]))
        for name, k in (("inner", 0), ("outer", -1))
    }
    return SheetMesh(
        points=points, triangles=np.array(triangles), edge_sets=sets, folds=dict.fromkeys(creases, "mountain")
    )


LEAST_LEVELS = 3  # fewer show no order


@dataclass(frozen=True)
class Level:
    """What one mesh gave.

    Attributes:
        mesh: in words.
        size: of its cells, in any unit.
        value: of the quantity; nan where the path did not get there.
        path: that it was read from.
    """

    mesh: str
    size: float
    value: float
    path: Solved


@dataclass(frozen=True)
class Claim:
    """One closed form.

    Attributes:
        quantity: in words.
        reference: what it should be.
        source: where that comes from.
        tolerance: relative, of the limit of the consistent formulation and of the shell; None only reports.
        params: what tells it from others of the same quantity.
        unit: of the values.
        finest: relative tolerance of the finest mesh itself, or None.
    """

    quantity: str
    reference: float
    source: str
    tolerance: float | None
    params: Mapping[str, Any]
    unit: str = ""
    finest: float | None = None


def converged(result: CaseResult, claim: Claim, levels: Sequence[Level]) -> None:
    """Values of the consistent formulation on every mesh, their order, and their limit against the closed form.

    Where the values show no order the limit is the finest value, and the order is reported as 0.

    Args:
        result: where the checks go.
        claim: the closed form.
        levels: coarse to fine.
    """
    params = {**claim.params, "formulation": "consistent"}
    for level in levels:
        result.check(
            claim.quantity,
            level.value,
            unit=claim.unit,
            reference=claim.reference,
            source=claim.source,
            tolerance=claim.finest if level is levels[-1] else None,
            params={**params, "mesh": level.mesh},
            path=level.path,
        )
    if len(levels) < LEAST_LEVELS:
        return
    values = [level.value for level in levels]
    if not all(map(math.isfinite, values)):
        result.check(
            f"{claim.quantity}, limit",
            math.nan,
            reference=claim.reference,
            tolerance=claim.tolerance,
            params=params,
        )
        return
    seen = judged(values, [level.size for level in levels])
    took = Cost.of(levels[-1].path)
    result.check(
        f"{claim.quantity}, limit",
        seen.limit.value,
        unit=claim.unit,
        reference=claim.reference,
        source=claim.source,
        tolerance=claim.tolerance,
        params={**params, "left unknown": seen.limit.bar, "seen": str(seen.verdict)},
        path=took,
    )
    order = seen.limit.rate if math.isfinite(seen.limit.rate) else 0.0
    result.check(f"{claim.quantity}, observed order", order, params={**params, "seen": str(seen.verdict)})


def by_shell(result: CaseResult, claim: Claim, level: Level) -> None:
    """The shell's value on one mesh against the closed form.

    Args:
        result: where the check goes.
        claim: the closed form.
        level: its mesh.
    """
    result.check(
        claim.quantity,
        level.value,
        unit=claim.unit,
        reference=claim.reference,
        source=claim.source,
        tolerance=claim.tolerance,
        params={**claim.params, "formulation": "shell", "mesh": level.mesh},
        path=level.path,
    )
