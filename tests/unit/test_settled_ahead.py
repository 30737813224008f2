"""A sheet with contact whose branch leads nowhere snaps, and that is told; others end as they did."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
import pytest

import bh
from bh.solvers.outcome import Outcome
from bh.solvers.points import Increment, point
from bh.solvers.settled_ahead import snaps
from bh.solvers.system import Remembering
from bh.solvers.walk import Walk, walk
from verification.studies.solver.benchmark_systems import VonMisesTruss

LOST = bh.Automatic(arc=bh.ArcLength(most=1))  # which leads nowhere


class Hindered(VonMisesTruss):
    """The truss, with something that could stand in its way, and does not."""

    hindered, looking = True, 0.0

    @contextmanager
    def unhindered(self) -> Iterator[None]:
        yield

    def clear_ways(self, places: Sequence[object]) -> float:
        return len(places) - 1.0

    def reshaped(self, one: object, other: object) -> float:
        return 0.0

    def free_part(self, q: object, dq: object, lam: float, since: float | None = None) -> float:
        return 1.0

    def room(self, q: object, lam: float) -> float:
        return 1.0

    def harden(self, factor: float) -> None: ...


def walked(system: VonMisesTruss, strategy: bh.Automatic) -> list[Increment]:
    return list(walk(Walk(system, strategy, (point(system, np.zeros(1), 0.0),))))


def test_it_snaps_to_where_arc_length_would_have_led() -> None:
    found = walked(Hindered(), LOST)
    snaps = [item for item in found if "the sheet snaps where its branch leads nowhere" in item.note]
    assert len(snaps) == 1
    assert snaps[0].jumped
    assert snaps[0].stable
    assert any("arc length" in cut for cut in snaps[0].cuts)  # why it was let fall
    end, other = found[-1], walked(VonMisesTruss(), bh.Automatic())[-1]
    assert end.outcome is Outcome.REACHED
    assert end.point.lam == 1.0
    assert end.point.q == pytest.approx(other.point.q, rel=1e-8)


def test_what_nothing_stands_in_the_way_of_ends_as_before() -> None:
    end = walked(VonMisesTruss(), LOST)[-1]
    assert end.outcome is not Outcome.REACHED


def test_a_strategy_that_stays_on_its_branch_does_not_fall() -> None:
    stays = bh.Automatic(arc=bh.ArcLength(most=1), at_bifurcation="primary")
    assert walked(Hindered(), stays)[-1].outcome is not Outcome.REACHED


class Yielding(Hindered):
    """Creases that yield: what it answers depends on the states before."""

    remembers, history = True, np.zeros((0, 2))

    def history_at(self, q: np.ndarray, lam: float) -> np.ndarray:
        return self.history

    def remember(self, history: np.ndarray) -> None: ...

    def takes(self, history: np.ndarray) -> bool:
        return True


def test_a_sheet_that_remembers_its_way_does_not_fall_from_a_state_before() -> None:
    """What creases have yielded on the way by arc length would be taken back to a state that had not seen it."""
    assert isinstance(Yielding(), Remembering)
    assert not snaps(Yielding())
    assert walked(Yielding(), LOST)[-1].outcome is not Outcome.REACHED
