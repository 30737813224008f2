"""Case `appendix_b_cross` (source App. B): bars and hinges and the consistent formulation beside the shell."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bh.analysis.alignment import aligned, hausdorff
from fem.state import ShellState
from meshes.cells import Kind
from verification.framework.checks import CaseResult, Context, Cost, line, plot
from verification.studies.app_b.shell_folding import ACTUATIONS, ANGLE, Solved, solve

Array = NDArray[np.float64]
CASE = "appendix_b_cross"
UNITS = {"b": ("couple a length of crease", "N")}
FORCE = ("force a length of crease", "N/mm")
NOTE = (
    "Energies are those of the sheet, without the spring of the crease. In (b) and (c) the load grows until the mean "
    "fold angle has passed a right angle, and is then found by the secant method to 1e-6 rad: it is the load that is "
    "prescribed, no angle is held. A force is a uniform line load on the shell and the same force on every node of the "
    "crease of the others. Distances of the crease are those after the curve has been moved rigidly to the shell's; "
    "Hausdorff's is between the curves as drawn, with the sag of straight edges: 0.012 mm with 32 cells along. Bars "
    "and hinges take Poisson's ratio as 0; on one row of cells they have the energy of the cone, with more they lock."
)


@dataclass(frozen=True)
class Member:
    """A formulation on a mesh; `tolerance` on the total energy against the shell, None where it is only reported."""

    formulation: str
    rows: int
    kind: Kind
    tolerance: float | None = None


def members(rows: int) -> tuple[Member, ...]:
    """Bars and hinges on their own mesh and on the judge's, and the consistent formulation on the judge's."""
    return (
        Member("bars-and-hinges", 1, "staggered"),
        Member("bars-and-hinges", rows, "mirrored"),
        Member("consistent", rows, "mirrored", 0.015),
    )


def run(context: Context) -> CaseResult:
    """The four actuations, (c) in both readings, by three models of one sheet."""
    result = CaseResult(
        name=CASE,
        title="App. B by bars and hinges, by the consistent formulation and by the shell",
        question="How far are energies, crease, fold angles and loads from those of the shell, and at what cost?",
        source="source App. B, Fig. B.4; the shell on the same sheet is the reference",
    )
    along, rows = (48, 6) if context.quick else (64, 8)
    for formulation in ("shell", "consistent", "bars-and-hinges"):
        solve("b", 4, 1, formulation)  # kernels are loaded before anything is timed
    for actuation in ACTUATIONS:
        context.tell(f"{CASE}: ({actuation}), shell, {along} x {2 * rows} cells")
        judge = solve(actuation, along, rows)
        angles = {"shell": judge}
        _energies(result, actuation, along, Member("shell", rows, "mirrored"), judge, None)
        for member in members(rows):
            context.tell(f"{CASE}: ({actuation}), {member.formulation}, {along} x {2 * member.rows} cells")
            solved = solve(actuation, along, member.rows, member.formulation, member.kind)
            _energies(result, actuation, along, member, solved, judge)
            compare(result, actuation, along, member, solved, judge)
            angles[f"{member.formulation}, {2 * member.rows} rows"] = solved
        if actuation in ("b", "c-hinge"):
            _plot(result, actuation, angles)
    result.notes.append(NOTE)
    return result


def sheet_energies(solved: Solved) -> dict[str, float]:
    """Stretching, bending and their sum, N mm: the sheet without the spring of the crease."""
    energy = solved.state.energy
    return {
        "stretching": energy.stretching,
        "bending": energy.bending,
        "total": energy.stretching + energy.bending,
    }


def both(solved: Solved, judge: Solved | None) -> str:
    """One outcome for a comparison: a figure stands only if both sides of it were reached."""
    if judge is None or judge.reached:
        return solved.outcome
    return judge.outcome


def _common(
    actuation: str, along: int, member: Member, solved: Solved, judge: Solved | None
) -> tuple[dict[str, Any], Cost]:
    """Parameters of every check of a member, and what it took; not reached if either sheet is not."""
    params = {
        "actuation": actuation,
        "how": ACTUATIONS[actuation],
        "formulation": member.formulation,
        "mesh": member.kind,
        "along": along,
        "rows": member.rows,
    }
    return params, Cost.of(solved, outcome=both(solved, judge))


def _energies(
    result: CaseResult, actuation: str, along: int, member: Member, solved: Solved, judge: Solved | None
) -> None:
    """Energies, load and moment, against the shell's where there is one."""
    params, cost = _common(actuation, along, member, solved, judge)
    source = "the judge" if judge is None else "the shell on the same sheet"
    reference = {} if judge is None else sheet_energies(judge)
    for kind, value in sheet_energies(solved).items():
        tolerance = member.tolerance if kind == "total" and actuation != "c-spring" else None
        result.check(
            f"{kind} energy",
            value,
            unit="N mm",
            reference=reference.get(kind),
            source=source,
            tolerance=tolerance,
            params=params,
            path=cost,
        )
    if math.isnan(solved.load):
        what, unit = "mean moment a length of crease", "N"
    else:
        what, unit = UNITS.get(actuation, FORCE)
    other = None if judge is None else _load(judge)
    result.check(what, _load(solved), unit=unit, reference=other, source=source, params=params, path=cost)


def _load(solved: Solved) -> float:
    """The load a length of crease, or the moment that an imposed angle takes."""
    return float(solved.state.crease_moment("crease").mean()) if math.isnan(solved.load) else solved.load


def compare(
    result: CaseResult, actuation: str, along: int, member: Member, solved: Solved, judge: Solved
) -> None:
    """Fold angles and the curve of the crease against the shell's, edge by edge and node by node."""
    params, cost = _common(actuation, along, member, solved, judge)
    one, two = (s.state.fold_angle("crease") for s in (solved, judge))
    source = "the shell on the same sheet"
    check = partial(result.check, params=params, path=cost)
    check("mean fold angle", one.mean(), unit="rad", reference=ANGLE, source="B.3", tolerance=1e-6)
    check(
        "range of the fold angle along the crease",
        np.ptp(one),
        unit="rad",
        reference=float(np.ptp(two)),
        source=source,
    )
    check(
        "root mean square difference of fold angles",
        np.sqrt(((one - two) ** 2).mean()),
        unit="rad",
        reference=0.0,
        source=source,
    )
    largest, apart = crease_distance(solved, judge)
    near = 0.1 if member.tolerance is not None and actuation != "c-spring" else None  # mm
    check(
        "largest distance of crease nodes", largest, unit="mm", reference=0.0, source=source, tolerance=near
    )
    check("Hausdorff distance of the crease", apart, unit="mm", reference=0.0, source=source)


def crease_distance(solved: Solved, judge: Solved) -> tuple[float, float]:
    """Largest distance of corresponding nodes of the crease after rigid alignment, and Hausdorff distance, mm."""
    onto = judge.state.crease_points("crease")
    moved, turn, shift = aligned(solved.state.crease_points("crease"), onto)
    curves = [
        s.state.crease_curve("crease") if isinstance(s.state, ShellState) else s.state.crease_points("crease")
        for s in (solved, judge)
    ]
    largest = float(np.linalg.norm(moved - onto, axis=1).max())
    return largest, hausdorff(turn.apply(curves[0]) + shift, curves[1])


def _plot(result: CaseResult, actuation: str, found: dict[str, Solved]) -> None:
    series = []
    for name, solved in found.items():
        if solved.reached:
            angle = np.degrees(solved.state.fold_angle("crease"))
            at = (np.arange(len(angle)) + 0.5) / len(angle)
            series.append(line(name, at.tolist(), angle.tolist(), "reference" if name == "shell" else "line"))
    result.plots.append(
        plot(
            f"appendix-b-cross-{actuation}",
            f"Fold angle along the crease, ({actuation})",
            "place along the crease",
            "fold angle, degrees",
            series,
            f"{ACTUATIONS[actuation].capitalize()}, mean fold angle 90 degrees; dashed is the shell.",
        )
    )
