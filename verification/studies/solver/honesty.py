"""Case `honesty`: a hundred scenes solved to a wanted accuracy; is the error that is told the error that is made?

The scenes (`verification.studies.solver.honesty_scenes`) are drawn at random from a seed that no choice in
`bh.solving` was made with ("held"): four of ten are narrow sheets, the others wide panels, closed rings, several
creases and drawn networks. Quick are the first of them without the rings, which buckle and take minutes each. Every
scene is kept in `honesty_runs.json` beside the results as it is done; a run that was stopped goes on.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np

from bh import trace
from bh.errors import InputError
from bh.solvers.outcome import Outcome
from bh.solving.accuracy import reading
from meshes import MeshError
from meshes.cells import Cells, RuledCells
from meshes.choices import choices, cut
from verification.framework.checks import CaseResult, Context, Cost, line, plot
from verification.framework.store import Store
from verification.studies.solver.honesty_scenes import WITHIN, Draw, draw, kind_of

CASE, SHELL, RUNS = "honesty", "the shell on a fine mesh", "honesty_runs.json"
SCENES, QUICK, ALLOWED = 100, 6, 1.5
ENOUGH_HONEST, ENOUGH_RIGHT = 95, 98
HELD, TRAINING = 20261128, 7  # seeds
JUDGES = (3, 5)  # rows of the shell; the last is the truth, its distance to the one before the bar


def judge(item: Draw) -> tuple[np.ndarray, float]:
    """The goal by the shell on its finest mesh, and its relative distance to the one before; nan if not reached."""
    pattern = item.model.mesh.pattern
    assert pattern is not None
    for cells in choices(pattern, "mirrored", float(JUDGES[0])):
        try:
            values = [_judged(item, mesh) for mesh in (cells, _finer(cells))]
        except MeshError:
            continue
        size = float(np.linalg.norm(values[-1]))
        return values[-1], float(np.linalg.norm(values[-1] - values[-2])) / size
    return np.array([math.nan]), math.nan


def _finer(cells: Cells) -> Cells:
    times = JUDGES[1] / JUDGES[0]
    if isinstance(cells, RuledCells):
        return replace(cells, along=round(cells.along * times), rows=round(cells.rows * times))
    return cells.refined(times)


def _judged(item: Draw, cells: Cells) -> np.ndarray:
    pattern = item.model.mesh.pattern
    assert pattern is not None
    path = trace(replace(item.model, mesh=cut(pattern, cells), formulation="shell"))
    return reading(path, item.goal) if path.reached else np.array([math.nan])


@dataclass(frozen=True)
class Found:
    """A scene, what was told of it and what is true (relative errors; nan where that is not known)."""

    words: str
    of: str
    asked: float
    outcome: str
    formulation: str
    meshes: int
    estimate: float
    met: bool
    error: float
    bar: float
    unknowns: int
    iterations: int
    wall_time_s: float

    @property
    def judged(self) -> bool:
        """Whether there is an answer and a truth to compare it with."""
        return self.outcome == Outcome.REACHED and math.isfinite(self.error)

    @property
    def honest(self) -> bool:
        """The error that was made is at most `ALLOWED` times the one that was told; an early end tells of none."""
        return self.judged and self.error <= ALLOWED * self.estimate

    @property
    def right(self) -> bool:
        """The error that was made is within what was asked."""
        return self.judged and self.error <= self.asked


def examine(seed: int, number: int) -> Found:
    """Solve a scene to its accuracy, and judge it; one that is refused has that as its outcome."""
    item = draw(seed, number)
    goal = item.goal
    try:
        path = trace(item.model, accuracy=goal)
    except InputError as refusal:
        why = f"refused: {refusal}"
        nan = math.nan
        return Found(item.words, goal.of, goal.within, why, "", 0, nan, False, nan, nan, 0, 0, nan)
    told = path.accuracy
    assert told is not None
    error, bar = math.nan, math.nan
    if path.reached:
        truth, bar = judge(item)
        error = float(np.linalg.norm(reading(path, goal) - truth) / np.linalg.norm(truth))
    return Found(
        item.words,
        goal.of,
        goal.within,
        path.outcome,
        told.formulation,
        len(told.trials),
        told.estimate,
        told.met,
        error,
        bar,
        path.unknowns,
        sum(t.iterations for t in told.trials),
        told.wall_time_s,
    )


def run(context: Context) -> CaseResult:
    """All held scenes, counted and shown."""
    result = CaseResult(
        name=CASE,
        title="Is an estimated accuracy honest?",
        question="Over scenes that nothing was chosen with: is the error at most 1.5 times the estimate?",
        source="mutual: a hundred random scenes, judged by a fine shell",
    )
    numbers = [n for n in range(SCENES) if not (context.quick and kind_of(n) == "ring")]
    numbers = numbers[: QUICK if context.quick else SCENES]
    count = len(numbers)
    store = Store.open(context.folder, RUNS, context.quick)
    found = []
    for done, number in enumerate(numbers, 1):
        key = str(number)
        if key not in store.runs:
            context.tell(f"{CASE}: scene {done} of {count}")
            store.keep(key, asdict(examine(HELD, number)))
        found.append(Found(**store.runs[key]))
        _record(result, number, found[-1])
    _count(result, found)
    _plots(result, found)
    chosen = Counter(f.formulation for f in found if f.formulation)
    store.file.unlink(missing_ok=True)
    result.notes.append(
        f"Chosen: {', '.join(f'{name} {n}' for name, n in sorted(chosen.items()))}. Asked were "
        f"{', '.join(f'{100 * w:g}' for w in WITHIN)} % of energy, tip displacement or stiffness. Bars and hinges are "
        "never chosen: their error does not vanish under refinement, so two meshes tell nothing of it."
    )
    return result


def _count(result: CaseResult, found: list[Found]) -> None:
    """How many scenes were honest, right, met and refused."""
    count = len(found)
    params = {"scenes": count, "allowed": ALLOWED}
    judged = [f for f in found if f.judged]
    misses = (1 - ENOUGH_HONEST / SCENES, 1 - ENOUGH_RIGHT / SCENES)
    check = partial(result.check, params=params)
    check(
        "scenes whose error is at most 1.5 times the estimate",
        sum(f.honest for f in found),
        unit="scenes",
        reference=float(count),
        source="asked: 95 of 100",
        tolerance=misses[0],
    )
    check(
        "scenes whose error is within what was asked",
        sum(f.right for f in found),
        unit="scenes",
        reference=float(count),
        source="asked: 98 of 100",
        tolerance=misses[1],
    )
    check(
        "scenes that were refused",
        sum(f.outcome.startswith("refused") for f in found),
        unit="scenes",
        reference=0.0,
        source="asked: none",
        tolerance=0.0,
    )
    check(
        "scenes whose estimate is within what was asked",
        sum(f.met for f in found),
        unit="scenes",
        reference=float(count),
        source="the others say so",
    )
    check(
        "error over estimate, median",
        np.median([f.error / f.estimate for f in judged]),
        unit="1",
        source=SHELL,
    )


def _plots(result: CaseResult, found: list[Found]) -> None:
    reached = [f for f in found if f.judged and math.isfinite(f.estimate) and f.estimate > 0.0]
    series = [
        line(
            what,
            [100.0 * f.estimate for f in reached if f.of == what],
            [100.0 * f.error for f in reached if f.of == what],
            "points",
        )
        for what in ("energy", "tip", "stiffness")
        if any(f.of == what for f in reached)
    ]
    ends = [100.0 * f.estimate for f in reached]
    for factor, words in ((1.0, "as told"), (ALLOWED, "1.5 times as told")):
        series.append(
            line(words, [min(ends), max(ends)], [factor * min(ends), factor * max(ends)], "reference")
        )
    result.plots.append(
        plot(
            "honesty",
            "Error made over error told",
            "estimate, %",
            "error, %",
            series,
            "Below the upper line an estimate is honest. Errors are those against the shell on a fine mesh.",
            log="xy",
        )
    )


def _record(result: CaseResult, number: int, found: Found) -> None:
    params = {
        "scene": number,
        "words": found.words,
        "of": found.of,
        "asked": found.asked,
        "estimate": found.estimate,
        "met": found.met,
        "formulation": found.formulation,
        "meshes": found.meshes,
        "honest": found.honest,
        "bar": found.bar,
    }
    result.check(
        "relative error",
        found.error,
        unit="1",
        reference=0.0,
        source=SHELL,
        params=params,
        path=Cost(
            unknowns=found.unknowns,
            iterations=found.iterations,
            wall_time_s=found.wall_time_s,
            outcome=found.outcome,
        ),
    )
