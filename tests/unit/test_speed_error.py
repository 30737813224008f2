"""The study of speed against error: who wins, how costs are measured, the truth, and the curve that is compared."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import meshes
from bh import trace
from bh.analysis.richardson import fitted
from verification.framework.checks import Context
from verification.framework.measuring import measure
from verification.framework.pareto import Trial, cheapest, front, rate
from verification.studies.solver import speed_error
from verification.studies.solver.speed_problems import PROBLEMS, curve

RACE = [
    Trial("coarse", "1", 1.0, 0.20),
    Trial("coarse", "2", 2.0, 0.01),  # crosses the truth here
    Trial("coarse", "3", 4.0, 0.08),
    Trial("fine", "1", 3.0, 0.05),
    Trial("fine", "2", 9.0, 0.004),
    Trial("failed", "1", 0.1, math.nan),
]


def test_front_has_what_nothing_beats() -> None:
    assert [(t.model, t.level) for t in front(RACE)] == [("coarse", "1"), ("coarse", "2"), ("fine", "2")]


def test_a_lucky_density_does_not_win() -> None:
    """`coarse` at level 2 is off by 1 % only because it crosses the truth: level 3 is worse again."""
    best = cheapest(RACE, 0.05)
    assert best is not None
    assert (best.model, best.level) == ("fine", "1")
    assert cheapest(RACE, 0.1) == RACE[1]
    assert cheapest(RACE, 1e-3) is None


def test_rate() -> None:
    sizes = [1.0, 0.5, 0.25, 0.1]
    assert rate(sizes, [3.0 * h**1.7 for h in sizes]) == pytest.approx(1.7)
    assert math.isnan(rate(sizes[:2], [1.0, 0.5]))


@pytest.mark.parametrize("order", [0.8, 2.0, 3.3])
def test_fit_on_any_sizes(order: float) -> None:
    sizes = [1.0, 0.6, 0.45, 0.3, 0.2]
    found = fitted([5.0 - 0.3 * h**order for h in sizes], sizes)
    assert found.value == pytest.approx(5.0, abs=2e-3 * 0.3)
    assert found.rate == pytest.approx(order, abs=0.05)
    assert abs(found.value - 5.0) < found.bar


def test_fit_makes_up_no_order() -> None:
    """Values that swing keep the finest one, with a bar as wide as they swing; three values are too few."""
    found = fitted([1.0, 1.04, 0.98, 1.01], [1.0, 0.5, 0.25, 0.125])
    assert (found.value, math.isnan(found.rate)) == (1.01, True)
    assert found.bar >= 0.06
    with pytest.raises(ValueError, match="four"):
        fitted([1.0, 2.0, 3.0], [3.0, 2.0, 1.0])


def test_measure_sees_memory() -> None:
    result, cost = measure(lambda: float(np.ones(4_000_000).sum()), quick=True)
    assert result == 4e6
    assert cost.repeats == 1
    assert cost.memory_mb > 30.0
    assert cost.wall_time_s > 0.0


def test_curve_of_the_shell_lies_on_its_quadratic_edges() -> None:
    """Nodes between two nodes of a coarse mesh are found on the curve, not on the chord."""
    problem = PROBLEMS[0]
    mesh = meshes.structured(problem.pattern, along=4, kind="mirrored")
    state = trace(problem.actuate(mesh, "shell"), strategy=problem.strategy("shell"))[-1]
    points = curve(state, 12)
    np.testing.assert_allclose(points[::3], state.crease_points("crease"), atol=1e-12)
    between = np.linalg.norm(points[1:-1] - 0.5 * (points[:-2] + points[2:]), axis=1)
    assert between.min() > 1e-3  # it bends everywhere


def test_case_keeps_runs_and_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A stopped case goes on with what is in its file; the file goes when the case has ended."""
    monkeypatch.setattr(speed_error, "PROBLEMS", PROBLEMS[:1])
    monkeypatch.setattr(speed_error, "TRUTH", (1.0, 1.5, 2.0, 3.0))
    monkeypatch.setattr(speed_error, "MEMBERS", (speed_error.MEMBERS[0], speed_error.MEMBERS[-1]))
    told: list[str] = []

    def stop(text: str) -> None:
        told.append(text)
        if len(told) == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        speed_error.run(Context(tmp_path, True, stop))
    kept = json.loads((tmp_path / speed_error.RUNS).read_text())
    assert len(kept) == 4  # who made it, the truth, two runs
    first = speed_error.run(Context(tmp_path, True, told.append))
    assert not (tmp_path / speed_error.RUNS).exists()
    assert told.count(told[0]) == told.count(told[1]) == 1
    energies = [c for c in first.checks if c.quantity == "relative error of the finest mesh, total energy"]
    assert [c.params["model"] for c in energies] == [m.name for m in speed_error.MEMBERS]
    assert energies[0].value < 0.05
    assert energies[1].value < 0.02
