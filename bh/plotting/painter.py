"""Folded sheets painted without a graphics library: triangles and lines into a picture with a depth for every pixel.

For pictures that have to be there soon: loading VTK and its OpenGL by processor takes 3 s, which is more than most
drawings take to fold; this takes a third of it for two thousand triangles. Light and colours are those of `pictures`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.plotting.camera import Camera
from bh.plotting.charts import INK
from bh.plotting.colouring import BLANK_SHEET, COLOURS, Colouring, shades_of_edges
from bh.plotting.panels import cut_open

if TYPE_CHECKING:
    from bh.formulations.state import State

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
AMBIENT, DIFFUSE = 0.57, 0.47
# intensity, and direction towards the light to the right, to the top and towards the viewer
LIGHTS = ((0.6, (0.0, 0.0, 1.0)), (0.55, (-0.8, 0.9, 0.7)))
SUPER = 2  # pixels each way of the canvas in one of the picture


@dataclass(frozen=True)
class Surface:
    """A surface to be painted.

    Attributes:
        points: (n, 3), mm.
        triangles: (t, 3) of points; shading is smooth where they share some.
        colours: (n, 3) of points, or (k, 3) of a scale where `values` are given, in [0, 1].
        values: (n,) places on the scale, 0 to 1; None where colours are those of points.
    """

    points: Array
    triangles: Ints
    colours: Array
    values: Array | None = None


@dataclass(frozen=True)
class Lines:
    """Lines to be painted.

    Attributes:
        points: (n, 3), mm.
        pairs: (m, 2) of points.
        colours: (n, 3) of points, in [0, 1].
        width: pixels of the picture.
        lift: towards the viewer, mm, so that they win over the surface that they lie in.
    """

    points: Array
    pairs: Ints
    colours: Array
    width: float
    lift: float


def paint(size: tuple[int, int], camera: Camera, surface: Surface, lines: list[Lines]) -> Array:
    """(height, width, 3) picture of a surface and lines on it, on white, values in [0, 1].

    Args:
        size: width and height, pixels.
        camera: that looks at them.
        surface: of the sheet.
        lines: its edges and creases.
    """
    width, height = size
    canvas = _Canvas(SUPER * width, SUPER * height)
    at = _projected(surface.points, camera, canvas)
    canvas.fill(at, surface.triangles, _light(surface, camera), surface.colours, surface.values)
    for each in lines:
        _draw_lines(canvas, _projected(each.points, camera, canvas), each)
    pixels = canvas.image.reshape(height, SUPER, width, SUPER, 3)
    averaged: Array = (
        np.add.reduce([pixels[:, i, :, j] for i in range(SUPER) for j in range(SUPER)]) / SUPER**2
    )
    return averaged


def painted(state: State, colouring: Colouring | None, size: tuple[int, int], camera: Camera) -> Array:
    """(height, width, 3) picture of the sheet alone as `pictures` draws it with VTK, values in [0, 1].

    Args:
        state: whose sheet is painted.
        colouring: of its nodes; None for a sheet of one colour.
        size: width and height, pixels.
        camera: that looks at it.
    """
    from matplotlib import colormaps
    from matplotlib.colors import to_rgb

    nodes, triangles = cut_open(state.mesh)
    points, ink = state.points, np.asarray(to_rgb(INK))
    blank = np.tile(np.asarray(to_rgb(BLANK_SHEET)), (len(nodes), 1))
    if colouring is None:
        sheet = Surface(points[nodes], triangles, blank)
        faint = np.tile(0.75 * np.asarray(to_rgb(BLANK_SHEET)) + 0.25 * ink, (len(points), 1))
    else:
        place = np.clip(colouring.values / colouring.top, 0.0, 1.0)
        scale = colormaps[COLOURS](np.linspace(0.0, 1.0, 256))[:, :3]
        sheet = Surface(points[nodes], triangles, scale, place[nodes])
        faint = shades_of_edges()(place)[:, :3]
    dark = np.tile(ink, (len(points), 1))
    _, height = size
    unit = max(height / 700.0, 0.5)
    mm = 2.0 * camera.half_height / height  # of a pixel
    topology = state.mesh.topology
    lines = [
        Lines(points, topology.edges, faint, 0.6, 0.3 * mm),
        Lines(points, topology.boundary, dark, 1.8 * unit, 0.9 * unit * mm),
        *(
            Lines(points, state.mesh.crease_edges(crease), dark, 4.6 * unit, 2.3 * unit * mm)
            for crease in state.mesh.creases
        ),
    ]
    return paint(size, camera, sheet, lines)


class _Canvas:
    """Colours of pixels, and how near to the viewer what has them is."""

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        self.image = np.ones((height, width, 3), dtype=np.float32)
        self.near = np.full((height, width), -np.inf, dtype=np.float32)

    def fill(self, at: Array, triangles: Ints, light: Array, colours: Array, values: Array | None) -> None:
        """Paint triangles; see `_fill`, which is compiled once for copies of one layout."""
        values = np.empty(0) if values is None else np.array(values, order="C")
        ints = np.array(triangles, dtype=np.int64, order="C")
        floats = (np.array(each, dtype=np.float64, order="C") for each in (light, colours))
        _fill(self.image, self.near, np.array(at, order="C"), ints, *floats, values)


@njit(cache=True, error_model="numpy")
def _fill(image, near, at, triangles, light, colours, values):  # type: ignore[no-untyped-def]
    """Paint triangles (t, 3) of points `at` (n, 3): pixel to the right, pixel down, depth; nearer ones win.

    A pixel has its light, interpolated between points, times its colour: that of points, or with `values` (n,) the one
    at its place, from 0 to 1, on the scale `colours` (k, 3).
    """
    height, width = near.shape
    scaled, last = len(values) > 0, len(colours) - 1
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        ax, ay, bx, by, cx, cy = at[a, 0], at[a, 1], at[b, 0], at[b, 1], at[c, 0], at[c, 1]
        double = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if abs(double) < 1e-9:
            continue
        for y in range(max(int(min(ay, by, cy)), 0), min(int(max(ay, by, cy)) + 1, height)):
            low, high = 0.0, width - 1.0
            # u, v and w of the middles of a row are linear in x; each has to be 0 or more
            v0 = ((0.5 - ax) * (cy - ay) - (cx - ax) * (y + 0.5 - ay)) / double
            w0 = ((bx - ax) * (y + 0.5 - ay) - (0.5 - ax) * (by - ay)) / double
            dv, dw = (cy - ay) / double, -(by - ay) / double
            for start, slope in ((v0, dv), (w0, dw), (1.0 - v0 - w0, -dv - dw)):
                if slope > 0.0:
                    low = max(low, -start / slope)
                elif slope < 0.0:
                    high = min(high, -start / slope)
                elif start < 0.0:
                    high = -1.0
            for x in range(int(np.ceil(low)), int(np.floor(high)) + 1):
                v, w = v0 + x * dv, w0 + x * dw
                u = 1.0 - v - w
                depth = u * at[a, 2] + v * at[b, 2] + w * at[c, 2]
                if depth <= near[y, x]:
                    continue
                near[y, x] = depth
                lit = u * light[a] + v * light[b] + w * light[c]
                place = 0
                if scaled:
                    place = int(np.rint(last * (u * values[a] + v * values[b] + w * values[c])))
                    place = min(max(place, 0), last)
                for k in range(3):
                    colour = (
                        colours[place, k]
                        if scaled
                        else u * colours[a, k] + v * colours[b, k] + w * colours[c, k]
                    )
                    image[y, x, k] = min(max(lit * colour, 0.0), 1.0)


def _projected(points: Array, camera: Camera, canvas: _Canvas) -> Array:
    """(n, 3) pixels to the right and down, and depth towards the viewer in mm."""
    from_centre = points - camera.centre
    pixels = 0.5 * canvas.height / camera.half_height
    return np.column_stack(
        (
            0.5 * canvas.width + pixels * (from_centre @ camera.across),
            0.5 * canvas.height - pixels * (from_centre @ camera.up),
            from_centre @ camera.back,
        )
    )


def _light(surface: Surface, camera: Camera) -> Array:
    """(n,) factors of the colours at points, by Lambert's law, the same for both sides of the sheet."""
    corners = surface.points[surface.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    at_points = np.zeros_like(surface.points)
    for k in range(3):
        np.add.at(at_points, surface.triangles[:, k], normal)
    at_points /= np.maximum(np.linalg.norm(at_points, axis=1, keepdims=True), 1e-300)
    seen = at_points @ np.column_stack((camera.across, camera.up, camera.back))
    seen *= np.where(seen[:, 2:] < 0.0, -1.0, 1.0)
    light = np.full(len(seen), AMBIENT)
    for intensity, towards in LIGHTS:
        direction = np.asarray(towards) / np.linalg.norm(towards)
        light += DIFFUSE * intensity * np.maximum(seen @ direction, 0.0)
    return light


def _draw_lines(canvas: _Canvas, at: Array, lines: Lines) -> None:
    """Each line as a rectangle, longer by half its width at both ends."""
    one, two = at[lines.pairs[:, 0]], at[lines.pairs[:, 1]]
    along = two[:, :2] - one[:, :2]
    along *= 0.5 * SUPER * lines.width / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    across = np.column_stack((-along[:, 1], along[:, 0]))
    corners = np.stack((one, one, two, two), axis=1)
    corners[:, :, :2] += np.stack((across - along, -across - along, along - across, along + across), axis=1)
    corners[:, :, 2] += lines.lift
    first = 4 * np.arange(len(one))[:, None]
    triangles = np.concatenate((first + np.array((0, 1, 2)), first + np.array((0, 2, 3))))
    colours = np.repeat(lines.colours[lines.pairs], 2, axis=1).reshape(-1, 3)
    at = corners.reshape(-1, 3)
    canvas.fill(at, triangles, np.ones(len(at)), colours, None)
