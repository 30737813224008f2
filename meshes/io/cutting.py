"""What a cutting machine asks of the lines of a pattern: the width of its beam, and creases cut up into dashes. mm."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from meshes.curves import Arc, Array, Polyline, arc_lengths, sample
from meshes.drawn_curves import Chain, EllipseArc
from meshes.errors import FileFormatError
from meshes.io.flat_lines import FlatLine
from meshes.planar import corners

NEAR = 1e-4  # mm that chords of a moved outline may stay off it
JOIN = 1e-6  # mm between ends of lines of one outline
SPIKE = 5.0  # longest mitre, times half the kerf


def check_cutting(perforate: tuple[float, float] | None, kerf: float) -> None:
    """Refuse lengths that cannot be.

    Args:
        perforate: cut and left, mm, or None.
        kerf: width of the beam, mm.

    Raises:
        FileFormatError: one line with the value and what to give.
    """
    if perforate is not None and not (
        len(perforate) == 2 and all(math.isfinite(x) and x > 0.0 for x in perforate)
    ):
        raise FileFormatError(f"perforate = {perforate} cannot be; give two positive lengths in mm")
    if not 0.0 <= kerf < 10.0:
        raise FileFormatError(f"kerf = {kerf} cannot be; give the width of the beam in mm, from 0 to 10")


def kerfed(lines: Sequence[FlatLine], kerf: float) -> list[FlatLine]:
    """The lines, with the outline moved outwards and holes inwards by half the width of the beam.

    Whole circles stay circles; other outlines become polylines within `NEAR`.

    Args:
        lines: among them a closed outline, mm.
        kerf: mm.

    Returns:
        the outline and holes first, then the other lines.

    Raises:
        FileFormatError: the outline is not closed, or a hole is narrower than the beam.
    """
    import shapely

    rim = [
        k
        for k, line in enumerate(lines)
        if line.layer == "boundary" or (line.layer == "cut" and line.curve.closed)
    ]
    shapes = [shapely.set_precision(shapely.LineString(sample(lines[k].curve, NEAR)), JOIN) for k in rim]
    faces = shapely.get_parts(shapely.polygonize([shapely.unary_union(shapes)]))
    if not len(faces):
        raise FileFormatError("a kerf needs a closed outline, and this one is open")
    outside = shapely.union_all([shapely.Polygon(face.exterior) for face in faces])
    touching = (
        [face for face in faces if face.distance(outside.exterior) == 0.0]
        if outside.geom_type == "Polygon"
        else []
    )
    if len(touching) != 1:
        raise FileFormatError(
            "a kerf needs one closed outline with holes inside; lines of it cross or divide the sheet"
        )
    found: list[FlatLine] = []
    used: set[int] = set()
    for grown, ring in [
        (0.5 * kerf, touching[0].exterior),
        *((-0.5 * kerf, hole) for hole in touching[0].interiors),
    ]:
        own = [
            k
            for k, shape in zip(rim, shapes, strict=True)
            if ring.distance(shape.interpolate(0.5, normalized=True)) < 10.0 * JOIN
        ]
        used.update(own)
        found.append(replace(lines[own[0]], curve=_moved(lines[own[0]], len(own), ring, grown)))
    return [*found, *(line for k, line in enumerate(lines) if k not in used)]


def _moved(line: FlatLine, count: int, ring: Any, grown: float) -> Arc | Polyline:
    """The ring of a line (one of `count`) moved outwards by `grown`, mm."""
    import shapely

    circle = _circle(line) if count == 1 else None
    if circle is not None and circle.radius + grown > 0.0:
        return replace(circle, radius=circle.radius + grown)
    moved = shapely.Polygon(ring).buffer(grown, join_style="mitre", mitre_limit=SPIKE)
    if moved.geom_type != "Polygon" or moved.is_empty:
        x, y = ring.centroid.coords[0]
        raise FileFormatError(
            f"the hole at ({x:.6g}, {y:.6g}) is narrower than the kerf of {-2.0 * grown:g} mm"
        )
    return Polyline(np.asarray(moved.exterior.coords))


def _circle(line: FlatLine) -> Arc | None:
    """The whole circle that a line is, or None."""
    curve = line.curve
    if isinstance(curve, Arc):
        return curve if curve.closed else None
    pieces = curve.pieces if isinstance(curve, Chain) else ()
    arcs = [piece.circle() if isinstance(piece, EllipseArc) else piece for piece in pieces]
    round_ = [arc for arc in arcs if isinstance(arc, Arc)]
    if not round_ or len(round_) < len(arcs) or not curve.closed:
        return None
    same = np.array([(*arc.centre, arc.radius) for arc in round_])
    turned = sum(arc.sweep for arc in round_)
    if np.ptp(same, axis=0).max() > JOIN or abs(abs(turned) - 2.0 * math.pi) > JOIN:
        return None
    return Arc(round_[0].centre, round_[0].radius, 0.0, 2.0 * math.pi)


def perforated(lines: Iterable[FlatLine], cut: float, left: float) -> Iterator[FlatLine]:
    """Creases as dashes of about that length, one at either end, so that they open from the rim, and at corners.

    Args:
        lines: of the pattern, mm.
        cut: length of a dash, mm.
        left: of what is left between two, mm.
    """
    for line in lines:
        if line.layer not in ("mountain", "valley", "flat"):
            yield line
            continue
        points = sample(line.curve, NEAR)
        turns = [0, *np.flatnonzero(corners(points)).tolist(), len(points) - 1]
        for first, last in pairwise(turns):
            for dash in _dashes(points[first : last + 1], cut, left):
                yield replace(line, curve=Polyline(dash))


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
