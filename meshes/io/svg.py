"""SVG drawings as strokes: the tree of `meshes.io.svg_tree`, its shapes parsed by svgelements, colours by tinycss2."""

from __future__ import annotations

import contextlib
import io
import math
import os
import re
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from typing import Any
from xml.etree.ElementTree import ParseError

import numpy as np

from meshes.curves import Line
from meshes.drawn_curves import Bezier, Chain, EllipseArc, Piece, quadratic
from meshes.errors import FileFormatError
from meshes.io.files import drawing_bytes
from meshes.io.strokes import Colour, Dash, Stroke, Strokes, always, dash_kind, drawn_curve
from meshes.io.svg_tree import CLIP, CLIP_SHAPE, svg_tree
from meshes.limits import check_limit

LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
PIXELS = 96.0  # an inch, as CSS has it
FINE = 2e-5  # of the size of what is clipped
MOST_CROSSINGS, MOST_CROSSED = (
    50,
    2_000,
)  # crossings of a clip path with itself, and points of one that has any
LONGEST_COLOUR = 100  # characters


def read_svg(path: str | os.PathLike[str]) -> Strokes:
    """The strokes of a file (y points upwards in them) and millimetres a unit of theirs.

    Filled areas without a stroke and texts are no lines. Elements that are not displayed are left out; what a clip path
    cuts off is, too.

    Args:
        path: of the file.

    Raises:
        FileFormatError: the file cannot be read, or is not SVG.
    """
    tree = svg_tree(drawing_bytes(path, "SVG"))
    import svgelements as se

    try:
        picture = se.SVG.parse(io.BytesIO(tree.text), ppi=PIXELS, reify=False)
        strokes = list(_strokes(se, picture))
    except FileFormatError:
        raise
    except (
        ArithmeticError,
        AttributeError,
        LookupError,
        RecursionError,
        TypeError,
        ValueError,
        ParseError,
    ) as error:
        raise FileFormatError(
            f"the SVG cannot be understood ({error}); save it again as plain SVG"
        ) from error
    remarks = []
    if tree.illustrator:
        remarks.append(
            "Illustrator's pixels are 1/72 inch, but an SVG file's are 1/96: if the sheet is too small, scale = "
            f"{25.4 / 72.0:.6g} makes it as large as in Illustrator"
        )
    # svgelements' millimetre is 5e-7 off (0.0393701 in): a page in mm comes out exactly by it, one in inches does not
    unit = 1.0 / float(se.Length("1mm").value(ppi=PIXELS)) if tree.metric else 25.4 / PIXELS
    return Strokes(strokes, unit, stated=tree.unit or tree.illustrator, remarks=remarks)


def _strokes(se: Any, picture: Any) -> Iterator[Stroke]:
    number, clipping, pieces = 0, 0, 0
    for shape, layer, clips in _shapes(se, picture, "", ()):
        colour, unknown = _colour(shape)
        if (colour is None and not unknown) or _hidden(shape):
            continue
        parts = list(_segments(se, shape))
        number += bool(parts)
        for part, segments in parts:
            name = f"'{shape.id}'" if shape.id else f"line {number} ({type(shape).__name__.lower()})"
            if part:
                name += f", part {part + 1}"
            curve = _curve(se, segments)
            stroke = Stroke(
                drawn_curve(curve, "a line of this drawing"),
                name,
                colour,
                layer,
                _dash(shape),
                _opacity(shape),
                unknown,
                f"id:{shape.id}" if shape.id else "",
                curve,
            )
            cutting = _cutting(stroke, clips)
            clipping += sum(_vertices(region) for region in cutting)
            check_limit(
                "clip_vertices",
                clipping,
                "this drawing, counted for every line that is cut,",
                FileFormatError,
            )
            left = list(_clipped(stroke, cutting))
            pieces += len(left) if cutting else 0
            check_limit("clips", pieces, "this drawing, once its lines are clipped,", FileFormatError)
            yield from left


def _segments(se: Any, shape: Any) -> Iterator[tuple[int, list[Any]]]:
    """Numbers and segments of the connected parts of a shape; a line is one, without the detour by a path."""
    if not isinstance(shape, se.SimpleLine):
        yield from _parts(se, _placed(se, shape))
        return
    m = shape.transform
    ends = [m.point_in_matrix_space(se.Point(*end)) for end in ((shape.x1, shape.y1), (shape.x2, shape.y2))]
    if ends[0] != ends[1]:
        yield 0, [se.Line(*ends)]


def _placed(se: Any, shape: Any) -> Any:
    """The path of a shape where it lies on the page; arcs that are sheared become Bezier curves before."""
    path = se.Path(shape)
    m = path.transform
    if abs(m.a * m.c + m.b * m.d) > 1e-9 * (m.a**2 + m.b**2 + m.c**2 + m.d**2):
        path.approximate_arcs_with_cubics(0.05)  # pieces of 18 degrees: 2e-8 of the radius off
    return path.reify()


def _parts(se: Any, path: Any) -> Iterator[tuple[int, list[Any]]]:
    """Numbers and segments of the connected parts of a path."""
    subpaths = list(path.as_subpaths())
    for part, subpath in enumerate(subpaths):
        own = path if len(subpaths) == 1 else se.Path(subpath)  # which is a copy
        segments = [s for s in own if not isinstance(s, se.Move)]
        segments = [s for s in segments if s.start is not None and s.end is not None and s.start != s.end]
        if segments:
            yield part, segments


def _shapes(
    se: Any, group: Any, layer: str, clips: tuple[Any, ...]
) -> Iterator[tuple[Any, str, tuple[Any, ...]]]:
    """All shapes, the name of the innermost named group around them, and the regions that clip them."""
    items = list(group)
    if (getattr(group, "values", None) or {}).get("attributes", {}).get(CLIP) and items:
        clips = (*clips, _region(se, items.pop(0)))
    for item in items:
        if isinstance(item, se.Shape):
            yield item, layer, clips
        elif isinstance(item, se.Group | se.Use):
            attributes = item.values.get("attributes") or {}
            name = attributes.get(LABEL) or attributes.get("id") or layer
            yield from _shapes(se, item, str(name), clips)


def _region(se: Any, group: Any) -> Any:
    """The area of the shapes of a clip path, as one polygon of shapely."""
    import shapely

    if not (group.values.get("attributes") or {}).get(CLIP_SHAPE):
        raise FileFormatError("a clip path cannot be understood; release the clipping in the drawing program")
    areas = []
    for shape, _, _ in _shapes(se, group, "", ()):
        path = _placed(se, shape)
        box = path.bbox()
        size = max(box[2] - box[0], box[3] - box[1]) if box is not None else 0.0
        for _, segments in _parts(se, path):
            points = drawn_curve(_curve(se, segments), "a clip path")(max(FINE * size, 1e-12))
            if len(points) > 2:
                areas.append(_area(points))
    region = shapely.union_all(areas)
    shapely.prepare(region)
    return region


def _cutting(stroke: Stroke, clips: tuple[Any, ...]) -> tuple[Any, ...]:
    """The regions that do not hold the whole stroke."""
    return tuple(region for region in clips if not region.covers(_fine(stroke)[0]))


def _fine(stroke: Stroke) -> tuple[Any, float]:
    """A stroke as a line of shapely, and its size, in units of the drawing."""
    import shapely

    size = float(np.ptp(stroke.sample(np.inf), axis=0).max()) or 1.0
    return shapely.LineString(stroke.sample(FINE * size)), size


def _vertices(region: Any) -> int:
    import shapely

    return int(shapely.get_num_coordinates(region))


def _area(points: np.ndarray) -> Any:
    """The area in a closed line of points, (n, 2), also where it crosses itself."""
    import shapely

    area = shapely.Polygon(points)
    if area.is_valid:
        return area
    ring = np.vstack([points, points[:1]])
    pieces = shapely.linestrings(np.stack([ring[:-1], ring[1:]], axis=1))
    if len(pieces) <= MOST_CROSSED:
        first, second = shapely.STRtree(pieces).query(pieces, predicate="intersects")
        if np.count_nonzero(second - first > 1) <= MOST_CROSSINGS:
            return shapely.make_valid(area)
    raise FileFormatError(  # shapely took 29 s for a star of 300 points
        f"a clip path crosses itself more than {MOST_CROSSINGS} times; release the clipping in the drawing program"
    )


def _clipped(stroke: Stroke, clips: tuple[Any, ...]) -> Iterator[Stroke]:
    """What the regions leave of a stroke: itself where they cut nothing off."""
    import shapely

    if not clips:
        yield stroke
        return
    whole, size = _fine(stroke)
    left = whole
    for region in clips:
        left = left.intersection(region.buffer(1e-6 * size))
    if left.length >= (1.0 - 1e-6) * whole.length:
        yield stroke
        return
    left = shapely.line_merge(left) if left.geom_type == "MultiLineString" else left
    for number, piece in enumerate(getattr(left, "geoms", [left])):
        if piece.geom_type == "LineString" and piece.length > 0.0:
            points = np.asarray(piece.coords)
            name = stroke.name + (f", clipped part {number + 1}" if number else ", clipped")
            yield replace(stroke, sample=always(points), name=name, curve=None)


def _hidden(shape: Any) -> bool:
    return str(shape.values.get("visibility", "")) in ("hidden", "collapse") or _opacity(shape) <= 0.0


def _colour(shape: Any) -> tuple[Colour | None, str]:
    """The colour of a line, None where it has no line; and what its colour says where that is not understood."""
    word = str(shape.values.get("stroke") or "none").replace("!important", "").strip()
    if word.lower() in ("none", "transparent"):
        return None, ""
    if word.lower() == "currentcolor":
        word = str(shape.values.get("color") or "black")
    return _colour_of(word)


@lru_cache(maxsize=1000)  # drawings have few colours and many lines
def _colour_of(word: str) -> tuple[Colour | None, str]:
    from tinycss2 import color5

    if len(word) > LONGEST_COLOUR:
        return None, word[:LONGEST_COLOUR] + "..."
    found = color5.parse_color(word)
    try:
        red, green, blue, alpha = found.to("srgb")
    except (
        AttributeError,
        NotImplementedError,
    ):  # nothing that is a colour, or one of a space without a formula
        return None, word
    if alpha <= 0.0:
        return None, ""
    red, green, blue = (round(255.0 * min(max(float(part), 0.0), 1.0)) for part in (red, green, blue))
    return (red, green, blue), ""


def _opacity(shape: Any) -> float:
    total = 1.0
    for key in ("opacity", "stroke-opacity"):
        word = str(shape.values.get(key, "") or "")
        with contextlib.suppress(ValueError):
            total *= float(word[:-1]) / 100.0 if word.endswith("%") else float(word or 1.0)
    return min(max(total, 0.0), 1.0)


def _dash(shape: Any) -> Dash:
    words = re.split(r"[\s,]+", str(shape.values.get("stroke-dasharray") or "").strip())
    try:
        return dash_kind([float(re.sub(r"[a-z%]+$", "", word)) for word in words if word and word != "none"])
    except ValueError:
        return "solid"


def _curve(se: Any, segments: list[Any]) -> Chain:
    """The segments of a path, y upwards."""
    return Chain(tuple(_piece(se, segment) for segment in segments))


def _piece(se: Any, segment: Any) -> Piece:
    if isinstance(segment, se.CubicBezier):
        ends = (segment.start, segment.control1, segment.control2, segment.end)
        a, b, c, d = (_up(point) for point in ends)
        return Bezier((a, b, c, d))
    if isinstance(segment, se.QuadraticBezier):
        return quadratic(*(_up(point) for point in (segment.start, segment.control, segment.end)))
    if isinstance(segment, se.Arc):
        centre, u, v = (_up(point) for point in (segment.center, segment.prx, segment.pry))
        half = (u[0] - centre[0], u[1] - centre[1]), (v[0] - centre[0], v[1] - centre[1])
        start = float(segment.get_start_t())
        ellipse = EllipseArc(centre, *half, start, float(segment.sweep))
        # svgelements mirrors v where the sweep runs from u away from it
        off = [
            math.dist(ellipse.at(np.array([part]))[0], _up(end))
            for part, end in ((0.0, segment.start), (1.0, segment.end))
        ]
        if max(off) > 1e-6 * max(math.hypot(*half[0]), math.hypot(*half[1])):
            ellipse = replace(ellipse, v=(-half[1][0], -half[1][1]))
        return ellipse
    return Line(_up(segment.start), _up(segment.end))


def _up(point: Any) -> tuple[float, float]:
    return float(point.x), -float(point.y)
