"""Flat patterns as SVG and DXF in mm, for laser cutters and other programs; `meshes.io.read_pattern` reads them.

One layer a kind of line: "boundary", "cut", "mountain", "valley", "flat" and "facet". Arcs stay arcs.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from meshes.curves import Arc, Array, Curve, Line, Polyline, arc_lengths, sample
from meshes.errors import FileFormatError
from meshes.fans import lips
from meshes.io.export import replacing, shown
from meshes.mesh import SheetMesh
from meshes.pattern import CreasePattern
from meshes.planar import corners
from meshes.topology import Ints, boundary_loops

MARGIN = 5.0  # mm of paper round the sheet
HAIRLINE = 0.1  # mm
NEAR = 5e-4  # mm that a written polyline may stay off its curve
# what a line looks like: colour, dashes and gaps in mm, number of DXF's palette
LOOKS: dict[str, tuple[str, tuple[float, ...], int]] = {
    "boundary": ("#000000", (), 7),
    "cut": ("#00ff00", (), 3),
    "mountain": ("#ff0000", (6.0, 1.5, 1.0, 1.5), 1),
    "valley": ("#0000ff", (3.0, 1.5), 5),
    "flat": ("#ff00ff", (1.0, 1.5), 6),
    "facet": ("#ffff00", (), 2),
}


@dataclass(frozen=True)
class FlatLine:
    """A curve of a flat pattern: the layer it belongs to, its name, and its drawn fold angle (rad) or None."""

    layer: str
    name: str
    curve: Curve
    angle: float | None = None


def write_pattern(
    path: str | os.PathLike[str],
    sheet: CreasePattern | SheetMesh,
    *,
    facets: bool = False,
    perforate: tuple[float, float] | None = None,
) -> None:
    """Write the flat pattern to an .svg or .dxf file, one unit of it a millimetre.

    Creases are drawn dashed (mountain dash-dot, valley dashed) by the style of their lines. The file appears whole or
    not at all.

    Args:
        path: of the file; its suffix decides the format.
        sheet: a pattern, or a flat mesh.
        facets: also the lines along which the sheet does not fold (drawn rulings; the inner edges of a mesh).
        perforate: lengths (cut, left) in mm: creases are cut up into dashes of that length, as many machines
            ignore the style of a line. Read back, the dashes are joined again.

    Raises:
        FileFormatError: another suffix, a mesh that is not flat, lengths that cannot be, a place that cannot
            be written to.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".svg", ".dxf"):
        raise FileFormatError(f"{shown(path)}: suffix '{suffix}' is no drawing; use .svg or .dxf")
    if perforate is not None and not (
        len(perforate) == 2 and all(math.isfinite(x) and x > 0.0 for x in perforate)
    ):
        raise FileFormatError(
            f"{shown(path)}: perforate = {perforate} cannot be; give two positive lengths in mm"
        )
    try:
        lines = [line for line in flat_lines(sheet) if facets or line.layer != "facet"]
    except FileFormatError as error:
        raise FileFormatError(f"{shown(path)}: {error}") from error
    if perforate is not None:
        lines = list(_perforated(lines, *perforate))
    (_write_svg if suffix == ".svg" else _write_dxf)(path, lines)


def flat_lines(sheet: CreasePattern | SheetMesh) -> list[FlatLine]:
    """All lines of a flat pattern, the outline first; of a mesh the edges between its nodes.

    Args:
        sheet: a pattern, or a flat mesh of which creases and boundary are drawn along the edges.

    Returns:
        The lines, mm, with drawn fold angles in rad where they are known.

    Raises:
        FileFormatError: the mesh is not flat.
    """
    if isinstance(sheet, CreasePattern):
        lines = [FlatLine("boundary", name, curve) for name, curve in sheet.edges] or [
            FlatLine("boundary", f"ring-{i}", Polyline(np.vstack((ring, ring[:1]))))
            for i, ring in enumerate(sheet.rings)
        ]
        lines += [FlatLine("cut", name, curve) for name, curve in sheet.cuts]
        lines += [FlatLine(crease.fold, crease.name, crease.curve, crease.angle) for crease in sheet.creases]
        return lines + [FlatLine("facet", f"facet-{i + 1}", curve) for i, curve in enumerate(sheet.facets)]
    if not sheet.flat:
        raise FileFormatError("the sheet is not flat; only flat sheets have a pattern to draw")
    xy, topology = sheet.points[:, :2], sheet.topology
    lines = _rims(sheet)
    free = np.ones(len(topology.edges), dtype=bool)
    free[topology.edge_triangles[:, 1] < 0] = False
    # of names that share edges (all mountains, and each chain of them) the shortest say most
    for name in sorted(sheet.creases, key=lambda crease: len(sheet.crease_edges(crease))):
        pairs = sheet.crease_edges(name)
        at = topology.find_edges(pairs)
        fresh = free[at]
        free[at] = False
        angles = sheet.fold_angles.get(name)
        fold = sheet.folds.get(name, "flat")
        for run in _runs(pairs[fresh], None if angles is None else np.asarray(angles)[fresh]):
            lines.append(FlatLine(fold, name, Polyline(xy[run[0]]), run[1]))
    return lines + [
        FlatLine("facet", "facet", Line(tuple(a), tuple(b))) for a, b in xy[topology.edges[free]].tolist()
    ]


def _rims(sheet: SheetMesh) -> list[FlatLine]:
    """The boundary of a flat mesh, and its cuts: lips that lie over each other are one line."""
    import shapely

    xy, topology = sheet.points[:, :2], sheet.topology
    double = lips(sheet.points, topology)
    if not double:
        return [
            FlatLine("boundary", f"ring-{i}", Polyline(xy[[*loop, loop[0]]]))
            for i, loop in enumerate(boundary_loops(topology))
        ]
    rim = topology.edge_triangles[:, 1] < 0
    rim[np.concatenate(double)] = False
    found: list[FlatLine] = []
    for layer, name, edges in (
        ("boundary", "ring-{}", np.flatnonzero(rim)),
        ("cut", "cut-{}", np.array([group[0] for group in double])),
    ):
        joined = shapely.line_merge(shapely.multilinestrings(list(xy[topology.edges[edges]])))
        parts = sorted(
            shapely.get_parts(joined), key=lambda part: -part.length if layer == "boundary" else 0.0
        )
        start = 0 if layer == "boundary" else 1
        found += [
            FlatLine(layer, name.format(start + i), Polyline(np.asarray(part.coords)))
            for i, part in enumerate(parts)
        ]
    return found


def _runs(pairs: Ints, angles: Array | None) -> Iterator[tuple[list[int], float | None]]:
    """Chains of node pairs in order, cut where they do not go on from each other or the angle changes."""
    run: list[int] = []
    last: float | None = None
    for k, (a, b) in enumerate(pairs.tolist()):
        angle = None if angles is None or math.isnan(angles[k]) else abs(float(angles[k]))
        if run and (run[-1] != a or angle != last):
            yield run, last
            run = []
        run = run or [a]
        run.append(b)
        last = angle
    if run:
        yield run, last


def _perforated(lines: Iterable[FlatLine], cut: float, left: float) -> Iterator[FlatLine]:
    """Creases as dashes of about that length, one at either end and on both sides of corners."""
    for line in lines:
        if line.layer in ("boundary", "cut", "facet"):
            yield line
            continue
        points = sample(line.curve)
        turns = [0, *np.flatnonzero(corners(points)).tolist(), len(points) - 1]
        for first, last in pairwise(turns):
            for dash in _dashes(points[first : last + 1], cut, left):
                yield FlatLine(line.layer, line.name, Polyline(dash), line.angle)


def _dashes(points: Array, cut: float, left: float) -> Iterator[Array]:
    """Dashes (k, 2) of a line without corners."""
    length = float(arc_lengths(points)[-1])
    count = max(1, round((length + left) / (cut + left)))
    dash = cut * length / (count * (cut + left) - left)
    pitch = (length - dash) / (count - 1) if count > 1 else 0.0
    for k in range(count):
        yield _part(points, k * pitch, k * pitch + dash)


def _part(points: Array, start: float, end: float) -> Array:
    import shapely
    from shapely.ops import substring

    return np.asarray(substring(shapely.LineString(points), start, end).coords)


def _box(lines: Iterable[FlatLine]) -> tuple[Array, Array]:
    points = np.vstack([sample(line.curve) for line in lines])
    return points.min(axis=0), points.max(axis=0)


# --- SVG ----------------------------------------------------------------------------------------------------


def _write_svg(path: str | os.PathLike[str], lines: list[FlatLine]) -> None:
    low, high = _box(lines)
    width, height = (high - low + 2.0 * MARGIN).tolist()
    page = f'width="{_mm(width)}mm" height="{_mm(height)}mm" viewBox="0 0 {_mm(width)} {_mm(height)}"'
    text = [
        '<?xml version="1.0" encoding="utf-8"?>',
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" '
        f'version="1.1" {page}>',
    ]

    def at(point: Any) -> str:
        return f"{_mm(point[0] - low[0] + MARGIN)},{_mm(high[1] - point[1] + MARGIN)}"

    for layer, (colour, dashes, _) in LOOKS.items():
        own = [line for line in lines if line.layer == layer]
        if not own:
            continue
        style = f'fill="none" stroke="{colour}" stroke-width="{HAIRLINE:g}"'
        if dashes:
            style += f' stroke-dasharray="{" ".join(f"{x:g}" for x in dashes)}"'
        text.append(f'  <g inkscape:groupmode="layer" inkscape:label="{layer}" id="{layer}" {style}>')
        for line in own:
            more = "" if line.angle is None else f' stroke-opacity="{line.angle / math.pi:.6g}"'
            text.append(
                f"    <path d={quoteattr(_path(line.curve, at))}{more}><title>{escape(line.name)}</title></path>"
            )
        text.append("  </g>")
    with replacing(path) as temporary:
        temporary.write_text("\n".join([*text, "</svg>", ""]), encoding="utf-8")


def _path(curve: Curve, at: Any) -> str:
    if isinstance(curve, Arc):
        pieces = max(1, math.ceil(abs(curve.sweep) / 3.0))  # an arc of half a turn or more is ambiguous
        stops = curve.point(np.linspace(0.0, 1.0, pieces + 1))
        turn = int(curve.sweep < 0.0)  # SVG's y points downwards
        r = _mm(curve.radius)
        return f"M{at(stops[0])}" + "".join(f" A{r},{r} 0 0,{turn} {at(stop)}" for stop in stops[1:])
    points = _few(curve)
    if curve.closed:
        return "M" + " L".join(map(at, points[:-1])) + " Z"
    return "M" + " L".join(map(at, points))


def _few(curve: Curve) -> Array:
    """Points (k, 2) of a curve, no more of them than it takes to stay within `NEAR`."""
    import shapely

    return np.asarray(shapely.LineString(sample(curve)).simplify(NEAR).coords)


def _mm(value: float) -> str:
    text = f"{value:.6f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


# --- DXF ----------------------------------------------------------------------------------------------------


def _write_dxf(path: str | os.PathLike[str], lines: list[FlatLine]) -> None:
    from ezdxf.filemanagement import new

    drawing = new("R2010", units=4)  # mm
    drawing.header["$MEASUREMENT"] = 1
    for layer in {line.layer: None for line in lines}:
        _, dashes, number = LOOKS[layer]
        if dashes:
            signed = [x if i % 2 == 0 else -x for i, x in enumerate(dashes)]
            drawing.linetypes.add(layer.upper(), [sum(dashes), *signed], description=f"{layer} score")
        added = drawing.layers.add(layer, color=number, linetype=layer.upper() if dashes else "CONTINUOUS")
        added.dxf.lineweight = 9  # hundredths of a millimetre
    space = drawing.modelspace()
    for line in lines:
        _entity(space, line.curve, {"layer": line.layer})
    with replacing(path) as temporary:
        drawing.saveas(temporary)


def _entity(space: Any, curve: Curve, attributes: dict[str, str]) -> None:
    if isinstance(curve, Arc) and curve.closed:
        space.add_circle(curve.centre, curve.radius, dxfattribs=attributes)
    elif isinstance(curve, Arc):
        start, end = math.degrees(curve.start), math.degrees(curve.start + curve.sweep)
        space.add_arc(
            curve.centre, curve.radius, min(start, end), max(start, end), dxfattribs=attributes
        )  # counter-clockwise
    elif isinstance(curve, Line):
        space.add_line(curve.start, curve.end, dxfattribs=attributes)
    else:
        points = _few(curve)
        space.add_lwpolyline(
            points[:-1] if curve.closed else points, close=curve.closed, dxfattribs=attributes
        )
