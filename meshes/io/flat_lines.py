"""The lines of a flat pattern as they are written: of a pattern, of a mesh, or of the drawing that it was read from."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Unpack

import numpy as np

from meshes.curves import Array, Curve, Line, Polyline, sample
from meshes.errors import FileFormatError, InputError
from meshes.fans import lips
from meshes.io.drawing import DrawingOptions, read_graph
from meshes.io.export import shown
from meshes.mesh import SheetMesh
from meshes.pattern import CreasePattern
from meshes.topology import Ints, boundary_loops

FOLDS = ("mountain", "valley", "flat")


@dataclass(frozen=True)
class FlatLine:
    """A line of a flat pattern.

    Attributes:
        layer: what it is: "boundary", "cut", "mountain", "valley", "flat", "facet", or "pinch" for a mark.
        name: of the crease, edge or cut; of a drawing what messages call the line.
        curve: mm.
        angle: its fold angle, rad, or None.
        own_layer: the name of its layer in the drawing that it comes from, or "".
    """

    layer: str
    name: str
    curve: Curve
    angle: float | None = None
    own_layer: str = ""


def drawn_lines(path: str | os.PathLike[str], **options: Unpack[DrawingOptions]) -> list[FlatLine]:
    """The lines of a drawing with their own curves, where `meshes.io.read_pattern` puts them, mm.

    Lines that are ignored, or belong to another sheet, are not among them. Those that were put together out of dashes,
    clipped, or have no exact form here (rational splines, faces) are the polylines that the pattern has.

    Args:
        path: of an .svg, .svgz, .dxf, .fold, .cp or .opx file.
        **options: as for `meshes.io.read_pattern`.

    Returns:
        the lines, outline and cuts first.

    Raises:
        FileFormatError: as for `meshes.io.read_pattern`.
    """
    try:
        graph, lines, _ = read_graph(path, **options)
    except InputError as error:
        raise FileFormatError(f"{shown(path)}: {' '.join(str(error).split())}") from error
    found = []
    for number in dict.fromkeys(graph.lines):
        line = lines[number]
        curve: Curve = Polyline((line.points - graph.origin) * graph.scale)
        if line.curve is not None:
            curve = line.curve.placed(graph.scale, graph.origin)
        angle = None if math.isnan(line.angle) else line.angle
        found.append(FlatLine(line.kind, line.name, curve, angle, line.layer))
    return sorted(found, key=lambda line: line.layer not in ("boundary", "cut"))


def with_angles(
    lines: Sequence[FlatLine], pattern: CreasePattern, angles: Mapping[str, float]
) -> list[FlatLine]:
    """The lines with the fold angles of the creases that they are part of.

    Args:
        lines: of the pattern, or of its drawing.
        pattern: has the creases, mm.
        angles: rad, by crease; lines of creases that are not in it keep theirs.

    Returns:
        the lines in the same order.
    """
    import shapely

    known = [crease for crease in pattern.creases if crease.name in angles]
    if not known:
        return list(lines)
    shapes = [shapely.LineString(sample(crease.curve)) for crease in known]
    near = 0.01 * float(np.ptp(pattern.rings[0], axis=0).max())
    found = []
    for line in lines:
        if line.layer in FOLDS:
            middle = shapely.Point(line.curve.point(np.array([0.5]))[0])
            away = [float(shape.distance(middle)) for shape in shapes]
            best = int(np.argmin(away))
            if away[best] < near:
                line = replace(line, angle=angles[known[best].name])
        found.append(line)
    return found


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
