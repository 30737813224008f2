"""States that press and that no way of the path's own leads between: slips, told by their shapes."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import bh
from bh.solvers.hindrance import slipped
from bh.solvers.in_the_way import apart_in_shape
from bh.solvers.points import Point, point
from verification.studies.solver.benchmark_systems import VonMisesTruss
from verification.studies.solver.contact_scenes import drawn

Array = NDArray[np.float64]


class Pressed(VonMisesTruss):
    """A truss that something presses on, which stands in nobody's way."""

    hindered, presses, looking = True, True, 0.0

    def free_part(self, q: Array, dq: Array, lam: float) -> float:
        return 1.0

    def unhindered(self) -> AbstractContextManager[None]:
        return nullcontext()

    def clear_ways(self, places: Sequence[tuple[Array, float]]) -> float:
        return len(places) - 1.0

    def room(self, q: Array, lam: float) -> float:
        return 1.0

    def harden(self, factor: float) -> None: ...

    def pressing(self, q: Array, lam: float) -> bool:
        return self.presses

    def reshaped(self, one: tuple[Array, float], other: tuple[Array, float]) -> float:
        return float(np.abs(one[0] - other[0]).max())


def at(truss: VonMisesTruss, w: float) -> Point:
    return point(truss, np.array([w]), float(truss.load(w)))


def test_a_state_beyond_a_snap_is_a_slip_and_one_along_the_branch_is_none() -> None:
    truss = Pressed(force=0.2)
    here, along = at(truss, 0.02), at(truss, 0.15)
    beyond = at(truss, brentq(lambda w: float(truss.load(w)) - along.lam, 2.0, 2.6))
    assert slipped(truss, here, along) == ""
    assert "panels slip in a jump before lambda" in slipped(truss, here, beyond)
    truss.__class__.presses = False
    try:
        assert slipped(truss, here, beyond) == ""  # told by the work alone
    finally:
        truss.__class__.presses = True
    assert slipped(VonMisesTruss(force=0.2), here, beyond) == ""


def test_shapes_are_compared_without_rigid_motions_and_not_with_mirror_images() -> None:
    rng = np.random.default_rng(3)
    x = rng.uniform(-1.0, 1.0, (12, 3))
    turned = x @ Rotation.from_rotvec([0.3, -2.0, 1.0]).as_matrix().T + [5.0, -2.0, 1.0]
    assert apart_in_shape(x, turned) < 1e-12
    assert apart_in_shape(x, x * [1.0, 1.0, -1.0]) > 0.5
    moved = x.copy()
    moved[0] += 0.01
    assert 0.5 * 0.01 < apart_in_shape(x, moved) < np.sqrt(3.0) * 0.01


@pytest.mark.slow
def test_pleats_that_slip_end_where_finer_increments_end() -> None:
    """Scene 45 of the case `contact`: 0.9158 N mm, and 2.34 where a slip at lambda 0.98 is not seen."""
    path = bh.trace(drawn(45)[1])
    assert path.outcome == "reached"
    assert path[-1].energy.total == pytest.approx(0.91578, rel=1e-3)
