"""DXF entities as the curves that they are. Made by ezdxf; its own paths have Bezier curves for arcs, 0.03 % off."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from meshes.curves import Array, Line
from meshes.drawn_curves import Bezier, Chain, EllipseArc, Piece, backwards, quadratic

FLAT = 1e-6  # of its size: how far a curve may be off its plane


def dxf_curve(entity: Any) -> Chain | None:
    """The curve of an entity, in its own units.

    Args:
        entity: of ezdxf, blocks written out.

    Returns:
        None where it has no exact curve here (rational or floating splines, helices, faces), or is not in the xy
        plane.
    """
    kind = entity.dxftype()
    if kind == "LINE":
        return _lines([entity.dxf.start, entity.dxf.end])
    if kind in ("ARC", "CIRCLE"):
        from ezdxf.entities.ellipse import Ellipse

        return _ellipse(Ellipse.from_arc(entity))
    if kind == "ELLIPSE":
        return _ellipse(entity)
    if kind in ("LWPOLYLINE", "POLYLINE"):
        return _polyline(entity)
    return _spline(entity) if kind == "SPLINE" else None


def _lines(points: Sequence[Any]) -> Chain | None:
    places = np.array([tuple(point) for point in points]).reshape(-1, 3)
    if not _is_flat(places):
        return None
    kept = places[np.append(True, np.any(np.diff(places, axis=0) != 0.0, axis=1)), :2]
    return Chain(tuple(Line(_pair(a), _pair(b)) for a, b in pairwise(kept))) if len(kept) > 1 else None


def _ellipse(entity: Any) -> Chain | None:
    tool = entity.construction_tool()
    axes = np.array([tuple(tool.major_axis), tuple(tool.minor_axis)])
    size = float(np.abs(axes).max())
    sweep = float(tool.param_span)
    if np.abs(axes[:, 2]).max() > FLAT * size or not sweep or not np.linalg.norm(axes[1]):
        return None
    centre, u, v = _pair(tool.center), _pair(axes[0]), _pair(axes[1])
    start = float(tool.start_param)
    if abs(sweep - 2.0 * math.pi) < 1e-12:  # in quarters, as SVG files have it
        quarter = 0.5 * math.pi
        return Chain(tuple(EllipseArc(centre, u, v, start + k * quarter, quarter) for k in range(4)))
    return Chain((EllipseArc(centre, u, v, start, sweep),))


def _polyline(entity: Any) -> Chain | None:
    if entity.dxftype() == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline):
        return None
    if entity.dxftype() == "POLYLINE" and entity.dxf.flags & 6:  # fitted by curves
        return None
    if not entity.has_arc:
        if entity.dxftype() == "LWPOLYLINE":
            points = list(entity.vertices_in_wcs())
        else:
            points = list(entity.points_in_wcs())
        return _lines([*points, points[0]] if entity.is_closed and points else points)
    pieces: list[Piece] = []
    for part in entity.virtual_entities():
        chain = dxf_curve(part)
        if chain is not None:
            pieces += chain.pieces
    return Chain(tuple(_in_line(pieces))) if pieces else None


def _in_line(pieces: list[Piece]) -> list[Piece]:
    """The pieces, those turned round that ezdxf gives counter-clockwise though they are passed the other way."""
    ends = [piece.point(np.array([0.0, 1.0])) for piece in pieces]
    found: list[Piece] = []
    at: Array | None = None
    for number, (piece, (a, b)) in enumerate(zip(pieces, ends, strict=True)):
        if at is None and number + 1 < len(pieces):  # the first: it ends where the second touches
            off = [float(np.linalg.norm(ends[number + 1] - end, axis=1).min()) for end in (a, b)]
            turn = off[0] < off[1]
        else:
            turn = at is not None and float(np.linalg.norm(b - at)) < float(np.linalg.norm(a - at))
        found.append(backwards(piece) if turn else piece)
        at = a if turn else b
    return found


def _spline(entity: Any) -> Chain | None:
    tool = entity.construction_tool()
    knots, degree = np.asarray(tool.knots()), tool.degree
    clamped = knots[degree] == knots[0] and knots[len(knots) - 1 - degree] == knots[-1]
    if tool.is_rational or not clamped or degree not in (2, 3):
        return None
    points = np.array([tuple(point) for point in tool.control_points])
    if not _is_flat(points):
        return None
    pieces: list[Piece] = []
    for control in tool.bezier_decomposition():
        ends = [_pair(point) for point in control]
        if degree == 2:
            pieces.append(quadratic(*ends))
        else:
            a, b, c, d = ends
            pieces.append(Bezier((a, b, c, d)))
    return Chain(tuple(pieces)) if pieces else None


def _is_flat(points: Array) -> bool:
    return len(points) > 0 and bool(np.ptp(points[:, 2]) <= FLAT * max(np.ptp(points, axis=0).max(), 1e-12))


def _pair(point: Any) -> tuple[float, float]:
    return float(point[0]), float(point[1])
