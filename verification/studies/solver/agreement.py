"""Case `agreement`: default, shell and energy balance on 500 random sheets: is any off by more than it says?

Networks, wide panels and closed rings, from a seed that nothing was chosen with. Each is solved as it comes (5 % of the
energy, mesh and formulation chosen), by the shell on two meshes of its own, and along the default's path the work of
the actuation is compared with the energy gained; other states beside the ends are not looked for. What each may be off
by is what it tells itself: the default's estimate, the distance of the shell's two meshes, the difference of the work
by all states and by every second one.
Sheets are kept in `agreement_runs.json` as they are done; BH_AGREEMENT=100:200 plays these and counts all that are
kept.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from bh import Goal, Path, trace
from bh.errors import InputError
from meshes import MeshError
from meshes.choices import choices, cut
from verification.framework.checks import CaseResult, Context, Cost, line, plot
from verification.framework.random_scenes import OutOfTimeError, part_of, played, processor_limit
from verification.studies.solver import honesty_scenes
from verification.studies.solver.agreement_work import balance

CASE, RUNS, PART = "agreement", "agreement_runs.json", "BH_AGREEMENT"
SEED = 20261130
SHEETS, QUICK, ENOUGH = 500, 4, 490
WITHIN = 0.05
KINDS: tuple[tuple[str, Callable[[np.random.Generator], honesty_scenes.Draw]], ...] = (
    ("network", honesty_scenes.network),
    ("wide panel", honesty_scenes.wide),
    ("network", honesty_scenes.network),
    ("wide panel", honesty_scenes.wide),
    ("closed ring", honesty_scenes.ring),
)
LEVELS = {"network": (2.5, 5.0), "wide panel": (2.5, 5.0), "closed ring": (1.0, 2.0)}  # rows of the shell
# processor time of a sheet; the default of a ring may take 40 s, then come its work and the shells
LIMIT_S = 300.0
SOURCE = "mutual: the default, the shell on meshes of its own, and the work done"


@dataclass(frozen=True)
class Row:
    """What became of a sheet; energies in N mm, nan where there is none.

    Attributes:
        number, kind, words: which sheet.
        why: no figures: the reason; empty where there are.
        formulation: that the default chose.
        energy, estimate: of the default, and its relative estimate.
        truth, bar: of the shell on the finer mesh, and its relative distance to the coarser one.
        work, gained, allowed: of the actuation, of the sheet along the same increments, and what they may differ by in
            parts of the latter; covered: part of the step that these increments cover.
        seconds: processor time of the sheet, all told.
    """

    number: int
    kind: str
    words: str
    why: str = ""
    formulation: str = ""
    energy: float = math.nan
    estimate: float = math.nan
    truth: float = math.nan
    bar: float = math.nan
    work: float = math.nan
    gained: float = math.nan
    allowed: float = math.nan
    covered: float = 0.0
    seconds: float = 0.0

    @property
    def apart(self) -> float:
        """Default against shell, in parts of the shell's energy."""
        return abs(self.energy / self.truth - 1.0)

    @property
    def agrees(self) -> bool:
        """Default and shell are apart by no more than both say."""
        return self.apart <= self.estimate + self.bar

    @property
    def balances(self) -> bool:
        """Work and energy are apart by no more than the rule of integration says."""
        return abs(self.work - self.gained) <= self.allowed * abs(self.gained)

    @property
    def held(self) -> bool:
        """Nothing is off by more than it says; a sheet without figures does not count as held."""
        return not self.why and self.agrees and self.balances


def play(number: int) -> Row:
    """Solve a sheet in the three ways.

    Args:
        number: of the sheet.
    """
    kind, make = KINDS[number % len(KINDS)]
    item = make(np.random.default_rng([SEED, number]))
    row = Row(number, kind, item.words)
    began = time.process_time()
    try:
        with processor_limit(LIMIT_S):
            row = _figures(row, item)
    except OutOfTimeError:
        row = replace(row, why=f"more than {LIMIT_S:g} s of processor time")
    except InputError as refusal:
        row = replace(row, why=f"refused: {refusal}")
    return replace(row, seconds=time.process_time() - began)


def _figures(row: Row, item: honesty_scenes.Draw) -> Row:
    path = trace(item.model, accuracy=Goal(WITHIN), warn=False, neighbours=False)
    if not path.reached or path.accuracy is None:
        return replace(row, why=f"the default ends early: {path.outcome}")
    done = balance(path)
    row = replace(
        row,
        formulation=path.accuracy.formulation,
        energy=path[-1].energy.total,
        estimate=path.accuracy.estimate,
        work=done.work,
        gained=done.gained,
        allowed=done.allowed,
        covered=done.covered,
    )
    judges = [_by_shell(item, level) for level in LEVELS[row.kind]]
    if judges[0] is None or judges[1] is None:
        return replace(row, why="the shell does not reach its end on both meshes")
    coarse, fine = (judge[-1].energy.total for judge in judges if judge is not None)
    return replace(row, truth=fine, bar=abs(coarse / fine - 1.0))


def _by_shell(item: honesty_scenes.Draw, level: float) -> Path | None:
    """The sheet by the shell with `level` rows a panel, stable at its end; None where that is not had."""
    pattern = item.model.mesh.pattern
    assert pattern is not None
    for cells in choices(pattern, "mirrored", level):
        try:
            mesh = cut(pattern, cells)
        except MeshError:
            continue
        path = trace(replace(item.model, mesh=mesh, formulation="shell"), warn=False, neighbours=False)
        return path if path.reached and path.stable is not False else None
    return None


def run(context: Context) -> CaseResult:
    """Play the sheets that are not kept, and count all that are."""
    numbers = part_of(PART, QUICK if context.quick else SHEETS, SHEETS)
    known = played(context, CASE, RUNS, numbers, SHEETS, play)
    return judged([Row(**row) for row in known])


def judged(rows: Sequence[Row]) -> CaseResult:
    """The case from what became of its sheets.

    Args:
        rows: one a sheet.
    """
    result = CaseResult(
        name=CASE,
        title="Default, shell and energy balance on random sheets",
        question="Is any of the three off by more than it says itself?",
        source=SOURCE,
    )
    judgeable = [row for row in rows if not row.why]
    params = {"sheets": len(rows), "seed": SEED}
    check = partial(result.check, params=params, unit="sheets")
    check(
        "sheets on which nothing is off by more than its own estimate allows",
        sum(row.held for row in rows),
        reference=float(len(rows)),
        source=f"asked: {ENOUGH} of {SHEETS}",
        tolerance=1.0 - ENOUGH / SHEETS,
    )
    check("sheets without figures", sum(bool(row.why) for row in rows), source="the others say so")
    check("default and shell apart by more than both allow", sum(not row.agrees for row in judgeable))
    check("work and energy apart by more than the rule allows", sum(not row.balances for row in judgeable))
    for kind in LEVELS:
        _kind(result, kind, [row for row in judgeable if row.kind == kind])
    result.notes += [
        f"Sheet {row.number} ({row.kind}: {row.words}): {_trouble(row)}." for row in rows if not row.held
    ]
    result.notes.append(
        "Work is that of the increments that can be followed in small parts; where a sheet buckles or jumps within "
        "an increment, that one is left out on both sides. Times are of the processor, on a machine in use."
    )
    _plots(result, judgeable)
    return result


def _kind(result: CaseResult, kind: str, rows: Sequence[Row]) -> None:
    """Medians and the largest of a kind."""
    if not rows:
        return
    params = {"kind": kind, "sheets": len(rows), "seed": SEED}
    took = Cost(wall_time_s=float(np.median([row.seconds for row in rows])))
    check = partial(result.check, params=params, source=SOURCE)
    check("sheets of the kind that hold", sum(row.held for row in rows), unit="sheets")
    check("default from the shell, median", np.median([row.apart for row in rows]), path=took)
    check("default from the shell, largest", max(row.apart for row in rows))
    check(
        "default from the shell over what both allow, median",
        np.median([row.apart / (row.estimate + row.bar) for row in rows]),
    )
    off = [abs(row.work / row.gained - 1.0) for row in rows if row.gained]
    if off:
        check("work from energy gained, median", np.median(off))
        check("work from energy gained, largest", max(off))
    check("part of the step whose work is compared, median", np.median([row.covered for row in rows]))


def _trouble(row: Row) -> str:
    if row.why:
        return row.why
    words = []
    if not row.agrees:
        words.append(
            f"default {row.energy:.4g} ({row.formulation}, told {row.estimate:.2%}), "
            f"shell {row.truth:.4g} N mm ({row.bar:.2%}): {row.apart:.2%} apart"
        )
    if not row.balances:
        off = abs(row.work / row.gained - 1.0) if row.gained else math.inf
        words.append(
            f"work {row.work:.5g}, energy gained {row.gained:.5g} N mm: {off:.3%} apart, {row.allowed:.3%} allowed"
        )
    return "; ".join(words)


def _plots(result: CaseResult, rows: Sequence[Row]) -> None:
    allowed = [100.0 * (row.estimate + row.bar) for row in rows]
    if not allowed:
        return
    series = [
        line(
            kind,
            [100.0 * (row.estimate + row.bar) for row in rows if row.kind == kind],
            [100.0 * row.apart for row in rows if row.kind == kind],
            "points",
        )
        for kind in LEVELS
        if any(row.kind == kind for row in rows)
    ]
    ends = [min(allowed), max(allowed)]
    series.append(line("as much as both allow", ends, ends, "reference"))
    result.plots.append(
        plot(
            "agreement",
            "Default against shell, over what both say of themselves",
            "estimate of the default and bar of the shell, %",
            "distance of their energies, %",
            series,
            "Every random sheet; below the line they agree within what they tell.",
            log="xy",
        )
    )
