"""Text for a terminal: names from files must not move its cursor, recolour it or turn the direction of reading."""

from __future__ import annotations

MESSAGE = 2000  # characters


def plain(text: str) -> str:
    """The text with every character that a terminal would act upon written out by its code; lines stay lines."""
    return "".join(c if c.isprintable() or c in "\n\t" else _written(c) for c in text)


def shortened(text: str) -> str:
    """A message without what is in the middle of a very long one: names in files may be of any length."""
    return text if len(text) <= MESSAGE else f"{text[: 2 * MESSAGE // 3]} ... {text[-MESSAGE // 4 :]}"


def say(text: str, err: bool = False) -> None:
    """Print a text, whatever names are in it.

    Args:
        text: lines.
        err: to the error stream.
    """
    import typer  # here, since programs that print nothing need none

    typer.echo(plain(text), err=err)


def _written(character: str) -> str:
    return character.encode("unicode_escape", "backslashreplace").decode()
