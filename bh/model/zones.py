"""Zones of a sheet that are made of something else: faces of the drawing, polygons, what closed lines enclose."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.laminate import laminate
from bh.model.sheet import Sheet
from meshes import SheetMesh
from meshes.topology import Ints, chain_nodes
from meshes.wide import SIDES, STRIP

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Where = str | tuple[str, ...] | tuple[tuple[float, float], ...]
WAYS = (
    '"face:X,Y" (the face around a point, mm), "inside:PLACE" or "layer:NAME" (what closed lines enclose), '
    '"strip:CREASE" (a wide crease), "all", '
    "a list of these, or a polygon [[x, y], ...]"
)
STIFFER = ("E", "E2", "G12")


class Sections(NamedTuple):
    """What every triangle of a mesh is made of.

    Attributes:
        sheets: the sheet itself, then those of the zones.
        of: (t,) which of them a triangle is of; None where all are of the first.
    """

    sheets: tuple[Sheet, ...]
    of: Ints | None

    def each(self, values: Sequence[object]) -> Array:
        """Values of the sheets (s, ...) as those of the triangles (t, ...), or (1, ...) of a sheet without zones.

        Args:
            values: one for each of `sheets`.
        """
        out = np.asarray(values, dtype=float)
        return out[:1] if self.of is None else np.asarray(out[self.of])

    def borders(self, mesh: SheetMesh) -> Bools:
        """(m,) hinges between triangles of different zones.

        Args:
            mesh: of the sheet.
        """
        sides = mesh.topology.edge_triangles[mesh.topology.hinge_edges]
        if self.of is None:
            return np.zeros(len(sides), dtype=bool)
        return np.asarray(self.of[sides[:, 0]] != self.of[sides[:, 1]])


@dataclass(frozen=True)
class SheetZone:
    """A part of the sheet that is made of something else.

    Attributes:
        where: "face:X,Y", the face of the drawing around a point, as creases and lines of the kind flat bound it (mm);
            "inside:PLACE", what the closed lines of a place such as "crease:f1" enclose; "layer:NAME", the same of the
            flat lines of a layer of the drawing; "strip:NAME", a wide crease; "all"; several of these; or the corners
            of a polygon, (k, 2), mm: the triangles whose middle lies in it.
        sheet: its material and thickness.
        instead: of a strip whose thickness follows from the sheet in whose place it is: that sheet. It is not stored.
    """

    where: Where
    sheet: Sheet
    instead: Sheet | None = field(default=None, compare=False, repr=False)

    if TYPE_CHECKING:

        def __init__(
            self,
            where: str | Sequence[str] | Sequence[Sequence[float]],
            sheet: Sheet,
            instead: Sheet | None = None,
        ) -> None:
            """See the attributes."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        object.__setattr__(self, "where", _where(self.where))
        if not isinstance(self.sheet, Sheet):
            raise ModelError(f"the sheet of a zone is a {type(self.sheet).__name__}; give a bh.Sheet")


def changed(sheet: Sheet, stiff: float = 1.0, **values: float | str | None) -> Sheet:
    """A sheet with other values: what a zone is made of.

    Args:
        sheet: that the others are of.
        stiff: factor of all moduli; 1000 makes a panel that is as good as rigid.
        **values: fields of `bh.Sheet`.

    Raises:
        ModelError: a value that a sheet does not have, or that cannot be.
    """
    unknown = sorted(set(values) - {f.name for f in fields(Sheet)})
    if unknown:
        raise ModelError(f"a zone has no {unknown[0]}; give a sheet, stiff, or values of a sheet such as t")
    number = isinstance(stiff, int | float) and not isinstance(stiff, bool)
    if not (number and 0.0 < stiff < math.inf):
        raise ModelError(f"zone stiff = {stiff!r} cannot be; give a positive factor of the moduli")
    out = Sheet(**{**vars(sheet), **values})
    if stiff == 1.0:
        return out
    if out.plies is not None:
        return laminate([changed(ply, stiff) for ply in out.plies])
    moduli = {name: getattr(out, name) for name in STIFFER}
    return replace(out, **{name: stiff * value for name, value in moduli.items() if value is not None})


@lru_cache(maxsize=16)
def sections(mesh: SheetMesh, sheet: Sheet, zones: tuple[SheetZone, ...]) -> Sections:
    """What every triangle is made of.

    Args:
        mesh: of the sheet.
        sheet: where there is no zone.
        zones: that do not overlap; strips of wide creases are taken out of the others.

    Raises:
        ModelError: a zone that has no triangle, or two that share one, or one that is laid around a strip whose
            thickness was chosen for another sheet; one line.
    """
    if not zones:
        return Sections((sheet,), None)
    of = np.zeros(len(mesh.triangles), dtype=np.int64)
    strips = [number for number, zone in enumerate(zones, 1) if is_strip(zone)]
    for number, zone in sorted(enumerate(zones, 1), key=lambda item: is_strip(item[1])):
        inside = triangles_in(mesh, zone.where, f"zone {number}")
        taken = inside & (of > 0)
        if is_strip(zone):  # it is taken out of zones around it
            taken &= np.isin(of, strips)
        twice = np.flatnonzero(taken)
        if len(twice):
            x, y, _ = mesh.points[mesh.triangles[twice[0]]].mean(axis=0)
            raise ModelError(
                f"zones {of[twice[0]]} and {number} overlap at ({x:.4g}, {y:.4g}) mm; let every place be in one"
            )
        if is_strip(zone):
            _check_instead(zone, [sheet if n == 0 else zones[n - 1].sheet for n in np.unique(of[inside])])
        of[inside] = number
    of.setflags(write=False)
    return Sections((sheet, *(zone.sheet for zone in zones)), of)


def _check_instead(strip: SheetZone, around: Sequence[Sheet]) -> None:
    """See that a strip lies where the sheet is that its thickness was chosen for."""
    if strip.instead is not None and any(sheet != strip.instead for sheet in around):
        raise ModelError(
            f"wide crease '{str(strip.where).removeprefix(STRIP)}' has Lstar or stiffness and was made as thin as that "
            f"takes in a sheet of t = {strip.instead.t:g} mm, but the sheet there is another one now (of the model, "
            "or of a zone that was added later); give sheet and zones before wide creases"
        )


def triangles_in(mesh: SheetMesh, where: str | Sequence[str] | Sequence[Sequence[float]], what: str) -> Bools:
    """(t,) triangles of a region.

    Args:
        mesh: the stress-free sheet.
        where: see `SheetZone`.
        what: it is for, in words.

    Raises:
        ModelError: it names no place of this sheet, or no triangle lies in it; one line.
    """
    where = _where(where)
    if isinstance(where, tuple) and not isinstance(where[0], str):
        inside = _polygon(mesh, np.asarray(where, dtype=float))
    else:
        names = (where,) if isinstance(where, str) else where
        inside = np.zeros(len(mesh.triangles), dtype=bool)
        for name in names:
            inside |= _named(mesh, str(name), what)
    if not inside.any():
        raise ModelError(
            f"{what}: no triangle of the mesh lies in {_shown(where)}; move it, or refine the mesh"
        )
    return inside


def _named(mesh: SheetMesh, where: str, what: str) -> Bools:
    kind, _, rest = where.partition(":")
    if where == "all":
        return np.ones(len(mesh.triangles), dtype=bool)
    if kind == "face":
        return _face(mesh, where, rest, what)
    if kind == "inside":
        return _enclosed(mesh, rest, what)
    if kind == STRIP[:-1]:
        return _strip(mesh, rest, what)
    if kind == "layer":
        layers = [name.removeprefix("layer:") for name in mesh.edge_sets if name.startswith("layer:")]
        if rest not in layers:
            raise ModelError(
                f"{what}: the drawing has no layer '{rest}' of flat lines; it has {', '.join(layers) or 'none'}"
            )
        return _enclosed(mesh, where, what)
    raise ModelError(f"{what}: where = '{where}' is not known; give {WAYS}")


def _face(mesh: SheetMesh, where: str, place: str, what: str) -> Bools:
    try:
        x, y = (float(word) for word in place.split(","))
    except ValueError:
        raise ModelError(f"{what}: '{where}' is no face; write a point in it in mm: face:10.5,20") from None
    corner = mesh.points[mesh.triangles][:, :, :2]
    to = np.array([x, y]) - corner
    side = np.roll(corner, -1, axis=1) - corner
    left = side[..., 0] * to[..., 1] - side[..., 1] * to[..., 0]
    there = np.flatnonzero((left >= -1e-12 * mesh.size**2).all(axis=1) | (left <= 0.0).all(axis=1))
    if len(there) == 0:
        raise ModelError(f"{what}: '{where}' names no face: ({x:g}, {y:g}) mm is not on the sheet")
    every = [pairs for name, pairs in mesh.edge_sets.items() if name.startswith("crease:")]
    label = _pieces(mesh, np.vstack(every) if every else np.zeros((0, 2), dtype=np.int64))
    faces = np.unique(label[there])
    if len(faces) > 1:
        raise ModelError(f"{what}: '{where}' lies on a line between two faces; name a point inside one")
    return np.asarray(label == faces[0])


def _enclosed(mesh: SheetMesh, place: str, what: str) -> Bools:
    """Triangles that cannot be reached from the outline without crossing the lines of a place."""
    if place not in mesh.edge_sets:
        raise ModelError(
            f"{what}: the sheet has no lines '{place}'; use one of {', '.join(mesh.edge_sets) or 'none'}"
        )
    topology = mesh.topology
    lines = topology.find_edges(mesh.edge_sets[place])
    label = _pieces(mesh, mesh.edge_sets[place])
    rim = topology.edge_triangles[:, 1] < 0
    rim[lines] = False
    outside = np.unique(label[topology.edge_triangles[rim, 0]])
    inside = ~np.isin(label, outside)
    if not inside.any():
        raise ModelError(f"{what}: the lines '{place}' enclose nothing; close them, or name a face")
    return np.asarray(inside)


def is_strip(zone: SheetZone) -> bool:
    """Is it the strip of a wide crease?

    Args:
        zone: of a sheet.
    """
    return isinstance(zone.where, str) and zone.where.startswith(STRIP)


def _strip(mesh: SheetMesh, crease: str, what: str) -> Bools:
    """Triangles between the two lines of a wide crease: those at one line on the side of the other, and all around."""
    import shapely

    if STRIP + crease not in mesh.edge_sets:
        known = ", ".join(name for name in mesh.edge_sets if name.startswith(STRIP)) or "none"
        raise ModelError(f"{what}: the sheet has no wide crease '{crease}'; it has {known}")
    topology = mesh.topology
    pairs = [mesh.edge_sets[f"crease:{crease}-{side}"] for side in SIDES]
    at = topology.edge_triangles[topology.find_edges(pairs[0])]
    other = shapely.LineString(mesh.points[chain_nodes(pairs[1]), :2])
    middle = mesh.points[mesh.triangles[at]].mean(axis=2)[..., :2]
    near = shapely.distance(other, shapely.points(middle)).argmin(axis=1)
    label = _pieces(mesh, np.vstack(pairs))
    return np.isin(label, label[at[np.arange(len(at)), near]])


def _pieces(mesh: SheetMesh, pairs: Ints) -> Ints:
    """(t,) number of the piece of every triangle when the sheet is cut along edges (k, 2)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    topology = mesh.topology
    joined = topology.edge_triangles[:, 1] >= 0
    joined[topology.find_edges(pairs)] = False
    one, two = topology.edge_triangles[joined].T
    count = len(mesh.triangles)
    graph = coo_array((np.ones(len(one)), (one, two)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _polygon(mesh: SheetMesh, corners: Array) -> Bools:
    import shapely

    region = shapely.Polygon(corners)
    if not region.is_valid or region.area <= 0.0:
        raise ModelError(
            f"the polygon of a zone crosses itself or has no area ({shapely.is_valid_reason(region)}); redraw it"
        )
    middle = mesh.points[mesh.triangles].mean(axis=1)
    return np.asarray(shapely.contains_xy(region, middle[:, 0], middle[:, 1]), dtype=bool)


def _where(where: object) -> Where:
    """A region as frozen data."""
    if isinstance(where, str) and where:
        return where
    if isinstance(where, Sequence) and len(where):
        if all(isinstance(each, str) for each in where):
            return tuple(str(each) for each in where)
        corners = [_corner(each) for each in where]
        found = tuple(each for each in corners if each is not None)
        if len(found) == len(corners) >= 3:
            return found
    raise ModelError(f"where = {where!r} cannot be; give {WAYS}")


def _corner(value: object) -> tuple[float, float] | None:
    if isinstance(value, str) or not isinstance(value, Sequence) or len(value) != 2:
        return None
    x, y = value
    good = all(isinstance(each, int | float) and math.isfinite(each) for each in (x, y))
    return (float(x), float(y)) if good else None


def _shown(where: Where) -> str:
    return f"'{where}'" if isinstance(where, str) else "the region " + str([*where][:4])
