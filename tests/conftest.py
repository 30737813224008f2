"""How the tests are shared out: one worker more than cores, and what takes long first."""

from __future__ import annotations

import os

import pytest

# Their tests take seconds each. Begun last, one of them keeps a worker busy while the others have nothing left.
LONG = frozenset({"test_shell_convergence.py", "test_verification.py", "test_hard_cases.py", "test_sweep.py"})


def pytest_xdist_auto_num_workers() -> int:
    """What `-n auto` means: some tests wait for browsers and for other processes, and a core is free meanwhile."""
    return 1 + (os.cpu_count() or 1)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long files first; the order within a file stays."""
    items.sort(key=lambda item: item.path.name not in LONG)
