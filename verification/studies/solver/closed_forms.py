"""Sheets that have a closed form: solved on several meshes by several formulations, the finest judged, all drawn."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from meshes.cells import Kind
from verification.framework.checks import CaseResult, Cost, line, plot

Levels = Mapping[str, Sequence[int]]
KINDS: Mapping[str, Kind] = {"consistent": "alternating", "shell": "mirrored"}  # of cells
LEVELS: Levels = {"consistent": (8, 16, 32), "shell": (8, 16)}  # cells along
LEAST = 1e-7  # %, of errors that are drawn


@dataclass(frozen=True)
class Problem:
    """A sheet and a figure of it; `found` by a formulation with a number of cells along the sheet."""

    name: str
    source: str
    unit: str
    exact: float
    found: Callable[[str, int], float]
    levels: Levels = field(default_factory=lambda: LEVELS)


def judge(
    result: CaseResult, case: str, problem: Problem, quick: bool, tolerances: tuple[float, float]
) -> None:
    """Values of all meshes, the finest of each formulation judged, and a plot of the errors.

    Args:
        result: gets checks and a plot.
        case: its name.
        problem: to solve.
        quick: leave out the finest meshes.
        tolerances: of the whole case and of its quick variant, relative.
    """
    series = []
    for formulation, cells in problem.levels.items():
        cells = cells[:-1] if quick else cells
        errors = []
        for along in cells:
            began = time.perf_counter()
            value = problem.found(formulation, along)
            result.check(
                problem.name,
                value,
                unit=problem.unit,
                reference=problem.exact,
                source=problem.source,
                tolerance=tolerances[int(quick)] if along == cells[-1] else None,
                params={"formulation": formulation, "along": along},
                path=Cost(wall_time_s=time.perf_counter() - began),
            )
            errors.append(max(100.0 * abs(value / problem.exact - 1.0), LEAST))
        series.append(line(formulation, [float(each) for each in cells], errors))
    about = f"{problem.name} against {problem.source}."
    name = f"{case}-" + "".join(c if c.isalnum() else "-" for c in problem.name)
    result.plots.append(plot(name, problem.name, "cells along", "error, %", series, about, log="xy"))
