"""The key `move` of a step: a place that goes along a path, each leg of which is a step of the model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from bh.errors import SceneError
from bh.model.moving import legs
from bh.model.step import Step
from bh.model.supports import Constraint
from bh.scene.reading import PLACE, Place, Spot, Table, read_table, within

BESIDE = ("hold", "release", "support")  # what a step may have beside a move


class MoveTable(Table):
    """Keys of `bh.model.moving.legs`."""

    at: Place = Field(description=PLACE)
    along: Annotated[list[Spot], Field(min_length=1, max_length=1000)] = Field(
        description="a list of corners [x, y, z] in mm, from where each node is when the step begins"
    )


def moved(
    step: dict[str, object],
    at: str,
    support: tuple[Constraint, ...],
    release: tuple[str | Sequence[int], ...],
) -> tuple[Step, ...]:
    """The steps of a table with the key `move`.

    Args:
        step: the table.
        at: where it is in the scene.
        support: that comes in with it.
        release: places that it lets go of.

    Returns:
        a step a leg, in their order.

    Raises:
        SceneError: another actuation beside it, or a path that cannot be.
    """
    others = [key for key in step if key not in ("move", *BESIDE)]
    if others:
        raise SceneError(
            f"{at}.move is a step for every leg of its path; give '{others[0]}' a step of its own beside it"
        )
    table = read_table(MoveTable, step["move"], f"{at}.move")
    with within(f"{at}.move"):
        return legs(table.at, table.along, support, release)
