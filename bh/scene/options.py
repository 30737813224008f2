"""Quantities in a command line: `--angle 60deg`, `--fit 8in`, or a number in the project's unit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from meshes.quantities import Kind


def _read(text: str | float, kind: Kind) -> float:
    if not isinstance(text, str):  # the default of an option
        return text
    from meshes.quantities import QuantityError, spoken  # loads numpy, which `bh --help` does without

    try:
        return spoken(text, kind)
    except QuantityError as error:
        raise typer.BadParameter(str(error)) from error


def an_angle(text: str) -> float:
    """An angle in rad.

    Raises:
        typer.BadParameter: the text is none; one line.
    """
    return _read(text, "angle")


def a_length(text: str) -> float:
    """A length in mm.

    Raises:
        typer.BadParameter: the text is none; one line.
    """
    return _read(text, "length")


def a_time(text: str) -> float:
    """A time in s.

    Raises:
        typer.BadParameter: the text is none; one line.
    """
    return _read(text, "time")


def a_sheet(text: str | int) -> int | str:
    """The number of a sheet, from 1, or "all".

    Raises:
        typer.BadParameter: the text is neither; one line.
    """
    if text == "all" or (isinstance(text, int) and text > 0):
        return text
    if not isinstance(text, str) or not text.isdecimal() or int(text) < 1:
        raise typer.BadParameter(f"'{text}' is no sheet; give a number from 1, or all")
    return int(text)
