"""The lock near closed hinges: its law, its place in energy, residual and tangent, and what it does to a path."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh import Fold, Force, Model, Sheet, trace
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.loading.load_step import crease_hinges, hinge_name
from bh.mechanics.bars_and_hinges.stiffness import bending_hinge_stiffness
from bh.mechanics.bars_and_hinges.system import BarsAndHingesSystem
from bh.mechanics.shared.hinge_lock import ZONE, lock_terms, until_closed
from bh.mechanics.shared.kinematics import dihedral_angles
from bh.model.sheet import ElementStiffness
from bh.model.step import Step
from bh.scene.load import parse_scene
from verification.studies.solver.derivatives import differences

Array = NDArray[np.float64]
TURN = 2.0 * math.pi
SHEET = Sheet(E=4000.0, t=0.2)
EDGES = (ZONE, TURN - ZONE)


def terms(phi: object, k: float = 1.0) -> tuple[Array, Array, Array]:
    """Energy, moment and stiffness at the angles `phi`."""
    angles = np.atleast_1d(np.asarray(phi, dtype=float))
    energy, moment, stiffness = lock_terms(angles, np.full(len(angles), k)).T
    return energy, moment, stiffness


# --------------------------------------------------------------------------------------- the law


def test_nothing_outside_the_zone() -> None:
    phi = np.concatenate((np.linspace(ZONE, TURN - ZONE, 1001), EDGES))
    assert not lock_terms(phi, np.ones(len(phi))).any()  # to the last digit


def test_moment_is_liu_and_paulinos() -> None:
    """Their enhanced law, M = k (phi_1 - phi_0) + (2 k phi_1 / pi) tan(pi (phi - phi_1) / (2 phi_1)) below phi_1."""
    k, phi = 3.0, np.linspace(0.01, 0.999, 50) * ZONE
    enhanced = 2.0 * k * ZONE / math.pi * np.tan(math.pi * (phi - ZONE) / (2.0 * ZONE))
    spring = k * (phi - ZONE)
    _, moment, stiffness = terms(phi, k)
    assert moment == pytest.approx(enhanced - spring, rel=1e-9)
    assert stiffness == pytest.approx(k / np.cos(math.pi * (phi - ZONE) / (2.0 * ZONE)) ** 2 - k, rel=1e-9)


@pytest.mark.parametrize("part", [0.02, 0.1, 0.5, 0.9, 0.99])
@pytest.mark.parametrize("side", [0, 1])
def test_moment_and_stiffness_are_derivatives(part: float, side: int) -> None:
    at = part * ZONE if side == 0 else TURN - part * ZONE
    h = 1e-3 * min(part, 1.0 - part) * ZONE
    energy, moment, stiffness = terms(at + h * np.array([-2.0, -1.0, 0.0, 1.0, 2.0]))
    weights = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12.0 * h)
    assert float(weights @ energy) == pytest.approx(float(moment[2]), rel=1e-6)
    assert float(weights @ moment) == pytest.approx(float(stiffness[2]), rel=1e-6)


def test_begins_smoothly() -> None:
    """Energy, moment and stiffness vanish at the zone's edge with the fourth, third and second power of the depth."""
    depth = ZONE * np.array([0.04, 0.02])
    for energy, moment, stiffness in (terms(ZONE - depth), terms(TURN - ZONE + depth)):
        for values, power in ((energy, 4), (moment, 3), (stiffness, 2)):
            assert values[0] / values[1] == pytest.approx(2.0**power, rel=0.01)
            assert values[1] != 0.0
    assert np.abs(np.array(terms(np.nextafter(ZONE, 0.0)))).max() < 1e-12


def test_grows_without_bound() -> None:
    closer = ZONE * 10.0 ** -np.arange(1.0, 9.0)
    energy, moment, stiffness = terms(closer)
    assert (moment[:-1] < 0.0).all()  # the derivative of the energy: it pushes open
    assert np.abs(moment[1:] / moment[:-1]) == pytest.approx(10.0, rel=0.35)  # ~ 1 / d
    assert np.diff(energy) == pytest.approx((2 * ZONE / math.pi) ** 2 * math.log(10.0), rel=0.25)  # ~ -ln d
    assert stiffness[-1] > 1e15
    mirrored = terms(TURN - ZONE * 0.3)
    assert mirrored[0] == pytest.approx(terms(ZONE * 0.3)[0], rel=1e-12)
    assert mirrored[1] == pytest.approx(-terms(ZONE * 0.3)[1], rel=1e-12)
    assert np.isfinite(lock_terms(np.array([0.0, TURN]), np.ones(2))).all()


# --------------------------------------------------------------------------------------- in a sheet


def flap(stiffness: float = 0.01, along: int = 4, **how: Any) -> Model:
    """A strip with a soft crease at rest flat, one panel of it clamped."""
    mesh = meshes.structured(meshes.strip(20.0, 10.0, [5.0]), along=along)
    model = Model(mesh, SHEET, **how, formulation="bars-and-hinges", contact=False).crease(
        "crease", stiffness=stiffness
    )
    return model.support("crease:crease", "xyz").support("edge:inner", "xyz")


def closing(force: float = 0.5, **how: Any) -> Model:
    """Dead forces turn the free panel down, then push it up against the clamped one and on."""
    return (
        flap(**how)
        .force("edge:outer", total=(0.0, 0.0, -force))
        .force("edge:outer", total=(0.0, -force, force))
    )


def mirrored(model: Model) -> Model:
    """The same with all forces turned to the other side of the sheet."""
    steps = tuple(
        Step(tuple(replace(f, total=(f.total[0], f.total[1], -f.total[2])) for f in step.actuations))  # type: ignore
        for step in model.steps
    )
    return replace(model, steps=steps)


def first_system(model: Model) -> BarsAndHingesSystem:
    system = formulation(model.formulation).system(model, load_steps(model)[0], None)
    assert isinstance(system, BarsAndHingesSystem)
    return system


def system_of(path: bh.Path, step: int) -> BarsAndHingesSystem:
    system = path.system(step)
    assert isinstance(system, BarsAndHingesSystem)
    return system


def bent_to(model: Model, angle: float) -> tuple[BarsAndHingesSystem, Array]:
    """The flap turned rigidly to a dihedral angle, and disturbed a little."""
    system = first_system(model)
    x = system.reference.copy()
    y = x[:, 1] - 5.0
    outer = y > 1e-9
    x[outer, 1], x[outer, 2] = 5.0 - y[outer] * math.cos(angle), -y[outer] * math.sin(angle)
    x += 1e-4 * np.random.default_rng(5).normal(size=x.shape)
    return system, system.displacements.components(x - system.reference)


@pytest.mark.parametrize("angle", [0.3, 0.5, 0.95, 1.05])
@pytest.mark.parametrize("other_way", [False, True])
def test_derivatives_of_the_system(angle: float, other_way: bool) -> None:
    """Residual = d energy, tangent = d residual, power = d energy / d lambda, through the zone and at its edge.

    The rest angle moves, too: the lock knows nothing of it.
    """
    model = flap().step(Fold("crease", rest=2.0), Force("edge:outer", total=(0.0, 0.0, -0.01)))
    phi = angle * ZONE
    system, q = bent_to(model, TURN - phi if other_way else phi)
    left = until_closed(dihedral_angles(system.positions(q, 0.4), system.elements.hinges))
    assert (left.min() < ZONE) == (angle < 1.0)
    errors = differences(system, q, 0.4, np.random.default_rng(1))
    errors.pop("control stiffness")
    assert max(errors.values()) < 1e-6, errors


def test_predicted_moments_hold_the_lock() -> None:
    """Halving the increment quarters the error of the predicted moments, in the zone as well."""
    system, q = bent_to(flap().force("edge:outer", total=(0.0, 0.0, -0.01)), 0.5 * ZONE)
    now = system.evaluate(q, 0.0)
    tangent = system.tangent(q, 0.0, now.forces)
    v = np.random.default_rng(4).normal(size=system.size)
    errors = [
        float(
            np.abs(tangent.predicted_forces(now.forces, h * v) - system.evaluate(q + h * v, 0.0).forces).max()
        )
        for h in (2e-5, 1e-5)
    ]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_stiffness_of_the_locks() -> None:
    """A soft crease takes the sheet's (Eq. 3.11), a stiff one its own; held creases have none, nor all if it is off."""
    model = flap(0.0001).force("edge:outer", total=(0.0, 0.0, -0.01))
    mesh = model.mesh
    lengths = np.linalg.norm(np.diff(mesh.points[mesh.topology.hinges[:, 1:3]], axis=1)[:, 0], axis=1)
    areas = mesh.areas[mesh.topology.edge_triangles[mesh.topology.hinge_edges]].sum(axis=1)
    sheet = bending_hinge_stiffness(SHEET.E, SHEET.t, lengths, areas)
    e = first_system(model).elements
    assert e.spring > 0
    assert e.lock == pytest.approx(sheet[e.source], rel=1e-14)
    e = first_system(flap(50.0).force("edge:outer", total=(0.0, 0.0, -0.01))).elements
    assert e.lock == pytest.approx(e.hinge_stiffness, rel=1e-14)
    assert not first_system(replace(model, hinge_lock=False)).elements.lock.any()
    e = first_system(
        Model(mesh, SHEET, formulation="bars-and-hinges", contact=False).fold("crease", to=2.0)
    ).elements
    assert e.prescribed > 0
    assert not e.lock[-e.prescribed :].any()
    assert e.lock[: -e.prescribed].all()


def test_stiffness_of_the_locks_where_stiffness_is_given() -> None:
    """The mean of all hinges stands for the sheet."""
    mesh = flap().mesh
    hinges = np.random.default_rng(2).uniform(0.0, 2.0, len(mesh.topology.hinges))
    given = ElementStiffness(np.full(len(mesh.topology.edges), 100.0), hinges)
    e = first_system(replace(flap().force("edge:outer", total=(0.0, 0.0, -0.01)), stiffness=given)).elements
    assert e.lock == pytest.approx(np.maximum(hinges, hinges.mean())[e.source], rel=1e-14)


def test_what_is_in_contact_is_named() -> None:
    """Bending hinges by their edge, creases by their shortest name; held creases never."""
    mesh = flap().mesh
    held = trace(
        Model(mesh, SHEET, formulation="bars-and-hinges", contact=False).fold("crease", to=0.2 * ZONE)
    )
    assert held.outcome == "reached"
    assert system_of(held, 0).contact(held.records[-1].q, 1.0) == ""
    plain = (
        Model(mesh, SHEET, formulation="bars-and-hinges", contact=False)
        .support("crease:crease", "xyz")
        .support("edge:inner", "xyz")
    )  # no law: sheet
    system, q = bent_to(plain.force("edge:outer", total=(0.0, 0.0, -0.01)), 0.2 * ZONE)
    assert system.elements.spring == 0
    assert system.contact(q, 0.0).startswith("the panels at crease 'crease' (edge ")
    nameless = meshes.SheetMesh(mesh.points, mesh.triangles)
    hinge = int(crease_hinges(mesh, "crease")[0])
    a, b = mesh.topology.hinges[hinge, 1:3].tolist()
    assert hinge_name(nameless, hinge) == f"edge {a}-{b}"
    part = {
        **mesh.edge_sets,
        "crease:all of them": mesh.crease_edges("crease"),
        "crease:c1": np.array([[a, b]]),
    }
    named = meshes.SheetMesh(mesh.points, mesh.triangles, edge_sets=part)
    assert hinge_name(named, hinge) == f"crease 'c1' (edge {a}-{b})"


def test_made_closed() -> None:
    """A sheet that is folded by a degree less than a half turn where it is stress-free: its crease has no lock."""
    drawn = flap().mesh
    angle = 0.5 * ZONE
    x = drawn.points.copy()
    y = x[:, 1] - 5.0
    outer = y > 1e-9
    x[outer, 1], x[outer, 2] = 5.0 - y[outer] * math.cos(angle), -y[outer] * math.sin(angle)
    mesh = meshes.SheetMesh(x, drawn.triangles, edge_sets=drawn.edge_sets, folds=drawn.folds)
    model = replace(flap().force("edge:outer", total=(0.0, 0.0, -0.01)), mesh=mesh)
    system = first_system(model)
    e = system.elements
    creases = np.isin(e.source, crease_hinges(mesh, "crease"))
    assert not e.lock[creases].any()
    assert e.lock[~creases].all()
    assert system.contact(system.start(), 0.0) == ""


# --------------------------------------------------------------------------------------- paths


@pytest.mark.parametrize("stiffness", [0.001, 0.01])
@pytest.mark.parametrize("force", [0.5, 5.0])
@pytest.mark.parametrize("other_way", [False, True])
def test_soft_crease_stops(stiffness: float, force: float, other_way: bool) -> None:
    """Default settings: the panel is pressed against the other one and stays on its side."""
    model = closing(force, stiffness=stiffness)
    path = trace(mirrored(model) if other_way else model)
    assert path.outcome == "reached", path.reason
    for state in path:
        phi = state.dihedral("crease")
        assert ((phi > 0.0) & (phi < TURN)).all()
        assert (phi > 1.0).all() if other_way else (phi < 5.0).all()  # never on the other side
    left = until_closed(path[-1].dihedral("crease"))
    assert left.max() < 0.5 * ZONE
    assert path[-1].energy.lock > 0.0
    said = system_of(path, 1).contact(path.records[-1].q, 1.0)
    assert said.startswith("the panels at crease 'crease' (edge ")
    assert system_of(path, 0).contact(path.records[0].q, 0.0) == ""


def test_harder_pressed_is_closer() -> None:
    """The moment of the lock is that of the force, 1/d: ten times the force leaves about a tenth of the angle."""
    left = [float(until_closed(trace(closing(f))[-1].dihedral("crease")).mean()) for f in (1.0, 10.0)]
    assert left[0] / left[1] == pytest.approx(10.0, rel=0.25)


@pytest.mark.parametrize("other_way", [False, True])
def test_without_the_lock_nothing_passes(other_way: bool) -> None:
    """The run ends where the panels meet, names the crease, and keeps the states up to there."""
    model = replace(closing(), hinge_lock=False)
    path = trace(mirrored(model) if other_way else model)
    assert path.outcome != "reached"
    assert "the panels at crease 'crease' (edge " in path.reason
    assert "would pass through each other" in path.reason
    assert path[-1].energy.lock == 0.0
    assert until_closed(path[-1].dihedral("crease")).min() < 1e-3
    assert "touch" in system_of(path, 1).contact(path.records[-1].q, path.records[-1].lam)


@pytest.mark.parametrize("small", [1e-9, 0.01, 0.6])
def test_crossing_is_always_objected_to(small: float) -> None:
    for locked in (True, False):
        model = replace(flap(), hinge_lock=locked).force("edge:outer", total=(0.0, 0.0, -0.01))
        system, before = bent_to(model, small + 1e-3)
        _, after = bent_to(model, TURN - small - 1e-3)
        for q, other in ((before, after), (after, before)):
            assert "pass through each other" in system.objection(q, 0.1, other, 0.2)
        _, near = bent_to(model, small + 0.1)
        assert system.objection(before, 0.1, near, 0.2) == ""


def test_work_is_total_plus_lock() -> None:
    """Potential = total + lock - dead loads; and in the zone the forces' work (trapezoidal rule) is what is gained."""
    path = trace(closing(5.0), strategy=bh.LoadControl(largest=0.02))
    assert path.outcome == "reached"
    for record, state in zip(path.records, path, strict=True):
        system = system_of(path, record.step)
        loads = float(np.vdot(system.force.at(record.lam), state.points - state.mesh.points))
        held = state.energy.total + state.energy.lock
        assert system.evaluate(record.q, record.lam).energy == pytest.approx(
            held - loads, rel=1e-9, abs=1e-15
        )
    near = [state for state in path if state.energy.lock > 0.0]
    assert len(near) > 5
    force = system_of(path, 1).force
    work = sum(
        float(np.vdot(0.5 * (force.at(a.lam) + force.at(b.lam)), b.points - a.points))
        for a, b in pairwise(near)
    )
    gained = [after.energy.total + after.energy.lock for after in (near[0], near[-1])]
    assert work == pytest.approx(gained[1] - gained[0], rel=1e-2)
    assert near[-1].energy.lock > 0.05 * work  # without it the balance would not hold


def test_nothing_changes_where_no_hinge_is_near() -> None:
    """Energies, positions and iterations to the last digit, with the lock and without."""
    mesh = meshes.structured(meshes.annulus_sector(40.0, 8.0, 0.6), along=8)
    for model in (
        Model(mesh, SHEET, formulation="bars-and-hinges", contact=False).fold("crease", to=1.2),
        Model(mesh, SHEET, formulation="bars-and-hinges", contact=False).fold("crease", rest=1.2, Lstar=2.0),
        Model(mesh, SHEET, formulation="bars-and-hinges", contact=False).fold(
            "crease", to=math.radians(1.0)
        ),  # a prescribed crease may go where the lock would be
    ):
        on, off = trace(model), trace(replace(model, hinge_lock=False))
        assert on.outcome == "reached"
        assert [r.iterations for r in on.records] == [r.iterations for r in off.records]
        for a, b in zip(on, off, strict=True):
            assert a.energy == b.energy
            assert np.array_equal(a.points, b.points)
        assert on[-1].energy.lock == 0.0


def test_released_in_the_zone() -> None:
    """A crease that is held at one degree and then becomes a spring goes on from there, in equilibrium."""
    model = flap(0.05).fold("crease", to=0.5 * ZONE).fold("crease", rest=1.0, stiffness=0.05)
    path = trace(model)
    assert path.outcome == "reached", path.reason
    system = system_of(path, 1)
    assert system.elements.lock[system.elements.bending :].all()
    assert system.evaluate(system.start(), 0.0).imbalance < 1e-7
    assert path[-1].dihedral("crease").mean() == pytest.approx(1.0, abs=0.05)


# --------------------------------------------------------------------------------------- descriptions


def test_option_is_kept_and_checked(tmp_path: Path) -> None:
    model = replace(flap(), hinge_lock=False).fold("crease", rest=2.9)
    path = trace(model, file=tmp_path / "path.bh")
    assert bh.Path.load(tmp_path / "path.bh").model.hinge_lock is False
    trace(replace(model, hinge_lock=True), file=tmp_path / "other.bh")
    again = bh.Path.load(tmp_path / "other.bh")
    assert again.model.hinge_lock is True
    assert again.provenance["input"] != path.provenance["input"]
    with pytest.raises(bh.ModelError, match="hinge_lock = 1 cannot be; give True or False"):
        replace(model, hinge_lock=1)  # type: ignore[arg-type]


def test_option_in_scenes() -> None:
    scene = """
[pattern]
kind = "strip"
length = 20.0
width = 10.0
creases = [5.0]
[sheet]
E = 4000.0
t = 0.2
[mesh]
along = 4
[model]
%s
[[steps]]
fold = { crease = "crease", to = 2.0 }
"""
    for text, expected in (("", True), ("hinge_lock = true", True), ("hinge_lock = false", False)):
        assert parse_scene(scene % text).model.hinge_lock is expected
    with pytest.raises(bh.SceneError, match=r"model.hinge_lock = 1 cannot be; give true or false"):
        parse_scene(scene % "hinge_lock = 1")
