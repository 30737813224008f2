"""A solved sheet against a point cloud, such as a laser scan of a folded paper model (source 3.4.3).

The scan is brought onto the sheet by a rigid motion: three picked points first, then every point of the cloud is drawn
to the nearest point of the sheet. Points beyond `TRIM` robust standard deviations take no part, so stray points do
not matter, and holes of the scan do not either, because nothing looks for scan points near the sheet. Lengths in mm.

The steps are Gauss-Newton steps of the squared distances (Chen and Medioni 1992: towards the tangent plane; towards the
edge line where the sheet ends). The point-to-point iteration of Besl and McKay (1992), as VTK has it, creeps where the
sheet can slide in itself: see docs/scan.md for the measurement.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.analysis.clouds import IDENTITY, Motion, ScanError, checked
from bh.analysis.nearest import boxes
from bh.formulations.state import State
from meshes.topology import Ints

Array = NDArray[np.float64]
TRIM = 3.0  # robust standard deviations beyond which a scan point is taken for a stray one
COARSE, COARSE_ROUNDS = 4000, 9  # points and rounds before all points take part
COARSE_TRIM = 4.0  # how much wider the trim is then
MOST_ROUNDS = 60
SETTLED = 0.02  # of the standard error: the motion has settled when a step is shorter


# ------------------------------------------------------------------------------------------------- nearest points


class Surface:
    """The triangles of a solved sheet, ready to be asked for nearest points (`bh.analysis.nearest`).

    Args:
        state: the sheet.
    """

    def __init__(self, state: State) -> None:
        """Make the tree of a state."""
        if not (hasattr(state, "points") and hasattr(state, "mesh")):
            raise ScanError(f"a {type(state).__name__} is not a state; give one of a path, such as path[-1]")
        mesh = state.mesh
        self.points: Array = np.asarray(state.points, dtype=float)
        self.triangles: Ints = mesh.triangles
        self._boxes = boxes(self.points, self.triangles)
        sides = mesh.triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)
        alone = mesh.topology.edge_triangles[mesh.topology.find_edges(sides), 1] < 0
        self._free = alone.reshape(-1, 3)  # is the side opposite to each corner an edge of the sheet?

    def nearest(self, points: Array) -> tuple[Array, Ints]:
        """(k, 3) nearest points of the sheet, and the triangles (k,) that they lie on.

        Args:
            points: (k, 3), mm.
        """
        return self._boxes.nearest(points)

    def on_edge(self, found: Array, cells: Ints) -> NDArray[np.bool_]:
        """Whether points lie on an edge of the sheet, to rounding.

        Args:
            found: (k, 3) points of the sheet, mm.
            cells: (k,) the triangles that they lie on.

        Returns:
            (k,) truth values.
        """
        p = self.points[self.triangles[cells]]
        height = np.empty((len(found), 3))  # of the point over each side, relative to the triangle's
        for corner in range(3):
            a, b, c = p[:, corner], p[:, (corner + 1) % 3], p[:, (corner + 2) % 3]
            whole = np.linalg.norm(np.cross(b - a, c - a), axis=1)
            height[:, corner] = np.linalg.norm(np.cross(b - found, c - found), axis=1) / whole
        on: NDArray[np.bool_] = ((height < 1e-6) & self._free[cells]).any(axis=1)
        return on

    def enriched(self, spacing: float) -> Array:
        """Points (k, 3) of the sheet, its nodes among them: edges longer than `spacing` (mm) are halved.

        Raises:
            ScanError: a spacing that cannot be, or that makes too many points.
        """
        if not (math.isfinite(spacing) and spacing > 0.0):
            raise ScanError(f"spacing = {spacing} cannot be; give a positive distance in mm")
        p = self.points[self.triangles]
        area = 0.5 * float(np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum())
        if area / spacing**2 > 2e6:
            raise ScanError(
                f"spacing = {spacing} makes some {4 * area / spacing**2:.1g} points; use a larger one"
            )
        import pyvista as pv

        data = pv.PolyData.from_regular_faces(self.points, self.triangles)
        finer = data.subdivide_adaptive(max_edge_len=spacing, max_tri_area=spacing**2, max_n_passes=30)
        return np.asarray(finer.points, dtype=float)


# ------------------------------------------------------------------------------------------------- registration


@dataclass(frozen=True, eq=False)
class Registration:
    """How a scan was brought onto a sheet.

    Attributes:
        motion: of the scan.
        kept: (k,) points that took part; the others lie beyond `trim` robust standard deviations.
        noise: root mean square distance of the points that took part, normal to the sheet, mm.
        standard_error: (6,) standard errors of translation (mm) and rotation (rad about x, y, z through `centre`), if
            the distances are independent: noise times the root of the diagonal of (J^T J)^-1.
        centre: (3,) mean of the moved points, mm.
        rounds: number of steps.
    """

    motion: Motion
    kept: NDArray[np.bool_]
    noise: float
    standard_error: Array
    centre: Array
    rounds: int


def register(
    cloud: ArrayLike, state: State | Surface, start: Motion = IDENTITY, trim: float = TRIM
) -> Registration:
    """The rigid motion that brings a scan (k, 3) onto a solved sheet, from the initial guess `start`; see the module.

    Args:
        cloud: (k, 3), mm.
        state: the sheet, or its `Surface`.
        start: initial guess of the motion.
        trim: robust standard deviations (1.4826 times the median distance) beyond which a point takes no
            part; infinite for plain least squares, fit for clean clouds that differ from the sheet.

    Raises:
        ScanError: no points, not finite, the sheet can slide in itself (a flat or round one without edges in
            the scan), or no convergence.
    """
    points = checked(cloud, "the scan", 6)
    if not trim >= 1.0:
        raise ScanError(f"trim = {trim} cannot be; give robust standard deviations from 1, such as 3")
    surface = state if isinstance(state, Surface) else Surface(state)
    # a few points, spread over the scan whatever its order, and those too that overstep the edges by some millimetres:
    # they alone draw back a sheet that has slid in itself
    some = points[np.random.default_rng(0).permutation(len(points))[:COARSE]]
    motion, rounds, *_ = _rounds(some, surface, start, COARSE_TRIM * trim, coarse=True)
    motion, more, kept, noise, error, centre = _rounds(points, surface, motion, trim)
    return Registration(motion, kept, noise, error, centre, rounds + more)


@dataclass(frozen=True, eq=False)
class _Fit:
    """The least-squares problem at one motion: unknowns are lengths (a turn is what it moves the rim by)."""

    motion: Motion
    cost: float
    normal: Array
    right: Array
    noise: float
    centre: Array

    def step(self, damping: float) -> Array:
        """Step (6,) with a share of the diagonal added (Levenberg 1944, Marquardt 1963)."""
        matrix = self.normal + damping * np.diag(np.diag(self.normal))
        step: Array = np.linalg.solve(matrix, self.right).astype(float)
        return step

    def in_errors(self, step: Array) -> float:
        """Length of a step in standard errors."""
        return math.sqrt(float(step @ self.normal @ step)) / max(self.noise, 1e-300)


def _rounds(
    points: Array, surface: Surface, motion: Motion, trim: float, coarse: bool = False
) -> tuple[Motion, int, NDArray[np.bool_], float, Array, Array]:
    size = float(np.linalg.norm(np.ptp(surface.points, axis=0)))
    arm = 0.5 * size
    kept = np.zeros(len(points), dtype=bool)
    best: _Fit | None = None
    frozen, damping = False, 0.0
    most = COARSE_ROUNDS if coarse else MOST_ROUNDS
    for number in range(1, most + 1):
        x = motion.apply(points)
        near, cells = surface.nearest(x)
        distance = np.linalg.norm(x - near, axis=1)
        if (
            not frozen
        ):  # strays are chosen anew until the motion has settled, else they could come and go for ever
            kept = distance <= trim * 1.4826 * float(np.median(distance)) + 1e-9 * size
        cost = float((distance[kept] ** 2).sum())
        if frozen and best is not None and cost > best.cost * (1.0 + 1e-12):
            damping = max(
                4.0 * damping, 0.25
            )  # a few points at edges and ridges changed sides: go more slowly
        else:
            fit = _fit(motion, cost, x, near, cells, kept, surface, arm)
            best, damping = fit, 0.25 * damping
        step = best.step(damping)
        largest = float(np.abs(step).max())
        settled = best.in_errors(step) < SETTLED or largest < 1e-9 * size
        if frozen and settled:
            break
        frozen = frozen or best.in_errors(step) < 1.0 or settled or number >= most // 3
        # far from the solution the tangent planes mean little
        step *= min(1.0, 0.1 * size / max(largest, 1e-300))
        motion = Motion.about(best.centre, step[3:] / arm, step[:3]).after(best.motion)
    else:
        if not coarse:
            raise ScanError(
                f"the scan did not settle on the sheet in {most} rounds; pick the points more exactly"
            )
    assert best is not None
    error = np.sqrt(np.diag(np.linalg.inv(best.normal))) * (best.noise / np.repeat((1.0, arm), 3))
    return best.motion, number, kept, best.noise, error, best.centre


def _fit(
    motion: Motion,
    cost: float,
    x: Array,
    near: Array,
    cells: Ints,
    kept: NDArray[np.bool_],
    surface: Surface,
    arm: float,
) -> _Fit:
    rows, right, centre = _equations(x, near, cells, kept, surface)
    rows = rows / np.repeat((1.0, arm), 3)
    normal = rows.T @ rows
    values = np.linalg.eigvalsh(normal)
    if values[0] <= 1e-9 * values[-1]:
        raise ScanError("the scan can slide along the sheet without notice; scan its edges or creases too")
    noise = math.sqrt(float(right @ right) / len(right))
    return _Fit(motion, cost, normal, rows.T @ right, noise, centre)


def _equations(
    x: Array, near: Array, cells: Ints, kept: NDArray[np.bool_], surface: Surface
) -> tuple[Array, Array, Array]:
    """Rows (m, 6) of translation and rotation about the centre (3,), and their right-hand side (m,).

    One row a point, along the normal; beyond an edge of the sheet two, both across that edge.
    """
    gap = x - near
    distance = np.linalg.norm(gap, axis=1)
    corners = surface.points[surface.triangles[cells]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    # outside a ridge the nearest point has no single normal: the gap itself is the direction
    apart = distance > 1e-9 * (1.0 + np.abs(x).max(axis=1))
    direction = np.where(apart[:, None], gap / np.where(apart, distance, 1.0)[:, None], normal)
    beyond = kept & apart & surface.on_edge(near, cells)
    beyond &= np.abs((direction * normal).sum(axis=1)) < 1.0 - 1e-9
    outward = gap - (gap * normal).sum(axis=1)[:, None] * normal
    outward /= np.maximum(np.linalg.norm(outward, axis=1), 1e-300)[:, None]
    direction = np.where(beyond[:, None], normal, direction)
    at = np.vstack((x[kept], x[beyond]))
    along = np.vstack((direction[kept], outward[beyond]))
    right = -(np.vstack((gap[kept], gap[beyond])) * along).sum(axis=1)
    centre = x[kept].mean(axis=0)
    return np.hstack((along, np.cross(at - centre, along))), right, centre


# ------------------------------------------------------------------------------------------------- distances


@dataclass(frozen=True, eq=False)
class Distances:
    """Distances of points to the other set.

    Attributes:
        points: (k, 3), mm.
        values: (k,), mm.
    """

    points: Array
    values: Array

    @property
    def mean(self) -> float:
        """Mean distance, mm."""
        return float(self.values.mean())

    @property
    def median(self) -> float:
        """Median distance, mm."""
        return float(np.median(self.values))

    @property
    def standard_deviation(self) -> float:
        """Standard deviation of the distances about their mean, as the source has it, mm."""
        return float(self.values.std())

    @property
    def max(self) -> float:
        """Largest distance, mm."""
        return float(self.values.max())

    def of(self, which: ArrayLike) -> Distances:
        """Those of some points only, such as `registration.kept`."""
        mask = np.asarray(which)
        return Distances(self.points[mask], self.values[mask])

    def __repr__(self) -> str:
        """One line: "Distances(mean 0.101, median 0.0857, standard deviation 0.0766, max 0.55 mm; 65343 points)"."""
        return (
            f"Distances(mean {self.mean:.3g}, median {self.median:.3g}, standard deviation "
            f"{self.standard_deviation:.3g}, max {self.max:.3g} mm; {len(self.values)} points)"
        )


def distances(
    cloud: ArrayLike,
    state: State | Surface,
    way: Literal["cloud-to-sheet", "sheet-to-cloud"] = "cloud-to-sheet",
    spacing: float = 1.0,
) -> Distances:
    """Distances between a registered scan (k, 3) and a solved sheet, mm.

    Args:
        cloud: (k, 3), registered, mm.
        state: the sheet, or its `Surface`.
        way: "cloud-to-sheet" (the default) is the distance of every scan point to the surface: exact, the
            same for any density of the scan, blind to holes, and sees stray points. "sheet-to-cloud" is the
            source's: from every point of the enriched mesh to the nearest scan point. A hole counts there as
            an error as large as itself, and noise as less than it is, since of many scan points the nearest
            is taken.
        spacing: of the enriched mesh, mm.

    Raises:
        ScanError: an unknown way, or no points.
    """
    points = checked(cloud, "the scan")
    surface = state if isinstance(state, Surface) else Surface(state)
    if way == "cloud-to-sheet":
        return Distances(points, np.linalg.norm(points - surface.nearest(points)[0], axis=1))
    if way != "sheet-to-cloud":
        raise ScanError(f"way '{way}' is not known; use cloud-to-sheet or sheet-to-cloud")
    from scipy.spatial import cKDTree

    enriched = surface.enriched(spacing)
    return Distances(enriched, cKDTree(points).query(enriched)[0])
