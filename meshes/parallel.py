"""Sheets with parallel creases, described by the first of them (source 5.3.2, 6.2.1). Lengths in mm, angles in rad."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from meshes.curves import Arc, ArcChain, Curve, Line
from meshes.errors import PatternError
from meshes.library import Folds, between_rails
from meshes.limits import check_limit
from meshes.pattern import CreasePattern, FoldKind
from meshes.quantities import Typed, number, numbers


def parallel_creases(
    curvature: Typed | Sequence[Typed],
    length: Typed | Sequence[Typed],
    spacing: Typed = 5.0,
    creases: int = 1,
    folds: Folds | None = None,
) -> CreasePattern:
    """One crease, or several at equal distances on its left, on a strip that goes as far beyond the outer ones.

    The first crease begins at the origin along x and turns to the left (towards y) where its curvature is positive;
    with curvature 0 the pattern is that of `strip`. One curvature gives concentric arcs, of which the first has the
    lowest curvature if that is positive (the source's annulus sectors); a list gives pieces that run into one another.

    The edges are "inner" (right of the first crease), "outer" (left of the last one), "start" and "end"; one crease is
    named `crease`, several are `crease-1`, `crease-2`, ... from the right.

    Args:
        curvature: kappa_0 of the first crease, 1/mm, of any sign; one number, or one a piece.
        length: of the first crease, mm; one number, or one a piece.
        spacing: between creases, and between the outermost creases and the edges, mm.
        creases: how many.
        folds: one word a crease, or one for all; by default alternating, the first one mountain.

    Raises:
        PatternError: a curve is narrower than its offsets, or the sheet meets itself.
    """
    curvatures = [float(k) for k in np.atleast_1d(np.asarray(numbers(curvature, "curvature"), dtype=float))]
    lengths = [float(each) for each in np.atleast_1d(np.asarray(numbers(length, "length"), dtype=float))]
    spacing = number(spacing, "length")
    check_limit("pieces", len(curvatures), "this crease", PatternError)
    if len(lengths) != len(curvatures):
        raise PatternError(
            f"{len(curvatures)} curvatures for {len(lengths)} lengths; give one of each a piece"
        )
    if not all(math.isfinite(each) and each > 0.0 for each in [*lengths, spacing]):
        raise PatternError(f"lengths {lengths} and spacing {spacing:g} must be positive, in mm")
    if isinstance(creases, bool) or not isinstance(creases, int | np.integer) or creases < 1:
        raise PatternError(f"creases = {creases!r} cannot be; give a whole number from 1")
    check_limit("creases", creases, "this pattern", PatternError)
    offsets = [spacing * i for i in range(-1, creases + 1)]
    for k in curvatures:
        if not math.isfinite(k):
            raise PatternError(f"curvature = {k} cannot be; give a number in 1/mm")
        if min(1.0 - k * offsets[0], 1.0 - k * offsets[-1]) <= 0.0:
            raise PatternError(
                f"a crease of curvature {k:g} /mm has a radius of {1.0 / abs(k):.4g} mm, but the sheet goes "
                f"{offsets[-1] if k > 0.0 else spacing:g} mm to that side; make it wider or the spacing smaller"
            )
    rails = [_rail(curvatures, lengths, offset) for offset in offsets]
    kinds: Folds = [_alternate(i) for i in range(creases)] if folds is None else folds
    return between_rails(rails, kinds)


def _alternate(i: int) -> FoldKind:
    return "valley" if i % 2 else "mountain"


def _rail(curvatures: list[float], lengths: list[float], offset: float) -> Curve:
    if len(curvatures) > 1:
        return ArcChain((0.0, 0.0), 0.0, tuple(curvatures), tuple(lengths), offset)
    k = curvatures[0]
    if k == 0.0:
        return Line((0.0, offset), (lengths[0], offset))
    side = math.copysign(1.0, k)
    return Arc((0.0, 1.0 / k), side * (1.0 / k - offset), -side * 0.5 * math.pi, k * lengths[0])
