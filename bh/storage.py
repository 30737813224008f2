"""One file for a path: an SQLite data base, so that a state that is accepted is on disk, whole, whatever happens next.

Tables: `meta` (key, JSON value), `arrays` (name, dtype, shape, data) with the model, `states` with one row for each
accepted state (step, lambda, energies in N mm, unknowns and node positions as little-endian float64), `steps` with the
outcome of every finished step. Any SQLite reader opens it; a killed run leaves a file that is complete up to its
last state.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path as FilePath
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.describe import AnyArray
from bh.errors import InputError, PathFileError

Array = NDArray[np.float64]
SCHEMA = """
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE arrays (name TEXT PRIMARY KEY, dtype TEXT NOT NULL, shape TEXT NOT NULL, data BLOB NOT NULL);
CREATE TABLE states (
    id INTEGER PRIMARY KEY, step INTEGER NOT NULL, lambda REAL NOT NULL, iterations INTEGER NOT NULL,
    imbalance REAL NOT NULL, stable INTEGER, wall_time_s REAL NOT NULL, next_increment REAL NOT NULL,
    stretching REAL NOT NULL, bending REAL NOT NULL, folding REAL NOT NULL,
    note TEXT NOT NULL, cuts TEXT NOT NULL, unknowns BLOB NOT NULL, points BLOB NOT NULL);
CREATE TABLE steps (step INTEGER PRIMARY KEY, outcome TEXT NOT NULL, reason TEXT NOT NULL);
"""


class StateRow(NamedTuple):
    """One accepted state as it is stored; see the columns of `states`."""

    step: int
    lam: float
    iterations: int
    imbalance: float
    stable: bool | None
    wall_time_s: float
    next_increment: float
    energies: tuple[float, float, float]
    note: str
    cuts: tuple[str, ...]
    q: Array
    points: Array


class PathFile:
    """An open path file; every `add` is one transaction."""

    def __init__(self, file: FilePath, connection: sqlite3.Connection) -> None:
        self.file, self._db = file, connection

    @classmethod
    def create(
        cls, file: FilePath, meta: dict[str, Any], arrays: dict[str, AnyArray], replace: bool = True
    ) -> PathFile:
        """Begin a new file; an old one of that name is replaced once the new one has its model.

        Raises:
            PathFileError: the folder cannot be written, or the file exists and `replace` is False.
        """
        file = FilePath(file)
        if file.exists() and not replace:
            raise PathFileError(f"'{file}' exists; resume it, remove it or choose another name")
        draft = file.with_name(file.name + ".part")
        try:
            for old in (draft, _journal(draft)):
                old.unlink(missing_ok=True)
            db = _connect(draft)
            with db:
                db.executescript(SCHEMA)
                db.executemany(
                    "INSERT INTO meta VALUES (?, ?)", [(k, json.dumps(v)) for k, v in meta.items()]
                )
                db.executemany(
                    "INSERT INTO arrays VALUES (?, ?, ?, ?)",
                    [
                        (name, _little(a).dtype.str, json.dumps(a.shape), _little(a).tobytes())
                        for name, a in arrays.items()
                    ],
                )
            db.close()
            # the journal of a run that was killed must not be played back into the new file
            for journal in (_journal(draft), _journal(file)):
                journal.unlink(missing_ok=True)
            draft.replace(file)
            return cls(file, _connect(file))
        except (OSError, sqlite3.Error) as error:
            with suppress(OSError):
                draft.unlink(missing_ok=True)
            raise PathFileError(
                f"cannot write '{file}' ({error}); choose a folder that can be written"
            ) from error

    @classmethod
    def open(cls, file: FilePath) -> PathFile:
        """Open an existing file.

        Raises:
            PathFileError: there is none, or it is not a path file.
        """
        file = FilePath(file)
        if not file.is_file():
            raise PathFileError(f"there is no path file '{file}'; check the name")
        with reading(file):
            db = _connect(file)
            db.execute("SELECT count(*) FROM states").fetchone()
        return cls(file, db)

    def add(self, row: StateRow) -> None:
        """Append one accepted state; it is on disk when this returns."""
        stable = None if row.stable is None else int(row.stable)
        values = (
            row.step, row.lam, row.iterations, row.imbalance, stable, row.wall_time_s, row.next_increment,
            *row.energies, row.note, json.dumps(row.cuts), _little(row.q).tobytes(), _little(row.points).tobytes(),
        )  # fmt: skip
        with self._guard():
            self._db.execute(
                "INSERT INTO states (step, lambda, iterations, imbalance, stable, wall_time_s, next_increment,"
                " stretching, bending, folding, note, cuts, unknowns, points)"
                " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                values,
            )

    def finish_step(self, step: int, outcome: str, reason: str) -> None:
        with self._guard():
            self._db.execute("INSERT OR REPLACE INTO steps VALUES (?, ?, ?)", (step, outcome, reason))

    def forget_failed_steps(self) -> None:
        """Steps that did not reach their end are tried again when a run is resumed."""
        with self._guard():
            self._db.execute("DELETE FROM steps WHERE outcome != 'reached'")

    def meta(self) -> dict[str, Any]:
        return {key: json.loads(value) for key, value in self._db.execute("SELECT key, value FROM meta")}

    def arrays(self) -> dict[str, AnyArray]:
        rows = self._db.execute("SELECT name, dtype, shape, data FROM arrays")
        return {
            name: np.frombuffer(data, dtype).reshape(json.loads(shape)).copy()
            for name, dtype, shape, data in rows
        }

    def states(self) -> Iterator[StateRow]:
        rows = self._db.execute(
            "SELECT step, lambda, iterations, imbalance, stable, wall_time_s, next_increment, stretching, bending,"
            " folding, note, cuts, unknowns, points FROM states ORDER BY id"
        )
        for step, lam, its, imbalance, stable, wall, nxt, s, b, f, note, cuts, q, points in rows:
            yield StateRow(
                step, lam, its, imbalance, None if stable is None else bool(stable), wall, nxt, (s, b, f), note,
                tuple(json.loads(cuts)), np.frombuffer(q, "<f8").copy(),
                np.frombuffer(points, "<f8").reshape(-1, 3).copy(),
            )  # fmt: skip

    def steps(self) -> dict[int, tuple[str, str]]:
        rows = self._db.execute("SELECT step, outcome, reason FROM steps")
        return {step: (outcome, reason) for step, outcome, reason in rows}

    def close(self) -> None:
        with suppress(sqlite3.Error):  # takes the empty journal away; it is in nobody's way if that fails
            self._db.execute("PRAGMA journal_mode = DELETE")
        self._db.close()

    def _guard(self) -> _Transaction:
        return _Transaction(self._db, self.file)


class _Transaction:
    """A transaction whose failure is told in one line."""

    def __init__(self, db: sqlite3.Connection, file: FilePath) -> None:
        self.db, self.file = db, file

    def __enter__(self) -> None:
        self.db.__enter__()

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        try:
            self.db.__exit__(kind, error, trace)
        except sqlite3.Error as failed:
            raise PathFileError(f"cannot write '{self.file}' ({failed}); is the disk full?") from failed
        if isinstance(error, sqlite3.Error):
            raise PathFileError(f"cannot write '{self.file}' ({error}); is the disk full?") from error


@contextmanager
def reading(file: FilePath) -> Iterator[None]:
    """Damaged files are told in one line, whatever comes up while they are read."""
    try:
        yield
    except InputError as error:
        raise PathFileError(f"'{file}': {error}") from error
    except (sqlite3.Error, KeyError, TypeError, ValueError) as error:
        raise PathFileError(f"'{file}' is not a path file ({error}); give one that bh has written") from error


def _journal(file: FilePath) -> FilePath:
    return file.with_name(file.name + "-journal")


def _connect(file: FilePath) -> sqlite3.Connection:
    db = sqlite3.connect(file, timeout=10.0)
    # a rollback journal survives a killed process without waiting for the disk's own cache at every state
    db.execute("PRAGMA journal_mode = TRUNCATE")
    db.execute("PRAGMA synchronous = OFF")
    return db


def _little(array: AnyArray) -> AnyArray:
    kind = "<i8" if array.dtype.kind in "iu" else "<f8"
    return np.ascontiguousarray(array, dtype=kind)
