"""Bodies in the steps of a scene: bars and moulds that press on the sheet (`press`), soft springs that hold it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from bh.errors import SceneError
from bh.model.actuations import Indenter, Tether
from bh.model.mould import Mould
from bh.model.step import Actuation
from bh.scene.reading import (
    PLACE,
    Length,
    Place,
    Positive,
    Spot,
    Table,
    Turn,
    Vector,
    arguments,
    inside,
    read_table,
    shown,
    within,
)

GAP = "the distance in mm at which it begins to press, positive"
FRICTION = "the coefficient of friction between it and the sheet, 0 or more, unless that of the scene holds"
Rubbing = Annotated[float, Field(ge=0.0, le=100.0)]


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
    gap: Length = Field(0.05, description=GAP)
    friction: Rubbing | None = Field(None, description=FRICTION)

    @model_validator(mode="after")
    def has_a_width(self) -> PressTable:
        """Check that the axis has a direction along the ground, from which across and up follow."""
        if not (self.direction[0] or self.direction[1]):
            raise ValueError(
                "has an axis that stands upright or has no direction; give direction = [x, y, z]"
            )
        return self


class MouldTable(Table):
    """A body of triangles from a file, `bh.Mould`."""

    file: Annotated[str, Field(min_length=1, max_length=300)] = Field(
        description="the name of an STL or OBJ file with a closed body, in the folder of the scene"
    )
    unit: Annotated[str, Field(min_length=1, max_length=20)] = Field(
        description='the unit of length in the file, such as "mm", "cm", "m" or "in"; the file does not say it'
    )
    name: Annotated[str, Field(min_length=1, max_length=60)] = Field(
        "mould", description="a name by which its force is told, another one for every body of the step"
    )
    at: Spot = Field(
        [0.0, 0.0, 0.0],
        description="three numbers [x, y, z] in mm, where the origin of the file lies where the step begins",
    )
    axis: Vector = Field(
        [0.0, 0.0, 1.0],
        description="three numbers [x, y, z], the axis through the origin of the file that it is turned about before",
    )
    angle: Turn = Field(0.0, description="the angle in rad by which it is turned about the axis")
    travel: Spot = Field(
        [0.0, 0.0, 0.0], description="three numbers [x, y, z] in mm, how far it moves during the step"
    )
    gap: Length = Field(0.05, description=GAP)
    friction: Rubbing | None = Field(None, description=FRICTION)


class TetherTable(Table):
    """Keys of `bh.Tether`."""

    at: Place = Field(description=PLACE)
    total: Annotated[list[Annotated[float, Field(ge=0.0, le=1e9)]], Field(min_length=3, max_length=3)] = (
        Field(description="three stiffnesses [x, y, z] in N/mm, 0 or more, shared by the nodes of the place")
    )


def _indenter(table: PressTable) -> Indenter:
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
        friction=table.friction,
    )


def _mould(table: MouldTable, folder: Path, at: str) -> Mould:
    given = arguments(table)
    file, by = inside(folder, given.pop("file"), f"{at}.file"), given.pop("travel")
    if not file.is_file():
        raise SceneError(f"{at}.file = {shown(table.file)} is not there; check the name and the folder")
    with within(at):
        return Mould.read(file, by=by, **given)


BODIES: dict[str, type[Table]] = {"press": PressTable, "tether": TetherTable}
OTHERS: dict[str, type[Table]] = {"press": MouldTable}  # what a body may be in place of that
FILE = "file"  # the key that makes a mould of what presses


def body(key: str, item: object, at: str, folder: Path) -> Actuation:
    """The body of a table.

    Args:
        key: one of `BODIES`.
        item: what the scene has there.
        at: its dotted path.
        folder: where files that it names are looked for.

    Raises:
        SceneError: its values cannot be, or do not go together; one line.
    """
    if key == "press" and isinstance(item, dict) and FILE in item:
        return _mould(read_table(MouldTable, item, at), folder, at)
    if key == "tether":
        tether = read_table(TetherTable, item, at)
        with within(at):
            return Tether(**arguments(tether))
    bar = read_table(PressTable, item, at)
    with within(at):
        return _indenter(bar)
