"""The pytest plugin: the marker `levels`, the cache of solved levels, the summary and the JSON file.

pytest loads it at every start where the package is installed, so it imports only the standard library and pytest.
"""

from __future__ import annotations

import json
from collections.abc import Generator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from bh.testing.session import Entry, Running, begin, end

if TYPE_CHECKING:
    from _pytest.terminal import TerminalReporter

PROPERTY = (
    "bh"  # of test reports: so entries also come from the workers of pytest-xdist, and stand in JUnit's XML
)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Two options, in a group of their own."""
    group = parser.getgroup("bh", "checks of folded sheets (bh.testing)")
    group.addoption("--bh-no-cache", action="store_true", help="solve every level anew, and keep none")
    group.addoption(
        "--bh-json", metavar="FILE", default=None, help="write what the checks have found to a JSON file"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Make the marker known."""
    config.addinivalue_line(
        "markers", "levels(1, 2, 4): levels of refinement of the checks of bh.testing in a test"
    )


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Tell the checks in a test which test they are in."""
    marker = item.get_closest_marker("levels")
    levels = None if marker is None else tuple(marker.args)
    begin(Running(item.nodeid, levels, _cache(item.config), lambda entry: _keep(item, entry)))
    try:
        return (yield)
    finally:
        end()


def _keep(item: pytest.Item, entry: Entry) -> None:
    item.user_properties.append((PROPERTY, json.dumps(entry)))


def _cache(config: pytest.Config) -> Path | None:
    """The folder of solved levels, which pytest makes; None where none are to be kept."""
    cache = getattr(config, "cache", None)  # the cache is a plugin, too, and can be switched off
    if cache is None or config.getoption("--bh-no-cache"):
        return None
    return Path(cache.mkdir("bh-levels"))


def pytest_terminal_summary(terminalreporter: TerminalReporter, config: pytest.Config) -> None:
    """A line a check, and the JSON file.

    Args:
        terminalreporter: has the reports of all tests.
        config: has the options.
    """
    entries = _entries(terminalreporter)
    if entries:
        terminalreporter.write_sep("=", "checks of folded sheets")
        for entry in entries:
            record = entry["record"]
            mark = "passed" if record["passed"] else "FAILED"
            terminalreporter.write_line(f"{mark} {record['case']}: {entry['line']}")
    file = config.getoption("--bh-json")
    if file is not None:
        records = {"checks": [entry["record"] for entry in entries]}
        text = json.dumps(records, indent=2, allow_nan=False) + "\n"
        Path(file).parent.mkdir(parents=True, exist_ok=True)
        Path(file).write_text(text, encoding="utf-8")
        terminalreporter.write_line(f"wrote {file}")


def _entries(reporter: TerminalReporter) -> list[Entry]:
    """The entries of all reports, each test's once, in the order in which they came."""
    found = []
    for reports in reporter.stats.values():
        for report in reports:
            if getattr(report, "when", None) == "call":
                found += [json.loads(value) for key, value in report.user_properties if key == PROPERTY]
    return sorted(found, key=lambda entry: str(entry["record"]["case"]))
