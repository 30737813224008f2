"""Case `appendix_b_shell` (source App. B): the shell's own figures for Table B.1, converged, and Fig. B.6 (c, d)."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

import meshes
from bh import Model
from bh.analysis.richardson import limit
from bh.solvers.outcome import Outcome
from verification.framework.checks import CaseResult, Context, Cost, line, plot
from verification.studies.app_b import appendix_b
from verification.studies.app_b.shell_folding import (
    ACTUATIONS,
    ANGLE,
    BUCKLE,
    SHEET,
    Solved,
    full_annulus,
    rotate,
    sheet_model,
    solve,
)
from verification.theory import cone

TABLE_B1 = {  # in-plane, bending, total, N mm
    **appendix_b.TABLE_B1,
    "b": (1.67e-3, 5.31e-2, 5.48e-2),
    "c": (3.14e-3, 5.56e-2, 5.87e-2),
}
DENSITIES = ((16, 2), (32, 4), (64, 8))  # cells along the crease and rows each side
KINDS = ("stretching", "bending", "total")
ARCS = (0.25, 0.5, 0.75, 1.0)  # of pi, Fig. B.6 (d)
NOTE = (
    "Energies are those of the sheet, without the spring of the crease. The error bar of a total is the distance to "
    "Richardson's value, or the last change where the values do not settle from one side. Converged totals lie 1.7 to "
    "2.0 % below the table for (a), (b) and (d): the published figures are of one mesh of 1,628 four-node elements, "
    "said to be 0.23 % above one of twice as many, and a stiff element's remaining error falls slowly. Nothing here is "
    "tuned to the table. For (c) the source does not say whether the crease's spring resists the force: with it the "
    "total lies above the table, with a free hinge below. A spring of about 2.5e-3 N mm/mm/rad would meet the total, "
    "but the in-plane energy would need 3.4e-3: no single stiffness meets both."
)


def run(context: Context) -> CaseResult:
    """Table B.1 by four actuations on three meshes each, and the approach to the cone with the arc."""
    result = CaseResult(
        name="appendix_b_shell",
        title="The creased annulus sector of App. B, by a shell",
        question="What does an independent shell model give for the four actuations of App. B?",
        source="source App. B, Table B.1, Fig. B.3 and Fig. B.6",
    )
    densities = DENSITIES[:2] if context.quick else DENSITIES
    series = []
    for actuation in ACTUATIONS:
        solved = []
        for along, rows in densities:
            context.tell(f"appendix_b_shell: ({actuation}), {along} x {2 * rows} cells")
            solved.append(solve(actuation, along, rows))
        record(result, actuation, solved, densities)
        converged = [s for s in solved if s.reached]
        series.append(
            line(
                f"({actuation})", [float(s.unknowns) for s in converged], [_energies(s)[2] for s in converged]
            )
        )
    result.plots.append(
        plot(
            "appendix-b-shell-convergence",
            "Total energy over unknowns",
            "unknowns",
            "energy, N mm",
            series,
            "Energy of the sheet at a mean fold angle of 90 degrees (as Fig. B.3).",
            log="x",
        )
    )
    _arcs(result, context)
    _variants(result, context)
    result.notes.append(NOTE)
    return result


def _energies(solved: Solved) -> tuple[float, float, float]:
    energy = solved.state.energy
    return energy.stretching, energy.bending, energy.stretching + energy.bending


def record(
    result: CaseResult, actuation: str, solved: list[Solved], densities: tuple[tuple[int, int], ...]
) -> None:
    """Checks of one actuation: the limit of every energy, and what the load is."""
    finest = solved[-1]
    params = {"actuation": actuation, "how": ACTUATIONS[actuation], "along": densities[-1][0]}
    known, cost = _converged(solved, params)
    params["formulation"] = "shell"
    for index, kind in enumerate(KINDS):
        values = [_energies(s)[index] for s in solved]
        result.check(
            f"{kind} energy against the table",
            limit(values).value,
            unit="N mm",
            reference=TABLE_B1[actuation[0]][index],
            source=appendix_b.SOURCE,
            params=known(values),
            path=cost,
        )
    angles = finest.state.fold_angle("crease")
    check = partial(result.check, params=params, path=cost)
    check("mean fold angle", angles.mean(), unit="rad", reference=ANGLE, source="B.3", tolerance=1e-6)
    moment = float(finest.state.crease_moment("crease").mean())
    if not math.isnan(finest.load):
        what = "couple a length of crease" if actuation == "b" else "force a length of crease"
        unit = "N" if actuation == "b" else "N/mm"
        check(what, finest.load, unit=unit, source="not in the source")
    else:
        check("mean moment a length of crease", moment, unit="N", source="not in the source")


def _arcs(result: CaseResult, context: Context) -> None:
    """Fig. B.6 (d): energy over the cone's, for longer and longer sectors."""
    series = []
    for nu in (SHEET.nu, 0.0):
        ratios = []
        for arc in ARCS:
            context.tell(f"appendix_b_shell: arc of {arc:g} pi, nu = {nu:g}")
            along, rows = (round(64 * arc), 2) if context.quick else (round(128 * arc), 4)
            solved = rotate(sheet_model("a", along, rows, arc * math.pi, nu))
            D = SHEET.bending_stiffness()
            exact = cone.bending_energy(
                D * (1.0 if nu else 1.0 - SHEET.nu**2), arc * math.pi, 90.0, 110.0, math.pi - ANGLE
            )
            ratio = solved.state.energy.total / exact
            ratios.append(ratio if solved.reached else np.nan)
            params = {"arc": arc * math.pi, "nu": nu, "along": along, "formulation": "shell"}
            result.check(
                "total energy over the cone's",
                ratio,
                unit="1",
                source="source Fig. B.6 (d): about 0.9 for nu = 0.38, closer to 1 for nu = 0",
                params=params,
                path=solved,
            )
        series.append(line(f"nu = {nu:g}", [arc * math.pi for arc in ARCS], ratios))
    result.plots.append(
        plot(
            "appendix-b-shell-arc",
            "Approach to the cone",
            "arc of the sector, rad",
            "energy over the cone's",
            series,
            "Energy of the folded sector over 1/2 D theta_a ln(r_o / r_i) cot^2(phi / 2), D with the same nu.",
        )
    )


def _variants(result: CaseResult, context: Context) -> None:
    """Fig. B.7: three creases mountain-valley-mountain, free, and a full annulus, folded by a right angle."""
    arcs = meshes.annulus_sector(
        [90.0, 100.0, 110.0], 10.0, math.pi / 4, folds=["mountain", "valley", "mountain"]
    )
    free = []
    for along in (16, 32) if context.quick else (16, 32, 64):
        mesh = meshes.structured(arcs, along=along, rows=along // 8, kind="mirrored")
        context.tell(f"appendix_b_shell: three creases, {along} cells along them")
        free.append(rotate(Model(mesh, SHEET, formulation="shell", contact=False), "all"))
    _limits(result, {"figure": "B.7", "sheet": "three creases M-V-M", "along": along}, free)
    rings = []
    for along in () if context.quick else (48, 96, 192):
        context.tell(f"appendix_b_shell: full annulus, {along} cells")
        rings.append(rotate(full_annulus(along, along // 24), strategy=BUCKLE))
    if rings:
        _limits(result, {"figure": "B.7", "sheet": "full annulus", "along": along}, rings)


def _limits(result: CaseResult, params: dict[str, Any], solved: list[Solved]) -> None:
    """Limits of the three energies of a sheet that the source only shows."""
    known, cost = _converged(solved, params)
    for index, kind in enumerate(KINDS):
        values = [_energies(s)[index] for s in solved]
        result.check(
            f"{kind} energy",
            limit(values).value,
            unit="N mm",
            source="not in the source",
            params=known(values),
            path=cost,
        )


def _converged(
    solved: list[Solved], params: dict[str, Any]
) -> tuple[Callable[[list[float]], dict[str, Any]], Cost]:
    """Parameters of a check on the limit of values over meshes, and what the finest mesh cost.

    A mesh that was not solved spoils the limit: the outcome says so and there is no value.
    """
    finest = solved[-1]
    outcome = next((s.outcome for s in solved if not s.reached), Outcome.REACHED)

    def known(values: list[float]) -> dict[str, Any]:
        if outcome != Outcome.REACHED:
            return dict(params, formulation="shell")
        found = limit(values)
        return dict(params, formulation="shell", rate=found.rate, error_bar=found.bar, finest=values[-1])

    return known, Cost.of(finest, outcome=outcome)
