"""Case `campaign`: random scenes with default settings; who does not reach the target must say so.

Every state reached is compared with what four times finer increments give: a state whose energy is more than 2 % higher
lies on another branch, however well it converged.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

import meshes
from bh import LoadControl, Model, Path, Sheet, trace
from verification.checks import CaseResult, Check, Context, line, plot

SEED = 2026
SCENES = 500
QUICK_SCENES = 60
TEST_SCENES = 12
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

    def model(self) -> Model:
        """The scene as a model; creases alternate between mountain and valley."""
        radii = [self.radius + self.gap * i for i in range(self.creases)]
        folds: list[Any] = ["mountain" if i % 2 == 0 else "valley" for i in range(self.creases)]
        pattern = meshes.annulus_sector(radii, self.width, self.angle, folds)
        mesh = meshes.structured(pattern, aspect_ratio=self.aspect_ratio, kind=self.kind)  # type: ignore[arg-type]
        model = Model(mesh, Sheet(E=4000.0, t=self.thickness))
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
    """Random scenes: thin sheets (t at most a twentieth of the panel width) of all sizes, creases and supports."""
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
    return found


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


def play(scene: Scene, compare: bool = True) -> Result:
    """Solve a scene with default settings, and again with four times finer increments."""
    model = scene.model()
    began = time.perf_counter()
    path = trace(model)
    spent = time.perf_counter() - began
    excess = math.nan
    if path.outcome == "reached" and compare:
        fine = trace(model, strategy=FINE)
        if fine.outcome == "reached":
            excess = _excess(path, fine)
    return Result(scene, path.outcome, path.reason, excess, path.iterations, path.unknowns, spent)


def _excess(path: Path, fine: Path) -> float:
    scale = max(fine[-1].energy.total, 1e-15 * path._system(0).energy_scale)
    return (path[-1].energy.total - fine[-1].energy.total) / scale


def run(context: Context) -> CaseResult:
    """The whole campaign."""
    count = QUICK_SCENES if context.quick else SCENES
    found: list[Result] = []
    for index, scene in enumerate(scenes(count)):
        if index % 20 == 0:
            context.tell(f"campaign: scene {index} of {count}")
        found.append(play(scene))
    result = CaseResult(
        name="campaign",
        title=f"{count} random scenes",
        question="Does every scene reach its target with default settings, on the branch that fine steps find?",
        source=SOURCE,
    )
    reached = [r for r in found if r.outcome == "reached"]
    higher = [r for r in reached if r.excess > 0.02]
    params = {"scenes": count, "seed": SEED}
    share = len(reached) / count
    result.checks = [
        Check("campaign", "share that fails to reach its target", params, 1.0 - share, "", 0.0, SOURCE, 0.01),
        Check(
            "campaign",
            "states on a higher branch (over 2 %)",
            params,
            float(len(higher)),
            "",
            0.0,
            SOURCE,
            0.0,
        ),
    ]
    for name, values in (
        ("iterations", [float(r.iterations) for r in reached]),
        ("wall time", [r.wall_time_s for r in reached]),
    ):
        for q in (50, 95, 100):
            value = float(np.percentile(values, q))
            unit = "s" if name == "wall time" else ""
            result.checks.append(
                Check("campaign", f"{name}, {q}th percentile", params, value, unit, None, "measured")
            )
    result.plots.append(
        plot(
            "campaign-time",
            "Run time over size",
            "unknowns",
            "wall time, s",
            [
                line("reached", [r.unknowns for r in reached], [r.wall_time_s for r in reached], "points"),
                line(
                    "not reached",
                    [r.unknowns for r in found if r.outcome != "reached"],
                    [r.wall_time_s for r in found if r.outcome != "reached"],
                    "points",
                ),
            ],
            "Every scene from flat to its target, default settings, one thread.",
            log="xy",
        )
    )
    for r in found:
        if r.outcome != "reached":
            result.notes.append(f"Not reached: {r.scene}: {r.outcome}, {r.reason}.")
        elif r.excess > 0.02:
            result.notes.append(f"Higher branch by {100 * r.excess:.1f} %: {r.scene}.")
    return result
