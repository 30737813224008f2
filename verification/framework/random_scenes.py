"""Cases that play many random scenes, one after another: which part of them, how long each, and what is kept."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import Any

from bh.errors import InputError
from verification.framework.checks import Context
from verification.framework.store import Store


class OutOfTimeError(Exception):
    """A scene has had its share."""


class _Interrupt(BaseException):
    """Raised by the signal: no handler of errors on the way takes it for one of its own."""


@contextmanager
def processor_limit(seconds: float) -> Iterator[None]:
    """Give what is within up after so many seconds of processor time, wherever it is then.

    Args:
        seconds: of processor time.

    Raises:
        OutOfTimeError: they are over.
    """

    def stop(_signal: int, _frame: object) -> None:
        raise _Interrupt

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    except _Interrupt:
        raise OutOfTimeError from None
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


class Clock:
    """A meter that ends a run whose processor time is over."""

    def __init__(self, seconds: float) -> None:
        """Begins now, with `seconds` of processor time."""
        self.end = time.process_time() + seconds

    def update(self, step: int, steps: int, lam: float, iterations: int, energy: float) -> None:
        """Look at the clock."""
        del step, steps, lam, iterations, energy
        if time.process_time() > self.end:
            raise OutOfTimeError

    def close(self, outcome: str) -> None:
        """Nothing to close."""


def part_of(variable: str, most: int, scenes: int) -> range:
    """Which scenes are played: those that a variable of the environment names, such as 100:200, or the first `most`.

    Args:
        variable: of the environment.
        most: without it.
        scenes: all.

    Raises:
        InputError: the variable names no such part.
    """
    word = os.environ.get(variable, "").strip()
    if not word:
        return range(most)
    first, _, last = word.partition(":")
    if not (first.isdecimal() and last.isdecimal() and int(first) < int(last) <= scenes):
        raise InputError(
            f"{variable} = {word[:40]!r} cannot be; give two numbers such as 100:200, up to {scenes}"
        )
    return range(int(first), int(last))


def played(
    context: Context, case: str, runs: str, numbers: range, scenes: int, play: Callable[[int], Any]
) -> list[dict[str, Any]]:
    """Play the scenes that are not stored, keep each as it ends, and give all that are stored, by number.

    Args:
        context: of the run.
        case: its name, for the progress.
        runs: file of the store.
        numbers: scenes to play.
        scenes: all.
        play: gives a dataclass for the number of a scene.
    """
    store = Store.open(context.folder, runs, context.quick)
    for number in numbers:
        if str(number) not in store.runs:
            context.tell(f"{case}: scene {number}")
            store.keep(str(number), asdict(play(number)))
    return [store.runs[str(n)] for n in range(scenes) if str(n) in store.runs]
