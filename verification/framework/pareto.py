"""Error against cost: who is not beaten, who is cheapest for an error, and how fast errors fall."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple


class Trial(NamedTuple):
    """One model at one density: its cost (any unit) and its relative error, floored at the bar of the truth."""

    model: str
    level: str
    cost: float
    error: float


def front(trials: Sequence[Trial]) -> list[Trial]:
    """Trials that no other beats in both cost and error, from the cheapest on; of equals the first."""
    found: list[Trial] = []
    for trial in sorted(trials, key=lambda t: (t.cost, t.error)):
        if math.isfinite(trial.error) and (not found or trial.error < found[-1].error):
            found.append(trial)
    return found


def cheapest(trials: Sequence[Trial], error: float) -> Trial | None:
    """The cheapest model that keeps an error from some density on; None if there is none.

    A density counts only if every finer one of the same model keeps the error too, so that no curve that happens to
    cross the truth wins. Trials of a model are in the order of refinement.
    """
    kept: list[Trial] = []
    for model in dict.fromkeys(trial.model for trial in trials):
        for trial in reversed([t for t in trials if t.model == model]):
            if not trial.error <= error:
                break
            kept.append(trial)
    return min(kept, key=lambda t: t.cost, default=None)


def rate(sizes: Sequence[float], errors: Sequence[float]) -> float:
    """Order p of errors ~ size^p by least squares in logarithms, over those that are not zero; nan for fewer than 3."""
    pairs = [
        (math.log(h), math.log(e)) for h, e in zip(sizes, errors, strict=True) if math.isfinite(e) and e > 0.0
    ]
    if len(pairs) < 3:
        return math.nan
    x = sum(a for a, _ in pairs) / len(pairs)
    y = sum(b for _, b in pairs) / len(pairs)
    return sum((a - x) * (b - y) for a, b in pairs) / sum((a - x) ** 2 for a, _ in pairs)
