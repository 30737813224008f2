"""Patterns that are asked for often. Lengths in mm, angles in rad; every sheet lies in z = 0."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from meshes.curves import Arc, Array, Curve, Line, Polyline, sample
from meshes.errors import PatternError
from meshes.limits import check_limit
from meshes.pattern import Crease, CreasePattern, FoldKind
from meshes.quantities import QuantityError, Typed, degrees_meant, number, numbers

Folds = FoldKind | Sequence[FoldKind]
CHORDS = 2048  # of a graph, so fine that nodes between its vertices are off by less than 1e-5 of the sheet


def strip(
    length: Typed, width: Typed, creases: Sequence[Typed] = (), folds: Folds = "mountain"
) -> CreasePattern:
    """A rectangle 0 <= x <= length, 0 <= y <= width, with straight creases along x at the heights `creases`.

    Edges are "inner" (y = 0), "outer" (y = width), "start" (x = 0) and "end" (x = length).

    Args:
        length: along x, mm.
        width: along y, mm.
        creases: rising heights y of the creases, mm.
        folds: "mountain" or "valley" for all, or one word a crease.

    Raises:
        PatternError: sizes that cannot be, creases outside the sheet or out of order, or folds that are not
            one a crease.
    """
    length = _positive("length", length)
    width = _positive("width", width)
    heights = [float(number(y, "length")) for y in creases]
    check_limit("creases", len(heights), "this pattern", PatternError)
    if any(not 0.0 < y < width for y in heights) or sorted(set(heights)) != heights:
        raise PatternError(
            f"strip creases {heights} leave the sheet or are not in order; give rising heights between 0 and {width:g}"
        )
    rails: list[Curve] = [Line((0.0, y), (length, y)) for y in [0.0, *heights, width]]
    return between_rails(rails, folds)


def annulus_sector(
    radius: Typed | Sequence[Typed], width: Typed, angle: Typed, folds: Folds = "mountain"
) -> CreasePattern:
    """A sector of an annulus with one or more concentric creases.

    The first radial edge lies on the x axis and the centre at the origin.

    Args:
        radius: radius of the crease, or rising radii of several creases, mm.
        width: of the panel inside the first and outside the last crease, mm.
        angle: of the sector, rad, in (0, 2 pi).
        folds: "mountain" or "valley" for all, or one word a crease from the inside.

    Raises:
        PatternError: sizes that cannot be, radii out of order, or folds that are not one a crease.
    """
    angle = _positive("angle", angle)
    if angle >= 2.0 * math.pi:
        hint = degrees_meant(angle)
        raise PatternError(f"angle {angle:g} rad closes the sector; use full_annulus for a whole turn{hint}")
    radii = _radii(radius, width)
    return between_rails([Arc((0.0, 0.0), r, 0.0, angle) for r in radii], folds)


def full_annulus(radius: Typed | Sequence[Typed], width: Typed, folds: Folds = "mountain") -> CreasePattern:
    """A whole annulus with concentric creases; arguments as for `annulus_sector`.

    Args:
        radius: radius of the crease, or rising radii of several creases, mm.
        width: of the panel inside the first and outside the last crease, mm.
        folds: "mountain" or "valley" for all, or one word a crease from the inside.

    Raises:
        PatternError: sizes that cannot be, radii out of order, or folds that are not one a crease.
    """
    return between_rails([Arc((0.0, 0.0), r, 0.0, 2.0 * math.pi) for r in _radii(radius, width)], folds)


def two_arcs(
    width: Typed = 100.0,
    height: Typed = 100.0,
    radii: Sequence[Typed] = (80.0, 250.0),
    at: Sequence[Typed] = (35.0, 70.0),
    folds: Folds = ("mountain", "valley"),
) -> CreasePattern:
    """A rectangle with circular creases across it that bulge the same way, upwards (source Fig. 3.7 c and 3.8 d).

    The sheet and its edges are those of `strip`.

    Args:
        width: along x, mm.
        height: along y, mm.
        radii: of the creases from below, mm; each at least half the width.
        at: heights of their tops in the middle of the sheet, mm, rising.
        folds: "mountain" or "valley" for both, or one word a crease.

    Raises:
        PatternError: an arc that does not reach across the sheet, or creases that leave it or cross.
    """
    width = _positive("width", width)
    sizes, tops = [_positive("radius", r) for r in radii], [float(number(y, "length")) for y in at]
    if len(sizes) != len(tops):
        raise PatternError(f"{len(sizes)} radii for {len(tops)} arcs; give one radius an arc")
    arcs: list[Curve] = []
    for r, y in zip(sizes, tops, strict=True):
        if 2.0 * r < width:
            raise PatternError(
                f"an arc of radius {r:g} mm cannot cross a sheet {width:g} mm wide; give at least half"
            )
        half = math.asin(0.5 * width / r)
        arcs.append(Arc((0.5 * width, y - r), r, 0.5 * math.pi + half, -2.0 * half))
    return _rectangle(width, height, arcs, folds)


def sine_tessellation(
    width: Typed = 100.0,
    height: Typed = 100.0,
    creases: int = 5,
    amplitude: Typed = 4.0,
    waves: float = 2.0,
    folds: Folds | None = None,
) -> CreasePattern:
    """A rectangle with equally spaced sine creases along x, alternately mountain and valley (source Fig. 3.7 b).

    Args:
        width: along x, mm.
        height: along y, mm.
        creases: how many.
        amplitude: of the sines, mm.
        waves: how many fit into the width.
        folds: one word a crease, or one for all; None is alternating, mountain first.

    Raises:
        PatternError: sizes that cannot be, or creases that leave the sheet or cross.
    """
    width, height = _positive("width", width), _positive("height", height)
    creases, amplitude = _count("creases", creases), _positive("amplitude", amplitude)
    k = 2.0 * math.pi * _positive("waves", waves) / width
    pitch = height / (creases + 1)

    def sine(middle: float) -> Curve:
        return _graph(width, lambda x: middle + amplitude * np.sin(k * x))

    curves = [sine(i * pitch) for i in range(1, creases + 1)]
    return _rectangle(width, height, curves, alternating(creases) if folds is None else folds)


def parabolic_canopy(
    width: Typed = 100.0,
    height: Typed = 100.0,
    creases: int = 3,
    sag: Typed = 15.0,
    folds: Folds | None = None,
) -> CreasePattern:
    """A rectangle with one parabola repeated upwards, alternately mountain and valley (source Fig. 3.7 d).

    Args:
        width: along x, mm.
        height: along y, mm.
        creases: how many.
        sag: how much lower the ends of the parabolas lie than their tops, mm; the tops are equally spaced
            about the middle of the sheet.
        folds: one word a crease, or one for all; None is alternating, mountain first.

    Raises:
        PatternError: sizes that cannot be, or creases that leave the sheet or cross.
    """
    width, height = _positive("width", width), _positive("height", height)
    creases, sag = _count("creases", creases), _positive("sag", sag)
    pitch = height / (creases + 1)

    def parabola(top: float) -> Curve:
        return _graph(width, lambda x: top - sag * (2.0 * x / width - 1.0) ** 2)

    curves = [parabola(i * pitch + 0.5 * sag) for i in range(1, creases + 1)]
    return _rectangle(width, height, curves, alternating(creases) if folds is None else folds)


def opposite_parabolas(
    side: Typed = 100.0, gap: Typed = 30.0, sag: Typed = 20.0, folds: Folds = "mountain"
) -> CreasePattern:
    """A square with two parabolas across it whose tops face each other in the middle (source Fig. 3.7 e).

    Args:
        side: of the square, mm.
        gap: between the tops, mm.
        sag: from a top to the ends of its parabola, towards the nearer edge, mm.
        folds: "mountain" or "valley" for both, or one word a crease.

    Raises:
        PatternError: sizes that cannot be, or creases that leave the sheet or cross.
    """
    side, gap, sag = _positive("side", side), _positive("gap", gap), _positive("sag", sag)

    def parabola(sign: float) -> Curve:
        return _graph(side, lambda x: 0.5 * side + sign * (0.5 * gap + sag * (2.0 * x / side - 1.0) ** 2))

    return _rectangle(side, side, [parabola(-1.0), parabola(1.0)], folds)


def _rectangle(width: float, height: Typed, curves: Sequence[Curve], folds: Folds) -> CreasePattern:
    """The sheet 0 <= x <= width, 0 <= y <= height with creases from x = 0 to x = width, from below."""
    height = _positive("height", height)
    rails = [Line((0.0, 0.0), (width, 0.0)), *curves, Line((0.0, height), (width, height))]
    for i, curve in enumerate(curves, 1):
        ends = curve.point(np.array([0.0, 1.0]))[:, 1]
        if ends.min() <= 0.0 or ends.max() >= height:
            raise PatternError(
                f"crease {i} ends at y = {ends[0]:g} mm, not on a side of the sheet; move it inside"
            )
    return between_rails(rails, folds)


def _graph(width: float, y: Callable[[Array], Array]) -> Polyline:
    """The curve y(x) over 0 <= x <= width."""
    x = np.linspace(0.0, width, CHORDS + 1)
    return Polyline(np.column_stack((x, y(x))))


def alternating(count: int) -> list[FoldKind]:
    """Mountain and valley in turn, mountain first.

    Returns:
        `count` words.
    """
    return ["valley" if i % 2 else "mountain" for i in range(count)]


def _count(name: str, value: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise PatternError(f"{name} = {value!r} cannot be; give a whole number from 1")
    check_limit("creases", int(value), "this pattern", PatternError)
    return int(value)


def _radii(radius: Typed | Sequence[Typed], width: Typed) -> list[float]:
    try:
        given = numbers(radius, "length")
        creases = [float(r) for r in np.atleast_1d(np.asarray(given, dtype=float))]
    except QuantityError as error:
        raise PatternError(f"radius = {error}") from error
    except (TypeError, ValueError) as error:
        raise PatternError(f"radius = {radius!r} is not a number; give radii in mm") from error
    check_limit("creases", len(creases), "this pattern", PatternError)
    for r in creases:
        _positive("radius", r)
    width = _positive("width", width)
    if not creases or sorted(set(creases)) != creases:
        raise PatternError(
            f"radii {creases} do not rise; give the crease radii from the inside to the outside"
        )
    if creases[0] <= width:
        raise PatternError(
            f"width {width:g} mm reaches the centre of a crease of radius {creases[0]:g} mm; make it smaller"
        )
    return [creases[0] - width, *creases, creases[-1] + width]


def between_rails(rails: Sequence[Curve], folds: Folds) -> CreasePattern:
    """A sheet between the first and the last of some curves, with creases along the others; these two may meet.

    Args:
        rails: curves, mm, in order across the sheet, all run the same way.
        folds: one word a crease, or one for all.

    Returns:
        The pattern; one crease is named "crease", several are "crease-1", "crease-2", ...

    Raises:
        PatternError: folds that are not one a crease, or creases that leave the sheet or cross.
    """
    count = len(rails) - 2
    check_limit("creases", count, "this pattern", PatternError)
    kinds: list[FoldKind] = [folds] * count if isinstance(folds, str) else list(folds)
    if len(kinds) != count:
        raise PatternError(f"{len(kinds)} folds for {count} creases; give one word a crease, or one for all")
    names = ["crease"] if count == 1 else [f"crease-{i + 1}" for i in range(count)]
    creases = tuple(
        Crease(name, rail, kind) for name, rail, kind in zip(names, rails[1:-1], kinds, strict=True)
    )
    inner, outer = rails[0], rails[-1]
    rings: tuple[Array, ...]
    edges: tuple[tuple[str, Curve], ...] = (("inner", inner), ("outer", outer))
    ends = np.array([0.0, 1.0])
    (a, b), (c, d) = inner.point(ends), outer.point(ends)
    if inner.closed:
        rings = (sample(outer)[:-1], sample(inner)[:-1])
    elif math.dist(a, c) > 0.0:
        rings = (np.vstack((sample(inner), sample(outer)[::-1])),)
        edges += (("start", Line(tuple(a), tuple(c))), ("end", Line(tuple(b), tuple(d))))
    else:
        rings = (np.vstack((sample(inner), sample(outer)[-2:0:-1])),)
    return CreasePattern(rings=rings, creases=creases, rails=tuple(rails), edges=edges)


def _positive(name: str, value: Typed) -> float:
    try:
        value = float(number(value, "angle" if name == "angle" else "length"))
    except QuantityError as error:
        raise PatternError(f"{name} = {error}") from error
    except (TypeError, ValueError) as error:
        raise PatternError(f"{name} = {value!r} is not a number; give a positive length or angle") from error
    if not math.isfinite(value) or value <= 0.0:
        raise PatternError(f"{name} = {value:g} cannot be; give a positive length or angle")
    return value
