"""Rails of a drawn pattern: creases that run across the sheet side by side, or round a hole one in the other.

Such a pattern can be meshed along rulings (`meshes.structured`), on which bars and hinges do not lock. Between two
neighbouring creases the rulings are taken to join points at equal parts of their lengths.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from meshes.curves import Array, Curve, Line, Polyline, sample
from meshes.pattern import Crease, CreasePattern
from meshes.planar import corners

STRAIGHT = 1e-3  # of the sheet's size: the sides between rails may bulge by so much


def find_rails(pattern: CreasePattern) -> CreasePattern:
    """The pattern with rails, its creases in their order and its sides named, or as it is where it has none.

    Args:
        pattern: drawn, with creases in any order and direction.
    """
    lines = [sample(crease.curve) for crease in pattern.creases]
    closed = [crease.curve.closed for crease in pattern.creases]
    if not lines or any(corners(line, ring).any() for line, ring in zip(lines, closed, strict=True)):
        return pattern
    if all(closed) and len(pattern.rings) == 2:
        return _rings(pattern, lines)
    if not any(closed) and len(pattern.rings) == 1:
        return _across(pattern, lines)
    return pattern


# --- round a hole -------------------------------------------------------------------------------------------


def _rings(pattern: CreasePattern, lines: list[Array]) -> CreasePattern:
    import shapely

    loops = [np.vstack((ring, ring[:1])) for ring in pattern.rings]
    if any(corners(loop, True).any() for loop in loops):
        return pattern
    order = np.argsort([shapely.Polygon(line).area for line in lines]).tolist()
    every = [loops[1], *(lines[k] for k in order), loops[0]]
    areas = [shapely.Polygon(line) for line in every]
    if not all(b.covers(a) for a, b in pairwise(areas)):
        return pattern
    rails: list[Curve] = []
    start = None
    for line in every:
        ring = line if shapely.LinearRing(line).is_ccw else line[::-1]
        start = ring[int(np.argmax(ring @ (1.0, 0.0)))] if start is None else start
        rails.append(Polyline(_from(shapely.LineString(ring), start)))
        start = rails[-1].point(np.zeros(1))[0]
    return _named(pattern, order, rails, (("inner", rails[0]), ("outer", rails[-1])))


def _from(ring: Any, start: Array) -> Array:
    """A closed line, begun at its point nearest to `start`."""
    import shapely
    from shapely.ops import substring

    at = float(ring.project(shapely.Point(start)))
    if at <= 1e-9 * ring.length or at >= (1.0 - 1e-9) * ring.length:
        return np.asarray(ring.coords)
    head, tail = substring(ring, 0.0, at), substring(ring, at, ring.length)
    return np.vstack((np.asarray(tail.coords), np.asarray(head.coords)[1:]))


# --- across the sheet ---------------------------------------------------------------------------------------


def _across(pattern: CreasePattern, lines: list[Array]) -> CreasePattern:
    import shapely

    loop = shapely.LineString(np.vstack((pattern.rings[0], pattern.rings[0][:1])))
    size = float(np.ptp(pattern.rings[0], axis=0).max())
    ends = [shapely.Point(point) for line in lines for point in (line[0], line[-1])]
    if max(loop.distance(end) for end in ends) > 1e-6 * size:
        return pattern
    places = np.array([loop.project(end) for end in ends])
    turn = _palindrome((np.argsort(places) // 2).tolist())
    if turn is None:
        return pattern
    order, begin = turn
    around = np.roll(np.argsort(places), -begin)
    count = len(lines)
    one = [places[k] for k in around[:count]]  # up one side ...
    two = [places[k] for k in around[count:][::-1]]  # ... and down the other
    first = _third_side(loop, two[0], one[0])
    last = _third_side(loop, one[-1], two[-1])
    if first is None or last is None:
        return pattern
    rails_ = [first[::-1], *(_run(lines[k], loop, one[i]) for i, k in enumerate(order)), last]
    rails: list[Curve] = [curve_through(points) for points in rails_]
    sides = [[rail.point(np.array([u]))[0] for rail in rails] for u in (0.0, 1.0)]
    if not _straight(loop, sides, size):
        return pattern
    return _from_lower_left(pattern, order, rails)


def _palindrome(labels: list[int]) -> tuple[list[int], int] | None:
    """The creases in order, and where to begin in the cyclic list of their ends; None if they are not side by side."""
    count = len(labels) // 2
    for begin in range(len(labels)):
        turned = labels[begin:] + labels[:begin]
        if turned[:count] == turned[count:][::-1] and len(set(turned[:count])) == count:
            return turned[:count], begin
    return None


def _stretch(loop: Any, start: float, end: float) -> Array:
    """The piece of a closed line from one place to another, onwards."""
    from shapely.ops import substring

    if end > start:
        return np.asarray(substring(loop, start, end).coords)
    tail = np.asarray(substring(loop, start, loop.length).coords)
    head = np.asarray(substring(loop, 0.0, end).coords)
    joined = np.vstack((tail, head)) if len(tail) > 1 and len(head) > 1 else (tail if len(tail) > 1 else head)
    keep = np.append(True, np.linalg.norm(np.diff(joined, axis=0), axis=1) > 1e-12 * loop.length)
    return np.asarray(joined[keep])


def _third_side(loop: Any, start: float, end: float) -> Array | None:
    """Between the two corners of the piece of the outline beyond the first (or last) crease, or None."""
    piece = _stretch(loop, start, end)
    sharp = np.flatnonzero(corners(piece))
    return piece[sharp[0] : sharp[1] + 1] if len(sharp) == 2 else None


def _run(line: Array, loop: Any, start: float) -> Array:
    """A crease from its end at that place of the outline."""
    begin = np.asarray(loop.interpolate(start).coords[0])
    return line if np.linalg.norm(line[0] - begin) < np.linalg.norm(line[-1] - begin) else line[::-1]


def curve_through(points: Array) -> Curve:
    """The straight segments through points (k, 2); a `Line` of two."""
    if len(points) == 2:
        return Line(tuple(points[0].tolist()), tuple(points[1].tolist()))
    return Polyline(points)


def _straight(loop: Any, sides: Sequence[Sequence[Array]], size: float) -> bool:
    """Is the outline straight between the ends of neighbouring rails?"""
    import shapely

    for side in sides:
        chords = list(pairwise(side))
        middle = [a + t * (b - a) for a, b in chords for t in (0.25, 0.5, 0.75)]
        if max(loop.distance(shapely.Point(point)) for point in middle) > STRAIGHT * size:
            return False
    return True


def _from_lower_left(pattern: CreasePattern, order: list[int], rails: list[Curve]) -> CreasePattern:
    """Rails from the lower or left side of the sheet, and from their own lower or left end."""
    half = np.array([0.5])
    if (rails[0].point(half)[0] - rails[-1].point(half)[0]).sum() > 0.0:
        rails, order = rails[::-1], order[::-1]
    ends = np.array([0.0, 1.0])
    first = rails[0].point(ends)
    if (first[0] - first[1]).sum() > 0.0:
        rails = [Line(r.end, r.start) if isinstance(r, Line) else Polyline(sample(r)[::-1]) for r in rails]
    start, end = np.stack([rail.point(ends) for rail in rails], axis=1)
    edges: tuple[tuple[str, Curve], ...] = (
        ("inner", rails[0]),
        ("outer", rails[-1]),
        ("start", curve_through(start)),
        ("end", curve_through(end)),
    )
    return _named(pattern, order, rails, edges)


def _named(
    pattern: CreasePattern, order: Sequence[int], rails: Sequence[Curve], edges: tuple[tuple[str, Curve], ...]
) -> CreasePattern:
    """Creases m1, v1, ... numbered in the order of the rails, on the rails' own curves."""
    counts = {"mountain": 0, "valley": 0, "flat": 0}
    creases = []
    for k, rail in zip(order, rails[1:-1], strict=True):
        old = pattern.creases[k]
        counts[old.fold] += 1
        creases.append(Crease(f"{old.fold[0]}{counts[old.fold]}", rail, old.fold, old.angle))
    groups = [
        (f"crease:{fold}", tuple(f"crease:{crease.name}" for crease in creases if crease.fold == fold))
        for fold in counts
    ]
    groups.append(("edge:boundary", tuple(f"edge:{name}" for name, _ in edges)))
    return replace(
        pattern,
        creases=tuple(creases),
        rails=tuple(rails),
        edges=edges,
        groups=tuple((name, members) for name, members in groups if members),
    )
