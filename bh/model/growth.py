"""Sheets that want another shape than their flat one: heat, moisture, growth, natural curvature, as a step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.laminate import free_strain, in_drawing
from bh.model.sheet import Sheet
from bh.model.step import Actuation, StepBuilder
from bh.model.zones import triangles_in
from meshes.quantities import number

Array = NDArray[np.float64]
Amount = float | str | Sequence[float] | Sequence[Sequence[float]]
LARGEST = (
    0.5  # strain: the metric of a sheet that grows by more is far from the flat one that it is measured on
)


@dataclass(frozen=True)
class Expand(Actuation):
    """What a part of the sheet wants to be at the end of the step, measured from its flat shape as drawn.

    The energy is that of the strain less `by` and of the curvature less `through`: where a shape has both, the sheet is
    at rest. What a step asks for stays until another one asks for something else there; several in one step add up.

    Attributes:
        by: strain: one number for all directions, or (e11, e22) or (e11, e22, 2 e12) along and across the grain (of a
            sheet without one along x and y of the drawing); or rows (t, 3) of the triangles of one mesh.
        through: curvature at rest, 1 / mm, likewise: positive where the edges go up, to +z, as those of a sheet that
            grows at its bottom. The strain that is wanted at the height z is `by` - z `through`.
        change: of temperature or moisture, in the unit that the sheet's `expansion` is of; a laminate bends as its
            plies tell.
        where: a region as of zones (`bh.SheetZone`).
        axes: direction of e11 in the drawing, rad; None for the grain, or the x axis.
    """

    by: Amount = 0.0
    through: Amount = 0.0
    change: float = 0.0
    where: str | Sequence[str] | Sequence[Sequence[float]] = "all"
    axes: float | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            by: Amount = 0.0,
            through: Amount = 0.0,
            change: float = 0.0,
            where: str | Sequence[str] | Sequence[Sequence[float]] = "all",
            axes: float | str | None = None,
        ) -> None:
            """See the attributes."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        strain = _amount("by", self.by)
        if np.abs(strain).max(initial=0.0) > LARGEST:
            raise ModelError(
                f"expand by = {np.abs(strain).max():g} cannot be; give a strain up to {LARGEST:g} (0.01 is 1 %)"
            )
        set_ = object.__setattr__
        set_(self, "by", _plain(strain))
        bent = number(self.through, "curvature") if isinstance(self.through, str) else self.through
        set_(self, "through", _plain(_amount("through", bent)))
        if not isinstance(self.change, int | float) or not math.isfinite(self.change):
            raise ModelError(f"expand change = {self.change!r} cannot be; give a number")
        if isinstance(self.axes, str):
            set_(self, "axes", number(self.axes, "angle"))
        if self.axes is not None and not math.isfinite(self.axes):
            raise ModelError(f"expand axes = {self.axes!r} cannot be; give an angle in rad")
        if not isinstance(self.where, str):
            set_(self, "where", tuple(each if isinstance(each, str) else tuple(each) for each in self.where))

    def apply(self, builder: StepBuilder) -> None:
        """Ask for the strain and the curvature of every triangle of the region.

        Raises:
            ModelError: no triangle lies there, or a sheet there has no expansion of its own; one line.
        """
        mesh, sections = builder.mesh, builder.sections
        inside = triangles_in(mesh, self.where, "expand")
        of = np.zeros(len(mesh.triangles), dtype=np.int64) if sections.of is None else sections.of
        both = np.zeros((2, len(of), 3))
        for kind, amount in enumerate((self.by, self.through)):
            rows = _rows(np.asarray(amount, dtype=float), len(of))
            for row, sheet in enumerate(sections.sheets):
                here = of == row
                both[kind, here] = in_drawing(rows[here], self._axes(sheet))
        if self.change:
            for row in np.unique(of[inside]).tolist():
                both[:, of == row] += np.stack(free_strain(sections.sheets[row], self.change))[:, None]
        builder.grow(np.flatnonzero(inside), both[0, inside], both[1, inside], self.change)

    def _axes(self, sheet: Sheet) -> float:
        if self.axes is not None:
            return self.axes
        return 0.0 if sheet.grain is None else sheet.grain


def _amount(name: str, value: object) -> Array:
    """A number, two, three, or rows of them, as an array."""
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        found = np.zeros((0, 0, 0))
    if found.ndim > 2 or (found.ndim > 0 and found.shape[-1] not in (2, 3)) or not np.isfinite(found).all():
        raise ModelError(
            f"expand {name} = {str(value)[:60]} cannot be; give a number, [e11, e22] or [e11, e22, 2 e12]"
        )
    return found


def _plain(value: Array) -> float | tuple[float, ...] | tuple[tuple[float, ...], ...]:
    """As frozen data."""
    if value.ndim == 0:
        return float(value)
    if value.ndim == 1:
        return tuple(float(each) for each in value)
    return tuple(tuple(float(each) for each in row) for row in value)


def _rows(value: Array, triangles: int) -> Array:
    """(t, 3) components 11, 22, 2 12."""
    if value.ndim == 2 and len(value) != triangles:
        raise ModelError(
            f"expand: {len(value)} rows do not fit {triangles} triangles; give one a triangle, or one for all"
        )
    if value.ndim == 0:
        value = np.array([float(value), float(value), 0.0])
    if value.shape[-1] == 2:
        value = np.concatenate((value, np.zeros((*value.shape[:-1], 1))), axis=-1)
    return np.asarray(np.broadcast_to(value, (triangles, 3)))
