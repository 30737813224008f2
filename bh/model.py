"""Description of what is to be solved: mesh, sheet, supports, creases and actuation steps. No unknowns in here."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from bh.actuation import Actuation, Displace, Fold, Force, Moment
from bh.errors import ModelError
from bh.supports import RigidBody, Support
from meshes import SheetMesh


@dataclass(frozen=True)
class Sheet:
    """A thin elastic sheet.

    Attributes:
        E: Young's modulus, MPa.
        t: thickness, mm.
        nu: Poisson's ratio in (-1, 0.5]; bars and hinges take 0, as the source does (3.3.2).
    """

    E: float
    t: float
    nu: float = 0.0

    def __post_init__(self) -> None:
        for name, unit in (("E", "MPa"), ("t", "mm")):
            value = getattr(self, name)
            if not (isinstance(value, int | float) and math.isfinite(value) and value > 0.0):
                raise ModelError(f"sheet {name} = {value} cannot be; give a positive number in {unit}")
        if not -1.0 < self.nu <= 0.5:
            raise ModelError(f"sheet nu = {self.nu} cannot be; Poisson's ratio lies in (-1, 0.5]")

    def bending_stiffness(self, nu: float | None = None) -> float:
        """D = E t^3 / (12 (1 - nu^2)), N mm (Eq. B.2); `nu` overrides the sheet's."""
        nu = self.nu if nu is None else nu
        return self.E * self.t**3 / (12.0 * (1.0 - nu**2))


@dataclass(frozen=True)
class CreaseLaw:
    """A spring crease: moment a length = stiffness (phi - rest), N mm / mm."""

    Lstar: float | None = None
    stiffness: float | None = None
    rest: float = math.pi

    def __post_init__(self) -> None:
        if (self.Lstar is None) == (self.stiffness is None):
            raise ModelError("a crease needs either Lstar (mm) or stiffness (N mm / (mm rad))")
        value = self.Lstar if self.Lstar is not None else self.stiffness
        assert value is not None
        low_ok = value > 0.0 if self.Lstar is not None else value >= 0.0
        if not (math.isfinite(value) and low_ok):
            raise ModelError(
                f"crease stiffness {value} cannot be; give a positive Lstar, or a stiffness of 0 or more"
            )

    def per_length(self, sheet: Sheet) -> float:
        """Stiffness a length of crease (Eq. 3.12 with nu = 0), N mm / (mm rad)."""
        if self.stiffness is not None:
            return self.stiffness
        assert self.Lstar is not None
        return sheet.bending_stiffness(nu=0.0) / self.Lstar


@dataclass(frozen=True)
class Model:
    """A sheet with supports, creases and steps of actuation (frozen; the methods return changed copies).

    Attributes:
        mesh: the stress-free sheet.
        sheet: its material and thickness.
        supports: none at all means the rigid-body support.
        steps: each a tuple of actuations that act together; steps run one after another.
        creases: laws of spring creases. A crease with no law and no fold is ordinary sheet.
        formulation: name of a registered formulation.
    """

    mesh: SheetMesh
    sheet: Sheet
    supports: tuple[Support | RigidBody, ...] = ()
    steps: tuple[tuple[Actuation, ...], ...] = ()
    creases: Mapping[str, CreaseLaw] = field(default_factory=dict)
    formulation: str = "bars-and-hinges"

    def support(self, at: str | Sequence[int], fix: str | Sequence[Sequence[float]] = "xyz") -> Model:
        """Hold nodes; at "rigid-body" take out what rigid motions are left (see `bh.supports`)."""
        item = RigidBody() if at == "rigid-body" else Support(at, fix)
        return replace(self, supports=(*self.supports, item))

    def crease(self, name: str, **law: Any) -> Model:
        """Give a crease a spring: `Lstar` (mm) or `stiffness` (N mm / (mm rad)), and its `rest` angle (rad)."""
        self.mesh.crease_edges(name)
        return replace(self, creases={**self.creases, name: CreaseLaw(**law)})

    def step(self, *actuations: Actuation) -> Model:
        """Add a step in which all `actuations` act together."""
        if not actuations:
            raise ModelError("a step needs at least one actuation (fold, moment, force or displace)")
        return replace(self, steps=(*self.steps, actuations))

    def fold(self, crease: str, **how: Any) -> Model:
        """Add a step that folds a crease; arguments of `bh.Fold`."""
        return self.step(Fold(crease, **how))

    def moment(self, crease: str, to: float) -> Model:
        """Add a step with a couple a length on a crease; see `bh.Moment`."""
        return self.step(Moment(crease, to))

    def force(self, at: str | Sequence[int], **how: Any) -> Model:
        """Add a step with dead forces; arguments of `bh.Force`."""
        return self.step(Force(at, **how))

    def displace(self, at: str | Sequence[int], direction: str | Sequence[float], by: float) -> Model:
        """Add a step with prescribed displacements; see `bh.Displace`."""
        return self.step(Displace(at, direction, by))
