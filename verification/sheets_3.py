"""Case `sheets_3` (source 3.4-3.5): sheets of Chapter 3 as they fold, by three formulations, to be turned."""

from __future__ import annotations

import math

import meshes
from bh import Model, Path, Sheet
from meshes.structured import Kind
from verification.checks import CaseResult, Check, Context, cost_of, reached_energy
from verification.folded_frames import in_frames, store

CASE = "sheets_3"
SHEET = Sheet(E=4000.0, nu=0.38, t=0.127)
ANGLE = math.pi / 2
LSTAR = 25.0  # mm
CREASES = (80.0, 90.0, 100.0, 110.0, 120.0)  # radii of the pleats, mm
# rows of cells between creases and mesh pattern that suit each
MESHES: dict[str, tuple[int, Kind]] = {
    "bars-and-hinges": (1, "staggered"),
    "consistent": (4, "mirrored"),
    "shell": (2, "mirrored"),
}
TOLERANCE = 0.03  # of the shell's energy


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
    senses = [("mountain", "valley")[i % 2] for i in range(len(CREASES))]
    pleats = meshes.annulus_sector(CREASES, 10.0, ANGLE, folds=senses)
    for name, pattern, fold, cells, what in (
        (
            "annulus",
            annulus,
            _spring,
            2 * along,
            "Half an annulus, its crease a spring that wants 90 degrees",
        ),
        ("pleats", pleats, _exactly, along, "Five pleats, folded by 90 degrees"),
    ):
        paths: dict[str, Path] = {}
        for formulation, (rows, kind) in MESHES.items():
            context.tell(f"{CASE}: {name}, {formulation}")
            mesh = meshes.structured(pattern, along=cells, rows=rows, kind=kind)
            paths[formulation] = in_frames(Model(mesh, SHEET, formulation=formulation), fold)
        for formulation in ("bars-and-hinges", "consistent"):
            _compare(result, name, cells, paths[formulation], paths["shell"])
        store(result, context, f"{CASE}_{name}", paths, what, f"{what}; the sheet is free.", what)
    return result


def _spring(model: Model, fraction: float) -> Model:
    return model.fold("crease", rest=math.pi - fraction * ANGLE, Lstar=LSTAR)


def _exactly(model: Model, fraction: float) -> Model:
    return model.fold("all", by=fraction * ANGLE)


def _compare(result: CaseResult, sheet: str, along: int, path: Path, shell: Path) -> None:
    formulation = path.model.formulation
    judged = TOLERANCE if formulation == "consistent" and along >= 32 else None
    outcome = path.outcome if path.outcome != "reached" else shell.outcome
    params = {"sheet": sheet, "formulation": formulation, "along": along}
    result.checks.append(
        Check(CASE, "total energy, folded", params, reached_energy(path), "N mm", reached_energy(shell),
              "the shell on the same sheet", judged, outcome=outcome, **cost_of(path))
    )  # fmt: skip
