"""What a hand asks of a sheet: fold angles of creases and points that are pulled; and the straight way between two."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from bh.live.grips import Grip, Jaws
from bh.model.actuations import Fold, Force, Pull
from bh.model.model import Model
from bh.model.step import Actuation

Array = NDArray[np.float64]
CLOSED = math.pi - 1e-3  # rad; the largest fold angle that a slider can ask for
UNIT = 1.0  # rad of the crease that turns most, a unit of the way between two controls
PARALLEL = 1e-9  # parts by which a direction may differ and still be the same


@dataclass(frozen=True)
class Controls:
    """Everything that a hand has set.

    Attributes:
        folds: fold angle of creases by name, rad, positive the way that each is drawn. Creases that are not here are
            left alone.
        grips: pulled nodes.
        jaws: pairs of pulled nodes that are pinched.
    """

    folds: Mapping[str, float] = field(default_factory=dict)
    grips: Mapping[int, Grip] = field(default_factory=dict)
    jaws: tuple[Jaws, ...] = ()

    def __post_init__(self) -> None:
        """Freeze what was given."""
        object.__setattr__(self, "folds", MappingProxyType(dict(self.folds)))
        object.__setattr__(self, "grips", MappingProxyType(dict(self.grips)))

    def vector(self) -> Array:
        """Its numbers in one array.

        Returns:
            (folds + 3 grips,) angles, rad, then points, mm.
        """
        points = [x for grip in self.grips.values() for x in grip.to]
        return np.array([*self.folds.values(), *points])

    def like(self, other: Controls) -> bool:
        """Whether both speak of the same creases, nodes and springs, so that there is a straight way between them."""
        springs, others = (
            [(node, grip.stiffness) for node, grip in each.grips.items()] for each in (self, other)
        )
        return list(self.folds) == list(other.folds) and springs == others

    def moved(self, vector: Array) -> Controls:
        """The same creases and nodes with the numbers of `vector`, as of `Controls.vector`."""
        folds = dict(zip(self.folds, vector[: len(self.folds)].tolist(), strict=True))
        points = vector[len(self.folds) :].reshape(-1, 3).tolist()
        grips = {
            node: Grip((x, y, z), grip.stiffness)
            for (node, grip), (x, y, z) in zip(self.grips.items(), points, strict=True)
        }
        return Controls(folds, grips, self.jaws)

    def gripped(self, grips: Mapping[int, Grip], jaws: Jaws | None = None) -> Controls:
        """With other nodes pulled, too; what held these nodes before is opened.

        Args:
            grips: by node.
            jaws: that pull them; None where a hand does.
        """
        kept = tuple(old for old in self.jaws if not grips.keys() & {old.a, old.b})
        opened = {node for old in self.jaws if old not in kept for node in (old.a, old.b)} - grips.keys()
        left = {node: grip for node, grip in self.grips.items() if node not in opened}
        new = () if jaws is None else (jaws,)
        return Controls(self.folds, {**left, **grips}, (*kept, *new))

    def without(self, node: int | None) -> Controls:
        """Without the pull or the pinch of a node; None lets go of all."""
        if node is None:
            return Controls(self.folds)
        opened = [old for old in self.jaws if node in (old.a, old.b)]
        gone = {node, *(n for old in opened for n in (old.a, old.b))}
        left = {n: grip for n, grip in self.grips.items() if n not in gone}
        return Controls(self.folds, left, tuple(old for old in self.jaws if old not in opened))


@dataclass(frozen=True)
class Way:
    """A straight way through controls: `start` at lambda = 0, and `end` at lambda = 1."""

    start: Controls
    end: Controls

    @classmethod
    def toward(cls, start: Controls, wanted: Controls) -> Way:
        """The way that leads through `wanted`, long enough for a slider that goes on.

        A unit of lambda is `UNIT` rad of the crease that turns most, or what is left of its range; a pull ends where
        it is wanted.

        Args:
            start: what the sheet is in equilibrium with.
            wanted: of the same creases and nodes.
        """
        change = wanted.vector() - start.vector()
        folds = len(start.folds)
        turned = float(np.abs(change[:folds]).max(initial=0.0))
        if turned == 0.0 or wanted.grips:
            return cls(start, wanted)
        room = min(
            (CLOSED - math.copysign(1.0, d) * a) / abs(d)
            for a, d in zip(start.folds.values(), change[:folds].tolist(), strict=True)
            if d != 0.0
        )
        return cls(start, start.moved(start.vector() + max(1.0, min(UNIT / turned, room)) * change))

    def at(self, lam: float) -> Controls:
        """The controls at a lambda, which may be outside 0 to 1."""
        begin = self.start.vector()
        return self.start.moved(begin + lam * (self.end.vector() - begin))

    def find(self, wanted: Controls) -> float | None:
        """Lambda of controls on this way; None if they are not on it."""
        if not wanted.like(self.start):
            return None
        along = self.end.vector() - self.start.vector()
        change = wanted.vector() - self.start.vector()
        size = float(along @ along)
        if size == 0.0:
            return 0.0 if not change.any() else None
        lam = float(change @ along) / size
        off = float(np.abs(change - lam * along).max())
        return lam if off <= PARALLEL * max(float(np.abs(change).max()), float(np.abs(along).max())) else None

    def actuations(self, model: Model, gone: tuple[int, ...] = ()) -> tuple[Actuation, ...]:
        """What brings the end about.

        Args:
            model: whose creases they are.
            gone: nodes that were let go of: what still pulls there fades out.

        Returns:
            one for each crease and node.
        """
        items: list[Actuation] = []
        for crease, angle in self.end.folds.items():
            items.append(fold_of(model, crease, angle))
        items += [Force([node], each=(0.0, 0.0, 0.0)) for node in gone]
        items += [
            Pull(node, grip.to, grip.stiffness, self.start.grips[node].to)
            for node, grip in self.end.grips.items()
        ]
        return tuple(items)


def fold_of(model: Model, crease: str, angle: float) -> Fold:
    """The fold of a crease to an angle: imposed, or the rest angle of its spring or of its strip.

    Args:
        model: whose crease it is.
        crease: its name.
        angle: rad, positive the way that it is drawn; of a wide crease mountain positive.
    """
    if crease in model.mesh.wide_creases:
        return Fold(crease, rest=math.pi - angle)
    law = model.creases.get(crease)
    if law is None:
        return Fold(crease, by=angle)
    if (
        law.Lstar is None and law.stiffness is None
    ):  # its law has a stiffness of its own: `by` would impose the angle
        return Fold(crease, rest=math.pi - model.mesh.sense(crease) * angle)
    return Fold(crease, by=angle, Lstar=law.Lstar, stiffness=law.stiffness)
