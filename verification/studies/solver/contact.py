"""Case `contact`: a strip on two supports that wraps round the cylinder which presses its middle.

Not in the list of cases yet: random scenes with contact of panels and an exact predicate are to come.
"""

from __future__ import annotations

import numpy as np

import bh
import meshes
from bh.mechanics.consistent.system import ConsistentSystem
from bh.paths.path import Path
from verification.framework.checks import CaseResult, Context
from verification.theory.wrapped import wrapped_by

CASE = "contact"
E, T, WIDE, HALF, RADIUS = 4000.0, 0.3, 5.0, 40.0, 60.0  # MPa, mm
TRAVEL = 12.0  # mm
GAPS = (0.2, 0.1, 0.05)  # mm
ALONG = (32, 64, 128)
TOLERANCE = 0.02
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


def read(path: Path) -> tuple[float, float, float]:
    """Deflection of the middle, mm, force of the cylinder, N, and the arm of its force on a half, mm."""
    system, _ = path.solved()
    assert isinstance(system, ConsistentSystem)
    assert system.rigid_contact is not None
    x, nodal = path[-1].points, np.zeros_like(path[-1].points)
    system.rigid_contact.forces(x, 1.0, nodal)
    down = nodal[:, 2]
    arm = float(np.abs(x[:, 0] - HALF) @ down / down.sum())
    middle = path.model.mesh.nodes(f"near:{HALF},{0.5 * WIDE}")
    return -float(x[middle, 2].mean()), -float(path[-1].contact_forces["bar"][2]), arm


def run(context: Context) -> CaseResult:
    """Force and arm at three gaps and three meshes; the finest mesh of each gap is judged."""
    result = CaseResult(
        CASE,
        "A strip that wraps round a cylinder",
        "Are the force of a rigid cylinder, and the place where a strip lifts off it, right?",
        ELASTICA,
    )
    cells = ALONG[:-1] if context.quick else ALONG
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
            ):
                result.check(
                    name, value, unit=unit, reference=right, tolerance=judged, params=params, path=path
                )
    return result
