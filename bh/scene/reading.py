"""What every table of a scene file is made of: kinds of numbers, and a clear line for what is wrong in a table."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, TypeVar

from annotated_types import Interval
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from bh.errors import InputError, SceneError
from bh.runtime.consent import outside_allowed
from bh.scene.toml_text import waits
from meshes.pattern import FoldKind
from meshes.quantities import PATTERN, Kind, QuantityError, degrees_meant, number

LONGEST, SHORTEST = 1e6, 1e-6  # mm; beyond, sampling a curve to a thousandth of a millimetre loses its sense
LARGEST = 1e9  # of any number
TURN = 2.0 * math.pi


def spelled(kind: Kind, limits: Interval) -> BeforeValidator:
    """What takes a text such as "60deg" in place of a number, and tells editors so.

    Args:
        kind: of the quantity.
        limits: of the number, in the project's unit.
    """
    text = Annotated[str, Field(pattern=PATTERN)]
    return BeforeValidator(
        lambda value: number(value, kind),
        json_schema_input_type=Annotated[float, limits] | text,
    )


_LENGTHS, _ANY, _POSITIVE = (
    Interval(ge=SHORTEST, le=LONGEST),
    Interval(ge=-LARGEST, le=LARGEST),
    Interval(ge=1e-12, le=LARGEST),
)
_DIHEDRAL, _REST, _FOLD = (
    Interval(gt=0.0, lt=TURN),
    Interval(ge=0.0, le=TURN),
    Interval(ge=-math.pi, le=math.pi),
)
_STIFF, _SECTOR, _PINCHED = (
    Interval(ge=0.0, le=LARGEST),
    Interval(ge=SHORTEST, lt=TURN),
    Interval(gt=0.0, lt=math.pi),
)
_TURN = Interval(ge=-TURN, le=TURN)
_BEND = Interval(gt=0.0, le=TURN)

Number = Annotated[float, _ANY]
Positive = Annotated[float, _POSITIVE]
Length = Annotated[float, _LENGTHS, spelled("length", _LENGTHS)]
Distance = Annotated[float, _ANY, spelled("length", _ANY)]
Scale = Annotated[float, _POSITIVE, spelled("length", _POSITIVE)]
Curvature = Annotated[float, _ANY, spelled("curvature", _ANY)]
Modulus = Annotated[float, _POSITIVE, spelled("modulus", _POSITIVE)]
Stiffness = Annotated[float, _STIFF, spelled("stiffness", _STIFF)]
Stiff = Annotated[float, _POSITIVE, spelled("stiffness", _POSITIVE)]
Slope = Annotated[float, _ANY, spelled("stiffness", _ANY)]
Bend = Annotated[float, _BEND, spelled("angle", _BEND)]
Couple = Annotated[float, _ANY, spelled("couple", _ANY)]
Closing = Annotated[float, _POSITIVE, spelled("couple", _POSITIVE)]
Seconds = Annotated[float, _POSITIVE, spelled("time", _POSITIVE)]
Turn = Annotated[float, _TURN, spelled("angle", _TURN)]
Dihedral = Annotated[float, _DIHEDRAL, spelled("angle", _DIHEDRAL)]
Rest = Annotated[float, _REST, spelled("angle", _REST)]
FoldAngle = Annotated[float, _FOLD, spelled("angle", _FOLD)]
SectorAngle = Annotated[float, _SECTOR, spelled("angle", _SECTOR)]
PinchAngle = Annotated[float, _PINCHED, spelled("angle", _PINCHED)]
Spot = Annotated[list[Distance], Field(min_length=3, max_length=3)]
Push = Annotated[list[Annotated[float, _ANY, spelled("force", _ANY)]], Field(min_length=3, max_length=3)]
Turning = Annotated[list[Annotated[float, _ANY, spelled("energy", _ANY)]], Field(min_length=3, max_length=3)]
Pressing = Annotated[float, _ANY, spelled("pressure", _ANY)]
PerArea = Annotated[list[Pressing], Field(min_length=3, max_length=3)]
PerLength = Annotated[
    list[Annotated[float, _ANY, spelled("line force", _ANY)]], Field(min_length=3, max_length=3)
]
Amounts = Annotated[list[Number], Field(min_length=2, max_length=3)]
Region = str | list[str] | list[Annotated[list[Number], Field(min_length=2, max_length=2)]]
Count = Annotated[int, Field(ge=1, le=1_000_000)]
Few = Annotated[int, Field(ge=1, le=1000)]
Node = Annotated[int, Field(ge=0, le=2**62)]
Vector = Annotated[list[Number], Field(min_length=3, max_length=3)]
Folds = FoldKind | Annotated[list[FoldKind], Field(min_length=1)]
Panels = Annotated[int, Field(ge=2, le=100)]
Power = Annotated[float, Field(ge=1.0, le=100.0)]
Place = str | Annotated[list[Node], Field(min_length=1)]

FOLDS = '"mountain", "valley" or "flat", or a list with one of them a crease'
PLACE = 'a place ("corner:inner-start", "edge:inner", "crease:NAME", "node:N", "all", ...) or a list of nodes'
RADII = "the radius of the crease in mm, or a list of rising radii"
ALTERNATING = FOLDS + "; alternating where it is left out"
ALONG, ACROSS = "the side along x in mm", "the side along y in mm"
DENSITY = "cell height across over width along the crease, a positive number, best 5 to 12"
LSTAR = "the length scale of the crease in mm, a positive number"
REGION = 'a region: "face:X,Y", "inside:PLACE", "layer:NAME", "all", a list of these, or a polygon [[x, y], ...] in mm'
VECTOR = "three numbers [x, y, z]"


class Table(BaseModel):
    """A table of the scene; values keep their TOML type, so that true is no number and "4" is none either."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


T = TypeVar("T", bound=Table)


def read_table(kind: type[T], data: object, at: str) -> T:
    """The table `data` as `kind`.

    Args:
        kind: the class of the table.
        data: what the scene has there.
        at: dotted path of the table.

    Raises:
        SceneError: the first thing that is wrong with it, with its dotted path (`at` is the table's).
    """
    table = as_table(data, at)
    check_keys(at, table, kind.model_fields)
    try:
        return kind.model_validate(table)
    except ValidationError as errors:
        found = errors.errors(include_url=False)
        first = found[0]
        if not first["loc"]:  # a rule of the whole table
            raise SceneError(f"{at}: {first['ctx']['error']}") from errors
        key = str(first["loc"][0])
        for each in found:
            told = each.get("ctx", {}).get("error")
            if str(each["loc"][0]) == key and isinstance(told, QuantityError) and told.has_number:
                raise SceneError(f"{at}.{key} = {told}") from errors
        allowed = str(kind.model_fields[key].description)
        if first["type"] == "missing":
            raise SceneError(f"{at}.{key} is missing; give {allowed}") from errors
        hint = _degrees_hint(table[key]) if " rad" in allowed else ""
        raise SceneError(f"{at}.{key} = {shown(table[key])} cannot be; give {allowed}{hint}") from errors


def check_keys(at: str, table: Mapping[str, object], known: Iterable[str]) -> None:
    """Refuse keys that a table does not know.

    Args:
        at: dotted path of the table, "" for the scene itself.
        table: what the scene has there.
        known: its keys.

    Raises:
        SceneError: the first unknown key, with the nearest known one.
    """
    allowed = list(known)
    for key, value in table.items():
        if key not in allowed:
            dotted = f"{at}.{key}" if at else key
            raise SceneError(
                f"unknown key {dotted} = {shown(value)}{nearest(key, allowed)}; "
                f"known keys are {', '.join(allowed)}"
            )


def as_table(data: object, at: str) -> dict[str, object]:
    """The value at a path, if it is a table.

    Args:
        data: what the scene has there.
        at: its dotted path.

    Returns:
        the table.

    Raises:
        SceneError: it is none.
    """
    if not isinstance(data, dict):
        example = f"[{at}]" if at.isalpha() else "{ key = value }"
        raise SceneError(f"{at} = {shown(data)} is not a table; write {example}")
    return data


def as_tables(data: object, at: str) -> list[object]:
    """The value at a path, if it is a list of tables.

    Args:
        data: what the scene has there.
        at: its dotted path.

    Returns:
        the tables in order.

    Raises:
        SceneError: it is none.
    """
    if isinstance(data, dict):
        raise SceneError(f"{at} is one table; it is a list of tables, so write [[{at}]] with double brackets")
    if not isinstance(data, list):
        raise SceneError(f"{at} = {shown(data)} is not a list of tables; write [[{at}]]")
    if not data and at == "steps":
        raise SceneError("steps is empty; add a table [[steps]]")
    return data


def one_or_more(value: object, at: str) -> list[tuple[str, object]]:
    """A table, or the tables of a list, each with its path.

    Args:
        value: what the scene has there.
        at: its dotted path.

    Returns:
        dotted path and value of each.

    Raises:
        SceneError: the list is empty.
    """
    if not isinstance(value, list):
        return [(at, value)]
    if not value:
        raise SceneError(f"{at} is an empty list; give a table or a list of tables")
    return [(f"{at}[{i}]", each) for i, each in enumerate(value)]


def places(value: object, at: str) -> tuple[str | tuple[int, ...], ...]:
    """A place, or several: names, and lists of node indices. A list of numbers is one place.

    Args:
        value: what the scene has there.
        at: its dotted path.

    Returns:
        a name or node indices for each.

    Raises:
        SceneError: it is something else; one line.
    """

    def nodes(item: object) -> tuple[int, ...] | None:
        if not isinstance(item, list) or not item:
            return None
        found = tuple(each for each in item if isinstance(each, int) and not isinstance(each, bool))
        return found if len(found) == len(item) and min(found) >= 0 else None

    given = [value] if isinstance(value, str) or nodes(value) else value
    items = (
        [each if isinstance(each, str) else nodes(each) for each in given] if isinstance(given, list) else []
    )
    if not items or None in items:
        raise SceneError(f"{at} = {shown(value)} cannot be; give {PLACE}, or a list of these")
    return tuple(item for item in items if item is not None)


@contextmanager
def within(at: str) -> Iterator[None]:
    """Errors inside get the dotted path in front, as a `SceneError`.

    Raises:
        SceneError: any error of the input inside.
    """
    try:
        yield
    except InputError as error:
        raise SceneError(f"{at}: {error}") from error


def nearest(key: object, known: Iterable[str]) -> str:
    """A known name like `key` as ` (did you mean ...?)`, or "".

    Args:
        key: that is not known.
        known: names to compare it with.
    """
    close = difflib.get_close_matches(str(key), list(known), n=1) or [
        name for name in known if name.lower() == str(key).lower()
    ]
    return f" (did you mean '{close[0]}'?)" if close else ""


def _degrees_hint(value: object) -> str:
    numbers = [v for v in (value if isinstance(value, list) else [value]) if isinstance(v, int | float)]
    return next((hint for v in numbers if (hint := degrees_meant(v))), "")


def shown(value: object) -> str:
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


def is_inside(folder: Path, place: Path) -> bool:
    """Whether a file lies below a folder, symbolic links followed.

    Args:
        folder: that is allowed.
        place: of the file, which need not exist.
    """
    try:
        return place.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError):  # a loop of links, a null character: told where it is opened
        return True


def inside(folder: Path, name: str, at: str) -> Path:
    """The place of a file that a file names: below the folder of the one that names it, unless the user said otherwise.

    Args:
        folder: of the file that names it.
        name: as it stands there.
        at: dotted path of the key.

    Raises:
        SceneError: it lies outside, directly or by a symbolic link.
    """
    place = folder / name
    if not outside_allowed() and not is_inside(folder, place):
        raise SceneError(
            f"{at} = {shown(name)} lies outside the folder of the file that names it; copy it there, or add "
            "--allow-outside (BH_ALLOW_OUTSIDE=1, or bh.allow_outside() in Python)"
        )
    if waits(place):
        raise SceneError(f"{at} = {shown(name)} is a pipe, which may never end; give a file")
    return place


def without(table: dict[str, object], key: str) -> dict[str, object]:
    """The table without one of its keys.

    Args:
        table: stays as it is.
        key: to leave out.

    Returns:
        a new table.
    """
    return {name: value for name, value in table.items() if name != key}


def arguments(table: Table) -> dict[str, Any]:
    """The keys of a table as keyword arguments; lists become the tuples of frozen data.

    Returns:
        the arguments by name.
    """
    return {name: tuple(value) if isinstance(value, list) else value for name, value in table}
