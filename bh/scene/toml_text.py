"""TOML texts: counted before they are parsed (a text may be made to be slow), and values as they are written.

Values stand in the middle of lines with comments of their own, which a writer of whole documents would not keep.
"""

from __future__ import annotations

import json
import re
import stat
import tomllib
from collections.abc import Mapping
from pathlib import Path

from bh.errors import SceneError
from meshes.limits import check_limit, limits

BYTES_EACH = 40  # of an entry: files are 4 MB long at most, since a number of 10 MB takes 1.4 GB to parse
MOST_PARTS = 16  # of a dotted key: the time of tomllib grows with their square
COUNTED = "this file (lines, keys and values of lists)"
BARE = re.compile(r"[A-Za-z0-9_-]+")  # keys that need no quotes
# a part of a key and the dot behind it, over and over; possessive, and not from within a word: linear in the text
_DOTTED = re.compile(r"""(?:(?:(?<![\w-])[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+)++""", re.ASCII)


def toml_bytes(path: Path) -> bytes:
    """The bytes of a TOML file, once it is sure that they are few and come.

    Args:
        path: of the file.

    Raises:
        SceneError: it is a pipe, or longer than `BYTES_EACH` times the limit of entries.
        OSError: it cannot be read.
    """
    if waits(path):
        raise SceneError("this is a pipe, which may never end; give a file")
    most = BYTES_EACH * limits().entries
    with path.open("rb") as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise SceneError(
            f"the file is longer than {most / 1e6:g} MB; give a scene file (TOML), or set BH_LIMIT_ENTRIES"
        )
    return content


def read_toml(text: str) -> dict[str, object]:
    """The tables of a TOML text.

    Returns:
        the tables by name.

    Raises:
        SceneError: the text is empty, no TOML, or holds too much (counted before it is parsed).
    """
    if not text.strip():
        raise SceneError("the file is empty; give a scene (see examples/)")
    _check_entries(text)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"this is not TOML: {error}") from error
    except RecursionError as error:
        raise SceneError("this is not a scene: brackets are nested too deeply") from error
    except ValueError as error:  # such as an integer of thousands of digits
        raise SceneError(f"this is not TOML: {str(error).split(';')[0]}") from error


def _check_entries(text: str) -> None:
    """Refuse what a parser written in Python would take long for; strings and comments are counted, too."""
    count, longest = sum(map(text.count, "\n,=[{\\")), 0
    check_limit("entries", count, COUNTED, SceneError)
    # escapes are no end of a part: pairs of backslashes go first, from the left, as TOML reads them
    for found in _DOTTED.finditer(text.replace("\\\\", "").replace('\\"', "")):
        parts = found.group().count(".")
        count += parts - 1  # a number, or a key of two parts, has one dot
        longest = max(longest, parts + 1)
    check_limit("entries", count, COUNTED, SceneError)
    if longest > MOST_PARTS:
        raise SceneError(
            f"this file has a key of {longest:,} parts with dots, more than {MOST_PARTS}; write tables of fewer"
        )


def waits(place: Path) -> bool:
    """Whether it is a pipe or socket: opening one waits until somebody writes, which may be for ever."""
    try:
        mode = place.stat().st_mode
    except (OSError, ValueError):  # told where it is opened
        return False
    return stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode)


def key_of(name: str) -> str:
    """A name as TOML writes it for a key, in quotes where it needs them.

    Args:
        name: of any characters.
    """
    return name if BARE.fullmatch(name) else _quoted(name)


def written(value: object) -> str:
    """A value as TOML writes it, tables in one line and numbers with all their digits.

    Args:
        value: a table, a list, a text, a number, or true or false.
    """
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key_of(key)} = {written(each)}" for key, each in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(written(each) for each in value) + "]"
    if isinstance(value, str):
        return _quoted(value)
    return repr(float(value)) if isinstance(value, float) else json.dumps(value)


def _quoted(text: str) -> str:
    """As in JSON, but that characters are not written as pairs of halves, and that DEL is."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
