"""The steps of a model as ramps: what every hinge and node is asked for while lambda runs from 0 to 1."""

from __future__ import annotations

from collections.abc import Mapping

from bh.loading.builder import Ramps
from bh.loading.load_step import Ended, StepProgram
from bh.model.model import Model


def program(model: Model, ended: Mapping[int, Ended] | None = None) -> tuple[StepProgram, ...]:
    """The ramps of every step of `model`, in order; nothing is solved. `ended` tells of steps that ended early.

    Raises:
        ModelError, MeshError: an actuation or support that the sheet cannot take; the message names it.
    """
    builder = Ramps(model)
    steps = []
    for number, actuations in enumerate(model.steps):
        steps.append(builder.step(actuations))
        if ended is not None and number in ended:
            builder.stop(steps[-1], ended[number])
    return tuple(steps)
