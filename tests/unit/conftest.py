"""What tests of several files begin with."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.unit.browsers import opened
from tests.unit.fold_objects import Read, reader


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    """A browser for the tests of a file."""
    with opened() as found:
        yield found


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Of a server of `bh studio` for the tests of a file."""
    from tests.unit.studio_visits import served

    with served() as found:
        yield found


@pytest.fixture
def window(chromium: Any, address: str) -> Iterator[Any]:
    """A window of its own; see `Visit`."""
    from tests.unit.studio_visits import Visit

    found = Visit(chromium, address)
    yield found
    found.context.close()


@pytest.fixture
def read(tmp_path: Path) -> Read:
    """Reads a FOLD object."""
    return reader(tmp_path)
