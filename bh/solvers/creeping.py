"""When steps lead nowhere: a way downhill that only creeps along a mode that hardly resists, and one that runs away."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bh.solvers.system import Evaluation

CREEPS = "creeps"  # why the globalised way of Newton's method gave up
STEPS, LEAST = 8, 1e-6  # steps, and the part of the energy that all of them together gain where they creep


def creeping(merits: Sequence[float]) -> bool:
    """Have the last steps together gained next to nothing?

    Args:
        merits: of the states so far, N mm.
    """
    return len(merits) > STEPS and merits[-1 - STEPS] - merits[-1] < LEAST * abs(merits[-1])


def slow(sizes: Sequence[float]) -> bool:
    """Do the sizes of Newton's steps, from the fifth on, not even halve in two iterations?

    The first ones say nothing: the second is often the largest, when the stretching that large rotations have left in
    the linear prediction is taken out.
    """
    return len(sizes) > 4 and sizes[-1] > 0.5 * sizes[-3]


def diverged(now: Evaluation, least: float) -> bool:
    """Whether a step has run away.

    Args:
        now: where it ends.
        least: smallest imbalance before it.
    """
    return not np.isfinite(now.energy) or 1e-8 * now.imbalance > max(least, 1.0)
