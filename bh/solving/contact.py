"""Contact where a path needs it: solved without, and from the last clear state on with panels that stop each other."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Literal

from bh.analysis.contact import first_contact
from bh.formulations.protocols import Stopping
from bh.model.model import Model
from bh.model.serialise import fingerprint
from bh.paths.path import Path
from bh.paths.record import StepOutcome
from bh.paths.storage import PathFile, reading

Solve = Callable[[Model, Path | None], Path]
WITH: Literal["thickness"] = "thickness"  # what stops panels once they have met


def solve_as_needed(model: Model, solve: Solve) -> Path:
    """A path without contact where its panels do not meet, else one that goes on with contact from before they do.

    Args:
        model: with contact = "auto".
        solve: follows a model through its steps, from the start or from where a path of it has come to.

    Returns:
        the path; that it goes on with contact is said in its remarks (the reason of the step in which panels meet).
    """
    free = solve(replace(model, contact=False), None)
    met = first_contact(free)
    if met is None:
        return free
    stopped = replace(model, contact=WITH)
    kept = last_clear(free, stopped, met.state)
    begun = Path(stopped)
    begun.records = free.records[: kept + 1]
    begun.steps = list(free.steps[: begun.records[-1].step])
    path = solve(stopped, begun)
    last = free.records[kept]
    where = f"lambda {last.lam:.4g} of step {last.step + 1}"
    about = f"panels met without contact ({met}); solved again from {where} on with contact = '{WITH}'"
    number = min(met.step, len(path.steps) - 1)
    end = path.steps[number]
    path.steps[number] = StepOutcome(
        end.outcome, f"{end.reason}; {about}" if end.reason else about, end.iterations
    )
    return path


def last_clear(path: Path, stopped: Model, before: int) -> int:
    """Index of the last state before one, up to which all states have their layers farther apart than contact asks for.

    Args:
        path: solved without contact.
        stopped: the same model with contact.
        before: index of the first state in which the sheet meets itself.

    Raises:
        ModelError: the first state meets itself already.
    """
    system = Path(stopped).system(0)  # which refuses a first state that meets itself
    assert isinstance(system, Stopping)
    for index in range(1, before):
        if system.meetings(path[index].points):
            return index - 1
    return max(before - 1, 0)


def stored_model(file: FilePath, model: Model) -> Model:
    """The model that a path file was written for: with contact, if panels had met by then, or without.

    Args:
        file: place of the path file.
        model: with contact = "auto".
    """
    with_contact = replace(model, contact=WITH)
    with closing(PathFile.open(file)) as stored, reading(file):
        return with_contact if stored.meta()["provenance"]["input"] == fingerprint(with_contact) else model
