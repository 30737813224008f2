"""Strains and stresses of a state: through the thickness, principal, equivalent, and against yield."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations import yield_criteria
from bh.formulations.plies import PlyStress, ply_stress
from bh.formulations.recovery import corner_values
from bh.model.sheet import Sheet
from bh.model.zones import Sections
from bh.runtime.one_line import OneLine
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
HEIGHT = {"top": 0.5, "middle": 0.0, "bottom": -0.5}  # above the middle surface, in thicknesses


class Resultants(NamedTuple):
    """What a formulation knows of every triangle, in the axes of the flat drawing, rows of (xx, yy, 2 xy or xy).

    Attributes:
        sheet: of which it is.
        strain: (t, 3) Green's strain of the middle surface, components xx, yy, 2 xy.
        curvature: (t, 3) its change of curvature, 1 / mm; positive where the sheet's edges are bent up.
        forces: (t, 3) membrane forces (second Piola-Kirchhoff), N / mm, components xx, yy, xy.
        moments: (t, 3) N mm / mm, components xx, yy, xy.
        sections: what every triangle is made of, where there are zones.
        changed: (t,) change of temperature or moisture, which plies feel one by one; None for none.
    """

    sheet: Sheet
    strain: Array
    curvature: Array
    forces: Array
    moments: Array
    sections: Sections | None = None
    changed: Array | None = None


class Extreme(NamedTuple):
    """Where a stress is nearest to yield.

    Attributes:
        utilisation: equivalent stress over strength; 1 is yield.
        side: "top" or "bottom"; of a laminate "top of ply 2", plies counted from the bottom.
        triangle: row of `mesh.triangles`.
        place: (2,) in the flat drawing, mm.
    """

    utilisation: float
    side: str
    triangle: int
    place: Array


@dataclass(frozen=True, eq=False, repr=False)
class Stress(OneLine):
    """Strains and stresses of a state; arrays (t, ...) of triangles, or (t, 3, ...) of their corners (`corners`).

    Components are in the axes of the flat drawing, which the sheet carries along. Stress varies linearly through the
    thickness: N / t -+ 6 M / t^2 at the top (the side that faces +z in the drawing) and at the bottom.

    Attributes:
        mesh: the stress-free sheet.
        sheet: its material.
        strain, curvature, forces, moments: see `Resultants`.
        cut: (k,) rows of `mesh.topology.hinges`: creases and borders of zones, across which nothing is averaged.
        sections: what every triangle is made of, where there are zones.
        changed: (t,) change of temperature or moisture; None for none.
    """

    mesh: SheetMesh
    sheet: Sheet
    strain: Array
    curvature: Array
    forces: Array
    moments: Array
    cut: Ints
    sections: Sections | None = None
    changed: Array | None = None

    @cached_property
    def corners(self) -> Stress:
        """The same at the corners of the triangles, (t, 3, ...), averaged within panels and never across creases."""
        both = np.hstack((self.strain, self.curvature, self.forces, self.moments))
        at = corner_values(self.mesh, both, self.cut)
        parts = (at[..., :3], at[..., 3:6], at[..., 6:9], at[..., 9:])
        return Stress(self.mesh, self.sheet, *parts, self.cut, self.sections, self.changed)

    def _each(self, read: Callable[[Sheet], float]) -> Array:
        """A value of the sheet, or of that of every triangle, (t, 1) or (t, 1, 1)."""
        if self.sections is None or self.sections.of is None:
            return np.asarray(read(self.sheet))
        values = self.sections.each([read(sheet) for sheet in self.sections.sheets])
        return values.reshape((-1,) + (1,) * (self.forces.ndim - 1))

    @property
    def _sheets(self) -> tuple[Sheet, ...]:
        return (self.sheet,) if self.sections is None else self.sections.sheets

    @property
    def plies(self) -> int:
        """Plies of the sheet, or of the zone that has most of them; 1 where no part is a laminate."""
        return max(1 if sheet.plies is None else len(sheet.plies) for sheet in self._sheets)

    def ply(self, number: int) -> PlyStress:
        """Strains and stresses of one ply of a laminate, on its own faces and along its fibres.

        Args:
            number: from 0 at the bottom; a sheet that is none has one.

        Raises:
            ModelError: there are fewer plies.
        """
        if not 0 <= number < self.plies:
            raise ModelError(f"ply {number} is none of the {self.plies} (0 is at the bottom)")
        of = None if self.sections is None else self.sections.of
        return ply_stress(
            number,
            self._sheets,
            np.zeros(len(self.forces), dtype=np.int64) if of is None else of,
            np.stack((self.strain, self.curvature)),
            np.stack((self.forces, self.moments)),
            self.changed,
        )

    def at(self, side: str = "top") -> Array:
        """(..., 3) stresses xx, yy, xy, MPa.

        Args:
            side: "top", "middle" or "bottom".

        Raises:
            ModelError: of a laminate, whose plies have stresses of their own.
        """
        if any(sheet.plies is not None for sheet in self._sheets):
            raise ModelError("every ply of a laminate has its own stress; read stress.ply(0).at(side), ...")
        t = self._each(lambda sheet: sheet.t)
        return np.asarray(self.forces / t - 12.0 / t**2 * _height(side) * self.moments)

    def strain_at(self, side: str = "top") -> Array:
        """(..., 3) strains xx, yy, 2 xy.

        Args:
            side: "top", "middle" or "bottom".
        """
        return np.asarray(self.strain - self._each(lambda sheet: sheet.t) * _height(side) * self.curvature)

    def principal(self, side: str = "top") -> Array:
        """(..., 2) principal stresses, the larger one first, MPa.

        Args:
            side: "top", "middle" or "bottom".
        """
        return yield_criteria.principal(self.at(side))

    def equivalent(self, side: str = "top") -> Array:
        """(...,) von Mises's stress; of a sheet with a grain Hill's, which is a pull along the grain, MPa.

        Args:
            side: "top", "middle" or "bottom".

        Raises:
            ModelError: a sheet with a grain whose strengths are not given.
        """
        stress = self.at(side)
        if self.sections is None or self.sections.of is None:
            return yield_criteria.equivalent(stress, self.sheet)
        out = np.empty(stress.shape[:-1])
        for number, sheet in enumerate(self.sections.sheets):
            here = self.sections.of == number
            if here.any():
                out[here] = yield_criteria.equivalent(stress[here], sheet)
        return out

    def utilisation(self, side: str = "top") -> Array:
        """(...,) equivalent stress over the strength of the sheet; yield begins at 1.

        Args:
            side: "top", "middle" or "bottom".

        Raises:
            ModelError: no strength is given.
        """
        return np.asarray(self.equivalent(side) / self._strength())

    def _strength(self) -> Array:
        strength = self._each(lambda sheet: sheet.strengths()[0])
        return strength[..., 0] if strength.ndim else strength

    def reserve(self, side: str = "top") -> Array:
        """(...,) by what all stresses could grow until yield: strength over equivalent stress, inf where there is none.

        Args:
            side: "top", "middle" or "bottom".

        Raises:
            ModelError: no strength is given.
        """
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / self.utilisation(side))

    def faces(self) -> dict[str, Array]:
        """(...,) utilisation on every face that stress is largest on, by its name as in `Extreme`; nan: no such ply.

        Raises:
            ModelError: no strength is given.
        """
        if self.plies == 1:
            return {side: self.utilisation(side) for side in ("top", "bottom")}
        plies = [self.ply(number) for number in range(self.plies)]
        return {
            f"{side} of ply {ply.number + 1}": ply.utilisation(side)
            for ply in reversed(plies)
            for side in ("top", "bottom")
        }

    def largest(self) -> Array:
        """(...,) utilisation where it is largest through the thickness, on any face of any ply.

        Raises:
            ModelError: no strength is given.
        """
        return np.asarray(np.nanmax(list(self.faces().values()), axis=0))

    def worst(self) -> Extreme:
        """Where the sheet is nearest to yield, on any face, by the values at corners.

        Raises:
            ModelError: no strength is given.
        """
        faces = self.corners.faces()
        side = max(faces, key=lambda name: float(np.nanmax(faces[name])))
        triangle, corner = np.unravel_index(int(np.nanargmax(faces[side])), faces[side].shape)
        place = self.mesh.points[self.mesh.triangles[triangle, corner], :2]
        return Extreme(float(np.nanmax(faces[side])), side, int(triangle), place)


def stress_of(mesh: SheetMesh, found: Resultants, moments: Array) -> Stress:
    """Stress from what a formulation gives.

    Args:
        mesh: the stress-free sheet.
        found: of every triangle.
        moments: (m,) of every hinge, nan off creases.

    Raises:
        ModelError: the stress-free sheet is not flat, so that its components have no axes.
    """
    if not mesh.flat:
        raise ModelError("stresses are read in the axes of the drawing; this stress-free sheet is not flat")
    topology = mesh.topology
    cut = ~np.isnan(moments)
    for name in mesh.creases:
        hinge = topology.edge_hinges[topology.find_edges(mesh.crease_edges(name))]
        cut[hinge[hinge >= 0]] = True
    if found.sections is not None:
        cut |= found.sections.borders(mesh)
    return Stress(mesh, *found[:5], np.flatnonzero(cut), found.sections, found.changed)


def _height(side: str) -> float:
    if side not in HEIGHT:
        raise ModelError(f"side '{side}' is not known; use one of {', '.join(HEIGHT)}")
    return HEIGHT[side]
