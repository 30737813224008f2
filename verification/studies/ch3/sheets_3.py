"""Case `sheets_3` (source 3.4-3.5): sheets of Chapter 3 as they fold, by three formulations, to be turned."""

from __future__ import annotations

import math
from typing import Literal

import meshes
from bh import Model, Sheet
from meshes import CreasePattern
from meshes.cells import Kind
from verification.framework.checks import CaseResult, Context
from verification.framework.folded_frames import by_every_formulation, store

CASE = "sheets_3"
SHEET = Sheet(E=4000.0, nu=0.38, t=0.127)
ANGLE = math.pi / 2
LSTAR = 25.0  # mm
CREASES = (80.0, 90.0, 100.0, 110.0, 120.0)  # radii of the pleats, mm
FOLDS: tuple[Literal["mountain", "valley"], ...] = ("mountain", "valley", "mountain", "valley", "mountain")
TOLERANCE = {False: 0.03, True: 0.08}  # of the shell's energy; quick meshes are twice as coarse


def run(context: Context) -> CaseResult:
    """A free annulus with a spring crease, and five pleats folded exactly; energies at the end against the shell's."""
    result = CaseResult(
        name=CASE,
        title="Sheets of Chapter 3 as they fold",
        question="Do three formulations fold a free annulus and a pleated one into the same shapes?",
        source="source 3.4.2 and 3.5.3; the shell on the same sheet is the reference",
    )
    along = 16 if context.quick else 32
    annulus = meshes.annulus_sector(100.0, 10.0, math.pi)
    pleats = meshes.annulus_sector(CREASES, 10.0, ANGLE, folds=FOLDS)
    for name, pattern, fold, cells, what in (
        (
            "annulus",
            annulus,
            _spring,
            2 * along,
            "Half an annulus, its crease a spring that wants 90 degrees",
        ),
        ("pleats", pleats, _exactly, 3 * along // 2, "Five pleats, folded by 90 degrees"),
    ):
        params = {"sheet": name, "along": cells}

        def model(
            formulation: str, rows: int, kind: Kind, pattern: CreasePattern = pattern, cells: int = cells
        ) -> Model:
            mesh = meshes.structured(pattern, along=cells, rows=rows, kind=kind)
            return Model(mesh, SHEET, formulation=formulation, contact=False)

        paths = by_every_formulation(result, context, name, model, fold, params, TOLERANCE[context.quick])
        store(result, context, f"{CASE}_{name}", paths, what, f"{what}; the sheet is free.", what)
    return result


def _spring(model: Model, fraction: float) -> Model:
    return model.fold("crease", rest=math.pi - fraction * ANGLE, Lstar=LSTAR)


def _exactly(model: Model, fraction: float) -> Model:
    return model.fold("all", by=fraction * ANGLE)
