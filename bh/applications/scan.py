"""Compare a solved sheet with a scan: `bh.scan.read_cloud`, `picked`, `register`, `distances`, `compare`, `picture`.

The parts are in `bh.analysis.clouds` and `bh.analysis.scan`; here is what puts them together, and the picture.
See docs/scan.md.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.analysis.clouds import IDENTITY, Motion, ScanError, align, picked, read_cloud
from bh.analysis.scan import TRIM, Distances, Registration, Surface, distances, register
from bh.formulations.state import State
from bh.plotting.offscreen import PlotError, render
from meshes.io.export import replacing

__all__ = [
    "IDENTITY", "TRIM", "Comparison", "Distances", "Motion", "Registration", "ScanError", "Surface", "align", "compare",
    "distances", "picked", "picture", "read_cloud", "register",
]  # fmt: skip


@dataclass(frozen=True, eq=False)
class Comparison:
    """A scan on a sheet.

    Attributes:
        state: the sheet.
        registration: how the scan was moved.
        cloud_to_sheet: distances of all scan points to the surface;
            `.of(registration.kept)` leaves stray points out, but also places where the sheet is really elsewhere.
        sheet_to_cloud: the source's distances, of the enriched mesh to the nearest scan point.
    """

    state: State
    registration: Registration
    cloud_to_sheet: Distances
    sheet_to_cloud: Distances

    @property
    def strays(self) -> int:
        """How many scan points lie too far from the sheet to take part."""
        return int((~self.registration.kept).sum())


def compare(
    cloud: ArrayLike, state: State, start: Motion = IDENTITY, spacing: float = 1.0, trim: float = TRIM
) -> Comparison:
    """Register a scan (k, 3) on a solved sheet from the first guess `start` and measure the distances both ways.

    Args:
        start: of `picked`, or of an earlier registration.
        spacing: of the enriched mesh, mm.
        trim: see `register`.

    Raises:
        ScanError: see `register` and `distances`.
    """
    surface = Surface(state)
    found = register(cloud, surface, start, trim)
    moved = found.motion.apply(cloud)
    return Comparison(
        state,
        found,
        distances(moved, surface),
        distances(moved, surface, "sheet-to-cloud", spacing),
    )


def picture(
    measured: Distances,
    file: str | os.PathLike[str],
    top: float | None = None,
    caption: str | bool = True,
    size: tuple[int, int] = (1200, 900),
) -> FilePath:
    """Write a picture of measured points coloured by their distance, without a window.

    Args:
        file: to write, .png; appears whole or not at all.
        top: distance where the colours end, mm; the 99.5th percentile if None.
        caption: a line of text; True for mean, median, standard deviation and maximum.

    Raises:
        PlotError: not a .png, a size or top that cannot be, or no library to draw with.
    """
    target = FilePath(file)
    if target.suffix.lower() != ".png":
        raise PlotError(f"picture '{target}' is not a .png file; name it so")
    if not (160 <= size[0] <= 8000 and 120 <= size[1] <= 8000):
        raise PlotError(f"picture size {size[0]} x {size[1]} cannot be; give 160 x 120 to 8000 x 8000 pixels")
    if top is None:
        top = max(float(np.quantile(measured.values, 0.995)), 1e-12)
    if not (np.isfinite(top) and top > 0.0):
        raise PlotError(f"top = {top} cannot be; give a distance in mm")
    foot = 120
    image = _image(measured, top, (size[0], max(size[1] - foot - 60, 60)))
    title = repr(measured)[len("Distances(") : -1] if caption is True else (caption or "")
    figure = _framed(image, size, foot, title, top, bool(measured.values.max() > top))
    with replacing(target) as temporary:
        figure.savefig(temporary, format="png", dpi=100, metadata={"Software": None})
    return target.resolve()


def _image(measured: Distances, top: float, size: tuple[int, int]) -> NDArray[np.float64]:
    """(height, width, 3) picture of the points, seen from where they spread most."""
    points = measured.points
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    _, axes = np.linalg.eigh(np.cov((points - points.mean(axis=0)).T))
    normal, wide = axes[:, 0] * np.sign(axes[2, 0] or 1.0), axes[:, 2]
    # from 35 degrees over the plane of largest extent, a little to the side
    back = 0.75 * normal - 0.6 * np.cross(normal, wide) + 0.25 * wide
    back /= np.linalg.norm(back)
    across = np.cross(normal, back)
    across /= np.linalg.norm(across)
    up = np.cross(back, across)
    seen = (points - centre) @ np.column_stack((across, up))
    half = 0.54 * max(np.ptp(seen[:, 0]) * size[1] / size[0], np.ptp(seen[:, 1]))
    centre = centre + (0.5 * (seen.min(axis=0) + seen.max(axis=0))) @ np.vstack((across, up))
    depth = float(np.linalg.norm(np.ptp(points, axis=0)))
    # twice the pixels that a point has for itself (`render` draws at twice the size), so that surfaces look closed
    own = float(np.prod(np.ptp(seen, axis=0))) / len(points)
    dot = min(max(2.4 * np.sqrt(own) * 0.5 * size[1] / half, 4.0), 24.0)

    def draw(plotter: Any) -> None:
        import pyvista as pv

        plotter.add_mesh(
            pv.PolyData(points), scalars=measured.values, clim=(0.0, top), cmap="viridis", lighting=False,
            point_size=dot, render_points_as_spheres=False, show_scalar_bar=False,
        )  # fmt: skip
        plotter.set_background("white")
        plotter.enable_parallel_projection()
        plotter.camera.focal_point = centre
        plotter.camera.position = centre + 2.0 * depth * back
        plotter.camera.up = up
        plotter.camera.parallel_scale = half
        plotter.camera.clipping_range = (0.5 * depth, 3.5 * depth)

    return render(size, draw)


def _framed(
    image: NDArray[np.float64], size: tuple[int, int], foot: int, title: str, top: float, cut: bool
) -> Any:
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    width, height = size
    figure = Figure(figsize=(width / 100, height / 100), dpi=100, facecolor="white")
    figure.figimage(image, 0, foot, origin="upper", zorder=-1)
    figure.text(0.03, 1.0 - 24 / height, title, ha="left", va="top", fontsize=14.0)
    axes = figure.add_axes((0.03, 50 / height, 0.4, 16 / height))
    colours = ScalarMappable(Normalize(0.0, top), colormaps["viridis"])
    figure.colorbar(colours, cax=axes, orientation="horizontal", extend="max" if cut else "neither")
    axes.tick_params(labelsize=13.0)
    axes.set_title("distance, mm", loc="left", fontsize=14.0)
    return figure
