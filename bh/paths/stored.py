"""What a stored file may hold: counted before it is read, tables of the format alone, values of their types.

Path files and journals travel from hand to hand. A data base may hold views that never end, arrays whose sizes are not
those of their bytes, texts where numbers should be; compiled code takes what it is given. So all is looked at first.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bh.errors import InputError
from meshes.limits import check_limit

Array = NDArray[np.float64]
MEGABYTE = 2**20
FAR = 1e100  # mm, rad: no state has more, and its square is still a number
TEXT_MB = 64  # of JSON in one place
LINE = 100_000  # characters of a note or a reason


def check_file(file: Path, error: type[InputError]) -> None:
    """Refuse a file that is larger than its limit, what belongs to it counted.

    Args:
        file: a data base of SQLite or HDF5.
        error: the kind of error to raise.

    Raises:
        InputError: of the kind `error`.
    """
    own = [file, *(file.with_name(file.name + end) for end in ("-journal", "-wal"))]
    size = sum(place.stat().st_size for place in own if place.is_file())
    check_limit("stored_megabytes", size / MEGABYTE, f"'{file}'", error)


def trusted(db: sqlite3.Connection) -> None:
    """Nothing in the data base's own schema may call what is not plain SQL."""
    db.execute("PRAGMA trusted_schema = OFF")


def check_tables(db: sqlite3.Connection, schema: str, what: str, error: type[InputError]) -> None:
    """See that a data base has the tables of a schema, none else, and not too many rows.

    Args:
        db: open connection.
        schema: of the format: CREATE TABLE statements.
        what: the file, for messages.
        error: the kind of error to raise where there are too many rows.

    Raises:
        ValueError: it holds views, triggers or other tables.
        InputError: it holds more rows than the limit.
    """
    wanted = {_words(text) for text in schema.split(";")}
    found = db.execute("SELECT type, name, sql FROM sqlite_master LIMIT 100").fetchall()
    tables = []
    for kind, name, sql in found:
        if kind == "index" and sql is None:  # of a key
            continue
        if kind != "table" or _words(sql or "") not in wanted:
            raise ValueError(f"it holds a {kind} {str(name)[:40]!r} that is not of this format")
        tables.append(name)
    for name in tables:
        rows = db.execute(f"SELECT count(*) FROM {name}").fetchone()[0]
        check_limit("stored_rows", rows, what, error)


def _words(sql: str) -> str:
    return " ".join(sql.split())


def parsed(text: object, most: int = TEXT_MB * MEGABYTE) -> object:
    """What a text of JSON says, once it is seen that it is not too large or too deep.

    Args:
        text: that should be JSON.
        most: characters.

    Raises:
        ValueError: it is no text, no JSON, or holds too much.
    """
    if not isinstance(text, str):
        raise ValueError(f"a {type(text).__name__} where a text should be")
    if len(text) > most or sum(map(text.count, ",[{")) > most // 64:
        raise ValueError("a text of JSON that holds too much")
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("JSON in too many brackets") from None


def parsed_file(file: Path, most: int = TEXT_MB * MEGABYTE) -> object:
    """The same of a file.

    Args:
        file: of JSON.
        most: bytes.

    Raises:
        ValueError: as `parsed`.
        OSError: it cannot be read.
    """
    if file.exists() and not file.is_file():
        raise ValueError("it is no plain file")
    if file.stat().st_size > most:
        raise ValueError("a text of JSON that holds too much")
    return parsed(file.read_text(encoding="utf-8"), most)


def array(dtype: object, shape: object, data: object) -> NDArray[np.float64] | NDArray[np.int64]:
    """An array of the model, if its bytes are as many as its shape says.

    Args:
        dtype: "<f8" or "<i8".
        shape: JSON list of sizes.
        data: bytes.

    Returns:
        the array, of that shape.

    Raises:
        ValueError: they are not.
    """
    sizes = parsed(shape, 1000)
    if (
        dtype not in ("<f8", "<i8")
        or not isinstance(data, bytes)
        or not isinstance(sizes, list)
        or not 1 <= len(sizes) <= 4
        or not all(type(size) is int and size >= 0 for size in sizes)
        or 8 * math.prod(sizes) != len(data)
    ):
        raise ValueError("an array that is not of the size or type that is written beside it")
    found = np.frombuffer(data, str(dtype)).reshape(sizes)
    return found.copy() if dtype == "<i8" else found.astype(float)


def numbers(data: object, what: str) -> Array:
    """(n,) numbers stored as bytes.

    Args:
        data: little-endian float64.
        what: column, for the message.

    Raises:
        ValueError: they are none, or such as no state has.
    """
    if not isinstance(data, bytes):
        raise ValueError(f"{what} are no numbers")
    found = np.frombuffer(data, "<f8").copy()
    if not (np.abs(found) < FAR).all():
        raise ValueError(f"{what} are not finite")
    return found


def whole(value: object, what: str) -> int:
    """A whole number.

    Args:
        value: of a column.
        what: its name, for the message.

    Raises:
        ValueError: it is none.
    """
    if type(value) is not int:
        raise ValueError(f"{what} is no whole number")
    return value


def real(value: object, what: str, *, finite: bool = True) -> float:
    """A number.

    Args:
        value: of a column.
        what: its name, for the message.
        finite: infinity is none.

    Raises:
        ValueError: it is none.
    """
    if not isinstance(value, int | float) or math.isnan(value) or (finite and math.isinf(value)):
        raise ValueError(f"{what} is no finite number")
    return float(value)


def line(value: object, what: str) -> str:
    """A text of a few lines at the most.

    Args:
        value: of a column.
        what: its name, for the message.

    Raises:
        ValueError: it is none.
    """
    if not isinstance(value, str) or len(value) > LINE:
        raise ValueError(f"{what} is no text of at most {LINE:,} characters")
    return value


def lines(value: object, what: str) -> tuple[str, ...]:
    """A list of texts, stored as JSON.

    Args:
        value: of a column.
        what: its name, for the message.

    Returns:
        the texts.

    Raises:
        ValueError: it is none.
    """
    found = parsed(value, 100 * LINE)
    if not isinstance(found, list):
        raise ValueError(f"{what} is no list")
    return tuple(line(item, what) for item in found)


def mapping(value: object, what: str) -> Mapping[str, object]:
    """A table.

    Args:
        value: parsed JSON.
        what: its name, for the message.

    Raises:
        ValueError: it is none.
    """
    if not isinstance(value, dict):
        raise ValueError(f"{what} is no table")
    return value
