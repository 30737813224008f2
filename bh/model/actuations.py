"""Actuations: what drives a sheet while the control parameter lambda runs from 0 to 1 in a step.

All of them are data, and know what they ask of the hinges and nodes of a sheet (`apply`); `bh.loading.builder` makes
load steps of it. The pinch has a module of its own, `bh.model.pinch`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.mould import check_friction
from bh.model.step import Actuation, Body, StepBuilder
from bh.model.supports import AXES, select
from bh.model.wide_crease import fold_strips
from meshes.quantities import Typed, degrees_meant, take_units

Array = NDArray[np.float64]
Angles = float | Sequence[float]
Given = Typed | Sequence[Typed]
FOLDS = ("to", "by", "rest", "Lstar", "stiffness")


@dataclass(frozen=True)
class Fold(Actuation):
    """Fold a crease.

    Attributes:
        crease: its name, or "all" for every crease that is drawn as mountain or valley.
        to: dihedral angle that is imposed exactly (rigid connector), rad in (0, 2 pi); one number or one an edge.
        by: fold angle, mountain or valley as drawn, rad in (-pi, pi); imposed exactly, or the rest angle of a
            spring crease if `Lstar` or `stiffness` is given; "drawn" takes the angles of the pattern.
        part: of the drawn angles (`by = "drawn"`), 0 to 1; where the pattern gives an angle to some creases only, the
            others fold by that part of half a turn.
        rest: rest dihedral angle of a spring crease, rad in [0, 2 pi].
        Lstar: length scale of the crease, mm; stiffness a length is E t^3 / (12 Lstar) (Eq. 3.12).
        stiffness: of the crease a length, N mm / (mm rad) (instead of `Lstar`).
    """

    crease: str
    to: Angles | None = None
    by: Angles | str | None = None
    rest: Angles | None = None
    Lstar: float | None = None
    stiffness: float | None = None
    part: float = 1.0

    if TYPE_CHECKING:  # texts with units are taken, too, and kept as numbers

        def __init__(
            self,
            crease: str,
            to: Given | None = None,
            by: Given | None = None,
            rest: Given | None = None,
            Lstar: Typed | None = None,
            stiffness: Typed | None = None,
            part: float = 1.0,
        ) -> None:
            """See the attributes."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        what = f"fold of crease '{self.crease}'"
        take_units(self, what, to="angle", rest="angle", Lstar="length", stiffness="stiffness")
        if not isinstance(self.by, str) or re.match(
            r"\s*[-+.]?[0-9]", self.by
        ):  # else "drawn", or a misspelt one
            take_units(self, what, by="angle")
        if not 0.0 <= self.part <= 1.0 or (self.part != 1.0 and self.by != "drawn"):
            raise ModelError(
                f"fold of crease '{self.crease}': part = {self.part} cannot be; give 0 to 1, with by = 'drawn'"
            )
        given = [key for key in ("to", "by", "rest") if getattr(self, key) is not None]
        if len(given) != 1:
            raise ModelError(
                f"fold of crease '{self.crease}' needs exactly one of to, by and rest, but has {given or 'none'}"
            )
        if self.Lstar is not None and self.stiffness is not None:
            raise ModelError(f"fold of crease '{self.crease}' has Lstar and stiffness; give one of them")
        if self.to is not None and (self.Lstar is not None or self.stiffness is not None):
            raise ModelError(
                f"fold of crease '{self.crease}': 'to' is exact and takes no stiffness; use 'rest' for a spring"
            )
        for key in ("Lstar", "stiffness"):
            value = getattr(self, key)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise ModelError(
                    f"fold of crease '{self.crease}': {key} = {value} cannot be; give a positive number"
                )
        if isinstance(self.by, str) and self.by != "drawn":
            raise ModelError(
                f"fold of crease '{self.crease}': by = '{self.by}' is not understood; use rad or 'drawn'"
            )
        limits = {"to": (0.0, 2.0 * math.pi), "rest": (0.0, 2.0 * math.pi), "by": (-math.pi, math.pi)}
        for key in given:
            value = getattr(self, key)
            if isinstance(value, str):
                continue
            low, high = limits[key]
            angles = np.atleast_1d(np.asarray(value, dtype=float))
            if not (np.isfinite(angles).all() and (angles >= low).all() and (angles <= high).all()):
                raise ModelError(
                    f"fold of crease '{self.crease}': {key} = {value} rad is outside {low:.4g} to {high:.4g}"
                    + degrees_meant(float(np.abs(angles).max(initial=0.0)))
                )

    @property
    def _spring(self) -> bool:
        return self.Lstar is not None or self.stiffness is not None

    def prepare(self, builder: StepBuilder) -> None:
        """Ask for the spring before the first step."""
        if self._spring and self.crease not in builder.mesh.wide_creases:
            builder.spring(builder.creases(self.crease)[0], self.Lstar, self.stiffness)

    def apply(self, builder: StepBuilder) -> None:
        """Ask for the angle, imposed or as a rest angle.

        Raises:
            ModelError: the angle leaves the range from 0 to 2 pi, or a list of angles does not fit the crease.
        """
        given = [key for key in FOLDS if getattr(self, key) is not None]
        if fold_strips(builder, self.crease, given, self.rest):
            return
        hinges, sense, drawn = builder.creases(self.crease)
        angle = self._target(sense, drawn)
        if self.rest is not None or self._spring:
            builder.rest_at(hinges, angle, release=self._spring)
            return
        if not ((angle > 0.0) & (angle < 2.0 * math.pi)).all():
            raise ModelError(
                f"fold of crease '{self.crease}' closes it completely; stay inside (0, 2 pi) rad"
            )
        builder.prescribe(hinges, angle)

    def _target(self, sense: Array, drawn: Array) -> Array:
        """(k,) dihedral angles at the end of the step, rad."""
        if isinstance(self.by, str):
            if np.isnan(drawn).all():
                raise ModelError(
                    f"fold of crease '{self.crease}': the pattern gives no fold angles; use by = radians"
                )
            return np.asarray(math.pi - self.part * np.where(np.isnan(drawn), math.pi * sense, drawn))
        value = next(value for value in (self.by, self.to, self.rest) if value is not None)
        angles = np.asarray(value, dtype=float)
        if angles.ndim and angles.shape != sense.shape:
            raise ModelError(
                f"fold of crease '{self.crease}' has {angles.size} angles for {len(sense)} edges"
            )
        angles = np.broadcast_to(angles, sense.shape).copy()
        return math.pi - sense * angles if self.by is not None else angles


@dataclass(frozen=True)
class Moment(Actuation):
    """A dead couple a length on a crease, N mm / mm; positive folds the crease the way that it is drawn."""

    crease: str
    to: float

    if TYPE_CHECKING:

        def __init__(self, crease: str, to: Typed) -> None:
            """See the class."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        take_units(self, f"moment on crease '{self.crease}'", to="couple")
        _finite(f"moment on crease '{self.crease}'", (self.to,))

    def apply(self, builder: StepBuilder) -> None:
        """Ask for the couple."""
        hinges, sense, _ = builder.creases(self.crease)
        builder.couple(hinges, sense * self.to)


@dataclass(frozen=True)
class Force(Actuation):
    """A dead force. `each` (N) acts on every node of the place; `total` (N) is shared equally among them."""

    at: str | Sequence[int]
    each: Sequence[float] | None = None
    total: Sequence[float] | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            at: str | Sequence[int],
            each: Sequence[Typed] | None = None,
            total: Sequence[Typed] | None = None,
        ) -> None:
            """See the class."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        if (self.each is None) == (self.total is None):
            raise ModelError(
                f"force at '{self.at}' needs either each or total, a vector of three numbers in N"
            )
        if isinstance(self.each, list | tuple) or isinstance(self.total, list | tuple):
            take_units(self, f"force at '{self.at}'", each="force", total="force")
        vector = self.each if self.each is not None else self.total
        assert vector is not None
        _vector(f"force at '{self.at}'", vector)

    def apply(self, builder: StepBuilder) -> None:
        """Ask for the force on every node."""
        nodes = select(builder.mesh, self.at)
        vector = self.each if self.each is not None else self.total
        share = 1.0 if self.each is not None else 1.0 / len(nodes)
        builder.pull(nodes, share * np.asarray(vector, dtype=float))


@dataclass(frozen=True)
class Displace(Actuation):
    """Prescribed displacement along `direction` (three numbers, or x, y, z), `by` or `further` of which is given.

    Nodes stay free across the direction, and keep their displacement in later steps until they are released.

    Attributes:
        at: a place of the mesh or node indices.
        direction: "x", "y", "z" or a vector (3,) of any length.
        by: displacement at the end of the step from the stress-free position, mm.
        further: the same from where each node is when the step begins, mm.
    """

    at: str | Sequence[int]
    direction: str | Sequence[float]
    by: float | None = None
    further: float | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            at: str | Sequence[int],
            direction: str | Sequence[float],
            by: Typed | None = None,
            further: Typed | None = None,
        ) -> None:
            """See the attributes."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        what = f"displacement at '{self.at}'"
        if (self.by is None) == (self.further is None):
            raise ModelError(
                f"{what} needs either by (mm from the stress-free position) or further (mm from the present one)"
            )
        take_units(self, what, by="length", further="length")
        _finite(what, [value for value in (self.by, self.further) if value is not None])
        if isinstance(self.direction, str):
            if self.direction not in ("x", "y", "z"):
                raise ModelError(
                    f"displacement at '{self.at}': direction '{self.direction}' is not x, y, z or a vector"
                )
        else:
            _vector(f"displacement at '{self.at}': direction", self.direction)
            if not any(self.direction):
                raise ModelError(f"displacement at '{self.at}': the direction is the zero vector")

    def apply(self, builder: StepBuilder) -> None:
        """Ask for the displacement."""
        raw = AXES[self.direction] if isinstance(self.direction, str) else self.direction
        unit = np.asarray(raw, dtype=float) / np.linalg.norm(raw)
        nodes = select(builder.mesh, self.at)
        if self.further is not None:
            builder.displace(nodes, unit.tolist(), self.further, further=True)
        elif self.by is not None:
            builder.displace(nodes, unit.tolist(), self.by)

    @property
    def looks_back(self) -> bool:
        """See `Actuation.looks_back`."""
        return self.further is not None


@dataclass(frozen=True)
class Indenter(Body):
    """A rigid body that presses on the sheet in the step that names it.

    Its section is a rectangle with rounded edges, its axis as long as it needs to be. Indenters take the place of the
    rigid-body support in their step.

    Attributes:
        name: in `State.contact_forces`.
        at: centre of the section where the step begins, mm.
        azimuth: of the axis, from the x axis towards y, rad; tilt: of the axis, upwards, rad.
        width, height: of the whole section, mm; radius: of its edges, mm. Width and height of twice the radius make a
            cylinder.
        by: how far it moves while lambda runs from 0 to 1, mm.
        stiffness: of its surface, N/mm for every mm of the mesh's edges; gap: distance at which it begins to press, mm.
        friction: coefficient between it and the sheet; None for that of the model.
    """

    name: str
    at: tuple[float, float, float]
    azimuth: float
    width: float
    height: float
    radius: float
    by: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tilt: float = 0.0
    stiffness: float = 50.0
    gap: float = 0.05
    friction: float | None = None

    if TYPE_CHECKING:

        def __init__(  # noqa: PLR0913 - the fields of the dataclass
            self,
            name: str,
            at: tuple[Typed, Typed, Typed],
            azimuth: Typed,
            width: Typed,
            height: Typed,
            radius: Typed,
            by: tuple[Typed, Typed, Typed] = (0.0, 0.0, 0.0),
            tilt: Typed = 0.0,
            stiffness: float = 50.0,
            gap: Typed = 0.05,
            friction: float | None = None,
        ) -> None:
            """See the attributes."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        what = f"indenter '{self.name}'"
        take_units(self, what, azimuth="angle", tilt="angle", at="length", by="length", gap="length")
        take_units(self, what, width="length", height="length", radius="length")
        for key in ("at", "by"):
            _vector(f"indenter '{self.name}': {key}", getattr(self, key))
        _finite(f"indenter '{self.name}': azimuth or tilt", (self.azimuth, self.tilt))
        for key in ("width", "height", "radius", "stiffness", "gap"):
            value = getattr(self, key)
            if not (math.isfinite(value) and value > 0.0):
                raise ModelError(f"indenter '{self.name}': {key} = {value} cannot be; give a positive number")
        check_friction(self.friction, what)
        if 2.0 * self.radius > min(self.width, self.height) * (1.0 + 1e-12):
            raise ModelError(
                f"indenter '{self.name}': its radius {self.radius:g} mm is more than half of its section"
            )

    @property
    def half(self) -> tuple[float, float]:
        """Half the width and height between the centres of the rounded edges, mm."""
        return max(0.5 * self.width - self.radius, 0.0), max(0.5 * self.height - self.radius, 0.0)

    @property
    def across(self) -> tuple[float, float, float]:
        """Unit vector of the width, horizontal."""
        return -math.sin(self.azimuth), math.cos(self.azimuth), 0.0

    @property
    def up(self) -> tuple[float, float, float]:
        """Unit vector of the height."""
        s = math.sin(self.tilt)
        return -s * math.cos(self.azimuth), -s * math.sin(self.azimuth), math.cos(self.tilt)


@dataclass(frozen=True)
class Tether(Body):
    """Soft springs that hold nodes where the step begins; they share the `total` stiffness along x, y and z, N/mm."""

    at: str | Sequence[int]
    total: tuple[float, float, float]

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        _vector(f"tether at '{self.at}'", self.total)
        if min(self.total) < 0.0:
            raise ModelError(f"tether at '{self.at}': {self.total} cannot be; stiffness is not negative")


@dataclass(frozen=True)
class Pull(Body):
    """A spring from a node to a point of space, which moves during the step: a hand that pulls.

    Pulls take the place of the rigid-body support in their step.

    Attributes:
        node: that is pulled.
        to: (3,) the point at the end of the step, mm.
        stiffness: of the spring, N/mm, the same in all directions.
        start: (3,) the point where the step begins, mm; None for where the node is then.
    """

    node: int
    to: tuple[float, float, float]
    stiffness: float
    start: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        for key, value in (("to", self.to), ("start", self.start)):
            if value is not None:
                _vector(f"pull at node {self.node}: {key}", value)
                object.__setattr__(self, key, tuple(float(x) for x in value))  # lists, as files hold them
        if not (math.isfinite(self.stiffness) and self.stiffness > 0.0):
            raise ModelError(
                f"pull at node {self.node}: stiffness = {self.stiffness} cannot be; give a positive number of N/mm"
            )


def _finite(what: str, values: Sequence[float]) -> None:
    if not all(math.isfinite(value) for value in values):
        raise ModelError(f"{what} is not finite; give numbers")


def _vector(what: str, vector: Sequence[float]) -> None:
    if len(vector) != 3:
        raise ModelError(f"{what} needs three numbers, but has {len(vector)}")
    _finite(what, vector)
