"""Creases that are strips of some width: what such a strip is made of, how it is folded, and by how much it is.

A wide crease has no hinge. Its strip is sheet of another thickness or material between two flat lines
(`meshes.wide_creases`), which bends; its curvature at rest folds it, as the rest angle folds a sharp spring crease.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.sheet import Sheet
from bh.model.step import StepBuilder
from bh.model.zones import SheetZone, changed, is_strip, sections, triangles_in
from meshes import SheetMesh
from meshes.curves import Array, sample
from meshes.quantities import Typed, number
from meshes.topology import Ints, chain_nodes
from meshes.wide import SIDES, STRIP

Floats = NDArray[np.float64]


def strip(
    mesh: SheetMesh,
    name: str,
    sheet: Sheet,
    Lstar: Typed | None = None,
    stiffness: Typed | None = None,
    other: Sheet | None = None,
    stiff: float = 1.0,
    zones: Sequence[SheetZone] = (),
    **values: float | str | None,
) -> SheetZone:
    """The strip of a wide crease, as a zone of what it is made of.

    Args:
        mesh: with the strip.
        name: of the crease.
        sheet: of the model.
        Lstar: of the sharp crease that the strip stands for, mm, as ever of the sheet of the model: the strip is the
            material around it, so thin that it turns by the same angle under the same moment.
        stiffness: the same as a moment a length and angle, N mm / (mm rad).
        other: what the strip is made of, instead of the sheet of the model.
        stiff: factor of the moduli.
        zones: of the sheet; with `Lstar` or `stiffness` the strip is made of what they have around it.
        **values: fields of `bh.Sheet`, such as t.

    Raises:
        ModelError: the mesh has no such strip, or what is given cannot be, or is given twice, or the strip goes through
            several zones; one line.
    """
    if name not in mesh.wide_creases:
        known = ", ".join(mesh.wide_creases) or "none; draw them by meshes.wide_creases"
        raise ModelError(f"the sheet has no wide crease '{name}'; it has {known}")
    given = [key for key, value in (("Lstar", Lstar), ("stiffness", stiffness)) if value is not None]
    given += ["sheet"] * (other is not None) + [f"stiff = {stiff:g}"] * (stiff != 1.0) + list(values)
    if not given:
        raise ModelError(
            f"wide crease '{name}' needs Lstar or stiffness, or what its strip is made of: t, E, material or stiff"
        )
    if Lstar is None and stiffness is None:
        return SheetZone(STRIP + name, changed(sheet if other is None else other, stiff, **values))
    if len(given) > 1:
        raise ModelError(told_twice(f"wide crease '{name}'", *given[:2]))
    around = _around(mesh, name, sheet, zones)
    if around.plies is not None:
        raise ModelError(
            f"wide crease '{name}': a strip of a laminate cannot be told by {given[0]}; give what it is made of"
        )
    value = number(Lstar, "length") if Lstar is not None else number(stiffness or 0.0, "stiffness")
    if not 0.0 < value < math.inf:
        raise ModelError(f"wide crease '{name}': {given[0]} = {value:g} cannot be; give a positive number")
    k = value if stiffness is not None else sheet.bending_stiffness(nu=0.0) / value
    wide = float(np.mean(_Ways(mesh, name).across(_stations(mesh, name))[1]))
    # a strip turns by the sharp crease's angle and by the sheet's
    softer = k * wide / around.bending_stiffness()
    made = replace(around, t=around.t * (softer / (1.0 + softer)) ** (1.0 / 3.0))
    return SheetZone(STRIP + name, made, instead=around)


def told_twice(what: str, one: str, other: str) -> str:
    """The message where a strip is told by `Lstar` or `stiffness` and by something else.

    Args:
        what: in words, or its place in a scene.
        one: the one key.
        other: what stands beside it.

    Returns:
        one line.
    """
    if other == "stiffness":
        return (
            f"{what} has {one} and {other}, which are two ways to say how easily it turns; give one of them"
        )
    return f"{what} has {one}, from which its thickness follows, and {other}; leave out one of them"


def _around(mesh: SheetMesh, name: str, sheet: Sheet, zones: Sequence[SheetZone]) -> Sheet:
    """The sheet that a strip is in place of."""
    others = tuple(zone for zone in zones if not is_strip(zone))
    made = sections(mesh, sheet, others)
    if made.of is None:
        return sheet
    there = np.unique(made.of[triangles_in(mesh, STRIP + name, f"wide crease '{name}'")])
    found = made.sheets[int(there[0])]
    if any(made.sheets[int(number)] != found for number in there):
        parts = " and ".join(f"zone {number}" if number else "the sheet around it" for number in there[::-1])
        raise ModelError(
            f"the strip of wide crease '{name}' lies in {parts}, so no one thickness makes it as soft as a crease; "
            "give what it is made of (t, E, material or stiff), or end zones at the strip"
        )
    return found


class _Ways:
    """Directions and widths across a strip, from its two lines."""

    def __init__(self, mesh: SheetMesh, name: str) -> None:
        import shapely

        lines = [f"crease:{name}-{side}" for side in SIDES]
        self.lines = [
            shapely.LineString(
                sample(mesh.curves[line], 1e-5)
                if line in mesh.curves and mesh.drawn is mesh.points
                else mesh.points[chain_nodes(mesh.edge_sets[line]), :2]
            )
            for line in lines
        ]

    def across(self, points: Floats) -> tuple[Array, Array]:
        """Unit vectors (k, 2) from right to left, and widths (k,), mm, at points (k, 2)."""
        import shapely

        places = shapely.points(points)
        left, right = (
            shapely.get_coordinates(
                shapely.line_interpolate_point(line, shapely.line_locate_point(line, places))
            )
            for line in self.lines
        )
        width = np.linalg.norm(left - right, axis=1)
        return (left - right) / width[:, None], width


def _stations(mesh: SheetMesh, name: str) -> Array:
    """(k, 2) middles of the edges of the left line."""
    return np.asarray(mesh.points[mesh.edge_sets[f"crease:{name}-{SIDES[0]}"], :2].mean(axis=1))


def fold_strips(
    builder: StepBuilder, crease: str, given: Sequence[str], rest: float | Sequence[float] | None
) -> bool:
    """Fold wide creases by their curvature at rest.

    Args:
        builder: of the step.
        crease: a name, or "all".
        given: keys of the fold.
        rest: rest dihedral angle, rad.

    Returns:
        whether nothing is left to fold: the crease is wide, or "all" are.

    Raises:
        ModelError: the fold asks for what strips cannot do; one line.
    """
    mesh = builder.mesh
    if crease in mesh.side_of:
        raise ModelError(
            f"fold of crease '{crease}': it is one edge of the strip of wide crease '{mesh.side_of[crease]}' and stays "
            f"flat; fold '{mesh.side_of[crease]}' by rest"
        )
    names = [name for name in mesh.wide_creases if crease in (name, "all")]
    for name in names:
        if not isinstance(rest, int | float) or list(given) != ["rest"]:
            raise _not_for_strips(crease, name, given)
        inside = np.flatnonzero(triangles_in(mesh, STRIP + name, f"fold of crease '{name}'"))
        builder.grow(
            inside, np.zeros((len(inside), 3)), rest_curvature(mesh, name, inside, math.pi - float(rest))
        )
    sharp = any(mesh.folds.get(each, "flat") != "flat" for each in mesh.creases)
    return crease in names or (bool(names) and not sharp)


def _not_for_strips(crease: str, name: str, given: Sequence[str]) -> ModelError:
    """What to say of a fold that strips cannot do."""
    beside = next((key for key in given if key not in ("to", "by", "rest")), None)
    if "rest" in given and beside is not None:
        others = (
            ", and that of lines for each of them (creases.NAME, Model.crease)" if crease == "all" else ""
        )
        return ModelError(
            f"fold of crease '{crease}' has {beside}, but crease '{name}' is a strip: leave {beside} out; its "
            f"stiffness is told where its width is (creases.{name}, Model.wide_crease){others}"
        )
    return ModelError(
        f"fold of crease '{crease}' has {given[0]}, but crease '{name}' is a strip and has no line whose angle could "
        "be imposed: give rest, one dihedral angle in rad, and nothing else; its stiffness is that of the strip"
    )


def rest_curvature(mesh: SheetMesh, name: str, triangles: Ints, fold: float) -> Array:
    """Curvature that turns the panels beside a strip by a fold angle, spread evenly over its width.

    Args:
        mesh: with the strip.
        name: of the crease.
        triangles: (k,) of the strip.
        fold: angle, rad, mountain positive.

    Returns:
        (k, 3, 3) components 11, 22, 2 12 at the corners in the axes of the drawing, 1 / mm, positive where the edges go
        up.
    """
    corners = mesh.points[mesh.triangles[triangles], :2]
    n, width = _Ways(mesh, name).across(corners.reshape(-1, 2))
    amount = -fold / width
    rows = np.column_stack((n[:, 0] ** 2, n[:, 1] ** 2, 2.0 * n[:, 0] * n[:, 1])) * amount[:, None]
    return np.asarray(rows.reshape(-1, 3, 3))


def strip_fold(mesh: SheetMesh, name: str, curvature: Array) -> Array:
    """Fold angles across a wide crease: its curvature across, over its width.

    Args:
        mesh: with the strip.
        name: of the crease.
        curvature: (t, 3) of every triangle, components 11, 22, 2 12, 1 / mm.

    Returns:
        (k,) one an edge of its left line in order, rad; mountain positive.
    """
    inside = np.flatnonzero(triangles_in(mesh, STRIP + name, f"wide crease '{name}'"))
    middle = mesh.points[mesh.triangles[inside], :2].mean(axis=1)
    n, width = _Ways(mesh, name).across(middle)
    k = curvature[inside]
    turned = -width * (n[:, 0] ** 2 * k[:, 0] + n[:, 1] ** 2 * k[:, 1] + n[:, 0] * n[:, 1] * k[:, 2])
    stations = _stations(mesh, name)
    nearest = np.argmin(np.linalg.norm(middle[:, None] - stations[None], axis=2), axis=1)
    weight = np.bincount(nearest, mesh.areas[inside], len(stations))
    total = np.bincount(nearest, mesh.areas[inside] * turned, len(stations))
    known = weight > 0.0
    every = np.arange(len(stations))
    return np.interp(every, every[known], total[known] / weight[known])
