"""Pinches by couples and by rest angles, and the four patterns of 5.5.3 (docs/pinching.md)."""

from __future__ import annotations

import math

import bh
import meshes
from bh.applications.pinching import PATTERNS, respond
from verification.framework.checks import CaseResult, reached_energy
from verification.studies.ch5.pinch_shell import SHELL
from verification.studies.ch5.pinching import pinched

LEFT, ZONE, COUPLE = math.pi / 14.0, 20.0, 150.0  # rad, mm, N mm / mm
KAPPA = 0.01  # 1 / mm
GRIPPED = ((50, 1), (100, 2), (200, 4), (400, 8))  # cells
LOOSE = (("consistent", 1), ("consistent", 2), ("bars-and-hinges", 1))
STOCK = ((0.5, 2.0), (0.1, 0.5))  # t and L* of the source, mm


def pinches(result: CaseResult, quick: bool) -> None:
    """Energies of a grip by couples, angles that a pinch by rest angles comes to, bend and twist of four patterns.

    Args:
        result: gets the checks.
        quick: with the coarsest meshes.
    """
    for along, rows in GRIPPED[: 1 if quick else 4]:
        model = folded("consistent", along, rows, 0.5, 2.0)
        path = bh.trace(
            model.pinch("crease", at=0.5, to=LEFT, length=ZONE, how="couple", couple=COUPLE, profile="grip"),
            estimate=False,
            neighbours=False,
        )
        result.check(
            "energy of a sheet that couples grip",
            reached_energy(path),
            unit="N mm",
            params={"along": along, "rows": rows},
            path=path,
        )
    _curvature(result, quick)
    for formulation, rows in LOOSE:
        for t, Lstar in STOCK:
            model = folded(formulation, 100 * rows, rows, t, Lstar)
            model = model.pinch("crease", at=0.5, to=LEFT, length=ZONE, how="rest")
            path = bh.trace(model, estimate=False, neighbours=False)
            result.check(
                "angle that a pinch by rest angles comes to",
                math.degrees(float(path[-1].dihedral("crease").min())),
                unit="deg",
                params={"formulation": formulation, "rows": rows, "t": t, "Lstar": Lstar},
                path=path,
            )
    for name, pattern in PATTERNS.items():
        found = respond(pattern())
        for angle, value in (("bend", found.bend), ("twist", found.twist)):
            result.check(
                f"{angle} of a pattern of 5.5.3",
                math.degrees(value),
                unit="deg",
                params={"pattern": name},
                path=found.path,
            )


def _curvature(result: CaseResult, quick: bool) -> None:
    found = pinched(SHELL, (50, 1) if quick else (100, 2), KAPPA)
    inside = found.inside(found.crease.curvature)
    result.check(
        "largest curvature of a pinched crease over kappa_0",
        float(inside.max()) / KAPPA,
        source="closed to pi / 14 by a raised cosine of 20 mm",
        params={"formulation": "shell", "kappa_0_per_mm": KAPPA},
        path=found.path,
    )


def folded(formulation: str, along: int, rows: int, t: float, Lstar: float) -> bh.Model:
    """A sector whose crease is folded to 90 degrees by its spring.

    Args:
        formulation: name.
        along: cells along the crease.
        rows: of cells a panel.
        t: thickness, mm.
        Lstar: length scale of the crease, mm.
    """
    mesh = meshes.structured(
        meshes.annulus_sector(radius=100.0, width=5.0, angle=1.0), along=along, rows=rows
    )
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=t), formulation=formulation)
    return model.fold("crease", rest=0.5 * math.pi, Lstar=Lstar)
