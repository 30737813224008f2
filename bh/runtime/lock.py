"""One writer at a time: a lock that the system takes back from whoever is killed."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from bh.errors import PathFileError


@contextmanager
def only_writer(file: Path) -> Iterator[None]:
    """Hold a file, or what is in a folder, for writing; others may read.

    The lock is on an empty file beside it, ".NAME.lock" (or in the folder, ".lock"), that goes with the lock.

    Args:
        file: to be written; its folder is there.

    Raises:
        PathFileError: another process writes it, or the folder cannot be written to.
    """
    place = file / ".lock" if file.is_dir() else file.with_name(f".{file.name}.lock")
    handle = _taken(place, file)
    try:
        yield
    finally:
        with suppress(OSError):
            place.unlink()  # before it is let go, so that nobody waits at a file that has no name any more
        os.close(handle)
        with suppress(OSError):
            if sys.platform == "win32":  # an open file cannot be removed there
                place.unlink()


def _taken(place: Path, file: Path) -> int:
    while True:
        try:
            handle = os.open(place, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o644)
        except OSError as error:
            raise PathFileError(
                f"cannot write '{file}' ({error.strerror}); choose a folder that can be written"
            ) from error
        try:
            _lock(handle)
        except OSError as error:
            os.close(handle)
            raise PathFileError(
                f"'{file}' is being written by another process; wait until it has ended, or choose another place"
            ) from error
        with suppress(OSError):  # the holder before may have removed it in between
            if os.path.samestat(os.fstat(handle), place.stat()):
                return handle
        os.close(handle)


def _lock(handle: int) -> None:
    if sys.platform == "win32":
        import msvcrt

        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
