"""Strips that an end couple bends to another arc, against their closed form: checks, order of convergence, plot."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.solvers.points import Increment
from verification.framework.checks import CaseResult, Context, Cost, line, plot
from verification.theory.shell_benchmarks import STRIP_LENGTH

Array = NDArray[np.float64]
Rolled = tuple[float, Array, Cost]  # energy, N mm, nodes (k, 3) of the end, mm, and what it took


def cost_of(increments: Sequence[Increment], seconds: float) -> Cost:
    """What a followed model took."""
    return Cost(
        unknowns=len(increments[-1].point.q),
        iterations=sum(increment.iterations for increment in increments),
        wall_time_s=seconds,
        outcome=increments[-1].outcome,
    )


@dataclass(frozen=True)
class RolledStrip:
    """How a benchmark is named in records and told of; `source` is of its closed form."""

    name: str
    words: str
    source: str
    plot: str

    def run(
        self,
        result: CaseResult,
        context: Context,
        solve: Callable[[int], Rolled],
        exact: tuple[float, float, float],
    ) -> None:
        """Solve it on finer and finer meshes.

        Args:
            result: that gets the checks and the plot.
            context: of the run.
            solve: solves it with a number of cells along the strip.
            exact: energy, N mm, and x and z of the tip, mm.
        """
        energy, x, z = exact
        sizes, errors = [], []
        for along in (12, 24) if context.quick else (12, 24, 48):
            context.tell(f"{result.name}: {self.words}, {along} cells")
            found, end, cost = solve(along)
            tip = end.mean(axis=0)
            off = math.hypot(tip[0] - x, tip[2] - z) / STRIP_LENGTH
            for quantity, value, unit, reference in (
                ("energy", found, "N mm", energy),
                ("distance of the tip from its place", off, "length", 0.0),
            ):
                result.check(
                    quantity,
                    value,
                    unit=unit,
                    reference=reference,
                    source=self.source,
                    tolerance=5e-4 if along >= 24 else None,
                    params={"benchmark": self.name, "along": along},
                    path=cost,
                )
            sizes.append(STRIP_LENGTH / along)
            errors.append(abs(found / energy - 1.0))
        result.check(
            "order of convergence of the energy",
            math.log2(errors[-2] / errors[-1]),
            unit="1",
            reference=4.0,
            source="quadratic positions, linear moments",
            tolerance=0.15,
            params={"benchmark": self.name},
        )
        result.plots.append(
            plot(
                self.plot,
                self.words.capitalize(),
                "mesh size",
                "error of the energy",
                [line("shell", sizes, errors, "points")],
                "Relative error against the closed form.",
                log="xy",
            )
        )
