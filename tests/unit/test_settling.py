"""Nets that snap: motions to rest reach the minima that are there, never through a closed hinge; and on the clock."""

from __future__ import annotations

import inspect
import math

import numpy as np
import pytest

import bh
from bh.mechanics.shared.hinge_lock import ZONE
from bh.mechanics.shared.penetration import left_to_close
from bh.runtime.progress import Silent
from bh.scene.load import parse_scene
from bh.solvers.hinged import Hinged
from bh.solvers.outcome import Outcome
from bh.solvers.points import Increment, point
from bh.solvers.settling import NOTE, Settling
from bh.solvers.system import Hindered, Limited, Remembering
from bh.solvers.walk import Walk, walk
from tests.unit.test_newton import Arch
from verification.studies.solver.benchmark_systems import VonMisesTruss

NET = """
[pattern]
file = "miura.svg"
[sheet]
E = 4000.0
t = 0.1
[mesh]
kind = "drawn"
[model]
formulation = "bars-and-hinges"
strategy = "{strategy}"
[[steps]]
fold = {{ crease = "all", by = {by}, Lstar = 1.0 }}
"""


def walked(system: object, strategy: Settling, q: float = 0.0) -> list[Increment]:
    start = point(system, np.full(1, q), 0.0)  # type: ignore[arg-type]
    return list(walk(Walk(system, strategy, (start,))))  # type: ignore[arg-type]


def test_the_truss_snaps_to_the_state_below() -> None:
    truss = VonMisesTruss()
    found = walked(truss, Settling())
    end = found[-1]
    assert end.outcome is Outcome.REACHED
    assert end.point.lam == 1.0
    assert all(item.stable for item in found)
    jumps = [item for item in found if item.jumped]
    assert jumps
    assert all(item.note.startswith(NOTE) for item in jumps)
    assert truss.evaluate(end.point.q, 1.0).imbalance < 1e-8
    # the same state as by arc length over both limit points
    other = list(walk(Walk(truss, bh.Automatic(), (point(truss, np.zeros(1), 0.0),))))[-1]
    assert end.point.q == pytest.approx(other.point.q, rel=1e-8)


def test_a_jump_over_a_limit_point_is_told() -> None:
    """Newton's method alone would step from one well of the arch into the other without a word."""
    found = walked(Arch(2.0), Settling(), -1.0)
    assert found[-1].point.q == pytest.approx([1.52137971], rel=1e-7)  # q^3 - q = 2
    assert [item.jumped for item in found].count(True) == 1
    assert all(item.point.q < -Arch.limit or item.point.q > 1.0 for item in found)


def test_a_motion_that_does_not_end_is_told() -> None:
    end = walked(Arch(2.0), Settling(most=1), -1.0)[-1]
    assert end.outcome is Outcome.STALLED
    assert end.note == "not at rest after 1 steps downhill"
    assert end.cuts


@pytest.mark.parametrize("by", [0.6, 1.2])
def test_without_a_snap_both_strategies_agree(by: float) -> None:
    paths = []
    for strategy in ("automatic", "settling"):
        scene = parse_scene(NET.format(strategy=strategy, by=by), "tests/data")
        assert isinstance(scene.strategy, Settling) == (strategy == "settling")
        paths.append(bh.trace(scene.model, strategy=scene.strategy))
    one, two = paths
    assert one.reached
    assert two.reached
    assert two.stable
    assert two[-1].energy.total == pytest.approx(one[-1].energy.total, rel=1e-6)


def test_a_step_leaves_a_part_of_the_way_to_closed() -> None:
    before = np.array([math.pi, 0.5 * ZONE, 2.0 * math.pi - ZONE])
    assert left_to_close(
        before, np.array([math.pi, 0.25 * ZONE, 2.0 * math.pi - 0.9 * ZONE])
    ) == pytest.approx(0.5)
    assert left_to_close(before, np.array([0.1 * ZONE, ZONE, math.pi])) == pytest.approx(0.1)  # from far away
    assert left_to_close(before, np.array([1.0, 1.0, 1.0])) == 1.0


def test_the_clock_is_looked_at_within_an_increment() -> None:
    from bh.commands.fold import EVALUATION, TANGENT, TimeUpError, _Clock, _Timed

    limit = 3.5 * (EVALUATION + TANGENT)
    clock = _Clock(Silent(), limit, limit)
    timed = _Timed(Settling(), clock)
    assert timed.limits(VonMisesTruss()) == (0.1, 0.5)
    with pytest.raises(TimeUpError):
        walked(VonMisesTruss(), timed)  # type: ignore[arg-type]
    assert limit < clock.spent < limit + TANGENT + EVALUATION


def test_what_is_timed_has_the_abilities_of_its_system() -> None:
    """From Python 3.12 on `isinstance` of a protocol looks at the class, where `__getattr__` is not asked."""
    from bh.commands.fold import _Clock, _timed

    scene = parse_scene(NET.format(strategy="settling", by=0.6), "tests/data")
    system = bh.trace(scene.model, strategy=scene.strategy).system(0)
    timed = _timed(system, _Clock(Silent(), 1.0, 1.0))
    for ability in (Hinged, Remembering, Limited, Hindered):
        assert isinstance(system, ability)
        wanted = [name for name in vars(ability) if not name.startswith("_")]
        assert wanted
        assert all(inspect.getattr_static(timed, name) is not None for name in wanted)
    q = system.start()
    assert isinstance(timed, Hinged)
    assert timed.left_to_close(q, q, 0.0) == 1.0
