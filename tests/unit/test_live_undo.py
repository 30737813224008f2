"""Undo brings the state back that was there, also past snaps; sheets that are drawn folded begin so."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import bh
import meshes
from bh.live import Mark, Session
from bh.live.controls import Controls
from bh.live.history import MOST_BYTES, lightened
from bh.solvers.load_control import LoadControl
from bh.solvers.newton import Newton
from bh.studio.desk import Desk
from bh.studio.messages import read
from bh.studio.sheets import of_file

DATA = Path(__file__).resolve().parents[1] / "data"


def arch() -> tuple[Session, int, list[float]]:
    """A shallow arch between two supports, the node in its middle, and where that is flat."""
    strip = meshes.structured(meshes.strip(100.0, 20.0, [10.0]), along=20, rows=1)
    model = bh.Model(strip, bh.Sheet(E=4000.0, nu=0.0, t=1.0))
    model = model.support("edge:start", "xyz").support("edge:end", "xyz")
    node = int(np.flatnonzero(np.abs(strip.points[:, 0] - 50.0) < 3.0)[0])
    return Session(model), node, strip.points[node].tolist()


def test_undo_goes_back_over_a_snap_to_the_state_that_was_there() -> None:
    """To the last digit, and what was left is not left any more; redo brings the snapped one back."""
    sector = meshes.annulus_sector([60.0, 75.0], 15.0, 1.0, folds=["mountain", "valley"])
    model = bh.Model(meshes.structured(sector, along=6, rows=2), bh.Sheet(E=4000.0, nu=0.3, t=0.2))
    for crease in model.mesh.creases:
        model = model.crease(crease, Lstar=10.0)
    session = Session(
        model, LoadControl(newton=Newton(full=1, globalised=1))
    )  # it moves downhill, as in a snap
    shapes = [session.rest()]
    for angle in (0.2, 0.6):
        session.fold("all", angle)
        shapes.append(session.rest())
        assert shapes[-1].at_rest
    assert session.left
    for before in shapes[-2::-1]:
        assert session.undo()
        frame = session.update(0.0)  # it lies there: nothing is solved
        assert frame.at_rest
        np.testing.assert_array_equal(frame.points, before.points)
        assert frame.controls == before.controls
    assert not session.left
    for behind in shapes[1:]:
        assert session.redo()
        np.testing.assert_array_equal(session.update(0.0).points, behind.points)
    assert session.left
    session.fold("all", 0.5)  # and it goes on from there
    assert session.rest().at_rest
    assert session.imbalance() < 1e-6


def test_a_mark_of_another_state_is_gone_to_and_not_believed() -> None:
    """Unknowns that are no equilibrium of what was asked for are solved anew."""
    session, node, (x, y, _) = arch()
    session.pull(node, (x, y, 3.0), 2.0)
    there = session.rest()
    mark = session.mark()
    assert mark.q is not None
    session.go_back(Mark(mark.controls, mark.q + 0.1))
    np.testing.assert_allclose(session.rest().points, there.points, atol=1e-7)
    session.go_back(Mark(mark.controls, mark.q[:-1]))
    np.testing.assert_allclose(session.rest().points, there.points, atol=1e-7)


def test_states_that_are_kept_end_at_a_size() -> None:
    marks = [Mark(Controls({"a": float(k)}), np.zeros(MOST_BYTES // 80)) for k in range(50)]
    kept = lightened(marks, 40)
    assert [mark.controls.folds["a"] for mark in kept] == list(range(10, 50))
    assert sum(mark.q is not None for mark in kept) == 10
    assert all(mark.q is not None for mark in kept[-10:])


def test_a_sheet_that_is_drawn_folded_begins_so_and_ends_where_a_run_does() -> None:
    """Its sliders stand where its creases are; what they ask for is what its springs then have."""
    file = DATA / "rigid_miura.fold"
    desk = Desk(of_file(file.name, file.read_bytes()))
    session = desk.session
    frame = session.rest()
    assert frame.state.energy.total < 1e-12
    assert dict(frame.wanted.folds) == pytest.approx(frame.fold_angles(), abs=1e-5)
    assert max(frame.fold_angles().values()) > 1.5
    np.testing.assert_allclose(frame.points, session.mesh.points, atol=1e-3)
    for percent in (50.0, 24.0):  # on the way to the first, to the second
        desk.take(read(json.dumps({"do": "percent", "value": percent})))
        session.update(1e-9)
    frame = session.rest()
    path = bh.trace(session.scene(), warn=False)
    np.testing.assert_allclose(path[-1].points, frame.points, atol=1e-5)
    before = frame.points
    far = int(np.argmax(np.linalg.norm(before - before.mean(axis=0), axis=1)))
    at = (before[far] + [5.0, 0.0, 0.0]).tolist()
    desk.take(read(json.dumps({"do": "pull", "node": far, "to": at})))
    assert np.abs(session.rest().points - before).max() < 20.0
    desk.take(read(json.dumps({"do": "let-go"})))
    np.testing.assert_allclose(session.rest().points, before, atol=1e-5)


def test_a_window_takes_back_what_it_did_to_another_sheet() -> None:
    """A material, then another sheet: undo lays the first one again, in the state that was there."""
    desk = Desk()
    desk.take(read(json.dumps({"do": "percent", "value": 30.0})))
    before = desk.session.rest().points
    desk.take(read(json.dumps({"do": "pattern", "name": "strip"})))
    desk.session.rest()
    desk.take(read(json.dumps({"do": "undo"})))
    np.testing.assert_array_equal(desk.session.update(0.0).points, before)
    assert desk.session.update(0.0).at_rest
