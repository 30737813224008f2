"""Strips of case `contact` that meet another one or themselves: pressed by their ends, and a ring squeezed shut.

One half of each is solved, with slopes clamped in the plane of symmetry, and along one edge, so that nothing twists.
The other strip, or the other side of the ring, is there as it is: panels meet panels.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

import bh
import meshes
from bh.mechanics.shared.base_system import SupportedSheet
from bh.paths.path import Path
from verification.framework.checks import CaseResult
from verification.theory.touching import pressed, squeezed

Array = NDArray[np.float64]
E, T, WIDE = 4000.0, 0.3, 5.0  # MPa, mm
EI = E * WIDE * T**3 / 12.0
HALF, BOW, TRAVEL = 40.0, 100.0, 7.2  # mm: half of a strip, its radius, and how far its ends are pressed
RADIUS, FACTOR = 20.0, 2.0  # of the ring: mm; it is squeezed by so many times what brings its sides together
GAPS = (0.2, 0.1, 0.05)  # mm
ALONG = (16, 32, 64)  # cells of a half
TOLERANCE = 0.02
ELASTICA = "elastica that meets its mirror image (verification/theory/touching.py)"


def two_strips(along: int, gap: float) -> Path:
    """Two bowed strips, back to back, whose ends are moved towards each other.

    Args:
        along: cells of a half.
        gap: of contact, mm.
    """
    one = meshes.structured(meshes.strip(HALF, WIDE, [0.5 * WIDE], "flat"), along=along)
    angle, count = one.points[:, 0] / BOW, len(one.points)
    z = 0.51 * gap + BOW * (1.0 - np.cos(angle))
    points = [np.column_stack((BOW * np.sin(angle), one.points[:, 1], sign * z)) for sign in (-1.0, 1.0)]
    mesh = meshes.SheetMesh(np.vstack(points), np.vstack((one.triangles, one.triangles + count)))
    model = bh.Model(mesh, bh.Sheet(E=E, nu=0.0, t=T), formulation="consistent", contact=gap)
    loads = []
    for first, sign in ((0, 1.0), (count, -1.0)):
        middle, end = (first + np.flatnonzero(one.points[:, 0] == x) for x in (0.0, one.points[:, 0].max()))
        edge = first + np.flatnonzero(one.points[:, 1] == 0.0)
        model = model.support(middle.tolist(), "x", clamp=True).support(edge.tolist(), "y", clamp=True)
        loads.append(bh.Displace(end.tolist(), "z", by=sign * TRAVEL))
    return bh.trace(model.step(*loads), warn=False, estimate=False)


def ring(along: int, gap: float) -> Path:
    """A ring that two opposite forces squeeze by more than it takes to bring its sides together.

    Args:
        along: cells of a half.
        gap: of contact, mm.
    """
    pattern = meshes.strip(math.pi * RADIUS, WIDE, [0.5 * WIDE], "flat")
    flat = meshes.structured(pattern, along=along, rows=along // ALONG[0])  # rows count on a curved sheet
    angle = flat.points[:, 0] / RADIUS
    points = np.column_stack((RADIUS * np.sin(angle), flat.points[:, 1], RADIUS * np.cos(angle)))
    mesh = meshes.SheetMesh(points, flat.triangles)
    top, bottom = (np.flatnonzero(np.isclose(points[:, 2], side * RADIUS)) for side in (1.0, -1.0))
    model = bh.Model(mesh, bh.Sheet(E=E, nu=0.0, t=T), formulation="consistent", contact=gap)
    for part in (top, bottom):
        model = model.support(part.tolist(), "x", clamp=True)
    side = np.flatnonzero(np.isclose(angle, 0.5 * math.pi))
    model = model.support(np.flatnonzero(points[:, 1] == 0.0).tolist(), "y", clamp=True)
    model = model.support(side.tolist(), "z")
    force = 0.5 * FACTOR * squeezed(RADIUS, EI)
    push = (
        bh.Force(part.tolist(), total=(0.0, 0.0, sign * force)) for part, sign in ((top, -1.0), (bottom, 1.0))
    )
    return bh.trace(model.step(*push), warn=False, estimate=False)


def pressing(path: Path) -> Array:
    """(n, 3) forces of contact on the nodes of a path's last state, N."""
    system, _ = path.solved()
    assert isinstance(system, SupportedSheet)
    assert system.barrier is not None
    pull = np.zeros_like(path[-1].points)
    system.barrier.forces(path[-1].points, pull)
    return -pull


def read_strips(path: Path) -> tuple[float, float, float]:
    """Where the force of contact on the upper strip acts, mm from its middle, the force, and that on its end, N."""
    upper = slice(len(path[-1].points) // 2, None)
    push = pressing(path)[upper, 2]
    end = abs(float(path[-1].reactions[upper, 2].sum()))
    return float(path[-1].points[upper, 0] @ push / push.sum()), float(push.sum()), end


def read_ring(path: Path) -> float:
    """Force of the lower half of the ring on the upper one, N."""
    return float(pressing(path)[path.model.mesh.points[:, 2] > 1e-9, 2].sum())


def met(result: CaseResult, quick: bool) -> None:
    """Both at three gaps and three meshes; the finest mesh of each gap is judged.

    Args:
        result: to which checks are added.
        quick: without the finest mesh.
    """
    cells = ALONG[:-1] if quick else ALONG
    shut = 0.5 * (FACTOR - 1.0) * squeezed(RADIUS, EI)
    for gap in GAPS:
        for along in cells:
            strips, loop = two_strips(along, gap), ring(along, gap)
            at, force, end = read_strips(strips)
            exact = pressed(end, BOW, HALF, EI)
            for name, value, reference, unit, path in (
                ("half the length along which bowed strips lie on each other", at, exact.flat, "mm", strips),
                ("force between bowed strips that their ends are pressed by", force, end, "N", strips),
                ("force of a squeezed ring on itself", read_ring(loop), shut, "N", loop),
            ):
                result.check(
                    name,
                    value if path.reached else math.nan,
                    unit=unit,
                    reference=reference,
                    source=ELASTICA,
                    tolerance=TOLERANCE if along == cells[-1] else None,
                    params={"gap": gap, "along": along},
                    path=path,
                )
