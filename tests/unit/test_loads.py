"""Pressure, forces a length and an area, couples on edges, ground springs: derivatives, statics, files, scenes."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh import (
    AreaForce,
    Couple,
    EdgeMoment,
    GroundSpring,
    LineForce,
    Model,
    ModelError,
    Pressure,
    SceneError,
    Sheet,
)
from bh.formulations.protocols import SheetSystem
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.mechanics.shared import outside
from bh.model.serialise import describe, rebuild
from bh.scene.load import parse_scene
from bh.solvers.factor import Matrix
from bh.solvers.follower import FollowerMatrix, conservative
from verification.theory import loads as theory
from verification.theory.plates import CLAMPED_UNIFORM

Array = NDArray[np.float64]
ALL = ("consistent", "bars-and-hinges", "shell")
SLOPES = ("consistent", "shell")
SHEET = Sheet(E=100.0, nu=0.3, t=0.3)
EDGES = ("edge:start", "edge:end", "edge:inner", "edge:outer")


def strip(name: str, length: float = 20.0, width: float = 8.0, along: int = 6, sheet: Sheet = SHEET) -> Model:
    mesh = meshes.structured(meshes.strip(length, width, [0.5 * width], "flat"), along=along, rows=1)
    return Model(mesh, sheet, formulation=name)


def held(name: str) -> Model:
    model = strip(name)
    for edge in EDGES:
        model = model.support(edge, "xyz")
    return model


def hanging(name: str) -> Model:
    """Held at one edge, at a corner, and along a slanted direction."""
    model = strip(name).support("edge:start", "xyz").support("corner:inner-end", "z")
    return model.support("edge:outer", [(0.0, 0.6, 0.8)])


MODELS = {
    "held": lambda name: held(name).step(Pressure(0.5)),
    "free edges": lambda name: hanging(name).step(
        Pressure(0.5), LineForce("edge:end", (0.0, 0.1, 0.2)), AreaForce((0.0, 0.1, 0.2))
    ),
    "springs and a place that moves": lambda name: (
        strip(name)
        .support("edge:start", "xyz")
        .spring("all", per_area=(0.1, 0.2, 0.3))
        .step(Pressure(0.5, (0, 1, 2, 3, 9)), bh.Displace("corner:outer-end", "z", by=2.0))
    ),
    "couple": lambda name: (
        strip(name).support("edge:start", "xyz").support("edge:inner", "z").step(EdgeMoment("edge:end", 1.0))
    ),
}
CASES = [(what, name) for what in MODELS for name in ALL if what != "couple" or name in SLOPES]


def first_system(model: Model) -> SheetSystem:
    return formulation(model.formulation).system(model, load_steps(model)[0], None)


def whole(matrix: Matrix, dq: Array) -> Array:
    """A tangent times dq, with what is skew in it."""
    product = matrix @ dq
    return product + np.asarray(matrix.skew @ dq) if isinstance(matrix, FollowerMatrix) else product


@pytest.mark.parametrize(("what", "name"), CASES)
def test_derivatives(what: str, name: str) -> None:
    """Tangent, rates with lambda and, where there is a potential, forces are derivatives; limits 1e-6."""
    system = first_system(MODELS[what](name))
    rng, lam = np.random.default_rng(3), 0.6
    q = system.start() + rng.normal(size=system.size) * (0.05 if name == "shell" else 0.3)
    dq, h = rng.normal(size=system.size), 1e-6
    here = system.evaluate(q, lam)
    up, down = system.evaluate(q + h * dq, lam), system.evaluate(q - h * dq, lam)
    has_potential = what in ("held", "couple")
    assert conservative(system) is has_potential
    gained = (up.energy - down.energy) / (2.0 * h)
    assert (abs(gained / float(here.residual @ dq) - 1.0) < 1e-6) is has_potential
    change = (up.residual - down.residual) / (2.0 * h)
    matrix = system.tangent(q, lam, here.forces).matrix
    assert isinstance(matrix, FollowerMatrix) is not has_potential
    assert np.abs(whole(matrix, dq) - change).max() < 1e-6 * np.abs(change).max()
    more, less = system.evaluate(q, lam + 1e-5), system.evaluate(q, lam - 1e-5)
    assert system.power(q, lam) == pytest.approx((more.energy - less.energy) / 2e-5, rel=1e-6)
    rate = (more.residual - less.residual) / 2e-5
    assert np.abs(system.control_rate(q, lam) - rate).max() < 1e-6 * np.abs(rate).max()
    second = (system.power(q, lam + 1e-5) - system.power(q, lam - 1e-5)) / 2e-5
    assert system.control_stiffness(q, lam) == pytest.approx(second, rel=1e-6, abs=1e-9)
    if isinstance(matrix, FollowerMatrix):
        b = rng.normal(size=system.size)
        factor, _ = matrix.factorise_any()
        assert np.abs(whole(matrix, factor.solve(b)) - b).max() < 1e-8


def test_pressure_turns_with_the_sheet_and_knows_no_origin() -> None:
    rng = np.random.default_rng(5)
    corner, p = rng.normal(size=(7, 3, 3)), rng.normal(size=7)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    moved = corner @ turn.T + [5.0, -2.0, 1.0]
    assert np.allclose(outside.normals(moved), outside.normals(corner) @ turn.T)
    away = rng.normal(size=3)
    # the same way, seen from elsewhere; and a slab is its area times its height
    assert np.allclose(outside.swept(corner + away, moved + away), outside.swept(corner, moved))
    lifted = corner + np.array([0.0, 0.0, 2.0])
    assert np.allclose(outside.swept(corner, lifted), outside.normals(corner)[:, 2])
    blocks = outside.pressure_blocks(corner, p)
    assert np.allclose(blocks, blocks.transpose(0, 2, 1))


@pytest.mark.parametrize("name", ALL)
def test_what_acts_is_what_supports_carry(name: str) -> None:
    """Flat areas and lengths; the sheet hardly moves."""
    model = held(name)
    last = bh.trace(model.step(Pressure(1e-5)), estimate=False)[-1]
    assert last.reaction() == pytest.approx([0.0, 0.0, -1e-5 * 160.0], abs=1e-8)
    last = bh.trace(model.step(AreaForce((0.0, 0.0, 1e-5), range(6))), estimate=False)[-1]
    part = model.mesh.areas[:6].sum()
    assert last.reaction() == pytest.approx([0.0, 0.0, -1e-5 * part], abs=1e-8)
    clamped = strip(name).support("edge:start", "xyz").support("edge:end", "z")
    last = bh.trace(clamped.step(LineForce("edge:outer", (1e-4, 0.0, 1e-5))), estimate=False)[-1]
    assert last.reaction() == pytest.approx([-2e-3, 0.0, -2e-4], abs=1e-8)


@pytest.mark.parametrize("name", ALL)
def test_a_sheet_on_springs_sinks_by_its_load(name: str) -> None:
    """No support at all: w = q / k, energy of the springs q^2 A / (2 k), and nothing in the sheet."""
    model = strip(name).spring("all", per_area=(1e-3, 1e-3, 0.02)).step(AreaForce((0.0, 0.0, -0.01)))
    last = bh.trace(model, estimate=False)[-1]
    assert last.displacement()[:, 2] == pytest.approx(-0.5, rel=1e-9)
    assert last.energy.ground == pytest.approx(0.01**2 * 160.0 / (2.0 * 0.02), rel=1e-3)
    assert last.energy.total < 1e-3 * last.energy.ground
    assert np.abs(last.reactions).max() == 0.0


@pytest.mark.parametrize("name", SLOPES)
def test_a_couple_rolls_a_strip_into_an_arc(name: str) -> None:
    """kappa = m / D of a strip that bends as a beam (nu = 0), by a quarter turn: tip of the circle to 1 %."""
    length, sheet = 40.0, Sheet(E=1000.0, nu=0.0, t=0.2)
    D = sheet.E * sheet.t**3 / 12.0
    model = strip(name, length, 4.0, 20, sheet).support("edge:start", "xyz", clamp=True)
    angle = 0.5 * math.pi
    last = bh.trace(model.step(EdgeMoment("edge:end", D * angle / length)), estimate=False)[-1]
    tip = last.points[model.mesh.nodes("edge:end")].mean(axis=0)
    radius = length / angle
    assert tip[[0, 2]] == pytest.approx([radius, radius], abs=0.01 * length)
    assert last.energy.total == pytest.approx(0.5 * D * (angle / length) ** 2 * length * 4.0, rel=0.01)


def test_loads_stay_until_others_are_asked_for(tmp_path: Path) -> None:
    """And they are kept in the path's file, from which a run goes on; what ends early leaves what it had."""
    model = held("consistent").step(Pressure(2e-4), LineForce("crease:crease", (0.0, 0.0, 1e-3)))
    model = model.step(bh.Force("all", each=(0.0, 0.0, 1e-5)), until=bh.Until("energy", 2e-4))
    model = model.step(Pressure(0.0)).step(LineForce("crease:crease", (0.0, 0.0, 0.0)))
    steps = load_steps(model)
    assert steps[1].pressure is not None
    assert np.array_equal(steps[1].pressure.start, steps[1].pressure.end)
    assert steps[3].pressure is None
    assert np.allclose(steps[3].force.end, [0.0, 0.0, 1e-5])
    file = tmp_path / "path.bh"
    whole = bh.trace(replace(model, springs=(GroundSpring("all", each=(0.0, 0.0, 1e-4)),)), file=file)
    again = bh.Path.load(file)
    assert again.model.springs == whole.model.springs
    assert again.model.steps[0] == whole.model.steps[0]
    assert [again[i].lam for i in range(len(again))] == [whole[i].lam for i in range(len(whole))]
    assert again[-1].energy == whole[-1].energy
    assert again[-1].energy.ground > 0.0


def test_theory_knows_its_limits_and_published_digits() -> None:
    """Mattiasson (1981) for F L^2 / E I = 1, 5 and 10; beams of small load, without thrust, without tension."""
    for load, down, along in ((1.0, 0.30172, 0.05643), (5.0, 0.71379, 0.38763), (10.0, 0.81061, 0.55500)):
        assert theory.lifted_tip(load) == pytest.approx((1.0 - along, down), abs=1e-5)
    assert theory.blown_tip(1e-3)[1] == pytest.approx(1e-3 / 8.0, rel=1e-4)
    assert theory.beam_column(1e-3) == pytest.approx(5.0 / 384.0, rel=2e-3)
    assert theory.held_strip(0.1, 0.1) == pytest.approx(5.0 / 384.0 * 0.1, rel=1e-3)
    assert theory.beam_on_springs(1e-3) == pytest.approx(1e3, rel=1e-3)  # it sinks as a whole
    small, large = theory.clamped_plate((1e-3, 402.0), 0.316)
    assert small / (12e-3 * (1.0 - 0.316**2)) == pytest.approx(CLAMPED_UNIFORM, rel=1e-6)
    assert large == pytest.approx(1.8559, abs=1e-4)  # 2.5 % below Levy
    assert theory.rolled_tip(math.pi) == pytest.approx((0.0, 2.0 / math.pi), abs=1e-12)


SCENE = """
[pattern]
kind = "strip"
length = 20.0
width = 8.0
creases = [4.0]
fold = "flat"
[sheet]
E = 100.0
nu = 0.3
t = 0.3
[mesh]
along = 6
[[supports]]
at = "edge:start"
fix = "xyz"
[[springs]]
at = "edge:end"
{spring}
[[steps]]
{load}
"""


@pytest.mark.parametrize(("formulation", "along", "rows"), [("consistent", 24, 4), ("shell", 12, 2)])
def test_couple_about_an_axis(formulation: str, along: int, rows: int) -> None:
    """A clamped strip twists by M L / (G J) (1 - tanh(a L) / (a L)), a b = (24 (1 - nu))^(1/2) (Reissner 1952)."""
    kind: Any = "staggered" if formulation == "consistent" else "mirrored"
    mesh = meshes.structured(meshes.strip(60.0, 10.0), along=along, rows=rows, kind=kind)
    model = Model(mesh, Sheet(E=4000.0, nu=0.3, t=0.2), formulation=formulation)
    model = model.support("edge:start", "xyz", clamp=True)
    end = mesh.nodes("edge:end")
    y = mesh.points[end, 1] - 5.0
    state = bh.trace(model.step(Couple("edge:end", (1e-4, 0.0, 0.0))))[-1]
    twist = float(y @ state.displacement("edge:end")[:, 2] / (y @ y))
    a = math.sqrt(24.0 * 0.7) / 10.0 * 60.0
    held = 1.0 - math.tanh(a) / a
    assert twist == pytest.approx(1e-4 * 60.0 * held / (4000.0 / 2.6 * 10.0 * 0.2**3 / 3.0), rel=0.015)
    assert np.abs(state.reaction()).max() < 1e-8
    state = bh.trace(model.step(Couple("edge:end", (0.0, 0.0, 0.01))))[-1]
    aside = float(state.displacement("near:45,5")[:, 1].mean())
    assert aside == pytest.approx(0.01 * 45.0**2 / 2.0 / (4000.0 * 0.2 * 10.0**3 / 12.0), rel=0.02)
    with pytest.raises(ModelError, match="nodes of one line"):
        bh.trace(model.step(Couple("edge:end", (0.0, 1.0, 0.0))))


def test_couples_add_and_are_replaced() -> None:
    """Its forces have no resultant, whatever the nodes; another one at the place takes its turn, and files keep it."""
    mesh = meshes.structured(meshes.strip(30.0, 20.0), along=6, rows=4)
    nodes = [0, 3, 7, 11, 20]
    asked = Couple(nodes, ("2 N mm", -1.0, "0.5mJ"))
    assert asked.total == (2.0, -1.0, 0.5)
    model = Model(mesh, Sheet(E=4000.0, nu=0.3, t=0.2)).support("edge:start", "xyz", clamp=True).step(asked)
    model = model.step(Couple("edge:end", (0.0, 0.0, 3.0))).step(Couple(nodes, (0.0, 0.0, 0.0)))
    first, second, third = (step.force.end for step in load_steps(model))
    for force, moment in (
        (first, [2.0, -1.0, 0.5]),
        (second, [2.0, -1.0, 3.5]),
        (third, [0.0, 0.0, 3.0]),
    ):
        np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-12)
        np.testing.assert_allclose(np.cross(mesh.points, force).sum(axis=0), moment, atol=1e-12)
    assert rebuild(*describe(model)).steps == model.steps


def test_scenes() -> None:
    text = SCENE.format(
        spring="total = [0.1, 0.2, 0.3]",
        load='pressure = { p = "2kPa" }',
    )
    model = parse_scene(text).model
    assert model.springs == (GroundSpring("edge:end", total=(0.1, 0.2, 0.3)),)
    assert model.steps[0].actuations == (Pressure(0.002),)
    loads = """line_force = { at = "edge:end", per_length = ["1 N/m", 0.0, 0.0] }
area_force = { per_area = [0.0, 0.0, 0.1], triangles = [3, 1] }
edge_moment = { at = "edge:end", to = 0.5 }
couple = { at = "edge:end", total = ["2 N mm", 0.0, 0.0] }"""
    found = parse_scene(SCENE.format(spring="each = [0.1, 0.2, 0.3]", load=loads)).model.steps[0].actuations
    assert found == (
        LineForce("edge:end", (0.001, 0.0, 0.0)),
        AreaForce((0.0, 0.0, 0.1), (3, 1)),
        EdgeMoment("edge:end", 0.5),
        Couple("edge:end", (2.0, 0.0, 0.0)),
    )


@pytest.mark.parametrize(
    ("spring", "load", "words"),
    [
        ("", "pressure = { p = 1.0 }", ["springs[0]", "each, total and per_area"]),
        ("each = [1.0, -1.0, 0.0]", "pressure = { p = 1.0 }", ["springs[0].each", "0 or more"]),
        ("each = [1.0, 1.0, 0.0]", 'pressure = { p = "3mm" }', ["steps[0].pressure.p", "kPa"]),
        ("each = [1.0, 1.0, 1.0]", "pressure = { p = 1.0, triangles = [99] }", ["steps[0]", "from 0 to"]),
        (
            "each = [1.0, 1.0, 1.0]",
            'line_force = { at = "rim", per_length = [0, 0, 1] }',
            ["rim", "edge:end"],
        ),
        ("each = [1.0, 1.0, 1.0]", 'edge_moment = { at = "crease:crease", to = 1.0 }', ["inside the sheet"]),
        (
            "each = [1.0, 1.0, 1.0]",
            'couple = { at = "rim", total = [0, 0, 1] }',
            ["steps[0].couple.at", "rim"],
        ),
        ("each = [1.0, 1.0, 1.0]", 'couple = { at = "node:1", total = [0, 0, 1] }', ["one line"]),
        (
            "each = [1.0, 1.0, 1.0]",
            'couple = { at = "all", total = [0, "3mm", 1] }',
            ["couple.total", "N mm"],
        ),
        ("each = [0.0, 0.0, 0.0]", "pressure = { p = 1.0 }", ["rotation about y", "free"]),
    ],
)
def test_bad_scenes(spring: str, load: str, words: list[str]) -> None:
    with pytest.raises(SceneError) as error:
        parse_scene(SCENE.format(spring=spring, load=load))
    assert "\n" not in str(error.value)
    for word in words:
        assert word in str(error.value)


def test_refusals() -> None:
    bars, shell = (strip(name) for name in ("bars-and-hinges", "shell"))
    with pytest.raises(ModelError, match="no slope at an edge to turn"):
        bh.trace(bars.support("edge:start", "xyz").support("edge:end", "z").step(EdgeMoment("edge:end", 1.0)))
    for model in (strip("consistent"), shell):
        with pytest.raises(ModelError, match="nothing holds as a whole"):
            bh.trace(model.step(Pressure(1e-3)))
    clamped = strip("consistent").support("edge:start", "xyz", clamp=True)
    with pytest.raises(ModelError, match="edge that is clamped"):
        bh.trace(clamped.step(EdgeMoment("edge:start", 1e-3)))
    with pytest.raises(ModelError, match="not solved by halves"):
        bh.trace(held("consistent").step(Pressure(1e-3)), symmetry="x")
    with pytest.raises(ModelError, match="not finite"):
        Pressure(math.nan)
    with pytest.raises(ModelError, match="three numbers"):
        LineForce("edge:end", (1.0, 2.0))
