"""Flat patterns as SVG and DXF, for laser cutters and other programs; `meshes.io.read_pattern` reads them.

One layer a kind of line: "boundary", "cut", "mountain", "valley", "flat" and "facet", or the layers of the
drawing. Arcs stay arcs, ellipses ellipses, and splines splines, so that what is read back is the same pattern.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from meshes.curves import Arc, Curve, Line, Polyline, sample
from meshes.drawn_curves import Bezier, Chain, EllipseArc, Piece, chain_of, lines_through
from meshes.errors import FileFormatError
from meshes.io.cutting import check_cutting, kerfed, perforated
from meshes.io.export import replacing, shown
from meshes.io.flat_lines import FlatLine, flat_lines
from meshes.io.strokes import Rules, Stroke, always, dash_kind, parse_colour
from meshes.mesh import SheetMesh
from meshes.pattern import CreasePattern

MARGIN = 5.0  # mm of paper round the sheet
HAIRLINE = 0.1  # mm
NEAR = 1e-8  # mm that a written polyline may stay off its points
OWN = 1e-4  # mm that chords may stay off a curve that has no pieces
TEXT = 3.0  # height of notes, mm
UNITS = {"mm": (1.0, 4), "in": (25.4, 1)}  # mm, number of $INSUNITS
HALF = 0.35  # rad about half a turn, where the centre of an arc does not follow from its ends
# what a line looks like: colour, dashes and gaps in mm, number of DXF's palette
LOOKS: dict[str, tuple[str, tuple[float, ...], int]] = {
    "boundary": ("#000000", (), 7),
    "cut": ("#00ff00", (), 3),
    "mountain": ("#ff0000", (6.0, 1.5, 1.0, 1.5), 1),
    "valley": ("#0000ff", (3.0, 1.5), 5),
    "flat": ("#ff00ff", (1.0, 1.5), 6),
    "facet": ("#ffff00", (), 2),
    "pinch": ("#00aaaa", (), 4),
}
NOTES = "angles"  # the layer of notes


@dataclass(frozen=True)
class Note:
    """A text beside a line, such as a fold angle; readers of patterns leave it out.

    Attributes:
        text: of one line.
        at: where it begins, mm.
    """

    text: str
    at: tuple[float, float]


def write_pattern(
    path: str | os.PathLike[str],
    sheet: CreasePattern | SheetMesh | Sequence[FlatLine],
    *,
    facets: bool = False,
    perforate: tuple[float, float] | None = None,
    kerf: float = 0.0,
    units: Literal["mm", "in"] = "mm",
    angle_layers: bool = False,
    notes: Sequence[Note] = (),
) -> None:
    """Write the flat pattern to an .svg or .dxf file.

    Creases are drawn dashed (mountain dash-dot, valley dashed) by the style of their lines. The file appears whole or
    not at all.

    Args:
        path: of the file; its suffix decides the format.
        sheet: a pattern, a flat mesh (drawn along its edges), or lines such as those of a drawing (`drawn_lines`).
        facets: also the lines along which the sheet does not fold (drawn rulings; the inner edges of a mesh).
        perforate: lengths (cut, left) in mm: creases are cut up into dashes of that length, as many machines
            ignore the style of a line. Read back, the dashes are creases again, from end to end.
        kerf: width of the beam, mm: outline and holes are moved by half of it, into what falls away. Open cuts stay.
        units: of the file.
        angle_layers: creases with a fold angle lie on layers such as "mountain 62.5deg", from which it is read back.
        notes: texts, on a layer of their own.

    Raises:
        FileFormatError: another suffix or unit, a mesh that is not flat, lengths that cannot be, an outline that is
            not closed with a kerf, a place that cannot be written to.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".svg", ".dxf"):
        raise FileFormatError(f"{shown(path)}: suffix '{suffix}' is no drawing; use .svg or .dxf")
    if units not in UNITS:
        raise FileFormatError(f"{shown(path)}: units = '{units}' are not known; use mm or in")
    try:
        check_cutting(perforate, kerf)
        lines = flat_lines(sheet) if isinstance(sheet, CreasePattern | SheetMesh) else list(sheet)
        lines = [line for line in lines if facets or line.layer != "facet"]
        if kerf:
            lines = kerfed(lines, kerf)
    except FileFormatError as error:
        raise FileFormatError(f"{shown(path)}: {error}") from error
    if perforate is not None:
        lines = list(perforated(lines, *perforate))
    named = list(zip(_layers(lines, angle_layers), lines, strict=True))
    (_write_svg if suffix == ".svg" else _write_dxf)(path, named, notes, units)


def _layers(lines: Sequence[FlatLine], angle_layers: bool) -> list[str]:
    """Names of the layers: those of the drawing where they are read back as what the lines are."""
    kinds: dict[str, set[str]] = {}
    for line in lines:
        kinds.setdefault(line.own_layer, set()).add(line.layer)
    found = []
    for line in lines:
        own = re.sub(r"[^\w .+-]", "_", line.own_layer).strip()
        names = [f"{line.layer} {own}"] if own else []
        if own and len(kinds[line.own_layer]) == 1:
            names.insert(0, own)
        name = next((name for name in names if _read_as(name, line.layer)), line.layer)
        if angle_layers and line.angle is not None and line.layer in ("mountain", "valley"):
            marked = f"{name} {math.degrees(line.angle):.12g}deg"
            name = (
                marked if _read_as(marked, line.layer) else f"{line.layer} {math.degrees(line.angle):.12g}deg"
            )
        found.append(name)
    return found


def _read_as(layer: str, kind: str) -> bool:
    colour, dashes, _ = LOOKS[kind]
    stroke = Stroke(always(np.zeros((2, 2))), "", parse_colour(colour), layer, dash_kind(list(dashes)))
    try:
        return Rules().kind(stroke) == kind
    except FileFormatError:
        return False


def pieces_of(curve: Curve) -> Chain:
    """The curve by its pieces, without points on straight lines between others.

    Args:
        curve: mm; one of one's own becomes chords within `OWN` of it.
    """
    import shapely

    if isinstance(curve, Polyline):
        few = np.asarray(shapely.LineString(curve.vertices).simplify(NEAR).coords)
        return lines_through(few)
    try:
        return chain_of(curve)
    except TypeError:
        return lines_through(sample(curve, OWN))


# --- SVG ----------------------------------------------------------------------------------------------------


def _write_svg(
    path: str | os.PathLike[str], lines: list[tuple[str, FlatLine]], notes: Sequence[Note], units: str
) -> None:
    points = np.vstack([sample(line.curve) for _, line in lines])
    low, high = points.min(axis=0), points.max(axis=0)
    width, height = (high - low + 2.0 * MARGIN).tolist()
    inch = UNITS[units][0]
    page = (
        f'width="{_mm(width / inch)}{units}" height="{_mm(height / inch)}{units}" '
        f'viewBox="0 0 {_mm(width)} {_mm(height)}"'
    )
    text = [
        '<?xml version="1.0" encoding="utf-8"?>',
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" '
        f'version="1.1" {page}>',
    ]

    def at(point: Any) -> str:
        return f"{_mm(point[0] - low[0] + MARGIN)},{_mm(high[1] - point[1] + MARGIN)}"

    for layer in dict.fromkeys(layer for layer, _ in lines):
        own = [line for name, line in lines if name == layer]
        colour, dashes, _ = LOOKS[own[0].layer]
        style = f'fill="none" stroke="{colour}" stroke-width="{HAIRLINE:g}"'
        if dashes:
            style += f' stroke-dasharray="{" ".join(f"{x:g}" for x in dashes)}"'
        word = re.sub(r"\W+", "-", layer)
        text.append(f'  <g inkscape:groupmode="layer" inkscape:label={quoteattr(layer)} id="{word}" {style}>')
        for line in own:
            more = "" if line.angle is None else f' stroke-opacity="{line.angle / math.pi:.12g}"'
            text.append(
                f"    <path d={quoteattr(_path(pieces_of(line.curve), at))}{more}>"
                f"<title>{escape(line.name)}</title></path>"
            )
        text.append("  </g>")
    if notes:
        text.append(
            f'  <g inkscape:groupmode="layer" inkscape:label="{NOTES}" id="{NOTES}" font-size="{TEXT:g}">'
        )
        for note in notes:
            x, y = at(note.at).split(",")
            text.append(f'    <text x="{x}" y="{y}">{escape(note.text)}</text>')
        text.append("  </g>")
    with replacing(path) as temporary:
        temporary.write_text("\n".join([*text, "</svg>", ""]), encoding="utf-8")


def _path(chain: Chain, at: Callable[[Any], str]) -> str:
    words = [f"M{at(chain.pieces[0].point(np.zeros(1))[0])}"]
    for piece in chain.pieces:
        if isinstance(piece, Line):
            words.append(f"L{at(piece.end)}")
        elif isinstance(piece, Bezier):
            words.append("C" + " ".join(at(point) for point in piece.points[1:]))
        else:
            words += _arcs(piece, at)
    if chain.closed:
        if len(words) > 2 and words[-1].startswith("L"):
            words.pop()
        words.append("Z")
    return " ".join(words)


def _arcs(piece: Arc | EllipseArc, at: Callable[[Any], str]) -> list[str]:
    """Elliptical arcs of SVG; near half and whole turns as several, since their centre follows from their ends."""
    round_ = piece if isinstance(piece, Arc) else piece.circle()
    tilt = 0.0
    if round_ is not None:
        piece, a, b = round_, round_.radius, round_.radius
    else:
        assert isinstance(piece, EllipseArc)
        piece = piece.axes()
        a, b = math.hypot(*piece.u), math.hypot(*piece.v)
        tilt = -math.degrees(math.atan2(piece.u[1], piece.u[0]))  # SVG's y points downwards
    size = abs(piece.sweep)
    count = 4 if size > 6.0 else 2 if abs(size - math.pi) < HALF else 1
    parts = np.linspace(0.0, 1.0, count + 1)[1:]
    stops = piece.at(parts) if isinstance(piece, EllipseArc) else piece.point(parts)
    large, turn = int(size / count > math.pi), int(piece.sweep < 0.0)
    return [f"A{_mm(a)},{_mm(b)} {_mm(tilt)} {large},{turn} {at(stop)}" for stop in stops]


def _mm(value: float) -> str:
    text = f"{value:.10f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


# --- DXF ----------------------------------------------------------------------------------------------------


def _write_dxf(
    path: str | os.PathLike[str], lines: list[tuple[str, FlatLine]], notes: Sequence[Note], units: str
) -> None:
    from ezdxf.filemanagement import new

    inch, number = UNITS[units]
    drawing = new("R2010", units=number)
    drawing.header["$MEASUREMENT"] = int(units == "mm")
    for layer, kind in {layer: line.layer for layer, line in lines}.items():
        _, dashes, colour = LOOKS[kind]
        if dashes and kind.upper() not in drawing.linetypes:
            signed = [x / inch if i % 2 == 0 else -x / inch for i, x in enumerate(dashes)]
            drawing.linetypes.add(kind.upper(), [sum(dashes) / inch, *signed], description=f"{kind} score")
        added = drawing.layers.add(layer, color=colour, linetype=kind.upper() if dashes else "CONTINUOUS")
        added.dxf.lineweight = 9  # hundredths of a millimetre
    space = drawing.modelspace()
    for layer, line in lines:
        for chain in _entities(pieces_of(line.curve)):
            _entity(space, chain.placed(1.0 / inch, (0.0, 0.0)), {"layer": layer})
    if notes:
        drawing.layers.add(NOTES, color=8)
    for note in notes:
        text = space.add_text(note.text, height=TEXT / inch, dxfattribs={"layer": NOTES})
        text.set_placement((note.at[0] / inch, note.at[1] / inch))
    with replacing(path) as temporary:
        drawing.saveas(temporary)


def _entities(chain: Chain) -> list[Chain]:
    """Parts of a chain that one entity can hold: lines and arcs of circles, lines and Bezier curves, or an ellipse."""
    pieces = [_circular(piece) for piece in _merged(chain.pieces)]
    parts: list[list[Piece]] = []
    for piece in pieces:
        kinds = {type(each) for each in [*(parts[-1] if parts else []), piece]}
        if parts and (kinds <= {Line, Arc} or kinds <= {Line, Bezier}):
            parts[-1].append(piece)
        else:
            parts.append([piece])
    return [Chain(tuple(part)) for part in parts]


def _merged(pieces: Sequence[Piece]) -> list[Piece]:
    """Arcs of one ellipse that go on from each other as one: programs draw a circle in four."""
    found: list[Piece] = []
    for piece in pieces:
        last = found[-1] if found else None
        if (
            isinstance(piece, EllipseArc)
            and isinstance(last, EllipseArc)
            and np.allclose((*last.centre, *last.u, *last.v), (*piece.centre, *piece.u, *piece.v), rtol=1e-11)
            and last.sweep * piece.sweep > 0.0
            and abs(last.sweep + piece.sweep) < 2.0 * math.pi + 1e-9
            and math.isclose(math.cos(last.start + last.sweep - piece.start), 1.0, abs_tol=1e-12)
        ):
            found[-1] = EllipseArc(last.centre, last.u, last.v, last.start, last.sweep + piece.sweep)
        else:
            found.append(piece)
    return found


def _circular(piece: Piece) -> Piece:
    return (piece.circle() or piece) if isinstance(piece, EllipseArc) else piece


def _entity(space: Any, chain: Chain, attributes: dict[str, str]) -> None:
    pieces = chain.pieces
    first = pieces[0]
    if len(pieces) == 1 and isinstance(first, Arc) and abs(abs(first.sweep) - 2.0 * math.pi) < 1e-9:
        space.add_circle(first.centre, first.radius, dxfattribs=attributes)
    elif len(pieces) == 1 and isinstance(first, Arc):
        ends = sorted((math.degrees(first.start), math.degrees(first.start + first.sweep)))
        space.add_arc(first.centre, first.radius, *ends, dxfattribs=attributes)  # counter-clockwise
    elif isinstance(first, EllipseArc):
        _ellipse(space, first.axes(), attributes)
    elif len(pieces) == 1 and isinstance(first, Line):
        space.add_line(first.start, first.end, dxfattribs=attributes)
    elif any(isinstance(piece, Bezier) for piece in pieces):
        _spline(space, chain, attributes)
    else:
        ends_ = [(*piece.point(np.zeros(1))[0].tolist(), _bulge(piece)) for piece in pieces]
        if not chain.closed:
            ends_.append((*pieces[-1].point(np.ones(1))[0].tolist(), 0.0))
        space.add_lwpolyline(ends_, format="xyb", close=chain.closed, dxfattribs=attributes)


def _bulge(piece: Piece) -> float:
    return math.tan(0.25 * piece.sweep) if isinstance(piece, Arc) else 0.0


def _ellipse(space: Any, arc: EllipseArc, attributes: dict[str, str]) -> None:
    """An ellipse of DXF runs counter-clockwise from the longer axis; a whole one has no ends."""
    ratio = math.hypot(*arc.v) / math.hypot(*arc.u)
    start, end = sorted((arc.start, arc.start + arc.sweep))
    if arc.closed:
        start, end = 0.0, 2.0 * math.pi
    space.add_ellipse(arc.centre, arc.u, ratio, start, end, dxfattribs=attributes)


def _spline(space: Any, chain: Chain, attributes: dict[str, str]) -> None:
    """A cubic B-spline that is the Bezier curves and lines one after another."""
    points: list[Any] = [chain.pieces[0].point(np.zeros(1))[0]]
    for piece in chain.pieces:
        if isinstance(piece, Bezier):
            points += piece.points[1:]
        else:
            points += [*piece.point(np.array([1.0, 2.0]) / 3.0), piece.point(np.ones(1))[0]]
    count = len(chain.pieces)
    knots = np.repeat(np.arange(count + 1, dtype=float), 3)
    places = [(float(x), float(y), 0.0) for x, y in points]
    spline = space.add_spline(degree=3, dxfattribs=attributes)
    spline.control_points = places
    spline.knots = [0.0, *knots.tolist(), float(count)]
