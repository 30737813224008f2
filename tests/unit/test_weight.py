"""The weight of sheets: sagging strips, the heavy elastica, sheets that hang, steps that switch it on and off."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh import Model, ModelError, Sheet, Until, Weight
from bh.loading.builder import LoadStepBuilder, load_steps
from bh.loading.load_step import StepEnd
from bh.model.serialise import describe, rebuild
from bh.scene.load import parse_scene
from meshes import SheetMesh
from verification.studies.solver import real_sheets
from verification.studies.solver.real_sheets import HEAVY as CARD
from verification.studies.solver.real_sheets import LINE
from verification.theory.heavy import elastica

Array = NDArray[np.float64]
NAMES = ("consistent", "shell")


def strip(length: float, width: float, along: int, rows: int = 2) -> SheetMesh:
    return meshes.structured(meshes.strip(length, width), along=along, rows=rows)


def last_of(path: bh.Path, step: int) -> bh.State:
    """The state at the end of a step."""
    return [state for state in path if state.step == step][-1]


def cantilever(length: float, along: int, name: str, rows: int = 2) -> Model:
    return real_sheets.cantilever(length, along, name, rows)


@pytest.mark.parametrize("name", NAMES)
def test_sagging_strip(name: str) -> None:
    """q L^4 / (8 D) at the end of a short strip, and the whole weight at its root."""
    length = 40.0
    path = bh.trace(cantilever(length, 40, name, 4).step(Weight()))
    last = path[-1]
    exact = LINE * length**4 / (8.0 * CARD.bending_stiffness())
    sag = -last.points[last.mesh.nodes("edge:end"), 2].mean()
    assert sag == pytest.approx(exact, rel=4e-3)
    assert last.reaction("edge:start")[2] == pytest.approx(LINE * length * 10.0, rel=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_energy_balance(name: str) -> None:
    """What the weight does on its way down is twice what a short strip stores."""
    last = bh.trace(cantilever(40.0, 20, name).step(Weight()))[-1]
    moved = (last.points - last.mesh.points)[last.mesh.triangles].mean(axis=1)[:, 2]
    work = -LINE * float(last.mesh.areas @ moved)
    # in the shell the deflection is quadratic in a triangle; its middle is not told
    assert last.energy.total == pytest.approx(0.5 * work, rel=1e-4 if name == "consistent" else 5e-3)


@pytest.mark.parametrize("name", NAMES)
def test_heavy_elastica(name: str) -> None:
    """A strip of card of 300 mm, which hangs down by more than half of its length."""
    length = 300.0
    x, y = elastica(LINE * length**3 / CARD.bending_stiffness())
    assert y < -0.3
    end = real_sheets.heavy_strip(name, 48)
    assert [end[0], end[2]] == pytest.approx([x, y], abs=2e-3)


@pytest.mark.parametrize("name", [*NAMES, "linear-shell"])
def test_hanging_sheet(name: str) -> None:
    """Gravity in the plane: the end goes down by rho g L^2 / (2 E)."""
    mesh = strip(40.0, 10.0, 8)
    model = Model(mesh, CARD, formulation=name).support("all", "z").support("edge:start", "x")
    model = model.support("corner:inner-start", "y").step(Weight(g=(9.81, 0.0, 0.0)))
    last = bh.trace(model)[-1]
    down = (last.points - mesh.points)[mesh.nodes("edge:end"), 0].mean()
    assert down == pytest.approx(9.81e-9 * 800.0 * 40.0**2 / (2.0 * CARD.E), rel=0.01)
    assert last.reaction("edge:start")[0] == pytest.approx(-LINE * 400.0, rel=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_switched_on_and_off(name: str) -> None:
    """It stays through a step that asks for something else, and the sheet is flat again without it."""
    model = cantilever(40.0, 10, name).step(Weight()).force("corner:outer-end", total=(0.0, 0.0, 1e-4))
    model = model.step(Weight(g=(0.0, 0.0, 0.0)), bh.Force("corner:outer-end", total=(0.0, 0.0, 0.0)))
    path = bh.trace(model)
    assert path.reached
    weight = LINE * 400.0
    up = [state.reaction("edge:start")[2] for state in (last_of(path, 0), last_of(path, 1))]
    assert up == pytest.approx([weight, weight - 1e-4], rel=1e-6)
    assert np.abs(path[-1].points - path[-1].mesh.points).max() < 1e-7


def test_beside_other_forces_when_a_step_ends_early() -> None:
    """Half of the weight and half of a force go on as they are."""
    model = cantilever(40.0, 4, "consistent")
    model = model.step(Weight(), bh.Force("edge:end", each=(0.0, 0.0, 0.2)))
    model = model.step(Weight(g=(0.0, 0.0, 0.0)))
    builder = LoadStepBuilder(model)
    first = builder.build(model.steps[0])
    points = model.mesh.points
    builder.end_early(first, StepEnd(0.5, points, np.full(len(model.mesh.topology.hinges), math.pi)))
    second = builder.build(model.steps[1])
    np.testing.assert_allclose(second.force.start, first.force.at(0.5), atol=1e-16)
    ends = model.mesh.nodes("edge:end")
    expected = np.zeros_like(points)
    expected[ends, 2] = 0.1
    np.testing.assert_allclose(second.force.end, expected, atol=1e-12)


def test_halves_and_the_folded_sheet() -> None:
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.6), along=8, rows=2)
    model = Model(mesh, Sheet(E=4000.0, t=0.127, density=1390.0)).support("edge:inner", "z")
    model = model.support("rigid-body").fold("crease", by=0.8).step(Weight())
    whole, half = bh.trace(model), bh.trace(model, symmetry="y")
    assert half[-1].energy.total == pytest.approx(whole[-1].energy.total, rel=1e-8)
    assert whole[-1].energy.total != pytest.approx(last_of(whole, 0).energy.total, rel=1e-6)


def test_what_cannot_be() -> None:
    mesh = strip(40.0, 10.0, 4)
    held = Model(mesh, Sheet(E=4000.0, t=0.1)).support("edge:start", clamp=True)
    with pytest.raises(ModelError, match="a weight needs a density"):
        load_steps(held.step(Weight()))
    with pytest.raises(ModelError, match="g = "):
        Weight(g=(0.0, -9.81))
    with pytest.raises(ModelError, match="density = -1"):
        Weight(density=-1.0)
    with pytest.raises(ModelError, match="not in equilibrium"):
        bh.trace(Model(mesh, CARD).step(Weight()))
    path = bh.trace(held.step(Weight(density=900.0)))
    with pytest.raises(ModelError, match="a weight depends on all nodes"):
        bh.node_sensitivities.of_nodes(path, [bh.sensitivities.Energy()])
    ended = held.step(Weight(density=900.0), until=Until("energy", 1e-9)).step(Weight(density=1.0))
    shell = Model(mesh, held.sheet, held.supports, ended.steps, formulation="shell")
    with pytest.raises(ModelError, match="weight or displacement that `until` ended"):
        bh.trace(shell)


def test_sensitivity_to_the_length_of_a_heavy_strip() -> None:
    def built(design: Any) -> Model:
        mesh = strip(float(design[0]), 10.0, 8, 1)
        return (
            Model(mesh, CARD)
            .support("edge:start", "xyz", clamp=False)
            .support("all", "y")
            .step(Weight(), bh.Displace("edge:end", "z", 0.0))
        )

    path = bh.trace(built([40.0]))
    found = bh.sensitivities.of(path, built, [40.0], [bh.sensitivities.Energy()])[0]
    low, high = (bh.trace(built([40.0 + h]))[-1].energy.total for h in (-0.01, 0.01))
    assert found.gradient[0] == pytest.approx((high - low) / 0.02, rel=1e-3)


SCENE = """
[pattern]
kind = "strip"
length = 40.0
width = 10.0
[mesh]
along = 8
[sheet]
material = "card-300"
[[supports]]
at = "edge:start"
clamp = true
[[steps]]
weight = {weight}
"""


def test_scene_and_file() -> None:
    model = parse_scene(SCENE.format(weight="{ g = [0.0, 0.0, -1.62] }")).model
    assert model.steps[0].actuations == (Weight(g=(0.0, 0.0, -1.62)),)
    assert parse_scene(SCENE.format(weight="{}")).model.steps[0].actuations[0] == Weight()
    data, arrays = describe(model)
    assert rebuild(data, arrays).steps == model.steps
    with pytest.raises(bh.SceneError, match=r"weight\.g = "):
        parse_scene(SCENE.format(weight="{ g = 9.81 }"))


def test_bars_and_hinges_bear_the_same_weight() -> None:
    """The whole weight at the edges that hold a strip, half at each; the energy balance of a small sag."""
    mesh = strip(40.0, 10.0, 20)
    model = Model(mesh, CARD, formulation="bars-and-hinges").support("edge:start", "xyz")
    last = bh.trace(model.support("edge:end", "yz").step(Weight()))[-1]
    whole = LINE * 400.0
    for edge in ("edge:start", "edge:end"):
        assert last.reaction(edge)[2] == pytest.approx(0.5 * whole, rel=1e-6)
    moved = (last.points - last.mesh.points)[last.mesh.triangles].mean(axis=1)[:, 2]
    assert last.energy.total == pytest.approx(-0.5 * LINE * float(last.mesh.areas @ moved), rel=1e-2)
