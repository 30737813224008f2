"""Motions to rest of panels that press hard: barriers are harder on the way, and the model's own at the end."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import bh
from bh.mechanics.contact.barrier import SheetBarrier
from bh.scene.load import parse_scene
from bh.solvers.hardening import HARDEST, SOON, Hardening
from bh.solvers.settling import Settling
from tests.unit.test_contact_barrier import two_layers
from tests.unit.test_stops import SCENE, net
from verification.studies.solver.benchmark_systems import VonMisesTruss

GAP, APART = 0.1, 0.04


class Blocked:
    """All that is asked of a system by `Hardening`: something presses, with a given part of the reach left."""

    hindered, looking = True, 0.0
    unhindered = clear_ways = reshaped = free_part = print  # never asked

    def __init__(self, left: float) -> None:
        self.left, self.factors = left, [1.0]

    def room(self, q: np.ndarray, lam: float) -> float:
        return self.left

    def harden(self, factor: float) -> None:
        self.factors.append(factor)


def hardened(left: float, part: float) -> tuple[Hardening, Blocked]:
    """Behind steps of which a part was taken, with some of the reach left."""
    system = Blocked(left)
    harder = Hardening(system)  # type: ignore[arg-type]
    whole = np.array([0.0, 1.0])
    for _ in range(20 * SOON):
        harder.mind(whole, 1.0, whole, part * whole)
    return harder, system


@pytest.mark.parametrize(("left", "part"), [(0.5, 0.01), (0.001, 0.9)])
def test_barriers_stay_as_they_are_where_there_is_room_or_steps_are_long(left: float, part: float) -> None:
    harder, system = hardened(left, part)
    assert not harder.ease()
    harder.end()
    assert system.factors == [1.0]


def test_barriers_become_harder_and_then_the_models_own_again() -> None:
    harder, system = hardened(0.001, 0.01)
    up = list(system.factors)
    assert up == sorted(up)
    assert up[-1] == HARDEST
    while harder.ease():
        assert not harder.mind(np.ones(1), 1.0, np.ones(1), np.zeros(1))  # never up again
    down = system.factors[len(up) :]
    assert down == sorted(down, reverse=True)
    assert down[-1] == 1.0


def test_a_motion_that_is_given_up_leaves_the_models_barriers() -> None:
    harder, system = hardened(0.001, 0.01)
    harder.end()
    assert system.factors[-1] == 1.0


def test_between_two_steps_the_barriers_are_the_models() -> None:
    """A window looks at the sheet there, and would tell contact forces of a barrier that no model has."""
    harder, system = hardened(0.001, 0.01)
    with harder.own():
        assert system.factors[-1] == 1.0
    assert system.factors[-1] == HARDEST


def test_who_waits_for_a_step_of_a_motion_finds_the_models_barriers() -> None:
    """Barriers that are hard all the way: a motion gives its steps with the model's own, and goes on with hard ones."""
    harder, blocked = hardened(0.001, 0.01)
    motion = Settling()._steps(VonMisesTruss(), np.zeros(1), 0.1, harder)
    for _ in range(3):
        next(motion)
        assert blocked.factors[-1] == 1.0
    assert blocked.factors[-5:] == [1.0, HARDEST, 1.0, HARDEST, 1.0]


def test_a_harder_barrier_presses_so_many_times_as_much_and_knows_its_room() -> None:
    mesh, x = two_layers(APART)
    barrier = SheetBarrier(mesh, 0.0, GAP, 2.0)
    own, more, again = (np.zeros_like(x) for _ in range(3))
    energy = barrier.forces(x, own)
    assert energy > 0.0
    barrier.harden(30.0)
    assert barrier.forces(x, more) == pytest.approx(30.0 * energy, rel=1e-12)
    assert more == pytest.approx(30.0 * own, rel=1e-12)
    barrier.harden(1.0)
    assert barrier.forces(x, again) == energy
    assert barrier.room(x) == pytest.approx(APART / GAP, rel=1e-12)
    assert barrier.room(x + 1e3 * (x[:, 2:] > 0.5 * APART)) == 1.0


def test_panels_that_press_hard_come_to_rest(tmp_path: Path) -> None:
    """Without it 4,222 steps lead to the same rest: pairs have 0.3 % of the reach left, and steps are as short."""
    (tmp_path / "net.fold").write_text(json.dumps(net(3, 0)))
    text = SCENE.format(formulation="bars-and-hinges").replace("contact = false", 'contact = "thickness"')
    model = parse_scene(text, tmp_path).model
    path = bh.trace(model, strategy=Settling(most=400), warn=False, neighbours=False)
    assert path.reached, path.early_end
    assert path.stable
    assert sum(record.iterations for record in path.records) < 600
    assert path[-1].energy.total == pytest.approx(145.685513, rel=1e-6)  # of the long way
    # in balance with the model's own barrier, not one that is harder
    last, system = path.records[-1], bh.Path(path.model).system(0)
    assert path[-1].energy.contact > 0.0
    assert system.evaluate(last.q, last.lam).imbalance < 1e-6
