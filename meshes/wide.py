"""Creases that are strips of some width: two flat lines in place of one, and what is between them.

A crease from edge to edge becomes two curves at half its width on either side; one that closes on itself becomes two
rings. Lines and arcs stay what they are; other curves are offset by shapely, as chords. Lengths in mm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from meshes.curves import Arc, ArcChain, Array, Curve, Line, Polyline, sample
from meshes.errors import PatternError
from meshes.pattern import Crease, CreasePattern, sheet_polygon
from meshes.quantities import Typed, number

STRIP = "strip:"  # a place that has both lines of a wide crease
SIDES = ("left", "right")  # of a crease, as it runs
WIDE = "wide crease"  # what the two lines are called where they are drawn
NEAR = 1e-6  # of the sheet's size: an end on the outline


def wide_creases(pattern: CreasePattern, width: Typed | Mapping[str, Typed]) -> CreasePattern:
    """A pattern with strips in place of creases.

    The two lines of the crease NAME are flat creases NAME-left and NAME-right, the place "strip:NAME" has both, and
    `bh.Model.wide_crease` says what is between them.

    Args:
        pattern: with creases from edge to edge or closed on themselves, away from others.
        width: of the strips, mm; one for all creases that are drawn as mountain or valley, or by name.

    Raises:
        PatternError: a crease that is not there, ends elsewhere, meets something, or turns within half its width; one
            line.
    """
    widths = _widths(pattern, width)
    sides = {name: _sides(pattern, _crease(pattern, name), wide) for name, wide in widths.items()}
    _check_apart(pattern, widths, sides)
    order = {name: _inner_first(pattern, name, both) for name, both in sides.items()}
    creases: list[Crease] = []
    rails: list[Curve] = list(pattern.rails[:1])
    for i, crease in enumerate(pattern.creases):
        both = order.get(crease.name)
        if both is None:
            creases.append(crease)
            rails += pattern.rails[i + 1 : i + 2]
            continue
        creases += [Crease(f"{crease.name}-{side}", curve, "flat") for side, curve in both]
        rails += [curve for _, curve in both] if pattern.rails else []
    rails += pattern.rails[-1:]
    gone = {f"crease:{name}" for name in widths}
    groups = [(name, tuple(each for each in members if each not in gone)) for name, members in pattern.groups]
    groups += [(STRIP + name, tuple(f"crease:{name}-{side}" for side in SIDES)) for name in widths]
    return replace(
        pattern,
        creases=tuple(creases),
        rails=tuple(rails),
        groups=tuple((name, members) for name, members in groups if members),
    )


def _widths(pattern: CreasePattern, width: Typed | Mapping[str, Typed]) -> dict[str, float]:
    """By crease, mm."""
    folded = [crease.name for crease in pattern.creases if crease.fold != "flat"]
    given = width if isinstance(width, Mapping) else dict.fromkeys(folded, width)
    found = {name: float(number(each, "length")) for name, each in given.items()}
    for name, each in found.items():
        _crease(pattern, name)
        if not 0.0 < each < np.inf:
            raise PatternError(f"crease '{name}': width = {each:g} cannot be; give a positive width in mm")
    return found


def _crease(pattern: CreasePattern, name: str) -> Crease:
    for crease in pattern.creases:
        if crease.name == name:
            return crease
    known = ", ".join(crease.name for crease in pattern.creases) or "none"
    raise PatternError(f"the pattern has no single crease '{name}' that could be wide; its creases: {known}")


# --- the two lines ------------------------------------------------------------------------------------------


def _sides(pattern: CreasePattern, crease: Crease, width: float) -> tuple[Curve, Curve]:
    """The curves on the left and on the right of a crease."""
    outline = _outline(pattern)
    size = float(np.ptp(pattern.rings[0], axis=0).max())
    if not crease.curve.closed:
        for x, y in crease.curve.point(np.array([0.0, 1.0])).tolist():
            if outline.distance(_point(x, y)) > 2e-3 + NEAR * size:
                raise PatternError(
                    f"crease '{crease.name}' ends at ({x:.6g}, {y:.6g}) inside the sheet, so it cannot be wide; only "
                    "creases from edge to edge and closed ones can"
                )
    left, right = (_offset(pattern, crease, side * 0.5 * width) for side in (1.0, -1.0))
    return left, right


def _offset(pattern: CreasePattern, crease: Crease, by: float) -> Curve:
    """A curve beside a crease, `by` mm to its left, that ends on the outline."""
    exact = _parallel(crease, by)
    if exact is not None:
        outline = _outline(pattern)
        size = float(np.ptp(pattern.rings[0], axis=0).max())
        ends = exact.point(np.array([0.0, 1.0])).tolist()
        if exact.closed or max(outline.distance(_point(x, y)) for x, y in ends) <= NEAR * size:
            return exact
    return _chords(pattern, crease, by)


def _parallel(crease: Crease, by: float) -> Curve | None:
    """Of the same kind as the crease, or None where there is no such curve."""
    curve = crease.curve
    if isinstance(curve, Line):
        start, end = np.asarray(curve.start), np.asarray(curve.end)
        left = by * np.array([start[1] - end[1], end[0] - start[0]]) / curve.length
        return Line(_pair(start + left), _pair(end + left))
    if isinstance(curve, Arc):
        radius = curve.radius - np.sign(curve.sweep) * by
        if radius <= 0.0:
            raise _too_sharp(crease)
        return replace(curve, radius=float(radius))
    if isinstance(curve, ArcChain):
        beside = replace(curve, offset=curve.offset + by)
        if min(1.0 - k * beside.offset for k in curve.curvatures) <= 0.0:
            raise _too_sharp(crease)
        return beside
    return None


def _chords(pattern: CreasePattern, crease: Crease, by: float) -> Curve:
    """The same as chords, cut off where it leaves the sheet."""
    import shapely

    points = sample(crease.curve)
    if crease.curve.closed:
        turn = 1.0 if shapely.LinearRing(points).is_ccw else -1.0
        ring = shapely.Polygon(points).buffer(-turn * by, join_style="mitre")
        if ring.geom_type != "Polygon" or ring.is_empty or ring.interiors:
            raise _too_sharp(crease)
        found = np.asarray(ring.exterior.coords)
        found = found if shapely.LinearRing(found).is_ccw == (turn > 0.0) else found[::-1]
        first = int(np.argmin(np.linalg.norm(found[:-1] - points[0], axis=1)))
        beside = np.roll(found[:-1], -first, axis=0)
        beside = np.vstack((beside, beside[:1]))
        whole = shapely.LineString(beside)
    else:
        reach = 4.0 * abs(by) + 0.01 * crease.curve.length
        before = points[0] + reach * _unit(points[0] - points[1])
        behind = points[-1] + reach * _unit(points[-1] - points[-2])
        whole = shapely.LineString(np.vstack((before, points, behind))).offset_curve(by, join_style="mitre")
        sheet = sheet_polygon(pattern.rings)
        parts = shapely.get_parts(whole.intersection(sheet))
        longest = max(parts, key=lambda part: float(part.length), default=None)
        if longest is None or longest.geom_type != "LineString" or longest.is_empty:
            raise _off_the_sheet(crease.name, 2.0 * abs(by))
        beside = np.asarray(longest.coords)
        if np.linalg.norm(beside[0] - points[0]) > np.linalg.norm(beside[-1] - points[0]):
            beside = beside[::-1]
    if shapely.distance(whole, shapely.points(points)).max() > 1.05 * abs(by):  # the offset has lost a piece
        raise _too_sharp(crease)
    return Polyline(beside)


def _too_sharp(crease: Crease) -> PatternError:
    return PatternError(
        f"crease '{crease.name}' turns on less than half its width; make it narrower, or its bends wider"
    )


def _off_the_sheet(name: str, width: float) -> PatternError:
    return PatternError(f"crease '{name}' is {width:g} mm wide and leaves the sheet; make it narrower")


# --- what is in the way, and the order ----------------------------------------------------------------------


def _check_apart(
    pattern: CreasePattern, widths: Mapping[str, float], sides: Mapping[str, tuple[Curve, Curve]]
) -> None:
    import shapely

    lines = {f"crease '{c.name}'": shapely.LineString(sample(c.curve)) for c in pattern.creases}
    lines |= {f"cut '{name}'": shapely.LineString(sample(curve)) for name, curve in pattern.cuts}
    sheet = sheet_polygon(pattern.rings).buffer(2e-3)
    strips: dict[str, Any] = {}
    for name, (left, right) in sides.items():
        one, two = sample(left), sample(right)
        if left.closed:
            a, b = shapely.Polygon(one), shapely.Polygon(two)
            strips[name] = a.difference(b) if a.area > b.area else b.difference(a)
        else:
            strips[name] = shapely.Polygon(np.vstack((one, two[::-1])))
        if not sheet.covers(strips[name]):
            raise _off_the_sheet(name, widths[name])
    wide = {
        member.replace(":", " '") + "'": f"crease '{group.removeprefix(STRIP)}', which is wide, too"
        for group, members in pattern.groups
        if group.startswith(STRIP)
        for member in members
    }
    for name, strip in strips.items():
        for what, line in lines.items():
            if what != f"crease '{name}'" and strip.intersects(strips.get(what[8:-1], line)):
                raise PatternError(
                    f"crease '{name}' is {widths[name]:g} mm wide and meets {wide.get(what, what)}; only creases that "
                    "keep away from others can be wide: make it narrower, or leave out its width"
                )


def _inner_first(
    pattern: CreasePattern, name: str, both: tuple[Curve, Curve]
) -> tuple[tuple[str, Curve], tuple[str, Curve]]:
    """The two lines in the order of the rails."""
    import shapely

    left, right = zip(SIDES, both, strict=True)
    if not pattern.rails:
        return left, right
    number = [crease.name for crease in pattern.creases].index(name)
    before = shapely.LineString(sample(pattern.rails[number]))
    near = [before.distance(_point(*curve.point(np.array([0.5]))[0].tolist())) for curve in both]
    return (left, right) if near[0] < near[1] else (right, left)


def _outline(pattern: CreasePattern) -> Any:
    import shapely

    return shapely.MultiLineString([np.vstack((ring, ring[:1])) for ring in pattern.rings])


def _point(x: float, y: float) -> Any:
    import shapely

    return shapely.Point(x, y)


def _pair(point: Array) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))
