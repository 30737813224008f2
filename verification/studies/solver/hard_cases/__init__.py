"""Case `hard_cases`: what breaks other solvers, each with a reference of its own, all with default settings."""

from __future__ import annotations

from collections.abc import Callable

from verification.framework.checks import CaseResult, Context
from verification.studies.solver.hard_cases.arches import arch, truss_with_spring
from verification.studies.solver.hard_cases.assemblages import assemblages
from verification.studies.solver.hard_cases.common import Found
from verification.studies.solver.hard_cases.deep_folding import deep_folding
from verification.studies.solver.hard_cases.limit_points import euler_buckling, trusses
from verification.studies.solver.hard_cases.parameters import crease_stiffness, slenderness, thickness
from verification.studies.solver.hard_cases.pinching import fan, pinch
from verification.studies.solver.hard_cases.random_meshes import random_meshes
from verification.studies.solver.hard_cases.roll_up import roll_up
from verification.studies.solver.hard_cases.same_answer import same_answer
from verification.studies.solver.hard_cases.starts import back_to_flat, flat_start, mechanism, ring
from verification.studies.solver.hard_cases.two_creases import two_creases

STUDIES: dict[str, Callable[[CaseResult], Found]] = {
    "deep folding": deep_folding,
    "L*": crease_stiffness,
    "thickness": thickness,
    "slender cells": slenderness,
    "flat start": flat_start,
    "two creases": two_creases,
    "ring": ring,
    "fan": fan,
    "pinch": pinch,
    "fold and unfold": back_to_flat,
    "trusses": trusses,
    "truss with spring": truss_with_spring,
    "arch": arch,
    "assemblages": assemblages,
    "Euler buckling": euler_buckling,
    "roll-up": roll_up,
    "same answer": same_answer,
    "random meshes": random_meshes,
    "mechanism": mechanism,
}


def run(context: Context) -> CaseResult:
    """Every study, one after another."""
    result = CaseResult(
        name="hard_cases",
        title="Hard cases",
        question="Does the solver get through what breaks others, with default settings?",
        source="closed forms, finer increments, published curves; each record names its own",
    )
    for name, study in STUDIES.items():
        context.tell(f"hard_cases: {name}")
        result.checks.extend(study(result))
    return result
