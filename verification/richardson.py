"""Limits of sequences of meshes: observed rate, Richardson's value and an error bar."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Limit:
    """Where the values of a sequence of meshes go.

    Attributes:
        value: Richardson's extrapolation where the last three values converge at an observed rate of at least
            `SLOWEST`, else the last value.
        rate: observed order in the mesh size, nan where the values do not settle from one side.
        bar: what is left unknown: the distance from the last value to the extrapolated one; where there is no rate
        the last
            change, or a tenth of the one before if that is larger.
    """

    value: float
    rate: float
    bar: float


SLOWEST = 0.8  # rates below are no convergence to speak of


def limit(values: Sequence[float], ratio: float = 2.0) -> Limit:
    """Limit of the last three values on meshes that are `ratio` times finer each (Richardson 1911; Roache 1994)."""
    if len(values) < 3:
        change = abs(values[-1] - values[-2]) if len(values) == 2 else math.inf
        return Limit(values[-1], math.nan, change)
    first, second = values[-2] - values[-3], values[-1] - values[-2]
    if first * second > 0.0 and abs(second) < abs(first) * ratio**-SLOWEST:
        rate = math.log(first / second) / math.log(ratio)
        rest = second / (ratio**rate - 1.0)
        return Limit(values[-1] + rest, rate, abs(rest))
    return Limit(values[-1], math.nan, max(0.1 * abs(first), abs(second)))
