"""Crease patterns of ORIPA and Oriedita: .cp (a line each: kind and two points) and .opx (Java beans in XML).

Both have no unit and count y downwards, as the screen does: 1 is the rim, 2 a mountain, 3 a valley, 4 an auxiliary
line.
"""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from xml.etree import ElementTree

import numpy as np

from meshes.errors import FileFormatError
from meshes.io.files import drawing_bytes
from meshes.io.strokes import Colour, Stroke, Strokes, always
from meshes.limits import check_limit

COLOURS: dict[int, Colour | None] = {
    0: (255, 255, 255),  # auxiliary
    1: None,  # the rim
    2: (255, 0, 0),
    3: (0, 0, 255),
    4: (255, 255, 255),
}
Row = tuple[int, float, float, float, float]


def read_cp(path: str | os.PathLike[str]) -> Strokes:
    """The lines of a .cp file, in its own units.

    Raises:
        FileFormatError: it cannot be read; the message names the line.
    """
    text = drawing_bytes(path, "CP").decode("utf-8", errors="replace")
    check_limit("entities", text.count("\n"), "this pattern", FileFormatError)
    return _strokes(_cp_rows(text))


def _cp_rows(text: str) -> Iterator[Row]:
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split()
        if not words:
            continue
        try:
            kind, a, b, c, d = words[:5]
            yield int(kind), float(a), float(b), float(c), float(d)
        except ValueError as error:
            raise FileFormatError(
                f"line {number} is not a kind and two points (1 -200 -200 200 -200); save the pattern again"
            ) from error


def read_opx(path: str | os.PathLike[str]) -> Strokes:
    """The lines of an .opx file, in its own units.

    Raises:
        FileFormatError: it cannot be read, or holds no lines.
    """
    try:
        root = ElementTree.parse(io.BytesIO(drawing_bytes(path, "OPX"))).getroot()
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise FileFormatError(f"this is not XML ({error}); save the pattern again") from error
    rows: list[Row] = []
    for item in root.iter("object"):
        if not str(item.get("class", "")).endswith("OriLineProxy"):
            continue
        values = {str(void.get("property")): _value(void) for void in item.findall("void")}
        a, b, c, d = (values.get(key, 0.0) for key in ("x0", "y0", "x1", "y1"))
        rows.append((int(values.get("type", 0.0)), a, b, c, d))
    if not rows:
        raise FileFormatError("the file holds no lines (OriLineProxy); save the pattern again")
    return _strokes(iter(rows))


def _value(void: ElementTree.Element) -> float:
    text = "".join(void.itertext()).strip()
    try:
        return float(text)
    except ValueError as error:
        raise FileFormatError(
            f"{void.get('property')} = '{text[:40]}' is no number; save the pattern again"
        ) from error


def _strokes(rows: Iterator[Row]) -> Strokes:
    strokes = []
    for number, (kind, a, b, c, d) in enumerate(rows, start=1):
        if kind not in COLOURS:
            raise FileFormatError(
                f"line {number} is of kind {kind}; use 1 (rim), 2 (mountain), 3 (valley) or 4"
            )
        points = np.array([[a, -b], [c, -d]])
        if np.array_equal(points[0], points[1]):
            continue
        strokes.append(Stroke(always(points), f"line {number}", COLOURS[kind]))
    if not strokes:
        raise FileFormatError("there is no line in the file; draw the creases first")
    return Strokes(strokes, 1.0, stated=False)
