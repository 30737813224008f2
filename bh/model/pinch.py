"""A crease that is folded already is closed further over a part of its length.

Arc lengths in mm of the flat sheet; parts, how far an edge takes part, in [0, 1].

Profiles of a pinch of length b about its middle (s = 0), as parts of the way from the present angle to the pinched one:

- "cosine": w(s) = cos^2(pi s / b), a raised cosine: one at the middle, zero with no slope at both ends, so that the
  fold rate phi' is continuous along the crease, and with it the torsion (Eq. 5.6);
- "grip": w(s) = 1, two jaws: the whole zone has the pinched angle, and the sheet finds its own way beyond.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError, TooCoarseError
from bh.model.laws import PRESCRIBED, SHEET
from bh.model.step import Actuation, StepBuilder, Zone
from meshes import SheetMesh
from meshes.curves import arc_lengths
from meshes.quantities import degrees_meant, take_units
from meshes.topology import Ints, chain_nodes

Array = NDArray[np.float64]
Profile = Literal["cosine", "grip"]
LEAST = 1e-9  # smaller parts are none


def _cosine(s: Array, b: float) -> Array:
    return np.where(np.abs(s) < 0.5 * b, np.cos(np.pi * s / b) ** 2, 0.0)


def _cosine_integral(s: Array, b: float) -> Array:
    s = np.clip(s, -0.5 * b, 0.5 * b)
    return 0.5 * s + b / (4.0 * np.pi) * np.sin(2.0 * np.pi * s / b)


def _grip(s: Array, b: float) -> Array:
    return (np.abs(s) <= 0.5 * b).astype(float)


def _grip_integral(s: Array, b: float) -> Array:
    return np.clip(s, -0.5 * b, 0.5 * b)


PROFILES: dict[str, tuple[Callable[[Array, float], Array], Callable[[Array, float], Array]]] = {
    "cosine": (_cosine, _cosine_integral),
    "grip": (_grip, _grip_integral),
}


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

    if TYPE_CHECKING:  # texts with units are taken, too, and kept as numbers

        def __init__(
            self,
            crease: str,
            at: float = 0.5,
            to: float | str | None = None,
            by: float | str | None = None,
            length: float | str | None = None,
            how: Literal["imposed", "rest", "couple"] = "imposed",
            profile: Profile = "cosine",
            couple: float | str | None = None,
        ) -> None:
            """See the attributes."""

    late: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        what = f"pinch of crease '{self.crease}'"
        take_units(self, what, to="angle", by="angle", length="length", couple="couple")
        if self.to is not None and self.by is not None:
            raise ModelError(f"{what} has to and by; give one of them")
        for key, low, high in (("to", 0.0, 2.0 * math.pi), ("by", 0.0, math.pi)):
            value = getattr(self, key)
            if value is not None and not low < value < high:
                hint = degrees_meant(value)
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

    def apply(self, builder: StepBuilder) -> None:
        """Ask for the pinch, from the angles that the other actuations of its step lead to."""
        for name in _names(builder.mesh, self.crease):
            self._apply_to(builder, name)

    def _apply_to(self, builder: StepBuilder, name: str) -> None:
        hinges, sense, _ = builder.creases(name)
        line = chain(builder.mesh, name)
        part, ends = parts(line, self.at, zone_length(line, name, self.at, self.length), self.profile)
        turned = builder.mesh.crease_edges(name)
        ends = np.where((turned[:, 0] > turned[:, 1])[:, None], ends[:, ::-1], ends)
        inside = np.flatnonzero(part > 0.0)
        rows, target = hinges[inside], self.target(sense)[inside]
        _check(builder, name, self, rows, target)
        zone = Zone(part[inside], ends[inside], name, self.at)
        if self.couple is not None:
            builder.couple(rows, sense[inside] * self.couple, zone)
        elif self.how == "rest":
            builder.rest_at(rows, target, zone=zone)
        else:
            builder.prescribe(rows, target, zone)


@dataclass(frozen=True, eq=False)
class Chain:
    """A crease as arc lengths: `ends` (k, 2) of its edges in order, mm; `closed` where it runs round."""

    ends: Array
    closed: bool

    @property
    def length(self) -> float:
        """Of the whole crease, mm."""
        return float(self.ends[-1, 1])


def is_chain(mesh: SheetMesh, crease: str) -> bool:
    """True if the edges of a crease follow one another.

    Args:
        mesh: has the crease.
        crease: its name.
    """
    pairs = mesh.crease_edges(crease)
    return bool((pairs[:-1, 1] == pairs[1:, 0]).all())


def chain(mesh: SheetMesh, crease: str) -> Chain:
    """Arc lengths along a crease of the flat sheet.

    Args:
        mesh: has the crease.
        crease: its name.

    Raises:
        ModelError: its edges are no chain (FOLD files name all mountains together, and each chain of them).
    """
    if not is_chain(mesh, crease):
        raise ModelError(
            f"pinch of crease '{crease}': it is not one line, so there is no way along it; name one line of it"
        )
    pairs = mesh.crease_edges(crease)
    s = arc_lengths(mesh.points[chain_nodes(pairs)])
    return Chain(np.column_stack((s[:-1], s[1:])), bool(pairs[0, 0] == pairs[-1, 1]))


def parts(line: Chain, at: float, length: float, profile: str) -> tuple[Array, Array]:
    """Parts (k,) of the edges of a chain in a pinch at the share `at` of its length, and (k, 2) of their ends.

    An edge has the mean of the profile along it. Both are scaled so that the largest is one: on any mesh the edge that
    closes most has just the pinched angle (the scale tends to one with the square of the edges' length).

    Args:
        line: of the crease.
        at: middle of the zone, as a share of the crease's length.
        length: of the zone, mm.
        profile: "cosine" or "grip".
    """
    value, integral = PROFILES[profile]
    middle = at * line.length
    turns = (-line.length, 0.0, line.length) if line.closed else (0.0,)
    widths = line.ends[:, 1] - line.ends[:, 0]
    mean: Array = np.zeros(len(widths))
    ends: Array = np.zeros((len(widths), 2))
    for turn in turns:
        s = line.ends - middle + turn
        mean += (integral(s[:, 1], length) - integral(s[:, 0], length)) / widths
        ends += value(s, length)
    if profile == "grip":  # jaws hold an edge or they do not
        mean = np.where(mean >= min(0.5, mean.max()) - LEAST, 1.0, 0.0)
        ends = np.repeat(mean, 2).reshape(-1, 2)
    mean = np.where(mean > LEAST, mean / mean.max(), 0.0)
    return mean, np.clip(ends / max(float(ends.max()), LEAST), 0.0, 1.0)


def zone_length(line: Chain, name: str, at: float, length: float | None) -> float:
    """Length of a pinched zone, mm; a fifth of the crease unless it is given.

    Args:
        line: of the crease.
        name: of the crease, for messages.
        at: middle of the zone, as a share of the crease's length.
        length: of the zone, mm; None for a fifth of the crease.

    Raises:
        TooCoarseError: the zone is shorter than two edges of the mesh.
        ModelError: the zone leaves the crease.
    """
    whole = line.length
    length = 0.2 * whole if length is None else length
    edge = whole / len(line.ends)
    if length < 1.999 * edge:
        raise TooCoarseError(
            f"pinch of crease '{name}': its zone of {length:.4g} mm is shorter than two edges of the mesh "
            f"({edge:.4g} mm each); give a longer one, or a finer mesh"
        )
    low, high = at * whole - 0.5 * length, at * whole + 0.5 * length
    if length > whole * (1.0 + 1e-9) or (
        not line.closed and (low < -1e-9 * whole or high > (1.0 + 1e-9) * whole)
    ):
        where = f"{0.5 * length / whole:.3g} to {1.0 - 0.5 * length / whole:.3g}"
        mend = f"give at from {where}, or a shorter length" if length <= whole else "give a shorter length"
        raise ModelError(
            f"pinch of crease '{name}': its zone from {low:.4g} to {high:.4g} mm leaves the crease (0 to "
            f"{whole:.4g} mm); {mend}"
        )
    return length


def _names(mesh: SheetMesh, crease: str) -> list[str]:
    """The creases that a pinch means, one line each."""
    if crease != "all":
        return [crease]
    found = [name for name in mesh.creases if mesh.folds.get(name) != "flat" and is_chain(mesh, name)]
    if not found:
        raise ModelError("pinch of crease 'all': the sheet has no mountain or valley crease")
    return found


def _check(builder: StepBuilder, name: str, item: Pinch, rows: Ints, target: Array) -> None:
    """Refuse a pinch of ordinary sheet, of prescribed angles by what acts on springs, and to the other side."""
    law, now = builder.laws(rows), builder.angles(rows)
    if (law == SHEET).any():
        raise ModelError(
            f"pinch of crease '{name}': it is ordinary sheet there; fold it before, or in the same step"
        )
    if item.how != "imposed" and (law == PRESCRIBED).any():
        by = "rest angles" if item.how == "rest" else "couples"
        raise ModelError(
            f"pinch of crease '{name}' by {by}: its angle is imposed there and no spring acts; use how = 'imposed'"
        )
    other = (now - math.pi) * (target - math.pi) < 0.0
    if other.any():
        angle = float(target[int(np.argmax(other))])
        raise ModelError(
            f"pinch of crease '{name}' to {angle:.4g} rad would fold it to its other side; "
            f"give {2.0 * math.pi - angle:.4g}, or by"
        )
