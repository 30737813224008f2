"""Warm starts: the state of a point from that of its neighbour along one axis, where that is checked to be the same.

A line of points along the axis is one task, always solved in the same order, so that results do not depend on
workers. Its first point is solved cold. A further one begins at the state of the one before, at the end of its last
step, if the models differ in that step's targets alone. The second and the last point of a line are solved cold as
well: where a state differs, or warm takes as many iterations, the whole line is solved cold.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from bh.model.model import Model
from bh.model.serialise import fingerprint
from bh.paths.path import Path
from bh.paths.record import StepOutcome
from bh.solvers.outcome import Outcome
from bh.solving.neighbour import end_beside
from bh.solving.trace import trace

SAME = 1e-6  # of the sheet's size: states this near each other are one


def line(models: Sequence[Model]) -> list[Path]:
    """Paths of models in order, each begun at the one before where that is worth it and gives the same states.

    Args:
        models: along one axis of a grid.

    Returns:
        The solved paths, in order.
    """
    cold = {0: trace(models[0], warn=False)}
    paths = list(_warm(models, cold[0]))
    checked = [i for i in (1, len(models) - 1) if i < len(paths) and len(paths) == len(models)]
    for i in checked:
        cold[i] = trace(models[i], warn=False)
        if not same(paths[i], cold[i]) or paths[i].iterations >= cold[i].iterations:
            checked = []
            break
    if not checked and len(models) > 1:
        return [cold[i] if i in cold else trace(model, warn=False) for i, model in enumerate(models)]
    return paths


def same(one: Path, other: Path) -> bool:
    """Whether two paths end in one state: all nodes within `SAME` of the sheet's size.

    Args:
        one: a path of the model.
        other: another one.
    """
    if not one.reached or not other.reached:
        return False
    apart = np.abs(one[-1].points - other[-1].points).max()
    return bool(apart <= SAME * one.model.mesh.size)


def _warm(models: Sequence[Model], first: Path) -> Iterator[Path]:
    """Paths as far as warm starts go; the first one is given."""
    yield first
    before = first
    for model in models[1:]:
        found = step_over(before, model)
        if found is None:
            return
        yield found
        before = found


def step_over(before: Path, model: Model) -> Path | None:
    """The path of a model from the last state of a neighbour's, or None where that cannot be or does not converge.

    The earlier steps are the neighbour's own; of the last step there is its end alone.

    Args:
        before: the neighbour's solved path.
        model: that differs from the neighbour's in its last step alone.
    """
    last = len(model.steps) - 1
    if not before.reached or not _alike(before.model, model):
        return None
    if model.remembers:
        return None  # it depends on the way
    path = Path(model)
    path.records = [record for record in before.records if record.step < last]
    path.steps = list(before.steps[:last])
    record = end_beside(path, last, before, len(before.records) - 1, "from a neighbouring point")
    if record is None or not record.stable:
        return None
    path.records.append(record)
    path.steps.append(StepOutcome(Outcome.REACHED))
    return path


def _alike(one: Model, other: Model) -> bool:
    """Do two models differ in their last step alone?"""
    shorter = (replace(model, steps=model.steps[:-1]) for model in (one, other))
    return len(one.steps) == len(other.steps) and len({fingerprint(model) for model in shorter}) == 1
