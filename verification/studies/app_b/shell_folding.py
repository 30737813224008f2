"""The folded annulus of App. B: models and solutions of its four actuations, with the shell or another formulation."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import meshes
from bh import Model, Sheet, State, trace
from bh.formulations.registry import formulation as registered
from bh.loading.builder import load_steps
from bh.runtime.threads import one_blas_thread
from bh.solvers.load_control import LoadControl
from bh.solvers.newton import Newton
from bh.solvers.outcome import Outcome
from bh.solvers.points import Point, extrapolate, point
from bh.solvers.system import System
from bh.solvers.walk import Walk, walk
from meshes.cells import Kind

SHEET = Sheet(E=4000.0, nu=0.38, t=0.127)
CREASE_STIFFNESS = 4.0e-3  # N mm / (mm rad), B.3
ANGLE = math.pi / 2
ACTUATIONS = {
    "a": "applied rotation",
    "b": "applied moment",
    "c-spring": "applied force, resisted by the crease's spring",
    "c-hinge": "applied force, the crease a free hinge",
    "d": "applied rotation, reduced supports",
}
# couple a length of crease (b, N) and force a length (c, N/mm) that fold by more than a right angle
ENOUGH = {"b": 9.0e-3, "c-spring": 2.6e-3, "c-hinge": 9.0e-4}
ROTATE = LoadControl(first_rotation=2.0, largest_rotation=2.0)  # a right angle in one increment
# where the ring buckles is asked in case `bifurcations`, and would be a third of the time here
BUCKLE = LoadControl(first_rotation=math.radians(2.0), largest_rotation=math.radians(20.0), locate=False)


@dataclass(frozen=True)
class Solved:
    """One actuation on one mesh: the state at a mean fold angle of 90 degrees and what it took.

    `load` is the couple a length (b, N) or the force a length (c, N/mm) there, nan for imposed angles. With another
    outcome than "reached" the state is the last one on the way, and none of a right angle.
    """

    state: State
    load: float
    unknowns: int
    iterations: int
    wall_time_s: float
    outcome: Outcome

    @property
    def reached(self) -> bool:
        """Whether the fold was reached."""
        return self.outcome == Outcome.REACHED


def sheet_model(
    actuation: str,
    along: int,
    rows: int,
    angle: float = math.pi / 4,
    nu: float = SHEET.nu,
    *,
    formulation: str = "shell",
    kind: Kind = "mirrored",
) -> Model:
    """Sheet and supports of B.3, not yet actuated; the straight edge with the pins lies on the x axis.

    Cells in the plane: `along` the crease, `rows` on either side.
    """
    pattern = meshes.annulus_sector(100.0, 10.0, angle)
    mesh = meshes.structured(pattern, along=along, rows=rows, kind=kind)
    model = Model(mesh, replace(SHEET, nu=nu), formulation=formulation, contact=False)
    model = model.support("corner:inner-start", "xyz").support("corner:outer-start", "yz")
    if actuation == "d":
        return model.support("corner:inner-end", "z").support("corner:outer-end", "z")
    return model.support("edge:inner", "z").support("edge:outer", "z")


def full_annulus(along: int, rows: int) -> Model:
    """Fig. B.7 (a): the whole ring, which buckles into two waves when it is folded.

    The phase of the waves costs nothing, which leaves the states undetermined. Supports at the places that stay put by
    symmetry take it away, and carry no force: z where the crease crosses its own plane, y and x at the crests.
    """
    mesh = meshes.structured(meshes.full_annulus(100.0, 10.0), along=along, rows=rows, kind="mirrored")
    nodes = mesh.nodes("crease:crease")
    phase = np.arctan2(mesh.points[nodes, 1], mesh.points[nodes, 0])
    model = Model(mesh, SHEET, formulation="shell", contact=False)
    for eighth, fix in ((1, "z"), (3, "z"), (5, "z"), (7, "z"), (0, "y"), (4, "y"), (2, "x")):
        off = np.abs(np.angle(np.exp(1j * (phase - eighth * math.pi / 4))))
        model = model.support([int(nodes[np.argmin(off)])], fix)
    return model


def solve(
    actuation: str, along: int, rows: int, formulation: str = "shell", kind: Kind = "mirrored"
) -> Solved:
    """Fold to a mean fold angle of 90 degrees by one of `ACTUATIONS`.

    Only the shell folds by a right angle in one increment; the others take those of the driver.
    """
    model = sheet_model(actuation, along, rows, formulation=formulation, kind=kind)
    if actuation in ("a", "d"):
        return rotate(model, strategy=ROTATE if formulation == "shell" else None)
    if actuation == "b":
        spring = model.crease("crease", stiffness=CREASE_STIFFNESS)
        return load(spring.moment("crease", to=ENOUGH[actuation]), ENOUGH[actuation])
    crease = model.crease("crease", stiffness=CREASE_STIFFNESS if actuation == "c-spring" else 0.0)
    length = 100.0 * math.pi / 4
    most = ENOUGH[actuation]
    return load(crease.force("crease:crease", total=(0.0, 0.0, most * length)), most)


def rotate(model: Model, crease: str = "crease", strategy: LoadControl | None = ROTATE) -> Solved:
    """Impose the right angle, mountain or valley as drawn; by default in one increment from flat.

    `strategy` None is the driver's own. Other stable states are looked for by the case `branches`, not here.
    """
    began = time.perf_counter()
    path = trace(model.fold(crease, by=ANGLE), strategy=strategy, neighbours=False)
    state = path[-1]
    spent = time.perf_counter() - began
    return Solved(state, math.nan, path.unknowns, path.iterations, spent, path.outcome)


def load(model: Model, most: float) -> Solved:
    """Load until the mean fold angle is a right angle; `most` is the load at lambda = 1."""
    with one_blas_thread():
        return _load(model, most)


def _load(model: Model, most: float) -> Solved:
    began = time.perf_counter()
    solver = registered(model.formulation)
    system = solver.system(model, load_steps(model)[0], None)

    def mean_fold(at: Point) -> float:
        return float(solver.observe(model, system, at.q, at.lam).fold_angle("crease").mean())

    points = [point(system, system.start(), 0.0)]
    iterations, outcome = 0, Outcome.REACHED
    for increment in walk(Walk(system, LoadControl(), (points[0],))):
        iterations += increment.iterations
        outcome = increment.outcome
        if outcome == Outcome.REACHED:
            points.append(increment.point)
        if outcome != Outcome.REACHED or mean_fold(points[-1]) > ANGLE:
            break
    if outcome == Outcome.REACHED and mean_fold(points[-1]) <= ANGLE:
        outcome = Outcome.STALLED  # the load is not enough
    here = points[-1]
    if outcome == Outcome.REACHED:
        here, more = meet(system, points, mean_fold)
        iterations += more
        if abs(mean_fold(here) - ANGLE) > 1e-6:
            outcome = Outcome.STALLED
    state = solver.observe(model, system, here.q, here.lam)
    spent = time.perf_counter() - began
    return Solved(state, here.lam * most, system.size, iterations, spent, outcome)


def meet(system: System, points: list[Point], mean_fold: Callable[[Point], float]) -> tuple[Point, int]:
    """The state between the last two points whose mean fold angle is the right one, by the secant method in lambda."""
    path = list(points[-3:])
    (low, high), iterations = path[-2:], 0
    folds = [mean_fold(low) - ANGLE, mean_fold(high) - ANGLE]
    lams = [low.lam, high.lam]
    for _ in range(12):
        lam = lams[-1] - folds[-1] * (lams[-1] - lams[-2]) / (folds[-1] - folds[-2])
        solution = Newton().solve(system, *_guess(path, lam))
        iterations += solution.iterations
        if not solution.converged:
            break
        found = point(system, solution.q, lam, evaluation=solution.evaluation)
        lams.append(lam)
        folds.append(mean_fold(found) - ANGLE)
        path = [*path[-2:], found]
        if abs(folds[-1]) < 1e-7:
            break
    return path[-1], iterations


def _guess(points: list[Point], lam: float) -> tuple[np.ndarray, float, np.ndarray]:
    q, forces = extrapolate(points, lam)
    return q, lam, forces
