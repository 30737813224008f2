"""Places that are moved along a path of straight legs, a step each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bh.errors import ModelError
from bh.model.actuations import Displace
from bh.model.step import Step
from bh.model.supports import Constraint

LEGS = 1000  # of one move, at most


def legs(
    at: str | Sequence[int],
    along: Sequence[Sequence[float]],
    support: tuple[Constraint, ...] = (),
    release: tuple[str | Sequence[int] | Constraint, ...] = (),
) -> tuple[Step, ...]:
    """The steps that move all nodes of a place alike from corner to corner of a path, in all three directions.

    Args:
        at: name of a place, or node indices.
        along: (k, 3) corners, mm from where each node is when the first leg begins.
        support: comes in with the first leg, as for `Step`.
        release: is let go of then.

    Returns:
        a step a leg; the nodes stay where the last one ends until they are released.

    Raises:
        ModelError: no corners or too many, one that is no three finite numbers, or two that are the same.
    """
    what = f"move of '{at}'"
    if not 1 <= len(along) <= LEGS:
        raise ModelError(f"{what} along {len(along)} corners cannot be; give 1 to {LEGS} of [x, y, z] in mm")
    found: list[Step] = []
    before: tuple[float, ...] = (0.0, 0.0, 0.0)
    for number, corner in enumerate(along):
        here = _point(corner)
        if here is None:
            raise ModelError(
                f"{what}: along[{number}] = {corner!r} is no point [x, y, z] in mm; give a list of such corners"
            )
        if here == before:
            raise ModelError(f"{what}: along[{number}] is where the move is already; leave it out")
        asked = [Displace(at, axis, further=b - a) for axis, a, b in zip("xyz", before, here, strict=True)]
        found.append(Step(tuple(asked), None, *((support, release) if number == 0 else ((), ()))))
        before = here
    return tuple(found)


def _point(corner: object) -> tuple[float, ...] | None:
    """The three finite numbers of a corner, or None where it has others or is none at all."""
    try:
        found = np.asarray(corner, dtype=float)
    except (TypeError, ValueError):
        return None
    return tuple(found.tolist()) if found.shape == (3,) and np.isfinite(found).all() else None
