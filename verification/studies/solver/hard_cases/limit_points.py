"""Limit points and buckling: von Mises truss and Euler's strip, against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import meshes
from bh import ArcLength, Model, Sheet
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.solvers.arc_length import Cylindrical, Generalised
from bh.solvers.linear import linear_response
from bh.solvers.outcome import Outcome
from bh.solvers.points import point
from verification.framework.checks import CaseResult, line, plot
from verification.studies.solver.benchmark_systems import VonMisesTruss


def trusses(result: CaseResult) -> None:
    """Von Mises truss through snap-through and snap-back by arc length, against the exact curve."""
    series = []
    for spring in (None, 0.5, 0.05):
        truss = VonMisesTruss(spring=spring)
        start = point(truss, np.zeros(truss.size), 0.0)
        for generalised in (False, True):
            control = Generalised() if generalised else Cylindrical()
            found = list(ArcLength(control=control).follow(truss, [start]))
            lam = np.array([item.point.lam for item in found])
            w = np.array([item.point.q[0] for item in found])
            off = (
                float(np.abs(truss.load(w) - lam).max()) if found[-1].outcome == Outcome.REACHED else math.nan
            )
            params: dict[str, Any] = {
                "spring": "none" if spring is None else spring,
                "control": "MGDCM" if generalised else "arc",
            }
            result.check(
                "truss: distance from the exact path",
                off,
                reference=0.0,
                source="closed form",
                tolerance=1e-7,
                params=params,
            )
            unstable = {item.negative for item in found if truss.limit() < 1.0}
            result.check(
                "truss: unstable states counted",
                unstable == {0, 1},
                reference=1.0,
                source="one negative mode",
                tolerance=0.0,
                params=params,
            )
            if not generalised:
                top = np.array([item.point.q[-1] for item in found])
                series.append(line(f"spring {params['spring']}", top.tolist(), lam.tolist()))
    w = np.linspace(0.0, 2.7, 200)
    series.append(line("exact, no spring", w.tolist(), VonMisesTruss().load(w).tolist(), "reference"))
    result.plots.append(
        plot(
            "hard-truss",
            "Von Mises truss",
            "displacement of the load, mm",
            "lambda",
            series,
            "Through limit points and snap-back by arc length.",
        )
    )


def euler_buckling(result: CaseResult) -> None:
    """Critical load of a simply supported strip, from the inertia of the flat state by bisection."""
    length, width, t, E = 100.0, 10.0, 0.5, 4000.0
    exact = math.pi**2 * E * width * t**3 / 12.0 / length**2
    for alpha in (2.0, 4.0, 8.0, 16.0):
        mesh = meshes.structured(meshes.strip(length, width), aspect_ratio=alpha)
        model = (
            Model(mesh, Sheet(E=E, t=t), formulation="bars-and-hinges", contact=False)
            .support("edge:start", "xz")
            .support("edge:end", "z")
        )
        model = model.support("corner:inner-start", "y").support("corner:inner-end", "y")
        squeeze = 3.0 * exact * length / (E * width * t)
        model = model.displace("edge:end", "x", -squeeze)
        form = formulation(model.formulation)
        system = form.system(model, load_steps(model)[0], None)
        in_plane = linear_response(system, system.start()).dq  # the strip stays flat, and strains are 1e-4
        low, high, force = 0.0, 1.0, math.nan
        for _ in range(30):
            lam = 0.5 * (low + high)
            q = lam * in_plane
            _, negative = system.tangent(q, lam, system.evaluate(q, lam).forces).matrix.factorise_any()
            state = form.observe(model, system, q, lam)
            force = -float(state.reaction("edge:end")[0])
            low, high = (lam, high) if negative == 0 else (low, lam)
        result.check(
            "Euler buckling: critical load",
            force,
            unit="N",
            reference=exact,
            source="pi^2 E I / L^2",
            tolerance=0.02 if alpha >= 8.0 else None,
            params={"alpha": alpha, "mesh": "staggered"},
        )
