"""A sheet under a hand: it rests where a run from flat ends, keeps its budget, says when it snaps, and goes back."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bh
import meshes
from bh.errors import ModelError
from bh.formulations.registry import formulation
from bh.live import Controls, Grip, Session
from bh.live.controls import CLOSED, Way
from bh.loading.builder import load_steps
from bh.solvers.load_control import LoadControl
from bh.solvers.newton import Newton

CARD = bh.Sheet(E=4000.0, nu=0.3, t=0.2)
angles = st.floats(-3.0, 3.0).map(lambda a: round(a, 6))


def pleats(rows: int = 2, formulation: str = "consistent") -> bh.Model:
    sector = meshes.annulus_sector([60.0, 75.0], 15.0, 1.0, folds=["mountain", "valley"])
    return bh.Model(meshes.structured(sector, along=10, rows=rows), CARD, formulation=formulation)


def corner(session: Session) -> int:
    return int(np.argmax(session.mesh.points[:, 0]))


@pytest.mark.parametrize("name", ["consistent", "bars-and-hinges"])
def test_at_rest_it_is_the_end_of_a_run_from_flat(name: str) -> None:
    """Thirty moves of two sliders, back and forth, and it is where `trace` goes directly."""
    session = Session(pleats(formulation=name))
    first, second = session.creases
    for k in range(30):
        session.fold(first, 0.8 * math.sin(0.1 * k))
        session.fold(second, 0.02 * k)
        session.update(0.02)
    frame = session.rest()
    assert frame.at_rest
    path = bh.trace(session.scene())
    size = float(np.ptp(session.mesh.points))
    np.testing.assert_allclose(frame.points, path[-1].points, atol=1e-8 * size)
    assert frame.state.energy.total == pytest.approx(path[-1].energy.total, rel=1e-8)


def test_springs_turn_their_rest_angles() -> None:
    """The fold angle stays behind the slider, as far as in a run."""
    model = pleats()
    for crease in model.mesh.creases:
        model = model.crease(crease, Lstar=10.0)
    session = Session(model)
    session.fold("all", 1.0)
    frame = session.rest()
    assert frame.at_rest
    assert all(0.05 < angle < 0.999 for angle in frame.fold_angles().values())
    np.testing.assert_allclose(frame.points, bh.trace(session.scene())[-1].points, atol=1e-6)


def test_a_pull_is_in_balance_and_fades_when_it_is_let_go() -> None:
    """The spring's force is what the supports give back; let go, the sheet is where it was."""
    session = Session(pleats())
    session.fold("all", 0.7)
    before = session.rest()
    node = corner(session)
    start = before.points[node]
    for k in range(1, 6):
        session.pull(node, (start[0], start[1], start[2] + 2.0 * k))
        frame = session.rest()
    assert frame.at_rest
    force = np.array(frame.forces[node])
    assert force[2] > 0.0
    np.testing.assert_allclose(frame.state.reactions.sum(axis=0), -force, atol=1e-7 * np.abs(force).max())
    np.testing.assert_allclose(frame.points, bh.trace(session.scene())[-1].points, atol=1e-6)
    session.let_go()
    assert not session.update(0.0).at_rest  # its force is still there, and fades
    pieces = 0
    while not (after := session.update(1e-9)).at_rest:  # one iteration at a time
        pieces += 1
    assert 0 < pieces < 60
    assert not after.forces
    np.testing.assert_allclose(after.points, before.points, atol=1e-6)


def test_a_node_that_is_caught_while_it_fades_keeps_no_force_that_is_not_told() -> None:
    """Let go and caught at once, what pulled before is gone at rest; let go again, the fading begins in balance."""
    session = Session(pleats())
    session.fold("all", 0.7)
    before = session.rest()
    node = corner(session)
    x, y, z = before.points[node].tolist()
    session.pull(node, (x, y, z + 10.0))
    session.rest()
    session.let_go()
    session.update(0.0)
    session.pull(node, (x, y, z - 5.0))
    frame = session.rest()
    assert frame.at_rest
    force = np.array(frame.forces[node])
    np.testing.assert_allclose(frame.state.reactions.sum(axis=0), -force, atol=1e-7 * np.abs(force).max())
    np.testing.assert_allclose(frame.points, bh.trace(session.scene())[-1].points, atol=1e-6)
    session.let_go()
    session.update(0.0)
    session.pull(node, (x, y, z + 3.0))
    session.update(0.0)
    session.let_go()  # of a grip, and of what is left of the one before
    assert not session.update(0.0).at_rest
    assert session.imbalance() < 1e-6
    np.testing.assert_allclose(session.rest().points, before.points, atol=1e-6)


def test_what_has_faded_out_does_not_come_back() -> None:
    """Asked again at rest, or led on by a slider, the sheet is pulled by nothing."""
    session = Session(pleats())
    session.fold("all", 0.7)
    before = session.rest()
    x, y, z = before.points[corner(session)].tolist()
    session.pull(corner(session), (x, y, z + 10.0))
    session.rest()
    session.let_go()
    session.rest()
    again = session.rest()
    assert again.at_rest
    np.testing.assert_allclose(again.points, before.points, atol=1e-6)
    session.pull(corner(session), (x, y, z + 10.0))
    session.rest()
    session.let_go()
    session.fold("all", 0.8)
    session.rest()
    session.fold("all", 0.9)
    while not (frame := session.update(1e-9)).at_rest:
        assert not frame.fading
        assert np.abs(frame.state.reactions.sum(axis=0)).max() < 1e-6


def test_a_pinch_presses_two_nodes_together_and_nothing_else_acts() -> None:
    """Both jaws press alike; the force is the slope of the energy over the gap; let go, the sheet is as before."""
    session = Session(pleats())
    session.fold("all", 0.8)
    before = session.rest()
    a, b = (
        int(np.argmin(np.linalg.norm(session.mesh.points - at, axis=1))) for at in ([45, 0, 0], [90, 0, 0])
    )
    wide = float(np.linalg.norm(before.points[a] - before.points[b]))
    session.pinch(a, b)
    assert session.rest().pinches()[session.wanted.jaws[0]] == pytest.approx(0.0, abs=1e-9)
    found = []
    for part in (0.90, 0.89, 0.88):
        session.pinch(a, b, part * wide)
        frame = session.rest()
        jaws = frame.wanted.jaws[0]
        one, two = (np.array(frame.forces[node]) for node in (a, b))
        assert np.linalg.norm(one + two) < 0.011 * np.linalg.norm(one)
        apart = float(np.linalg.norm(frame.points[a] - frame.points[b]))
        found.append((apart, frame.pinches()[jaws], frame.state.energy.total))
    (wider, _, low), (_, force, _), (nearer, _, high) = found
    assert force > 0.0
    assert force == pytest.approx((high - low) / (wider - nearer), rel=0.02)
    np.testing.assert_allclose(frame.points, bh.trace(session.scene())[-1].points, atol=1e-6)
    assert session.undo()
    assert session.rest().wanted.jaws
    session.let_go(a)
    assert not session.wanted.grips
    np.testing.assert_allclose(session.rest().points, before.points, atol=1e-5)


def test_who_is_pulled_is_pinched_no_more() -> None:
    session = Session(pleats())
    session.pinch(0, 5)
    session.pinch(5, 9)
    assert [(jaws.a, jaws.b) for jaws in session.wanted.jaws] == [(5, 9)]
    assert set(session.wanted.grips) == {5, 9}
    session.pull(9, (0.0, 0.0, 0.0))
    assert not session.wanted.jaws
    assert set(session.wanted.grips) == {9}


def test_who_is_pulled_and_then_pinched_goes_on_with_the_same_force() -> None:
    """A jaw has a stiffer spring: it begins with the force of the pull, and the pull asked anew with the jaw's."""
    session = Session(pleats())
    node = corner(session)
    session.fold("all", 0.4)
    session.rest()
    x, y, z = session.rest().points[node].tolist()
    session.pull(node, (x, y, z + 3.0))
    before = session.rest()
    size = float(np.linalg.norm(before.forces[node]))
    assert size > 1e-4
    session.pinch(node, 0, 0.98 * float(np.linalg.norm(before.points[node] - before.points[0])))
    began = session.update(1e-9)
    assert began.forces[node] == pytest.approx(before.forces[node], abs=1e-6 * size)
    for wanted in (session.wanted, before.wanted):
        session.let_go()
        session.ask(wanted)
        for _ in range(12):
            session.update(1e-9)
            assert session.imbalance() < 1e-8
        assert session.rest().at_rest


def test_it_works_in_pieces_and_every_piece_is_an_equilibrium() -> None:
    """Without time an update does nothing; little by little it arrives, and each frame is a balanced state."""
    session = Session(pleats())
    session.fold("all", 1.2)
    frame = session.update(0.0)
    assert not frame.at_rest
    assert frame.controls.folds[session.creases[0]] == 0.0
    seen = set()
    while not frame.at_rest:
        frame = session.update(1e-9)
        seen.add(frame.controls.folds[session.creases[0]])
        assert np.abs(frame.state.reactions).max() < 1e-6  # the three nodes in the middle hold nothing
    assert frame.controls == frame.wanted
    assert frame.controls.folds[session.creases[0]] == 1.2


def test_the_middle_holds_six_rigid_motions_and_nothing_else() -> None:
    """The folded energy is that of the free sheet."""
    free = bh.trace(pleats().support("rigid-body").fold("all", by=0.9))[-1].energy.total
    session = Session(pleats())
    session.fold("all", 0.9)
    assert session.rest().state.energy.total == pytest.approx(free, rel=1e-8)


def test_undo_and_redo_go_to_the_same_shapes() -> None:
    session = Session(pleats())
    flat = session.rest()
    session.fold("all", 0.5)
    once = session.rest()
    session.fold("all", 1.0)
    session.rest()
    assert session.undo()
    np.testing.assert_allclose(session.rest().points, once.points, atol=1e-7)
    assert session.undo()
    np.testing.assert_allclose(session.rest().points, flat.points, atol=1e-7)
    assert not session.undo()
    assert session.redo()
    np.testing.assert_allclose(session.rest().points, once.points, atol=1e-7)
    session.fold("all", 0.2)
    assert not session.redo()


def test_a_snap_is_told() -> None:
    """A shallow arch that is pushed through its middle leaves its branch; going on is told as a snap."""
    strip = meshes.structured(meshes.strip(100.0, 20.0, [10.0]), along=20, rows=1)
    model = bh.Model(strip, bh.Sheet(E=4000.0, nu=0.0, t=1.0))
    model = model.support("edge:start", "xyz").support("edge:end", "xyz")
    session = Session(model)
    ends = np.abs(strip.points[:, 0] - 50.0) < 3.0
    node = int(np.flatnonzero(ends)[0])
    stiff = 2.0
    told = []
    for z in (3.0, 6.0, 3.0, 0.0, -3.0, -6.0):
        x, y, _ = strip.points[node]
        session.pull(node, (float(x), float(y), z), stiff)
        frame = session.rest()
        told.append(frame.snapped)
        assert frame.at_rest
    assert frame.points[node, 2] < 0.0  # it followed to the other side


def test_where_a_branch_ends_it_moves_downhill_to_rest() -> None:
    """Newton's method is taken away: the motion alone arrives, at the shape of a run from flat, and tells the snap."""
    model = pleats()
    for crease in model.mesh.creases:
        model = model.crease(crease, Lstar=10.0)
    session = Session(model, LoadControl(newton=Newton(full=1, globalised=1)))
    session.fold("all", 0.6)
    frame = session.rest()
    assert frame.at_rest
    assert frame.snapped
    assert session.imbalance() < 1e-6
    np.testing.assert_allclose(frame.points, bh.trace(session.scene())[-1].points, atol=1e-4)


def test_what_cannot_be_asked_is_named() -> None:
    session = Session(pleats())
    asked: tuple[tuple[Callable[[], None], str], ...] = (
        (lambda: session.fold("no such", 0.1), "no crease 'no such'"),
        (lambda: session.fold("all", math.nan), "cannot be"),
        (lambda: session.pull(10_000, (0.0, 0.0, 0.0)), "no node 10000"),
        (lambda: session.pull(0, (0.0, math.inf, 0.0)), "three numbers"),
        (lambda: session.pinch(0, 10_000), "no node 10000"),
        *(
            (partial(ask, stiffness=stiffness), f"a stiffness of {stiffness}")
            for stiffness in (0.0, -1.0, math.inf, math.nan)
            for ask in (partial(session.pull, 0, (0.0, 0.0, 5.0)), partial(session.pinch, 0, 9))
        ),
        (lambda: session.pinch(3, 3), "lie at one point"),
        (lambda: session.pinch(0, 1, -1.0), "gap of -1"),
    )
    for ask, words in asked:
        with pytest.raises(ModelError, match=words):
            ask()
    assert session.update(0.0).at_rest
    session.fold("all", 99.0)
    assert all(angle == CLOSED for angle in session.wanted.folds.values())


@given(angles, angles, angles, angles)
@settings(max_examples=50, deadline=None)
def test_a_way_leads_through_what_is_wanted(a: float, b: float, c: float, d: float) -> None:
    """Lambda that finds it gives it back, whatever the two controls are; what is beside it is not found."""
    start, wanted = Controls({"one": a, "two": b}), Controls({"one": c, "two": d})
    way = Way.toward(start, wanted)
    lam = way.find(wanted)
    assert lam is not None
    np.testing.assert_allclose(way.at(lam).vector(), wanted.vector(), atol=1e-12)
    assert all(abs(angle) <= CLOSED + 1e-12 for angle in way.end.folds.values())
    if start != wanted:
        beside = Controls({"one": c + 0.1 * (d - b) + 0.05, "two": d - 0.1 * (c - a)})
        found = way.find(beside)
        assert found is None or np.allclose(way.at(found).vector(), beside.vector(), atol=1e-6)
    assert way.find(Controls({"one": c}, {3: Grip((0.0, 0.0, 0.0), 1.0)})) is None


def test_rates_of_a_pull_are_those_of_its_energy() -> None:
    """Residual, rate by lambda, power and its rate, against differences of the energy and of each other."""
    model = pleats()
    node = 5
    model = model.support([0, 1, 2], "xyz").step(bh.Pull(node, (1.0, -2.0, 7.0), 0.3, (60.0, 1.0, 2.0)))
    system = formulation("consistent").system(model, load_steps(model)[0], None)
    rng = np.random.default_rng(3)
    q = system.start() + 1e-2 * rng.standard_normal(system.size)
    v, lam, h = rng.standard_normal(system.size), 0.4, 1e-5

    def energy(dq: float, dl: float) -> float:
        return system.evaluate(q + dq * v, lam + dl).energy

    now = system.evaluate(q, lam)
    assert float(now.residual @ v) == pytest.approx((energy(h, 0.0) - energy(-h, 0.0)) / (2.0 * h), rel=1e-6)
    assert system.power(q, lam) == pytest.approx((energy(0.0, h) - energy(0.0, -h)) / (2.0 * h), rel=1e-6)
    rate = (system.evaluate(q, lam + h).residual - system.evaluate(q, lam - h).residual) / (2.0 * h)
    np.testing.assert_allclose(system.control_rate(q, lam), rate, atol=1e-6)
    second = (system.power(q, lam + h) - system.power(q, lam - h)) / (2.0 * h)
    assert system.control_stiffness(q, lam) == pytest.approx(second, rel=1e-5)


def test_a_pull_is_stored_with_its_path(tmp_path: object) -> None:
    model = pleats().support([0, 1, 2], "xyz").step(bh.Pull(40, (90.0, 5.0, 10.0), 1e-3))
    path = bh.trace(model)
    path.save(f"{tmp_path}/path.bh")
    read = bh.Path.load(f"{tmp_path}/path.bh")
    assert read.model.steps == model.steps
    np.testing.assert_array_equal(read[-1].points, path[-1].points)


def test_pulls_that_cannot_be_are_refused() -> None:
    with pytest.raises(ModelError, match="stiffness = 0"):
        bh.Pull(0, (0.0, 0.0, 0.0), 0.0)
    held = pleats().support([0, 1, 2], "xyz")
    with pytest.raises(ModelError, match="node 9999 is pulled"):
        bh.trace(held.step(bh.Pull(9999, (0.0, 0.0, 0.0), 1.0)))
    with pytest.raises(ModelError, match="pulled and held by a spring already"):
        bh.trace(held.step(bh.Pull(9, (0.0, 0.0, 0.0), 1.0), bh.Pull(9, (0.0, 0.0, 1.0), 1.0)))
