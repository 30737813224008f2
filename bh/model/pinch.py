"""How far each edge of a crease takes part in a pinch. Arc lengths in mm of the flat sheet; parts in [0, 1].

Profiles of a pinch of length b about its middle (s = 0), as parts of the way from the present angle to the pinched one:

- "cosine": w(s) = cos^2(pi s / b), a raised cosine: one at the middle, zero with no slope at both ends, so that the
  fold rate phi' is continuous along the crease, and with it the torsion (Eq. 5.6);
- "grip": w(s) = 1, two jaws: the whole zone has the pinched angle, and the sheet finds its own way beyond.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.laws import HELD, SHEET
from meshes import SheetMesh
from meshes.curves import arc_lengths
from meshes.topology import Ints

if TYPE_CHECKING:
    from bh.loading.builder import Ramps
    from bh.model.actuations import Pinch

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


@dataclass(frozen=True, eq=False)
class Pinched:
    """Held creases whose angles at the end of a step follow from those at its start.

    Attributes:
        toward: (m,) angle in the middle of the pinch, rad; nan where there is none.
        base: (m,) angle that the pinch goes from, rad; nan where it is the one that the step begins with.
        part: (m,) how far the edge goes from there to `toward`, and `ends` (m, 2) at its lower and its higher node.
        present: (m,) what the steps before make of the angle at the start, rad, for the size of increments only.
    """

    toward: Array
    base: Array
    part: Array
    ends: Array
    present: Array

    @classmethod
    def none(cls, hinges: int) -> Pinched:
        empty = np.full(hinges, np.nan)
        return cls(empty, empty.copy(), np.zeros(hinges), np.zeros((hinges, 2)), np.full(hinges, np.pi))


@dataclass(frozen=True, eq=False)
class Chain:
    """A crease as arc lengths: `ends` (k, 2) of its edges in order, mm; `closed` where it runs round."""

    ends: Array
    closed: bool

    @property
    def length(self) -> float:
        return float(self.ends[-1, 1])


def is_chain(mesh: SheetMesh, crease: str) -> bool:
    """True if the edges of a crease follow one another."""
    pairs = mesh.crease_edges(crease)
    return bool((pairs[:-1, 1] == pairs[1:, 0]).all())


def chain(mesh: SheetMesh, crease: str) -> Chain:
    """Arc lengths along a crease of the flat sheet.

    Raises:
        ModelError: its edges are no chain (FOLD files name all mountains together, and each chain of them).
    """
    if not is_chain(mesh, crease):
        raise ModelError(
            f"pinch of crease '{crease}': it is not one line, so there is no way along it; name one line of it"
        )
    pairs = mesh.crease_edges(crease)
    s = arc_lengths(mesh.points[np.append(pairs[:, 0], pairs[-1, 1])])
    return Chain(np.column_stack((s[:-1], s[1:])), bool(pairs[0, 0] == pairs[-1, 1]))


def parts(line: Chain, at: float, length: float, profile: str) -> tuple[Array, Array]:
    """Parts (k,) of the edges of a chain in a pinch at the share `at` of its length, and (k, 2) of their ends.

    An edge has the mean of the profile along it. Both are scaled so that the largest is one: on any mesh the edge that
    closes most has just the pinched angle (the scale tends to one with the square of the edges' length).
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


def zone(line: Chain, name: str, at: float, length: float | None) -> float:
    """Length of a pinched zone, mm; a fifth of the crease unless it is given.

    Raises:
        ModelError: the zone leaves the crease, or is shorter than two edges of the mesh.
    """
    whole = line.length
    length = 0.2 * whole if length is None else length
    edge = whole / len(line.ends)
    if length < 1.999 * edge:
        raise ModelError(
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


def pinch(ramps: Ramps, item: Pinch) -> None:
    """Ask for a pinch, from the angles that the other actuations of its step lead to."""
    names = [item.crease]
    if item.crease == "all":
        folds, mesh = ramps.mesh.folds, ramps.mesh
        names = [name for name in mesh.creases if folds.get(name) != "flat" and is_chain(mesh, name)]
        if not names:
            raise ModelError("pinch of crease 'all': the sheet has no mountain or valley crease")
    for name in names:
        _pinch_one(ramps, name, item)


def _pinch_one(ramps: Ramps, name: str, item: Pinch) -> None:
    hinges, sense, _ = ramps.creases(name)
    line = chain(ramps.mesh, name)
    part, ends = parts(line, item.at, zone(line, name, item.at, item.length), item.profile)
    turned = ramps.mesh.crease_edges(name)
    ends = np.where((turned[:, 0] > turned[:, 1])[:, None], ends[:, ::-1], ends)
    inside = np.flatnonzero(part > 0.0)
    rows, part, ends = hinges[inside], part[inside], ends[inside]
    now, target = ramps.before[rows], item.target(sense)[inside]
    _check(ramps, name, item, rows, now, target)
    nominal = now + part * (target - now)
    wanted = nominal if item.couple is None else part * item.couple
    for row, angle in zip(rows.tolist(), wanted.tolist(), strict=True):
        known, other = ramps.claimed.setdefault(row, (angle, item.at))
        if abs(known - angle) > 1e-9:
            raise ModelError(
                f"two pinches of crease '{name}' overlap and contradict each other (at {other:g} and "
                f"{item.at:g}); keep their zones apart, or pinch one after the other"
            )
    if item.couple is not None:
        ramps.moment[rows] = sense[inside] * wanted
        return
    if item.how == "rest":
        ramps.rest[rows] = nominal
        ramps.rest_ends[rows] += ends * (target[:, None] - ramps.rest_ends[rows])
        return
    ramps.law[rows], ramps.held[rows] = HELD, nominal
    ramps.pinch.toward[rows], ramps.pinch.part[rows], ramps.pinch.ends[rows] = target, part, ends
    ramps.pinch.base[rows] = np.where(ramps.folded[rows], now, np.nan)
    ramps.pinched[rows] = True


def _check(ramps: Ramps, name: str, item: Pinch, rows: Ints, now: Array, target: Array) -> None:
    law = ramps.law[rows]
    if (law == SHEET).any():
        raise ModelError(
            f"pinch of crease '{name}': it is ordinary sheet there; fold it before, or in the same step"
        )
    if item.how != "imposed" and (law == HELD).any():
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
