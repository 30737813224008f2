"""The weight of a sheet: dead forces in proportion to its area."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.sheet import Sheet
from bh.model.step import Actuation, StepBuilder
from bh.model.zones import Sections

Array = NDArray[np.float64]
EARTH = (0.0, 0.0, -9.81)  # m / s^2
UNITS = 1e-9  # kg / m^3 mm^3 m / s^2 -> N


@dataclass(frozen=True)
class Weight(Actuation):
    """The sheet's own weight, beside other forces; it comes in during its step and stays until another is asked for.

    Attributes:
        g: gravity, m / s^2; [0, 0, 0] takes the weight away.
        density: kg / m^3; None for the sheet's.
    """

    g: Sequence[float] = EARTH
    density: float | None = None

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        if isinstance(self.g, list):  # as files have it
            object.__setattr__(self, "g", tuple(self.g))
        numbers = [part for part in self.g if isinstance(part, int | float) and math.isfinite(part)]
        if isinstance(self.g, str) or len(self.g) != 3 or len(numbers) != 3:
            raise ModelError(
                f"weight g = {self.g} cannot be; give three numbers in m/s^2, such as {list(EARTH)}"
            )
        if self.density is not None and not 0.0 < self.density < math.inf:
            raise ModelError(f"weight density = {self.density} cannot be; give a positive number in kg/m^3")

    def per_area(self, sheet: Sheet) -> Array:
        """(3,) force an area of the sheet, N / mm^2.

        Args:
            sheet: of which it is.

        Raises:
            ModelError: no density is given, neither here nor with the sheet.
        """
        density = sheet.density if self.density is None else self.density
        if density is None:
            raise ModelError("a weight needs a density in kg/m^3; give it with the sheet or with the weight")
        return np.asarray(UNITS * density * sheet.t * np.asarray(self.g, dtype=float))

    def of_triangles(self, sections: Sections) -> Array:
        """(t, 3) force an area of every triangle, N / mm^2, or (1, 3) of a sheet without zones.

        Args:
            sections: what they are made of.

        Raises:
            ModelError: a density is missing.
        """
        return sections.each([self.per_area(sheet) for sheet in sections.sheets])

    def apply(self, builder: StepBuilder) -> None:
        """Ask for the weight of every triangle, a third on each of its corners."""
        mesh, sections = builder.mesh, builder.sections
        if sections.of is None:
            area = np.bincount(
                mesh.triangles.ravel(), np.repeat(mesh.areas / 3.0, 3), minlength=len(mesh.points)
            )
            builder.bear(area[:, None] * self.per_area(builder.sheet))
            return
        force = np.zeros_like(mesh.points)
        for corner in mesh.triangles.T:
            np.add.at(force, corner, (mesh.areas / 3.0)[:, None] * self.of_triangles(sections))
        builder.bear(force)
