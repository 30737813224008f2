"""Case `branches`: random scenes that end apart from four times finer increments have to say so.

Every scene is solved with default settings and with increments of a quarter; where both reach their end and end in
other states, `path.remarks` of the first has to name what lies beside the path. Scenes are stored one by one, so a run
that was stopped goes on; with BH_BRANCHES=100:200 in the environment it plays these and counts all that are stored.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

from bh import Automatic, LoadControl, Path, trace
from bh.errors import InputError
from verification.framework.checks import CaseResult, Context
from verification.framework.random_scenes import Clock, OutOfTimeError, part_of, played
from verification.studies.solver.branch_scenes import SEED, drawn

CASE, RUNS, PART = "branches", "branches_runs.json", "BH_BRANCHES"
SCENES, QUICK = 500, 12
APART = 1e-3  # in parts of the energy: two states
COARSE_S, FINE_S = 20.0, 80.0  # processor time of a scene
FINE = LoadControl(
    first_rotation=math.radians(90.0) / 4.0,
    largest_rotation=math.radians(90.0) / 4.0,
    cautious_rotation=math.radians(15.0) / 4.0,
    first=0.1 / 4.0,
    largest=0.34 / 4.0,
)
TELLING = (
    "state is within reach",
    "state of lower energy is within reach",
    " point passed at lambda",
    "jump",
    "by arc length",
    "left an unstable state",
    "stable branch",
    "settled",
    "not stable",
)


@dataclass(frozen=True)
class Row:
    """What became of a scene.

    Attributes:
        number: of the scene.
        words: the scene.
        outcome: of the default run, "refused", or "out of time".
        fine: the same with finer increments; empty where it was not tried.
        apart: largest difference of an energy between the two, in parts of the larger total; nan without both.
        lower: part by which the default run's energy is the lower one; nan without both.
        told: remarks of the default run that tell of branches.
        seconds: processor time of the default run.
    """

    number: int
    words: str
    outcome: str
    fine: str = ""
    apart: float = math.nan
    lower: float = math.nan
    told: tuple[str, ...] = ()
    seconds: float = 0.0

    @property
    def silent(self) -> bool:
        """Does it end apart without a word?"""
        return self.apart > APART and not self.told


def telling(path: Path) -> tuple[str, ...]:
    """Remarks of a path that tell of other branches, states or critical points."""
    return tuple(line for line in path.remarks if any(word in line for word in TELLING))


def apart(one: Path, other: Path) -> tuple[float, float]:
    """By how much two ends differ in a kind of energy, and the first is lower in all, in parts of the larger total."""
    a, b = one[-1].energy, other[-1].energy
    size = max(abs(a.total), abs(b.total), 1e-15 * one.solved(-1)[0].energy_scale)
    kinds = ((a.stretching, b.stretching), (a.bending, b.bending), (a.folding, b.folding), (a.total, b.total))
    return max(abs(x - y) for x, y in kinds) / size, (b.total - a.total) / size


def play(number: int) -> Row:
    """Solve a scene twice.

    Args:
        number: of the scene.
    """
    scene = drawn(number)
    began = time.process_time()
    try:
        path = trace(scene.model, progress=Clock(COARSE_S), warn=False)
    except InputError:
        return Row(number, scene.words, "refused")
    except OutOfTimeError:
        return Row(number, scene.words, "out of time")
    seconds = time.process_time() - began
    told = telling(path)
    if not path.reached:
        return Row(number, scene.words, str(path.outcome), told=told, seconds=seconds)
    try:
        fine = trace(
            scene.model, strategy=Automatic(load=FINE), progress=Clock(FINE_S), warn=False, neighbours=False
        )
    except OutOfTimeError:
        return Row(number, scene.words, str(path.outcome), "out of time", told=told, seconds=seconds)
    if not fine.reached:
        return Row(number, scene.words, str(path.outcome), str(fine.outcome), told=told, seconds=seconds)
    difference, lower = apart(path, fine)
    return Row(number, scene.words, str(path.outcome), str(fine.outcome), difference, lower, told, seconds)


def run(context: Context) -> CaseResult:
    """Play the scenes that are not stored, and count all that are."""
    numbers = part_of(PART, QUICK if context.quick else SCENES, SCENES)
    known = played(context, CASE, RUNS, numbers, SCENES, play)
    return judged([Row(**{**row, "told": tuple(row["told"])}) for row in known])


def judged(rows: Sequence[Row]) -> CaseResult:
    """The case from what became of its scenes.

    Args:
        rows: one a scene.
    """
    result = CaseResult(
        name=CASE,
        title="Which branch",
        question="Do scenes that end apart from finer increments say what lies beside their path?",
        source=f"{SCENES} random scenes of seed {SEED}, soft and multi-step ones among them",
    )
    both = [row for row in rows if math.isfinite(row.apart)]
    away = [row for row in both if row.apart > APART]
    silent = [row for row in both if row.silent]
    params = {"scenes": len(rows), "compared": len(both), "seed": SEED}
    result.check(
        "scenes that end apart from four times finer increments without a remark",
        len(silent),
        reference=0.0,
        source="at most 2 in 500",
        tolerance=2.0 * len(rows) / SCENES,
        params=params,
    )
    result.check("scenes that end apart", len(away), source="measured", params=params)
    result.check(
        "scenes that end in the same state and have a remark",
        sum(bool(row.told) for row in both if row.apart <= APART),
        source="measured",
        params=params,
    )
    for outcome in sorted({row.outcome for row in rows}):
        result.check(
            f"scenes that end as {outcome}",
            sum(row.outcome == outcome for row in rows),
            source="measured",
            params=params,
        )
    for row in away:
        told = "; ".join(row.told) or "nothing is said"
        result.notes.append(
            f"Scene {row.number} ends apart by {row.apart:.2%} (energy {row.lower:+.2%} lower): {row.words}: {told}."
        )
    return result
