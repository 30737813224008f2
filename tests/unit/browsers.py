"""The browser of this machine for tests of pages: how it is started, and what goes without one."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from reports.pdf import browser

PROGRAM = browser()
needs_browser = pytest.mark.skipif(
    PROGRAM is None, reason="no chromium or chrome on this machine; .ci/run installs it"
)
# WebGL without a graphics card, which the whole page is then composed by, too, as if it were one
OPTIONS = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
PLAIN = ("--enable-unsafe-swiftshader",)  # as a browser does it that finds no card: only what is WebGL


@contextmanager
def opened(options: tuple[str, ...] = OPTIONS) -> Iterator[Any]:
    """A browser of playwright; the test is skipped where that is not installed."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    # root may start it only without its sandbox
    alone = ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []
    with api.sync_playwright() as driver:
        found = driver.chromium.launch(executable_path=PROGRAM, args=[*options, *alone])
        yield found
        found.close()
