"""Numbers from tests: the examples of docs/calibrate.md and docs/from_a_test.md, and a hundred repeats with noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import bh
import meshes
from bh.commands.calibrate_file import load_task
from verification.framework.checks import CaseResult, Cost

EXAMPLE = Path(__file__).resolve().parents[4] / "examples" / "calibrate" / "calibrate.toml"
REPEATS, TRUE = 100, (4000.0, 20.0)  # E in MPa and L* in mm
NAMES = ("sheet.E", "creases.crease.Lstar")
LAB = "what the shell was given, which made the readings"


def calibration(result: CaseResult, quick: bool) -> None:
    """What the examples find, and how often intervals hold the truth.

    Args:
        result: gets the checks.
        quick: with few repeats.
    """
    task = load_task(EXAMPLE)
    found = bh.calibrate(task.build, task.data, task.free, task.starts, task.seed)
    _one(result, "examples/calibrate", found, 20.0)
    result.check("solutions of a calibration", found.solved, params={"of": "examples/calibrate"})
    result.check("misfit of a calibration", found.misfit, params={"of": "examples/calibrate"})
    force = bh.Measured("reaction_z", (0.01033, 0.01937, 0.03191), of="edge:end", sigma=0.0004)
    _one(result, "strip", bh.calibrate(strip(3000.0), force, free={"sheet.E": (3000, 500, 9000)}), 3800.0)
    for rows in (2, 4):
        force = bh.Measured("reaction_z", (0.0977, 0.2019, 0.4609), of="edge:outer", sigma=0.005)
        free = {"creases.crease.Lstar": (20.0, 1.0, 200.0)}
        _one(result, f"crease, {rows} rows", bh.calibrate(scored(rows), force, free=free), 12.0)
    path = bh.trace(strip(3800.0), estimate=False).require()
    ends = {state.step: state for state in path}
    stiff = [ends[k].reaction("edge:end")[2] / lift for k, lift in enumerate((4.0, 8.0, 12.0))]
    result.check("force a millimetre at 12 mm over that at 4 mm", stiff[2] / stiff[0], path=path)
    inside, solved = repeats(5 if quick else REPEATS)
    for name, count in zip(NAMES, inside, strict=True):
        result.check(
            "repeats whose interval holds the true value",
            int(count),
            params={"of": name, "repeats": 5 if quick else REPEATS},
            path=Cost(iterations=solved),
        )


def _one(result: CaseResult, what: str, found: bh.Calibration, true: float) -> None:
    """The value, its error and the ends of its interval."""
    for quantity, value in (
        ("value", found.values[0]),
        ("error", found.errors[0]),
        ("lower end of the interval", found.intervals[0, 0]),
        ("upper end of the interval", found.intervals[0, 1]),
    ):
        result.check(
            f"{quantity} that a calibration finds",
            float(value),
            unit="MPa" if what == "strip" else "mm",
            reference=true if quantity == "value" else None,
            source=LAB,
            params={"of": what},
        )


def strip(E: float) -> bh.Model:
    """A strip that is lifted at its end in three steps, as on the page.

    Args:
        E: MPa.
    """
    mesh = meshes.structured(meshes.strip(60, 20, [10], "flat"), along=6, rows=2)
    model = bh.Model(mesh, bh.Sheet(E=E, nu=0.3, t=0.3)).support("edge:start", "xyz", clamp=True)
    for lift in (4, 8, 12):
        model = model.displace("edge:end", "z", by=lift)
    return model


def scored(rows: int) -> bh.Model:
    """A strip with a crease that is lifted close to it, as on the page.

    Args:
        rows: of cells.
    """
    mesh = meshes.structured(meshes.strip(20, 20, [10]), along=rows + 2, rows=rows)
    model = bh.Model(mesh, bh.Sheet(E=3800, nu=0.3, t=0.3)).crease("crease", Lstar=20)
    model = model.support("edge:inner", "xyz", clamp=True).support("crease:crease", "xyz")
    for lift in (1, 2, 4):
        model = model.displace("edge:outer", "z", by=lift)
    return model


def lifted(Lstar: float) -> bh.Model:
    """A curved crease that is lifted in three steps while the edges stay in the plane.

    Args:
        Lstar: mm.
    """
    mesh = meshes.structured(meshes.annulus_sector(radius=60.0, width=12.0, angle=0.8), along=6, rows=2)
    model = bh.Model(mesh, bh.Sheet(E=TRUE[0], nu=0.38, t=0.2), formulation="consistent")
    model = model.crease("crease", Lstar=Lstar).support("corner:inner-start", "xyz")
    model = model.support("corner:outer-start", "yz").support("edge:inner", "z").support("edge:outer", "z")
    for lift in (0.8, 1.6, 2.4):
        model = model.step(bh.Displace("crease:crease", "z", by=lift))
    return model


def repeats(count: int) -> tuple[list[int], int]:
    """How often E and L* lie in their intervals, of noisy forces and fold angles; and how many solutions that took.

    Args:
        count: of repeats.
    """
    ends = {state.step: state for state in bh.trace(lifted(TRUE[1]), estimate=False).require()}
    force = np.array([ends[k].reaction("crease:crease")[2] for k in sorted(ends)])
    angle = np.array([ends[k].fold_angle("crease").mean() for k in sorted(ends)])
    noise = 0.01 * float(force.mean())
    free = {NAMES[0]: (3000.0, 500.0, 20000.0), NAMES[1]: (30.0, 2.0, 200.0)}
    rng, inside, solved = np.random.default_rng(11), np.zeros(2, dtype=int), 0
    for _ in range(count):
        noisy = force + noise * rng.normal(size=3), angle + 0.003 * rng.normal(size=3)
        data = [
            bh.Measured("reaction_z", noisy[0].tolist(), of="crease:crease", sigma=noise),
            bh.Measured("fold_angle", noisy[1].tolist(), of="crease", sigma=0.003),
        ]
        found = bh.calibrate(lifted(50.0), data, free)
        inside += (found.intervals[:, 0] <= TRUE) & (found.intervals[:, 1] >= TRUE)
        solved += found.solved
    return inside.tolist(), solved
