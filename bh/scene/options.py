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
