"""Case `speed_error`: error against time of every model, on six scenes, by one machine in one run.

`bh verify speed_error` takes minutes. Every solve is kept in `speed_error_runs.json` beside the results until the case
has ended, so that a run that was stopped goes on where it was.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

import meshes
from bh import Path, trace
from bh.analysis.alignment import aligned
from bh.analysis.richardson import fitted
from bh.solvers.outcome import Outcome
from meshes.cells import Kind
from verification.framework.checks import CaseResult, Context, Cost, line, plot
from verification.framework.measuring import REPEATS, measure
from verification.framework.pareto import Trial, cheapest, front, rate
from verification.framework.store import Store
from verification.studies.solver.speed_problems import PROBLEMS, Problem, curve

CASE = "speed_error"
RUNS = "speed_error_runs.json"
QUANTITIES = {"energy": "total energy", "curve": "crease curve", "stiffness": "stiffness"}
LIMITS = (0.1, 0.05, 0.02, 0.01, 0.005)
TRUTH = (3.0, 4.0, 6.0, 8.0)  # refinements of the judge, the last of them is solved for the truth alone
SOURCE = "the shell, extrapolated"


@dataclass(frozen=True)
class Member:
    """A model in the race. `levels` refine the sheet: n times a scene's cells along the crease, in n rows a side.

    `rows` fixes the number of rows instead: bars and hinges lock where cells are not long (docs/formulation.md).
    """

    formulation: str
    kind: Kind
    levels: tuple[float, ...] = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0)
    rows: int | None = None

    @property
    def name(self) -> str:
        """As in the legends."""
        return f"{self.formulation}, {self.kind}"


BARS = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
MEMBERS = (
    Member("bars-and-hinges", "staggered", BARS, rows=1),
    Member("bars-and-hinges", "alternating", BARS, rows=1),
    Member("bars-and-hinges", "one-way", BARS, rows=1),
    Member("bars-and-hinges", "mirrored", BARS, rows=1),
    Member("consistent", "staggered"),
    Member("linear-shell", "staggered"),
    Member("shell", "mirrored", (0.5, 1.0, 2.0, 3.0, 4.0, 6.0)),
)
JUDGE = MEMBERS[-1]


class Run(NamedTuple):
    """What one solve gave: values (N mm, mm, the scene's unit) and cost. `nodes` are those of the crease, as lists."""

    outcome: str
    energy: float
    stiffness: float
    nodes: list[list[float]]
    along: int
    rows: int
    unknowns: int
    iterations: int
    wall_time_s: float
    repeats: int
    memory_mb: float


class Truth(NamedTuple):
    """Limits of energy and stiffness and their bars; the finest curve, as the nodes of `n` cells, and its bar, mm."""

    energy: tuple[float, float, float]  # value, bar, rate
    stiffness: tuple[float, float, float]
    curves: dict[int, list[list[float]]]
    bar: float


def solve(problem: Problem, member: Member, level: float, *, timed: bool, quick: bool) -> tuple[Run, Path]:
    """One member at one density. What is timed is the trace, from the model to its last state."""
    along = max(2, round(problem.cells * level))
    rows = member.rows or max(1, round(level))
    mesh = meshes.structured(problem.pattern, along=along, rows=rows, kind=member.kind)
    model = problem.actuate(mesh, member.formulation)

    def once() -> Path:
        path = trace(model, strategy=problem.strategy(member.formulation))
        _ = path[-1]
        return path

    if timed:
        path, cost = measure(once, quick)
        times = (cost.wall_time_s, cost.repeats, cost.memory_mb)
    else:
        path = once()
        times = (path.wall_time_s, 0, math.nan)
    reached = path.reached
    run = Run(
        path.outcome,
        path[-1].energy.total,
        problem.stiffness(path) if reached else math.nan,
        path[-1].crease_points("crease").tolist(),
        along,
        rows,
        path.unknowns,
        path.iterations,
        *times,
    )
    return run, path


def find_truth(problem: Problem, quick: bool) -> Truth:
    """Limits of the judge on its finest meshes."""
    found = [solve(problem, JUDGE, n, timed=False, quick=quick) for n in TRUTH]
    if any(run.outcome != Outcome.REACHED for run, _ in found):
        raise RuntimeError(f"the judge does not reach the end of scene '{problem.name}'")
    sizes = [1.0 / run.along for run, _ in found]
    energy = fitted([run.energy for run, _ in found], sizes)
    stiffness = fitted([run.stiffness for run, _ in found], sizes)
    finest, before = found[-1][1], found[-2][0]
    counts = {max(2, round(problem.cells * n)) for member in MEMBERS for n in member.levels}
    curves = {n: curve(finest[-1], n).tolist() for n in sorted(counts | {before.along})}
    # what is left after the last step of refinement, at second order
    ratio = found[-1][0].along / before.along
    bar = apart(before.nodes, curves[before.along]) / (ratio**2 - 1.0)
    return Truth(
        (energy.value, energy.bar, energy.rate), (stiffness.value, stiffness.bar, stiffness.rate), curves, bar
    )


def apart(nodes: Sequence[Sequence[float]], onto: Sequence[Sequence[float]]) -> float:
    """Largest distance of nodes of the crease from where they should be, after rigid alignment, mm."""
    points, other = np.asarray(nodes), np.asarray(onto)
    with warnings.catch_warnings():  # how a straight line is turned about itself does not matter
        warnings.filterwarnings("ignore", "Optimal rotation")
        moved = aligned(points, other)[0]
    return float(np.linalg.norm(moved - other, axis=1).max())


def errors(problem: Problem, run: Run, truth: Truth) -> dict[str, tuple[float, float]]:
    """(error, bar) of each quantity, relative; of the curve to its length. Not reached is no value: nan."""
    if run.outcome != Outcome.REACHED:
        return dict.fromkeys(QUANTITIES, (math.nan, math.nan))
    out = {"curve": (apart(run.nodes, truth.curves[run.along]) / problem.length, truth.bar / problem.length)}
    for name in ("energy", "stiffness"):
        value, bar, _ = getattr(truth, name)
        out[name] = (abs(getattr(run, name) - value) / abs(value), bar / abs(value))
    return out


def _quick_levels(member: Member) -> int:
    """How many densities of a quick run; the judged one goes as far as its bound of 1 % asks for."""
    return 5 if member.formulation == "consistent" else 4


def run(context: Context) -> CaseResult:
    """All scenes and members; tables and plots a scene."""
    result = CaseResult(
        name=CASE,
        title="Speed against error",
        question="Which model is the cheapest for a given error of energy, of the crease curve, of a stiffness?",
        source="mutual: six scenes by every model, judged by the extrapolated shell",
    )
    members = [replace(m, levels=m.levels[: _quick_levels(m)]) if context.quick else m for m in MEMBERS]
    problems = PROBLEMS[:2] if context.quick else PROBLEMS
    store = Store.open(context.folder, RUNS, context.quick)
    lost: list[str] = []
    for problem in problems:
        truth = _truth(context, store, problem)
        found = {m: list(_runs(context, store, problem, m)) for m in members}
        _records(result, problem, truth, found)
        lost += [
            f"{problem.name}, {m.name}, {r.along} x {r.rows} ({r.outcome})"
            for m, runs in found.items()
            for r in runs
            if r.outcome != Outcome.REACHED
        ]
    store.file.unlink(missing_ok=True)
    result.notes += _notes(result)
    if lost:
        result.notes.append(f"Not reached, and in no curve: {'; '.join(lost)}.")
    return result


def _truth(context: Context, store: Store, problem: Problem) -> Truth:
    key = f"{problem.name}/truth"
    if key not in store.runs:
        context.tell(f"{CASE}: {problem.name}, the judge on its finest meshes")
        store.keep(key, find_truth(problem, context.quick)._asdict())
    kept = store.runs[key]
    curves = {int(n): nodes for n, nodes in kept["curves"].items()}
    return Truth(tuple(kept["energy"]), tuple(kept["stiffness"]), curves, kept["bar"])


def _runs(context: Context, store: Store, problem: Problem, member: Member) -> Iterator[Run]:
    for level in member.levels:
        key = f"{problem.name}/{member.name}/{level}"
        if key not in store.runs:
            context.tell(f"{CASE}: {problem.name}, {member.name}, refined {level:g} times")
            done, _ = solve(problem, member, level, timed=True, quick=context.quick)
            store.keep(key, done._asdict())
        yield Run(**store.runs[key])


# --- records --------------------------------------------------------------------------------------------------


def _records(result: CaseResult, problem: Problem, truth: Truth, found: dict[Member, list[Run]]) -> None:
    errs = {m: [errors(problem, r, truth) for r in runs] for m, runs in found.items()}
    _judge_truth(result, problem, truth)
    for quantity, words in QUANTITIES.items():
        trials = [
            Trial(m.name, f"{r.along} x {r.rows}", r.wall_time_s, max(e[quantity]))
            for m, runs in found.items()
            for r, e in zip(runs, errs[m], strict=True)
        ]
        by_level = {(t.model, t.level): t for t in trials}
        for allowed in LIMITS:
            _cheapest(result, problem, found, cheapest(trials, allowed), quantity, allowed)
        _rates(result, problem, found, errs, quantity)
        bars = [e[quantity][1] for es in errs.values() for e in es if math.isfinite(e[quantity][1])]
        bar = max(bars, default=math.nan)
        _plots(result, problem, found, by_level, front(trials), quantity, words, bar)


def _judge_truth(result: CaseResult, problem: Problem, truth: Truth) -> None:
    units = {"energy": "N mm", "stiffness": problem.unit}
    for name, unit in units.items():
        value, bar, order = getattr(truth, name)
        params = {"scene": problem.name, "error_bar": bar, "order": order, "formulation": JUDGE.formulation}
        words = QUANTITIES[name] if name == "energy" else problem.what
        result.check(f"truth: {words}", value, unit=unit, source=SOURCE, params=params)
        result.check(
            f"error bar of the truth over its value, {QUANTITIES[name]}",
            bar / abs(value),
            unit="1",
            reference=0.0,
            source="fit of the finest shells",
            tolerance=0.01,
            params=params,
        )
    params = {"scene": problem.name, "length_mm": problem.length, "formulation": JUDGE.formulation}
    result.check(
        "error bar of the crease curve",
        truth.bar,
        unit="mm",
        reference=0.0,
        source="last refinement of the shell",
        tolerance=2e-3 * problem.length,
        params=params,
    )


def _cheapest(
    result: CaseResult,
    problem: Problem,
    found: dict[Member, list[Run]],
    best: Trial | None,
    quantity: str,
    allowed: float,
) -> None:
    params: dict[str, Any] = {"scene": problem.name, "within": allowed}
    words = f"cheapest model, {QUANTITIES[quantity]} within {100 * allowed:g} %"
    if best is None:
        params["model"] = "none of those that were run"
        result.check(words, math.nan, unit="s", source="wall time, median", params=params)
        return
    run = next(
        r
        for m, runs in found.items()
        for r in runs
        if (m.name, f"{r.along} x {r.rows}") == (best.model, best.level)
    )
    params |= {"model": best.model, "along": run.along, "rows": run.rows, "relative_error": best.error}
    params |= {"memory_mb": run.memory_mb, "repeats": run.repeats}
    result.check(
        words,
        run.wall_time_s,
        unit="s",
        source="wall time, median",
        params=params,
        path=Cost(unknowns=run.unknowns, iterations=run.iterations, wall_time_s=run.wall_time_s),
    )


def _rates(
    result: CaseResult,
    problem: Problem,
    found: dict[Member, list[Run]],
    errs: dict[Member, list[dict[str, tuple[float, float]]]],
    quantity: str,
) -> None:
    """Order in the size of a cell of the errors above the bar, and the finest density's error, of every member."""
    for member, runs in found.items():
        above = [
            (1.0 / r.along, e[quantity][0])
            for r, e in zip(runs, errs[member], strict=True)
            if e[quantity][0] > e[quantity][1]
        ]
        ended = [
            i for i, r in enumerate(runs) if r.outcome == Outcome.REACHED
        ]  # the others are named in the notes
        if not ended:
            continue
        last, cost = errs[member][ended[-1]][quantity], runs[ended[-1]]
        params: dict[str, Any] = {"scene": problem.name, "model": member.name}
        params |= {"along": cost.along, "rows": cost.rows}
        params |= {"order": rate(*zip(*above, strict=True)) if len(above) > 2 else math.nan, "bar": last[1]}
        params |= {"memory_mb": cost.memory_mb, "below_the_bar": last[0] <= last[1]}
        if quantity == "curve":
            params["mm"] = last[0] * problem.length
        judged = member.formulation == "consistent" and quantity == "energy"
        asked = problem.asked + last[1] if judged else None
        result.check(
            f"relative error of the finest mesh, {QUANTITIES[quantity]}",
            last[0],
            unit="1",
            reference=0.0,
            source=SOURCE,
            tolerance=asked,
            params=params,
            path=cost,
        )


# --- plots and words ------------------------------------------------------------------------------------------


def _plots(
    result: CaseResult,
    problem: Problem,
    found: dict[Member, list[Run]],
    trials: dict[tuple[str, str], Trial],
    best: list[Trial],
    quantity: str,
    words: str,
    bar: float,
) -> None:
    against_time, against_size = [], []
    for member, runs in found.items():
        here = [trials[member.name, f"{r.along} x {r.rows}"] for r in runs]
        good = [(t, r) for t, r in zip(here, runs, strict=True) if math.isfinite(t.error)]
        errors_ = [100.0 * t.error for t, _ in good]
        against_time.append(line(member.name, [1e3 * t.cost for t, _ in good], errors_))
        order = rate([r.unknowns**-0.5 for _, r in good], errors_)
        label = f"{member.name}: rate {order:.1f}" if math.isfinite(order) else member.name
        against_size.append(line(label, [float(r.unknowns) for _, r in good], errors_))
    names = ", then ".join(dict.fromkeys(f"{t.model} ({t.level})" for t in best))
    against_time.append(
        line(
            "not beaten (Pareto front)",
            [1e3 * t.cost for t in best],
            [100.0 * t.error for t in best],
            "points",
        )
    )
    unit = "% of its length" if quantity == "curve" else "%"
    for series, x, name, caption in (
        (against_time, "wall time, ms", "time", f"Not beaten, from the cheapest on: {names}."),
        (against_size, "unknowns", "unknowns", "Rates are orders in the size of a cell, unknowns^(-1/2)."),
    ):
        ends = [v for s in series for v in s["x"]]
        if math.isfinite(bar) and bar > 0.0:
            series = [
                *series,
                line("error bar of the truth", [min(ends), max(ends)], [100.0 * bar] * 2, "reference"),
            ]
        result.plots.append(
            plot(
                f"speed-error-{problem.name}-{quantity}-{name}",
                f"{problem.title}: {words}",
                x,
                f"error, {unit}",
                series,
                caption + " Errors below the error bar of the truth are drawn on it.",
                log="xy",
            )
        )


def _notes(result: CaseResult) -> list[str]:
    wins: dict[str, int] = {}
    for check in result.checks:
        if check.quantity.startswith("cheapest"):
            wins[check.params["model"]] = wins.get(check.params["model"], 0) + 1
    listed = ", ".join(f"{name} {n}" for name, n in sorted(wins.items(), key=lambda item: -item[1]))
    repeats = ", ".join(
        f"{n} below {limit:g} s" if math.isfinite(limit) else f"else {n}" for limit, n in REPEATS
    )
    return [
        f"Cheapest model, counted over scenes, quantities and errors: {listed}. A density counts only if all finer "
        "ones of its model keep the error, too.",
        "Truth is the shell: the limit of a least-squares fit v0 + c h^p over its four finest meshes, with a bar of "
        "1.25 times what is left and the scatter, at least the last change; where no order from 0.5 to 4 fits, the "
        "finest value with a bar of three times the last change. Of the curve it is the finest shell, compared at the "
        "nodes after rigid alignment; its bar is what the last refinement leaves at second order.",
        f"Wall time is the median of repeated traces ({repeats}) after one that is not counted, without meshing; "
        "memory is the peak of that one, by tracemalloc (Python and NumPy; what compiled code takes for itself "
        "is seen only where it raises the peak of the process, VmHWM). Bars and hinges take Poisson's ratio as 0, "
        "which is part of their error where the sheet has 0.38.",
    ]
