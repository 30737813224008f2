"""Case `map`: how far each model is off, for every kind of sheet, and what it costs.

Five random sheets of every kind (`map_sheets`) are solved by every model and by the shell on two meshes: the finer is
the truth, its distance to the coarser one the bar. Cells of the map are kept in `map_runs.json` as they are done, a
sheet at a time; a run that was stopped goes on. Where a model has no figure, or a kind no such quantity, a record says
why. With BH_MAP="network, closed ring" in the environment these kinds alone are played and shown.
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
from bh.analysis.alignment import aligned
from bh.analysis.shapes import at_nodes_of
from bh.errors import InputError, ModelError
from bh.solving.accuracy import reading
from meshes import MeshError, SheetMesh
from meshes.cells import Cells, Kind, RuledCells
from meshes.choices import choices, cut
from verification.framework.checks import CaseResult, Context, Cost, line, plot
from verification.framework.random_scenes import OutOfTimeError, processor_limit
from verification.framework.store import Store
from verification.studies.solver.map_sheets import ABSENT, KINDS, Sample, on, sample

CASE, RUNS, PART = "map", "map_runs.json", "BH_MAP"
SHEETS, QUICK, QUICK_KINDS = 5, 1, ("narrow ring", "twisted", "orthotropic")
LIMIT_S = 60.0  # processor time of a sheet by a model
NO_FIGURES, NOTHING, ERROR = (
    "sheets without figures",
    "sheets without this quantity",
    ": median relative error",
)
BARS_HAVE_NONE = "the model is bars and hinges, which have none"
QUANTITIES = ("energy", "shape", "fold angle", "force", "stiffness", "stress")
EXCEEDED = 0.05  # part of the sheet's area in which the stress is above what is compared
TRUTH = "the shell, 4 rows"
JUDGES = (2.0, 4.0)  # levels of the shell


@dataclass(frozen=True)
class Member:
    """A model of the map: a formulation on the meshes that it is used with.

    Attributes:
        name, formulation: of the model.
        kind: of cutting cells into triangles.
        level: rows of cells in a panel; below one it is one row of longer cells.
        slender: how many times as many cells along the creases, for bars and hinges that want slender ones.
    """

    name: str
    formulation: str
    kind: Kind
    level: float
    slender: int = 1

    def meshes(self, item: Sample) -> Iterator[SheetMesh]:
        """Meshes to be tried, the best first; bars and hinges have one row of cells, where a sheet has rows."""
        for cells in choices(item.pattern, self.kind, self.level):
            taken: Cells = cells
            if isinstance(cells, RuledCells):
                along = cells.along * self.slender
                if self.level < 1.0:
                    taken = replace(cells, along=max(along, 8), rows=1)
                else:
                    taken = replace(cells, along=math.ceil(along / item.cells) * item.cells)
            elif self.slender > 1:
                return  # a drawing has no rows of cells
            try:
                yield cut(item.pattern, taken)
            except MeshError:
                continue


MEMBERS = (
    Member("bars and hinges", "bars-and-hinges", "staggered", 0.3),
    Member("bars and hinges, aspect ratio 8", "bars-and-hinges", "staggered", 1.0, 8),
    Member("consistent, 2 rows", "consistent", "staggered", 2.0),
    Member("consistent, 4 rows", "consistent", "staggered", 4.0),
)
SHELLS = tuple(Member(f"shell, {level:g} rows", "shell", "mirrored", level) for level in JUDGES)


def solved(member: Member, item: Sample) -> tuple[Path | None, float, str]:
    """A sheet by a model: its path where it reached its end within `LIMIT_S`, processor time (s), else why not."""
    mesh = next(member.meshes(item), None)
    if mesh is None:
        return None, math.nan, "no mesh of rows"
    began = time.process_time()
    try:
        with processor_limit(LIMIT_S):
            path = trace(on(item, mesh, member.formulation), warn=False)
    except OutOfTimeError:
        return None, math.nan, f"more than {LIMIT_S:g} s of processor time"
    except InputError as refusal:
        return None, math.nan, f"refused: {refusal}"
    took = time.process_time() - began
    return (path, took, "") if path.reached else (None, math.nan, str(path.outcome))


def values(path: Path, item: Sample) -> dict[str, float]:
    """What is compared as numbers; nan where the sheet has no such thing."""
    state = path[-1]
    found = dict.fromkeys(QUANTITIES, math.nan)
    found["energy"] = float(state.energy.total)
    if item.spring:
        angles = [np.abs(state.fold_angle(crease.name)).mean() for crease in item.pattern.creases]
        found["fold angle"] = float(np.mean(angles))
    if item.force is not None:
        found["force"] = item.force(path)
    found["stress"] = high_stress(state)
    if item.probes:
        try:
            each = [float(reading(path, Goal(0.05, "stiffness", *probe))[0]) for probe in item.probes]
            found["stiffness"] = float(np.mean(each))
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
    except ModelError:  # bars and hinges
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
    found["shape"] = apart(path[-1], truth[-1], item) / moved
    return found


def apart(state: State, truth: State, item: Sample) -> float:
    """Root mean square distance of nodes from where the truth, or a twin of it, has the same points of the sheet, mm.

    Args:
        state: its nodes are compared, moved rigidly onto the other shape.
        truth: on a mesh of its own.
        item: the sheet, which knows its twins.
    """
    mesh = state.mesh
    found = []
    for twin in (None, *item.twins):
        flat = mesh.points.copy()
        flat[:, :2] = flat[:, :2] if twin is None else twin(flat[:, :2])
        there = at_nodes_of(replace(mesh, points=flat), truth)
        off = np.linalg.norm(aligned(there, state.points)[0] - state.points, axis=1)
        found.append(float(np.sqrt(np.mean(off**2))))
    return min(found)


def examine(kind: str, number: int) -> dict[str, Any]:
    """A sheet of a kind: for every model errors, time and why there are none, and the bars of the shell."""
    item = sample(kind, number)
    judges = [solved(member, item) for member in SHELLS]
    coarse, fine = (path for path, _, _ in judges)
    if coarse is None or fine is None:
        why = next(why for path, _, why in judges if path is None)
        return {"words": item.words, "why": f"the shell does not reach its end: {why}"}
    found: dict[str, Any] = {
        "words": item.words,
        "bars": errors(coarse, fine, item),
        "models": {},
        "judge_s": judges[1][1],
    }
    for member in MEMBERS:
        path, took, why = solved(member, item)
        found["models"][member.name] = {
            "errors": None if path is None else errors(path, fine, item),
            "time_s": took,
            "unknowns": None if path is None else path.unknowns,
            "why": why,
        }
    return found


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
                store.keep(key, examine(kind, number))
    for kind in kinds:
        _cells(result, kind, [store.runs[f"{kind}/{number}"] for number in range(count)])
        _converges(result, kind)
        _absent(result, kind, count)
    _plots(result, kinds)
    if len(kinds) == len(KINDS):
        store.file.unlink(missing_ok=True)
    result.notes.append(
        "A cell is the median of the sheets of its kind, its bar the median distance of the shell's two meshes (2 and "
        "4 rows): an error below its bar is not told apart from it. Times are processor times of one trace, on a "
        "machine in use. A sheet that is symmetric (a ring, a twisted strip) may take either of two states that are "
        "each other's: then its shape is compared with the nearer one. The force of a pinch is the moment that closes "
        "it. Stiffness is that of a free corner of a sheet held at the others; of a ring, which is held where its "
        "saddle crosses its plane, the mean of two crests."
    )
    return result


def _without(result: CaseResult, kind: str, model: str, count: int, why: str) -> None:
    """Sheets of a kind that have no figure of a model, and why."""
    params = {"kind": kind, "model": model, "why": why}
    result.check(NO_FIGURES, count, unit="sheets", params=params)


def _absent(result: CaseResult, kind: str, count: int) -> None:
    """Cells of a kind that are empty because there is no such quantity."""
    for quantity, why in ABSENT.get(kind, {}).items():
        params = {"kind": kind, "model": "all", "quantity": quantity, "why": why}
        result.check(NOTHING, count, unit="sheets", params=params)
    bars = [member for member in MEMBERS if member.formulation == "bars-and-hinges"]
    for member in bars:
        if any(
            check.quantity.endswith(ERROR)
            and (check.params["kind"], check.params["model"]) == (kind, member.name)
            for check in result.checks
        ):
            params = {"kind": kind, "model": member.name, "quantity": "stress", "why": BARS_HAVE_NONE}
            result.check(NOTHING, count, unit="sheets", params=params)


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
