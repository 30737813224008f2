"""Checks of one's own sheets for pytest: converged energies, equal shapes, stable states; docs/testing.md.

The package is a pytest plugin, too (`bh.testing.plugin`). Nothing heavy is loaded before a check is used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bh.analysis.richardson import Convergence, Verdict
    from bh.testing.checks import (
        assert_converges,
        assert_energy_converges,
        assert_reached,
        assert_same_shape,
        assert_stable,
        assert_values_converge,
    )

_HOME = {
    "Convergence": "bh.analysis.richardson",
    "Verdict": "bh.analysis.richardson",
    "assert_converges": "bh.testing.checks",
    "assert_energy_converges": "bh.testing.checks",
    "assert_reached": "bh.testing.checks",
    "assert_same_shape": "bh.testing.checks",
    "assert_stable": "bh.testing.checks",
    "assert_values_converge": "bh.testing.checks",
}
__all__ = [
    "Convergence",
    "Verdict",
    "assert_converges",
    "assert_energy_converges",
    "assert_reached",
    "assert_same_shape",
    "assert_stable",
    "assert_values_converge",
]


def __getattr__(name: str) -> object:
    """A name of the table, loaded when it is first asked for."""
    if name not in _HOME:
        raise AttributeError(f"module 'bh.testing' has no attribute '{name}'")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])
