"""Case `landing`: designs by the model that converges, judged by the shell, which none of them was made with."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import bh.sweep
from bh.applications.inverse.judge import MESHES, judge
from bh.applications.inverse.models import SHIPPED, model
from bh.applications.inverse.reach import Reach
from bh.applications.inverse.simulate import simulate
from bh.solvers.outcome import Outcome
from verification.framework.checks import CaseResult, Context
from verification.studies.ch6.problem_c import MOST, cores, targets

Array = NDArray[np.float64]
REFINED = ((1.25, 4), (0.625, 6))  # of the shell that judges segments: mm along the crease, rows a panel
SEGMENTS, JUDGED = 40, 60
SHELL = "shell"


@dataclass(frozen=True)
class LandTask:
    """A target with y >= 0; the mirrored design is its mirror image."""

    reach: Reach = field(default_factory=Reach)

    @property
    def identity(self) -> str:
        """Of the task, its settings and the data set."""
        import hashlib

        return f"land {self.reach!r} {hashlib.sha256(SHIPPED.read_bytes()).hexdigest()}"

    def __call__(self, point: Mapping[str, Any]) -> dict[str, Any]:
        """What was found for the target {"x", "y", "z"} (mm), as values of the data set."""
        found = self.reach(np.array([point["x"], point["y"], point["z"]], dtype=float))
        design, pad = found.design, MOST - found.design.n
        assert found.landing is not None
        return {
            "missed": found.missed_simulated,
            "bar": found.landing.bar,
            "n": design.n,
            "clear": float(found.clear),
            "simulations": found.simulations,
            "k0": np.pad(design.k0, (0, pad), constant_values=np.nan),
            "length": np.pad(design.length, (0, pad), constant_values=np.nan),
            "pinched": np.pad(design.pinched.astype(float), (0, pad), constant_values=np.nan),
        }


def run(context: Context) -> CaseResult:
    """Segments off the grid and whole designs against the shell, and all targets with error bars."""
    result = CaseResult(
        name="landing",
        title="Designs that land where the sheet does",
        question="Does a sheet that is cut, folded and pinched as designed end where it should?",
        source=SHELL,
    )
    context.folder.mkdir(parents=True, exist_ok=True)
    context.tell("landing: segments off the grid against the shell")
    segments(result, 2 if context.quick else SEGMENTS)
    context.tell(f"landing: {len(targets(context.quick))} targets with y >= 0")
    data = solve(context.folder / "landing.nc", context.quick)
    reached(result, data)
    context.tell("landing: designs against the shell")
    judged(result, data, 1 if context.quick else JUDGED)
    return result


def solve(file: Path, quick: bool, pool: int | None = None) -> Any:
    """The data set of all targets; goes on with what an earlier run of this file has left, also a finished one."""
    resume = file.is_file() or Path(f"{file}.points").is_file()
    return bh.sweep.run(LandTask(), targets(quick), file, pool=pool, resume=resume)


def drawn(count: int, seed: int = 19) -> list[tuple[float, float, bool]]:
    """Segments at random in the domain, three of four pinched: k0 before folding (1/mm), length (mm), pinched."""
    rng, domain = np.random.default_rng(seed), model().domain
    found = []
    for i in range(count):
        length = float(rng.uniform(*domain.length))
        found.append((float(rng.uniform(-1.0, 1.0) * domain.largest_curvature(length)), length, i % 4 != 3))
    return found


def off(k0: float, length: float, pinched: bool) -> tuple[float, float, float, float]:
    """Of one segment: distance from the shell's end (mm), angle to its frame (degrees), and both error bars."""
    judge_ = judge([k0], [length], [pinched], model().setting, REFINED)
    points, frames = model().forward([k0], [length], [pinched])
    position, turn = model().bars([k0], [length], [pinched])
    apart = float(np.linalg.norm(points[-1] - judge_.end))
    angle = np.linalg.norm(Rotation.from_matrix(frames[-1].T @ judge_.strips[-1].r).as_rotvec())
    return apart, math.degrees(angle), float(position), math.degrees(float(turn))


def segments(result: CaseResult, count: int) -> None:
    """Single segments against the refined shell."""
    rows = np.array([off(*each) for each in drawn(count)])
    check = partial(result.check, params={"segments": count}, reference=0.0)
    for i, (name, unit) in enumerate((("position", "mm"), ("orientation", "deg"))):
        check(f"{name} of segments, 95th percentile", np.percentile(rows[:, i], 95), unit=unit, tolerance=0.3)
        over = float((rows[:, i] / rows[:, i + 2]).max())
        result.check(
            f"largest error of the {name} over its bar",
            over,
            reference=0.0,
            tolerance=2.0,
            params={"segments": count},
        )


def reached(result: CaseResult, data: Any) -> None:
    """All targets, mirror images included: found, and within a millimetre with the error bar."""
    good = data["outcome"].values == Outcome.REACHED
    mirror = data["y"].values > 0.0
    check = partial(result.check, params={"targets": len(good)})
    check(
        "points with a design, mirror images included",
        int(good.sum() + (good & mirror).sum()),
        reference=float(len(good) + mirror.sum()),
        tolerance=0.0,
    )
    far = data["missed"].values[good] + data["bar"].values[good]
    check(
        "largest distance of a strip from its point, error bar included",
        far.max(),
        unit="mm",
        reference=0.0,
        tolerance=1.0,
    )
    check("median of these distances", np.median(far), unit="mm")
    check("designs that clear themselves in space", data["clear"].values[good].sum())
    seconds = float(np.nansum(data["wall_time_s"].values))
    check("time of all targets on this machine", seconds / cores(), unit="s", source="aim: 600 s")


def judged(result: CaseResult, data: Any, count: int) -> None:
    """Some designs, drawn at random, by the shell, and what the source's model would have cut."""
    good = np.flatnonzero(data["outcome"].values == Outcome.REACHED)
    rng = np.random.default_rng(60)
    for i in rng.permutation(good)[:count]:
        n = int(data["n"].values[i])
        k0, length = (data[name].values[i][:n].tolist() for name in ("k0", "length"))
        on = [bool(x) for x in data["pinched"].values[i][:n]]
        target = np.array([data[name].values[i] for name in "xyz"])
        verdict = judge(k0, length, on, model().setting, MESHES)
        params = {"target": target.tolist(), "segments": n, "pinched": sum(on)}
        result.check(
            "distance of a design from its point by the shell",
            verdict.missed(target),
            unit="mm",
            reference=0.0,
            tolerance=1.0,
            params=params,
        )
        result.check("change of the shell's end with its mesh", verdict.change, unit="mm", params=params)


def missed_by_source(target: Array) -> tuple[float, float]:
    """What a design by the source's model misses its point (3,) by: as that model says, and by the shell, mm."""
    found = Reach(model="source")(target)
    verdict = judge(*found.design.lists(), model("source").setting)
    strip = simulate(*found.design.lists(), model("source").setting)
    return float(np.linalg.norm(strip.t - target)), verdict.missed(target)
