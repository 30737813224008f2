"""The sheet, and what its elements are given in its place, as plain frozen values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from meshes.quantities import take_units

TURN = 2.0 * math.pi
STRENGTHS = ("strength", "strength2", "shear_strength")


@dataclass(frozen=True, kw_only=True, repr=False)
class Sheet:
    """A thin elastic sheet; its values are given by name: `Sheet(E=4000, nu=0.38, t=0.127)`.

    With E2, G12 and grain it is orthotropic, as paper and card are: E is E1 then, along the grain, and nu is nu12, what
    a pull along the grain contracts across it (`Sheet.orthotropic` has these names).

    Attributes:
        E: Young's modulus, MPa, or with a unit ("4GPa").
        t: thickness, mm, or with a unit ("0.2mm").
        nu: Poisson's ratio in (-1, 0.5], with a grain nu^2 < E / E2. Bars and hinges take 0, as the source (3.3.2).
        E2: Young's modulus across the grain, MPa; None for a sheet that is alike in all directions.
        G12: shear modulus in the plane of the sheet, MPa; with a grain.
        grain: direction of the grain in the drawing, rad from its x axis towards its y axis, or with a unit ("30deg").
        density: kg / m^3, of a sheet that is to have a weight; None where it does not matter.
        strength: stress at which it yields when it is pulled, along the grain where there is one, MPa, or with a unit;
            None where it is not known. No formulation yields: states are compared with it (`State.stress`).
        strength2: the same across the grain, MPa; with a grain.
        shear_strength: the same in shear along the grain, MPa; with a grain, sqrt(strength strength2 / 3) unless given.
        plies: of a laminate, from the bottom to the top (the side that faces +z), each a sheet with a t and, where it
            has one, a grain of its own: `bh.laminate`. E, nu and t are those of an equivalent sheet then.
        expansion: strain a kelvin (or a percent of moisture, ...), one number or (along, across the grain).
    """

    E: float
    t: float
    nu: float = 0.0
    E2: float | None = None
    G12: float | None = None
    grain: float | None = None
    density: float | None = None
    strength: float | None = None
    strength2: float | None = None
    shear_strength: float | None = None
    expansion: float | tuple[float, float] | None = None
    plies: tuple[Sheet, ...] | None = None

    if TYPE_CHECKING:  # texts with units are taken, too, and kept as numbers

        def __init__(  # noqa: PLR0913
            self,
            *,
            E: float | str,
            t: float | str,
            nu: float = 0.0,
            E2: float | str | None = None,
            G12: float | str | None = None,
            grain: float | str | None = None,
            density: float | None = None,
            strength: float | str | None = None,
            strength2: float | str | None = None,
            shear_strength: float | str | None = None,
            expansion: float | Sequence[float] | None = None,
            plies: Sequence[Sheet] | None = None,
        ) -> None:
            """See the attributes."""

    def __repr__(self) -> str:
        """One line with what is given: "Sheet(E=4000, t=0.127, nu=0.38)"."""
        given = ((item.name, getattr(self, item.name)) for item in fields(self))
        return f"Sheet({', '.join(f'{name}={value:.6g}' for name, value in given if value is not None)})"

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        take_units(self, "sheet", E="modulus", t="length", E2="modulus", G12="modulus", grain="angle")
        take_units(self, "sheet", strength="modulus", strength2="modulus", shear_strength="modulus")
        units = {"E": "MPa", "t": "mm", "E2": "MPa", "G12": "MPa", "density": "kg/m^3"}
        for name, unit in (units | dict.fromkeys(STRENGTHS, "MPa")).items():
            value = getattr(self, name)
            if value is None and name not in ("E", "t"):
                continue
            if not (isinstance(value, Real) and math.isfinite(value) and float(value) > 0.0):
                raise ModelError(f"sheet {name} = {value!r} cannot be; give a positive number in {unit}")
        if self.plies is not None:
            _check_plies(self)
        if self.expansion is not None:
            object.__setattr__(self, "expansion", _expansion(self.expansion))
        if self.grain is None and (self.strength2, self.shear_strength) != (None, None):
            raise ModelError(
                "sheet strength2 and shear_strength are of a grain; give E2, G12 and grain, or strength alone"
            )
        if (self.E2, self.G12, self.grain) != (None, None, None):
            _check_grain(self)
        elif not (isinstance(self.nu, Real) and -1.0 < self.nu <= 0.5):
            raise ModelError(f"sheet nu = {self.nu!r} cannot be; Poisson's ratio lies in (-1, 0.5]")

    @classmethod
    def orthotropic(
        cls,
        *,
        E1: float | str,
        E2: float | str,
        G12: float | str,
        nu12: float,
        grain: float | str,
        t: float | str,
        density: float | None = None,
        expansion: float | Sequence[float] | None = None,
        **strengths: float | str | None,
    ) -> Sheet:
        """A sheet with a grain, by the names of its moduli.

        Args:
            E1: Young's modulus along the grain, MPa.
            E2: Young's modulus across it, MPa.
            G12: shear modulus in the plane of the sheet, MPa.
            nu12: what a pull along the grain contracts across it; nu12 / E1 = nu21 / E2.
            grain: direction of the grain in the drawing, rad from its x axis towards its y axis.
            t: thickness, mm.
            density: kg / m^3, or None.
            expansion: strain a unit of change, one number or (along, across the grain), or None.
            **strengths: `strength`, `strength2` and `shear_strength`, MPa (see the class).

        Raises:
            ModelError: moduli that are not definite: a sheet that gives energy when it is strained.
        """
        unknown = set(strengths) - set(STRENGTHS)
        if unknown:
            raise ModelError(f"a sheet has no {sorted(unknown)[0]}; its strengths are {', '.join(STRENGTHS)}")
        return cls(
            E=E1,
            E2=E2,
            G12=G12,
            nu=nu12,
            grain=grain,
            t=t,
            density=density,
            expansion=expansion,
            strength=strengths.get("strength"),
            strength2=strengths.get("strength2"),
            shear_strength=strengths.get("shear_strength"),
        )

    def strengths(self) -> tuple[float, float, float]:
        """Stresses of yield; of a sheet without a grain von Mises's.

        Returns:
            along the grain, across it and in shear, MPa.

        Raises:
            ModelError: they are not given.
        """
        if self.strength is None:
            raise ModelError("the sheet has no strength to compare stresses with; give strength in MPa")
        across = self.strength if self.grain is None else self.strength2
        if across is None:
            raise ModelError(
                "a sheet with a grain has a strength in both directions; give strength2, across it, in MPa"
            )
        shear = self.shear_strength
        return self.strength, across, math.sqrt(self.strength * across / 3.0) if shear is None else shear

    @property
    def directed(self) -> bool:
        """Does it depend on the direction?"""
        return self.grain is not None or self.plies is not None

    @property
    def nu_squared(self) -> float:
        """nu^2, or nu12 nu21 of a sheet with a grain."""
        return self.nu**2 if self.E2 is None else self.nu**2 * self.E2 / self.E

    def bending_stiffness(self, nu: float | None = None) -> float:
        """D = E t^3 / (12 (1 - nu^2)), N mm (Eq. B.2); `nu` overrides the sheet's.

        With a grain the geometric mean of both directions, to which L* of creases refers: E = sqrt(E1 E2), and
        nu^2 = nu12 nu21.
        """
        E = self.E if self.E2 is None else math.sqrt(self.E * self.E2)
        nu_squared = self.nu_squared if nu is None else nu**2
        return E * self.t**3 / (12.0 * (1.0 - nu_squared))


def _check_plies(sheet: Sheet) -> None:
    """Plies as frozen sheets, whose thickness is that of the laminate."""
    assert sheet.plies is not None
    plies = tuple(Sheet(**ply) if isinstance(ply, dict) else ply for ply in sheet.plies)  # as files have them
    if not plies or any(not isinstance(ply, Sheet) or ply.plies is not None for ply in plies):
        raise ModelError(
            "the plies of a laminate are sheets, one or more, and no laminates; give bh.Sheet for each"
        )
    if sheet.grain is not None or sheet.expansion is not None:
        raise ModelError("grain and expansion of a laminate are those of its plies; give them there")
    thick = sum(ply.t for ply in plies)
    if abs(thick - sheet.t) > 1e-9 * thick:
        raise ModelError(
            f"a laminate of {len(plies)} plies is {thick:g} mm thick, not {sheet.t:g}; change the plies, not t"
        )
    object.__setattr__(sheet, "plies", plies)


def _expansion(value: object) -> float | tuple[float, float]:
    """One number, or two."""
    both = list(value) if isinstance(value, Sequence) and not isinstance(value, str) else [value]
    found = [float(each) for each in both if isinstance(each, Real) and math.isfinite(each)]
    if len(found) != len(both) or len(found) not in (1, 2):
        raise ModelError(
            f"sheet expansion = {value!r} cannot be; give a strain a kelvin or a percent, or one along and one across "
            "the grain"
        )
    return found[0] if len(found) == 1 else (found[0], found[1])


def _check_grain(sheet: Sheet) -> None:
    """Are the moduli of a sheet with a grain all there, and definite?"""
    missing = [name for name in ("E2", "G12", "grain") if getattr(sheet, name) is None]
    if missing == ["grain"]:
        raise ModelError('sheet E2 and G12 are of a grain without a direction; give grain, such as "30deg"')
    if missing:
        raise ModelError(
            f"sheet {' and '.join(missing)} is missing; a sheet with a grain needs E2, G12 (MPa) and grain (an angle)"
        )
    assert sheet.E2 is not None
    if not (isinstance(sheet.grain, Real) and abs(sheet.grain) <= TURN):
        raise ModelError(
            f'sheet grain = {sheet.grain!r} cannot be; give an angle in rad from -2 pi to 2 pi, or such as "30deg"'
        )
    if not (isinstance(sheet.nu, Real) and sheet.nu**2 < sheet.E / sheet.E2):
        most = math.sqrt(sheet.E / sheet.E2)
        raise ModelError(
            f"sheet nu = {sheet.nu!r} cannot be with E = {sheet.E:g} along and E2 = {sheet.E2:g} MPa across the "
            f"grain: the moduli are not definite; nu (nu12) lies between -{most:.4g} and {most:.4g}"
        )


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
