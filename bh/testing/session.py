"""What the running test gives its checks: levels of a marker, the folder of solved levels, and where results go.

Outside pytest, or with the plugin switched off, there is none and the checks work all the same. Loads nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict


class Entry(TypedDict):
    """What one check has found, as plain data: a record with the keys of those of `bh verify`, and it in words."""

    record: dict[str, object]
    line: str


@dataclass(frozen=True)
class Running:
    """The test that is running.

    Attributes:
        name: of the test, as pytest has it.
        levels: of its marker, or None.
        cache: folder of solved levels, or None where none are kept.
        tell: takes an entry for the summary.
    """

    name: str
    levels: tuple[object, ...] | None
    cache: Path | None
    tell: Callable[[Entry], None]


_running: list[Running] = []


def running() -> Running | None:
    """The test that is running, where the plugin knows of one."""
    return _running[-1] if _running else None


def begin(test: Running) -> None:
    """A test begins."""
    _running.append(test)


def end() -> None:
    """The test has ended."""
    _running.clear()
