"""Contact where a path needs it: solved without, and from the last clear state on with panels that stop each other."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Literal

from bh.analysis.contact import first_contact
from bh.errors import ModelError
from bh.formulations.protocols import Stopping
from bh.model.model import Model
from bh.paths.path import Path
from bh.paths.record import StepOutcome
from bh.paths.storage import PathFile, reading

Solve = Callable[[Model, Path], Path]
AUTO: Literal["auto"] = "auto"
WITH: Literal["thickness"] = "thickness"  # what stops panels once they have met


def go_on_as_needed(free: Path, solve: Solve) -> Path:
    """A path without contact if its panels do not meet, else one that goes on with contact from before they do.

    Args:
        free: of a model with contact = "auto", solved without.
        solve: follows a model with contact on from where a path of it has come to.

    Returns:
        `free` itself where nothing meets or nothing can be done about it, else a path of another model. What was done
        is said in its remarks (the reason of the step in which panels meet).
    """
    met = first_contact(free)
    if met is None:
        return free
    stopped = replace(free.model, contact=WITH)
    try:
        kept = last_clear(free, stopped, met.state)
    except ModelError as error:
        _say(free, met.step, f"panels pass through each other ({met}), not prevented: {error}")
        return free
    begun = Path(stopped)
    begun.records = free.records[: kept + 1]
    begun.steps = list(free.steps[: begun.records[-1].step])
    path = solve(stopped, begun)
    last = free.records[kept]
    where = f"lambda {last.lam:.4g} of step {last.step + 1}"
    _say(
        path,
        met.step,
        f"panels met without contact ({met}); solved again from {where} on with contact = '{WITH}'",
    )
    if free.accuracy is not None:
        note = "the estimate is that of the path without contact"
        path.accuracy = replace(free.accuracy, notes=(*free.accuracy.notes, note))
    return path


def _say(path: Path, step: int, about: str) -> None:
    """Add to what is said of how a step ended, or the last one that there is."""
    number = min(step, len(path.steps) - 1)
    end = path.steps[number]
    if about not in end.reason:  # a resumed run has said it before
        reason = f"{end.reason}; {about}" if end.reason else about
        path.steps[number] = StepOutcome(end.outcome, reason, end.iterations)


def last_clear(path: Path, stopped: Model, before: int) -> int:
    """Index of the last state before one, up to which all states have their layers farther apart than contact asks for.

    Args:
        path: solved without contact.
        stopped: the same model with contact.
        before: index of the first state in which the sheet meets itself.

    Raises:
        ModelError: the first state meets itself already, or the model cannot be solved with contact.
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
    if model.contact != AUTO or not file.is_file():
        return model
    with closing(PathFile.open(file)) as stored, reading(file):
        return replace(model, contact=WITH) if stored.meta()["model"].get("contact") == WITH else model
