"""Formulations, found through the entry-point group "bh.formulations", so that none is known by name here."""

from __future__ import annotations

from functools import cache
from importlib.metadata import entry_points
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.state import State
from bh.loading.load_step import StepProgram
from bh.model.model import Model
from bh.model.plugins import named

GROUP = "bh.formulations"


class Formulation(Protocol):
    """Turns a description into a `bh.solvers.System` for one step, and reads states from its unknowns.

    The system also has `start()`, the unknowns of the state that the step begins with,
    `positions(q, lam)`, the (n, 3) node positions, `vectors(dq)`, the (n, 3) changes of these for changes of the
    unknowns, and its transpose `loads(forces)`.
    """

    name: str

    def system(self, model: Model, program: StepProgram, start: State | None) -> Any: ...

    def observe(
        self,
        model: Model,
        system: Any,
        q: NDArray[np.float64],
        lam: float,
        step: int = 0,
        stable: bool | None = None,
    ) -> State: ...


def names() -> list[str]:
    """Names of all registered formulations."""
    return sorted(point.name for point in entry_points(group=GROUP))


@cache
def formulation(name: str) -> Formulation:
    """The formulation of that name, or of the user's own "module:Class".

    Raises:
        ModelError: it is not registered; the message lists those that are.
    """
    for point in entry_points(group=GROUP):
        if point.name == name:
            made: Formulation = point.load()()
            return made
    if ":" in name:
        own: Formulation = named(name)()
        return own
    known = ", ".join(names()) or "none; install the project with pip first"
    raise ModelError(f"formulation '{name}' is not known; use one of: {known}")


def takes_nu(name: str) -> bool:
    """Whether a formulation uses Poisson's ratio of the sheet; it can say so itself by an attribute of this name.

    The formulation that a model has by default does not (3.3.2 of the source).
    """
    return bool(getattr(formulation(name), "takes_nu", name != Model.formulation))
