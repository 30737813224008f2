"""Real sheets by name: moduli, density, strength, usual thickness. docs/materials.md says where each figure is from."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from bh.errors import ModelError
from bh.model.sheet import Sheet


@dataclass(frozen=True, kw_only=True)
class Stock:
    """A material as it is sold.

    Attributes:
        about: what it is, in a few words.
        E: Young's modulus, MPa; along the grain where there is one.
        nu: Poisson's ratio; nu12 where there is a grain.
        t: usual thickness, mm.
        density: kg / m^3.
        E2, G12: across the grain and in shear, MPa; None for a material that is alike in all directions.
        strength: stress at which it yields, MPa, along the grain; None where none is known.
    """

    about: str
    E: float
    nu: float
    t: float
    density: float
    E2: float | None = None
    G12: float | None = None
    strength: float | None = None

    @property
    def grained(self) -> bool:
        """Whether it has a grain."""
        return self.E2 is not None

    def sheet(self, t: float | str | None = None, grain: float | str | None = None) -> Sheet:
        """A sheet of it.

        Without a direction a material with a grain becomes one that is alike in all directions, of the geometric means
        E = sqrt(E1 E2) and nu = sqrt(nu12 nu21), and of the strength across the grain. Across it a sheet yields at the
        same strain as along it.

        Args:
            t: thickness, mm; None for the usual one.
            grain: direction of the grain in the drawing, rad from its x axis towards its y axis.

        Raises:
            ModelError: a direction for a material without a grain, or a value that cannot be.
        """
        thickness = self.t if t is None else t
        if self.E2 is None or self.G12 is None:
            if grain is not None:
                raise ModelError(f"{self.about} is alike in all directions; leave out grain")
            return Sheet(E=self.E, nu=self.nu, t=thickness, density=self.density, strength=self.strength)
        across = None if self.strength is None else self.strength * self.E2 / self.E
        if grain is None:
            ratio = math.sqrt(self.E2 / self.E)
            # the weaker direction is what counts where nobody knows which one it is
            return Sheet(
                E=self.E * ratio, nu=self.nu * ratio, t=thickness, density=self.density, strength=across
            )
        return Sheet.orthotropic(
            E1=self.E,
            E2=self.E2,
            G12=self.G12,
            nu12=self.nu,
            grain=grain,
            t=thickness,
            density=self.density,
            strength=self.strength,
            strength2=across,
        )

    def tightest_radius(self, t: float | None = None) -> float:
        """Radius, mm, to which a panel can be rolled (along the grain) before its surface yields: t E / (2 strength).

        Args:
            t: thickness, mm; None for the usual one.

        Raises:
            ModelError: its strength is not known.
        """
        if self.strength is None:
            raise ModelError(f"no stress is known at which {self.about} yields")
        return 0.5 * (self.t if t is None else t) * self.E / self.strength


# name: what it is, E (E1), nu (nu12), t, density, then E2 and G12, and strength
_ROWS: Mapping[str, tuple[str, float, float, float, float, tuple[float, float] | None, float | None]] = {
    "paper-80": ("copy paper, 80 g/m2", 5320.0, 0.3, 0.105, 760.0, (2660.0, 1456.0), 13.3),
    "card-160": ("card, 160 g/m2", 6000.0, 0.3, 0.2, 800.0, (3000.0, 1642.0), 15.0),
    "card-300": ("card, 300 g/m2", 6000.0, 0.3, 0.375, 800.0, (3000.0, 1642.0), 15.0),
    "liner": ("liner of corrugated board", 3348.0, 0.3, 0.2, 700.0, (1155.0, 761.0), None),
    "board": ("solid board, 700 g/m2", 3000.0, 0.3, 1.0, 700.0, None, None),
    "pet": ("polyester film (Mylar)", 4900.0, 0.38, 0.127, 1390.0, None, 98.0),
    "pp-film": ("oriented polypropylene film", 4500.0, 0.42, 0.05, 905.0, (2500.0, 1298.0), None),
    "pp": ("polypropylene sheet", 1500.0, 0.42, 0.5, 900.0, None, 30.0),
    "aluminium": ("aluminium 1100-O", 68900.0, 0.33, 0.1, 2710.0, None, 34.0),
    "copper": ("copper strip, annealed", 117000.0, 0.34, 0.1, 8930.0, None, 50.0),
    "copper-hard": ("copper strip, hard", 117000.0, 0.34, 0.1, 8930.0, None, 265.0),
    "spring-steel": ("stainless steel 301, spring temper", 193000.0, 0.3, 0.1, 7900.0, None, 1010.0),
    "beryllium-copper": ("beryllium copper 172, hard", 131000.0, 0.33, 0.1, 8800.0, None, None),
}


def _stock() -> Iterator[tuple[str, Stock]]:
    for name, (about, E, nu, t, density, across, strength) in _ROWS.items():
        E2, G12 = across or (None, None)
        yield name, Stock(about=about, E=E, nu=nu, t=t, density=density, E2=E2, G12=G12, strength=strength)


MATERIALS: Mapping[str, Stock] = MappingProxyType(dict(_stock()))


def material(name: str) -> Stock:
    """A material of the table.

    Args:
        name: such as "card-300".

    Raises:
        ModelError: there is none of that name; the line has the nearest one, and all.
    """
    if name not in MATERIALS:
        close = difflib.get_close_matches(name.lower(), MATERIALS, n=1)
        hint = f" (did you mean '{close[0]}'?)" if close else ""
        raise ModelError(f"material '{name}' is not known{hint}; use one of {', '.join(MATERIALS)}")
    return MATERIALS[name]


def sheet(name: str, t: float | str | None = None, grain: float | str | None = None) -> Sheet:
    """A sheet of a material of the table: `bh.materials.sheet("card-300", grain="30deg")`.

    Args:
        name: of the material.
        t: thickness, mm; None for the usual one.
        grain: direction of the grain in the drawing, rad; None for a sheet that is alike in all directions.

    Raises:
        ModelError: there is no such material, it has no grain, or a value cannot be.
    """
    return material(name).sheet(t, grain)
