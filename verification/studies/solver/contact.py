"""Case `contact`: strips on a cylinder and each other, a ring, layers, friction, moulds, sheets whose panels meet.

The strip lies on two supports and is pressed in its middle: force and lift-off by the elastica. Stacks are as high as
their sheets are thick. Scenes are stored one
by one, so a run that was stopped goes on; with BH_CONTACT=50:100 in the environment it plays these and counts all that
are stored.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

import bh
import meshes
from bh.mechanics.consistent.system import ConsistentSystem
from bh.paths.path import Path
from bh.solvers.outcome import Outcome
from verification.framework.checks import CaseResult, Context
from verification.framework.random_scenes import part_of, played
from verification.studies.solver.contact_layers import crushing, layers
from verification.studies.solver.contact_more import more
from verification.studies.solver.contact_scenes import SEED, Row, play
from verification.studies.solver.contact_strips import met
from verification.studies.solver.contact_uses import uses
from verification.theory.wrapped import wrapped_by

CASE = "contact"
E, T, WIDE, HALF, RADIUS = 4000.0, 0.3, 5.0, 40.0, 60.0  # MPa, mm
TRAVEL = 12.0  # mm
GAPS = (0.2, 0.1, 0.05)  # mm
ALONG = (32, 64, 128)
FREE, LEFT_OUT = 1.15, 2.0  # of the arm, mm of the end: between them the strip is free
TOLERANCE = 0.02
SCENES, QUICK, RUNS, PART = 200, 2, "contact_runs.json", "BH_CONTACT"
APART = 0.02  # in parts of the energy
PREDICATE = "the predicate of bh.contact, which shares nothing with the barrier"
ELASTICA = "elastica that wraps round a cylinder (verification/theory/wrapped.py)"


def pressed(along: int, gap: float) -> Path:
    """The path of the strip; its ends slide without friction, its middle stays in the plane of symmetry."""
    mesh = meshes.structured(meshes.strip(2.0 * HALF, WIDE, [0.5 * WIDE], "flat"), along=along)
    model = bh.Model(mesh, bh.Sheet(E=E, nu=0.0, t=T), formulation="consistent")
    model = model.support("edge:start", "z").support("edge:end", "z")
    model = model.support(f"near:{HALF},{0.5 * WIDE}", "xy").support(f"near:0,{0.5 * WIDE}", "y")
    at = (HALF, 0.5 * WIDE, RADIUS + gap)
    size = 2.0 * RADIUS
    bar = bh.Indenter("bar", at, 0.5 * np.pi, size, size, RADIUS, by=(0.0, 0.0, -TRAVEL), gap=gap)
    return bh.trace(model.step(bar), estimate=False)


def lift_off(path: Path, arm: float) -> float:
    """Distance of the lift-off from the middle, mm, by the curvature of the free part: there it reaches the cylinder's.

    That curvature is linear along x (the moment of the support's force), so a line through what is beyond the contact
    says where; points on the cylinder would only tell to a cell.

    Args:
        path: of the strip.
        arm: of the force of the cylinder on one half, mm; what lies well beyond is free.
    """
    x, first = path[-1].points, path.model.mesh.points
    line = np.flatnonzero(np.isclose(first[:, 1], 0.5 * WIDE) & (first[:, 0] >= HALF))
    line = line[np.argsort(first[line, 0])]
    way = np.diff(x[line][:, [0, 2]], axis=0)
    length, slope = np.linalg.norm(way, axis=1), np.arctan2(way[:, 1], way[:, 0])
    curvature = np.diff(slope) / (0.5 * (length[1:] + length[:-1]))
    at = x[line][1:-1, 0] - HALF
    free = (at > FREE * arm) & (at < at.max() - LEFT_OUT)
    return float(np.polyval(np.polyfit(curvature[free], at[free], 1), 1.0 / RADIUS))


def read(path: Path) -> tuple[float, float, float]:
    """Deflection of the middle, mm, force of the cylinder, N, and the arm of its force on a half, mm."""
    system, _ = path.solved()
    assert isinstance(system, ConsistentSystem)
    assert system.outside is not None
    x, nodal = path[-1].points, np.zeros_like(path[-1].points)
    system.outside.forces(x, 1.0, nodal)
    down = nodal[:, 2]
    arm = float(np.abs(x[:, 0] - HALF) @ down / down.sum())
    middle = path.model.mesh.nodes(f"near:{HALF},{0.5 * WIDE}")
    return -float(x[middle, 2].mean()), -float(path[-1].contact_forces["bar"][2]), arm


def wrapping(result: CaseResult, quick: bool) -> None:
    """Force and arm at three gaps and three meshes; the finest mesh of each gap is judged.

    Args:
        result: to which checks are added.
        quick: without the finest mesh.
    """
    cells = ALONG[:-1] if quick else ALONG
    for gap in GAPS:
        for along in cells:
            path = pressed(along, gap)
            deflection, force, arm = read(path)
            exact = wrapped_by(deflection, HALF, RADIUS, E * WIDE * T**3 / 12.0)
            judged = TOLERANCE if along == cells[-1] else None
            params = {"gap": gap, "along": along}
            for name, value, right, unit in (
                ("force of the cylinder", force, exact.force, "N"),
                ("arm of the force", arm, exact.arm, "mm"),
                ("lift-off of the strip", lift_off(path, arm), RADIUS * math.sin(exact.phi), "mm"),
            ):
                result.check(
                    name,
                    value,
                    unit=unit,
                    reference=right,
                    source=ELASTICA,
                    tolerance=judged,
                    params=params,
                    path=path,
                )


def orders(result: CaseResult) -> None:
    """With which power of the gap the errors go, of every quantity that has three gaps, on its finest mesh.

    Args:
        result: to which checks are added.
    """
    names = dict.fromkeys(check.quantity for check in result.checks if "gap" in check.params)
    for name in names:
        found = [check for check in result.checks if check.quantity == name]
        cells = max(check.params["along"] for check in found)
        at = {c.params["gap"]: c.error for c in found if c.params["along"] == cells and c.error}
        if len(at) == len(GAPS):
            widest, least = max(at), min(at)
            order = math.log(at[widest] / at[least]) / math.log(widest / least)
            result.check(f"order in the gap: {name}", order, source="measured", params={"along": cells})


def meeting(result: CaseResult, rows: Sequence[Row]) -> None:
    """What became of the random scenes.

    Args:
        result: to which checks are added.
        rows: one a scene.
    """
    compared = [row for row in rows if math.isfinite(row.apart)]
    params = {"scenes": len(rows), "compared": len(compared), "seed": SEED}
    crossing = [row for row in rows if row.crossing]
    apart = [row for row in compared if row.apart > APART]
    silent = [row for row in apart if not row.told]
    ended = [row for row in rows if row.outcome != Outcome.REACHED]
    unsaid = [row for row in ended if not row.reason]
    result.check(
        "scenes with an accepted state that meets itself",
        len(crossing),
        reference=0.0,
        source=PREDICATE,
        tolerance=0.0,
        params=params,
    )
    result.check(
        "scenes that do not reach and do not say why",
        len(unsaid),
        reference=0.0,
        source="asked for",
        tolerance=0.0,
        params=params,
    )
    result.check(
        "scenes whose energy differs by more than 2 % from finer increments without a remark",
        len(silent),
        reference=0.0,
        source="asked for",
        tolerance=0.0,
        params=params,
    )
    for name, count in (
        ("scenes whose panels press on each other", sum(row.pressed for row in rows)),
        ("scenes that do not reach their end", len(ended)),
        ("scenes whose energy differs by more than 2 % from finer increments", len(apart)),
    ):
        result.check(name, count, source="measured", params=params)
    for row in (*crossing, *ended, *apart):
        told = row.crossing or row.reason or "; ".join(row.told) or "nothing is said"
        result.notes.append(
            f"Scene {row.number}, {row.outcome} ({row.words}), apart by {row.apart:.2%}: {told}."
        )


def run(context: Context) -> CaseResult:
    """The strip, and the scenes that are not stored yet; all that are stored are counted."""
    result = CaseResult(
        CASE,
        "Contact",
        "Are forces of contact right, and does nothing pass through anything?",
        f"{ELASTICA}; {SCENES} random scenes of seed {SEED}",
    )
    wrapping(result, context.quick)
    met(result, context.quick)
    orders(result)
    layers(result)
    if not context.quick:
        crushing(result)
    more(result, context)
    uses(result, context)
    numbers = part_of(PART, QUICK if context.quick else SCENES, SCENES)
    known = played(context, CASE, RUNS, numbers, SCENES, play)
    meeting(result, [Row(**{**row, "told": tuple(row["told"])}) for row in known])
    return result
