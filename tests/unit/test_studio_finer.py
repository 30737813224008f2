"""The finer mesh at rest: the same branch and nodes, an honest error, and it ends when it is told to."""

from __future__ import annotations

import json
import struct
from dataclasses import replace

import numpy as np
import pytest

import bh
from bh.studio.desk import Desk
from bh.studio.finer import finer
from bh.studio.messages import read
from bh.studio.sheets import of_library, of_model


def folded(name: str = "arc", percent: float = 30.0) -> Desk:
    desk = Desk(of_library(name))
    desk.take(read(json.dumps({"do": "percent", "value": percent})))
    desk.session.rest()
    desk.update()
    return desk


def always() -> bool:
    return True


def test_it_is_the_end_of_a_run_on_that_mesh() -> None:
    desk = folded(percent=10.0)
    found = finer(desk.sheet.model, desk.frame, always)
    assert found is not None
    assert found.state is not None
    assert len(found.state.mesh.triangles) > 3 * len(desk.session.mesh.triangles)
    model = replace(desk.sheet.model, mesh=found.state.mesh, supports=()).support("rigid-body")
    energy = bh.trace(model.fold("all", by=0.1 * np.pi))[-1].energy.total
    assert found.state.energy.total == pytest.approx(energy, rel=1e-8)
    # the error that is told is not smaller than that against a mesh twice as fine still
    assert found.error is not None
    assert 0.0 < found.error < 0.05
    finest = finer(
        replace(model, supports=desk.sheet.model.supports, mesh=desk.session.mesh), desk.frame, always, 5e-3
    )
    assert finest is not None
    assert finest.state is not None
    assert abs(found.state.energy.total / finest.state.energy.total - 1.0) < found.error


def test_a_pull_goes_over_to_the_nearest_node() -> None:
    desk = folded()
    node = int(np.argmax(desk.session.mesh.points[:, 0]))
    x, y, z = desk.frame.points[node].tolist()
    desk.session.pull(node, (x, y, z + 5.0))
    desk.session.rest()
    desk.update()
    found = finer(desk.sheet.model, desk.frame, always)
    assert found is not None
    assert found.state is not None
    far = np.linalg.norm(found.state.mesh.points - desk.session.mesh.points[node], axis=1)
    there = found.state.points[np.argmin(far)]
    assert far.min() < 1e-9
    assert np.linalg.norm(there - desk.frame.points[node]) < 0.5  # mm, of a pull by 5


def test_it_ends_when_somebody_asks_for_something() -> None:
    desk = folded()
    left = iter([True, True, False])
    assert desk.finer(lambda: next(left)) is None
    frame = desk.finer(always, 7)
    assert frame is not None
    (length,) = struct.unpack("<I", frame[:4])
    head = json.loads(frame[4 : 4 + length])
    assert head["heard"] == 7
    floats = np.frombuffer(frame[4 + length :], "<f4")
    assert len(floats) == 4 * len(head["mesh"]["points"]) // 3
    assert desk.finer(lambda: False) is not None  # what was found is kept
    desk.session.fold("all", 0.1)
    desk.work(0.0)
    assert desk.finer(always) is None  # not at rest


def test_what_cannot_be_refined_says_why() -> None:
    flat = Desk()
    found = finer(flat.sheet.model, flat.frame, always)
    assert found is not None
    assert found.reason == "the sheet is flat"
    model = of_library("arc").model
    given = replace(model.mesh, origin=None)
    for other, words in (
        (replace(model, mesh=given), "knows no finer one"),
        (
            replace(model, formulation="bars-and-hinges", sheet=replace(model.sheet, nu=0.0)),
            "not known to converge",
        ),
    ):
        desk = Desk(of_model(other))
        desk.session.fold("all", 0.5)
        desk.session.rest()
        desk.update()
        found = finer(desk.sheet.model, desk.frame, always)
        assert found is not None
        assert found.state is None
        assert words in found.reason


def test_panels_that_pass_through_each_other_are_counted() -> None:
    """Two wide panels beside a narrow one, both folded up, go through each other; at first they do not."""
    scene = of_library("strip", values={"length": 60.0, "width": 50.0, "creases": [22.0, 28.0]})
    mesh = scene.model.mesh
    model = replace(scene.model, mesh=replace(mesh, folds=dict.fromkeys(mesh.folds, "mountain")))
    desk = Desk(replace(scene, model=model))
    for percent, meets in ((20.0, False), (70.0, True)):
        desk.take(read(json.dumps({"do": "percent", "value": percent})))
        desk.session.rest()
        desk.update()
        frame = desk.finer(always)
        assert frame is not None
        (length,) = struct.unpack("<I", frame[:4])
        assert (json.loads(frame[4 : 4 + length])["meets"] > 0) == meets
