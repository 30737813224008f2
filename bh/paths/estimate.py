"""How accurate a path is by its own estimate, and what that took: what `bh.solving.accuracy` finds out."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from bh.model.refinement import Goal
from bh.solvers.outcome import Outcome

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trial:
    """One solve on the way: formulation, level, mesh, cost and the value of the goal: (k,), nan if not reached."""

    formulation: str
    level: float
    triangles: int
    unknowns: int
    iterations: int
    wall_time_s: float
    outcome: Outcome
    value: Array


@dataclass(frozen=True)
class Accuracy:
    """How accurate a path is by its own estimate, and what that took.

    Attributes:
        goal: what was asked for.
        estimate: of the relative error of the goal at the last state; inf where there is none.
        met: whether the estimate is within what was asked for.
        order: that the last three values show, nan where they show none.
        formulation, mesh: what was chosen.
        trials: all solves, coarse to fine.
        wall_time_s: of all of them with their meshes.
    """

    goal: Goal
    estimate: float
    met: bool
    order: float
    formulation: str
    mesh: str
    trials: tuple[Trial, ...]
    wall_time_s: float

    def __str__(self) -> str:
        """One line: "energy to 1.3 % by its own estimate (2 % asked): consistent, 32 x 4 staggered cells; 3 meshes"."""
        met = "asked" if self.met else "asked, not met"
        return (
            f"{self.goal.of} to {100 * self.estimate:.2g} % by its own estimate ({100 * self.goal.within:g} % {met}): "
            f"{self.formulation}, {self.mesh}; {len(self.trials)} meshes, {self.wall_time_s:.2g} s"
        )

    def as_dict(self) -> dict[str, object]:
        """Plain data for result.json."""
        return {
            "of": self.goal.of,
            "at": self.goal.at,
            "within": self.goal.within,
            "estimate": self.estimate if math.isfinite(self.estimate) else None,
            "met": self.met,
            "order": self.order if math.isfinite(self.order) else None,
            "formulation": self.formulation,
            "mesh": self.mesh,
            "wall_time_s": self.wall_time_s,
            "trials": [{**asdict(t), "value": _plain(t.value)} for t in self.trials],
        }


def _plain(value: Array) -> list[float] | None:
    return [float(v) for v in value] if np.isfinite(value).all() else None
