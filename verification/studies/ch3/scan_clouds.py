"""Clouds of points as a scanner would give them, and the sheet that they are of (case `scan`)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

import bh
import meshes
from bh.applications import scan

Array = NDArray[np.float64]

NOISE = 0.127  # mm, the scanner's accuracy, taken as the standard deviation of each coordinate
DENSITY = 104.0 / 5.0  # points a mm^2: 10,400 a cm^2, of which the source keeps every fifth
RADIUS, WIDTH, DIHEDRAL = 100.0, 10.0, 0.5 * math.pi
STRAYS, HOLES = 0.05, (4.0, 5.0, 6.0)  # share of the points; radii in mm


def sampled(state: bh.State, density: float, seed: int) -> Array:
    """Points (k, 3) spread evenly at random over a sheet, `density` a mm^2."""
    random = np.random.default_rng(seed)
    p = state.points[state.mesh.triangles]
    area = 0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    count = round(density * float(area.sum()))
    chosen = p[random.choice(len(p), count, p=area / area.sum())]
    u, v = random.random((2, count, 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    points: Array = chosen[:, 0] + u * (chosen[:, 1] - chosen[:, 0]) + v * (chosen[:, 2] - chosen[:, 0])
    return points


def scanned(points: Array, seed: int, strays: float = STRAYS, holes: tuple[float, ...] = HOLES) -> Array:
    """The points as a scanner gives them: noisy, with stray points in and around the sheet's box, and with holes."""
    random = np.random.default_rng(seed)
    centres = points[random.choice(len(points), len(holes), replace=False)]
    seen = points + random.normal(0.0, NOISE, points.shape)
    low, high = points.min(axis=0) - 10.0, points.max(axis=0) + 10.0
    seen = np.vstack((seen, random.uniform(low, high, (round(strays * len(points)), 3))))
    for centre, radius in zip(centres, holes, strict=True):
        seen = seen[np.linalg.norm(seen - centre, axis=1) > radius]
    return random.permutation(seen)


def folded_sector(formulation: str, angle: float, rows: int | None = None) -> bh.State:
    """The annulus sector of App. B with its crease in its plane, folded to a right angle.

    The consistent formulation gets four rows a panel unless told otherwise: the fewer, the farther its free ends stray
    from the cones.
    """
    default, alpha = (4, 4.0) if formulation == "consistent" else (1, 8.0)
    rows = rows or default
    mesh = meshes.structured(meshes.annulus_sector(RADIUS, WIDTH, angle), aspect_ratio=alpha, rows=rows)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), formulation=formulation, contact=False)
    model = model.support("crease:crease", "z").support("rigid-body").fold("crease", to=DIHEDRAL)
    return bh.trace(model)[-1]


def corners(state: bh.State) -> Array:
    """(4, 3) corners of the sheet: what is picked."""
    return state.points[[state.mesh.corners[name] for name in sorted(state.mesh.corners)]]


def truncated_normal() -> tuple[float, float, float]:
    """Root mean square, mean and median of |N(0, 1)| below `bh.scan`'s trim."""
    trim = scan.TRIM
    inside = math.erf(trim / math.sqrt(2.0))
    density = math.exp(-0.5 * trim * trim)
    square = 1.0 - math.sqrt(2.0 / math.pi) * trim * density / inside
    mean = math.sqrt(2.0 / math.pi) * (1.0 - density) / inside
    from scipy.special import erfinv

    return math.sqrt(square), mean, math.sqrt(2.0) * float(erfinv(0.5 * inside))


def rotation_vector(motion: scan.Motion) -> Array:
    """(3,) axis times angle of a rigid motion, rad."""
    from scipy.spatial.transform import Rotation

    vector: Array = Rotation.from_matrix(motion.rotation).as_rotvec()
    return vector
