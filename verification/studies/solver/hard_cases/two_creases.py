"""Two creases of different curvature in one rectangle (source 3.4.4, Fig. 3.8 d-f).

The source tells neither the sizes nor the senses of the folds. Here the square is 100 mm wide and 0.274 mm thick (its
paper models of 3.4.3), the radii are 80 and 250 mm, and both readings are tried: creases of one sense, which fight
each other, and of opposite senses.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

import meshes
from bh import Model, Sheet, trace
from bh.solvers.outcome import Outcome
from meshes.pattern import CreasePattern, FoldKind
from verification.framework.checks import CaseResult, line, plot
from verification.studies.solver.campaign import FINE

SIDE, RADII, HEIGHTS = 100.0, (80.0, 250.0), (35.0, 70.0)
STIFF_TO_SOFT = (0.01, 1.0, 10.0, 100.0)
SOURCE = "source 3.4.4: the crease of high curvature nears its rest angle only where it is far stiffer than real ones"


def rectangle(folds: tuple[FoldKind, FoldKind]) -> CreasePattern:
    """A square with two arcs that bulge the same way, the more curved one below."""
    return meshes.two_arcs(SIDE, SIDE, RADII, HEIGHTS, folds)


def folded(folds: tuple[FoldKind, FoldKind], Lstar: float, by: float, along: int = 40) -> Model:
    """Both creases folded by the angle `by` (rad) as drawn, springs of length scale `Lstar` (mm)."""
    mesh = meshes.structured(rectangle(folds), along=along)
    return Model(mesh, Sheet(E=4000.0, t=0.274), formulation="bars-and-hinges", contact=False).fold(
        "all", by=by, Lstar=Lstar
    )


def two_creases(result: CaseResult) -> None:
    """Rest angles from flat to 30 degrees (60 where the creases fight), L* over four decades."""
    series = []
    for folds, by in (
        (("mountain", "valley"), 5.0 * math.pi / 6.0),
        (("mountain", "mountain"), 2.0 * math.pi / 3.0),
    ):
        senses = " and ".join(folds)
        short = []  # of the rest angle, crease by crease
        for Lstar in STIFF_TO_SOFT:
            path = trace(folded(folds, Lstar, by))  # type: ignore[arg-type]
            fine = trace(folded(folds, Lstar, by), strategy=FINE)  # type: ignore[arg-type]
            result.check(
                "two creases: total energy",
                path[-1].energy.total,
                unit="N mm",
                reference=fine[-1].energy.total,
                source="four times finer increments",
                tolerance=1e-7,
                params={"folds": senses, "Lstar_mm": Lstar},
                path=path,
            )
            angles = [[abs(float(state.fold_angle(f"crease-{i}").mean())) for state in path] for i in (1, 2)]
            short.append([1.0 - angle[-1] / by for angle in angles])
            if folds[1] == "mountain":
                rest = np.degrees(by * path.lambdas).tolist()
                series += [
                    line(f"{name}, L* = {Lstar:g} mm", rest, np.degrees(angle).tolist())
                    for name, angle in zip(("curved", "straighter"), angles, strict=True)
                ]
        result.check(
            "two creases: share of its fold that the curved crease lacks at L* = 0.01",
            short[0][0],
            source=SOURCE,
            params={"folds": senses},
        )
        ordered = all(a[0] < b[0] for a, b in pairwise(short)) and all(abs(s[1]) < s[0] for s in short)
        result.check(
            "two creases: the curved one lags more, and more so the softer",
            ordered,
            reference=1.0,
            source=SOURCE,
            tolerance=0.0,
            params={"folds": senses},
        )
    # beyond about 145 degrees the panel inside the curved crease crumples: whatever happens has to be named
    path = trace(folded(("mountain", "mountain"), 0.01, 5.0 * math.pi / 6.0))
    named = path.outcome in (Outcome.REACHED, Outcome.LIMIT_POINT, Outcome.BIFURCATION, Outcome.CONTACT)
    result.check(
        "two creases: rigid springs of one sense to 150 degrees, reached or the reason named",
        named,
        reference=1.0,
        source="an outcome that names the reason",
        tolerance=0.0,
        params={"furthest": round(path[-1].lam, 4)},
    )
    result.plots.append(
        plot(
            "hard-two-creases",
            "Two creases of different curvature",
            "rest fold angle, degrees",
            "mean fold angle, degrees",
            series,
            "Both mountain, radii 80 and 250 mm in a 100 mm square (Fig. 3.8).",
        )
    )
