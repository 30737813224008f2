"""Case `map`: how far each model is off, for every kind of sheet, and what it costs.

At least five random sheets of every kind (`map_sheets`) are solved by every model and by the shell on two meshes: the
finer is the truth, its distance to the coarser one the bar. Cells of the map are kept in `map_runs.json` as they are
done, a sheet at a time; a run that was stopped goes on. Where a model has no figure, a record says why. With
BH_MAP="network, closed ring" in the environment these kinds alone are played and shown.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bh import Goal, Path, State, trace
from bh.analysis.shapes import shape_distance
from bh.errors import InputError, ModelError
from bh.solving.accuracy import reading
from meshes import MeshError, SheetMesh
from meshes.cells import Kind, RuledCells
from meshes.choices import choices, cut
from verification.framework.checks import CaseResult, Context, Cost, line, plot
from verification.framework.random_scenes import OutOfTimeError, processor_limit
from verification.framework.store import Store
from verification.studies.solver.map_sheets import KINDS, UNMEASURED, Sample, on, sample

CASE, RUNS, PART = "map", "map_runs.json", "BH_MAP"
SHEETS, QUICK, QUICK_KINDS = 5, 1, ("narrow ring", "twisted", "orthotropic")
LIMIT_S = 60.0  # processor time of a sheet, the shell included
NO_FIGURES, ERROR = "sheets without figures", ": median relative error"
QUANTITIES = ("energy", "shape", "fold angle", "force", "stiffness", "stress")
EXCEEDED = 0.05  # part of the sheet's area in which the stress is above what is compared
TRUTH = "the shell, 4 rows"
JUDGES = (2.0, 4.0)  # levels of the shell


@dataclass(frozen=True)
class Member:
    """A model of the map: a formulation on the meshes that it is used with."""

    name: str
    formulation: str
    kind: Kind
    level: float

    def meshes(self, item: Sample) -> Iterator[SheetMesh]:
        """Meshes to be tried, the best first; bars and hinges have one row of cells, where a sheet has rows."""
        for cells in choices(item.pattern, self.kind, self.level):
            taken = cells
            if self.level < 1.0 and isinstance(cells, RuledCells):
                taken = replace(cells, along=max(cells.along, 8), rows=1)
            try:
                yield cut(item.pattern, taken)
            except MeshError:
                continue


MEMBERS = (
    Member("bars and hinges", "bars-and-hinges", "staggered", 0.3),
    Member("consistent, 2 rows", "consistent", "staggered", 2.0),
    Member("consistent, 4 rows", "consistent", "staggered", 4.0),
)
SHELLS = tuple(Member(f"shell, {level:g} rows", "shell", "mirrored", level) for level in JUDGES)


def solved(member: Member, item: Sample) -> tuple[Path | None, float, str]:
    """A sheet by a model: its path where it reached its end, processor time (s), else why not."""
    why = "no mesh"
    for mesh in member.meshes(item):
        began = time.process_time()
        try:
            path = trace(on(item, mesh, member.formulation))
        except InputError as refusal:
            return None, math.nan, f"refused: {refusal}"
        took = time.process_time() - began
        if path.reached:
            return path, took, ""
        why = str(path.outcome)
        break
    return None, math.nan, why


def values(path: Path, item: Sample) -> dict[str, float]:
    """What is compared as numbers; nan where the sheet has no such thing."""
    state = path[-1]
    found = dict.fromkeys(QUANTITIES, math.nan)
    found["energy"] = float(state.energy.total)
    if item.spring:
        angles = [np.abs(state.fold_angle(crease.name)).mean() for crease in item.pattern.creases]
        found["fold angle"] = float(np.mean(angles))
    if item.pulled is not None:
        place, axis = item.pulled
        nodes = path.model.mesh.nodes(place)
        found["force"] = float(state.reactions[nodes, "xyz".index(axis)].sum())
    found["stress"] = high_stress(state)
    if item.probe is not None:
        try:
            found["stiffness"] = float(reading(path, Goal(0.05, "stiffness", *item.probe))[0])
        except ModelError:
            found["stiffness"] = math.nan
    return found


def high_stress(state: State) -> float:
    """Equivalent stress at the surfaces that 5 % of the sheet's area exceed, MPa; nan where a model has none.

    The peak itself stands in corners of creases, where it grows with the mesh.
    """
    try:
        stress = state.stress()
        high = np.maximum(stress.equivalent("top"), stress.equivalent("bottom"))
    except ModelError:  # bars and hinges; a sheet with a grain whose strengths nobody knows
        return math.nan
    area = state.mesh.areas
    order = np.argsort(high)
    share = np.cumsum(area[order]) / area.sum()
    return float(np.interp(1.0 - EXCEEDED, share - 0.5 * area[order] / area.sum(), high[order]))


def errors(path: Path, truth: Path, item: Sample) -> dict[str, float]:
    """Relative errors of a path; of the shape, the rms distance over the largest displacement."""
    mine, right = values(path, item), values(truth, item)
    found = {name: abs(mine[name] / right[name] - 1.0) if right[name] else math.nan for name in QUANTITIES}
    moved = float(np.linalg.norm(truth[-1].displacement(), axis=1).max())
    found["shape"] = shape_distance(path[-1], truth[-1]).rms / moved
    return found


def examine(kind: str, number: int) -> dict[str, Any]:
    """A sheet of a kind: for every model errors, time and why there are none, and the bars of the shell."""
    item = sample(kind, number)
    coarse, fine = (solved(member, item)[0] for member in SHELLS)
    if coarse is None or fine is None:
        return {"words": item.words, "why": "the shell does not reach its end"}
    found: dict[str, Any] = {"words": item.words, "bars": errors(coarse, fine, item), "models": {}}
    for member in MEMBERS:
        path, took, why = solved(member, item)
        found["models"][member.name] = {
            "errors": None if path is None else errors(path, fine, item),
            "time_s": took,
            "unknowns": None if path is None else path.unknowns,
            "why": why,
        }
    return found


def within_time(kind: str, number: int) -> dict[str, Any]:
    """`examine`, given up after `LIMIT_S` of processor time: then the sheet has no figures, and that is said."""
    try:
        with processor_limit(LIMIT_S):
            return examine(kind, number)
    except OutOfTimeError:
        return {"words": sample(kind, number).words, "why": f"more than {LIMIT_S:g} s of processor time"}


def wanted(kinds: tuple[str, ...]) -> list[str]:
    """The kinds that the environment names, else those given.

    Args:
        kinds: without BH_MAP.

    Raises:
        InputError: it names one that there is not.
    """
    named = [word.strip() for word in os.environ.get(PART, "").split(",") if word.strip()]
    for name in named:
        if name not in KINDS:
            raise InputError(f"{PART}: there is no kind {name[:40]!r}; give some of {', '.join(KINDS)}")
    return named or list(kinds)


def run(context: Context) -> CaseResult:
    """All kinds, a sheet at a time."""
    result = CaseResult(
        name=CASE,
        title="For my kind of sheet, how far off is each model, and what does it cost?",
        question="Median errors of each model on random sheets of every kind, against the shell, with its bar.",
        source=TRUTH,
    )
    store = Store.open(context.folder, RUNS, context.quick)
    count = QUICK if context.quick else SHEETS
    kinds = wanted(QUICK_KINDS if context.quick else tuple(KINDS))
    for kind in kinds:
        for number in range(count):
            key = f"{kind}/{number}"
            if key not in store.runs:
                context.tell(f"{CASE}: {kind}, sheet {number + 1} of {count}")
                store.keep(key, within_time(kind, number))
    for kind in kinds:
        _cells(result, kind, [store.runs[f"{kind}/{number}"] for number in range(count)])
        _converges(result, kind)
    for kind, why in UNMEASURED.items():
        _without(result, kind, "all", SHEETS, why)
    _plots(result, kinds)
    if len(kinds) == len(KINDS):
        store.file.unlink(missing_ok=True)
    result.notes.append(
        "A cell is the median of the sheets of its kind, its bar the median distance of the shell's two meshes (2 and "
        "4 rows): an error below its bar is not told apart from it. Times are processor times of one trace, on a "
        "machine in use. A sheet that is symmetric may take either of two states that mirror each other: then its "
        "energy is right and its shape is not."
    )
    return result


def _without(result: CaseResult, kind: str, model: str, count: int, why: str) -> None:
    """Sheets of a kind that have no figure of a model, and why."""
    params = {"kind": kind, "model": model, "why": why}
    result.check(NO_FIGURES, count, unit="sheets", params=params)


def _cells(result: CaseResult, kind: str, found: list[dict[str, Any]]) -> None:
    """Records of a kind: one a quantity and a model, and one for the sheets of which a model has no figures."""
    judged = [item for item in found if "bars" in item]
    for member in MEMBERS:
        rows = [item["models"][member.name] for item in judged]
        there = [row for row in rows if row["errors"] is not None]
        reasons = [row["why"] for row in rows if row["why"]] + [
            item["why"] for item in found if "why" in item
        ]
        if reasons:
            _without(result, kind, member.name, len(reasons), "; ".join(sorted(set(reasons))))
        for quantity in QUANTITIES if there else ():
            off = [row["errors"][quantity] for row in there if math.isfinite(row["errors"][quantity])]
            if not off:
                continue  # sheets of this kind have no such quantity
            bars = [item["bars"][quantity] for item in judged]
            result.check(
                quantity + ERROR,
                float(np.median(off)),
                unit="1",
                reference=0.0,
                params={
                    "kind": kind,
                    "model": member.name,
                    "sheets": len(off),
                    "largest": max(off),
                    "error_bar": float(np.median(bars)),
                },
                path=Cost(
                    unknowns=int(np.median([row["unknowns"] for row in there])),
                    wall_time_s=float(np.median([row["time_s"] for row in there])),
                ),
            )


def _converges(result: CaseResult, kind: str) -> None:
    """Whether the energy of the finer consistent mesh lies nearer to the shell, or within the bar of the shell."""
    cells = {
        check.params["model"]: check
        for check in result.checks
        if check.quantity == "energy" + ERROR and check.params["kind"] == kind
    }
    coarse, fine = (cells.get(member.name) for member in MEMBERS if member.formulation == "consistent")
    if coarse is None or fine is None:
        return
    nearer = fine.value <= max(coarse.value, float(fine.params["error_bar"]))
    result.check(
        "energy: refined, the consistent formulation comes nearer, or within the bar",
        nearer,
        reference=1.0,
        tolerance=0.0,
        params={"kind": kind},
    )


def _plots(result: CaseResult, kinds: list[str]) -> None:
    """Error against time, a curve a kind, from bars and hinges to the finest mesh."""
    for quantity in ("energy", "shape"):
        series = []
        for kind in kinds:
            cells = [
                check
                for check in result.checks
                if check.quantity == quantity + ERROR
                and check.params["kind"] == kind
                and check.wall_time_s is not None
                and math.isfinite(check.value)
            ]
            if cells:
                times = [1e3 * (check.wall_time_s or 0.0) for check in cells]
                series.append(line(kind, times, [100.0 * check.value for check in cells]))
        result.plots.append(
            plot(
                f"map-{quantity}",
                f"Error of the {quantity} against time, by kind of sheet",
                "processor time of a trace, ms",
                "error, %",
                series,
                "Each curve from bars and hinges on one row by the consistent formulation on 2 and on 4 rows; "
                "medians of random sheets against the shell.",
                log="xy",
            )
        )
