"""Memory that was freed goes back to the system."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from bh.runtime.memory import give_back


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only glibc keeps what was freed")
def test_holes_of_the_heap_are_given_back() -> None:
    """Many small arrays go, one of the last stays: without a trim the heap keeps nearly all of it."""
    psutil = pytest.importorskip("psutil")
    process = psutil.Process()
    give_back()
    kept = [np.ones(4000) for _ in range(4000)]  # 128 MB
    kept = [kept[-1]]
    before = process.memory_info().rss
    give_back()
    assert before - process.memory_info().rss > 60e6
    assert kept
