"""Case `consistent`: patch tests, plates, Cook's panel and the strips of 3.4.1 by the consistent formulation."""

from __future__ import annotations

from typing import get_args

from bh import Sheet
from meshes.cells import Kind
from verification.framework.checks import CaseResult, Context, Cost, line, plot
from verification.studies.solver import plates
from verification.studies.solver.patch_tests import (
    CURVATURES,
    STRETCHES,
    bending_error,
    distorted,
    stretching_error,
)
from verification.theory import plates as theory

RATIOS = (0.0, 0.3, 0.49)
KINDS: tuple[Kind, ...] = get_args(Kind)
MORLEY = "second order: Morley's element (Lascaux and Lesaint 1975; Shi 1990)"
STRIPS = "source 3.4.1; theory of beams and St Venant"


def run(context: Context) -> CaseResult:
    """All of them, over mesh patterns, Poisson's ratios and densities."""
    result = CaseResult(
        name="consistent",
        title="The consistent formulation on plates and strips",
        question="Does it reproduce constant states exactly on any mesh, and converge at the rates of its elements?",
        source="docs/formulation.md; Timoshenko and Woinowsky-Krieger 1959; Cook 1974",
    )
    _patch_tests(result, context)
    _square_plates(result, context)
    _cook(result, context)
    _strips(result, context)
    return result


def _patch_tests(result: CaseResult, context: Context) -> None:
    context.tell("consistent: patch tests")
    for kind in KINDS:
        for nu in (0.0, 0.38):
            sheet = Sheet(E=1000.0, t=0.1, nu=nu)
            mesh = distorted(kind, seed=1)
            found = {name: stretching_error(mesh, sheet, F) for name, F in STRETCHES.items()}  # type: ignore[arg-type]
            found |= {name: bending_error(mesh, sheet, kappa) for name, kappa in CURVATURES.items()}  # type: ignore[arg-type]
            for state, error in found.items():
                result.check(
                    "patch test, largest relative error",
                    max(error.energy, error.inside),
                    reference=0.0,
                    source="exact state",
                    tolerance=1e-10,
                    params={"state": state, "mesh": kind, "nu": nu, "distorted": True},
                    path=Cost(unknowns=error.unknowns, iterations=1),
                )


def _square_plates(result: CaseResult, context: Context) -> None:
    cells = (8, 16) if context.quick else (8, 16, 32)
    exact = {"simply supported": theory.simply_supported_uniform(), "clamped": theory.CLAMPED_UNIFORM}
    for edge, reference in exact.items():
        series = []
        for kind in KINDS:
            for nu in RATIOS:
                context.tell(f"consistent: plate, {edge}, {kind}, nu = {nu}")
                found = [plates.square_plate(n, kind, nu, edge == "clamped") for n in cells]
                params = {"edge": edge, "mesh": kind, "nu": nu, "cells": cells[-1]}
                quantity = "deflection of a square plate, D w / (q a^4)"
                result.check(
                    quantity,
                    found[-1].value,
                    reference=reference,
                    source="Timoshenko and Woinowsky-Krieger 1959",
                    tolerance=0.035 if cells[-1] >= 32 else 0.13,
                    params=params,
                    path=Cost(unknowns=found[-1].unknowns, iterations=1),
                )
                errors = [answer.value / reference - 1.0 for answer in found]
                result.check(
                    "order of convergence of a square plate",
                    plates.rates(errors)[-1],
                    reference=2.0,
                    source=MORLEY,
                    tolerance=0.05,
                    params=params,
                )
                if nu == 0.3:
                    series.append(line(kind, [float(n) for n in cells], [abs(e) for e in errors]))
        result.plots.append(
            plot(
                f"plate-{edge.replace(' ', '-')}",
                f"Square plate, {edge}, nu = 0.3",
                "cells a side",
                "relative error",
                series,
                "Error of the deflection of the centre under a uniform load.",
                log="xy",
            )
        )


def _cook(result: CaseResult, context: Context) -> None:
    cells = (8, 16, 32) if context.quick else (8, 16, 32, 64)
    series = []
    for kind in KINDS:
        context.tell(f"consistent: Cook's panel, {kind}")
        found = [plates.cooks_panel(n, kind) for n in cells]
        errors = [answer.value / theory.COOK - 1.0 for answer in found]
        params = {"mesh": kind, "cells": cells[-1]}
        result.check(
            "Cook's panel, tip deflection",
            found[-1].value,
            unit="mm",
            reference=theory.COOK,
            source="Cook 1974",
            tolerance=0.01 if cells[-1] >= 64 else 0.035,
            params=params,
            path=Cost(unknowns=found[-1].unknowns, iterations=1),
        )
        result.check(
            "Cook's panel, order of convergence",
            plates.rates(errors)[-1],
            reference=1.75,
            source="between second order and 1.5 of the singular corner, which smoothed strains come down to",
            tolerance=0.15,
            params=params,
        )
        series.append(line(kind, [float(n) for n in cells], [abs(e) for e in errors]))
    result.plots.append(
        plot(
            "cook",
            "Cook's panel",
            "cells a side",
            "relative error",
            series,
            "Error of the tip deflection.",
            log="xy",
        )
    )


def _strips(result: CaseResult, context: Context) -> None:
    rows = (1, 2, 4) if context.quick else (1, 2, 4, 8)
    for load in ("tension", "torsion", "bending_out_of_plane", "bending_in_plane"):
        series = []
        for kind in KINDS:
            context.tell(f"consistent: strip, {load}, {kind}")
            found = [plates.strip_ratio(load, kind, n) for n in rows]
            for n, answer in zip(rows, found, strict=True):
                tolerance = 0.01 if load in ("tension", "torsion") or n >= 4 else None
                if load == "bending_in_plane":  # constant strain: second order in the rows, from far
                    tolerance = 0.08 if n >= 8 else None
                result.check(
                    f"strip, {load.replace('_', ' ')}",
                    answer.value,
                    unit="U / U_Th",
                    reference=1.0,
                    source=STRIPS,
                    tolerance=tolerance,
                    params={"mesh": kind, "rows": n, "alpha": 1.0},
                    path=Cost(unknowns=answer.unknowns, iterations=1),
                )
            series.append(line(kind, [float(n) for n in rows], [answer.value for answer in found]))
        series.append(line("theory", [float(n) for n in rows], [1.0] * len(rows), "reference"))
        result.plots.append(
            plot(
                f"consistent-strip-{load}",
                load.replace("_", " "),
                "rows of cells",
                "U / U_Th",
                series,
                "Energy of the strip over theory at equal displacement, cells of aspect ratio 1.",
                log="x",
            )
        )
