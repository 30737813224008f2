"""What is known of the error of a path: the estimate, and the meshes that it was made from."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bh.model.refinement import MOST, Goal
from bh.paths.stored import line
from bh.solvers.outcome import Outcome
from meshes.mesh import count

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trial:
    """One solve on the way.

    Attributes:
        formulation, level: what was solved; the level is that of `meshes.choices.choices`, nan of a given mesh.
        mesh: its cells in words.
        triangles, unknowns, iterations, wall_time_s: what it took.
        outcome: of the path.
        value: of the goal: (k,), nan if not reached.
        snaps: numbers of the steps, from 1, in which the path passed a limit point, jumped to another branch, or
            ended where it is not stable.
        doubtful: it snapped in a step where the next mesh does not; its value does not enter the estimate.
    """

    formulation: str
    level: float
    mesh: str
    triangles: int
    unknowns: int
    iterations: int
    wall_time_s: float
    outcome: Outcome
    value: Array
    snaps: tuple[int, ...] = ()
    doubtful: bool = False


@dataclass(frozen=True)
class Accuracy:
    """How accurate a path is by its own estimate, and what that took.

    Attributes:
        goal: what the estimate is of, and what was asked for.
        estimate: of the relative error of the goal at the last state; inf where there is none.
        met: whether the estimate is within what was asked for.
        order: that the last three values show, nan where they show none.
        formulation, mesh: what was solved last.
        trials: all solves, coarse to fine.
        wall_time_s: of all of them with their meshes; where nothing was asked for, of the estimate alone.
        asked: False where the mesh was given and the error is only told; `met` says nothing then.
        notes: one line each: meshes that could not be made and what was taken, values that were not trusted, why it is
            not met.
    """

    goal: Goal
    estimate: float
    met: bool
    order: float
    formulation: str
    mesh: str
    trials: tuple[Trial, ...]
    wall_time_s: float
    asked: bool = True
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        """One line: "energy to 1.3 % by its own estimate (2 % asked): consistent, 256 triangles; 3 meshes, 0.1 s"."""
        told = f"{self.goal.of} to {100 * self.estimate:.2g} % by its own estimate"
        if not math.isfinite(self.estimate):
            told = f"{self.goal.of}: no estimate"
        meshes = f"{count(len(self.trials), 'mesh').replace('meshs', 'meshes')}, {self.wall_time_s:.2g} s"
        if not self.asked:
            return f"{told}: {self.formulation}, {self.mesh}; a coarser mesh was solved, too, {self.wall_time_s:.2g} s"
        met = "asked" if self.met else "asked, not met"
        return f"{told} ({100 * self.goal.within:g} % {met}): {self.formulation}, {self.mesh}; {meshes}"

    def as_dict(self) -> dict[str, object]:
        """Plain data for result.json and path files.

        Returns:
            plain data by the names of the fields.
        """
        return {
            "of": self.goal.of,
            "at": self.goal.at,
            "direction": None if self.goal.direction is None else list(self.goal.direction),
            "within": self.goal.within if self.asked else None,
            "estimate": self.estimate if math.isfinite(self.estimate) else None,
            "met": self.met if self.asked else None,
            "order": self.order if math.isfinite(self.order) else None,
            "formulation": self.formulation,
            "mesh": self.mesh,
            "wall_time_s": self.wall_time_s,
            "notes": list(self.notes),
            "trials": [
                {
                    **asdict(t),
                    "level": t.level if math.isfinite(t.level) else None,
                    "value": _plain(t.value),
                    "snaps": list(t.snaps),
                }
                for t in self.trials
            ],
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Accuracy:
        """What `as_dict` has written."""
        direction = data["direction"]
        asked = data["within"] is not None
        goal = Goal(
            data["within"] if asked else MOST,
            data["of"],
            data["at"],
            None if direction is None else tuple(direction),
        )
        return cls(
            goal,
            math.inf if data["estimate"] is None else data["estimate"],
            bool(data["met"]),
            math.nan if data["order"] is None else data["order"],
            data["formulation"],
            data["mesh"],
            tuple(_trial(trial) for trial in data["trials"]),
            data["wall_time_s"],
            asked,
            tuple(data["notes"]),
        )


def stored(data: Mapping[str, object]) -> Accuracy:
    """What a path file tells of the error, its types looked at.

    Args:
        data: what `Accuracy.as_dict` has written, or somebody else.

    Raises:
        ValueError, TypeError, LookupError: it is not that.
    """
    found = Accuracy.from_dict(data)
    for number in (found.estimate, found.order, found.wall_time_s):
        if type(number) not in (int, float):
            raise ValueError("its accuracy is no number")
    for text in (found.formulation, found.mesh, *found.notes):
        line(text, "what it says of its accuracy")
    str(found), found.as_dict()
    return found


def _trial(data: Mapping[str, Any]) -> Trial:
    level, value = data["level"], data["value"]
    told = {
        "level": math.nan if level is None else level,
        "value": np.array([math.nan] if value is None else value),
        "outcome": Outcome(data["outcome"]),
        "snaps": tuple(data.get("snaps", ())),
    }
    known = {
        key: value for key, value in data.items() if key != "snapped"
    }  # older files: whether, not in which steps
    return Trial(**{**known, **told})


def _plain(value: Array) -> list[float] | None:
    return [float(v) for v in value] if np.isfinite(value).all() else None
