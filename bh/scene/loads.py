"""Loads that are spread, and springs to the ground, in scenes: the keys of `bh.model.loads` and `bh.model.springs`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

from pydantic import BeforeValidator, Field, model_validator

from bh.errors import SceneError
from bh.model.imperfection import RandomField, imperfect_mesh
from bh.model.model import Model
from bh.model.springs import GroundSpring
from bh.model.supports import select
from bh.scene.reading import (
    PLACE,
    VECTOR,
    Couple,
    Length,
    PerArea,
    PerLength,
    Place,
    Pressing,
    Table,
    Turning,
    arguments,
    as_tables,
    read_table,
    within,
)
from meshes import SheetMesh

Triangles = Annotated[list[Annotated[int, Field(ge=0, le=2**62)]], Field(min_length=1)]
Springy = Annotated[list[Annotated[float, Field(ge=0.0, le=1e12)]], Field(min_length=3, max_length=3)]
Seed = Annotated[
    int,
    Field(ge=0, le=2**31 - 1),
    BeforeValidator(lambda v: int(v) if isinstance(v, float) and v == int(v) else v),
]  # sweeps count in numbers with a point
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


class CoupleTable(Table):
    """Keys of `bh.Couple`."""

    at: Place = Field(description=PLACE)
    total: Turning = Field(
        description=VECTOR + " in N mm, a moment about the directions of the axes, right-handed"
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
    "couple": CoupleTable,
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


class ImperfectionTable(Table):
    """What makes the stress-free sheet not flat: a field of heights, or a random one."""

    z: str | None = Field(
        None, description='a field of heights in mm of x and y in mm, such as "0.1 * sin(pi * x / 100)"'
    )
    amplitude: Length | None = Field(
        None, description="the standard deviation of a random field of heights in mm, positive"
    )
    wavelength: Length | None = Field(None, description="the length of its waves in mm, positive")
    seed: Seed = Field(
        0, description="a whole number from 0; the same seed gives the same field on every mesh"
    )

    @model_validator(mode="after")
    def one_field(self) -> ImperfectionTable:
        """Check that it is given in one of the two ways."""
        random = self.amplitude is not None
        if (self.z is not None) == random or random != (self.wavelength is not None):
            raise ValueError("needs either z, or amplitude and wavelength")
        return self


def not_flat(data: Mapping[str, object], mesh: SheetMesh) -> SheetMesh:
    """The mesh of a scene with its imperfection, if it has one.

    Args:
        data: the tables of the scene.
        mesh: of its flat sheet.

    Raises:
        SceneError: the table cannot be, or the scene chooses its mesh by an accuracy; one line.
    """
    if "imperfection" not in data:
        return mesh
    table = read_table(ImperfectionTable, data["imperfection"], "imperfection")
    if "accuracy" in data or "mesh" not in data:
        raise SceneError(
            "imperfection: an accuracy chooses among meshes of flat sheets; give a [mesh], and no accuracy"
        )
    with within("imperfection"):
        if table.z is not None:
            return imperfect_mesh(mesh, table.z)
        assert table.amplitude is not None
        assert table.wavelength is not None
        return imperfect_mesh(mesh, RandomField(table.amplitude, table.wavelength, table.seed))
