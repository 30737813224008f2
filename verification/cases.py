"""All named cases; adding one is adding a file and a line here."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module

from meshes.errors import InputError
from verification.checks import Case

ALL_CASES = {
    "strips": "verification.strips",
    "shear_calibration": "verification.shear_calibration",
    "cone": "verification.cone",
    "appendix_b": "verification.appendix_b",
    "consistent": "verification.consistent",
    "convergence": "verification.convergence",
    "fig3_6": "verification.fig3_6",
    "fig3_8": "verification.fig3_8",
    "fig3_10": "verification.fig3_10",
    "derivatives": "verification.derivatives",
    "fig3_9": "verification.fig3_9",
    "fig3_11": "verification.fig3_11",
    "sheets_3": "verification.sheets_3",
    "fig5_5": "verification.fig5_5",
    "fig5_9": "verification.fig5_9",
    "fig5_10": "verification.fig5_10",
    "fig5_11": "verification.fig5_11",
    "fig5_3": "verification.fig5_3",
    "appendix_a": "verification.appendix_a",
    "pinch_shell": "verification.pinch_shell",
    "scan": "verification.scan",
    "hard_cases": "verification.hard_cases",
    "appendix_b_shell": "verification.appendix_b_shell",
    "appendix_b_cross": "verification.appendix_b_cross",
    "appendix_b_fields": "verification.appendix_b_fields",
    "appendix_b_sheets": "verification.appendix_b_sheets",
    "shell_benchmarks": "verification.shell_benchmarks",
    "tables4": "verification.tables4",
    "speed_error": "verification.speed_error",
    "honesty": "verification.honesty",
    "campaign": "verification.campaign",
}
# run only when named: minutes, not seconds; `records` keeps a run of each
LONG = {"campaign", "speed_error", "honesty", "fig3_8", "fig3_10"}
LONG_CASES = {name: module for name, module in ALL_CASES.items() if name in LONG}
CASES = {name: module for name, module in ALL_CASES.items() if name not in LONG}
# run with the case by `bh verify`
PARTS = {"appendix_b": ("appendix_b_shell", "appendix_b_cross", "appendix_b_fields", "appendix_b_sheets")}


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
