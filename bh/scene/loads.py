"""Loads that are spread, and springs to the ground, in scenes: the keys of `bh.model.loads` and `bh.model.springs`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from bh.model.model import Model
from bh.model.springs import GroundSpring
from bh.model.supports import select
from bh.scene.reading import (
    PLACE,
    VECTOR,
    Couple,
    PerArea,
    PerLength,
    Place,
    Pressing,
    Table,
    arguments,
    as_tables,
    read_table,
    within,
)

Triangles = Annotated[list[Annotated[int, Field(ge=0, le=2**62)]], Field(min_length=1)]
Springy = Annotated[list[Annotated[float, Field(ge=0.0, le=1e12)]], Field(min_length=3, max_length=3)]
SET = 'the name of edges, such as "edge:end" or "crease:NAME"'
CHOSEN = "a list of numbers of triangles, all of them unless given; it belongs to one mesh"
STIFF = "three stiffnesses [x, y, z]"


class PressureTable(Table):
    """Keys of `bh.Pressure`."""

    p: Pressing = Field(
        description="a pressure in N/mm^2 (MPa) on the lower side; negative pushes from above"
    )
    triangles: Triangles | None = Field(None, description=CHOSEN)


class LineForceTable(Table):
    """Keys of `bh.LineForce`."""

    at: str = Field(description=SET)
    per_length: PerLength = Field(description=VECTOR + " in N/mm of the flat edge")


class AreaForceTable(Table):
    """Keys of `bh.AreaForce`."""

    per_area: PerArea = Field(description=VECTOR + " in N/mm^2 of the flat sheet")
    triangles: Triangles | None = Field(None, description=CHOSEN)


class EdgeMomentTable(Table):
    """Keys of `bh.EdgeMoment`."""

    at: str = Field(description='the name of edges of the boundary, such as "edge:end"')
    to: Couple = Field(
        description="a couple a length in N mm / mm; positive turns the outside towards the upper side"
    )


class SpringTable(Table):
    """Keys of `bh.GroundSpring`."""

    at: Place = Field(description=PLACE)
    each: Springy | None = Field(None, description=STIFF + " in N/mm of every node of the place, 0 or more")
    total: Springy | None = Field(None, description=STIFF + " in N/mm, shared by the nodes of the place")
    per_area: Springy | None = Field(
        None, description=STIFF + " in N/mm^3 for the area of sheet that belongs to the nodes: a foundation"
    )


LOADS: dict[str, type[Table]] = {
    "pressure": PressureTable,
    "line_force": LineForceTable,
    "area_force": AreaForceTable,
    "edge_moment": EdgeMomentTable,
}


def springs_of(data: object) -> tuple[GroundSpring, ...]:
    """The springs of `[[springs]]`.

    Args:
        data: what the scene has there.

    Returns:
        one a table, in order.

    Raises:
        SceneError: a table that is none, or whose values cannot be; one line.
    """
    found = []
    for i, item in enumerate(as_tables(data, "springs")):
        table = read_table(SpringTable, item, f"springs[{i}]")
        with within(f"springs[{i}]"):
            found.append(GroundSpring(**arguments(table)))
    return tuple(found)


def check_springs(model: Model) -> None:
    """Are the places of the springs there?

    Args:
        model: has the springs and the mesh.

    Raises:
        SceneError: one line that names the place.
    """
    for i, spring in enumerate(model.springs):
        with within(f"springs[{i}].at"):
            select(model.mesh, spring.at)
