"""Crease patterns that were drawn: SVG and DXF files to patterns and meshes. docs/drawing.md says how to draw one."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypedDict, TypeVar, Unpack

import numpy as np

from meshes.curves import Array
from meshes.drawn_pattern import pattern_of, region_of
from meshes.errors import FileFormatError, InputError
from meshes.io.construction import construction
from meshes.io.export import one_line, shown
from meshes.io.fine_lines import smooth
from meshes.io.perforation import join_dashes
from meshes.io.sizes import check_lengths, size_remarks
from meshes.io.strokes import Rules, Stroke, Strokes, layer_angle
from meshes.limits import check_limit
from meshes.mesh import SheetMesh
from meshes.pattern import CreasePattern
from meshes.planar import FOLDED, RIM, DrawnLine, Graph, check_crossings, heal
from meshes.separate import one_sheet, sheets_of

OUTLINES = ("drawn", "hull")
DRAWINGS = (".svg", ".svgz", ".dxf", ".cp", ".opx")
PATTERNS = (*DRAWINGS, ".fold")
UPWARDS = (".dxf", ".cp", ".opx", ".fold")  # keep their coordinates; the page of an SVG file begins anywhere
TOLERANCE, GAP = 2e-5, 5e-4  # of the drawing's diagonal
SHORT = 0.4  # of its shortest line: a larger gap by default would swallow it
LONGEST = 1e6  # mm
LETTERS = {"mountain": "M", "valley": "V", "boundary": "B", "cut": "C", "facet": "F", "flat": "U"}

Read = TypeVar("Read")
Named = TypeVar("Named", bound=str)  # what a line stands for


class DrawingOptions(TypedDict, total=False):
    """How the lines of a drawing are taken.

    Attributes:
        scale: mm a unit of the drawing; None for the unit that the file states (SVG: CSS lengths, 96 px an inch;
            DXF: $INSUNITS, mm where it is unset).
        fit: length of the longer side of the sheet's bounding box, mm, in place of a scale.
        tolerance: how far chords may stay off curves, mm; None for 1 / 50,000 of the diagonal.
        gap: lines that miss each other by up to so much are joined, mm; None for 1 / 2,000 of the diagonal, but no
            more than 0.4 of the shortest line.
        lines: what colours, layers and dashes stand for, in front of the defaults (see `meshes.io.strokes`).
        outline: "hull" takes the convex hull of what is drawn as the outline.
        frame: of a FOLD file, see `meshes.io.read_fold`.
        sheet: which of several sheets that the drawing holds, counted from 1 in rows from the top left; None where it
            holds one. `fit` is of that sheet then.
    """

    scale: float | None
    fit: float | None
    tolerance: float | None
    gap: float | None
    lines: Mapping[str, str] | None
    outline: str
    frame: int | str | None
    sheet: int | None


def read_pattern(path: str | os.PathLike[str], **options: Unpack[DrawingOptions]) -> CreasePattern:
    """The crease pattern of a drawing (SVG, DXF, FOLD, .cp, .opx), lengths in mm.

    Mountain and valley are as seen on the drawing, that is from +z. The sheet of an SVG file has the lower left corner
    of its bounding box at the origin; that of a DXF file keeps its coordinates (unless `fit` scales it).

    Args:
        path: of an .svg, .svgz, .dxf, .fold, .cp or .opx file.
        **options: see `DrawingOptions`.

    Raises:
        FileFormatError: one line that names the file, the line or place, and the mend.
    """
    return read_drawing(path, **options).pattern()


def read_drawn(path: str | os.PathLike[str], **options: Unpack[DrawingOptions]) -> SheetMesh:
    """The drawing as a mesh of its own faces, cut into triangles; no node is added.

    For drawings whose facet lines are to be the mesh. The names are those of `meshes.io.read_fold`.

    Args:
        path: of an .svg, .svgz, .dxf, .fold, .cp or .opx file.
        **options: as for `read_pattern`.

    Raises:
        FileFormatError: as for `read_pattern`.
    """
    return read_drawing(path, **options).faces()


def count_sheets(path: str | os.PathLike[str], **options: Unpack[DrawingOptions]) -> int:
    """How many sheets a drawing holds; 0 where it has no closed outline.

    Args:
        path: of an .svg, .svgz, .dxf, .fold, .cp or .opx file.
        **options: as for `read_pattern`, without `sheet`.

    Raises:
        FileFormatError: as for `read_pattern`.
    """
    return _naming_the_file(path, lambda: len(sheets_of(read_graph(path, **options)[0])))


def _naming_the_file(path: str | os.PathLike[str], read: Callable[[], Read]) -> Read:
    """What `read` returns; its errors get the name of the file in front."""
    import shapely

    try:
        return read()
    except (InputError, shapely.errors.ShapelyError) as error:
        raise FileFormatError(f"{shown(path)}: {one_line(error)}") from error


@dataclass(frozen=True)
class ReadDrawing:
    """The lines of a drawing, read once, from which both its pattern and its own faces can be made.

    Attributes:
        path: of the file, for messages.
        graph: its healed plane graph, mm.
        lines: that the edges of the graph belong to.
        remarks: what was taken for granted, one line each.
    """

    path: str | os.PathLike[str]
    graph: Graph
    lines: list[DrawnLine]
    remarks: tuple[str, ...]

    def pattern(self) -> CreasePattern:
        """As `read_pattern`.

        Raises:
            FileFormatError: as for `read_pattern`.
        """
        return _naming_the_file(self.path, lambda: _pattern(self))

    def faces(self) -> SheetMesh:
        """As `read_drawn`.

        Raises:
            FileFormatError: as for `read_pattern`.
        """
        return _naming_the_file(self.path, lambda: _faces(self))


def read_drawing(path: str | os.PathLike[str], **options: Unpack[DrawingOptions]) -> ReadDrawing:
    """The lines of a drawing.

    Args:
        path: of an .svg, .svgz, .dxf, .fold, .cp or .opx file.
        **options: as for `read_pattern`.

    Raises:
        FileFormatError: as for `read_pattern`.
    """
    graph, lines, remarks = _naming_the_file(path, lambda: read_graph(path, **options))
    return ReadDrawing(path, graph, lines, tuple(remarks))


def _pattern(read: ReadDrawing) -> CreasePattern:
    pattern = pattern_of(read.graph, read.lines)
    return replace(pattern, remarks=(*read.remarks, *pattern.remarks))


def _faces(read: ReadDrawing) -> SheetMesh:
    from meshes.io.fold import sheet_of_frame
    from meshes.io.fold_frame import Frame
    from meshes.io.loose_ends import tie_ends

    graph, lines, remarks = read.graph, read.lines, list(read.remarks)
    region = region_of(graph, lines)
    rim = np.setdiff1d(np.arange(len(graph.edges)), [*region.inside.tolist(), *region.stubs.tolist()])
    letters = ["F" if kind == "boundary" else LETTERS[kind] for kind in graph.kinds]
    for e in rim.tolist():
        letters[e] = "B"
    sign = {"M": -1.0, "V": 1.0}
    angles = [
        sign[letter] * math.degrees(lines[line].angle) if letter in sign else 0.0
        for letter, line in zip(letters, graph.lines, strict=True)
    ]
    known = any(not math.isnan(line.angle) for line in lines)
    points = np.column_stack((graph.points, np.zeros(len(graph.points))))
    kept = np.setdiff1d(np.arange(len(graph.edges)), region.stubs).tolist()
    edges = [(int(a), int(b)) for a, b in graph.edges[kept].tolist()]
    letters, angles = [letters[e] for e in kept], [angles[e] for e in kept]
    frame = Frame(points, edges, letters, angles if known else None, [])
    tied = tie_ends(frame, "MVFUC")
    if more := len(tied.edges) - len(edges):
        remarks.append(
            f"facet lines ({more}) lead on where lines end inside the sheet, to cut its faces into triangles"
        )
    mesh = sheet_of_frame(tied)
    return replace(mesh, kind="drawn", remarks=(*remarks, *region.remarks, *mesh.remarks))


def read_graph(
    path: str | os.PathLike[str], **options: Unpack[DrawingOptions]
) -> tuple[Graph, list[DrawnLine], list[str]]:
    """The healed plane graph of a drawing.

    Args:
        path: of an .svg, .svgz, .dxf, .fold, .cp or .opx file.
        **options: see `DrawingOptions`.

    Returns:
        The graph, the lines that its edges belong to, and one remark for each thing that was taken for
        granted.

    Raises:
        FileFormatError: the file cannot be read, or its lines cannot be understood; the message does not name
            the file.
        PatternError: lines that cannot be healed, see `meshes.planar.heal`.
    """
    found = _drawn(path, options)
    drawn, gap, sheet, fit = found.lines, found.gap, options.get("sheet"), options.get("fit")
    remarks = list(found.remarks)
    check_crossings(np.vstack([np.hstack((line.points[:-1], line.points[1:])) for line in drawn]))
    drawn, smoothed = smooth(drawn, gap, found.tolerance, found.diagonal)
    drawn, joined = join_dashes(drawn, gap)
    if options.get("outline") == "hull":
        drawn.append(_hull(drawn))
        remarks.append("the outline is the convex hull of what is drawn")
    graph = heal(drawn, gap)
    if sheet is not None:
        graph = one_sheet(graph, sheet, fit, Path(path).suffix.lower() not in UPWARDS or fit is not None)
    return graph, drawn, [*remarks, *joined, *smoothed, *graph.remarks]


def read_lines(path: str | os.PathLike[str], **options: Unpack[DrawingOptions]) -> list[DrawnLine]:
    """The lines of a drawing in mm, as they are drawn, before they are healed.

    Args:
        path: of an .svg, .svgz, .dxf, .fold, .cp or .opx file.
        **options: as for `read_pattern`.

    Returns:
        the lines in the order of the file, without those that are ignored or too short to count.

    Raises:
        FileFormatError: the file cannot be read, or its lines cannot be understood.
    """
    return _naming_the_file(path, lambda: list(_drawn(path, options).lines))


@dataclass(frozen=True)
class _Drawn:
    """Lines as they are drawn, mm, and with which lengths (mm) they are healed."""

    lines: list[DrawnLine]
    gap: float
    tolerance: float
    diagonal: float
    remarks: list[str]


def _drawn(path: str | os.PathLike[str], options: DrawingOptions) -> _Drawn:
    scale, fit = options.get("scale"), options.get("fit")
    tolerance, gap, outline = options.get("tolerance"), options.get("gap"), options.get("outline", "drawn")
    _check({"scale": scale, "fit": fit, "tolerance": tolerance, "gap": gap}, outline)
    found = _read(path, options.get("frame"))
    strokes, unit, remarks = found.strokes, found.unit, list(found.remarks)
    rules = Rules(options.get("lines"))
    kept = [(stroke, kind) for stroke in strokes if (kind := rules.kind(stroke)) != "ignore"]
    if not kept:
        raise FileFormatError(
            f"there is no line in the drawing ({len(strokes)} are ignored); draw the creases as strokes"
        )
    check_limit("lines", len(kept), "this drawing", FileFormatError)
    rough = _box([_finite(stroke, stroke.sample(math.inf)) for stroke, _ in kept])
    fine = TOLERANCE * float(np.linalg.norm(rough[1] - rough[0])) or 1.0
    sampled = _sampled([stroke for stroke, _ in kept], fine)
    near = GAP * fine / TOLERANCE if gap is None or fit is not None else gap / (scale or unit)
    kept, sampled = _without_construction(kept, sampled, near, remarks)
    rim = [points for points, (_, kind) in zip(sampled, kept, strict=True) if kind in RIM]
    low, high = _box(rim or sampled)
    if fit is not None:
        scale = fit / float((high - low).max() or 1.0)
    unit = unit if scale is None else scale
    diagonal = unit * float(np.linalg.norm(high - low))
    if not 0.0 < diagonal <= LONGEST:
        raise FileFormatError(f"the drawing is {diagonal:.3g} mm across; set scale (mm a unit) or fit (mm)")
    if tolerance is not None:
        sampled = _sampled([stroke for stroke, _ in kept], tolerance / unit)
    if scale is None:
        remarks += size_remarks(unit * float((high - low).max()), found.stated)
    moved = np.zeros(2) if Path(path).suffix.lower() in UPWARDS and fit is None else low
    partly = any(stroke.opacity < 1.0 for stroke, kind in kept if kind in FOLDED)
    drawn = []
    for (stroke, kind), points in zip(kept, sampled, strict=True):
        angle = math.pi * stroke.opacity if partly and kind in FOLDED else math.nan
        if kind in FOLDED and not math.isnan(said := layer_angle(stroke.layer)):
            angle = said
        curve = None if stroke.curve is None else stroke.curve.placed(unit, moved.tolist())
        place = _clean((points - moved) * unit, 1e-9 * diagonal)
        drawn.append(DrawnLine(place, kind, stroke.name, angle, curve, stroke.layer))
    drawn = [line for line in drawn if len(line.points) > 1]
    lengths = np.array([_length(line.points) for line in drawn])
    if gap is None:
        gap = min(GAP * diagonal, SHORT * float(lengths.min()))
    elif (lengths <= gap).any():
        short = int((lengths <= gap).sum())
        first = drawn[int(np.argmax(lengths <= gap))].name
        remarks.append(f"{short} lines shorter than gap = {gap:g} mm are left out (first {first})")
        drawn = [line for line, length in zip(drawn, lengths.tolist(), strict=True) if length > gap]
    return _Drawn(drawn, gap, tolerance or fine * unit, diagonal, [*remarks, *rules.remarks])


def _without_construction(
    kept: list[tuple[Stroke, Named]], sampled: list[Array], near: float, remarks: list[str]
) -> tuple[list[tuple[Stroke, Named]], list[Array]]:
    """Strokes with their kinds, and their points, without construction lines; these get a remark."""
    out = construction(sampled, [kind for _, kind in kept], near)
    if not out:
        return kept, sampled
    remarks.append(
        f"{len(out)} lines in the outline's colour (first {kept[out[0]][0].name}) end loosely beyond the outline: "
        "taken as construction lines, left out"
    )
    left = np.setdiff1d(np.arange(len(kept)), out).tolist()
    return [kept[k] for k in left], [sampled[k] for k in left]


def _check(lengths: Mapping[str, float | None], outline: str) -> None:
    """Refuse options that cannot be."""
    check_lengths(lengths)
    if outline not in OUTLINES:
        raise FileFormatError(f"outline = '{outline}' is not known; use {' or '.join(OUTLINES)}")


def _hull(lines: list[DrawnLine]) -> DrawnLine:
    """The convex hull of everything that is drawn, as the outline."""
    import shapely

    hull = shapely.convex_hull(shapely.MultiPoint(np.vstack([line.points for line in lines])))
    if hull.geom_type != "Polygon":
        raise FileFormatError('outline = "hull": all lines lie on one line; draw the outline')
    return DrawnLine(np.asarray(hull.exterior.coords), "boundary", "the hull of the drawing")


def _read(path: str | os.PathLike[str], frame: int | str | None) -> Strokes:
    suffix = Path(path).suffix.lower()
    if suffix in (".svg", ".svgz"):
        from meshes.io.svg import read_svg

        return read_svg(path)
    if suffix == ".dxf":
        from meshes.io.dxf import read_dxf

        return read_dxf(path)
    if suffix in (".cp", ".opx"):
        from meshes.io.oripa import read_cp, read_opx

        return (read_cp if suffix == ".cp" else read_opx)(path)
    if suffix == ".fold":
        from meshes.io.fold_lines import read_fold_lines

        return read_fold_lines(path, frame)
    raise FileFormatError(f"suffix '{suffix}' is no drawing; give one of {', '.join(PATTERNS)}")


def _sampled(strokes: list[Stroke], tolerance: float) -> list[Array]:
    """Points (k, 2) of every stroke, not more than the limit allows together."""
    found: list[Array] = []
    total = 0
    for stroke in strokes:
        found.append(_finite(stroke, stroke.sample(tolerance)))
        total += len(found[-1])
        check_limit("vertices", total, "this drawing", FileFormatError)
    return found


def _finite(stroke: Stroke, points: Array) -> Array:
    if not (np.isfinite(points).all() and np.abs(points).max(initial=0.0) < 1e12):
        raise FileFormatError(f"{stroke.name} has coordinates that are not finite; remove or redraw it")
    return points


def _box(lines: list[Array]) -> tuple[Array, Array]:
    points = np.vstack(lines)
    return points.min(axis=0), points.max(axis=0)


def _clean(points: Array, near: float) -> Array:
    """The points without repetitions."""
    keep = np.append(True, np.linalg.norm(np.diff(points, axis=0), axis=1) > near)
    return np.asarray(points[keep])


def _length(points: Array) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
