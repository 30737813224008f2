"""A seeded hand handles sheets at random for some seconds: the long run is `python -m benchmarks.studio_dragging`."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.studio_dragging import Hand, own_imbalance
from bh.live import Session

ACTS = 20


def test_what_a_random_hand_is_shown_is_in_equilibrium() -> None:
    """Every frame by its own forces, states at rest by those of a system that knows the controls and nothing else."""
    hand = Hand(7)
    for _ in range(ACTS):
        hand.act()
    assert len(hand.gone) > 5
    assert hand.log.frames > 50
    assert hand.log.rests > 1
    assert (hand.log.off, hand.log.wrong) == (0, [])
    assert hand.log.worst < 1e-6


def test_a_state_that_is_not_one_of_equilibrium_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The hand sees a shape that is a hundredth of a millimetre off, at rest and under way."""
    hand = Hand(22)
    hand.desk.session.fold("all", 0.5)
    hand.desk.session.rest()
    hand.desk.update()
    assert own_imbalance(hand.desk.session.model, hand.desk.frame) < 1e-8
    points = hand.desk.frame.points.copy()
    points[np.argmax(points[:, 0])] += [0.0, 0.0, 0.01]
    monkeypatch.setattr(type(hand.desk.frame), "points", property(lambda _: points))
    monkeypatch.setattr(Session, "imbalance", lambda _: 1e-5)
    hand._rest()
    hand._frame()
    assert hand.log.off == 2
