"""Patterns that are asked for often. Lengths in mm, angles in rad; every sheet lies in z = 0."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from meshes.curves import Arc, Array, Curve, Line, sample
from meshes.errors import PatternError
from meshes.pattern import Crease, CreasePattern, FoldKind

Folds = FoldKind | Sequence[FoldKind]


def strip(
    length: float, width: float, creases: Sequence[float] = (), folds: Folds = "mountain"
) -> CreasePattern:
    """A rectangle 0 <= x <= length, 0 <= y <= width, with straight creases along x at the heights `creases`.

    Edges are "inner" (y = 0), "outer" (y = width), "start" (x = 0) and "end" (x = length).
    """
    length = _positive("length", length)
    width = _positive("width", width)
    heights = [float(y) for y in creases]
    if any(not 0.0 < y < width for y in heights) or sorted(set(heights)) != heights:
        raise PatternError(
            f"strip creases {heights} leave the sheet or are not in order; give rising heights between 0 and {width:g}"
        )
    rails: list[Curve] = [Line((0.0, y), (length, y)) for y in [0.0, *heights, width]]
    return _between_rails(rails, folds)


def annulus_sector(
    radius: float | Sequence[float], width: float, angle: float, folds: Folds = "mountain"
) -> CreasePattern:
    """A sector of an annulus with one or more concentric creases.

    Args:
        radius: radius of the crease, or rising radii of several creases, mm.
        width: of the panel inside the first and outside the last crease, mm.
        angle: of the sector, rad, in (0, 2 pi).
        folds: "mountain" or "valley" for all, or one word a crease from the inside.

    The first radial edge lies on the x axis and the centre at the origin.
    """
    angle = _positive("angle", angle)
    if angle >= 2.0 * math.pi:
        hint = "; angles are radians, not degrees" if 7.0 < angle <= 360.0 else ""
        raise PatternError(f"angle {angle:g} rad closes the sector; use full_annulus for a whole turn{hint}")
    radii = _radii(radius, width)
    return _between_rails([Arc((0.0, 0.0), r, 0.0, angle) for r in radii], folds)


def full_annulus(radius: float | Sequence[float], width: float, folds: Folds = "mountain") -> CreasePattern:
    """A whole annulus with concentric creases; arguments as for `annulus_sector`."""
    return _between_rails([Arc((0.0, 0.0), r, 0.0, 2.0 * math.pi) for r in _radii(radius, width)], folds)


def _radii(radius: float | Sequence[float], width: float) -> list[float]:
    try:
        creases = [float(r) for r in np.atleast_1d(np.asarray(radius, dtype=float))]
    except (TypeError, ValueError) as error:
        raise PatternError(f"radius = {radius!r} is not a number; give radii in mm") from error
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


def _between_rails(rails: Sequence[Curve], folds: Folds) -> CreasePattern:
    count = len(rails) - 2
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
    if inner.closed:
        rings = (sample(outer)[:-1], sample(inner)[:-1])
    else:
        rings = (np.vstack((sample(inner), sample(outer)[::-1])),)
        ends = np.array([0.0, 1.0])
        (a, b), (c, d) = inner.point(ends), outer.point(ends)
        edges += (("start", Line(tuple(a), tuple(c))), ("end", Line(tuple(b), tuple(d))))
    return CreasePattern(rings=rings, creases=creases, rails=tuple(rails), edges=edges)


def _positive(name: str, value: float) -> float:
    try:
        if isinstance(value, str):
            raise TypeError
        value = float(value)
    except (TypeError, ValueError) as error:
        raise PatternError(f"{name} = {value!r} is not a number; give a positive length or angle") from error
    if not math.isfinite(value) or value <= 0.0:
        raise PatternError(f"{name} = {value:g} cannot be; give a positive length or angle")
    return value
