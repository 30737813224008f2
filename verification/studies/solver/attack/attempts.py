"""What an attempt found: a kind of attack, how often, and what did not hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Found:
    """What came of an attempt.

    Attributes:
        tried: how many attacks the attempt was made of.
        failures: one line each of what did not hold; what cannot be tried here says so in `skipped`.
        worst: the largest figure seen (time, memory), in the unit of the kind; nan without one.
        skipped: why nothing could be tried.
        before: signals beside `tried` that came before the first line of the program (`Ended.before`).
    """

    tried: int
    failures: list[str] = field(default_factory=list)
    worst: float = float("nan")
    skipped: str = ""
    before: int = 0

    def plain(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)


@dataclass(frozen=True)
class Kind:
    """A kind of attack.

    Attributes:
        name: in words.
        promise: what has to hold in every one.
        play: an attempt in an empty folder, with random numbers of its own.
        attempts: how many are asked for.
        quick: how many of them in a quick run.
        unit: of `Found.worst`; empty without one.
    """

    name: str
    promise: str
    play: Callable[[Path, np.random.Generator], Found]
    attempts: int
    quick: int
    unit: str = ""
