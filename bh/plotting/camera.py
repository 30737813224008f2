"""Where a folded sheet is seen from: a parallel projection that shows most of its upper side."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pyvista import Plotter

    from bh.formulations.state import State

Array = NDArray[np.float64]


class Camera(NamedTuple):
    """Parallel projection with z up: the picture's unit vectors in space, its centre and half its height, mm."""

    across: Array
    up: Array
    back: Array
    centre: Array
    half_height: float
    depth: float

    def aim(self, plotter: Plotter) -> None:
        """Make a pyvista plotter see the sheet so."""
        plotter.enable_parallel_projection()
        plotter.camera.focal_point = self.centre
        plotter.camera.position = self.centre + 2.0 * self.depth * self.back
        plotter.camera.up = self.up
        plotter.camera.parallel_scale = self.half_height
        plotter.camera.clipping_range = (0.5 * self.depth, 3.5 * self.depth)


def camera_of(
    state: State, aspect: float, view: tuple[float, float] | None, points: Array | None = None
) -> Camera:
    """The camera that fills a picture with the sheet but for a margin, or with all of `points`.

    Args:
        state: of a path.
        aspect: width of the picture over its height.
        view: azimuth and elevation that it looks from, rad; None for `best_view`.
        points: (n, 3) to be seen, mm; None for those of the state.
    """
    across, up, back = viewing_axes(*(view or best_view(state, aspect)))
    to_picture = np.column_stack((across, up, back))
    seen = (state.points if points is None else points) @ to_picture
    low, high = seen.min(axis=0), seen.max(axis=0)
    width, height, _ = (high - low).tolist()
    centre, depth = to_picture @ (0.5 * (low + high)), float(np.linalg.norm(high - low))
    return Camera(across, up, back, centre, 0.54 * max(width / aspect, height), depth)


def best_view(state: State, aspect: float) -> tuple[float, float]:
    """Azimuth and elevation, rad, from where most of the upper side is seen and the picture is filled.

    Args:
        state: of a path.
        aspect: width of the picture over its height.

    Returns:
        the two angles.
    """
    triangles = state.points[state.mesh.triangles]
    doubled = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(doubled, axis=1)
    normal, weight = doubled / area[:, None], area / area.sum()
    if weight @ normal[:, 2] < 0.0:
        normal = -normal
    plan = state.points[:, :2] - state.points[:, :2].mean(axis=0)
    long_axis = np.linalg.eigh(plan.T @ plan)[1][:, 1]
    best, choice = -np.inf, (0.0, 0.0)
    for elevation in np.deg2rad((30.0, 36.0, 42.0, 48.0)):
        for azimuth in np.deg2rad(np.arange(-60.0, 300.0, 10.0)):
            across, up, back = viewing_axes(azimuth, elevation)
            facing = np.log(np.maximum(normal @ back, 0.08))
            extent = max(np.ptp(state.points @ across) / aspect, np.ptp(state.points @ up))
            # along and across the sheet are dull; so is a view from far above
            slanted = abs(2.0 * (long_axis @ across[:2]) * (long_axis @ back[:2]))
            score = float(weight @ facing - 0.8 * np.log(extent) + 0.3 * slanted - 0.6 * elevation)
            if score > best + 1e-9:
                best, choice = score, (float(azimuth), float(elevation))
    return choice


def viewing_axes(azimuth: float, elevation: float) -> tuple[Array, Array, Array]:
    """Unit vectors (3,) of the picture in space: to its right, to its top, and towards the viewer.

    Args:
        azimuth: that it looks from, rad.
        elevation: that it looks from, rad.
    """
    back = np.array(
        (np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation))
    )
    across = np.array((-np.sin(azimuth), np.cos(azimuth), 0.0))
    return across, np.cross(back, across), back
