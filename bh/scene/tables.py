"""What a scene file may hold: one class a table, one field a key, its description what is allowed there.

Descriptions are what a user reads behind "give ..." in an error, so they state unit and range. Values that
only fit or fail together with others (a place, a width too large for its radius) are checked where they are
used.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from bh.model.pinch import Profile
from bh.model.refinement import LEAST, MOST, MOST_TRIANGLES
from bh.scene.loads import LOADS
from bh.scene.reading import (
    DENSITY,
    LSTAR,
    PLACE,
    REGION,
    VECTOR,
    Amounts,
    Closing,
    Count,
    Couple,
    Curvature,
    Dihedral,
    Distance,
    FoldAngle,
    Length,
    Modulus,
    Number,
    PinchAngle,
    Place,
    Positive,
    Push,
    Region,
    Rest,
    Scale,
    Seconds,
    Stiff,
    Stiffness,
    Table,
    Turn,
    Vector,
)
from meshes.cells import Kind


class SheetTable(Table):
    """Material and thickness of the sheet; with a grain E1 and nu12 are other names of E and nu."""

    E: Modulus | None = Field(
        None, description="Young's modulus in MPa, a positive number up to 1e9 MPa (1 GPa is 1000 MPa)"
    )
    nu: Annotated[float, Field(gt=-1.0, le=0.5)] | None = Field(
        None, description="Poisson's ratio in (-1, 0.5]"
    )
    t: Length | None = Field(None, description="the thickness in mm, a positive number")
    E1: Modulus | None = Field(None, description="Young's modulus along the grain in MPa, a positive number")
    E2: Modulus | None = Field(None, description="Young's modulus across the grain in MPa, a positive number")
    G12: Modulus | None = Field(
        None, description="the shear modulus of a sheet with a grain in MPa, a positive number"
    )
    nu12: Annotated[float, Field(gt=-100.0, lt=100.0)] | None = Field(
        None, description="Poisson's ratio of a pull along the grain, nu12^2 < E1 / E2"
    )
    grain: Turn | None = Field(
        None,
        description="the direction of the grain in the drawing in rad from its x axis, from -2 pi to 2 pi",
    )

    density: Positive | None = Field(
        None, description="the density in kg/m^3 of a sheet with a weight, positive"
    )
    strength: Modulus | None = Field(
        None, description="the stress in MPa at which the sheet yields, along the grain where there is one"
    )
    strength2: Modulus | None = Field(None, description="the stress of yield across the grain in MPa")
    shear_strength: Modulus | None = Field(
        None,
        description="the stress of yield in shear in MPa, with a grain; sqrt(strength strength2 / 3) unless given",
    )
    plies: list[dict[str, object]] | None = Field(
        None,
        description="the plies of a laminate from the bottom to the top, tables with the keys of a sheet; alone",
    )
    expansion: Number | Amounts | None = Field(
        None,
        description="a strain a kelvin or a percent of moisture, or [along, across] the grain",
    )
    material: str | None = Field(
        None,
        description='a name of the table of materials (docs/materials.md), such as "card-300", in place of moduli',
    )

    @model_validator(mode="after")
    def one_name(self) -> SheetTable:
        """Check names; a kind of table of its own may ask for less."""
        self.names()
        return self

    def names(self) -> None:
        """Check that the modulus is there, and that nothing is given by two names."""
        if self.plies is not None:
            given = [name for name in SheetTable.model_fields if getattr(self, name) is not None]
            if given != ["plies"]:
                raise ValueError(f"has plies and {given[0]}, which each ply has; remove one of them")
            return
        self.one_name_each()

    def one_name_each(self) -> None:
        """The same of a sheet that is no laminate."""
        if self.material is not None:
            for name in ("E", "E1", "E2", "G12", "nu", "nu12", "strength", "strength2", "shear_strength"):
                if getattr(self, name) is not None:
                    raise ValueError(f"has material and {name}, which the material gives; remove one of them")
            return
        for name, other in (("E", "E1"), ("nu", "nu12")):
            if getattr(self, name) is not None and getattr(self, other) is not None:
                raise ValueError(f"has both {name} and {other}, which are one value; remove one of them")
        if self.E is None and self.E1 is None:
            raise ValueError(
                "needs E, Young's modulus in MPa; or E1, E2, G12, nu12 and grain of a sheet with a grain"
            )
        if self.E2 is None and self.G12 is None and self.grain is None:
            for name in ("E1", "nu12"):
                if getattr(self, name) is not None:
                    raise ValueError(
                        f"has {name} but no grain; give E2, G12 and grain too, or E and nu alone"
                    )


class GmshTable(Table):
    """An unstructured mesh that conforms to the creases."""

    kind: Literal["gmsh"] = Field(description='"gmsh"')
    size: Scale = Field(description="the length of an edge in mm, positive")
    near: dict[str, Scale] = Field(
        {},
        description='shorter edges at some creases or sides in mm, such as { "crease:crease" = 1.0 }',
    )
    growth: Annotated[float, Field(gt=0.0, le=10.0)] = Field(
        0.3, description="how fast edges grow away from these, mm a mm, above 0 up to 10"
    )
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = Field(1, description="a whole number from 0")


class DrawnTable(Table):
    """The faces of a drawing, cut into triangles."""

    kind: Literal["drawn"] = Field(description='"drawn"')


class MeshTable(Table):
    """A mesh along rulings."""

    kind: Kind = Field("staggered", description='"staggered", "alternating", "one-way" or "mirrored"')
    along: Count | None = Field(None, description="a whole number of cells along the crease, from 1")
    aspect_ratio: Annotated[float, Field(gt=0.0, le=1e4)] | None = Field(None, description=DENSITY)
    rows: Annotated[int, Field(ge=1, le=10_000)] = Field(
        1, description="a whole number of rows of cells each side of a crease, from 1"
    )

    @model_validator(mode="after")
    def one_density(self) -> MeshTable:
        """Check that the density is given in one of the two ways."""
        if (self.along is None) == (self.aspect_ratio is None):
            given = "both" if self.along is not None else "neither"
            raise ValueError(f"needs either along (cells along the crease) or aspect_ratio, but has {given}")
        return self


class ModelTable(Table):
    """How the sheet is modelled."""

    formulation: str = Field("consistent", description="a name that `bh formulations` lists")
    hinge_lock: bool = Field(True, description="true or false")
    strategy: Literal["automatic", "settling"] = Field("automatic", description='"automatic" or "settling"')
    neighbours: bool | None = Field(
        None,
        description="true: look beside the end of every step for another stable state; false: at none. Left out: where "
        "there is reason to",
    )


class OutputsTable(Table):
    """What a run writes beside the result."""

    pictures: bool = Field(False, description="true or false")
    vtu: bool = Field(False, description="true or false")
    fold: bool = Field(False, description="true or false")
    folded: list[Literal["glb", "obj", "off", "ply", "stl", "vtk", "msh", "inp"]] = Field(
        [],
        description='formats of the folded sheet: "glb" (glTF), "obj", "off", "ply", "stl", "vtk", "msh", "inp"',
    )
    flat: list[Literal["svg", "dxf", "fold"]] = Field(
        [], description='formats of the flat pattern: "svg", "dxf" (mm, a layer a kind of line), "fold"'
    )


class AccuracyTable(Table):
    """Keys of `bh.Goal`; a number alone is `within`."""

    within: Annotated[float, Field(ge=LEAST, le=MOST)] = Field(
        description=f"a relative error from {LEAST:g} to {MOST:g} (0.02 is 2 %)"
    )
    of: Literal["energy", "tip", "stiffness"] = Field("energy", description='"energy", "tip" or "stiffness"')
    at: str | None = Field(None, description='the place of a tip or a stiffness, such as "corner:outer-end"')
    direction: Vector | None = Field(None, description=VECTOR + ", of the force on a stiffness")
    most_triangles: Annotated[int, Field(ge=1, le=4_000_000)] = Field(
        MOST_TRIANGLES, description="a whole number of triangles; no finer mesh is solved"
    )
    seconds: Seconds | None = Field(
        None,
        description="a time in s; no mesh is begun that is likely to take longer than is left of it. Counted by work "
        "(unknowns times iterations, 5.5e-6 s each), not by the clock",
    )


class SupportTable(Table):
    """Nodes that are held."""

    at: Place = Field(description=PLACE + ', or "rigid-body"')
    fix: str | Vector | Annotated[list[Vector], Field(min_length=1)] | None = Field(
        None, description='letters out of "xyz", a direction [x, y, z], or a list of directions'
    )
    clamp: bool = Field(False, description="true or false: also hold the slope across the edges of the place")

    @model_validator(mode="after")
    def rigid_body_fixes_nothing(self) -> SupportTable:
        """Check that "rigid-body" stands alone."""
        if self.at == "rigid-body" and (self.fix is not None or self.clamp):
            raise ValueError(
                'at = "rigid-body" takes out the motions that are left and needs neither; remove fix and clamp'
            )
        return self


class CreaseTable(Table):
    """The law of a crease: its stiffness, and the angle where it is at rest."""

    Lstar: Scale | None = Field(None, description=LSTAR)
    stiffness: Stiffness | None = Field(None, description="a stiffness a length, N mm / (mm rad), 0 or more")
    rest: Rest = Field(math.pi, description="a rest dihedral angle in rad from 0 to 2 pi (flat is pi)")
    law: dict[str, object] | None = Field(
        None,
        description='a table with kind = "table", "bilinear", "softening", "elastic-plastic" or "module:Class"',
    )

    @model_validator(mode="after")
    def one_stiffness(self) -> CreaseTable:
        """Check that the stiffness is given in one of the two ways; where there is a law it tells."""
        if self.law is None and (self.Lstar is None) == (self.stiffness is None):
            raise ValueError("needs either Lstar (mm) or stiffness (N mm / (mm rad)), one of them")
        return self


class FoldTable(Table):
    """Keys of `bh.Fold`; which of them go together is checked there."""

    crease: str = Field(description='the name of a crease, or "all"')
    to: Dihedral | list[Dihedral] | None = Field(
        None, description="a dihedral angle in rad inside (0, 2 pi), flat is pi, or a list of one an edge"
    )
    by: FoldAngle | list[FoldAngle] | Literal["drawn"] | None = Field(
        None, description='a fold angle in rad from -pi to pi, a list of one an edge, or "drawn"'
    )
    rest: Rest | list[Rest] | None = Field(
        None, description="a rest dihedral angle in rad from 0 to 2 pi, flat is pi, or a list of one an edge"
    )
    Lstar: Scale | None = Field(None, description=LSTAR)
    stiffness: Stiff | None = Field(None, description="a positive stiffness a length, N mm / (mm rad)")
    part: Annotated[float, Field(ge=0.0, le=1.0)] = Field(
        1.0, description='a part of the drawn angles from 0 to 1, with by = "drawn"'
    )


class PinchTable(Table):
    """Keys of `bh.Pinch`."""

    crease: str = Field(description='the name of a crease, or "all"')
    at: Annotated[float, Field(ge=0.0, le=1.0)] = Field(
        0.5, description="the middle of the zone in parts of the crease's length, 0 to 1"
    )
    to: Dihedral | None = Field(
        None, description="the dihedral angle in the middle in rad inside (0, 2 pi), flat is pi"
    )
    by: PinchAngle | None = Field(
        None,
        description="a fold angle in rad inside (0, pi), mountain or valley as drawn; pi - pi / 14 without to",
    )
    length: Length | None = Field(
        None, description="the length of the zone along the crease in mm; a fifth of the crease unless given"
    )
    how: Literal["imposed", "rest", "couple"] = Field(
        "imposed",
        description='"imposed", "rest" for the rest angles of the crease\'s spring, or "couple" for closing couples',
    )
    profile: Profile = Field("cosine", description='"cosine", or "grip" for the same angle all over the zone')
    couple: Closing | None = Field(
        None,
        description='with how = "couple" the largest couple a length in the middle, a positive number in N mm / mm',
    )


class MomentTable(Table):
    """Keys of `bh.Moment`."""

    crease: str = Field(description='the name of a crease, or "all"')
    to: Couple = Field(description="a couple a length in N mm / mm")


class ForceTable(Table):
    """Keys of `bh.Force`."""

    at: Place = Field(description=PLACE)
    each: Push | None = Field(None, description=VECTOR + " in N, on every node of the place")
    total: Push | None = Field(None, description=VECTOR + " in N, shared by the nodes of the place")


class DisplaceTable(Table):
    """Keys of `bh.Displace`."""

    at: Place = Field(description=PLACE)
    direction: Literal["x", "y", "z"] | Vector = Field(description='"x", "y", "z" or a direction [x, y, z]')
    by: Distance | None = Field(
        None, description="a displacement in mm from the stress-free position, or give further"
    )
    further: Distance | None = Field(
        None, description="a displacement in mm from where the node is when the step begins"
    )


class PullTable(Table):
    """Keys of `bh.Pull`."""

    node: Annotated[int, Field(ge=0)] = Field(description="the number of a node")
    to: Vector = Field(description=VECTOR + " in mm, the point that the node is pulled to by a spring")
    stiffness: Positive = Field(description="the stiffness of the spring in N/mm, a positive number")
    start: Vector | None = Field(
        None,
        description=VECTOR + " in mm, the point where the step begins; where the node is then unless given",
    )


class WeightTable(Table):
    """Keys of `bh.Weight`."""

    g: Vector = Field(
        [0.0, 0.0, -9.81], description=VECTOR + " in m/s^2, gravity; [0, 0, 0] takes the weight away"
    )
    density: Positive | None = Field(None, description="a density in kg/m^3, that of the sheet unless given")


class UntilTable(Table):
    """What ends a step before its actuations are complete."""

    depth: Length | None = Field(None, description="a depth of the corrugation in mm (docs/corrugations.md)")
    observable: str | None = Field(None, description="the name of an observable, or module:function")
    value: Number | str | None = Field(
        None, description="its value at the end of the step, a number in its own unit, or with a unit"
    )
    of: str | None = Field(None, description="the crease or place that it is of")
    tolerance: Positive = Field(
        1e-5, description="how near the value must be met, in parts of it (in its unit where it is 0)"
    )

    @model_validator(mode="after")
    def one_target(self) -> UntilTable:
        """Check that the target is given in one of the two ways."""
        if (self.depth is None) == (self.observable is None) or (self.observable is None) != (
            self.value is None
        ):
            raise ValueError("needs either depth (mm), or observable and value")
        return self


class ExpandTable(Table):
    """Keys of `bh.Expand`."""

    by: Number | Amounts = Field(
        0.0, description="a strain up to 0.5, or [e11, e22] or [e11, e22, 2 e12] along and across the grain"
    )
    through: Curvature | Amounts = Field(
        0.0,
        description="a curvature at rest in 1/mm, or two or three of them; positive where the edges go up",
    )
    change: Number = Field(
        0.0, description="a change of temperature or moisture, in the unit of the expansion of the sheet"
    )
    where: Region = Field("all", description=REGION)
    axes: Turn | None = Field(
        None, description="the direction of e11 in the drawing in rad; the grain, or the x axis, unless given"
    )


ACTUATIONS: dict[str, type[Table]] = {
    "fold": FoldTable,
    "pinch": PinchTable,
    "moment": MomentTable,
    "force": ForceTable,
    "displace": DisplaceTable,
    "pull": PullTable,
    "weight": WeightTable,
    **LOADS,
    "expand": ExpandTable,
}
