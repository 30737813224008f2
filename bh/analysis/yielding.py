"""When and where a sheet begins to yield along a path. Nothing yields in a formulation: elastic states are judged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bh.errors import ModelError
from bh.formulations.stress import Extreme
from bh.paths.path import Path


@dataclass(frozen=True)
class Yielding:
    """How near to yield a path has come.

    Attributes:
        largest: nearest to yield of all states; its utilisation is below 1 where nothing yields.
        state: which one of the path that is, from 0.
        first: the first place that yields, in the first state beyond; None where nothing does.
        step: in which it begins, from 0; -1 where nothing yields.
        lam: control parameter there, between two states linear in the utilisation; nan where nothing yields.
    """

    largest: Extreme
    state: int
    first: Extreme | None = None
    step: int = -1
    lam: float = float("nan")

    def __str__(self) -> str:
        """One line, such as "yield begins in step 1 at lambda 0.42, at the top near (12.5, 3) mm"."""
        if self.first is None:
            where = _where(self.largest)
            return f"yield: none; at most {self.largest.utilisation:.3g} of the strength, {where}"
        return (
            f"yield begins in step {self.step + 1} at lambda {self.lam:.3g}, {_where(self.first)}; "
            f"at most {self.largest.utilisation:.3g} of the strength, {_where(self.largest)}"
        )


def yielding(path: Path) -> Yielding:
    """When and where the stress first reaches the strength of the sheet, by values at corners of triangles.

    Args:
        path: of a formulation that has stresses, and of a sheet with a strength.

    Raises:
        ModelError: there is no state, no stress or no strength.
    """
    if len(path) == 0:
        raise ModelError("the path has no states whose stress could be read; trace the model first")
    worst = [(state.step, state.lam, state.stress().worst()) for state in path]
    use = np.array([found.utilisation for _, _, found in worst])
    most = int(use.argmax())
    if use[most] < 1.0:
        return Yielding(worst[most][2], most)
    first = int((use >= 1.0).argmax())
    step, lam, found = worst[first]
    before, begin = 0.0, 0.0
    if first > 0:
        before, begin = float(use[first - 1]), worst[first - 1][1] if worst[first - 1][0] == step else 0.0
    part = (1.0 - before) / (found.utilisation - before)
    return Yielding(worst[most][2], most, found, step, begin + part * (lam - begin))


def _where(found: Extreme) -> str:
    x, y = found.place
    return f"at the {found.side} near ({x:.4g}, {y:.4g}) mm"
