"""One file for a path: an SQLite data base, so that a state that is accepted is on disk, whole, whatever happens next.

Tables: `meta` (key, JSON value), `arrays` (name, dtype, shape, data) with the model, `states` with one row for each
accepted state (step, lambda, energies in N mm, unknowns and node positions as little-endian float64), `critical` with
the limit and bifurcation points that were passed, `history` with what creases that yield have been through (permanent
turn of every hinge and the sum of its changes, rad; one row for each state of a sheet that has some), `steps` with the
outcome of every finished step. Any SQLite reader opens it; a killed run leaves a file that is complete up to its last
state.
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

from bh.errors import InputError, PathFileError
from bh.model.serialise import AnyArray
from bh.paths.stored import (
    array,
    check_file,
    check_tables,
    line,
    lines,
    numbers,
    parsed,
    real,
    trusted,
    whole,
)

Array = NDArray[np.float64]
FORMAT = (
    3  # of the tables and of the model in them; raised with every change. Format 2 is that of version 0.1
)
MESSAGE = 600  # characters of what is said of a damaged file
SCHEMA = """
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE arrays (name TEXT PRIMARY KEY, dtype TEXT NOT NULL, shape TEXT NOT NULL, data BLOB NOT NULL);
CREATE TABLE states (
    id INTEGER PRIMARY KEY, step INTEGER NOT NULL, lambda REAL NOT NULL, iterations INTEGER NOT NULL,
    imbalance REAL NOT NULL, negative INTEGER, mode TEXT NOT NULL, jumped INTEGER NOT NULL,
    wall_time_s REAL NOT NULL, next_increment REAL NOT NULL,
    stretching REAL NOT NULL, bending REAL NOT NULL, folding REAL NOT NULL,
    note TEXT NOT NULL, cuts TEXT NOT NULL, unknowns BLOB NOT NULL, points BLOB NOT NULL);
CREATE TABLE critical (
    id INTEGER PRIMARY KEY, state INTEGER NOT NULL REFERENCES states (id), step INTEGER NOT NULL, kind TEXT NOT NULL,
    lambda REAL NOT NULL, error REAL NOT NULL, negative_before INTEGER NOT NULL, negative_behind INTEGER NOT NULL,
    unknowns BLOB NOT NULL, mode BLOB NOT NULL);
CREATE TABLE history (state INTEGER PRIMARY KEY REFERENCES states (id), turns BLOB NOT NULL);
CREATE TABLE steps (
    step INTEGER PRIMARY KEY, outcome TEXT NOT NULL, reason TEXT NOT NULL, iterations INTEGER NOT NULL);
"""


class CriticalRow(NamedTuple):
    """A limit or bifurcation point that was passed just before a state; see the columns of `critical`."""

    step: int
    kind: str
    lam: float
    error: float
    negative: tuple[int, int]
    q: Array
    mode: Array


class StateRow(NamedTuple):
    """One accepted state as it is stored; see the columns of `states`."""

    step: int
    lam: float
    iterations: int
    imbalance: float
    negative: int | None
    mode: str
    jumped: bool
    wall_time_s: float
    next_increment: float
    energies: tuple[float, float, float]
    note: str
    cuts: tuple[str, ...]
    q: Array
    points: Array
    critical: tuple[CriticalRow, ...] = ()
    history: Array | None = None


class PathFile:
    """An open path file; every `add` is one transaction."""

    def __init__(self, file: FilePath, connection: sqlite3.Connection) -> None:
        """Of an open connection; see `create` and `open`."""
        self.file, self._db = file, connection

    @classmethod
    def create(
        cls, file: FilePath, meta: dict[str, Any], arrays: dict[str, AnyArray], replace: bool = True
    ) -> PathFile:
        """Begin a new file; an old one of that name is replaced once the new one has its model.

        Args:
            file: place of the path file.
            meta: model and provenance, as plain data.
            arrays: of the model, by name.
            replace: take the place of an older file.

        Raises:
            PathFileError: the folder cannot be written, or the file exists and `replace` is False.
        """
        file = FilePath(file)
        if file.exists() and not replace:
            raise PathFileError(f"'{file}' exists; resume it, remove it or choose another name")
        draft = file.with_name(file.name + ".part")
        db = None
        try:
            for old in (draft, _journal(draft)):
                old.unlink(missing_ok=True)
            db = _connect(draft)
            with db:
                db.executescript(SCHEMA + f"PRAGMA user_version = {FORMAT};")
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
            if db is not None:
                db.close()
            for left in (draft, _journal(draft)):
                with suppress(OSError):
                    left.unlink(missing_ok=True)
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
        check_file(file, PathFileError)
        with reading(file):
            db = _connect(file)
            found = db.execute("PRAGMA user_version").fetchone()[0]
            if found == FORMAT:
                check_tables(db, SCHEMA, "it", PathFileError)
                db.execute("SELECT count(*) FROM states").fetchone()
        if found != FORMAT:
            db.close()
            raise PathFileError(
                f"'{file}' was written by another version (format {found}, this one reads {FORMAT}); make it anew "
                "from its scene: bh run SCENE, or bh.trace(model, file=...)"
            )
        return cls(file, db)

    def add(self, row: StateRow) -> None:
        """Append one accepted state; it is on disk when this returns."""
        values = (
            row.step, row.lam, row.iterations, row.imbalance, row.negative, row.mode, int(row.jumped),
            row.wall_time_s, row.next_increment, *row.energies, row.note, json.dumps(row.cuts),
            _little(row.q).tobytes(), _little(row.points).tobytes(),
        )  # fmt: skip
        with self._guard():
            state = self._db.execute(
                "INSERT INTO states (step, lambda, iterations, imbalance, negative, mode, jumped, wall_time_s,"
                " next_increment, stretching, bending, folding, note, cuts, unknowns, points)"
                " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                values,
            ).lastrowid
            if row.history is not None:
                self._db.execute("INSERT INTO history VALUES (?, ?)", (state, _little(row.history).tobytes()))
            self._db.executemany(
                "INSERT INTO critical (state, step, kind, lambda, error, negative_before, negative_behind, unknowns,"
                " mode) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                [
                    (
                        state,
                        c.step,
                        c.kind,
                        c.lam,
                        c.error,
                        *c.negative,
                        *(_little(a).tobytes() for a in (c.q, c.mode)),
                    )
                    for c in row.critical
                ],
            )

    def finish_step(self, step: int, outcome: str, reason: str, iterations: int) -> None:
        """Store how a step ended; `iterations` are those of an increment that failed.

        Args:
            step: number of the step, from 0.
            outcome: how it ended, a value of `bh.Outcome`.
            reason: in one line, empty where it is reached.
            iterations: of an increment that failed.
        """
        with self._guard():
            self._db.execute(
                "INSERT OR REPLACE INTO steps VALUES (?, ?, ?, ?)", (step, outcome, reason, iterations)
            )

    def forget_failed_steps(self) -> None:
        """Steps that did not reach their end are tried again when a run is resumed."""
        with self._guard():
            self._db.execute("DELETE FROM steps WHERE outcome != 'reached'")

    def meta(self) -> dict[str, Any]:
        """Model and provenance as plain data.

        Returns:
            plain data by key.
        """
        return {key: parsed(value) for key, value in self._db.execute("SELECT key, value FROM meta")}

    def note(self, key: str, value: Any) -> None:
        """Write a JSON value into `meta` in place of an older one.

        Args:
            key: of `meta`.
            value: plain data.

        Raises:
            PathFileError: the file cannot be written.
        """
        try:
            with self._db:
                self._db.execute("INSERT OR REPLACE INTO meta VALUES (?, ?)", (key, json.dumps(value)))
        except sqlite3.Error as error:
            raise PathFileError(f"cannot write '{self.file}' ({error}); is the disk full?") from error

    def arrays(self) -> dict[str, AnyArray]:
        """Arrays of the model by name.

        Returns:
            the arrays, of the shapes and types that were stored.
        """
        rows = self._db.execute("SELECT name, dtype, shape, data FROM arrays")
        return {line(name, "a name"): array(dtype, shape, data) for name, dtype, shape, data in rows}

    def states(self) -> Iterator[StateRow]:
        """All accepted states, in order."""
        critical, history = self._critical(), self._history()
        rows = self._db.execute(
            "SELECT id, step, lambda, iterations, imbalance, negative, mode, jumped, wall_time_s, next_increment,"
            " stretching, bending, folding, note, cuts, unknowns, points FROM states ORDER BY id"
        )
        for row, *values in rows:
            yield _state_row(values, tuple(critical.get(row, ())), history.get(row))

    def _history(self) -> dict[int, Array]:
        """What creases remember, by the row of the state; files of versions without creases that yield have none."""
        known = self._db.execute("SELECT count(*) FROM sqlite_master WHERE name = 'history'").fetchone()[0]
        rows = self._db.execute("SELECT state, turns FROM history") if known else ()
        return {state: numbers(turns, "turns").reshape(-1, 2) for state, turns in rows}

    def _critical(self) -> dict[int, list[CriticalRow]]:
        """Critical points by the row of the state that they were passed before."""
        found: dict[int, list[CriticalRow]] = {}
        rows = self._db.execute(
            "SELECT state, step, kind, lambda, error, negative_before, negative_behind, unknowns, mode FROM critical"
            " ORDER BY id"
        )
        for state, step, kind, lam, error, before, behind, q, mode in rows:
            row = CriticalRow(
                whole(step, "step"),
                line(kind, "kind"),
                real(lam, "lambda"),
                real(error, "error"),
                (whole(before, "negative_before"), whole(behind, "negative_behind")),
                numbers(q, "unknowns"),
                numbers(mode, "a mode"),
            )
            found.setdefault(state, []).append(row)
        return found

    def steps(self) -> dict[int, tuple[str, str, int]]:
        """Outcome, reason and lost iterations of every step that ended.

        Returns:
            outcome, reason and iterations by number of the step.
        """
        rows = self._db.execute("SELECT step, outcome, reason, iterations FROM steps")
        return {
            whole(step, "step"): (outcome, line(reason, "reason"), whole(iterations, "iterations"))
            for step, outcome, reason, iterations in rows
        }

    def close(self) -> None:
        """Close the file; nothing is lost if it is not done."""
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
    """Damaged files are told in one line, whatever comes up while they are read.

    Raises:
        PathFileError: the file is damaged.
    """
    try:
        with np.errstate(all="ignore"):  # of numbers that are refused in the end
            yield
    except InputError as error:
        raise PathFileError(f"'{file}': {_cut(str(error))}") from error
    except (
        sqlite3.Error,
        LookupError,
        TypeError,
        ValueError,
        AttributeError,
        ArithmeticError,
        RecursionError,
        MemoryError,
    ) as error:
        why = _cut(" ".join(str(error).split())) or type(error).__name__
        raise PathFileError(f"'{file}' is not a path file ({why}); give one that bh has written") from error


def _cut(text: str) -> str:
    """What is said of a file, whose names may be of any length."""
    return text if len(text) <= MESSAGE else f"{text[:MESSAGE]} ..."


def _journal(file: FilePath) -> FilePath:
    return file.with_name(file.name + "-journal")


def _connect(file: FilePath) -> sqlite3.Connection:
    db = sqlite3.connect(file, timeout=10.0)
    trusted(db)
    # a rollback journal survives a killed process without waiting for the disk's own cache at every state
    db.execute("PRAGMA journal_mode = TRUNCATE")
    db.execute("PRAGMA synchronous = OFF")
    return db


def _state_row(values: list[object], critical: tuple[CriticalRow, ...], history: Array | None) -> StateRow:
    """A row of `states`, its types looked at."""
    step, lam, its, imbalance, negative, mode, jumped, wall, nxt, s, b, f, note, cuts, q, points = values
    return StateRow(
        whole(step, "step"),
        real(lam, "lambda"),
        whole(its, "iterations"),
        real(imbalance, "imbalance", finite=False),
        None if negative is None else whole(negative, "negative"),
        line(mode, "mode"),
        bool(whole(jumped, "jumped")),
        real(wall, "wall_time_s"),
        real(nxt, "next_increment", finite=False),
        (real(s, "stretching"), real(b, "bending"), real(f, "folding")),
        line(note, "note"),
        lines(cuts, "cuts"),
        numbers(q, "unknowns"),
        numbers(points, "points").reshape(-1, 3),
        critical,
        history,
    )


def _little(array: AnyArray) -> AnyArray:
    kind = "<i8" if array.dtype.kind in "iu" else "<f8"
    return np.ascontiguousarray(array, dtype=kind)
