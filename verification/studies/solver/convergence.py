"""Case `convergence`: the folded annulus of App. B and the buckled full annulus by both formulations, over meshes."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import cast, get_args

import numpy as np

import meshes
from bh import Model, Path, Sheet, trace
from meshes import SheetMesh
from meshes.cells import Kind
from verification.framework.checks import CaseResult, Context, Cost, line, plot, reached_energy
from verification.studies.app_b import appendix_b

KINDS: tuple[str, ...] = (*get_args(Kind), "gmsh")
# cells along the crease and rows a side: halved again and again
LEVELS = ((16, 2), (32, 4), (64, 8), (128, 16))
DESIGN = ((32, 4, 0.03), (64, 12, 0.005))  # tolerances of the two meshes
BOTH = ("bars-and-hinges", "consistent")
RING = math.radians(150.0)  # dihedral angle of the full annulus


def sector(along: int, rows: int, kind: str) -> SheetMesh:
    """A mesh of the annulus sector of App. B; one by gmsh has edges as long as the rows are high."""
    pattern = meshes.annulus_sector(100.0, 10.0, math.pi / 4)
    if kind == "gmsh":
        return meshes.unstructured(pattern, size=10.0 / rows)
    return meshes.structured(pattern, along=along, rows=rows, kind=cast(Kind, kind))


def folded(mesh: SheetMesh, actuation: str, nu: float, name: str = "consistent") -> Path:
    """App. B (a) or (d) on a mesh."""
    model = replace(appendix_b.model(actuation), mesh=mesh, formulation=name)
    return trace(replace(model, sheet=Sheet(E=4000.0, nu=nu, t=0.127)))


def ring(along: int, rows: int, name: str) -> Path:
    """The full annulus folded until it has buckled into a saddle."""
    mesh = meshes.structured(meshes.full_annulus(100.0, 10.0), along=along, rows=rows)
    return trace(
        Model(mesh, Sheet(E=4000.0, nu=0.38, t=0.127), formulation=name, contact=False).fold(
            "crease", to=RING
        )
    )


def run(context: Context) -> CaseResult:
    """Energies over density, pattern, Poisson's ratio and formulation; the cost of a solve."""
    result = CaseResult(
        name="convergence",
        title="Convergence of folded sheets",
        question="Do the energies of folded sheets converge to one value on every mesh, and what does it cost?",
        source="App. B (a) and (d); mutual agreement of the meshes",
    )
    for actuation, nu in (("a", 0.38), ("a", 0.0), ("d", 0.38))[: 1 if context.quick else 3]:
        _sector(result, context, actuation, nu)
    _bars(result, context)
    _ring(result, context)
    _cost(result, context)
    return result


def _sector(result: CaseResult, context: Context, actuation: str, nu: float) -> None:
    levels = LEVELS[:3] if context.quick else LEVELS
    totals: dict[str, list[float]] = {}
    paths: dict[str, Path] = {}
    for kind in KINDS:
        for along, rows in levels:
            context.tell(f"convergence: ({actuation}), nu = {nu}, {kind}, {along} x {rows}")
            paths[kind] = folded(sector(along, rows, kind), actuation, nu)
            totals.setdefault(kind, []).append(reached_energy(paths[kind]))
    limits = {kind: extrapolated(values) for kind, values in totals.items()}
    converged = float(np.nanmedian(list(limits.values())))
    here = {"actuation": actuation, "nu": nu, "formulation": "consistent"}
    along, rows = levels[-1]
    for kind in KINDS:
        params = {**here, "mesh": kind, "along": along, "rows": rows}
        result.check(
            "total energy against the limit of all meshes",
            totals[kind][-1],
            unit="N mm",
            reference=converged,
            source="extrapolated, median of the mesh patterns",
            tolerance=0.005,
            params=params,
            path=paths[kind],
        )
        result.check("order of convergence", order(totals[kind]), source="last three levels", params=params)
    for along, rows, tolerance in DESIGN[: 1 if context.quick else 2]:
        for kind in KINDS:
            context.tell(f"convergence: ({actuation}), nu = {nu}, {kind}, {along} x {rows}")
            path = folded(sector(along, rows, kind), actuation, nu)
            result.check(
                f"total energy at {along} x {rows}",
                path[-1].energy.total,
                unit="N mm",
                reference=converged,
                source="extrapolated, median of the mesh patterns",
                tolerance=tolerance,
                params={**here, "mesh": kind, "along": along, "rows": rows},
                path=path,
            )
    if nu > 0.0:
        table = appendix_b.TABLE_B1[actuation][2]
        result.check(
            "limit of the total energy against the table",
            converged,
            unit="N mm",
            reference=table,
            source=appendix_b.SOURCE,
            params=here,
        )
    x = [float(along) for along, _ in levels]
    series = [line(kind, x, totals[kind]) for kind in KINDS]
    series.append(line("limit", x, [converged] * len(x), "reference"))
    result.plots.append(
        plot(
            f"convergence-{actuation}-{nu}",
            f"Total energy, ({actuation}), nu = {nu}",
            "cells along the crease",
            "energy, N mm",
            series,
            "Eight cells along the crease to a row on each side.",
            log="x",
        )
    )


def extrapolated(values: list[float]) -> float:
    """Limit of values at halved cells, of second order in their size."""
    return values[-1] + (values[-1] - values[-2]) / 3.0


def order(values: list[float]) -> float:
    """Order of convergence by the last three values at halved cells; nan where they do not approach a limit."""
    first, second = values[-2] - values[-3], values[-1] - values[-2]
    return math.log2(abs(first / second)) if first != 0.0 and second != 0.0 else math.nan


def _bars(result: CaseResult, context: Context) -> None:
    """The same meshes by bars and hinges: more rows lead away."""
    for kind in KINDS:
        for along, rows in LEVELS[: 2 if context.quick else 3]:
            context.tell(f"convergence: bars and hinges, {kind}, {along} x {rows}")
            path = folded(sector(along, rows, kind), "a", 0.0, "bars-and-hinges")
            params = {"actuation": "a", "nu": 0.0, "mesh": kind, "along": along, "rows": rows}
            result.check(
                "total energy",
                path[-1].energy.total,
                unit="N mm",
                source="reported: no limit to compare with",
                params={**params, "formulation": "bars-and-hinges"},
                path=path,
            )


def _ring(result: CaseResult, context: Context) -> None:
    """A ring of one row of long cells: bars and hinges grow stiffer in torsion with the aspect ratio."""
    counts = (90, 120) if context.quick else (90, 120, 180, 240)
    found: dict[str, list[float]] = {}
    for name in BOTH:
        for along in counts:
            context.tell(f"convergence: full annulus, {name}, {along}")
            path = ring(along, 1, name)
            energy = reached_energy(path)
            found.setdefault(name, []).append(energy)
            judged = name == "consistent" and along > counts[0]
            result.check(
                "energy of the full annulus, against the mesh before",
                energy,
                unit="N mm",
                reference=found[name][-2] if along > counts[0] else None,
                source="one row of cells a side",
                tolerance=0.005 if judged else None,
                params={
                    "along": along,
                    "rows": 1,
                    "alpha": path.model.mesh.aspect_ratio,
                    "formulation": name,
                    "dihedral_deg": math.degrees(RING),
                },
                path=path,
            )
    result.plots.append(
        plot(
            "convergence-ring",
            "Full annulus folded by 30 degrees",
            "cells round the crease",
            "energy, N mm",
            [line(name, [float(n) for n in counts], values) for name, values in found.items()],
            "Energy of the saddle; with bars and hinges the twist of long cells locks.",
            log="xy",
        )
    )


def _cost(result: CaseResult, context: Context) -> None:
    """Wall time of both formulations on the same meshes; reported, as machines differ."""
    for along, rows, repeat in ((32, 1, 9), (64, 1, 9), (32, 4, 5), (64, 12, 2))[: 2 if context.quick else 4]:
        context.tell(f"convergence: cost, {along} x {rows}")
        best = dict.fromkeys(BOTH, math.inf)
        for _ in range(repeat):
            for name in BOTH:
                began = time.perf_counter()
                path = folded(sector(along, rows, "staggered"), "a", 0.38, name)
                best[name] = min(best[name], time.perf_counter() - began)
        params = {"actuation": "a", "mesh": "staggered", "along": along, "rows": rows}
        result.check(
            "time of a fold over that of bars and hinges",
            best["consistent"] / best["bars-and-hinges"],
            source="least of some runs, at most 3 is asked",
            params=params,
            path=Cost(unknowns=path.unknowns, iterations=path.iterations, wall_time_s=best["consistent"]),
        )
