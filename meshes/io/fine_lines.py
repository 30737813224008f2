"""Curves that a program has written as many short segments, made curves again. mm.

Segments that are lines of their own, end to end, are put together first. Runs of segments that turn a little at each
vertex are replaced by a smoothing spline (FITPACK's, by `scipy.interpolate.splprep`) that goes through the ends of the
run and past every vertex within a tolerance; where a line turns more it keeps its corner.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from meshes.curves import Array, Line
from meshes.drawn_curves import Chain, lines_through
from meshes.planar import CORNER, DrawnLine, corners

LEAST = 16  # segments of a run
FINE = 0.15  # rad that a run turns at a vertex, at most: a circle of 42 segments
STRAIGHT = 0.05  # rad that it turns in all, at least
MET = (
    1.0 / 3.0
)  # of its vertices: where so many are ends of other lines these are rulings, and the facets are meant
LONG = 8.0  # times the median segment: such a segment is straight, and no curve goes on through it
WITHIN = 0.25  # of the gap: how far the vertices may be off the curve
EXACT = 100.0  # weight of the ends of a run
# of the tolerance: root mean squares that are tried, the closest first that needs few knots (more follow the noise)
PARTS, KNOTS = (0.2, 0.4, 0.0), 1.0 / 3.0
LONGEST = 5_000  # points of a run

End = tuple[int, int]  # a line, and 0 for its beginning or -1 for its end


def smooth(
    lines: Sequence[DrawnLine], gap: float, tolerance: float, size: float
) -> tuple[list[DrawnLine], list[str]]:
    """Lines of many short segments as curves.

    Args:
        lines: what is drawn, mm.
        gap: that joins lines, mm; vertices come to lie within a quarter of it.
        tolerance: of the chords that the curves are sampled to, mm.
        size: of the drawing, mm; ends within 1e-9 of it are one.

    Returns:
        the lines, those points of which are on a fitted curve with their own segments as `curve`, and a remark
        where there are any.
    """
    joined = _end_to_end(lines, 1e-9 * size)
    touched = _places(joined)
    out: list[DrawnLine] = []
    first, count, segments = "", 0, 0
    for number, line in enumerate(joined):
        points = _fitted(line, number, touched, WITHIN * gap, tolerance)
        if points is None:
            out.append(line)
            continue
        first, segments = first or line.name, segments + len(line.points) - 1
        count += 1
        out.append(replace(line, points=points, curve=line.curve or lines_through(line.points)))
    if not count:
        return list(lines), []
    what = "line is taken as a smooth curve" if count == 1 else "lines are taken as smooth curves"
    return out, [
        f"{count} {what} within {WITHIN * gap:.2g} mm of the ends of {segments} short segments (first {first}); "
        "corners stay"
    ]


def _fitted(
    line: DrawnLine, number: int, touched: tuple[Array, Array], within: float, tolerance: float
) -> Array | None:
    """The line's points on curves, or None where no run of it is fine."""
    points = line.points
    if len(points) <= LEAST or (line.curve is not None and not _segments(line.curve)):
        return None
    closed = bool(np.array_equal(points[0], points[-1]))
    sharp = np.flatnonzero(_breaks(points, closed))
    if closed and len(sharp) and sharp[0] > 0:  # begin at a break
        points = np.vstack((points[sharp[0] :], points[1 : sharp[0] + 1]))
        sharp = np.flatnonzero(_breaks(points, closed))
    inner = sharp[(sharp > 0) & (sharp < len(points) - 1)]
    parts, found = [], False
    for a, b in pairwise([0, *inner.tolist(), len(points) - 1]):
        run = points[a : b + 1]
        whole = closed and not len(sharp)
        curve = _curve(run, whole, within, tolerance) if not _met(run, number, touched, within) else None
        found = found or curve is not None
        parts.append(run if curve is None else curve)
    return np.vstack([parts[0], *(part[1:] for part in parts[1:])]) if found else None


def _breaks(points: Array, closed: bool) -> NDArray[np.bool_]:
    """Where no curve goes through a vertex (k,): at corners, and at both ends of long straight segments."""
    found = corners(points, closed)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    long = lengths > LONG * float(np.median(lengths))
    found[:-1] |= long
    found[1:] |= long
    if closed:
        found[0] = found[-1] = found[0] or found[-1]
    return found


def _curve(run: Array, closed: bool, within: float, tolerance: float) -> Array | None:
    """Points on the spline past a run of vertices, or None where these are no curve."""
    from scipy.interpolate import splev, splprep

    if not LEAST < len(run) <= LONGEST:
        return None
    steps = np.diff(run, axis=0)
    heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    if np.abs(np.diff(heading)).max() > FINE or np.ptp(heading) < STRAIGHT:
        return None
    if closed and abs((heading[0] - heading[-1] + math.pi) % (2.0 * math.pi) - math.pi) > FINE:
        return None
    weights = np.ones(len(run))
    weights[[0, -1]] = EXACT
    for part in PARTS:  # the last goes through every vertex
        spline, at = splprep(run.T, w=weights, s=len(run) * (part * within) ** 2, per=int(closed))
        off = np.linalg.norm(np.column_stack(splev(at, spline)) - run, axis=1)
        if off.max() <= within and len(spline[0]) < KNOTS * len(run):
            break
    dense = np.linspace(0.0, 1.0, 8 * len(run))
    bend = np.linalg.norm(np.column_stack(splev(dense, spline, der=2)), axis=1).max()
    chords = min(max(math.ceil(math.sqrt(bend / (8.0 * tolerance))), LEAST), LONGEST)
    points = np.column_stack(splev(np.linspace(0.0, 1.0, chords + 1), spline))
    points[[0, -1]] = run[[0, -1]]
    return points if off.max() <= within and _beside(points, run, within) else None


def _beside(points: Array, run: Array, within: float) -> bool:
    """Is the curve nowhere further off the segments than an arc through their ends, and the tolerance?"""
    import shapely

    lengths = np.linalg.norm(np.diff(run, axis=0), axis=1)
    sagitta = float(lengths.max()) * FINE / 4.0
    return float(shapely.distance(shapely.points(points), shapely.LineString(run)).max()) <= within + sagitta


def _segments(curve: Chain) -> bool:
    return all(isinstance(piece, Line) for piece in curve.pieces)


def _places(lines: Sequence[DrawnLine]) -> tuple[Array, Array]:
    """The ends of all lines, (2 n, 2) mm, and the numbers of the lines (2 n,)."""
    ends = np.vstack([line.points[[0, -1]] for line in lines])
    return ends, np.repeat(np.arange(len(lines)), 2)


def _met(run: Array, number: int, touched: tuple[Array, Array], within: float) -> bool:
    """Do other lines end at so many of its vertices that its segments are meant?"""
    from scipy.spatial import cKDTree

    ends, owner = touched
    others = ends[owner != number]
    if not len(others) or len(run) <= LEAST:
        return False
    near = cKDTree(others).query(run[1:-1], distance_upper_bound=within)[0]
    return float(np.isfinite(near).mean()) > MET


def _end_to_end(lines: Sequence[DrawnLine], near: float) -> list[DrawnLine]:
    """The lines with chains of `LEAST` or more single segments of one kind as one line each."""
    at: dict[tuple[int, int], list[End]] = {}
    places = {}
    for number, line in enumerate(lines):
        for end in (0, -1):
            key = tuple(np.round(line.points[end] / (4.0 * near)).astype(np.int64).tolist())
            places[number, end] = key
            at.setdefault(key, []).append((number, end))

    def after(number: int, end: int) -> End | None:
        """The segment that goes on smoothly from that end of a segment, and at which of its ends it begins."""
        here = at[places[number, end]]
        if len(here) != 2 or here[0][0] == here[1][0]:
            return None
        other = here[0] if here[1] == (number, end) else here[1]
        one, two = lines[number], lines[other[0]]
        if not _alike(one, two):
            return None
        u = one.points[end] - one.points[-1 - end]
        v = two.points[-1 - other[1]] - two.points[other[1]]
        turn = abs(math.atan2(u[0] * v[1] - u[1] * v[0], float(u @ v)))
        return other if turn <= CORNER else None

    gone: set[int] = set()
    out = list(lines)
    for number, line in enumerate(lines):
        if number in gone or len(line.points) != 2:
            continue
        chain = _walk(number, after)
        if len(chain) < LEAST:
            continue
        points = [lines[chain[0][0]].points[chain[0][1]]]
        points += [lines[k].points[-1 - begin] for k, begin in chain]
        together = np.array(points)
        out[number] = replace(line, points=together, curve=lines_through(together))
        gone |= {k for k, _ in chain} - {number}
    return [line for number, line in enumerate(out) if number not in gone]


def _walk(number: int, after: Callable[[int, int], End | None]) -> list[End]:
    """The segments of a chain in order, each with the end that it begins at; closed ones begin with `number`."""
    chain: list[End] = [(number, 0)]
    while (ahead := after(chain[-1][0], -1 - chain[-1][1])) is not None and ahead[0] != number:
        chain.append(ahead)
    if ahead is not None:
        return chain
    back: list[End] = []
    at, end = number, 0
    while (before := after(at, end)) is not None:
        at, end = before[0], -1 - before[1]
        back.append((at, end))
    return back[::-1] + chain


def _alike(one: DrawnLine, two: DrawnLine) -> bool:
    """Two single segments of one kind, angle and layer."""
    if len(one.points) != 2 or len(two.points) != 2:
        return False
    angles = one.angle == two.angle or (math.isnan(one.angle) and math.isnan(two.angle))
    return one.kind == two.kind and one.layer == two.layer and angles
