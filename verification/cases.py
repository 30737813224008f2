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
    "derivatives": "verification.derivatives",
    "hard_cases": "verification.hard_cases",
}
LONG_CASES = {"campaign": "verification.campaign"}  # only when named: minutes, not seconds


def case(name: str) -> Case:
    """The function of a named case.

    Raises:
        InputError: there is no such case; the message lists those there are.
    """
    every = {**CASES, **LONG_CASES}
    if name not in every:
        raise InputError(f"there is no verification case '{name}'; use one of {', '.join(every)}")
    found: Case = import_module(every[name]).run
    return found
