"""SVG drawings as strokes, parsed by svgelements (transforms, units, styles and `use` resolved there)."""

from __future__ import annotations

import contextlib
import io
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import ParseError

import numpy as np

from meshes.curves import Array
from meshes.errors import FileFormatError
from meshes.io.strokes import Colour, Dash, Stroke, dash_kind

LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
PIXELS = 96.0  # an inch, as CSS has it


def read_svg(path: str | os.PathLike[str]) -> tuple[list[Stroke], float]:
    """The strokes of a file, and millimetres a unit of theirs (y points upwards in them).

    Filled areas without a stroke and texts are no lines. Elements that are not displayed are left out.

    Args:
        path: of the file.

    Raises:
        FileFormatError: the file cannot be read, or is not SVG.
    """
    try:
        text = Path(path).read_bytes()
    except IsADirectoryError as error:
        raise FileFormatError("this is a folder; name an .svg file in it") from error
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise FileFormatError(f"cannot be read ({why}); check the name and rights") from error
    import svgelements as se

    try:
        picture = se.SVG.parse(io.BytesIO(text), ppi=PIXELS, reify=True)
    except ParseError as error:
        raise FileFormatError(f"this is not XML ({error}); save the drawing as SVG again") from error
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError) as error:
        raise FileFormatError(
            f"the SVG cannot be understood ({error}); save it again as plain SVG"
        ) from error
    if b"<svg" not in text and b":svg" not in text:
        raise FileFormatError("the file has no <svg> element; save the drawing as SVG")
    strokes: list[Stroke] = []
    for shape, layer in _shapes(se, picture, ""):
        colour = _colour(shape)
        if colour is None or _hidden(shape):
            continue
        number = len(strokes)
        path_ = se.Path(shape)
        for part, subpath in enumerate(path_.as_subpaths()):
            segments = [s for s in se.Path(subpath) if not isinstance(s, se.Move)]
            segments = [s for s in segments if s.start is not None and s.end is not None and s.start != s.end]
            if segments:
                name = f"'{shape.id}'" if shape.id else f"line {number + 1} ({type(shape).__name__.lower()})"
                if part:
                    name += f", part {part + 1}"
                strokes.append(
                    Stroke(_sampler(se, segments), name, colour, layer, _dash(shape), _opacity(shape))
                )
    # svgelements' own millimetre, so that a drawing in mm comes out exactly
    return strokes, 1.0 / float(se.Length("1mm").value(ppi=PIXELS))


def _shapes(se: Any, group: Any, layer: str) -> Iterator[tuple[Any, str]]:
    """All shapes with the name of the innermost named group around them."""
    for item in group:
        if isinstance(item, se.Shape):
            yield item, layer
        elif isinstance(item, se.Group | se.Use):
            attributes = item.values.get("attributes") or {}
            name = attributes.get(LABEL) or attributes.get("id") or layer
            yield from _shapes(se, item, str(name))


def _hidden(shape: Any) -> bool:
    return str(shape.values.get("visibility", "")) in ("hidden", "collapse") or _opacity(shape) <= 0.0


def _colour(shape: Any) -> Colour | None:
    stroke = shape.stroke
    if stroke is None or stroke.value is None:
        return None
    return int(stroke.red), int(stroke.green), int(stroke.blue)


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


def _sampler(se: Any, segments: list[Any]) -> Any:
    curved = (se.CubicBezier, se.QuadraticBezier, se.Arc)

    def sample(tolerance: float) -> Array:
        points = [np.array([[segments[0].start.x, segments[0].start.y]])]
        for segment in segments:
            if not isinstance(segment, curved):
                points.append(np.array([[segment.end.x, segment.end.y]]))
                continue
            t = np.linspace(0.0, 1.0, _pieces(se, segment, tolerance) + 1)[1:]
            points.append(np.array([[p.x, p.y] for p in map(segment.point, t)]))
            points[-1][-1] = segment.end.x, segment.end.y
        flipped: Array = np.vstack(points) * (1.0, -1.0)
        return flipped

    return sample


@np.errstate(invalid="ignore", over="ignore")  # what is not finite is refused later
def _pieces(se: Any, segment: Any, tolerance: float) -> int:
    """How many chords keep within the tolerance: the error of one is max |c''| / (8 n^2)."""
    if isinstance(segment, se.CubicBezier):
        p = [np.array([q.x, q.y]) for q in (segment.start, segment.control1, segment.control2, segment.end)]
        bend = 6.0 * max(np.linalg.norm(p[0] - 2 * p[1] + p[2]), np.linalg.norm(p[1] - 2 * p[2] + p[3]))
    elif isinstance(segment, se.QuadraticBezier):
        p = [np.array([q.x, q.y]) for q in (segment.start, segment.control, segment.end)]
        bend = 2.0 * np.linalg.norm(p[0] - 2 * p[1] + p[2])
    else:
        bend = max(abs(segment.rx), abs(segment.ry)) * float(segment.sweep) ** 2
    if not np.isfinite(bend):
        return 1
    return int(min(max(np.ceil(np.sqrt(bend / (8.0 * tolerance))), 1 if bend < tolerance else 2), 20_000))
