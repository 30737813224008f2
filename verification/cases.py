"""All named cases; adding one is adding a file and a line here."""

from __future__ import annotations

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
    "scan": "verification.scan",
    "hard_cases": "verification.hard_cases",
}
LONG_CASES = {"campaign": "verification.campaign"}  # only when named: minutes, not seconds
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
