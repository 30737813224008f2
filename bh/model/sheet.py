"""The sheet, and what its elements are given in its place, as plain frozen values."""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from meshes.quantities import take_units


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A thin elastic sheet; its values are given by name: `Sheet(E=4000, nu=0.38, t=0.127)`.

    Attributes:
        E: Young's modulus, MPa, or with a unit ("4GPa").
        t: thickness, mm, or with a unit ("0.2mm").
        nu: Poisson's ratio in (-1, 0.5]; bars and hinges take 0, as the source does (3.3.2).
    """

    E: float
    t: float
    nu: float = 0.0

    if TYPE_CHECKING:  # texts with units are taken, too, and kept as numbers

        def __init__(self, *, E: float | str, t: float | str, nu: float = 0.0) -> None:
            """See the attributes."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        take_units(self, "sheet", E="modulus", t="length")
        for name, unit in (("E", "MPa"), ("t", "mm")):
            value = getattr(self, name)
            if not (isinstance(value, Real) and math.isfinite(value) and float(value) > 0.0):
                raise ModelError(f"sheet {name} = {value!r} cannot be; give a positive number in {unit}")
        if not (isinstance(self.nu, Real) and -1.0 < self.nu <= 0.5):
            raise ModelError(f"sheet nu = {self.nu!r} cannot be; Poisson's ratio lies in (-1, 0.5]")

    def bending_stiffness(self, nu: float | None = None) -> float:
        """D = E t^3 / (12 (1 - nu^2)), N mm (Eq. B.2); `nu` overrides the sheet's."""
        nu = self.nu if nu is None else nu
        return self.E * self.t**3 / (12.0 * (1.0 - nu**2))


@dataclass(frozen=True, eq=False)
class ElementStiffness:
    """Given stiffness of every element, in place of what the sheet would give.

    Attributes:
        bars: (e,) axial stiffness of the bar on every edge of `mesh.topology.edges`, N/mm.
        green: bars measure Green's strain, energy 1/2 k L^2 e^2 with e = (l^2 - L^2) / (2 L^2), in place of l - L.
        hinges: (m,) rotational stiffness of every hinge of `mesh.topology.hinges` (total, not a length), N mm / rad.
    """

    bars: NDArray[np.float64]
    hinges: NDArray[np.float64]
    green: bool = False

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        for name in ("bars", "hinges"):
            values = np.array(getattr(self, name), dtype=float)
            if not (np.isfinite(values).all() and (values >= 0.0).all()):
                raise ModelError(f"stiffness of {name} must be finite and not negative")
            values.setflags(write=False)
            object.__setattr__(self, name, values)
