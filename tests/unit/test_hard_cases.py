"""Hard cases and a small seed of the random campaign; the whole of both runs through `bh verify`."""

from __future__ import annotations

import numpy as np
import pytest

from bh import ArcLength
from bh.solvers.points import point
from verification.framework.checks import CaseResult
from verification.studies.solver.benchmark_systems import VonMisesTruss
from verification.studies.solver.campaign import TEST_SCENES, play, scenes
from verification.studies.solver.hard_cases import STUDIES

# over ten seconds; `bh verify hard_cases` runs them, and test_hard_case_tools.py tries their parts
SLOW = {"assemblages", "fan", "random meshes", "two creases"}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if name in SLOW else []) for name in STUDIES]
)
def test_study(name: str) -> None:
    """Every judged figure of every study holds."""
    result = CaseResult("hard_cases", "", "", "")
    STUDIES[name](result)
    assert result.checks
    failed = [
        f"{check.quantity} {check.params}: {check.value} against {check.reference}"
        for check in result.checks
        if check.passed is False
    ]
    assert not failed


@pytest.mark.parametrize("index", range(TEST_SCENES))
def test_random_scene(index: int) -> None:
    """A few scenes of the campaign: the target is reached, on the branch that fine increments find."""
    result = play(scenes(TEST_SCENES)[index])
    assert result.outcome == "reached", result
    assert result.excess < 0.02


def test_truss_limit_is_the_maximum_of_the_exact_curve() -> None:
    truss = VonMisesTruss()
    w = np.linspace(0.0, 1.0, 100_001)
    assert truss.limit() == pytest.approx(truss.load(w).max(), rel=1e-9)


def test_limit_is_passed_backwards() -> None:
    """Behind the limit point lambda falls, and the states are counted as unstable until it rises again."""
    truss = VonMisesTruss(spring=0.05)
    found = list(ArcLength().follow(truss, [point(truss, np.zeros(2), 0.0)]))
    lam = np.array([item.point.lam for item in found])
    assert found[-1].outcome == "reached"
    assert lam[-1] == 1.0
    first = int(np.argmax(np.diff(lam) < 0.0))
    assert lam[: first + 1].max() <= truss.limit() + 1e-9
    assert found[first + 2].negative == 1
    assert found[-1].negative == 0
