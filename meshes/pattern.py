"""The flat crease pattern: what is drawn before anything is meshed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from meshes.curves import Array, Curve, sample
from meshes.errors import PatternError
from meshes.topology import Ints

if TYPE_CHECKING:
    from shapely import Polygon

FoldKind = Literal["mountain", "valley", "flat"]
FOLD_KINDS: tuple[FoldKind, ...] = ("mountain", "valley", "flat")


@dataclass(frozen=True)
class Crease:
    """A named crease curve.

    Attributes:
        name: without "crease:".
        curve: mm.
        fold: how it was drawn: mountain (dihedral < pi), valley (> pi) or flat.
        angle: how far it was drawn to fold, rad in [0, pi], or None.

    Raises:
        PatternError: a fold that is not known.
    """

    name: str
    curve: Curve
    fold: FoldKind = "mountain"
    angle: float | None = None

    def __post_init__(self) -> None:
        """Check the fold."""
        if self.fold not in FOLD_KINDS:
            raise PatternError(
                f"crease '{self.name}': fold '{self.fold}' is not known; use one of {', '.join(FOLD_KINDS)}"
            )


@dataclass(frozen=True, repr=False)
class CreasePattern:
    """A flat sheet with named creases, in millimetres.

    Attributes:
        rings: closed boundary curves as (k, 2) polygons without a repeated last vertex; the first is the
            outside, the others are holes.
        creases: the crease curves.
        rails: the curves from the inner to the outer edge that panels are ruled between (edges and creases in
            order, all run the same way); empty where a pattern has no such order, then only an unstructured
            mesh can be made of it.
        edges: names of boundary curves ("inner", "outer", "start", "end").
        facets: lines that a mesh is to follow though the sheet does not fold there, such as drawn rulings.
        groups: names for several places together, such as ("crease:mountain", ("crease:m1", "crease:m2")).
        remarks: what was taken for granted when the pattern was read, one line each.
        cuts: names and curves of the cuts inside the sheet, along which it opens, such as ("cut-1", Line(...)). They
            may end anywhere, and on each other; a closed one leaves a hole. Meshes name their lips "edge:cut-1".

    Raises:
        PatternError: a crease or a cut leaves the sheet, intersects itself or another one, or names are not unique.
    """

    rings: tuple[Array, ...]
    creases: tuple[Crease, ...] = ()
    rails: tuple[Curve, ...] = ()
    edges: tuple[tuple[str, Curve], ...] = ()
    units: Literal["mm"] = "mm"
    facets: tuple[Curve, ...] = ()
    groups: tuple[tuple[str, tuple[str, ...]], ...] = ()
    remarks: tuple[str, ...] = ()
    cuts: tuple[tuple[str, Curve], ...] = ()

    def __post_init__(self) -> None:
        """Check names and geometry."""
        if self.units != "mm":
            raise PatternError(f"units '{self.units}' are not known; give lengths in mm")
        names = [crease.name for crease in self.creases]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise PatternError(f"crease name '{twice[0]}' is used twice; give every crease its own name")
        names = [name for name, _ in (*self.edges, *self.cuts)]
        twice = sorted({name for name, _ in self.cuts if names.count(name) > 1})
        if twice:
            raise PatternError(f"name '{twice[0]}' of a cut is used twice; give every cut its own name")
        lines = [(f"crease '{crease.name}'", crease.curve) for crease in self.creases]
        _check_geometry(self.rings, lines + [(f"cut '{name}'", curve) for name, curve in self.cuts])

    def __repr__(self) -> str:
        """One line: "CreasePattern(120 x 40 mm, 5 creases, 1 hole)"."""
        x, y = (float(side) for side in np.ptp(self.rings[0], axis=0))
        counts = (len(self.creases), "crease"), (len(self.rings) - 1, "hole"), (len(self.cuts), "cut")
        parts = [f"{n} {what}{'' if n == 1 else 's'}" for n, what in counts if n or what == "crease"]
        return f"CreasePattern({x:.4g} x {y:.4g} mm, {', '.join(parts)})"

    @property
    def closed(self) -> bool:
        """True where the rails close on themselves (a full annulus)."""
        return bool(self.rails) and self.rails[0].closed

    @cached_property
    def panel_sizes(self) -> tuple[Array, Array]:
        """Mean length along and height across of every panel between two rails, mm; many meshes are tried on them."""
        u = np.linspace(0.0, 1.0, 65)
        lengths = np.array([rail.length for rail in self.rails])
        heights = [
            float(np.linalg.norm(b.point(u) - a.point(u), axis=1).mean())
            for a, b in zip(self.rails[:-1], self.rails[1:], strict=True)
        ]
        return 0.5 * (lengths[:-1] + lengths[1:]), np.array(heights)

    @property
    def folds(self) -> dict[str, FoldKind]:
        """How creases, and groups of creases that are drawn alike, were drawn."""
        each = {crease.name: crease.fold for crease in self.creases}
        for name, members in self.groups:
            kinds = {each.get(member.removeprefix("crease:")) for member in members}
            if name.startswith("crease:") and len(kinds) == 1 and None not in kinds:
                each[name.removeprefix("crease:")] = kinds.pop()  # type: ignore[assignment]
        return each


def with_groups(pattern: CreasePattern, sets: dict[str, Ints]) -> dict[str, Ints]:
    """The edge sets of a mesh with those of the pattern's groups in front, whose members are joined.

    Args:
        pattern: has the groups.
        sets: (k, 2) node pairs by name, such as "crease:m1".

    Returns:
        (k, 2) node pairs by name.
    """
    joined = {
        name: np.vstack([sets[member] for member in members])
        for name, members in pattern.groups
        if all(member in sets for member in members)
    }
    return joined | sets


def drawn_angles(pattern: CreasePattern, sets: Mapping[str, Ints]) -> dict[str, Array]:
    """Drawn fold angles of the creases of a mesh; none if no crease has one.

    Args:
        pattern: has the angles.
        sets: (k, 2) node pairs by name, such as "crease:m1".

    Returns:
        By crease (k,) angles, one an edge, rad, mountain positive, nan where a crease has none.
    """
    sign = {"mountain": 1.0, "valley": -1.0, "flat": 0.0}
    each = {c.name: sign[c.fold] * (np.nan if c.angle is None else c.angle) for c in pattern.creases}
    if all(crease.angle is None for crease in pattern.creases):
        return {}
    members = {name: [m.removeprefix("crease:") for m in parts] for name, parts in pattern.groups}
    members |= {f"crease:{name}": [name] for name in each}
    return {
        name.removeprefix("crease:"): np.concatenate(
            [np.full(len(sets[f"crease:{part}"]), each[part]) for part in parts]
        )
        for name, parts in members.items()
        if name in sets and all(part in each for part in parts)
    }


def sheet_polygon(rings: Sequence[Array]) -> Polygon:
    """The flat sheet inside its outline, without its holes, as a polygon of shapely.

    Args:
        rings: (k, 2) corners of the outline, then those of every hole, mm.
    """
    import shapely

    return shapely.Polygon(rings[0], holes=list(rings[1:]))


def _check_geometry(rings: Sequence[Array], curves: Sequence[tuple[str, Curve]]) -> None:
    """Creases and cuts (in words) lie inside the outline, are simple and do not cross; predicates by shapely."""
    import shapely

    if not rings:
        raise PatternError("the pattern has no outline; give at least one boundary ring")
    for ring in rings:
        if len(ring) < 3 or not np.all(np.isfinite(ring)):
            raise PatternError("a boundary ring needs at least three finite points")
    sheet = sheet_polygon(rings)
    if not sheet.is_valid or sheet.area <= 0.0:
        raise PatternError(
            f"the outline is not a simple polygon ({shapely.is_valid_reason(sheet)}); redraw it"
        )
    size = float(np.ptp(rings[0], axis=0).max())
    # chords of curved outlines cut the sheet short by up to the sampling tolerance
    grown = sheet.buffer(2e-3 + 1e-6 * size)
    lines = []
    for what, curve in curves:
        # before sampling: an arc of radius 0 or nan cannot be sampled
        if not 0.0 < curve.length < np.inf or not np.all(np.isfinite(points := sample(curve))):
            raise PatternError(f"{what} has no length; give it two distinct finite points")
        line = shapely.LineString(points)
        if not line.is_simple:
            raise PatternError(f"{what} crosses itself; split or redraw it")
        if not grown.covers(line):
            raise PatternError(f"{what} leaves the sheet; move it inside the outline")
        lines.append(line)
    shapes = np.array(lines, dtype=object)
    for i, j in shapely.STRtree(shapes).query(shapes, predicate="intersects").T.tolist():
        if j >= i:
            continue
        first, second = lines[i], lines[j]
        if first.crosses(second) or (first.intersection(second).length > 1e-6 * size):
            one, two = curves[j][0], curves[i][0]
            both = (
                f"creases {one[7:]} and {two[7:]}" if one[:6] == two[:6] == "crease" else f"{one} and {two}"
            )
            raise PatternError(f"{both} cross; let them meet only at end points")
