"""Solve to a wanted accuracy: choose formulation and mesh by measured errors, estimate, refine until it holds.

A level n of refinement has n rows of cells in each panel. A model is solved at three levels, each twice as fine as the
one before, and at finer ones until the estimate is small enough. The estimate is that of Roache (1994): with the last
two values v1, v2 and the order p that the last three show, but not more than `ORDERS[1]`,

    error of v2 = SAFETY |v2 - v1| / (2^p - 1)

where |v2 - v1| counts as at least what second order leaves of the difference before it: values that go up and then
down are close to each other once without being close to their limit. Where they turn back, or the differences do not
fall, p is `ORDERS[0]`.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.registry import formulation, names
from bh.loading.program import program
from bh.loading.symmetry import Plane
from bh.model.model import Model
from bh.model.refinement import Goal, Refinement, mesh_at, pattern_of, with_mesh
from bh.paths.path import Path
from bh.runtime.progress import ProgressMeter
from bh.solvers.trace import Strategy
from bh.solving.follow import trace

Array = NDArray[np.float64]
LARGEST = 40_000  # triangles
FALLING = 0.9  # an estimate that does not fall by this factor from one mesh to the next falls no more
LOST = 3  # meshes in a row whose path ends early
SAFETY = 1.5
ORDERS = (1.0, 2.0)


@dataclass(frozen=True)
class Trial:
    """One solve on the way: formulation, level, mesh, cost and the value of the goal: (k,), nan if not reached."""

    formulation: str
    level: float
    triangles: int
    unknowns: int
    iterations: int
    wall_time_s: float
    outcome: str
    value: Array


@dataclass(frozen=True)
class Accuracy:
    """How accurate a path is by its own estimate, and what that took.

    Attributes:
        goal: what was asked for.
        estimate: of the relative error of the goal at the last state; inf where there is none.
        met: whether the estimate is within what was asked for.
        order: that the last three values show, nan where they show none.
        formulation, mesh: what was chosen.
        trials: all solves, coarse to fine.
        wall_time_s: of all of them with their meshes.
    """

    goal: Goal
    estimate: float
    met: bool
    order: float
    formulation: str
    mesh: str
    trials: tuple[Trial, ...]
    wall_time_s: float

    def __str__(self) -> str:
        """ "energy to 1.3 % by its own estimate (2 % asked): consistent, 32 x 4 staggered cells; 3 meshes, 0.11 s" """
        met = "asked" if self.met else "asked, not met"
        return (
            f"{self.goal.of} to {100 * self.estimate:.2g} % by its own estimate ({100 * self.goal.within:g} % {met}): "
            f"{self.formulation}, {self.mesh}; {len(self.trials)} meshes, {self.wall_time_s:.2g} s"
        )

    def as_dict(self) -> dict[str, object]:
        """Plain data for result.json."""
        return {
            "of": self.goal.of,
            "at": self.goal.at,
            "within": self.goal.within,
            "estimate": self.estimate if math.isfinite(self.estimate) else None,
            "met": self.met,
            "order": self.order if math.isfinite(self.order) else None,
            "formulation": self.formulation,
            "mesh": self.mesh,
            "wall_time_s": self.wall_time_s,
            "trials": [{**asdict(t), "value": _plain(t.value)} for t in self.trials],
        }


def _plain(value: Array) -> list[float] | None:
    return [float(v) for v in value] if np.isfinite(value).all() else None


def solve(
    model: Model,
    goal: Goal,
    *,
    progress: bool | ProgressMeter = False,
    strategy: Strategy | None = None,
    symmetry: Plane | None = None,
) -> Path:
    """Trace a model to a wanted accuracy; its own mesh and formulation only say what the sheet is.

    Returns:
        the path on the finest mesh; `path.accuracy` says what was chosen, estimated and spent. If the estimate does not
        hold with up to `LARGEST` triangles, or falls no more, `met` is False.

    Raises:
        ModelError: the model cannot be meshed anew, or has no such goal.
    """
    began = time.perf_counter()
    pattern = pattern_of(model)
    _check(model, goal)
    race = _Race(goal, candidates(halves=symmetry is not None))
    trials: list[Trial] = []
    error, order, lost = math.inf, math.nan, 0
    while True:
        name, level = race.next()
        mesh = mesh_at(pattern, race.options[name].kind, level)
        clock = time.perf_counter()
        path = trace(with_mesh(model, mesh, name), progress=progress, strategy=strategy, symmetry=symmetry)
        reached = path.outcome == "reached"
        value = reading(path, goal) if reached else np.array([math.nan])
        spent = time.perf_counter() - clock
        trials.append(
            Trial(
                name, level, len(mesh.triangles), path.unknowns, path.iterations, spent, path.outcome, value
            )
        )
        before = error
        error, order = estimate([t.value for t in trials if t.formulation == name])
        lost = 0 if reached else lost + 1
        stuck = len(race.tried[name]) > 3 and error > FALLING * before
        if error <= goal.within or lost == LOST or stuck or 4 * len(mesh.triangles) > LARGEST:
            break
    met, spent = error <= goal.within, time.perf_counter() - began
    path.accuracy = Accuracy(goal, error, met, order, name, _words(path), tuple(trials), spent)
    return path


@dataclass
class _Race:
    """Which formulation at which level comes next.

    The formulation that is likely to be the cheapest begins, with three levels. Where its estimate does not hold it is
    refined further, unless another one is likely to do the whole in less time than that level takes.
    """

    goal: Goal
    options: Mapping[str, Refinement]
    tried: dict[str, list[float]] = field(default_factory=dict)

    def next(self) -> tuple[str, float]:
        within = self.goal.within
        now = next(reversed(self.tried), "")
        fresh = [name for name in self.options if name not in self.tried]
        best = min(fresh, key=lambda name: self.options[name].time(within), default="")
        if now and len(self.tried[now]) >= 3:
            option = self.options[now]
            ahead = option.cost * (2.0 * self.tried[now][-1]) ** option.power
            if best and self.options[best].time(within) < ahead:
                now = ""
        if not now:
            now = best
            self.tried[now] = []
        levels = self.tried[now]
        levels.append(2.0 * levels[-1] if levels else self.options[now].level(within) / 4.0)
        return now, levels[-1]


def estimate(values: list[Array]) -> tuple[float, float]:
    """(estimated relative error of the last value, observed order) of values on meshes twice as fine each.

    Values are vectors; (inf, nan) for fewer than three of them in a row.
    """
    last = values[-3:]
    if len(last) < 3 or not all(np.isfinite(v).all() for v in last):
        return math.inf, math.nan
    size = float(np.linalg.norm(last[2]))
    before, now = (float(np.linalg.norm(b - a)) for a, b in pairwise(last))
    if size == 0.0:
        return (0.0 if now == 0.0 else math.inf), math.nan
    onward = float((last[1] - last[0]) @ (last[2] - last[1])) > 0.0
    order = math.log2(before / now) if onward and 0.0 < now < before else math.nan
    p = min(max(order, ORDERS[0]), ORDERS[1]) if math.isfinite(order) else ORDERS[0]
    left = max(now, before / 2.0 ** ORDERS[1]) / (2.0**p - 1.0)
    return SAFETY * left / size, order


def candidates(halves: bool = False) -> dict[str, Refinement]:
    """The formulations that say on which meshes they converge; those only that can be solved by `halves`, if asked.

    Raises:
        ModelError: there is none.
    """
    found = {name: getattr(formulation(name), "refinement", None) for name in names()}
    known = {name: item for name, item in found.items() if isinstance(item, Refinement)}
    if halves:
        known = {name: item for name, item in known.items() if hasattr(formulation(name), "half")}
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
    if goal.of == "tip" and any(step.constraints.rigid_body for step in program(model)):
        raise ModelError(
            "a sheet that is free to move has no tip displacement of its own; hold it, or ask for the energy"
        )


def reading(path: Path, goal: Goal) -> Array:
    """The goal at the last state, as a vector."""
    state = path[-1]
    if goal.of == "energy":
        return np.array([state.energy.total])
    assert goal.at is not None
    if goal.of == "tip":
        return np.asarray(state.displacement(goal.at).mean(axis=0))
    from bh.analysis.stiffness_probe import Probe

    stiffness = float(Probe(path).at(goal.at).loaded(np.asarray(goal.direction)))
    if not math.isfinite(stiffness):
        raise ModelError(
            f"'{goal.at}' is held in that direction and has no stiffness there; ask at another place"
        )
    return np.array([stiffness])


def _words(path: Path) -> str:
    mesh = path.model.mesh
    return f"{len(mesh.triangles)} triangles ({mesh.kind})"
