"""All named cases; adding one is adding a file and a line here."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module

from meshes.errors import InputError
from verification.checks import Case

CASES = {
    "strips": "verification.strips",
    "shear_calibration": "verification.shear_calibration",
    "cone": "verification.cone",
    "appendix_b": "verification.appendix_b",
    "consistent": "verification.consistent",
    "convergence": "verification.convergence",
    "derivatives": "verification.derivatives",
    "hard_cases": "verification.hard_cases",
    "appendix_b_shell": "verification.appendix_b_shell",
    "appendix_b_cross": "verification.appendix_b_cross",
    "appendix_b_fields": "verification.appendix_b_fields",
    "shell_benchmarks": "verification.shell_benchmarks",
}
LONG_CASES = {"campaign": "verification.campaign"}  # only when named: minutes, not seconds
# run with the case by `bh verify`
PARTS = {"appendix_b": ("appendix_b_shell", "appendix_b_cross", "appendix_b_fields")}
ALL_CASES = {**CASES, **LONG_CASES}


def case(name: str) -> Case:
    """The function of a named case.

    Raises:
        InputError: there is no such case; the message lists those there are.
    """
    if name not in ALL_CASES:
        raise InputError(f"there is no verification case '{name}'; use one of {', '.join(ALL_CASES)}")
    found: Case = import_module(ALL_CASES[name]).run
    return found


def with_parts(names: Sequence[str]) -> list[str]:
    """The names, each followed by the other parts of its study, each case once."""
    return list(dict.fromkeys(part for name in names for part in (name, *PARTS.get(name, ()))))
