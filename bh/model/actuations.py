"""Actuations: what drives a sheet while the control parameter lambda runs from 0 to 1 in a step.

All of them are data, and know what they ask of the hinges and nodes of a sheet (`apply`); `bh.loading.builder` makes ramps of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.pinch import PROFILES, Profile, pinch
from bh.model.supports import AXES, select

if TYPE_CHECKING:
    from bh.loading.builder import Ramps

Array = NDArray[np.float64]
Angles = float | Sequence[float]


@dataclass(frozen=True)
class Ramp:
    """A value that goes linearly from `start` to `end`; both arrays of one shape."""

    start: Array
    end: Array

    def at(self, lam: float) -> Array:
        return (1.0 - lam) * self.start + lam * self.end

    @property
    def rate(self) -> Array:
        return self.end - self.start


class Actuation:
    """What acts in a step. An actuation of your own derives from it and is a frozen dataclass of plain values
    (docs/extending.md).
    """

    late: ClassVar[bool] = False  # applied after the others of its step, from where they lead

    def prepare(self, ramps: Ramps) -> None:
        """Before the first step: springs that must be there from the start."""

    def apply(self, ramps: Ramps) -> None:
        """What is asked for at the end of the step."""
        raise NotImplementedError


@dataclass(frozen=True)
class Fold(Actuation):
    """Fold a crease.

    Attributes:
        crease: its name, or "all" for every crease that is drawn as mountain or valley.
        to: dihedral angle that is imposed exactly (rigid connector), rad in (0, 2 pi); one number or one an edge.
        by: fold angle, mountain or valley as drawn, rad in (-pi, pi); imposed exactly, or the rest angle of a
            spring crease if `Lstar` or `stiffness` is given; "drawn" takes the angles of the pattern.
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

    def __post_init__(self) -> None:
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
                    + ("; angles are radians, not degrees" if np.abs(angles).max(initial=0.0) > 7.0 else "")
                )

    @property
    def _spring(self) -> bool:
        return self.Lstar is not None or self.stiffness is not None

    def prepare(self, ramps: Ramps) -> None:
        if self._spring:
            ramps.spring(ramps.creases(self.crease)[0], self.Lstar, self.stiffness)

    def apply(self, ramps: Ramps) -> None:
        hinges, sense, drawn = ramps.creases(self.crease)
        angle = self._target(sense, drawn)
        if self.rest is not None or self._spring:
            ramps.rest_at(hinges, angle, release=self._spring)
            return
        if not ((angle > 0.0) & (angle < 2.0 * math.pi)).all():
            raise ModelError(
                f"fold of crease '{self.crease}' closes it completely; stay inside (0, 2 pi) rad"
            )
        ramps.hold(hinges, angle)

    def _target(self, sense: Array, drawn: Array) -> Array:
        """(k,) dihedral angles at the end of the step, rad."""
        if isinstance(self.by, str):
            if np.isnan(drawn).any():
                raise ModelError(
                    f"fold of crease '{self.crease}': the pattern gives no fold angles; use by = radians"
                )
            return np.asarray(math.pi - drawn)
        value = next(value for value in (self.by, self.to, self.rest) if value is not None)
        angles = np.asarray(value, dtype=float)
        if angles.ndim and angles.shape != sense.shape:
            raise ModelError(
                f"fold of crease '{self.crease}' has {angles.size} angles for {len(sense)} edges"
            )
        angles = np.broadcast_to(angles, sense.shape).copy()
        return math.pi - sense * angles if self.by is not None else angles


@dataclass(frozen=True)
class Pinch(Actuation):
    """Close a crease that is folded already over a part of its length (source 5.3.2).

    Along the pinched zone the dihedral angle goes from what it is to the pinched one by a profile (`bh.model.pinch`).
    Outside of the zone, and in later steps, the crease stays what it was; `Fold` with the stiffness of its spring opens
    a pinch again. In one step with the fold, the zone goes to where the fold would have brought it.

    Attributes:
        crease: its name, or "all" for every crease that is drawn as mountain or valley.
        at: where the middle of the zone is, in parts of the crease's length from its start, 0 to 1.
        to: dihedral angle in the middle, rad in (0, 2 pi).
        by: fold angle in the middle instead, mountain or valley as drawn, rad in (0, pi). If neither is given it is
            pi - pi / 14, the source's pinch.
        length: of the zone along the crease, mm; a fifth of the crease if not given.
        how: "imposed" holds the angles of the zone exactly. "rest" only sets the rest angles of the crease's spring,
            which the sheet resists: with the source's L* of 0.5 and 2 mm such a pinch stops far above its angle.
            "couple" lets closing couples act over the zone, spread by the profile, which grow until the angle is
            reached somewhere in it (`Model.pinch`; alone, or without such an `Until`, they grow to their end).
        profile: "cosine", or "grip" for the pinched angle all over the zone.
        couple: with "couple" the largest one a length in the middle, N mm / mm; more than the pinch needs.
    """

    crease: str
    at: float = 0.5
    to: float | None = None
    by: float | None = None
    length: float | None = None
    how: Literal["imposed", "rest", "couple"] = "imposed"
    profile: Profile = "cosine"
    couple: float | None = None

    def __post_init__(self) -> None:
        what = f"pinch of crease '{self.crease}'"
        if self.to is not None and self.by is not None:
            raise ModelError(f"{what} has to and by; give one of them")
        for key, low, high in (("to", 0.0, 2.0 * math.pi), ("by", 0.0, math.pi)):
            value = getattr(self, key)
            if value is not None and not low < value < high:
                hint = "; angles are radians, not degrees" if abs(value) > 7.0 else ""
                raise ModelError(
                    f"{what}: {key} = {value} rad closes it beyond what it can; stay inside ({low:g}, {high:.4g}){hint}"
                )
        if not 0.0 <= self.at <= 1.0:
            raise ModelError(
                f"{what}: at = {self.at} is outside the crease; give a part of its length, 0 to 1"
            )
        if self.length is not None and not (math.isfinite(self.length) and self.length > 0.0):
            raise ModelError(f"{what}: length = {self.length} cannot be; give a positive length in mm")
        for key, known in (("how", ("imposed", "rest", "couple")), ("profile", tuple(PROFILES))):
            if getattr(self, key) not in known:
                raise ModelError(
                    f"{what}: {key} = '{getattr(self, key)}' is not known; use {' or '.join(known)}"
                )

        if (self.how == "couple") != (self.couple is not None):
            raise ModelError(
                f"{what}: couple goes with how = 'couple', and only with it; give both or neither"
            )
        if self.couple is not None and not (math.isfinite(self.couple) and self.couple > 0.0):
            raise ModelError(f"{what}: couple = {self.couple} cannot be; give a positive number in N mm / mm")

    def target(self, sense: Array) -> Array:
        """(k,) dihedral angles in the middle, rad, for edges drawn as mountain (+1) or valley (-1)."""
        if self.to is not None:
            return np.full(len(sense), float(self.to))
        return np.asarray(math.pi - sense * self.fold)

    @property
    def fold(self) -> float:
        """Size of the fold angle in the middle, rad."""
        if self.to is not None:
            return abs(math.pi - self.to)
        return math.pi - math.pi / 14.0 if self.by is None else self.by

    late: ClassVar[bool] = True

    def apply(self, ramps: Ramps) -> None:
        pinch(ramps, self)


@dataclass(frozen=True)
class Moment(Actuation):
    """A dead couple a length on a crease, N mm / mm; positive folds the crease the way that it is drawn."""

    crease: str
    to: float

    def __post_init__(self) -> None:
        _finite(f"moment on crease '{self.crease}'", (self.to,))

    def apply(self, ramps: Ramps) -> None:
        hinges, sense, _ = ramps.creases(self.crease)
        ramps.couple(hinges, sense * self.to)


@dataclass(frozen=True)
class Force(Actuation):
    """A dead force. `each` (N) acts on every node of the place; `total` (N) is shared equally among them."""

    at: str | Sequence[int]
    each: Sequence[float] | None = None
    total: Sequence[float] | None = None

    def __post_init__(self) -> None:
        if (self.each is None) == (self.total is None):
            raise ModelError(
                f"force at '{self.at}' needs either each or total, a vector of three numbers in N"
            )
        vector = self.each if self.each is not None else self.total
        assert vector is not None
        _vector(f"force at '{self.at}'", vector)

    def apply(self, ramps: Ramps) -> None:
        nodes = select(ramps.mesh, self.at)
        vector = self.each if self.each is not None else self.total
        share = 1.0 if self.each is not None else 1.0 / len(nodes)
        ramps.pull(nodes, share * np.asarray(vector, dtype=float))


@dataclass(frozen=True)
class Displace(Actuation):
    """Prescribed displacement from the stress-free position: `by` (mm) along `direction` (three numbers, or x, y, z).

    Nodes stay free across the direction, and keep their displacement in later steps.
    """

    at: str | Sequence[int]
    direction: str | Sequence[float]
    by: float

    def __post_init__(self) -> None:
        _finite(f"displacement at '{self.at}'", (self.by,))
        if isinstance(self.direction, str):
            if self.direction not in ("x", "y", "z"):
                raise ModelError(
                    f"displacement at '{self.at}': direction '{self.direction}' is not x, y, z or a vector"
                )
        else:
            _vector(f"displacement at '{self.at}': direction", self.direction)
            if not any(self.direction):
                raise ModelError(f"displacement at '{self.at}': the direction is the zero vector")

    def apply(self, ramps: Ramps) -> None:
        raw = AXES[self.direction] if isinstance(self.direction, str) else self.direction
        unit = np.asarray(raw, dtype=float) / np.linalg.norm(raw)
        ramps.displace(select(ramps.mesh, self.at), unit.tolist(), self.by)


@dataclass(frozen=True)
class Bar(Actuation):
    """A rigid bar that the sheet can touch, without friction, in the step that names it (`bh.mechanics.shared.contact`).

    Its section is a rectangle with rounded edges, its axis as long as it needs to be. Bars take the place of the
    rigid-body support in their step.

    Attributes:
        name: in `State.pressing`.
        at: centre of the section where the step begins, mm.
        azimuth: of the axis, from the x axis towards y, rad; tilt: of the axis, upwards, rad.
        width, height: of the whole section, mm; radius: of its edges, mm. Width and height of twice the radius make a
            cylinder.
        by: how far it moves while lambda runs from 0 to 1, mm.
        stiffness: of its surface, N/mm for every mm of the mesh's edges; gap: distance at which it begins to press, mm.
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

    def __post_init__(self) -> None:
        for key in ("at", "by"):
            _vector(f"bar '{self.name}': {key}", getattr(self, key))
        _finite(f"bar '{self.name}': azimuth or tilt", (self.azimuth, self.tilt))
        for key in ("width", "height", "radius", "stiffness", "gap"):
            value = getattr(self, key)
            if not (math.isfinite(value) and value > 0.0):
                raise ModelError(f"bar '{self.name}': {key} = {value} cannot be; give a positive number")
        if 2.0 * self.radius > min(self.width, self.height) * (1.0 + 1e-12):
            raise ModelError(
                f"bar '{self.name}': its radius {self.radius:g} mm is more than half of its section"
            )

    def apply(self, ramps: Ramps) -> None:
        ramps.touch(self)

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
class Tether(Actuation):
    """Soft springs that hold nodes where the step begins; they share the `total` stiffness along x, y and z, N/mm."""

    at: str | Sequence[int]
    total: tuple[float, float, float]

    def __post_init__(self) -> None:
        _vector(f"tether at '{self.at}'", self.total)
        if min(self.total) < 0.0:
            raise ModelError(f"tether at '{self.at}': {self.total} cannot be; stiffness is not negative")

    def apply(self, ramps: Ramps) -> None:
        ramps.touch(self)


def _finite(what: str, values: Sequence[float]) -> None:
    if not all(math.isfinite(value) for value in values):
        raise ModelError(f"{what} is not finite; give numbers")


def _vector(what: str, vector: Sequence[float]) -> None:
    if len(vector) != 3:
        raise ModelError(f"{what} needs three numbers, but has {len(vector)}")
    _finite(what, vector)
