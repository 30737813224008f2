"""What a worker does: one task, called with the parameters of a point. Everything here crosses process borders."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from bh.errors import InputError
from bh.solvers.outcome import Outcome
from bh.sweep.points import SweepError, Value

Task = Callable[[Mapping[str, Value]], "Measured | Mapping[str, object]"]


@dataclass(frozen=True)
class Measured:
    """What a task found at a point.

    Attributes:
        values: by name, a number, a word or an array of numbers.
        outcome: "reached", or why there are no values.
        reason: one line, where the outcome is another.
    """

    values: Mapping[str, object] = field(default_factory=dict)
    outcome: str = Outcome.REACHED
    reason: str = ""


class Finished(NamedTuple):
    """A point as it is stored; `values` hold plain numbers, words and lists of numbers.

    Attributes:
        number: in the order of the data set, from 0.
        outcome: "reached", or why there are no values.
        reason: one line, where the outcome is another.
        wall_time_s: that the point took, s.
        attempts: how often it was begun.
        worker: host and process.
    """

    number: int
    outcome: str
    reason: str
    values: dict[str, object]
    wall_time_s: float
    attempts: int = 1
    worker: str = ""


def work(task: Task, points: Sequence[tuple[int, Mapping[str, Value]]]) -> list[Finished]:
    """Run a task at some points, one after another; an exception is an outcome of its point.

    A task that has `line` is first asked for all of them at once; it returns None where they have to be done alone.

    Args:
        task: called with the parameters of a point.
        points: index and parameters of each.

    Returns:
        The points in the same order.
    """
    worker = f"{platform.node()}:{os.getpid()}"
    line = getattr(task, "line", None)
    if line is not None and len(points) > 1:
        began = time.perf_counter()
        measured = line([parameters for _, parameters in points])
        if measured is not None:
            each = (time.perf_counter() - began) / len(points)
            return [
                Finished(
                    index,
                    Outcome.REACHED,
                    "",
                    {n: _plain(n, v) for n, v in m.values.items()},
                    each,
                    worker=worker,
                )
                for (index, _), m in zip(points, measured, strict=True)
            ]
    found = []
    for index, parameters in points:
        began = time.perf_counter()
        try:
            measured = task(parameters)
            if not isinstance(measured, Measured):
                measured = Measured(measured)
            outcome, reason = measured.outcome, measured.reason
            values = {name: _plain(name, value) for name, value in measured.values.items()}
        except InputError as error:
            outcome, reason, values = Outcome.REFUSED, str(error), {}
        except Exception as error:  # one bad point must not stop the others
            outcome, reason, values = Outcome.FAILED, f"{type(error).__name__}: {error}", {}
        line = " ".join(reason.split())
        found.append(Finished(index, outcome, line, values, time.perf_counter() - began, worker=worker))
    return found


def identity(task: Task) -> str:
    """What a task is, in words: its own `identity` if it has one, else its qualified name."""
    own = getattr(task, "identity", None)
    if isinstance(own, str):
        return own
    name = getattr(task, "__qualname__", type(task).__qualname__)
    return f"{getattr(task, '__module__', type(task).__module__)}.{name}"


def _plain(name: str, value: object) -> object:
    """The value as JSON can hold it; Python writes floats so that they are read back to the last bit."""
    if isinstance(value, str | bool | int | float):
        return value
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "biuf":
            raise TypeError
    except (TypeError, ValueError) as error:
        raise SweepError(f"measured '{name}' is a {type(value).__name__}; give numbers or words") from error
    plain: object = array.tolist()
    return plain
