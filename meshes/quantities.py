"""Quantities as people write them: "60deg", "3in", "4GPa" become plain numbers in rad, mm, MPa.

A plain number is returned as it is, in the unit of the project, and costs nothing; pint is loaded when the first text
with a unit comes. It is given the units of this module and no others: what is not here is refused, with the nearest
name that is.
"""

from __future__ import annotations

import difflib
import math
import re
from functools import cache
from typing import Any, Literal, NamedTuple, TypeVar, overload

from meshes.errors import InputError

Kind = Literal[
    "angle",
    "length",
    "modulus",
    "force",
    "couple",
    "stiffness",
    "curvature",
    "energy",
    "moment",
    "time",
    "pressure",
    "line force",
]
Typed = float | str  # a number in the project's unit, or a text with a unit
T = TypeVar("T")


class QuantityError(InputError):
    """A text that is no quantity of the kind that is wanted.

    Attributes:
        has_number: it begins with a number, so that it was meant as one.
    """

    has_number: bool = False


class _Unit(NamedTuple):
    """Unit of the project, as pint reads it; an article with the name; examples; names that are alike."""

    unit: str
    name: str
    examples: str
    known: tuple[str, ...]


_LENGTHS = ("mm", "cm", "m", "um", "in", "inch", "inches", "ft", "foot", "feet", "thou", "mil", "metre", "meter",
            "millimetre", "millimeter", "centimetre", "centimeter", "micron", "micrometre", "micrometer")  # fmt: skip
_FORCES = ("N", "mN", "kN", "newton", "newtons", "gf", "kgf", "lbf", "ozf")
UNITS: dict[Kind, _Unit] = {
    "angle": _Unit("radian", "angle", "60deg or 1.05rad", ("deg", "degree", "degrees", "rad", "radian", "radians",
                                                          "mrad", "arcmin", "turn", "turns")),
    "length": _Unit("millimeter", "length", "0.5mm, 3cm or 3in", _LENGTHS),
    "modulus": _Unit("megapascal", "modulus", "4GPa or 4000MPa", ("MPa", "GPa", "kPa", "Pa", "psi", "ksi", "bar")),
    "force": _Unit("newton", "force", "0.1N or 10gf", _FORCES),
    "couple": _Unit("newton", "couple a length", "0.2N or 0.2 N mm/mm", _FORCES),
    "stiffness": _Unit("newton", "stiffness a length", "0.2N or 0.2 N mm/(mm rad)", _FORCES),
    "curvature": _Unit("1 / millimeter", "curvature", "0.01/mm or 10/m", ("1/mm", "1/m", "1/in")),
    "energy": _Unit("newton * millimeter", "energy", "2mJ or 2 N mm", ("J", "mJ", "uJ", "joule")),
    "moment": _Unit("newton * millimeter", "moment", "2 N mm", ("N mm", "N m")),
    "pressure": _Unit("megapascal", "pressure", "2kPa or 0.002MPa", ("MPa", "kPa", "Pa", "GPa", "psi", "ksi", "bar")),
    "line force": _Unit("newton / millimeter", "force a length", "0.1 N/mm", ("N/mm", "N/m", "mN/mm", "N/cm")),
    "time": _Unit("second", "time", "30s or 2min", ("s", "second", "seconds", "min", "minute", "minutes", "ms", "h")),
}  # fmt: skip
SHORT = {
    "inch": "in", "inches": "in", "foot": "ft", "feet": "ft", "mil": "thou", "metre": "m", "meter": "m",
    "millimetre": "mm", "millimeter": "mm", "centimetre": "cm", "centimeter": "cm", "micron": "um", "micrometre": "um",
    "micrometer": "um", "degree": "deg", "degrees": "deg", "radian": "rad", "radians": "rad", "turns": "turn",
    "newton": "N", "newtons": "N", "joule": "J", "second": "s", "seconds": "s", "minute": "min", "minutes": "min",
}  # fmt: skip
_DEFINED = """
giga- = 1e9 = G-
mega- = 1e6 = M-
kilo- = 1e3 = k-
centi- = 1e-2 = c-
milli- = 1e-3 = m-
micro- = 1e-6 = u-
meter = [length] = m = metre
second = [time] = s
minute = 60 * second = min
hour = 3600 * second = h
kilogram = [mass] = kg
radian = [] = rad
degree = 0.017453292519943295 * radian = deg
arcminute = degree / 60 = arcmin
turn = 6.283185307179586 * radian
inch = 0.0254 * meter = in = inches
foot = 0.3048 * meter = ft = feet
thou = 2.54e-5 * meter = mil
micron = 1e-6 * meter
newton = kilogram * meter / second ** 2 = N
gram_force = 0.00980665 * newton = gf
kilogram_force = 9.80665 * newton = kgf
pound_force = 4.4482216152605 * newton = lbf
ounce_force = 0.27801385095378125 * newton = ozf
newton_millimeter = newton * millimeter = Nmm
newton_meter = newton * meter = Nm
joule = newton * meter = J
pascal = newton / meter ** 2 = Pa
bar = 1e5 * pascal
pound_per_square_inch = 6894.757293168361 * pascal = psi
ksi = 6894757.293168361 * pascal
"""
_WORDS = frozenset(
    word for unit in UNITS.values() for name in unit.known for word in re.findall("[A-Za-z]+", name)
)
_MORE = frozenset(("Nmm", "Nm", "N", "mN", "kN", "mm", "cm", "m", "um", "in", "ft", "rad"))
_SIGNS = str.maketrans({"°": " deg", "µ": "u", "μ": "u", "²": "**2", "³": "**3", "·": "*", "″": " in"})
_TEXT = re.compile(r"\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*(.*?)\s*", re.DOTALL)
_ALLOWED = re.compile(
    r"(?:[A-Za-z]++(?:(?:\*\*|\^)-?[1-3](?![0-9*^]))?|1(?= */)|[*/() ])+"
)  # no towers of powers
PATTERN = r"^\s*[-+]?[.0-9].*\S\s*$"  # what editors may check of a text that stands for a number
LONGEST = 40  # characters
OTHER = frozenset(("grad", "gon"))  # 60 grad are no misspelt 60 rad, and not known


@overload
def number(value: str, kind: Kind) -> float: ...
@overload
def number(value: T, kind: Kind) -> T: ...


def number(value: object, kind: Kind) -> object:
    """A number in the project's unit (mm, N, rad, MPa, s) of a text with a unit; anything else is returned as it is.

    Args:
        value: such as "60deg"; or a number already.
        kind: what it is to be.

    Returns:
        the number.

    Raises:
        QuantityError: the text is no quantity of that kind; one line that says how to write one.
    """
    if not isinstance(value, str):
        return value
    found = _TEXT.fullmatch(value) if len(value) <= LONGEST else None
    if found is None:
        raise _wrong(value, kind)
    size, unit = float(found[1]), found[2].translate(_SIGNS).strip()
    if not unit:
        home = _short(UNITS[kind].known[0])
        raise _error(
            f'"{value}" has no unit: write {value.strip()}{home}, or the number without quotes', True
        )
    factor = _factor(unit, kind)
    if factor is None:
        raise _wrong(value, kind, found[1], found[2])
    return size * factor


def numbers(value: Any, kind: Kind) -> Any:
    """As `number`, of a list or tuple too, at any depth; one of numbers only is returned as it is.

    Args:
        value: a number, a text, or a list or tuple of them.
        kind: what they are to be.

    Raises:
        QuantityError: a text is no quantity of that kind.
    """
    if isinstance(value, list | tuple) and any(isinstance(each, str | list | tuple) for each in value):
        return type(value)(numbers(each, kind) for each in value)
    return number(value, kind)


def of_any_kind(value: float | str) -> float:
    """A number in the project's unit of a text whose kind its unit tells, or a number as it is.

    Args:
        value: such as "30deg" or "2mm".

    Raises:
        QuantityError: its unit is none of any kind.
    """
    if not isinstance(value, str):
        return value
    for kind in UNITS:
        try:
            return number(value, kind)
        except QuantityError:
            continue
    raise QuantityError(f'"{value}" is no quantity: write one such as 60deg, 3in or 4GPa')


def spoken(text: str, kind: Kind) -> float:
    """A number of what is typed in a command line, where "3" is a number in the project's unit.

    Args:
        text: as it was typed.
        kind: what it is to be.

    Raises:
        QuantityError: the text is no quantity of that kind.
    """
    try:
        return float(text)
    except ValueError:
        return number(text, kind)


def take_units(item: object, what: str, **kinds: Kind) -> None:
    """Put numbers in the place of texts with units in a frozen dataclass that is being made.

    Args:
        item: the dataclass.
        what: of it, for messages.
        **kinds: by the name of a field.

    Raises:
        QuantityError: a text is no quantity; one line that names the field.
    """
    for key, kind in kinds.items():
        value = getattr(item, key)
        if isinstance(value, str | list | tuple):
            try:
                object.__setattr__(item, key, numbers(value, kind))
            except QuantityError as error:
                raise _error(f"{what}: {key} = {error}", error.has_number) from error


def degrees_meant(angle: float) -> str:
    """What to add to a message about an angle that looks like degrees, or ""."""
    if not (math.isfinite(angle) and 7.0 < abs(angle) <= 360.0):
        return ""
    return f'; angles are radians, not degrees: write "{angle:g}deg"'


def _factor(unit: str, kind: Kind) -> float | None:
    """What a unit is in the project's, or None where it is none of that kind."""
    words = re.findall("[A-Za-z]+", unit)
    if not _ALLOWED.fullmatch(unit) or not all(word in _WORDS | _MORE for word in words):
        return None
    if kind == "angle" and not set(words) & set(UNITS[kind].known):  # mm/mm has no dimension either
        return None
    try:
        return float(_registry().Quantity(1.0, _unit(unit)).to(_unit(UNITS[kind].unit)).magnitude)
    except Exception:  # what pint raises has no common base: division by zero, powers of words, brackets
        return None


@cache
def _unit(text: str) -> Any:
    return _registry().parse_units(f"1 {text}" if text.startswith("/") else text)


@cache
def _registry() -> Any:
    import pint

    registry: Any = pint.UnitRegistry(None)
    registry.load_definitions(_DEFINED.strip().splitlines())
    return registry


def _wrong(value: str, kind: Kind, size: str = "", unit: str = "") -> QuantityError:
    asked = UNITS[kind]
    lower = {name.lower(): name for name in asked.known}
    other = unit in _WORDS or unit.lower() in OTHER  # of another kind: 3N is no misspelt 3in
    near = difflib.get_close_matches(unit.lower(), lower, n=1, cutoff=0.6) if unit and not other else []
    mend = f"write {size}{_short(lower[near[0]])}" if near else f"write one such as {asked.examples}"
    text = value if len(value) <= LONGEST else value[:36] + " ..."
    return _error(f'"{text}" is no {asked.name}: {mend}', bool(size))


def _error(text: str, has_number: bool) -> QuantityError:
    error = QuantityError(text)
    error.has_number = has_number
    return error


def _short(name: str) -> str:
    return SHORT.get(name, name)
