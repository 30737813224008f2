"""What holds the sheet from step to step, and where it lies when a step begins."""

from __future__ import annotations

from collections.abc import MutableMapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from bh.errors import ModelError
from bh.model.constraints import Constraints, Lying, free_motions, rigid_motions
from bh.model.model import Model
from bh.model.step import Step
from bh.model.supports import Constraint, RigidBody, Support, same_place, select

Array = NDArray[np.float64]
Direction = tuple[float, float, float]
Displaced = MutableMapping[tuple[int, Direction], float]


class Supports:
    """Supports in force.

    Attributes:
        flat: those of the model, which hold stress-free places.
        here: those that came in with a step, which hold what lies where that step begins, and from then on.
        points: (n, 3) positions where the step in hand begins, mm; None where they are not known.
    """

    def __init__(self, model: Model) -> None:
        """Those of a model before its first step, which begins with the stress-free sheet."""
        self.mesh = model.mesh
        self.flat: list[Constraint] = list(model.supports)
        self.here: list[Constraint] = []
        self.points: Array | None = model.mesh.points
        self._changing = any(step.looks_back for step in model.steps)
        self._first = True

    @property
    def lying(self) -> Lying | None:
        """What `bh.model.constraints.resolve` has to know of a step; None where supports never change."""
        return Lying(tuple(self.here), self.points) if self._changing else None

    def displacement(self, node: int, direction: Direction) -> float:
        """Displacement of a node along a unit vector where the step begins, mm; nan where that is not known.

        Args:
            node: its index.
            direction: (3,) of length one.
        """
        if self.points is None:
            return np.nan
        return float((self.points[node] - self.mesh.points[node]) @ np.asarray(direction))

    def now(self, key: tuple[int, Direction], asked: float) -> float:
        """What a prescribed displacement is where the step begins, mm.

        Args:
            key: node and direction.
            asked: what the steps before have asked for, nan where that follows from a state.
        """
        return self.displacement(*key) if np.isnan(asked) else asked

    def change(self, step: Step, displaced: Displaced) -> None:
        """Let go of what a step releases, and take in what it supports.

        Args:
            step: that begins.
            displaced: prescribed displacements by node and direction; released ones are removed, and those that are not
                known become what they are.

        Raises:
            ModelError: nothing is held at a place that is to be released; one line that names what is.
        """
        for key, value in displaced.items():
            displaced[key] = self.now(key, value)
        for item in step.release:
            self._release(item, displaced)
        self.here += [each for each in step.support if each not in self.here]

    def _release(self, item: str | Sequence[int] | Constraint, displaced: Displaced) -> None:
        kept = [[each for each in group if not _is(item, each)] for group in (self.flat, self.here)]
        gone = len(self.flat) + len(self.here) - len(kept[0]) - len(kept[1])
        self.flat, self.here = kept
        if not isinstance(item, Constraint) and item != RIGID_BODY:
            nodes = set(select(self.mesh, item).tolist())
            for key in [key for key in displaced if key[0] in nodes]:
                del displaced[key]
                gone += 1
        if not gone:
            held = [_name(each) for each in (*self.flat, *self.here)]
            what = f"'{item}'" if isinstance(item, str) else "what was given"
            raise ModelError(
                f"release: nothing is held at {what}"
                + (f"; held are {', '.join(held)}" if held else ", nor elsewhere")
            )


def isostatic(constraints: Constraints, points: Array) -> list[Support]:
    """Supports that hold what rigid motions are left free and no more, so that they carry nothing in equilibrium.

    Args:
        constraints: what is held already.
        points: (n, 3) positions, mm.

    Returns:
        one a motion that is free, each of one node along one axis.
    """
    left = rigid_motions(points) @ free_motions(points, constraints)
    rows = left.reshape(len(points), 3, -1).copy()
    rows[constraints.frame_of >= 0] = 0.0
    rows[constraints.fixed] = 0.0
    _, _, order = qr(rows.reshape(3 * len(points), -1).T, mode="economic", pivoting=True)
    return [Support((int(row) // 3,), "xyz"[int(row) % 3]) for row in order[: left.shape[1]]]


RIGID_BODY = "rigid-body"


def _is(item: str | Sequence[int] | Constraint, support: Constraint) -> bool:
    """Whether a support is meant by an item of `Step.release`."""
    if isinstance(item, Constraint):
        return item == support
    if isinstance(support, RigidBody):
        return item == RIGID_BODY
    place = getattr(support, "at", None)
    return place is not None and same_place(item, place)


def _name(support: Constraint) -> str:
    if isinstance(support, RigidBody):
        return RIGID_BODY
    place = getattr(support, "at", type(support).__name__)
    return str(place) if isinstance(place, str) else "nodes " + ", ".join(str(node) for node in place)
