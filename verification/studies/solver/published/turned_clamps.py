"""A buckled strip that snaps when its clamps are turned against it (`verification.theory.clamped_arch`).

It is followed from the arch through the limit point and along the unstable branch to its state at mu = 0, the
saddle between the two arches, whose energy less that of the arch is the barrier. A turned clamp is a short
part of the strip that is held, and a crease with an imposed angle.
"""

from __future__ import annotations

import math

import numpy as np

from bh import Displace, Fold, Model, Path, Sheet, Until, trace
from bh.solvers.outcome import Critical, Outcome
from verification.framework.checks import CaseResult, Context, Cost
from verification.studies.solver.published.common import (
    Claim,
    Level,
    by_shell,
    converged,
    strip_mesh,
)
from verification.theory import clamped_arch as theory

SOURCE = (
    "Gomez, Moulton and Vella (2017), Radisson and Kanso (2023); the elastica for small slopes solved in "
    "verification.theory.clamped_arch"
)
LENGTH, BREADTH = 100.0, 10.0  # mm
STUB = 0.1  # mm; its own bending makes a clamp softer by a third of its length
SHEET = Sheet(E=4000.0, nu=0.0, t=0.02)
NEARER = 1e-3  # dL / L: slopes are small, and stretching is 2e-4 of it
UNIT = math.sqrt(NEARER)  # slope at mu = 1
FAR = 1.2  # of the critical mu, where the clamp is turned to; only just beyond where both are
FAR_BOTH = 1.05
LEVELS = ((2, 16), (4, 32), (8, 64))  # cells across the strip, rows between the clamps
SHELL = (2, 16)
TOLERANCE, BARRIER = 5e-3, 0.01  # relative, set before the first run
REST, AGAINST = 2, 3  # steps: the arch between straight clamps; the clamp turned against it


def strip_model(both: bool, formulation: str, along: int, rows: int, side: float = 1.0) -> Model:
    """The strip: its clamp turned a little, its ends brought nearer, the clamp turned back, and against the arch.

    One clamp is turned until the middle of the strip is level, which is the unstable state at mu = 0.

    Args:
        both: both clamps are turned, mirrored.
        formulation: by name.
        along: cells across the strip.
        rows: of cells between the clamps, an even number.
        side: 1 for the arch above, -1 for the one below.
    """
    lines = [0.0, *(STUB + np.linspace(0.0, LENGTH, rows + 1)), LENGTH + 2.0 * STUB]
    mesh = strip_mesh(lines, BREADTH, along, {"crease-1": STUB, "crease-2": STUB + LENGTH})
    y = mesh.points[:, 1]
    first, last = (np.flatnonzero(part).tolist() for part in (y < STUB + 1e-9, y > STUB + LENGTH - 1e-9))
    model = (
        Model(mesh, SHEET, formulation=formulation, contact=False).support(first, "xyz").support(last, "xz")
    )
    # without its own clamp so short a part could bow between its nodes
    model = model.support("edge:inner", "z", clamp=True).support("edge:outer", "z", clamp=True)

    def turn(mu: float) -> list[Fold]:
        names = ("crease-1", "crease-2") if both else ("crease-1",)
        return [Fold(name, to=math.pi + side * mu * UNIT) for name in names]

    still = [] if both else [Fold("crease-2", to=math.pi)]
    model = model.step(*turn(0.5), *still).step(Displace(last, "y", by=-NEARER * LENGTH)).step(*turn(0.0))
    middle = int(np.argmin(np.abs(mesh.points - [0.0, STUB + 0.5 * LENGTH, 0.0]).sum(axis=1)))
    level = None if both else Until("displacement_z", 0.0, of=f"node:{middle}", tolerance=1e-4)
    return model.step(*turn(-farthest(both)), until=level)


def farthest(both: bool) -> float:
    """Mu that the clamps are turned to against the arch.

    Args:
        both: both clamps are turned.
    """
    return 2.0 * FAR_BOTH if both else FAR * theory.snap()[0]


def critical(path: Path, kind: Critical, both: bool) -> float:
    """Mu against the arch at the first critical point of a kind; nan where there is none.

    Args:
        path: of `strip_model`.
        kind: of the point.
        both: both clamps are turned.
    """
    found = [at.lam for step, at in path.critical_points if step == AGAINST and at.kind is kind]
    return found[0] * farthest(both) if found else math.nan


NOTE = (
    "Snapping strip: first results changed the set-up (held parts of 5 mm became 0.1 mm with clamped outer "
    "edges, meshes of square cells, the path ends in the saddle in place of going to the other arch and "
    "back); the tolerances are those of before. The arch below is the mirror image of the one above and gives "
    "the same figures: it shows symmetry alone."
)


def snapping_strip(result: CaseResult, context: Context) -> None:
    """One clamp (limit points, barrier), and both (a bifurcation before the limit point)."""
    result.notes.append(NOTE)
    levels = LEVELS[:2] if context.quick else LEVELS
    for side, name in (
        ((1.0, "arch above"),) if context.quick else ((1.0, "arch above"), (-1.0, "arch below"))
    ):
        _one(result, levels if side > 0.0 else levels[-1:], side, name)
    params = {"sheet": "buckled strip", "turned": "both clamps"}
    claim = Claim("mu where the symmetric strip branches", 2.0, SOURCE, TOLERANCE, params)
    found = []
    for formulation, mesh in [*(("consistent", mesh) for mesh in levels), ("shell", SHELL)]:
        path = trace(strip_model(True, formulation, *mesh), neighbours=False)
        found.append(_level(mesh, critical(path, Critical.BIFURCATION, True), path))
    converged(result, claim, found[:-1])
    by_shell(result, claim, found[-1])


def _one(result: CaseResult, levels: tuple[tuple[int, int], ...], side: float, name: str) -> None:
    params = {"sheet": "buckled strip", "turned": "one clamp", "from": name}
    arch, saddle = (NEARER / LENGTH * SHEET.bending_stiffness() * BREADTH * e for e in theory.energies())
    claims = (
        Claim("mu at the limit point", theory.snap()[0], SOURCE, TOLERANCE, params),
        Claim(
            "mu of the saddle between the arches over its own at the limit point",
            0.0,
            SOURCE,
            TOLERANCE,
            params,
        ),
        Claim("energy of the arch over the closed form", 1.0, SOURCE, BARRIER, params),
        Claim("barrier between the arches over the closed form", 1.0, SOURCE, BARRIER, params),
    )
    paths = [
        (mesh, trace(strip_model(False, "consistent", *mesh, side), neighbours=False)) for mesh in levels
    ]
    shell = trace(strip_model(False, "shell", *SHELL, side), neighbours=False)

    def values(path: Path) -> tuple[float, ...]:
        rest, level = (_end(path, step) for step in (REST, AGAINST))
        at = path[-1].lam * FAR if _level_met(path) else math.nan
        return critical(path, Critical.LIMIT, False), at, rest / arch, (level - rest) / (saddle - arch)

    read = [values(path) for _, path in paths]
    for i, claim in enumerate(claims):
        converged(
            result, claim, [_level(mesh, v[i], path) for (mesh, path), v in zip(paths, read, strict=True)]
        )
        by_shell(result, claim, _level(SHELL, values(shell)[i], shell))


def _level_met(path: Path) -> bool:
    return path.outcome in (Outcome.REACHED, Outcome.UNSTABLE) and len(path.steps) == AGAINST + 1


def _level(mesh: tuple[int, int], value: float, path: Path) -> Level:
    """A mesh; that a path ends in the saddle, which is not stable, is what is asked of it."""
    found = path.outcome is Outcome.UNSTABLE
    took = Cost.of(path, outcome=Outcome.REACHED) if found else path
    return Level("{} x {}".format(*mesh), 1.0 / mesh[1], value, took)


def _end(path: Path, step: int) -> float:
    """Energy at the end of a step, N mm; nan where it was not reached."""
    ends = [state for state in path if state.step == step]
    return ends[-1].energy.total if ends and (step < AGAINST or _level_met(path)) else math.nan
