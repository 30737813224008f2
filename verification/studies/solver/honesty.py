"""Case `honesty`: forty scenes solved to a wanted accuracy; is the error that is told the error that is made?

The scenes are drawn at random from a seed that no choice in `bh.solving.accuracy` was made with ("held").
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

import meshes
from bh import Goal, Model, Sheet, trace
from bh.model.refinement import mesh_at
from bh.solving.accuracy import Accuracy, reading
from meshes.pattern import FoldKind
from verification.framework.checks import CaseResult, Check, Context, line, plot

CASE, SHELL = "honesty", "the shell on a fine mesh"
SCENES, ENOUGH, ALLOWED = 40, 38, 1.5
HELD, TRAINING = 2026, 1  # seeds
WITHIN = (0.1, 0.05, 0.02, 0.01)
JUDGES = (4.0, 6.0)  # levels of the shell; the last is the truth, its distance to the one before the bar


@dataclass(frozen=True)
class Draw:
    """One scene: what it is in words, its model on some mesh, and what is asked for."""

    words: str
    model: Model
    goal: Goal


def draw(seed: int, number: int) -> Draw:
    """Scene `number` of a seed: sectors and strips with one or two creases, folded, then perhaps pulled."""
    rng = np.random.default_rng([seed, number])
    sheet = Sheet(E=4000.0, nu=float(rng.choice([0.0, 0.2, 0.38])), t=float(rng.choice([0.127, 0.2, 0.3])))
    creases = int(rng.choice([1, 1, 1, 2]))
    width = float(rng.uniform(6.0, 15.0))
    alternating: tuple[FoldKind, ...] = ("mountain", "valley")
    folds = alternating[:creases]
    curved = bool(rng.random() < 0.75)
    if curved:
        radius = float(rng.uniform(60.0, 150.0))
        angle = float(rng.uniform(30.0, 100.0) / radius * 1.2)
        radii = [radius + 1.2 * width * k for k in range(creases)]
        pattern = meshes.annulus_sector(radii, width, angle, folds)
        words = f"sector of {creases}"
    else:
        length = float(rng.uniform(40.0, 100.0))
        heights = [width * (k + 1) for k in range(creases)]
        pattern = meshes.strip(length, width * (creases + 1), heights, folds)
        words = f"strip of {creases}"
    model = Model(meshes.structured(pattern, along=4), sheet)
    held = not curved or bool(rng.random() < 0.5)  # a free sheet folds along straight creases for nothing
    if held:
        model = model.support("corner:inner-start", "xyz").support(
            "corner:outer-start", "yz" if curved else "xz"
        )
        model = model.support("corner:inner-end", "z")
        words += ", held at three corners"
    by = math.radians(float(rng.uniform(25.0, 90.0)))
    spring = rng.random() < 0.5
    model = model.fold("all", by=by, Lstar=float(rng.choice([10.0, 25.0, 60.0])) if spring else None)
    words += f", {'spring' if spring else 'imposed'} {math.degrees(by):.0f} degrees"
    what = "energy"
    if held:
        if not curved or rng.random() < 0.5:
            up = float(rng.uniform(2.0, 8.0))
            model = model.displace("corner:outer-end", "z", up)
            words += f", corner to {up:.1f} mm"
        what = str(rng.choice(["energy", "tip", "stiffness"]))
    within = float(rng.choice(WITHIN))
    if what == "tip":
        goal = Goal(within, "tip", "corner:inner-end")
    elif what == "stiffness":
        goal = Goal(within, "stiffness", "corner:outer-start", (1.0, 0.0, 0.0) if curved else (0.0, 1.0, 0.0))
    else:
        goal = Goal(within)
    return Draw(words, model, goal)


def judge(item: Draw, levels: tuple[float, ...] = JUDGES) -> tuple[np.ndarray, float]:
    """The goal by the shell on its finest mesh, and a bar, relative: how far the one before it is."""
    pattern = item.model.mesh.pattern
    assert pattern is not None
    values = []
    for level in levels:
        model = replace(item.model, mesh=mesh_at(pattern, "mirrored", level), formulation="shell")
        path = trace(model)
        if path.outcome != "reached":
            return np.array([math.nan]), math.nan
        values.append(reading(path, item.goal))
    size = float(np.linalg.norm(values[-1]))
    return values[-1], float(np.linalg.norm(values[-1] - values[-2])) / size


@dataclass(frozen=True)
class Found:
    """A scene, what was told of it and what is true (relative errors)."""

    item: Draw
    accuracy: Accuracy
    outcome: str
    error: float
    bar: float

    @property
    def honest(self) -> bool:
        """The error that was made is at most `ALLOWED` times the one that was told; an early end tells of none."""
        return self.outcome != "reached" or self.error <= ALLOWED * self.accuracy.estimate


def examine(seed: int, number: int) -> Found:
    """Solve a scene to its accuracy, and judge it."""
    item = draw(seed, number)
    path = trace(item.model, accuracy=item.goal)
    assert path.accuracy is not None
    if path.outcome != "reached":
        return Found(item, path.accuracy, path.outcome, math.nan, math.nan)
    truth, bar = judge(item)
    error = float(np.linalg.norm(path.accuracy.trials[-1].value - truth) / np.linalg.norm(truth))
    return Found(item, path.accuracy, path.outcome, error, bar)


def run(context: Context) -> CaseResult:
    """All held scenes, counted and shown."""
    result = CaseResult(
        name=CASE,
        title="Is an estimated accuracy honest?",
        question="Over scenes that nothing was chosen with: is the error at most 1.5 times the estimate?",
        source="mutual: forty random scenes, judged by a fine shell",
    )
    count = SCENES // 8 if context.quick else SCENES
    found = []
    for number in range(count):
        context.tell(f"{CASE}: scene {number + 1} of {count}")
        found.append(examine(HELD, number))
        _record(result, number, found[-1])
    honest, met = sum(f.honest for f in found), sum(f.accuracy.met for f in found)
    reached = [f for f in found if f.outcome == "reached"]
    params = {"scenes": count, "allowed": ALLOWED}
    misses = 1 if context.quick else SCENES - ENOUGH
    result.checks += [
        Check(CASE, "scenes whose error is at most 1.5 times the estimate", params, float(honest), "scenes",
              float(count), "asked: 38 of 40", misses / count),
        Check(CASE, "scenes whose estimate is within what was asked", params, float(met), "scenes", float(count),
              "the others say so"),
        Check(CASE, "scenes whose error is within what was asked", params,
              float(sum(f.error <= f.item.goal.within for f in reached)), "scenes", float(count), SHELL),
        Check(CASE, "error over estimate, median", params,
              float(np.median([f.error / f.accuracy.estimate for f in reached])), "1", None, SHELL),
    ]  # fmt: skip
    series = [
        line(what, [100.0 * f.accuracy.estimate for f in reached if f.item.goal.of == what],
             [100.0 * f.error for f in reached if f.item.goal.of == what], "points")
        for what in ("energy", "tip", "stiffness")
    ]  # fmt: skip
    ends = [100.0 * f.accuracy.estimate for f in reached]
    for factor, words in ((1.0, "as told"), (ALLOWED, "1.5 times as told")):
        series.append(
            line(words, [min(ends), max(ends)], [factor * min(ends), factor * max(ends)], "reference")
        )
    result.plots.append(
        plot("honesty", "Error made over error told", "estimate, %", "error, %", series,
             "Below the upper line an estimate is honest. Errors are those against the shell on a fine mesh.", log="xy")
    )  # fmt: skip
    chosen = Counter(f.accuracy.formulation for f in found)
    result.notes.append(
        f"Chosen: {', '.join(f'{name} {n}' for name, n in sorted(chosen.items()))}. Asked were "
        f"{', '.join(f'{100 * w:g}' for w in WITHIN)} % of energy, tip displacement or stiffness. Bars and hinges are "
        "never chosen: their error does not vanish under refinement, so two meshes tell nothing of it."
    )
    return result


def _record(result: CaseResult, number: int, found: Found) -> None:
    goal, told = found.item.goal, found.accuracy
    last = told.trials[-1]
    params = {
        "scene": number, "words": found.item.words, "of": goal.of, "asked": goal.within, "estimate": told.estimate,
        "met": told.met, "formulation": told.formulation, "meshes": len(told.trials), "honest": found.honest,
        "bar": found.bar,
    }  # fmt: skip
    result.checks.append(
        Check(CASE, "relative error", params, found.error, "1", 0.0, SHELL, unknowns=last.unknowns,
              iterations=sum(t.iterations for t in told.trials), wall_time_s=told.wall_time_s, outcome=found.outcome)
    )  # fmt: skip
