"""Layers of case `contact`: a block, pleats between plates, a crushed corrugation, a carton and a map that open."""

from __future__ import annotations

import math
from pathlib import Path as FilePath

import numpy as np

import bh
import meshes
from bh.analysis.contact import first_contact
from bh.paths.path import Path
from bh.scene.load import load_scene
from bh.solvers.automatic import Automatic
from bh.solvers.load_control import LoadControl
from bh.solvers.walk import Strategy
from verification.framework.checks import CaseResult

EXAMPLES = FilePath(__file__).resolve().parents[3] / "examples"
SHEETS, SIDE, APART, FORCE = 5, 20.0, 1.02, 0.5  # of the block: mm, thicknesses at first, N
THICK = (0.1, 0.2, 0.4)  # mm
TOLERANCE = 0.01
OPENED, PANELS = ("pressed_pleats", "carton", "map"), 4  # examples, and panels of the first
CORNERS, ACROSS = [0, 80, 8, 72], 60.0 * math.sqrt(2.0)  # of the map, and its diagonal, mm
WITHIN = 0.02  # of the diagonal: its creases are turned and its panels stand in wedges at first
CRUSHED, TRAVEL, FINER = "crushed_corrugation", 6.7, 0.005  # example, mm, largest increment beside some 0.02
CLOSE = 0.02  # loads and work of increments a quarter as long
QUARTER = "increments a quarter as long"
SHORT: Strategy = Automatic(LoadControl(first=FINER, largest=FINER))
STACK = "a stack is as high as its sheets are thick"


def block(t: float) -> Path:
    """Loose sheets on each other, the lowest one on a plane, that a force on the uppermost one presses.

    Args:
        t: thickness, mm.
    """
    one = meshes.structured(meshes.strip(SIDE, SIDE, [0.5 * SIDE], "flat"), along=1, rows=1)
    count = len(one.points)
    points = np.vstack([one.points + np.array([0.0, 0.0, APART * t * k]) for k in range(SHEETS)])
    triangles = np.vstack([one.triangles + count * k for k in range(SHEETS)])
    mesh = meshes.SheetMesh(points, triangles)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, nu=0.3, t=t), contact="thickness")
    model = model.support(list(range(count)), "z")
    for k in range(SHEETS):
        model = model.support([count * k], "xy").support([count * k + 1], "y")
    top = list(range(count * (SHEETS - 1), count * SHEETS))
    soft = bh.Tether("all", (1.0, 1.0, 1.0))  # what holds sheets that do not touch yet
    return bh.trace(model.step(bh.Force(top, total=(0.0, 0.0, -FORCE)), soft), warn=False, estimate=False)


def height(path: Path) -> float:
    """Of all middle surfaces, with half a thickness on either side, mm; nan of a path that did not reach its end."""
    if not path.reached:
        return math.nan
    return float(np.ptp(path[-1].points[:, 2])) + path.model.sheet.t


def layers(result: CaseResult) -> None:
    """Heights of stacks, and what the carton and the map open to.

    Args:
        result: to which checks are added.
    """
    for t in THICK:
        _stack(result, "height of five loose sheets that are pressed", block(t), SHEETS)
    paths = {name: bh.trace(load_scene(EXAMPLES / f"{name}.toml").model, warn=False) for name in OPENED}
    pleats, carton, opened = (paths[name] for name in OPENED)
    _stack(result, "height of four pleats between plates", pleats, PANELS)
    result.check(
        "fold angle of an opened carton",
        float(carton[-1].fold_angle("mountain").mean()) if carton.reached else math.nan,
        unit="rad",
        reference=0.5 * math.pi,
        source="four panels of a sleeve are a rectangle",
        tolerance=TOLERANCE,
        params={},
        path=carton,
    )
    a, b, c, d = opened[-1].points[CORNERS]
    result.check(
        "diagonal of a map that was folded twice across",
        float(np.linalg.norm(b - a) + np.linalg.norm(d - c)) / 2.0 if opened.reached else math.nan,
        unit="mm",
        reference=ACROSS,
        source="two squares by two lie flat",
        tolerance=WITHIN,
        params={},
        path=opened,
    )
    result.check(
        "states of layers that meet themselves",
        sum(first_contact(path) is not None for path in paths.values()),
        reference=0.0,
        source="the predicate of bh.contact, which shares nothing with the barrier",
        tolerance=0.0,
        params={"states": sum(len(path) for path in paths.values())},
    )


def _stack(result: CaseResult, quantity: str, path: Path, sheets: int) -> None:
    """The height of so many layers that lie on each other."""
    t = path.model.sheet.t
    result.check(
        quantity,
        height(path),
        unit="mm",
        reference=sheets * t,
        source=STACK,
        tolerance=TOLERANCE,
        params={"t": t},
        path=path,
    )


def crushing(result: CaseResult) -> None:
    """Crush load of a corrugation between plates, and what the plate has done, beside finer increments.

    Args:
        result: to which checks are added.
    """
    model = load_scene(EXAMPLES / f"{CRUSHED}.toml").model
    path = bh.trace(model, warn=False, estimate=False, neighbours=False)
    fine = crush(bh.trace(model, strategy=SHORT, warn=False, estimate=False, neighbours=False))
    found = crush(path)
    for quantity, unit, value, reference, source in (
        ("load that crushes a corrugation", "N", found[0], fine[0], QUARTER),
        ("energy of a crushed corrugation", "N mm", found[1], fine[1], QUARTER),
        ("work of the plate that crushes it", "N mm", found[2], found[1], "what the sheet has gained"),
    ):
        result.check(
            quantity,
            value,
            unit=unit,
            reference=reference,
            source=source,
            tolerance=CLOSE,
            params={"travel": TRAVEL},
            path=path,
        )


def crush(path: Path) -> tuple[float, float, float]:
    """What the plate of the example does to the corrugation; nan where it does not arrive.

    Args:
        path: of the example, folded in its first step and crushed in its second one.

    Returns:
        its load at the end, N, what the sheet has gained and friction used up, and the work of the plate, N mm.
    """
    if not path.reached:
        return math.nan, math.nan, math.nan
    states = [state for state in path if state.step == 1]
    load = np.array([0.0, *(-state.contact_forces["upper"][2] for state in states)])
    folded = next(state for state in reversed(list(path)) if state.step == 0).energy
    work = TRAVEL * float(np.trapezoid(load, [0.0, *(state.lam for state in states)]))
    last = states[-1].energy
    return float(load[-1]), last.total + last.friction - folded.total, work
