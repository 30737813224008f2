"""An angle section compressed along its crease: both legs twist the same way (`verification.theory.angle_section`)."""

from __future__ import annotations

import math

import meshes
from bh import Displace, Model, Path, Sheet, Support, trace
from bh.solvers.outcome import Critical
from verification.framework.checks import CaseResult, Context
from verification.studies.solver.published.common import Claim, Level, by_shell, converged
from verification.theory.angle_section import exact

SOURCE = (
    "Timoshenko and Gere, Theory of Elastic Stability, 9.4; the plate equation solved in "
    "verification.theory.angle_section"
)
LENGTH, LEG = 160.0, 20.0  # mm
SHEET = Sheet(E=4000.0, nu=0.0, t=0.5)
ENOUGH = 1.15  # of the buckling load, at the end of the step
LEVELS = ((8, 2), (16, 4), (32, 8))  # cells along the crease, rows a leg
SHELL = (16, 2)
TOLERANCE = 0.01  # relative, set before the first run


def section_model(formulation: str, along: int, rows: int) -> Model:
    """The strip folded by a right angle without stress, then shortened along its crease between plane ends.

    Args:
        formulation: by name.
        along: cells along the crease.
        rows: of cells in each leg.
    """
    pattern = meshes.strip(LENGTH, 2.0 * LEG, [LEG])
    mesh = meshes.structured(
        pattern, along=along, rows=rows, kind="mirrored" if formulation == "shell" else "staggered"
    )
    model = Model(mesh, SHEET, formulation=formulation, contact=False).fold("crease", by=0.5 * math.pi)
    ends = (Support("edge:start", "xyz"), Support("edge:end", "yz"))
    return model.step(Displace("edge:end", "x", further=-shortening(ENOUGH)), support=ends)


def shortening(share: float) -> float:
    """Of the ends at a share of the buckling load, mm: N = E t u / a, and N = k pi^2 D / b^2.

    Args:
        share: of the buckling load.
    """
    load = exact(LENGTH, LEG, SHEET.nu) * math.pi**2 * SHEET.bending_stiffness() / LEG**2
    return share * load * LENGTH / (SHEET.E * SHEET.t)


def factor(path: Path) -> float:
    """K at the first point where the straight section branches; nan if it does not."""
    found = [at.lam for step, at in path.critical_points if step == 1 and at.kind is Critical.BIFURCATION]
    return found[0] * ENOUGH * exact(LENGTH, LEG, SHEET.nu) if found else math.nan


def compressed_section(result: CaseResult, context: Context) -> None:
    """Its buckling load."""
    params = {"sheet": "angle section", "a / b": LENGTH / LEG}
    claim = Claim("buckling load b^2 N / (pi^2 D)", exact(LENGTH, LEG, SHEET.nu), SOURCE, TOLERANCE, params)
    levels = []
    for along, rows in LEVELS[:2] if context.quick else LEVELS:
        path = trace(section_model("consistent", along, rows), neighbours=False)
        levels.append(Level(f"{along} x {rows}", 1.0 / rows, factor(path), path))
    converged(result, claim, levels)
    path = trace(section_model("shell", *SHELL), neighbours=False)
    by_shell(result, claim, Level("{} x {}".format(*SHELL), 1.0 / SHELL[1], factor(path), path))
