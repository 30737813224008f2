"""Case `actuated`: sheets of two thicknesses, heated laminates, sheets that are curved at rest, against closed forms.

Tolerances were set before the first run: 1 % on the finest mesh of each formulation, 4 % in the quick variant.
"""

from __future__ import annotations

import math

import numpy as np

import bh
import meshes
from verification.framework.checks import CaseResult, Context
from verification.studies.solver.closed_forms import KINDS, Problem, judge
from verification.theory import actuated as theory

CASE = "actuated"
TOLERANCE, QUICK_TOLERANCE = 0.01, 0.04
LONG, WIDE, SIDE = 60.0, 10.0, 20.0  # of the strip and the square, mm
STEEL, BRASS = (200000.0, 0.1, 1.2e-5), (100000.0, 0.2, 1.9e-5)  # E, t, expansion
HEAT = 20.0
FIBRES = {"E1": 130000.0, "E2": 9000.0, "nu12": 0.3}
SWELL = (-1e-7, 3e-5)
PLY = 0.125  # mm
RADIUS = 20.0  # of the cylinder, mm
BOWL = 1e-5  # 1 / mm


def problems() -> tuple[Problem, ...]:
    """All of them, with their closed forms."""
    strip = theory.stepped_cantilever(1e-7, 4000.0, WIDE, LONG, 0.5 * LONG, (0.4, 0.2))
    ply = theory.cross_ply(130000.0, 9000.0, 0.3, SWELL, PLY, 1.0)
    return (
        Problem("stepped cantilever", "P (L - x) / E I(x) integrated twice", "mm", strip, _stepped),
        Problem("bimetal strip", "Timoshenko (1925)", "1/mm", theory.bimetal(STEEL, BRASS, HEAT), _bimetal),
        Problem("heated [0/90]", "Jones (1999), 4.4", "1/mm", ply, _cross_ply),
        Problem("strip curved at rest", "a cylinder", "mm", theory.chord(RADIUS, LONG), _rolled),
        Problem("shallow bowl", "k (x^2 + y^2) / 2", "mm", 0.25 * BOWL * SIDE**2, _bowl),
    )


def _mesh(formulation: str, along: int, long: float, wide: float) -> meshes.SheetMesh:
    rows = max(round(along * wide / long), 1)
    return meshes.structured(meshes.strip(long, wide), along=along, rows=rows, kind=KINDS[formulation])


def _state(formulation: str, mesh: meshes.SheetMesh, sheet: bh.Sheet, *acts: bh.Actuation) -> bh.State:
    return bh.trace(bh.Model(mesh, sheet, formulation=formulation).step(*acts)).require()[-1]


def _stepped(formulation: str, along: int) -> float:
    mesh = _mesh(formulation, along, LONG, WIDE)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.2), formulation=formulation)
    half = 0.5 * LONG
    model = model.support("edge:start", "xyz", clamp=True)
    model = model.zone([[-1.0, -1.0], [half, -1.0], [half, WIDE + 1.0], [-1.0, WIDE + 1.0]], t=0.4)
    path = bh.trace(model.force("edge:end", total=(0.0, 0.0, 1e-7))).require()
    return float(path[-1].displacement("edge:end")[:, 2].mean())


def _bimetal(formulation: str, along: int) -> float:
    metals = [bh.Sheet(E=E, nu=0.3, t=t, expansion=a) for E, t, a in (STEEL, BRASS)]
    mesh = _mesh(formulation, along, LONG, WIDE)
    state = _state(formulation, mesh, bh.laminate(metals), bh.Expand(change=HEAT))
    return float(state.stress().curvature[:, 0].mean())


def _cross_ply(formulation: str, along: int) -> float:
    both = [
        bh.Sheet.orthotropic(**FIBRES, G12=5000.0, grain=grain, t=PLY, expansion=SWELL)
        for grain in (0.0, 0.5 * math.pi)
    ]
    mesh = _mesh(formulation, along, SIDE, SIDE)
    state = _state(formulation, mesh, bh.laminate(both), bh.Expand(change=1.0))
    return float(state.stress().curvature[:, 0].mean())


def _rolled(formulation: str, along: int) -> float:
    mesh = _mesh(formulation, along, LONG, WIDE)
    state = _state(
        formulation, mesh, bh.Sheet(E=4000.0, nu=0.3, t=0.2), bh.Expand(through=[1.0 / RADIUS, 0.0])
    )
    start, end = (state.points[mesh.nodes(f"edge:{side}")].mean(axis=0) for side in ("start", "end"))
    return float(np.linalg.norm(end - start))


def _bowl(formulation: str, along: int) -> float:
    mesh = _mesh(formulation, along, SIDE, SIDE)
    state = _state(formulation, mesh, bh.Sheet(E=4000.0, nu=0.3, t=0.2), bh.Expand(through=BOWL))
    corners = [f"corner:{a}-{b}" for a in ("inner", "outer") for b in ("start", "end")]
    rim = np.mean([state.points[mesh.nodes(each)].mean(axis=0) for each in corners], axis=0)
    middle = state.points[mesh.nodes(f"near:{0.5 * SIDE},{0.5 * SIDE}")].mean(axis=0)
    return float(np.linalg.norm(rim - middle))


def run(context: Context) -> CaseResult:
    """Five sheets by both formulations."""
    result = CaseResult(
        CASE,
        "Sheets of several materials, heated and curved at rest",
        "Do zones, laminates and strains at rest come out as closed forms say?",
        "closed forms",
    )
    for problem in problems():
        judge(result, CASE, problem, context.quick, (TOLERANCE, QUICK_TOLERANCE))
    result.notes.append(
        "The bimetal strip and [0/90] are those of lamination theory; both metals have one nu, so that a plate has the "
        "curvature of Timoshenko's strip."
    )
    return result
