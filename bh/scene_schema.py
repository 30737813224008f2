"""What a scene file may hold: one class a table, one field a key, its description what is allowed there.

Descriptions are what a user reads behind "give ..." in an error, so they state unit and range. Values that
only fit or fail together with others (a place, a width too large for its radius) are checked where they are
used.
"""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from bh.errors import InputError, SceneError
from bh.pinch_zone import Profile
from meshes.pattern import FoldKind
from meshes.structured import Kind

LONGEST, SHORTEST = 1e6, 1e-6  # mm; beyond, sampling a curve to a thousandth of a millimetre loses its sense
LARGEST = 1e9  # of any number
TURN = 2.0 * math.pi

Length = Annotated[float, Field(ge=SHORTEST, le=LONGEST)]
Height = Annotated[float, Field(gt=0.0, le=LONGEST)]
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Field(ge=1e-12, le=LARGEST)]
Stiffness = Annotated[float, Field(ge=0.0, le=LARGEST)]
Dihedral = Annotated[float, Field(gt=0.0, lt=TURN)]
Rest = Annotated[float, Field(ge=0.0, le=TURN)]
FoldAngle = Annotated[float, Field(ge=-math.pi, le=math.pi)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]
Node = Annotated[int, Field(ge=0, le=2**62)]
Vector = Annotated[list[Number], Field(min_length=3, max_length=3)]
Folds = FoldKind | Annotated[list[FoldKind], Field(min_length=1)]
Place = str | Annotated[list[Node], Field(min_length=1)]

FOLDS = '"mountain", "valley" or "flat", or a list with one of them a crease'
PLACE = 'a place ("corner:inner-start", "edge:inner", "crease:NAME", "node:N", "all", ...) or a list of nodes'
RADII = "the radius of the crease in mm, or a list of rising radii"
DENSITY = "cell height across over width along the crease, a positive number, best 5 to 12"
LSTAR = "the length scale of the crease in mm, a positive number"
VECTOR = "three numbers [x, y, z]"


class Table(BaseModel):
    """A table of the scene; values keep their TOML type, so that true is no number and "4" is none either."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


T = TypeVar("T", bound=Table)


# --- pattern: the class is chosen by `kind`, or is FilePattern where there is `file` ------------------------


class StripPattern(Table):
    kind: Literal["strip"]
    length: Length = Field(description="a positive length along x in mm")
    width: Length = Field(description="a positive width along y in mm")
    creases: list[Number] = Field([], description="a list of rising heights y in mm between 0 and the width")
    fold: Folds = Field("mountain", description=FOLDS)


class AnnulusSectorPattern(Table):
    kind: Literal["annulus_sector"]
    radius: Length | list[Length] = Field(description=RADII)
    width: Length = Field(description="a positive width each side of the creases in mm")
    angle: Annotated[float, Field(ge=SHORTEST, lt=TURN)] = Field(
        description='a sector angle in rad inside (0, 2 pi); kind = "full_annulus" is the whole turn'
    )
    fold: Folds = Field("mountain", description=FOLDS)


class FullAnnulusPattern(Table):
    kind: Literal["full_annulus"]
    radius: Length | list[Length] = Field(description=RADII)
    width: Length = Field(description="a positive width each side of the creases in mm")
    fold: Folds = Field("mountain", description=FOLDS)


class ParallelPattern(Table):
    kind: Literal["parallel_creases"]
    curvature: Number | Annotated[list[Number], Field(min_length=1)] = Field(
        description="the curvature of the first crease in 1/mm, of any sign, or a list with one of them a piece"
    )
    length: Length | Annotated[list[Length], Field(min_length=1)] = Field(
        description="the length of the first crease in mm, or a list with one of them a piece"
    )
    spacing: Length = Field(5.0, description="a positive distance between creases and to the edges in mm")
    creases: Annotated[int, Field(ge=1, le=1000)] = Field(1, description="a whole number of creases, from 1")
    fold: Folds | None = Field(None, description=FOLDS + "; alternating from mountain unless given")


class FilePattern(Table):
    file: Annotated[str, Field(min_length=1)] = Field(
        description="the name of a .fold file, from the folder of the scene"
    )
    frame: Annotated[int, Field(ge=0, le=1_000_000)] | None = Field(
        None, description="a frame number from 0 (the key frame)"
    )


LIBRARY: dict[str, type[StripPattern | AnnulusSectorPattern | FullAnnulusPattern | ParallelPattern]] = {
    "strip": StripPattern,
    "parallel_creases": ParallelPattern,
    "annulus_sector": AnnulusSectorPattern,
    "full_annulus": FullAnnulusPattern,
}


# --- sheet, mesh, model, outputs ----------------------------------------------------------------------------


class SheetTable(Table):
    E: Positive = Field(
        description="Young's modulus in MPa, a positive number up to 1e9 MPa (1 GPa is 1000 MPa)"
    )
    nu: Annotated[float, Field(gt=-1.0, le=0.5)] = Field(0.0, description="Poisson's ratio in (-1, 0.5]")
    t: Length = Field(description="the thickness in mm, a positive number")


class GmshTable(Table):
    """An unstructured mesh that conforms to the creases."""

    kind: Literal["gmsh"] = Field(description='"gmsh"')
    size: Annotated[float, Field(gt=0.0)] = Field(description="the length of an edge in mm, positive")
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = Field(1, description="a whole number from 0")


class MeshTable(Table):
    kind: Kind = Field("staggered", description='"staggered", "alternating", "one-way" or "mirrored"')
    along: Count | None = Field(None, description="a whole number of cells along the crease, from 1")
    aspect_ratio: Annotated[float, Field(gt=0.0, le=1e4)] | None = Field(None, description=DENSITY)
    rows: Annotated[int, Field(ge=1, le=10_000)] = Field(
        1, description="a whole number of rows of cells each side of a crease, from 1"
    )

    @model_validator(mode="after")
    def one_density(self) -> MeshTable:
        if (self.along is None) == (self.aspect_ratio is None):
            given = "both" if self.along is not None else "neither"
            raise ValueError(f"needs either along (cells along the crease) or aspect_ratio, but has {given}")
        return self


class ModelTable(Table):
    formulation: str = Field("bars-and-hinges", description="a name that `bh formulations` lists")
    hinge_lock: bool = Field(True, description="true or false")


class OutputsTable(Table):
    pictures: bool = Field(False, description="true or false")
    vtu: bool = Field(False, description="true or false")
    fold: bool = Field(False, description="true or false")


# --- supports, creases, steps -------------------------------------------------------------------------------


class SupportTable(Table):
    at: Place = Field(description=PLACE + ', or "rigid-body"')
    fix: str | Vector | Annotated[list[Vector], Field(min_length=1)] | None = Field(
        None, description='letters out of "xyz", a direction [x, y, z], or a list of directions'
    )
    clamp: bool = Field(False, description="true or false: also hold the slope across the edges of the place")

    @model_validator(mode="after")
    def rigid_body_fixes_nothing(self) -> SupportTable:
        if self.at == "rigid-body" and (self.fix is not None or self.clamp):
            raise ValueError(
                'at = "rigid-body" takes out the motions that are left and needs neither; remove fix and clamp'
            )
        return self


class CreaseTable(Table):
    Lstar: Positive | None = Field(None, description=LSTAR)
    stiffness: Stiffness | None = Field(None, description="a stiffness a length, N mm / (mm rad), 0 or more")
    rest: Rest = Field(math.pi, description="a rest dihedral angle in rad from 0 to 2 pi (flat is pi)")

    @model_validator(mode="after")
    def one_stiffness(self) -> CreaseTable:
        if (self.Lstar is None) == (self.stiffness is None):
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
    Lstar: Positive | None = Field(None, description=LSTAR)
    stiffness: Positive | None = Field(None, description="a positive stiffness a length, N mm / (mm rad)")


class PinchTable(Table):
    """Keys of `bh.Pinch`."""

    crease: str = Field(description='the name of a crease, or "all"')
    at: Annotated[float, Field(ge=0.0, le=1.0)] = Field(
        0.5, description="the middle of the zone in parts of the crease's length, 0 to 1"
    )
    to: Dihedral | None = Field(
        None, description="the dihedral angle in the middle in rad inside (0, 2 pi), flat is pi"
    )
    by: Annotated[float, Field(gt=0.0, lt=math.pi)] | None = Field(
        None,
        description="a fold angle in rad inside (0, pi), mountain or valley as drawn; pi - pi / 14 without to",
    )
    length: Length | None = Field(
        None, description="the length of the zone along the crease in mm; a fifth of the crease unless given"
    )
    how: Literal["imposed", "rest"] = Field(
        "imposed", description='"imposed", or "rest" for the rest angles of the crease\'s spring'
    )
    profile: Profile = Field("cosine", description='"cosine", or "grip" for the same angle all over the zone')


class MomentTable(Table):
    crease: str = Field(description='the name of a crease, or "all"')
    to: Number = Field(description="a couple a length in N mm / mm")


class ForceTable(Table):
    at: Place = Field(description=PLACE)
    each: Vector | None = Field(None, description=VECTOR + " in N, on every node of the place")
    total: Vector | None = Field(None, description=VECTOR + " in N, shared by the nodes of the place")


class DisplaceTable(Table):
    at: Place = Field(description=PLACE)
    direction: Literal["x", "y", "z"] | Vector = Field(description='"x", "y", "z" or a direction [x, y, z]')
    by: Number = Field(description="a displacement in mm")


ACTUATIONS: dict[str, type[FoldTable | PinchTable | MomentTable | ForceTable | DisplaceTable]] = {
    "fold": FoldTable,
    "pinch": PinchTable,
    "moment": MomentTable,
    "force": ForceTable,
    "displace": DisplaceTable,
}


# --- reading tables -----------------------------------------------------------------------------------------


def read_toml(text: str) -> dict[str, Any]:
    if not text.strip():
        raise SceneError("the file is empty; give a scene (see examples/)")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"this is not TOML: {error}") from error
    except RecursionError as error:
        raise SceneError("this is not a scene: brackets are nested too deeply") from error
    except ValueError as error:  # such as an integer of thousands of digits
        raise SceneError(f"this is not TOML: {str(error).split(';')[0]}") from error


def read_table(kind: type[T], data: Any, at: str) -> T:
    """The table `data` as `kind`.

    Raises:
        SceneError: the first thing that is wrong with it, with its dotted path (`at` is the table's).
    """
    table = as_table(data, at)
    check_keys(at, table, kind.model_fields)
    try:
        return kind.model_validate(table)
    except ValidationError as errors:
        first = errors.errors(include_url=False)[0]
        if not first["loc"]:  # a rule of the whole table
            raise SceneError(f"{at}: {first['ctx']['error']}") from errors
        key = str(first["loc"][0])
        allowed = str(kind.model_fields[key].description)
        if first["type"] == "missing":
            raise SceneError(f"{at}.{key} is missing; give {allowed}") from errors
        hint = "; angles are radians, not degrees" if " rad" in allowed and _like_degrees(table[key]) else ""
        raise SceneError(f"{at}.{key} = {shown(table[key])} cannot be; give {allowed}{hint}") from errors


def check_keys(at: str, table: Mapping[str, Any], known: Iterable[str]) -> None:
    allowed = list(known)
    for key, value in table.items():
        if key not in allowed:
            dotted = f"{at}.{key}" if at else key
            raise SceneError(
                f"unknown key {dotted} = {shown(value)}{nearest(key, allowed)}; "
                f"known keys are {', '.join(allowed)}"
            )


def as_table(data: Any, at: str) -> dict[str, Any]:
    if not isinstance(data, dict):
        example = f"[{at}]" if at.isalpha() else "{ key = value }"
        raise SceneError(f"{at} = {shown(data)} is not a table; write {example}")
    return data


def as_tables(data: Any, at: str) -> list[Any]:
    if isinstance(data, dict):
        raise SceneError(f"{at} is one table; it is a list of tables, so write [[{at}]] with double brackets")
    if not isinstance(data, list):
        raise SceneError(f"{at} = {shown(data)} is not a list of tables; write [[{at}]]")
    if not data and at == "steps":
        raise SceneError("steps is empty; add a table [[steps]]")
    return data


def one_or_more(value: Any, at: str) -> list[tuple[str, Any]]:
    """A table, or the tables of a list, each with its path."""
    if not isinstance(value, list):
        return [(at, value)]
    if not value:
        raise SceneError(f"{at} is an empty list; give a table or a list of tables")
    return [(f"{at}[{i}]", each) for i, each in enumerate(value)]


# --- words --------------------------------------------------------------------------------------------------


@contextmanager
def within(at: str) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise SceneError(f"{at}: {error}") from error


def nearest(key: object, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(str(key), list(known), n=1) or [
        name for name in known if name.lower() == str(key).lower()
    ]
    return f" (did you mean '{close[0]}'?)" if close else ""


def _like_degrees(value: Any) -> bool:
    numbers = [v for v in (value if isinstance(value, list) else [value]) if isinstance(v, int | float)]
    return any(7.0 < abs(v) <= 360.0 for v in numbers)


def shown(value: Any) -> str:
    """A value as TOML writes it, in a few characters."""
    if isinstance(value, dict):
        return "{...}" if value else "{}"
    if isinstance(value, list):
        inner = ", ".join(shown(item) for item in value[:4])
        return f"[{inner}{', ...' if len(value) > 4 else ''}]"[:80]
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int) and abs(value) >= 10**18:
        return "an integer of many digits"
    text = f'"{value}"' if isinstance(value, str) else str(value)
    return text if len(text) <= 60 else text[:56] + " ..."


def one_line(text: str) -> str:
    """One printable line of a bearable length."""
    words = " ".join(text.split())
    clean = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in words)
    return clean if len(clean) <= 600 else clean[:596] + " ..."
