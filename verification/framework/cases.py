"""All named cases.

Adding one is adding a file of that name with a function `run`, and a line here: the commands, the tests and the page
of its chapter in the report find it (docs/extending.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module

from meshes.errors import InputError
from verification.framework.checks import Case

LONGEST = (
    60.0  # s of processor time on a quiet core: a case of the report that takes more is long, whatever it is
)
ROOMS = {"3": "ch3", "4": "ch4", "5": "ch5", "6": "ch6", "A": "app_a", "B": "app_b", "solver": "solver"}


@dataclass(frozen=True)
class Study:
    """A case: the module of its name in the folder of its chapter (`ROOMS`).

    Attributes:
        chapter: key of `verification.framework.chapters.CHAPTERS`.
        long: over a minute of processor time (`LONGEST`): run only when named, and `records` keeps a run of it.
        part_of: the case with which `bh verify` runs it too.
        seconds: rough processor time of a run; where cases run side by side the longest begin first.
    """

    name: str
    chapter: str
    long: bool = False
    part_of: str | None = None
    seconds: float = 30.0

    @property
    def module(self) -> str:
        """Full name of the module that has its function `run`."""
        return f"verification.studies.{ROOMS[self.chapter]}.{self.name}"


STUDIES = (
    Study("strips", "3", seconds=2),
    Study("shear_calibration", "3", seconds=1),
    Study("cone", "3", seconds=6),
    Study("appendix_b", "B", seconds=3),
    Study("consistent", "solver", seconds=14),
    Study("convergence", "solver", seconds=38),
    Study("one_row", "solver", seconds=23),
    Study("fig3_6", "3", seconds=10),
    Study("fig3_8", "3", long=True),
    Study("fig3_10", "3", long=True),
    Study("derivatives", "solver", seconds=1),
    Study("fig3_9", "3", seconds=10),
    Study("fig3_11", "3", seconds=21),
    Study("sheets_3", "3", seconds=7),
    Study("fig5_5", "5", seconds=12),
    Study("fig5_9", "5", seconds=25),
    Study("fig5_10", "5", seconds=12),
    Study("fig5_11", "5", seconds=13),
    Study("fig5_3", "5", seconds=24),
    Study("appendix_a", "A", seconds=2),
    Study("pinch_shell", "5", seconds=28),
    Study("bend_twist", "5", long=True),
    Study("scan", "3", seconds=28),
    Study("hard_cases", "solver", seconds=38),
    Study("appendix_b_shell", "B", part_of="appendix_b", seconds=48),
    Study("appendix_b_cross", "B", part_of="appendix_b", seconds=15),
    Study("appendix_b_fields", "B", part_of="appendix_b", seconds=23),
    Study("appendix_b_sheets", "B", part_of="appendix_b", seconds=3),
    Study("shell_benchmarks", "solver", seconds=8),
    Study("curved_shells", "solver", seconds=11),
    Study("eigenvalues", "solver", seconds=14),
    Study("loads", "solver", seconds=18),
    Study("actuated", "solver", seconds=3),
    Study("real_sheets", "solver", seconds=3),
    Study("bifurcations", "solver", seconds=26),
    Study("published", "solver", seconds=57),
    Study("cones", "solver", long=True),
    Study("peers", "solver", seconds=6),
    Study("tables4", "4", seconds=1),
    Study("speed_error", "solver", long=True),
    Study("map", "solver", long=True),
    Study("defaults", "solver", long=True),
    Study("honesty", "solver", long=True),
    Study("campaign", "solver", long=True),
    Study("agreement", "solver", long=True),
    Study("attack", "solver", long=True),
    Study("branches", "solver", long=True),
    Study("contact", "solver", long=True),
    Study("drawings", "solver", long=True),
    Study("page_figures", "solver", long=True),
    Study("gradients", "solver", seconds=22),
    Study("top_down", "4", seconds=12),
    Study("bottom_up", "4", seconds=1),
    Study("three_point", "4", long=True),
    Study("bending_fit", "4", long=True),
    Study("corrugation_stiffness", "4", long=True),
    Study("forward", "6", seconds=18),
    Study("problem_a", "6", seconds=25),
    Study("problem_b", "6", seconds=38),
    Study("problem_c", "6", long=True),
    Study("two_models", "6", seconds=36),
    Study("landing", "6", long=True),
    Study("tolerances", "6", long=True),
    Study("designs", "6", long=True),
)
BY_NAME = {study.name: study for study in STUDIES}
ALL_CASES = tuple(BY_NAME)
LONG_CASES = tuple(study.name for study in STUDIES if study.long)
CASES = tuple(study.name for study in STUDIES if not study.long)


def case(name: str) -> Case:
    """The function of a named case.

    Raises:
        InputError: there is no such case; the message lists those there are.
    """
    if name not in BY_NAME:
        raise InputError(f"there is no verification case '{name}'; use one of {', '.join(ALL_CASES)}")
    found: Case = import_module(BY_NAME[name].module).run
    return found


def longest_first(names: Sequence[str]) -> list[str]:
    """The names in the order in which several processes are best given them: the longest is not begun last."""
    return sorted(names, key=lambda name: -BY_NAME[name].seconds)


def with_parts(names: Sequence[str]) -> list[str]:
    """The names, each followed by the other parts of its study, each case once."""
    parts = [part for name in names for part in (name, *(s.name for s in STUDIES if s.part_of == name))]
    return list(dict.fromkeys(parts))
