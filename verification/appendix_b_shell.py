"""Case `appendix_b_shell` (source App. B): the four actuations with the shell, converged, beside Table B.1."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import meshes
from bh import Model, Path, Sheet, trace
from bh.solvers.continuation import LoadControl
from fem.observables import ShellState
from verification.checks import CaseResult, Check, Context, line, plot
from verification.theory import cone

SHEET = Sheet(E=4000.0, nu=0.38, t=0.127)
CREASE_STIFFNESS = 4.0e-3  # N mm / (mm rad), B.3
ANGLE = math.pi / 2
TABLE_B1 = {  # in-plane, bending, total, N mm
    "a": (1.67e-3, 5.30e-2, 5.47e-2),
    "b": (1.67e-3, 5.31e-2, 5.48e-2),
    "c": (3.14e-3, 5.56e-2, 5.87e-2),
    "d": (1.62e-3, 4.97e-2, 5.13e-2),
}
NAMES = {
    "a": "applied rotation",
    "b": "applied moment",
    "c-spring": "applied force, the crease's spring resists it",
    "c-hinge": "applied force, the crease is a free hinge",
    "d": "applied rotation, reduced supports",
}
SOURCE = "source Table B.1 (shell elements, nu = 0.38)"
DENSITIES = ((16, 2), (32, 4), (64, 8))  # cells along the crease and rows each side
ROTATE = LoadControl(first_rotation=2.0, largest_rotation=2.0)  # a right angle in one increment


@dataclass(frozen=True)
class Solved:
    """One actuation on one mesh: the state at a mean dihedral angle of 90 degrees and what it took.

    `load` is the couple a length (b, N) or the force a length (c, N/mm) there, nan for imposed angles.
    """

    state: ShellState
    load: float
    unknowns: int
    iterations: int
    wall_time_s: float
    outcome: str


def sheet_model(
    actuation: str, along: int, rows: int, angle: float = math.pi / 4, nu: float = SHEET.nu
) -> Model:
    """Sheet and supports of B.3, not yet actuated; the straight edge with the pins lies on the x axis."""
    pattern = meshes.annulus_sector(100.0, 10.0, angle)
    mesh = meshes.structured(pattern, along=along, rows=rows, kind="mirrored")
    model = Model(mesh, Sheet(E=SHEET.E, nu=nu, t=SHEET.t), formulation="shell")
    model = model.support("corner:inner-start", "xyz").support("corner:outer-start", "yz")
    if actuation == "d":
        return model.support("corner:inner-end", "z").support("corner:outer-end", "z")
    return model.support("edge:inner", "z").support("edge:outer", "z")


def solve(actuation: str, along: int, rows: int) -> Solved:
    """Fold to a mean dihedral angle of 90 degrees by one of `NAMES`."""
    model = sheet_model(actuation, along, rows)
    began = time.perf_counter()
    if actuation in ("a", "d"):
        path = trace(model.fold("crease", to=math.pi - ANGLE), strategy=ROTATE)
        return _solved([path], math.nan, began)
    if actuation == "b":
        return until(
            lambda m: model.crease("crease", stiffness=CREASE_STIFFNESS).moment("crease", to=m), 6.5e-3, began
        )
    stiffness = CREASE_STIFFNESS if actuation == "c-spring" else 0.0
    crease = model.crease("crease", stiffness=stiffness)
    length = 100.0 * math.pi / 4
    guess = 1.4e-3 if stiffness else 7.5e-4
    return until(lambda f: crease.force("crease:crease", total=(0.0, 0.0, f * length)), guess, began)


def until(loaded: Callable[[float], Model], guess: float, began: float) -> Solved:
    """Load at which the mean fold angle is a right angle, by the secant method; each trial is a path from flat."""
    loads: list[float] = [guess, 1.05 * guess]
    angles: list[float] = []
    paths: list[Path] = []
    while True:
        paths.append(trace(loaded(loads[len(angles)])))
        if paths[-1].outcome != "reached":
            return _solved(paths, loads[len(angles)], began)
        angles.append(float(paths[-1][-1].fold_angle("crease").mean()))
        if abs(angles[-1] - ANGLE) < 1e-6 or len(angles) == 12:
            return _solved(paths, loads[len(angles) - 1], began)
        if len(angles) > 1:
            slope = (angles[-1] - angles[-2]) / (loads[-1] - loads[-2])
            loads.append(loads[-1] + (ANGLE - angles[-1]) / slope)


def _solved(paths: list[Path], load: float, began: float) -> Solved:
    state = paths[-1][-1]
    assert isinstance(state, ShellState)
    return Solved(
        state, load, paths[-1].unknowns, sum(path.iterations for path in paths), time.perf_counter() - began,
        paths[-1].outcome,
    )  # fmt: skip
