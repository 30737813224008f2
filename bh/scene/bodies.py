"""Bodies in the steps of a scene: bars that press on the sheet (`press`), and soft springs that hold it (`tether`)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated

from pydantic import Field, model_validator

from bh.model.actuations import Indenter, Tether
from bh.model.step import Actuation
from bh.scene.reading import PLACE, Length, Place, Positive, Spot, Table, Vector, arguments


class PressTable(Table):
    """A bar or a cylinder, `bh.Indenter`."""

    name: Annotated[str, Field(min_length=1, max_length=60)] = Field(
        "bar", description="a name by which its force is told, another one for every bar of the step"
    )
    at: Spot = Field(
        description="three numbers [x, y, z] in mm, the centre of its section where the step begins"
    )
    direction: Vector = Field(description="three numbers [x, y, z], the direction of its axis, not upright")
    radius: Length = Field(description="the radius of its edges in mm, that of a cylinder; positive")
    width: Length | None = Field(
        None,
        description="the whole width of its section in mm, at least twice the radius, and that unless given",
    )
    height: Length | None = Field(
        None,
        description="the whole height of its section in mm, at least twice the radius, and that unless given",
    )
    travel: Spot = Field(
        [0.0, 0.0, 0.0], description="three numbers [x, y, z] in mm, how far it moves during the step"
    )
    stiffness: Positive = Field(
        50.0,
        description="the stiffness of its surface in N/mm for every mm of the edges of the mesh, positive",
    )
    gap: Length = Field(0.05, description="the distance in mm at which it begins to press, positive")

    @model_validator(mode="after")
    def has_a_width(self) -> PressTable:
        """Check that the axis has a direction along the ground, from which across and up follow."""
        if not (self.direction[0] or self.direction[1]):
            raise ValueError(
                "has an axis that stands upright or has no direction; give direction = [x, y, z]"
            )
        return self


class TetherTable(Table):
    """Keys of `bh.Tether`."""

    at: Place = Field(description=PLACE)
    total: Annotated[list[Annotated[float, Field(ge=0.0, le=1e9)]], Field(min_length=3, max_length=3)] = (
        Field(description="three stiffnesses [x, y, z] in N/mm, 0 or more, shared by the nodes of the place")
    )


def _indenter(table: Table) -> Indenter:
    assert isinstance(table, PressTable)
    x, y, z = table.direction
    along = math.hypot(x, y)
    return Indenter(
        table.name,
        (table.at[0], table.at[1], table.at[2]),
        math.atan2(y, x),
        2.0 * table.radius if table.width is None else table.width,
        2.0 * table.radius if table.height is None else table.height,
        table.radius,
        by=(table.travel[0], table.travel[1], table.travel[2]),
        tilt=math.atan2(z, along),
        stiffness=table.stiffness,
        gap=table.gap,
    )


def _tether(table: Table) -> Tether:
    return Tether(**arguments(table))


BODIES: dict[str, type[Table]] = {"press": PressTable, "tether": TetherTable}
_MAKERS: dict[str, Callable[[Table], Actuation]] = {"press": _indenter, "tether": _tether}


def body(key: str, table: Table) -> Actuation:
    """The body of a table.

    Args:
        key: one of `BODIES`.
        table: that has been read.

    Raises:
        ModelError: its values do not go together; one line.
    """
    return _MAKERS[key](table)
