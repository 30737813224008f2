"""Colours of the window: right values with units, offered where there are any, and computed only when chosen."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import bh
from bh.errors import InputError
from bh.formulations.state import State
from bh.formulations.stress import Resultants
from bh.studio.colours import COLOURS, at_nodes, offered, top_of
from bh.studio.desk import Desk
from bh.studio.messages import read
from bh.studio.sheets import of_library, of_model


def folded(**sheet: Any) -> Desk:
    """A strip folded by a third, of some sheet."""
    model = of_library("strip").model
    desk = Desk(of_model(replace(model, sheet=replace(model.sheet, **sheet))))
    desk.take(read('{"do": "percent", "value": 30}'))
    desk.session.rest()
    desk.update()
    return desk


def shown(desk: Desk, by: str) -> tuple[dict[str, Any], np.ndarray[Any, Any]]:
    desk.take(read(json.dumps({"do": "colour", "by": by})))
    assert desk.busy  # the same state has to be shown anew
    frame = desk.update()
    (length,) = struct.unpack("<I", frame[:4])
    values = np.frombuffer(frame[4 + length :], "<f4")[-len(desk.session.mesh.points) :]
    return json.loads(frame[4 : 4 + length]), values


def test_every_colour_that_is_offered_is_shown_with_its_scale() -> None:
    desk = folded(strength=50.0)
    assert desk.describe()["colours"] == {
        name: [each.label, each.unit] for name, each in offered(desk.frame.state).items()
    }
    assert set(offered(desk.frame.state)) == set(COLOURS)
    seen = {}
    for name in COLOURS:
        head, seen[name] = shown(desk, name)
        assert head["top"] == pytest.approx(top_of(seen[name]), rel=1e-5)
        assert head["top"] > 0.0, name
        assert seen[name].min() >= 0.0
    np.testing.assert_allclose(50.0 * seen["utilisation"], seen["stress"], rtol=1e-5)
    head, plain = shown(desk, "none")
    assert head["top"] == 0.0
    assert not plain.any()


def test_stresses_are_those_of_the_state() -> None:
    """A rolled sheet: curvature 1 / radius, faces strained by t / 2 radius, and its stress by hand."""
    state = folded(nu=0.0).frame.state
    sheet = state.stress().sheet
    zero = np.zeros((len(state.mesh.triangles), 3))
    curvature = np.tile([0.01, 0.0, 0.0], (len(zero), 1))
    roll = Resultants(sheet, zero, curvature, zero, curvature * sheet.bending_stiffness())
    bent = replace(state, recover=lambda: roll)
    np.testing.assert_allclose(COLOURS["curvature"].values(bent), 0.01)
    np.testing.assert_allclose(COLOURS["surface"].values(bent), 0.005 * sheet.t)
    np.testing.assert_allclose(COLOURS["stress"].values(bent), 0.005 * sheet.t * sheet.E)


def test_means_at_nodes_are_by_area() -> None:
    mesh = of_library("strip").model.mesh
    np.testing.assert_allclose(at_nodes(mesh, np.full(len(mesh.triangles), 3.0)), 3.0)
    one = np.zeros(len(mesh.triangles))
    one[0] = 1.0
    weights = at_nodes(mesh, one)
    assert set(np.flatnonzero(weights)) == set(mesh.triangles[0].tolist())
    node = mesh.triangles[0, 0]
    around = (mesh.triangles == node).any(axis=1)
    assert weights[node] == pytest.approx(mesh.areas[0] / mesh.areas[around].sum())


def test_what_a_sheet_has_not_is_not_offered() -> None:
    """No strength, no part of it; bars and hinges have no stress at all; a grain without strengths has none to show."""
    assert set(COLOURS) - set(offered(folded().frame.state)) == {"utilisation"}
    model = replace(of_library("strip").model, formulation="bars-and-hinges")
    bars = Desk(of_model(replace(model, sheet=replace(model.sheet, nu=0.0))))
    assert set(offered(bars.frame.state)) == {"bending", "stretching", "strain"}
    with pytest.raises(InputError, match="cannot be coloured by 'stress'; choose one of bending"):
        bars.take(read('{"do": "colour", "by": "stress"}'))
    grain = bh.Sheet.orthotropic(E1=4000.0, E2=2000.0, G12=900.0, nu12=0.3, grain=0.0, t=0.2)
    desk = Desk(of_model(replace(of_library("strip").model, sheet=grain)))
    assert "stress" not in offered(desk.frame.state)
    strong = replace(grain, strength=60.0, strength2=30.0)
    desk = Desk(of_model(replace(of_library("strip").model, sheet=strong)))
    assert offered(desk.frame.state)["stress"].label == "equivalent stress (Hill)"


def test_what_is_not_chosen_is_not_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = folded()
    asked = []
    monkeypatch.setattr(State, "stress", lambda self: asked.append(self))
    desk.take(read('{"do": "percent", "value": 31}'))
    desk.session.rest()
    desk.update()
    assert not asked


def test_another_sheet_keeps_the_colour_that_it_can_have() -> None:
    desk = folded()
    shown(desk, "curvature")
    desk.put(of_library("pleats"))
    assert desk.describe()["colour"] == "curvature"
    model = of_library("strip").model
    desk.put(of_model(replace(model, formulation="bars-and-hinges", sheet=replace(model.sheet, nu=0.0))))
    assert desk.describe()["colour"] == "bending"
