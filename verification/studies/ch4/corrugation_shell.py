"""A corrugation folded, and bent by a force in its middle, by the shell and by the consistent formulation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

import meshes
from bh import Model, Path, trace
from bh.applications.corrugation.folding import LSTAR, POLYESTER
from bh.formulations.observables import depth_of
from verification.framework.checks import CaseResult, Cost

REST, LOAD = 1.0, 1.0  # rad; N
SOURCE = "shell (fem) on its own mesh"


@dataclass(frozen=True)
class Bent:
    """Depth (mm), energy (N mm) folded, and how far the load goes down (mm)."""

    path: Path
    depth: float
    energy: float
    deflection: float


def bent(formulation: str, along: int, rows: int) -> Bent:
    """The parabolic-edge corrugation on three points: the ends of its first valley and the top of its outer edge.

    They hold the six rigid motions and nothing else, while all creases fold and while a dead force then presses on the
    top of the second mountain.
    """
    mesh = meshes.structured(meshes.corrugation("parabolic-edge"), along=along, rows=rows)
    ends = mesh.nodes("crease:crease-2")[[0, -1]].tolist()

    def top(place: str) -> int:
        nodes = mesh.nodes(place)
        return int(nodes[np.argmin(np.abs(mesh.points[nodes, 0]))])

    under = top("crease:crease-3")
    model = Model(mesh, POLYESTER, formulation=formulation, contact=False)
    model = model.support(ends[:1]).support(ends[1:], "yz").support([top("edge:outer")], "z")
    path = trace(model.fold("all", by=REST, Lstar=LSTAR).force([under], total=(0.0, 0.0, -LOAD)))
    folded = path[max(i for i, record in enumerate(path.records) if record.step == 0)]
    down = float(folded.points[under, 2] - path[-1].points[under, 2])
    return Bent(path, depth_of(folded)[0], folded.energy.total, down)


def against_shell(result: CaseResult, quick: bool) -> None:
    """Checks of depth, energy and deflection."""
    judge = bent("shell", 24, 2) if quick else bent("shell", 48, 4)
    finest = ("consistent", 36, 3) if quick else ("consistent", 96, 8)
    for formulation, along, rows in (("consistent", 32, 2), finest, ("bars-and-hinges", 32, 2)):
        found = bent(formulation, along, rows)
        params: dict[str, Any] = {
            "kind": "parabolic-edge",
            "formulation": formulation,
            "along": along,
            "rows": rows,
        }
        judged = (formulation, along, rows) == finest
        outcome = judge.path.outcome if not judge.path.reached else found.path.outcome
        took = Cost.of(found.path, outcome=outcome)
        for name, value, exact, unit in (
            ("depth, folded by rest angles of 1 rad", found.depth, judge.depth, "mm"),
            ("energy, folded by rest angles of 1 rad", found.energy, judge.energy, "N mm"),
            ("deflection under 1 N on the second mountain", found.deflection, judge.deflection, "mm"),
        ):
            result.check(
                name,
                value,
                unit=unit,
                reference=exact,
                source=SOURCE,
                tolerance=0.05 if judged else None,
                params=params,
                path=took,
            )
