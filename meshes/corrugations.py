"""Corrugation patterns: sheets with pleats along curves that a plane of symmetry maps onto themselves (source 4.3).

The sheet lies over -W/2 <= x <= W/2 with its straight edge on y = 0; curves y_1 ... y_n are counted from there, the
last one is the outer edge and all others are creases, alternately mountain and valley. All lengths are in mm.

Every curved pattern here is of one family,

    y_i(x) = E_i (1 - |2 x / W|^p)^(1/q) + F_i,  E_i = H (s i / n + 1 - s),  F_i = H (1 - s) (i / n - 1),

with tops at H i / n: parabolas for p = 2, q = 1 and ellipses for p = q = 2; for the spread s = 1 all creases meet in
the two corners ("point"), for s = 0 they are copies shifted along y that end at the straight edge ("edge").
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from meshes.curves import Array, Curve, Line, Polyline
from meshes.errors import PatternError
from meshes.library import alternating, between_rails
from meshes.pattern import CreasePattern, FoldKind
from meshes.quantities import Typed, number

KINDS = ("straight", "parabolic-point", "parabolic-edge", "elliptical-point", "elliptical-edge")
FAMILY = {  # exponent p, root q and spread s
    "parabolic-point": (2.0, 1.0, 1.0),
    "parabolic-edge": (2.0, 1.0, 0.0),
    "elliptical-point": (2.0, 2.0, 1.0),
    "elliptical-edge": (2.0, 2.0, 0.0),
}
CHORDS = 2048  # of a curve: a node between its vertices is off by less than 1e-4 mm on a sheet of 100 mm
LARGEST = 100  # panels, and exponents


@dataclass(frozen=True)
class CorrugationTable:
    """Parameters of the curves of a corrugation as the source tabulates them (Tables 4.1-4.5).

    Attributes:
        form: the equation that they belong to.
        columns: name to (n,) values of the curves 1 ... n: a, or b and c, or d, e and f, and always r, the half width
            of the domain; mm, and 1/mm for b.
    """

    form: str
    columns: dict[str, Array]


def corrugation_table(
    kind: str, width: Typed = 100.0, height: Typed = 100.0, panels: int = 5
) -> CorrugationTable:
    """Parameters of the five example patterns from W, H and n_s (Eq. 4.7-4.16).

    Args:
        kind: one of `KINDS`.
        width: W along x, mm.
        height: H along y, mm.
        panels: n_s, sheets between creases, 2 to 100.

    Returns:
        The parameters of the curves 1 ... n_s, the last of which is the outer edge.

    Raises:
        PatternError: an unknown kind, or sizes that cannot be.
    """
    W, H, n = _sizes(width, height, panels)
    i = np.arange(1, n + 1)
    part = i / n
    if kind == "straight":
        return CorrugationTable("y = a", {"a": H * part, "r": np.full(n, 0.5 * W)})
    if kind == "parabolic-point":
        return CorrugationTable(
            "y = b x^2 + c", {"b": -4.0 * H * part / W**2, "c": H * part, "r": np.full(n, 0.5 * W)}
        )
    if kind == "parabolic-edge":
        b = np.full(n, -4.0 * H / W**2)
        return CorrugationTable("y = b x^2 + c", {"b": b, "c": H * part, "r": np.sqrt(-H * part / b)})
    form, d = "y = e sqrt(1 - (x / d)^2) + f", np.full(n, 0.5 * W)
    if kind == "elliptical-point":
        return CorrugationTable(form, {"d": d, "e": H * part, "f": np.zeros(n), "r": d})
    if kind == "elliptical-edge":
        e, f = np.full(n, H), H * (part - 1.0)
        return CorrugationTable(form, {"d": d, "e": e, "f": f, "r": d * np.sqrt(1.0 - (f / e) ** 2)})
    raise PatternError(f"corrugation kind '{kind}' is not known; use one of {', '.join(KINDS)}")


def corrugation(
    kind: str,
    width: Typed = 100.0,
    height: Typed = 100.0,
    panels: int = 5,
    folds: FoldKind | Sequence[FoldKind] | None = None,
) -> CreasePattern:
    """One of the five example patterns of the source: "straight", "parabolic-point", ... (Fig. 4.3).

    Args:
        kind: one of `KINDS`.
        width: W along x, mm.
        height: H along y, mm.
        panels: n_s, sheets between creases; there are n_s - 1 creases, "crease-1" next to the straight edge.
        folds: one word a crease; None is alternately mountain and valley, mountain first.

    Returns:
        The pattern, with rails from the straight edge to the outer one.

    Raises:
        PatternError: an unknown kind, sizes that cannot be, or folds that are not one a crease.
    """
    if kind == "straight":
        W, H, n = _sizes(width, height, panels)
        rails: list[Curve] = [Line((-0.5 * W, H * i / n), (0.5 * W, H * i / n)) for i in range(n + 1)]
        return _pattern(rails, folds)
    if kind not in FAMILY:
        raise PatternError(f"corrugation kind '{kind}' is not known; use one of {', '.join(KINDS)}")
    p, q, s = FAMILY[kind]
    return curved_corrugation(p, q, s, width, height, panels, folds)


def curved_corrugation(
    exponent: float = 2.0,
    root: float = 1.0,
    spread: float = 0.0,
    width: Typed = 100.0,
    height: Typed = 100.0,
    panels: int = 5,
    folds: FoldKind | Sequence[FoldKind] | None = None,
) -> CreasePattern:
    """Any pattern of the family above.

    Args:
        exponent: p, from 1; larger ones make curves flatter in the middle and steeper at the ends.
        root: q, from 1, with the same effect.
        spread: s in [0, 1], from "edge" to "point".
        width: W along x, mm.
        height: H along y, mm.
        panels: n_s, sheets between creases.
        folds: one word a crease; None is alternately mountain and valley, mountain first.

    Returns:
        The pattern, with rails from the straight edge to the outer one.

    Raises:
        PatternError: an exponent, root, spread or size that cannot be, or folds that are not one a crease.
    """
    W, H, n = _sizes(width, height, panels)
    for name, value in (("exponent", exponent), ("root", root)):
        if not (math.isfinite(value) and 1.0 <= value <= LARGEST):
            raise PatternError(f"{name} = {value} cannot be; give a number from 1 to {LARGEST}")
    if not 0.0 <= spread <= 1.0:
        raise PatternError(f"spread = {spread} cannot be; give a number from 0 (edge) to 1 (point)")
    # vertices crowd at the ends, where the curves can be vertical
    turn = np.sin(np.linspace(-0.5 * math.pi, 0.5 * math.pi, CHORDS + 1))
    rails: list[Curve] = [Line((-0.5 * W, 0.0), (0.5 * W, 0.0))]
    for part in np.arange(1, n + 1) / n:
        E, F = H * (spread * part + 1.0 - spread), H * (1.0 - spread) * (part - 1.0)
        r = 0.5 * W * (1.0 - (max(-F, 0.0) / E) ** root) ** (1.0 / exponent)
        x = r * turn
        y = E * np.maximum(1.0 - np.abs(2.0 * x / W) ** exponent, 0.0) ** (1.0 / root) + F
        y[[0, -1]] = 0.0
        rails.append(Polyline(np.column_stack((x, np.maximum(y, 0.0)))))
    return _pattern(rails, folds)


def _pattern(rails: list[Curve], folds: FoldKind | Sequence[FoldKind] | None) -> CreasePattern:
    return between_rails(rails, alternating(len(rails) - 2) if folds is None else folds)


def _sizes(width: Typed, height: Typed, panels: int) -> tuple[float, float, int]:
    width, height = number(width, "length"), number(height, "length")
    for name, value in (("width", width), ("height", height)):
        if isinstance(value, bool | str) or not (math.isfinite(value) and value > 0.0):
            raise PatternError(f"{name} = {value!r} cannot be; give a positive length in mm")
    if isinstance(panels, bool) or not isinstance(panels, int | np.integer) or not 2 <= panels <= LARGEST:
        raise PatternError(f"panels = {panels!r} cannot be; give a whole number from 2 to {LARGEST}")
    return float(width), float(height), int(panels)
