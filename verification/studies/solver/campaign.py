"""Case `campaign`: random scenes with default settings; who does not reach the target must say so.

Each is played by bars and hinges and, on the same mesh, by the consistent formulation. Every state reached is compared
with what four times finer increments give: a state whose energy is more than 2 % higher lies on another branch, however
well it converged.
"""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import as_completed
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path as FilePath
from typing import Any

import numpy as np

import meshes
from bh import Automatic, LoadControl, Model, Path, Sheet, trace
from bh.runtime.workers import Workers
from bh.solvers.outcome import Outcome
from verification.framework.checks import CaseResult, Context, line, plot
from verification.framework.environment import environment

SEED = 2026
SCENES = 500
QUICK_SCENES = 60
TEST_SCENES = 12
FORMULATIONS = ("bars-and-hinges", "consistent")
SOURCE = "at least 99 % of the scenes reach their target with default settings; none ends on a higher branch"


@dataclass(frozen=True)
class Scene:
    """One random scene, as plain numbers (mm, rad)."""

    radius: float
    width: float
    gap: float
    creases: int
    angle: float
    thickness: float
    Lstar: float | None
    aspect_ratio: float
    kind: str
    supports: str
    dihedral: float
    formulation: str = FORMULATIONS[0]

    def model(self) -> Model:
        """The scene as a model; creases alternate between mountain and valley."""
        radii = [self.radius + self.gap * i for i in range(self.creases)]
        folds: list[Any] = ["mountain" if i % 2 == 0 else "valley" for i in range(self.creases)]
        pattern = meshes.annulus_sector(radii, self.width, self.angle, folds)
        mesh = meshes.structured(pattern, aspect_ratio=self.aspect_ratio, kind=self.kind)  # type: ignore[arg-type]
        model = Model(mesh, Sheet(E=4000.0, t=self.thickness), formulation=self.formulation, contact=False)
        if self.supports == "corners":
            model = model.support("corner:inner-start", "xyz").support("corner:outer-start", "yz")
            model = model.support("corner:inner-end", "z")
        elif self.supports == "planar crease":
            model = model.support(f"crease:{mesh.creases[0]}", "z").support("rigid-body")
        fold = math.pi - self.dihedral
        return (
            model.fold("all", by=fold) if self.Lstar is None else model.fold("all", by=fold, Lstar=self.Lstar)
        )


def scenes(count: int, seed: int = SEED) -> list[Scene]:
    """Random scenes: thin sheets (t at most a twentieth of the panel width) of all sizes, creases and supports.

    Args:
        count: of sheets.
        seed: of the random numbers.

    Returns:
        all sheets by the first formulation, then all by the next.
    """
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        radius = 10.0 ** rng.uniform(1.3, 2.6)
        width = radius * 10.0 ** rng.uniform(-1.5, -0.4)
        thickness = min(10.0 ** rng.uniform(-2.0, 0.3), width / 20.0)
        held = rng.random() < 0.4
        found.append(
            Scene(
                radius=radius,
                width=width,
                gap=width * rng.uniform(0.5, 1.5),
                creases=int(rng.integers(1, 6)),
                angle=rng.uniform(0.2, 1.5 * math.pi),
                thickness=thickness,
                Lstar=None if held else 10.0 ** rng.uniform(-1.0, 2.7),
                aspect_ratio=rng.uniform(2.0, 14.0),
                kind=str(
                    rng.choice(["staggered", "alternating", "one-way", "mirrored"], p=[0.55, 0.25, 0.1, 0.1])
                ),
                supports=str(rng.choice(["free", "corners", "planar crease"])),
                dihedral=math.radians(rng.uniform(10.0, 170.0)),
            )
        )
    return [replace(scene, formulation=name) for name in FORMULATIONS for scene in found]


FINE = LoadControl(
    first_rotation=math.radians(3.75), largest_rotation=math.radians(6.75), first=0.025, largest=0.085
)


@dataclass(frozen=True)
class Result:
    """How a scene ended, and by how much its energy exceeds that of fine increments (nan where either failed)."""

    scene: Scene
    outcome: str
    reason: str
    excess: float
    iterations: int
    unknowns: int
    wall_time_s: float
    stable: bool | None = None


def play(scene: Scene, compare: bool = True) -> Result:
    """Solve a scene with default settings, and again with four times finer increments."""
    model = scene.model()
    began = time.perf_counter()
    path = trace(model)
    spent = time.perf_counter() - began
    excess = math.nan
    if path.reached and compare:
        fine = trace(model, strategy=Automatic(load=FINE))
        if fine.reached:
            excess = _excess(path, fine)
    return Result(
        scene, path.outcome, path.reason, excess, path.iterations, path.unknowns, spent, path.stable
    )


def _excess(path: Path, fine: Path) -> float:
    scale = max(fine[-1].energy.total, 1e-15 * path.solved(0)[0].energy_scale)
    return float((path[-1].energy.total - fine[-1].energy.total) / scale)


def _played(job: tuple[int, Scene]) -> dict[str, Any]:
    index, scene = job
    found = asdict(play(scene))
    del found["scene"]
    return {"index": index, **found}


def play_all(found: Sequence[Scene], store: FilePath, tell: Callable[[str], None]) -> list[Result]:
    """Play every scene on all cores; each result is in the file `store` before the next, so a killed run goes on.

    The first line of the file names what its results depend on; a file of anything else is begun anew.
    """
    key = json.dumps({"seed": SEED, "scenes": len(found), **environment()})
    lines = store.read_text(encoding="utf-8").splitlines() if store.is_file() else []
    if not lines or lines[0] != key or "with changes" in key:
        lines = [key]
        store.write_text(key + "\n", encoding="utf-8")
    done = {item["index"]: item for item in map(_parsed, lines[1:]) if item}
    jobs = [(index, scene) for index, scene in enumerate(found) if index not in done]
    if done:
        tell(f"campaign: {len(done)} of {len(found)} scenes are known from a run that was cut short")
    with (
        Workers(os.cpu_count() or 1) as pool,
        store.open("a", encoding="utf-8") as file,
    ):
        futures = [pool.submit(_played, job) for job in jobs]
        for future in as_completed(futures):
            item = future.result()
            file.write(json.dumps(item) + "\n")
            file.flush()
            done[item["index"]] = item
            if len(done) % 20 == 0:
                tell(f"campaign: {len(done)} of {len(found)} scenes")
    results = []
    for index, scene in enumerate(found):
        values = {name: value for name, value in done[index].items() if name != "index"}
        results.append(Result(scene, **values))
    return results


def _parsed(line: str) -> dict[str, Any] | None:
    try:
        item = json.loads(line)
    except ValueError:  # the line at which the run was killed
        return None
    return item if isinstance(item, dict) else None


def run(context: Context) -> CaseResult:
    """The whole campaign."""
    count = QUICK_SCENES if context.quick else SCENES
    store = context.folder / f"campaign-{count}.jsonl"
    found = play_all(scenes(count), store, context.tell)
    result = judged(found)
    store.unlink()
    return result


def judged(found: Sequence[Result]) -> CaseResult:
    """The case from the results of its scenes."""
    sheets = len(found) // len(FORMULATIONS)
    result = CaseResult(
        name="campaign",
        title=f"{sheets} random scenes by both formulations",
        question="Does every scene reach its target with default settings, on the branch that fine steps find?",
        source=SOURCE,
    )
    for name in FORMULATIONS:
        _judge(result, name, [r for r in found if r.scene.formulation == name])
    groups = {
        name: [r for r in found if r.scene.formulation == name and _reached(r)] for name in FORMULATIONS
    }
    groups["not reached"] = [r for r in found if not _reached(r)]
    series = [
        line(name, [r.unknowns for r in group], [r.wall_time_s for r in group], "points")
        for name, group in groups.items()
    ]
    result.plots.append(
        plot(
            "campaign-time",
            "Run time over size",
            "unknowns",
            "wall time, s",
            series,
            "Every scene from flat to its target, default settings, one thread each, all cores busy.",
            log="xy",
        )
    )
    for r in found:
        if not _reached(r):
            result.notes.append(f"Not reached: {r.scene}: {r.outcome}, {r.reason}.")
        elif r.excess > 0.02:
            result.notes.append(f"Higher branch by {100 * r.excess:.1f} %: {r.scene}.")
    return result


def _reached(one: Result) -> bool:
    return one.outcome == Outcome.REACHED


def _judge(result: CaseResult, formulation: str, found: Sequence[Result]) -> None:
    """The checks of one formulation."""
    reached = [r for r in found if _reached(r)]
    higher = [r for r in reached if r.excess > 0.02]
    unknown = [r for r in reached if math.isnan(r.excess)]
    params = {"scenes": len(found), "seed": SEED, "formulation": formulation}
    check = partial(result.check, params=params)
    check(
        "share that fails to reach its target", 1.0 - len(reached) / len(found), reference=0.0, tolerance=0.01
    )
    check(
        "scenes that fail and do not say why",
        sum(not r.reason for r in found if not _reached(r)),
        reference=0.0,
        tolerance=0.0,
    )
    check("states on a higher branch (over 2 %)", len(higher), reference=0.0, tolerance=0.0)
    check("states that fine increments did not reach, so not compared", len(unknown), source="measured")
    check("end states that are not stable", sum(r.stable is False for r in reached), source="measured")
    for q in (50, 95, 100):
        check(
            f"iterations, {q}th percentile",
            np.percentile([r.iterations for r in reached], q),
            source="measured",
        )
    for q in (50, 95, 100):
        check(
            f"wall time, {q}th percentile",
            np.percentile([r.wall_time_s for r in reached], q),
            unit="s",
            source="measured",
        )
