"""DXF drawings as read, against what ezdxf's own drawing add-on draws: differing pixels are counted."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
import shapely
from ezdxf.addons.drawing.config import BackgroundPolicy, ColorPolicy, Configuration
from ezdxf.addons.drawing.frontend import Frontend
from ezdxf.addons.drawing.matplotlib import MatplotlibBackend
from ezdxf.addons.drawing.properties import RenderContext
from ezdxf.document import Drawing
from ezdxf.filemanagement import new, readfile
from matplotlib.figure import Figure

from meshes.io.dxf import read_dxf

WIDE, HIGH, ZOOM = 120, 80, 5  # mm, mm, pixels a mm


def curves(drawing: Drawing) -> None:
    """An arc, an ellipse's part, a bulged polyline, a circle that is mirrored, a spline.

    No closed spline: the add-on draws periodic ones beyond the domain of their knots, with ends that lie apart.
    """
    space = drawing.modelspace()
    space.add_lwpolyline([(5, 5, 0.0), (60, 5, 0.4), (60, 40, -0.3), (5, 40, 0.0)], format="xyb", close=True)
    space.add_arc((90, 30), 18, 200, 20, dxfattribs={"color": 1})
    space.add_ellipse((90, 60), (22, 6), 0.4, 0.5, 5.0, dxfattribs={"color": 5})
    space.add_circle((-30, 60), 10, dxfattribs={"extrusion": (0, 0, -1), "color": 1})
    space.add_spline([(5, 50), (20, 75), (40, 45), (70, 75)], dxfattribs={"color": 5})


def blocks(drawing: Drawing) -> None:
    """References that are turned, stretched, mirrored, nested and in rows; a layer that is off."""
    inner = drawing.blocks.new("inner")
    inner.add_lwpolyline([(0, 0, 0.0), (12, 0, 0.5), (12, 8, 0.0), (0, 8, 0.0)], format="xyb", close=True)
    inner.add_circle((4, 4), 2.5, dxfattribs={"color": 1})
    outer = drawing.blocks.new("outer", base_point=(3, 2))
    outer.add_blockref("inner", (0, 0), dxfattribs={"rotation": 25})
    outer.add_blockref("inner", (18, 0), dxfattribs={"xscale": -1.4, "yscale": 0.7})
    space = drawing.modelspace()
    space.add_blockref("outer", (20, 15), dxfattribs={"xscale": 1.5, "yscale": 1.5, "rotation": 10})
    space.add_blockref("outer", (90, 55), dxfattribs={"yscale": -1.2})
    rows = {"column_count": 3, "row_count": 2, "column_spacing": 16, "row_spacing": 12, "rotation": 15}
    space.add_blockref("inner", (20, 45), dxfattribs=rows)
    drawing.layers.add("hidden").off()
    space.add_line((0, 0), (120, 80), dxfattribs={"layer": "hidden"})


def ink(drawing: Drawing) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    """(rows, columns) pixels that the add-on draws on, from above, all lines 1.2 mm wide."""
    figure = Figure(figsize=(WIDE * ZOOM / 100, HIGH * ZOOM / 100), dpi=100)
    axes = figure.add_axes((0, 0, 1, 1))
    look = Configuration(
        background_policy=BackgroundPolicy.WHITE,
        color_policy=ColorPolicy.BLACK,
        min_lineweight=1.2 * ZOOM * 72 / 100,
        lineweight_scaling=0.0,
    )
    Frontend(RenderContext(drawing), MatplotlibBackend(axes, adjust_figure=False), config=look).draw_layout(
        drawing.modelspace()
    )
    axes.set_xlim(0, WIDE)
    axes.set_ylim(0, HIGH)
    axes.set_aspect("auto")
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=100)
    file.seek(0)
    shown = matplotlib.image.imread(file)
    assert shown.shape[:2] == (HIGH * ZOOM, WIDE * ZOOM)
    return np.asarray(shown[..., :3].min(axis=-1) < 0.5)


@pytest.mark.parametrize("draw", [curves, blocks])
def test_it_is_what_the_add_on_draws(tmp_path: Path, draw: Callable[[Drawing], None]) -> None:
    """Fewer than 1 % of the inked pixels differ."""
    drawing = new(units=4)
    draw(drawing)
    file = tmp_path / "drawing.dxf"
    drawing.saveas(file)
    found, shown = read_dxf(file), ink(readfile(file))
    y, x = np.mgrid[0 : HIGH * ZOOM, 0 : WIDE * ZOOM]
    pixels = shapely.points((x.ravel() + 0.5) / ZOOM, HIGH - (y.ravel() + 0.5) / ZOOM)
    lines = shapely.union_all([shapely.LineString(s.sample(1e-3) * found.unit) for s in found.strokes])
    wide, thin = (shapely.dwithin(lines, pixels, part).reshape(shown.shape) for part in (1.1, 0.2))
    assert shown.sum() > 1000
    assert (shown & ~wide).sum() < 0.01 * shown.sum()  # nothing is drawn where nothing was read
    assert (thin & ~shown).sum() < 0.01 * thin.sum()  # and nothing was read where nothing is drawn
