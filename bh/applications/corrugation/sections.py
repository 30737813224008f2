"""Second moments of area of a folded corrugation, from its sections and from its creases (source 4.4)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.observables import crease_nodes
from bh.runtime.one_line import OneLine

if TYPE_CHECKING:
    from bh.applications.corrugation.folded import Folded

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Sections(OneLine):
    """Second moments of the sections across a span.

    Attributes:
        azimuth: of the axis that bending is about, in the plane of the sections, rad from the x axis.
        at: (k,) where the planes cut, from the middle, mm.
        moment: (k,) second moments, mm^4.
        area: (k,) of the sheet cut by each plane, mm^2.
    """

    azimuth: float
    at: Array
    moment: Array
    area: Array

    def mean(self, part: float = 0.8) -> float:
        """Mean second moment over the central `part` of the span, mm^4."""
        span = self.at[-1] + self.at[0], self.at[-1] - self.at[0]
        inside = np.abs(self.at - 0.5 * span[0]) <= 0.5 * part * span[1] * (1.0 + 1e-12)
        return float(self.moment[inside].mean())


def rectangles(segments: Array, thickness: float) -> tuple[float, float]:
    """Second moment (mm^4) about the horizontal axis through its centroid, and area (mm^2), of thin rectangles.

    Eq. 4.6 with half the dihedral angle the slope from the vertical, I = s t / 12 (s^2 cos^2 + t^2 sin^2) with
    s cos the height of a rectangle, and the parallel axis theorem.

    Args:
        segments: (k, 2, 2) ends (along the section, height) of the middle line of each rectangle, mm.
        thickness: of the sheet, mm.

    Returns:
        the second moment and the area.
    """
    if len(segments) == 0:
        return 0.0, 0.0
    step = segments[:, 1] - segments[:, 0]
    s = np.hypot(step[:, 0], step[:, 1])
    area = s * thickness
    height = segments[:, :, 1].mean(axis=1)
    steep = np.divide(step[:, 1], s, out=np.zeros_like(s), where=s > 0.0) ** 2
    own = s * thickness / 12.0 * (s**2 * steep + thickness**2 * (1.0 - steep))
    total = float(area.sum())
    if total == 0.0:
        return 0.0, 0.0
    axis = float(area @ height) / total
    return float((own + area * (height - axis) ** 2).sum()), total


def section_moments(folded: Folded, azimuth: float, count: int = 100) -> Sections:
    """Second moments of sections by vertical planes that contain the axis, evenly over the span (top-down, 4.4.1).

    Args:
        folded: the corrugation.
        azimuth: of the axis that bending is about, from x, rad: the planes are parallel to it, the span
            across.
        count: of planes; each in the middle of its part of the span.

    Raises:
        ModelError: less than two planes.
    """
    import pyvista as pv

    if count < 2:
        raise ModelError(f"count = {count} sections cannot be; give at least 2")
    points, triangles = folded.points, folded.mesh.triangles
    along = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    across = np.array([-along[1], along[0], 0.0])
    s = points @ across
    low, high = float(s.min()), float(s.max())
    at = low + (high - low) * (np.arange(count) + 0.5) / count
    surface = pv.PolyData(points, np.column_stack((np.full(len(triangles), 3), triangles)))
    moments, areas = np.zeros(count), np.zeros(count)
    for k, place in enumerate(at):
        lines = _cut(surface, across, float(place), 1e-9 * (high - low))
        flat = np.stack((lines @ along, lines[..., 2]), axis=-1)
        moments[k], areas[k] = rectangles(flat, folded.sheet.t)
    return Sections(azimuth, at - 0.5 * (low + high), moments, areas)


def _cut(surface: object, normal: Array, place: float, shift: float) -> Array:
    """(k, 2, 3) segments in which a vertical plane cuts a surface; beside an edge that lies in the plane."""
    cut = surface.slice(normal=normal, origin=(place + shift) * normal)  # type: ignore[attr-defined]
    if cut.n_cells == 0:
        return np.zeros((0, 2, 3))
    cells = np.asarray(cut.lines).reshape(-1, 3)[:, 1:]
    return np.asarray(np.asarray(cut.points, dtype=float)[cells])


def top_down(folded: Folded, azimuth: float, count: int = 100, part: float = 0.8) -> float:
    """Mean second moment over the central `part` of the span for bending about an axis, mm^4 (4.4.1).

    Args:
        folded: the corrugation.
        azimuth: of the axis from x, rad.
        count: of planes.
        part: of the span, 0 to 1.
    """
    return section_moments(folded, azimuth, count).mean(part)


@dataclass(frozen=True, eq=False, repr=False)
class BottomUp(OneLine):
    """Second moments of unit sections at the bars of the mountain creases (4.4.2).

    Attributes:
        at: (k, 3) middle of each bar, mm.
        tangent: (k,) azimuth of the crease there, rad.
        weight: (k,) length of the bar over that of all.
        moment: (k,) I_L + I_R, mm^4, not weighted.
        skipped: bars without a valley on both sides in their plane.
    """

    at: Array
    tangent: Array
    weight: Array
    moment: Array
    skipped: int

    @property
    def x(self) -> float:
        """I_x^loc, mm^4 (Eq. 4.18): for bending about x."""
        return float(np.abs(self.weight * self.moment * np.sin(self.tangent)).sum())

    @property
    def y(self) -> float:
        """I_y^loc, mm^4 (Eq. 4.19): for bending about y."""
        return float(np.abs(self.weight * self.moment * np.cos(self.tangent)).sum())

    def about(self, azimuth: float) -> float:
        """Second moment for bending about any axis, mm^4 (Eq. 4.20, by symmetry); azimuth from x, rad."""
        return self.x * abs(math.cos(azimuth)) + self.y * abs(math.sin(azimuth))


def bottom_up(folded: Folded, restrained: NDArray[np.bool_] | None = None) -> BottomUp:
    """Unit sections at every bar of the mountain creases (Eq. 4.17): to the valleys or edges on either side.

    The section is in the vertical plane across the bar through its middle; S_L and S_R go from there to where the plane
    meets the next valley crease or edge of the sheet on that side.

    Args:
        folded: the corrugation.
        restrained: (n,) nodes that rest on supports; bars between two of them are left out.

    Raises:
        ModelError: no bar of a mountain crease has a valley on both sides.
    """
    points, mesh = folded.points, folded.mesh
    valleys = [
        mesh.edge_sets[name] for name in mesh.edge_sets if not _mountain(mesh.folds.get(name[7:]), name)
    ]
    lower = np.vstack(valleys)
    crease_nodes(mesh, "mountain")  # or says what is missing
    rows: list[tuple[Array, float, float, float]] = []
    skipped = 0
    for name in mesh.creases:
        if mesh.folds[name] != "mountain":
            continue
        for a, b in mesh.crease_edges(name):
            if restrained is not None and restrained[a] and restrained[b]:
                continue
            bar = points[b] - points[a]
            middle = 0.5 * (points[a] + points[b])
            sides = _sides(points, lower, middle, bar)
            if sides is None:
                skipped += 1
                continue
            moment = sum(_unit(side, folded.sheet.t) for side in sides)
            rows.append((middle, math.atan2(bar[1], bar[0]), float(np.linalg.norm(bar)), moment))
    if not rows:
        raise ModelError("no bar of a mountain crease has a valley on both sides")
    length = np.array([row[2] for row in rows])
    return BottomUp(
        np.array([row[0] for row in rows]),
        np.array([row[1] for row in rows]),
        length / length.sum(),
        np.array([row[3] for row in rows]),
        skipped,
    )


def _mountain(fold: str | None, name: str) -> bool:
    return name.startswith("crease:") and fold == "mountain"


def _unit(side: Array, t: float) -> float:
    """Second moment of a sheet section S (3,) from a mountain down to a valley, about the level axis (Eq. 4.6)."""
    s2, drop2 = float(side @ side), float(side[2] ** 2)
    cosine2 = drop2 / s2
    return math.sqrt(s2) * t / 12.0 * (s2 * cosine2 + t**2 * (1.0 - cosine2))


def _sides(points: Array, lower: NDArray[np.int64], middle: Array, bar: Array) -> tuple[Array, Array] | None:
    """(3,) vectors from the middle of a bar to the nearest valley or edge in its normal plane, left and right."""
    normal = np.array([bar[0], bar[1], 0.0])
    normal /= np.linalg.norm(normal)
    left = np.array([-normal[1], normal[0], 0.0])
    p, q = points[lower[:, 0]] - middle, points[lower[:, 1]] - middle
    a, b = p @ normal, q @ normal
    cut = (a * b <= 0.0) & (a != b)
    part = (a[cut] / (a[cut] - b[cut]))[:, None]
    met = (1.0 - part) * p[cut] + part * q[cut]
    where = met @ left
    found = []
    for side in (1.0, -1.0):
        there = np.flatnonzero(side * where > 1e-9)
        if len(there) == 0:
            return None
        found.append(met[there[np.argmin(side * where[there])]])
    return found[0], found[1]
