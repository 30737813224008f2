"""A buckled strip that snaps when its clamps are turned against it (`verification.theory.clamped_arch`).

It is followed from the arch through the limit point, along the unstable branch (whose state at mu = 0 is the saddle between
the two arches, so its energy less that of the arch is the barrier) to the other arch, and back: both limit points are met
from both sides. A turned clamp is a short part of the strip that is held, and a crease with an imposed angle.
"""

from __future__ import annotations

import math

import numpy as np

import meshes
from bh import Displace, Fold, Model, Path, Sheet, trace
from bh.solvers.outcome import Critical
from verification.framework.checks import CaseResult, Context
from verification.studies.solver.published.common import Claim, Level, by_shell, converged
from verification.theory import clamped_arch as theory

SOURCE = "Gomez, Moulton and Vella (2017), Radisson and Kanso (2023); the elastica for small slopes solved in verification.theory.clamped_arch"
LENGTH, BREADTH, STUB = 100.0, 10.0, 5.0  # mm
SHEET = Sheet(E=4000.0, nu=0.0, t=0.02)
NEARER = 1e-3  # dL / L: slopes are small, and stretching is 2e-4 of it
UNIT = math.sqrt(NEARER)  # slope at mu = 1
FAR = 1.2  # of the critical mu, where the clamp is turned to
LEVELS = (8, 16, 32)  # rows a panel
SHELL = 8
TOLERANCE, BARRIER = 5e-3, 0.01  # relative, set before the first run
BEFORE = 2  # steps before the clamp is turned against the arch


def strip_model(both: bool, formulation: str, rows: int) -> Model:
    """The strip, its clamp turned a little and its ends brought nearer, turned back to none, against it, and back again.

    Args:
        both: both clamps are turned, mirrored.
        formulation: by name.
        rows: of cells between the clamps.
    """
    pattern = meshes.strip(BREADTH, LENGTH + 2.0 * STUB, [STUB, STUB + LENGTH])
    kind = "mirrored" if formulation == "shell" else "staggered"
    mesh = meshes.structured(pattern, along=1, rows=rows, kind=kind)
    y = mesh.points[:, 1]
    first, last = (np.flatnonzero(part).tolist() for part in (y < STUB + 1e-9, y > STUB + LENGTH - 1e-9))
    model = Model(mesh, SHEET, formulation=formulation).support(first, "xyz").support(last, "xz")
    far = FAR * (2.0 if both else theory.snap()[0])

    def turn(mu: float) -> list[Fold]:
        return [Fold(name, to=math.pi + mu * UNIT) for name in (("crease-1", "crease-2") if both else ("crease-1",))]

    still = [] if both else [Fold("crease-2", to=math.pi)]
    model = model.step(*turn(-0.5), *still, Displace(last, "y", by=-0.1 * NEARER * LENGTH))
    model = model.step(Displace(last, "y", by=-NEARER * LENGTH)).step(*turn(0.0))
    model = model.step(*turn(far))
    return model if both else model.step(*turn(-far))


def critical(path: Path, step: int, kind: Critical, both: bool) -> float:
    """mu at the first critical point of a kind in a step of `strip_model`; nan where there is none."""
    far = FAR * (2.0 if both else theory.snap()[0])
    begin, end = {3: (0.0, far), 4: (far, -far)}[step]
    found = [begin + at.lam * (end - begin) for index, at in path.critical_points if index == step and at.kind is kind]
    return found[0] if found else math.nan


def turned_clamps(result: CaseResult, context: Context) -> None:
    """One clamp (limit points, barrier), and both (a bifurcation before the limit point)."""
    levels = LEVELS[:2] if context.quick else LEVELS
    _one(result, levels)
    params = {"sheet": "buckled strip", "turned": "both clamps"}
    claim = Claim("mu where the symmetric strip branches", 2.0, SOURCE, TOLERANCE, params)
    found = []
    for formulation, rows in [*(("consistent", n) for n in levels), ("shell", SHELL)]:
        path = trace(strip_model(True, formulation, rows), neighbours=False)
        found.append(Level(f"{rows} rows", 1.0 / rows, critical(path, 3, Critical.BIFURCATION, True), path))
    converged(result, claim, found[:-1])
    by_shell(result, claim, found[-1])


def _one(result: CaseResult, levels: tuple[int, ...]) -> None:
    params = {"sheet": "buckled strip", "turned": "one clamp"}
    arch, saddle = (NEARER / LENGTH * SHEET.bending_stiffness() * BREADTH * e for e in theory.energies())
    mu = theory.snap()[0]
    claims = (
        Claim("mu at the limit point, from one arch", mu, SOURCE, TOLERANCE, params),
        Claim("mu at the limit point, from the other arch", -mu, SOURCE, TOLERANCE, params),
        Claim("energy of the arch over the closed form", 1.0, SOURCE, BARRIER, params),
        Claim("barrier between the arches over the closed form", 1.0, SOURCE, BARRIER, params),
    )
    paths = [(n, trace(strip_model(False, "consistent", n), neighbours=False)) for n in levels]
    shell = trace(strip_model(False, "shell", SHELL), neighbours=False)

    def values(path: Path) -> tuple[float, ...]:
        limits = [critical(path, step, Critical.LIMIT, False) for step in (3, 4)]
        at_rest = rest_energy(path)
        return (*limits, at_rest / arch, (saddle_energy(path) - at_rest) / (saddle - arch))

    read = [values(path) for _, path in paths]
    for i, claim in enumerate(claims):
        converged(
            result, claim, [Level(f"{n} rows", 1.0 / n, v[i], path) for (n, path), v in zip(paths, read, strict=True)]
        )
        by_shell(result, claim, Level(f"{SHELL} rows", 1.0 / SHELL, values(shell)[i], shell))


def rest_energy(path: Path) -> float:
    """Of the arch with straight clamps, N mm."""
    ends = [state for state in path if state.step == BEFORE]
    return ends[-1].energy.total if ends else math.nan


def saddle_energy(path: Path) -> float:
    """Of the unstable state at mu = 0 on the way from one arch to the other, N mm; nan where the path has none.

    A polynomial through the four states about it; mu runs monotonically there.
    """
    states = [state for state in path if state.step == BEFORE + 1]
    mu = [float(state.dihedral("crease-1").mean()) - math.pi for state in states]
    for i in range(2, len(states) - 1):
        if mu[i - 1] > 0.0 >= mu[i]:
            part = slice(i - 2, i + 2)
            energies = [state.energy.total for state in states[part]]
            return float(np.polyfit(np.array(mu[part]) / UNIT, energies, 3)[-1])
    return math.nan
