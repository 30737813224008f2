"""A hand at random: every frame is balanced, time is kept, and rest is where a run from flat ends."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import bh
import meshes
from bh.live import Frame, Session
from bh.live import session as live
from bh.live.march import March

CARD = bh.Sheet(E=4000.0, nu=0.3, t=0.2)
SAME = 1e-8  # of the sheet's size: how far rest may be from where `trace` ends
BALANCED = 1e-8  # imbalance of a state that is shown
MOVES = 24
STEP = 0.01  # s that an iteration takes by the clock of the test


def pleats(formulation: str = "consistent", contact: bool = True, lstar: float | None = None) -> bh.Model:
    sector = meshes.annulus_sector([60.0, 75.0], 15.0, 1.0, folds=["mountain", "valley"])
    mesh = meshes.structured(sector, along=6, rows=1 if "shell" in formulation else 2)
    model = bh.Model(mesh, CARD, formulation=formulation, contact="auto" if contact else False)
    for crease in mesh.creases if lstar else ():
        model = model.crease(crease, Lstar=lstar)
    return model


class Hand:
    """It folds, pulls, pinches and lets go as a seed says, in pieces of any length, and looks at every frame."""

    def __init__(self, session: Session, seed: int, ways: tuple[str, ...]) -> None:
        self.session, self.random, self.ways = session, np.random.default_rng(seed), ways

    def act(self) -> None:
        session, random = self.session, self.random
        way = str(random.choice(self.ways))
        points = session.rest().points if way == "pinch" else session.update(0.0).points
        size = float(np.ptp(session.mesh.points))
        if way == "fold":
            session.fold(str(random.choice([*session.creases, "all"])), float(random.uniform(0.2, 1.1)))
        elif way == "pull":
            node = int(random.integers(len(points)))
            x, y, z = (points[node] + random.normal(0.0, 0.01 * size, 3)).tolist()
            session.pull(node, (x, y, z))
        elif way == "pinch":
            session.let_go()
            a, b = (
                int(np.argmin(np.linalg.norm(session.mesh.points - at, axis=1)))
                for at in ([45, 0, 0], [90, 0, 0])
            )
            wide = float(np.linalg.norm(points[a] - points[b]))
            session.pinch(a, b, float(random.uniform(0.96, 1.0)) * wide)
        elif way == "let-go":
            session.let_go()
        elif way == "undo":
            session.undo()
        for _ in range(random.integers(0, 4)):
            budget = float(random.choice([0.0, 1e-9, 0.03, 0.2]))
            frame = session.update(budget)
            self.look(frame)
            assert frame.seconds <= (budget + 1.001 * STEP if budget else 0.0)

    def look(self, frame: Frame) -> None:
        assert self.session.imbalance() <= BALANCED
        assert frame.arrived == (frame.controls == frame.wanted and not frame.fading)
        assert not frame.at_rest or (frame.arrived and frame.state.stable)
        assert frame.looked or frame.state.stable is not True


class Clock:
    """Stands for `time` in the session: an iteration takes `STEP`, all else nothing."""

    def __init__(self) -> None:
        self.now = 0.0

    def perf_counter(self) -> float:
        return self.now


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """Iterations take the same time on every machine, so that a seed says all."""
    clock, advance = Clock(), March.advance

    def timed(march: March) -> bool:
        worked = advance(march)
        clock.now += STEP if worked else 0.0
        return worked

    monkeypatch.setattr(March, "advance", timed)
    monkeypatch.setattr(live, "time", clock)
    return clock


KINDS: dict[str, tuple[Callable[[], bh.Model], tuple[str, ...]]] = {
    "consistent": (lambda: pleats(contact=False), ("fold",)),
    "bars-and-hinges": (lambda: pleats("bars-and-hinges", contact=False), ("fold",)),
    "linear-shell": (lambda: pleats("linear-shell", contact=False), ("fold",)),
    "shell": (lambda: pleats("shell", contact=False), ("fold",)),
    "contact": (pleats, ("fold", "fold", "pull", "let-go")),
    "contact of bars": (lambda: pleats("bars-and-hinges"), ("fold", "fold", "pull", "let-go")),
    "pulls": (lambda: pleats(contact=False), ("fold", "pull", "pull", "let-go", "undo")),
    "pinch": (lambda: pleats(contact=False), ("pinch", "pinch", "undo")),
    "springs": (lambda: pleats(contact=False, lstar=10.0), ("fold", "pull", "undo")),
}


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("kind", KINDS)
def test_rest_is_where_a_run_from_flat_ends(kind: str, seed: int) -> None:
    """Whatever was asked on the way; a snap would be told, and there is none in these."""
    make, ways = KINDS[kind]
    session = Session(make())
    hand = Hand(session, seed, ways)
    session.fold("all", 0.5)  # through the flat sheet branches meet without a snap
    session.rest()
    for _ in range(MOVES if "shell" not in kind else MOVES // 3):
        hand.act()
    session.fold("all", 0.5 if session.wanted.jaws else 0.9)  # so that there is something to compare
    frame = session.rest()
    hand.look(frame)
    assert frame.at_rest, frame.note
    assert not session.left
    path = bh.trace(session.scene(), warn=False)
    size = float(np.ptp(session.mesh.points))
    np.testing.assert_allclose(frame.points, path[-1].points, atol=SAME * size)


def test_panels_that_touch_rest_where_a_run_ends() -> None:
    """Three panels close until the outer ones press on each other, in pieces of one iteration."""
    sector = meshes.annulus_sector([60.0, 75.0], 15.0, 0.6, folds=["mountain", "mountain"])
    model = bh.Model(meshes.structured(sector, along=5, rows=2), CARD, contact=2.0)
    for crease in model.mesh.creases:
        model = model.crease(crease, Lstar=10.0)
    session = Session(model)
    session.fold("all", 3.1)
    frame = session.update(1e-9)
    while not (frame.at_rest or frame.note):
        frame = session.update(1e-9)
        assert session.imbalance() <= BALANCED
    assert frame.at_rest
    assert frame.state.energy.contact > 0.0
    size = float(np.ptp(session.mesh.points))
    path = bh.trace(session.scene(), warn=False)
    np.testing.assert_allclose(frame.points, path[-1].points, atol=SAME * size)


@pytest.mark.parametrize("kind", ["consistent", "bars-and-hinges", "pulls", "springs"])
def test_undo_goes_back_through_what_was_at_rest(kind: str) -> None:
    """Step by step, to the same shapes, and forward again."""
    make, _ = KINDS[kind]
    session, random = Session(make()), np.random.default_rng(5)
    shapes = [session.rest().points]
    for k in range(6):
        session.fold(str(random.choice([*session.creases, "all"])), float(random.uniform(0.2, 1.1)))
        session.update(0.03)  # on its way, and then somewhere else
        session.fold("all", 0.3 + 0.1 * k)
        if kind == "pulls":
            x, y, z = shapes[-1][7].tolist()
            session.pull(7, (x, y, z + 0.2 * k))
        shapes.append(session.rest().points)
    size = float(np.ptp(session.mesh.points))
    for shape in shapes[-2:0:-1]:
        assert session.undo()
        np.testing.assert_allclose(session.rest().points, shape, atol=1e-7 * size)
    for shape in shapes[2:]:
        assert session.redo()
        np.testing.assert_allclose(session.rest().points, shape, atol=1e-7 * size)


def test_what_was_not_looked_at_is_not_told_to_be_at_rest(clock: Clock) -> None:
    """A slider's frame is there before stability is counted, by the next update where nothing else is wanted."""
    session = Session(pleats(contact=False))
    session.fold("all", 0.5)
    session.rest()
    session.fold("all", 0.52)
    began = clock.now
    frame = session.update(1.0)
    assert frame.arrived
    assert not frame.at_rest
    assert frame.state.stable is None
    assert clock.now - began <= 5.0 * STEP
    frame = session.update(1.0)
    assert frame.at_rest
    assert frame.state.stable is True


def test_an_unstable_state_is_left_when_it_is_looked_at() -> None:
    """A strut pressed beyond its load stays straight while it is not looked at; then it buckles, which is told."""
    strip = meshes.structured(meshes.strip(100.0, 20.0, [10.0]), along=20, rows=1)
    model = bh.Model(strip, bh.Sheet(E=4000.0, nu=0.0, t=1.0), contact=False)
    model = model.support("edge:start", "xyz").support("edge:end", "yz")
    session = Session(model)
    ends = np.flatnonzero(np.abs(strip.points[:, 0] - 100.0) < 1e-9).tolist()
    told = False
    for pressed in (0.0, 0.5, 1.0, 1.5, 2.0):
        for node in ends:
            x, y, z = strip.points[node].tolist()
            session.pull(node, (x - pressed, y, z), 500.0)
        frame = session.update(10.0)
        told = told or frame.snapped
        assert not frame.at_rest or frame.state.stable
    assert frame.arrived
    frame = session.rest()
    assert frame.at_rest
    assert frame.state.stable
    assert np.abs(frame.points[:, 2]).max() > 1.0
    assert told or frame.snapped
