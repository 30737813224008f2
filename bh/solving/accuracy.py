"""Solve to a wanted accuracy: choose formulation and mesh by measured errors, estimate, refine until it holds.

A level n of refinement has n rows of cells in each panel. A model is solved at three levels, each twice as fine as the
one before, and at finer ones until the estimate is small enough. The estimate is that of Roache (1994): with the last
two values v1, v2 and the order p that the last three show, but not more than `ORDERS[1]`,

    error of v2 = SAFETY |v2 - v1| / (2^p - 1)

where |v2 - v1| counts as at least what second order leaves of the difference before it: values that go up and then
down are close to each other once without being close to their limit. Where they turn back, or the differences do not
fall, p is `ORDERS[0]`. Meshes of gmsh are no halves of each other, so three of them show no order that is worth much:
SAFETY is twice as large until a fourth one is solved. Meshes that snap to another branch in other steps than the last
one does are left out.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bh.analysis.stiffness_probe import Probe
from bh.errors import ModelError, TooCoarseError
from bh.formulations.protocols import Mirrored, Refinable
from bh.formulations.registry import formulation, names
from bh.loading.builder import load_steps
from bh.loading.symmetry import Plane
from bh.model.model import Model
from bh.model.refinement import Goal, Refinement, pattern_of, with_mesh
from bh.paths.estimate import Accuracy, Trial
from bh.paths.path import Path
from bh.runtime.progress import ProgressMeter, meter, stage
from bh.solvers.outcome import Critical, Outcome
from bh.solvers.walk import Strategy
from bh.solving.follow import follow, look_beside
from bh.solving.levels import Levels
from bh.solving.mesh_choice import Ladder
from bh.solving.race import Race
from meshes import MeshError, SheetMesh
from meshes.cells import Cells, GmshCells

Array = NDArray[np.float64]
SAFETY = 1.5
FEW_UNLIKE = 4, 2.0  # meshes of gmsh before which the safety is so many times as large
ORDERS = (1.0, 2.0)
NOTHING = 1e-6  # of E t^3: an energy that is none, such as that of straight creases that nothing holds


def solve(
    model: Model,
    goal: Goal,
    *,
    progress: bool | ProgressMeter = False,
    strategy: Strategy | None = None,
    symmetry: Plane | None = None,
    levels: Levels | None = None,
    neighbours: bool | None = None,
) -> Path:
    """Trace a model to a wanted accuracy; its own mesh and formulation only say what the sheet is.

    Args:
        model: what is solved.
        goal: what is to be how accurate, and at which cost.
        progress: as for `bh.trace`; a meter that has a method `stage` is told the mesh that comes next.
        strategy: as for `bh.trace`.
        symmetry: as for `bh.trace`.
        levels: where the path of every mesh is kept, and found again.
        neighbours: as for `bh.trace`; looked for once, on the mesh before the one that is taken.

    Returns:
        the path on the finest mesh; `path.accuracy` says what was chosen, estimated and spent. If the estimate does not
        hold within the cost of the goal, or falls no more, `met` is False, and the path is that of the best estimate.

    Raises:
        ModelError: the model cannot be meshed anew, or has no such goal.
        MeshError: no mesh can be made of it.
    """
    began = time.perf_counter()
    pattern = pattern_of(model)
    _check(model, goal)
    race = Race(goal, candidates(symmetric=symmetry is not None))
    task = _Task(model, goal, meter(progress), strategy, symmetry, levels)
    ladders = {name: Ladder(pattern, option.kind, race.first(name)) for name, option in race.options.items()}
    trials: list[Trial] = []
    found: list[_Found] = []
    why, failed = "", None
    while (turn := race.next()) is not None and not (why := race.too_long(trials)):
        name, step = turn
        try:
            coarser = found[-1].path if found and found[-1].formulation == name else None
            path, trial = task.solve(ladders[name], name, race.tried[name][-1], step, coarser)
        except (MeshError, TooCoarseError) as error:
            failed = failed or error
            race.out[name] = f"{name} has no mesh of this sheet ({error.args[0].split(';')[0]})"
            continue
        trials = mark_doubtful([*trials, trial])
        values = trusted(trials, name)
        error_, order = estimate(values, nothing(model, goal), safety(path, len(values)))
        found.append(_Found(path, error_, order, name, str(trial.mesh)))
        if error_ <= goal.within:
            break
        race.judge(name, trials, [item.error for item in found if item.formulation == name])
    if not found:
        raise failed or ModelError("no formulation is left to solve this with")
    path = _chosen(goal, found, trials, _notes(race, ladders, trials, why), time.perf_counter() - began)
    if neighbours is not False:
        look_beside(path, _before(path, found), asked=bool(neighbours))
    return path


@dataclass(frozen=True)
class _Found:
    """A solved mesh and the estimate that was made there."""

    path: Path
    error: float
    order: float
    formulation: str
    mesh: str


@dataclass(frozen=True)
class _Task:
    """What is the same on every mesh."""

    model: Model
    goal: Goal
    report: ProgressMeter
    strategy: Strategy | None
    symmetry: Plane | None
    levels: Levels | None

    def solve(
        self, ladder: Ladder, name: str, level: float, step: int, coarser: Path | None
    ) -> tuple[Path, Trial]:
        """Solve mesh number `step` of a ladder; `coarser` is the path on the one before."""
        clock = time.perf_counter()

        def on_mesh(mesh: SheetMesh, cells: Cells) -> Path:
            stage(self.report, f"{name}, {cells}")
            file = None if self.levels is None else self.levels.file(name, cells)
            return follow(
                with_mesh(self.model, mesh, name),
                progress=self.report,
                strategy=self.strategy,
                symmetry=self.symmetry,
                file=file,
                resume=file is not None and file.exists(),
                coarser=coarser if self.symmetry is None else None,
                neighbours=False,  # only that of the mesh that is taken is shown
            )

        path, cells = ladder.solve(step, on_mesh)
        value = reading(path, self.goal) if path.reached else np.array([math.nan])
        spent = max(
            time.perf_counter() - clock, path.wall_time_s
        )  # what was found solved has cost its time before
        return path, Trial(
            name,
            level,
            str(cells),
            len(path.model.mesh.triangles),
            path.unknowns,
            path.iterations,
            spent,
            path.outcome,
            value,
            snaps(path),
        )


def _chosen(goal: Goal, found: Sequence[_Found], trials: list[Trial], notes: list[str], spent: float) -> Path:
    """The last path where its estimate holds, else the one with the best estimate."""
    best = min(reversed(found), key=lambda item: item.error)
    if not math.isfinite(best.error):
        best = found[-1]
    path, met = best.path, best.error <= goal.within
    path.accuracy = Accuracy(
        goal,
        best.error,
        met,
        best.order,
        best.formulation,
        _words(path, best.mesh),
        tuple(trials),
        spent,
        notes=tuple(notes if not met else [note for note in notes if not note.startswith("ended")]),
    )
    return path


def _before(path: Path, found: Sequence[_Found]) -> Path | None:
    """The path on the mesh before that of `path`, of the same formulation, if both were reached."""
    paths = [item.path for item in found if item.formulation == path.model.formulation]
    number = next(i for i, other in enumerate(paths) if other is path)
    return paths[number - 1] if number > 0 and path.reached and paths[number - 1].reached else None


def _notes(race: Race, ladders: dict[str, Ladder], trials: Sequence[Trial], why: str) -> list[str]:
    """What was not as planned, and why the run ended, last."""
    notes = [note for name in race.tried for note in ladders[name].notes]
    notes += [
        f"doubtful: {t.formulation}, {t.mesh}: it snaps to another branch where the next mesh does not"
        for t in trials
        if t.doubtful
    ]
    if len(trials) > 1 and (alone := set(trials[-1].snaps) - set(trials[-2].snaps)):
        notes.append(
            f"doubtful: {trials[-1].formulation}, {trials[-1].mesh}: it snaps to another branch in "
            f"{steps_in_words(alone)}, which the mesh before does not, and no finer one was solved"
        )
    return notes + [f"ended: {text}" for text in dict.fromkeys([*race.out.values(), *([why] if why else [])])]


def snaps(path: Path) -> tuple[int, ...]:
    """In which steps a path passes a limit point or jumps to another branch, or ends where it is not stable.

    A mesh that repeats the snap of another one does so in the same step; that both snap somewhere says nothing.

    Returns:
        their numbers, from 1, in order.
    """
    found = {
        record.step
        for record in path.records
        if record.jumped or any(passed.kind is Critical.LIMIT for passed in record.critical)
    }
    if path.stable is False:
        found.add(path.records[-1].step)
    return tuple(step + 1 for step in sorted(found))


def steps_in_words(steps: Iterable[int]) -> str:
    """What stands in a remark: "step 2", or "steps 1 and 3"."""
    *before, last = sorted(steps)
    return f"steps {', '.join(map(str, before))} and {last}" if before else f"step {last}"


def mark_doubtful(trials: Sequence[Trial]) -> list[Trial]:
    """The trials, marked where one snapped in a step in which the next of its formulation, which was reached, did not.

    Returns:
        the trials in order.
    """
    found = list(trials)
    for k, trial in enumerate(found):
        after = next((t for t in found[k + 1 :] if t.formulation == trial.formulation), None)
        doubtful = (
            after is not None
            and after.outcome is Outcome.REACHED
            and not set(trial.snaps) <= set(after.snaps)
        )
        found[k] = replace(trial, doubtful=doubtful)
    return found


def trusted(trials: Sequence[Trial], name: str) -> list[Array]:
    """Values of a formulation that an estimate may be made of, coarse to fine: those that snap in the same steps.

    Args:
        trials: coarse to fine.
        name: of the formulation.

    Returns:
        one vector a trial.
    """
    own = [trial for trial in trials if trial.formulation == name]
    return [trial.value for trial in own if not trial.doubtful and trial.snaps == own[-1].snaps]


def safety(path: Path, meshes: int) -> float:
    """On the difference of the last two meshes.

    Args:
        path: on the last one.
        meshes: how many values there are.
    """
    few, times = FEW_UNLIKE
    unlike = isinstance(path.model.mesh.cells, GmshCells)
    return SAFETY * times if unlike and meshes < few else SAFETY


def estimate(values: Sequence[Array], nothing: float = 0.0, safety: float = SAFETY) -> tuple[float, float]:
    """(estimated relative error of the last value, observed order) of values on meshes twice as fine each.

    Args:
        values: vectors, coarse to fine.
        nothing: a size below which a value is none; the error is told of that size then.
        safety: factor on what the order says.

    Returns:
        (inf, nan) for fewer than three of them in a row.
    """
    last = values[-3:]
    if len(last) < 3 or not all(np.isfinite(v).all() for v in last):
        return math.inf, math.nan
    size = max(float(np.linalg.norm(last[2])), nothing)
    before, now = (float(np.linalg.norm(b - a)) for a, b in pairwise(last))
    if size == 0.0:
        return (0.0 if now == 0.0 else math.inf), math.nan
    onward = float((last[1] - last[0]) @ (last[2] - last[1])) > 0.0
    order = math.log2(before / now) if onward and 0.0 < now < before else math.nan
    p = min(max(order, ORDERS[0]), ORDERS[1]) if math.isfinite(order) else ORDERS[0]
    left = max(now, before / 2.0 ** ORDERS[1]) / (2.0**p - 1.0)
    return safety * left / size, order


def candidates(symmetric: bool = False) -> dict[str, Refinement]:
    """The formulations that say on which meshes they converge; if `symmetric`, those that take a plane of symmetry.

    Returns:
        how each refines, by name.

    Raises:
        ModelError: there is none.
    """
    known = {}
    for name in names():
        found = formulation(name)
        if (
            isinstance(found, Refinable)
            and found.refinement
            and (not symmetric or isinstance(found, Mirrored))
        ):
            known[name] = found.refinement
    if not known:
        raise ModelError(
            "no formulation is installed that says how its meshes are refined; install the project with pip"
        )
    return known


def _check(model: Model, goal: Goal) -> None:
    if not model.steps:
        raise ModelError("the model has no steps; add one, for example model.fold('crease', to=1.57)")
    if goal.at is not None:
        if goal.at.startswith("node:"):
            raise ModelError(
                f"accuracy at '{goal.at}' names a node of one mesh; name a corner, an edge or a crease"
            )
        model.mesh.nodes(goal.at)
    if goal.of == "tip" and any(step.constraints.rigid_body for step in load_steps(model)):
        raise ModelError(
            "a sheet that is free to move has no tip displacement of its own; hold it, or ask for the energy"
        )


def reading(path: Path, goal: Goal) -> Array:
    """The goal at the last state, as a vector.

    Args:
        path: that reached its end.
        goal: what is measured.

    Returns:
        (k,) in the goal's own unit.

    Raises:
        ModelError: the place is held in the direction of the goal and has no stiffness there.
    """
    state = path[-1]
    if goal.of == "energy":
        return np.array([state.energy.total])
    assert goal.at is not None
    if goal.of == "tip":
        return np.asarray(state.displacement(goal.at).mean(axis=0))
    stiffness = float(Probe(path).at(goal.at).loaded(np.asarray(goal.direction)))
    if not math.isfinite(stiffness):
        raise ModelError(
            f"'{goal.at}' is held in that direction and has no stiffness there; ask at another place"
        )
    return np.array([stiffness])


def nothing(model: Model, goal: Goal) -> float:
    """The size below which a goal is none.

    Args:
        model: of the sheet.
        goal: what is measured.
    """
    return NOTHING * model.sheet.E * model.sheet.t**3 if goal.of == "energy" else 0.0


def _words(path: Path, cells: str) -> str:
    return f"{len(path.model.mesh.triangles)} triangles ({cells})"
