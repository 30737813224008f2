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
from bh.model.zones import changed, triangles_in
from meshes import SheetMesh
from meshes.curves import Array, sample
from meshes.quantities import Typed, number
from meshes.topology import Ints, chain_nodes
from meshes.wide import SIDES, STRIP

Floats = NDArray[np.float64]


def wide_names(mesh: SheetMesh) -> tuple[str, ...]:
    """Names of the wide creases of a mesh.

    Args:
        mesh: of the sheet.

    Returns:
        without "strip:".
    """
    return tuple(name.removeprefix(STRIP) for name in mesh.edge_sets if name.startswith(STRIP))


def folding(mesh: SheetMesh) -> tuple[str, ...]:
    """Names of the creases of a mesh.

    Args:
        mesh: of the sheet.

    Returns:
        those of lines, then the wide ones in place of their two lines.
    """
    wide = wide_names(mesh)
    lines = {f"{name}-{side}" for name in wide for side in SIDES}
    return (*(name for name in mesh.creases if name not in lines), *wide)


def strip_sheet(
    mesh: SheetMesh,
    name: str,
    sheet: Sheet,
    Lstar: Typed | None = None,
    stiffness: Typed | None = None,
    other: Sheet | None = None,
    stiff: float = 1.0,
    **values: float | str | None,
) -> Sheet:
    """What the strip of a wide crease is made of.

    Args:
        mesh: with the strip.
        name: of the crease.
        sheet: around it.
        Lstar: of the sharp crease that the strip stands for, mm: the strip is the sheet's material, so thin that it
            turns by the same angle under the same moment.
        stiffness: the same as a moment a length and angle, N mm / (mm rad).
        other: what the strip is made of, instead of the sheet around it.
        stiff: factor of the moduli.
        **values: fields of `bh.Sheet`, such as t.

    Raises:
        ModelError: the mesh has no such strip, or what is given cannot be, or is given twice; one line.
    """
    if name not in wide_names(mesh):
        known = ", ".join(wide_names(mesh)) or "none; draw them by meshes.wide_creases"
        raise ModelError(f"the sheet has no wide crease '{name}'; it has {known}")
    given = [key for key, value in (("Lstar", Lstar), ("stiffness", stiffness)) if value is not None]
    given += ["sheet"] * (other is not None) + [f"stiff = {stiff:g}"] * (stiff != 1.0) + list(values)
    if not given:
        raise ModelError(
            f"wide crease '{name}' needs Lstar or stiffness, or what its strip is made of: t, E, material or stiff"
        )
    if Lstar is None and stiffness is None:
        return changed(sheet if other is None else other, stiff, **values)
    if len(given) > 1:
        raise ModelError(
            f"wide crease '{name}' has {given[0]} and {given[1]}, which say the same; give one of them"
        )
    if sheet.plies is not None:
        raise ModelError(
            f"wide crease '{name}': a strip of a laminate cannot be told by {given[0]}; give what it is made of"
        )
    value = number(Lstar, "length") if Lstar is not None else number(stiffness or 0.0, "stiffness")
    if not 0.0 < value < math.inf:
        raise ModelError(f"wide crease '{name}': {given[0]} = {value:g} cannot be; give a positive number")
    k = value if stiffness is not None else sheet.bending_stiffness(nu=0.0) / value
    wide = float(np.mean(_Ways(mesh, name).across(_stations(mesh, name))[1]))
    # a strip turns by the sharp crease's angle and by the sheet's
    softer = k * wide / sheet.bending_stiffness()
    return replace(sheet, t=sheet.t * (softer / (1.0 + softer)) ** (1.0 / 3.0))


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
    names = [name for name in wide_names(mesh) if crease in (name, "all")]
    for name in names:
        if not isinstance(rest, int | float) or list(given) != ["rest"]:
            raise ModelError(
                f"crease '{name}' is a strip and has no line whose angle could be imposed: give rest, one dihedral "
                "angle in rad, and nothing else; its stiffness is that of the strip"
            )
        inside = np.flatnonzero(triangles_in(mesh, STRIP + name, f"fold of crease '{name}'"))
        builder.grow(
            inside, np.zeros((len(inside), 3)), rest_curvature(mesh, name, inside, math.pi - float(rest))
        )
    sharp = any(mesh.folds.get(each, "flat") != "flat" for each in mesh.creases)
    return crease in names or (bool(names) and not sharp)


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
