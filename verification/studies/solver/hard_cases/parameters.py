"""Extreme parameters: stiffness of the crease, thickness, slenderness of the cells."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

import meshes
from bh import Model, Path, Sheet, trace
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from verification.framework.checks import CaseResult
from verification.studies.solver.campaign import FINE
from verification.studies.solver.hard_cases.common import annulus
from verification.theory import cone


def crease_stiffness(result: CaseResult) -> None:
    """L* over five decades: a stiff crease reaches its rest angle, a soft one lets the sheet win."""
    reached = []
    for Lstar in (0.01, 0.1, 1.0, 10.0, 100.0, 700.0):
        path = trace(annulus().fold("crease", rest=math.pi / 2, Lstar=Lstar))
        fine = trace(annulus().fold("crease", rest=math.pi / 2, Lstar=Lstar), strategy=FINE)
        reached.append(float(path[-1].dihedral("crease").mean()))
        result.check(
            "L*: total energy",
            path[-1].energy.total,
            unit="N mm",
            reference=fine[-1].energy.total,
            source="four times finer increments",
            tolerance=1e-7,
            params={"Lstar_mm": Lstar},
            path=path,
        )
    ordered = all(a < b for a, b in pairwise(reached))
    result.check("L*: softer creases stay more open", ordered, reference=1.0, source="energy", tolerance=0.0)
    result.check(
        "L* = 0.01: dihedral angle",
        reached[0],
        unit="rad",
        reference=math.pi / 2,
        source="rigid crease",
        tolerance=1e-3,
    )


def thickness(result: CaseResult) -> None:
    """Thickness over two decades at fixed size: bending energy goes with t^3."""
    unit = None
    for t in (0.01, 0.03, 0.1, 0.3, 1.0, 2.0):
        path = trace(annulus(t=t).fold("crease", to=math.pi / 2))
        D = Sheet(E=4000.0, t=t).bending_stiffness()
        ratio = path[-1].energy.total / cone.bending_energy(D, math.pi / 4, 90.0, 110.0, math.pi / 2)
        unit = ratio if unit is None else unit
        result.check(
            "thickness: energy over the cone's",
            ratio,
            reference=1.0,
            source="Eq. 3.13 integrated",
            tolerance=0.03 if t <= 0.3 else None,
            params={"t_mm": t},
            path=path,
        )


def supported(alpha: float) -> Model:
    """A sector of cells with aspect ratio alpha on three corners, its spring crease folded towards 90 degrees.

    It is statically determinate and holds no angle exactly, so that its tangent is one plain matrix.
    """
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, math.pi / 4), aspect_ratio=alpha)
    model = Model(mesh, Sheet(E=4000.0, t=0.127), formulation="bars-and-hinges", contact=False).support(
        "corner:inner-start", "xyz"
    )
    model = model.support("corner:outer-start", "yz").support("corner:inner-end", "z")
    return model.fold("crease", rest=math.pi / 2, Lstar=10.0)


def condition_number(path: Path) -> float:
    """Largest over smallest eigenvalue of the tangent at the last state of a stable path, by Lanczos' method."""
    model = path.model
    form = formulation(model.formulation)
    system = form.system(model, load_steps(model)[-1], None)
    q, lam = path.records[-1].q, path.records[-1].lam
    tangent = system.tangent(q, lam, system.evaluate(q, lam).forces).matrix
    n = len(q)
    # a fixed start keeps the figure the same from run to run
    options: dict[str, Any] = {"k": 1, "return_eigenvectors": False, "v0": np.ones(n), "tol": 1e-4}
    stiffest = eigsh(LinearOperator((n, n), tangent.__matmul__, dtype=float), which="LA", **options)
    softest = eigsh(LinearOperator((n, n), tangent.factorise().solve, dtype=float), which="LA", **options)
    return float(stiffest[0] * softest[0])


def slenderness(result: CaseResult) -> None:
    """Aspect ratio alpha from 0.5 to 30: iterations do not grow, though the condition number does."""
    for alpha in (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0):
        mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, math.pi / 4), aspect_ratio=alpha)
        path = trace(
            Model(mesh, Sheet(E=4000.0, t=0.127), formulation="bars-and-hinges", contact=False).fold(
                "crease", to=math.pi / 2
            )
        )
        result.check(
            "slender cells: iterations from flat to 90 degrees",
            path.iterations,
            source="at most 60",
            params={"alpha": alpha},
            path=path,
        )
        result.check(
            "slender cells: at most 60 iterations",
            path.iterations <= 60,
            reference=1.0,
            source="target",
            tolerance=0.0,
            params={"alpha": alpha},
            path=path,
        )
        spring = trace(supported(alpha))
        result.check(
            "slender cells: condition number of the tangent, spring crease on three corners",
            condition_number(spring),
            source="reported",
            params={"alpha": alpha},
            path=spring,
        )
