"""The points that are finished, on disk at once: an SQLite file beside the data set that a sweep is to become.

Tables: `meta` (key, JSON value) with the parameters and the provenance, `points` with one row for each finished point.
One transaction a task; a killed sweep leaves a file that is whole up to its last one. It is written ahead (WAL): a kill
of the program loses nothing, a power cut at most what the system had not written yet, and never the file.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TypedDict, cast

from bh.paths.stored import (
    check_file,
    check_tables,
    line,
    mapping,
    parsed,
    real,
    trusted,
    whole,
)
from bh.sweep.points import SweepError, Value
from bh.sweep.task import Finished

FORMAT = 1
SCHEMA = """
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE points (
    id INTEGER PRIMARY KEY, outcome TEXT NOT NULL, reason TEXT NOT NULL, measured TEXT NOT NULL,
    wall_time_s REAL NOT NULL, attempts INTEGER NOT NULL, worker TEXT NOT NULL);
"""


class Meta(TypedDict):
    """What a journal knows of its sweep.

    Attributes:
        identity: of task and points; SHA-256.
        names: of the parameters.
        values: of each parameter, see `Points`.
        grid: every combination of the values, or row by row.
        labels: unit, text and dimensions of parameters and values, by name.
        attributes: of the data set.
    """

    identity: str
    names: Sequence[str]
    values: Sequence[Sequence[Value]]
    grid: bool
    labels: dict[str, tuple[str, str, Sequence[str]]]
    attributes: dict[str, object]


class Journal:
    """An open journal; every `add` is one transaction."""

    def __init__(self, file: Path, connection: sqlite3.Connection) -> None:
        """Take over an open connection to a file."""
        self.file, self._db = file, connection

    @classmethod
    def create(cls, file: Path, meta: Meta) -> Journal:
        """Begin a new journal; an old one of that name is replaced.

        Args:
            file: its place.
            meta: what the sweep is of.

        Raises:
            SweepError: the folder cannot be written.
        """
        draft = file.with_name(file.name + ".part")  # a kill leaves no file, or one that can be gone on from
        db = None
        try:
            for old in (draft, *_logs(draft), file, *_logs(file)):
                old.unlink(missing_ok=True)
            db = sqlite3.connect(draft)
            with db:
                db.executescript(SCHEMA + f"PRAGMA user_version = {FORMAT};")
                db.executemany(
                    "INSERT INTO meta VALUES (?, ?)", [(k, json.dumps(v)) for k, v in meta.items()]
                )
            db.close()
            draft.replace(file)
            return cls(file, _connect(file))
        except (OSError, sqlite3.Error) as error:
            if db is not None:
                db.close()
            for left in (draft, *_logs(draft)):
                with suppress(OSError):
                    left.unlink(missing_ok=True)
            raise SweepError(f"cannot write '{file}' ({error}); choose another output with -o") from error

    @classmethod
    def open(cls, file: Path) -> Journal:
        """Open a journal.

        Raises:
            SweepError: there is none, or it is of another version.
        """
        if not file.is_file():
            raise SweepError(f"there is no journal '{file}' to go on from; run without --resume")
        check_file(file, SweepError)
        try:
            db = _connect(file)
            (version,) = db.execute("PRAGMA user_version").fetchone()
            if version == FORMAT:
                check_tables(db, SCHEMA, f"'{file}'", SweepError)
        except (sqlite3.Error, ValueError) as error:
            raise SweepError(f"'{file}' is not a journal of a sweep ({error})") from error
        if version != FORMAT:
            db.close()
            raise SweepError(
                f"'{file}' has format {version}, this version reads {FORMAT}; run the sweep anew"
            )
        return cls(file, db)

    @property
    def meta(self) -> Meta:
        """What was written when the sweep began."""
        try:
            found = {key: parsed(value) for key, value in self._db.execute("SELECT key, value FROM meta")}
        except (sqlite3.Error, ValueError) as error:
            raise SweepError(f"'{self.file}' is not a journal of a sweep ({error})") from error
        if not set(found) >= Meta.__required_keys__ or not isinstance(found["identity"], str):
            raise SweepError(f"'{self.file}' is not a journal of a sweep; run the sweep anew")
        return cast(Meta, found)

    def done(self) -> set[int]:
        """Indices of the finished points."""
        return {row[0] for row in self._db.execute("SELECT id FROM points")}

    def failed(self) -> int:
        """How many points have another outcome than "reached"."""
        (count,) = self._db.execute("SELECT count(*) FROM points WHERE outcome <> 'reached'").fetchone()
        return int(count)

    def add(self, found: Sequence[Finished]) -> None:
        """Write points, all of them or none.

        Raises:
            SweepError: the disk takes no more.
        """
        rows = [
            (p.number, p.outcome, p.reason, json.dumps(p.values), p.wall_time_s, p.attempts, p.worker)
            for p in found
        ]
        try:
            with self._db:
                self._db.executemany("INSERT OR REPLACE INTO points VALUES (?, ?, ?, ?, ?, ?, ?)", rows)
        except sqlite3.Error as error:
            raise SweepError(f"'{self.file}' takes no more points ({error}); what it has is kept") from error

    def __iter__(self) -> Iterator[Finished]:
        """Finished points in the order of the data set."""
        for i, outcome, reason, values, wall_time, attempts, worker in self._db.execute(
            "SELECT id, outcome, reason, measured, wall_time_s, attempts, worker FROM points ORDER BY id"
        ):
            try:
                yield Finished(
                    whole(i, "a point"),
                    line(outcome, "outcome"),
                    line(reason, "reason"),
                    dict(mapping(parsed(values), "measured")),
                    real(wall_time, "wall_time_s"),
                    whole(attempts, "attempts"),
                    line(worker, "worker"),
                )
            except ValueError as error:
                raise SweepError(f"'{self.file}' is not a journal of a sweep ({error})") from error

    def close(self) -> None:
        """Close the file."""
        self._db.close()


def _connect(file: Path) -> sqlite3.Connection:
    db = sqlite3.connect(file)
    trusted(db)
    # without waiting for the disk after each point (5 to 12 ms on a busy machine)
    db.execute("PRAGMA journal_mode = WAL")
    db.execute("PRAGMA synchronous = NORMAL")
    return db


def _logs(file: Path) -> list[Path]:
    return [file.with_name(file.name + end) for end in ("-journal", "-wal", "-shm")]
