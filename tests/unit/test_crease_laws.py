"""Creases whose moment is no straight line: laws, equilibrium, what a crease that yields keeps, files and refusals."""

from __future__ import annotations

import math
import shutil
import sqlite3
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh.loading.builder import load_steps
from bh.mechanics.bars_and_hinges.formulation import BarsAndHinges
from bh.mechanics.consistent.formulation import Consistent
from bh.model.hinge_laws import HingeLaw
from bh.model.serialise import describe, rebuild
from bh.solvers.system import Remembering, System
from meshes.quantities import QuantityError

Array = NDArray[np.float64]
FORMULATIONS = ("bars-and-hinges", "consistent", "shell")
KINDS: dict[str, Any] = {"consistent": "staggered", "shell": "mirrored"}
K, MY, H, LENGTH = 0.5, 0.2, 0.05, 20.0
SHEET = bh.Sheet(E=4000.0, nu=0.3, t=0.3)
HEAD = """
[pattern]
kind = "strip"
length = 20.0
width = 40.0
creases = [20.0]
[sheet]
E = 4000.0
t = 0.3
[mesh]
kind = "staggered"
along = 4
[creases.crease]
"""
STEP = '\n[[steps]]\nmoment = { crease = "crease", to = 0.1 }\n'


@dataclass(frozen=True)
class Cubic(HingeLaw):
    """A law of a user's own: k (turn + more turn^3)."""

    more: float

    def energy(self, turn: Array, k: float) -> Array:
        return np.asarray(k * (0.5 * turn**2 + 0.25 * self.more * turn**4))

    def moment(self, turn: Array, k: float) -> Array:
        return np.asarray(k * (turn + self.more * turn**3))

    def stiffness(self, turn: Array, k: float) -> Array:
        return np.asarray(k * (1.0 + 3.0 * self.more * turn**2))


LAWS: dict[str, HingeLaw] = {
    "table": bh.MomentTable((-1.0, -0.2, 0.0, 0.4, 1.0), (-0.1, -0.3, 0.0, 0.3, 0.2)),
    "odd table": bh.MomentTable((0.0, 0.4, 1.0), (0.0, 0.3, 0.2)),
    "bilinear": bh.Bilinear(0.3, -0.1),
    "softening": bh.Softening(0.5),
    "own": Cubic(2.0),
    "kinematic": bh.ElasticPlastic(MY, H),
    "isotropic": bh.ElasticPlastic(MY, H, "isotropic"),
    "perfect": bh.ElasticPlastic(MY),
}


def strip(formulation: str, law: HingeLaw | None, stiffness: float | None = K) -> bh.Model:
    """Two flat panels that a straight crease joins; nothing in them resists."""
    mesh = meshes.structured(meshes.strip(length=LENGTH, width=40.0, creases=[20.0]), along=4, rows=2)
    return bh.Model(mesh, SHEET, formulation=formulation).crease("crease", stiffness=stiffness, law=law)


def solved(model: bh.Model, **options: object) -> bh.Path:
    return bh.trace(model, estimate=False, neighbours=False, **options).require()  # type: ignore[arg-type]


@pytest.mark.parametrize("name", LAWS)
def test_moment_and_stiffness_are_derivatives(name: str) -> None:
    law, turn, h = LAWS[name], np.linspace(-1.53, 1.47, 41), 1e-6
    history = np.column_stack((0.3 * np.sin(7.0 * turn), 0.4 + 0.1 * np.cos(turn)))
    up, here, down = (law.respond(turn + d, history, K) for d in (h, 0.0, -h))
    np.testing.assert_allclose((up.energy - down.energy) / (2.0 * h), here.moment, atol=1e-8)
    np.testing.assert_allclose((up.moment - down.moment) / (2.0 * h), here.stiffness, atol=1e-7)
    again = law.respond(turn, here.history, K)  # an accepted state answers the same
    np.testing.assert_allclose(again.energy, here.energy, atol=1e-15)
    np.testing.assert_allclose(again.moment, here.moment, atol=1e-15)
    np.testing.assert_array_equal(again.history, here.history)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize(
    ("name", "turn"), [("table", 0.2 / 3.0), ("bilinear", 0.2), ("softening", 0.25), ("own", 0.186935)]
)
def test_equilibrium_under_a_couple(formulation: str, name: str, turn: float) -> None:
    """The crease turns until its law holds the couple, here 0.1 N mm / mm, towards a mountain."""
    law = LAWS[name]
    path = solved(strip(formulation, law, None if law.own_stiffness else K).moment("crease", to=0.1))
    np.testing.assert_allclose(law.moment(-path[-1].fold_angle("crease"), K), -0.1, rtol=1e-8)
    np.testing.assert_allclose(path[-1].fold_angle("crease"), turn, rtol=1e-5)
    np.testing.assert_allclose(path[-1].crease_moment("crease"), -0.1, rtol=1e-8)
    assert path[-1].energy.folding == pytest.approx(
        LENGTH * float(law.energy(np.array([-turn]), K)[0]), rel=1e-4
    )


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("hardens", ["kinematic", "isotropic"])
def test_springback(formulation: str, hardens: str) -> None:
    """Folded to 1 rad and let go, a hinge keeps (k turn - M_y) / (k + H), elastic on the way back (closed form)."""
    law = bh.ElasticPlastic(MY, H, hardens)
    model = strip(formulation, law).fold("crease", to=math.pi - 1.0).fold("crease", rest=math.pi)
    path = solved(model)
    kept = (K - MY) / (K + H)
    np.testing.assert_allclose(path[-1].fold_angle("crease"), kept, rtol=1e-9)
    np.testing.assert_allclose(path[-1].permanent_fold("crease"), kept, rtol=1e-9)
    lost = MY * kept + (0.5 * H * kept**2 if hardens == "isotropic" else 0.0)
    assert path[-1].energy.dissipated == pytest.approx(LENGTH * lost)
    np.testing.assert_allclose(path[-1].crease_moment("crease"), 0.0, atol=1e-9)
    assert path[0].energy.dissipated == 0.0, "a state is read with what was remembered there"


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_hysteresis_loop(formulation: str) -> None:
    """A cycle of couples +-M dissipates the area of its loop, 4 M_y (M - M_y) / H (kinematic)."""
    M = 0.25
    model = strip(formulation, bh.ElasticPlastic(MY, H)).moment("crease", to=M)
    path = solved(model.moment("crease", to=-M).moment("crease", to=M))
    ends = {state.step: state for state in path}
    area = 4.0 * MY * (M - MY) / H
    loop = ends[2].energy.dissipated - ends[0].energy.dissipated
    assert loop == pytest.approx(LENGTH * area)
    np.testing.assert_allclose(ends[2].fold_angle("crease"), ends[0].fold_angle("crease"), rtol=1e-8)
    states = [state for state in path if state.step > 0 or state is ends[0]]
    moments = np.array([state.crease_moment("crease")[0] for state in states])
    turns = np.array([state.fold_angle("crease")[0] for state in states])
    work = -LENGTH * float(
        np.sum(0.5 * (moments[1:] + moments[:-1]) * np.diff(turns))
    )  # kinks lie between states
    assert work == pytest.approx(LENGTH * area, rel=0.05)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_increments_do_not_matter(formulation: str) -> None:
    """The return mapping is exact for a turn that goes one way: few increments or many, the same end."""
    model = strip(formulation, LAWS["kinematic"]).moment("crease", to=0.24)
    few = solved(model, strategy=bh.LoadControl(largest=1.0, first=1.0))
    many = solved(model, strategy=bh.LoadControl(largest=0.05, first=0.05))
    assert len(many) > 2 * len(few)
    np.testing.assert_allclose(few[-1].permanent_fold("crease"), many[-1].permanent_fold("crease"), rtol=1e-9)


def sector(formulation: str, law: HingeLaw) -> bh.Model:
    mesh = meshes.structured(meshes.annulus_sector(radius=100.0, width=10.0, angle=0.5), along=8, rows=1)
    stiffness = None if law.own_stiffness else K
    return bh.Model(mesh, SHEET, formulation=formulation).crease("crease", stiffness=stiffness, law=law)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("name", ["own", "softening", "kinematic", "isotropic"])
def test_tangent_is_consistent(formulation: str, name: str) -> None:
    """Residual, tangent, rate with lambda and power against differences, at a state off equilibrium that yields."""
    model = sector(formulation, LAWS[name]).support("corner:inner-start", "xyz").support("rigid-body")
    model = model.step(bh.Fold("crease", rest=2.2), bh.Moment("crease", to=0.05))
    system: System = bh.trace(model, estimate=False, neighbours=False, warn=False).system(0)
    if isinstance(system, Remembering):
        system.remember(np.zeros_like(system.history))
    rng = np.random.default_rng(3)
    q, lam, h = 0.02 * rng.normal(size=system.size), 0.9, 1e-6
    v = rng.normal(size=system.size)
    now = system.evaluate(q, lam)
    up, down = system.evaluate(q + h * v, lam), system.evaluate(q - h * v, lam)
    assert (up.energy - down.energy) / (2.0 * h) == pytest.approx(float(now.residual @ v), rel=1e-6)
    matrix = system.tangent(q, lam, now.forces).matrix
    rate = (up.residual - down.residual) / (2.0 * h)
    np.testing.assert_allclose(matrix @ v, rate, atol=1e-5 * np.abs(rate).max())
    up, down = system.evaluate(q, lam + h), system.evaluate(q, lam - h)
    rate = (up.residual - down.residual) / (2.0 * h)
    np.testing.assert_allclose(system.control_rate(q, lam), rate, atol=1e-5 * np.abs(rate).max())
    assert system.power(q, lam) == pytest.approx((up.energy - down.energy) / (2.0 * h), rel=1e-6)
    second = (system.power(q, lam + h) - system.power(q, lam - h)) / (2.0 * h)
    assert system.control_stiffness(q, lam) == pytest.approx(second, rel=1e-5, abs=1e-5)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_curved_fold_is_kept(formulation: str) -> None:
    """A curved crease that yields stays folded where its panels let it: the fold kept lies below the straight one's."""
    model = sector(formulation, bh.ElasticPlastic(MY, H))
    path = solved(model.fold("crease", to=math.pi - 1.0).fold("crease", rest=math.pi))
    kept = float(path[-1].fold_angle("crease").mean())
    assert 0.1 < kept < (K - MY) / (K + H)
    assert float(path[-1].permanent_fold("crease").min()) > kept, (
        "panels bend the crease back below its rest angle"
    )
    elastic = sector(formulation, Cubic(0.0))
    flat = solved(elastic.fold("crease", to=math.pi - 1.0).fold("crease", rest=math.pi))[-1]
    assert float(np.abs(flat.fold_angle("crease")).max()) < 1e-6


def test_the_shell_judges_a_springback() -> None:
    """A curved crease, folded to 1 rad and let go: fold kept and energies of both formulations to 0.5 %."""
    found = []
    for name, along, rows in (("consistent", 32, 4), ("shell", 8, 1)):
        pattern = meshes.annulus_sector(radius=100.0, width=10.0, angle=0.5)
        mesh = meshes.structured(pattern, along=along, rows=rows, kind=KINDS[name])
        model = bh.Model(mesh, SHEET, formulation=name).crease("crease", stiffness=K, law=LAWS["kinematic"])
        end = solved(model.fold("crease", to=math.pi - 1.0).fold("crease", rest=math.pi))[-1]
        kept = end.fold_angle("crease").mean(), end.permanent_fold("crease").mean()
        found.append([*kept, end.energy.dissipated, end.energy.total])
    np.testing.assert_allclose(found[0], found[1], rtol=5e-3)
    assert found[0][0] < 0.995 * found[0][1], "panels hold against what the crease keeps"


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_snap_of_a_softening_law(formulation: str) -> None:
    """Moment against turn rises, falls and rises: arc length passes both limit points and ends on the third branch."""
    law = bh.MomentTable((0.0, 0.3, 0.8, 2.0), (0.0, 0.2, 0.1, 0.5))
    path = solved(strip(formulation, law, None).moment("crease", to=0.3))
    np.testing.assert_allclose(path[-1].fold_angle("crease"), 1.4, rtol=1e-8)
    falling = [s for s in path if 0.35 < s.fold_angle("crease").mean() < 0.75]
    for state in path:
        couple = 0.3 * state.lam
        np.testing.assert_allclose(law.moment(-state.fold_angle("crease"), K), -couple, atol=1e-7)
    assert falling, "the falling branch is followed, not jumped over"
    assert any(bend.kind == "limit" for _, bend in path.critical_points)


def test_resumed_to_the_same_bits(tmp_path: Path) -> None:
    """A run that was killed in the middle of a step goes on with what its creases had been through."""
    for formulation in FORMULATIONS:
        model = (
            sector(formulation, LAWS["kinematic"]).fold("crease", to=math.pi - 0.8).moment("crease", to=0.0)
        )
        model = model.fold("crease", rest=math.pi).moment("crease", to=-0.3)
        whole, part = tmp_path / f"{formulation}.bh", tmp_path / f"{formulation}-part.bh"
        first = solved(model, file=whole)
        assert float(np.ptp([s.permanent_fold("crease").mean() for s in first if s.step == 3])) > 0.01
        last = [i for i, s in enumerate(first) if s.step == 3]
        shutil.copy(whole, part)
        with sqlite3.connect(part) as db:
            db.execute("DELETE FROM states WHERE id > ?", (last[len(last) // 2] + 1,))
            db.execute("DELETE FROM history WHERE state > ?", (last[len(last) // 2] + 1,))
            db.execute("DELETE FROM steps WHERE step = 3")
        second = solved(model, file=part, resume=True)
        assert len(first) == len(second)
        for a, b in zip(first.records, second.records, strict=True):
            np.testing.assert_array_equal(a.q, b.q)
            np.testing.assert_array_equal(a.history, b.history)
        loaded = bh.Path.load(whole)
        np.testing.assert_array_equal(loaded[-1].permanent_fold("crease"), first[-1].permanent_fold("crease"))
        assert loaded[3].energy == first[3].energy


def test_a_straight_law_is_as_ever() -> None:
    """Without a law nothing is stored and nothing is remembered; with a straight one the numbers are the same."""
    for formulation in FORMULATIONS:
        plain = strip(formulation, None).moment("crease", to=0.1)
        assert "law" not in describe(plain)[0]["creases"]["crease"]
        assert load_steps(plain)[0].curve is None
        assert solved(plain).records[-1].history is None
        angle = solved(strip(formulation, Cubic(0.0)).moment("crease", to=0.1))[-1].fold_angle("crease")
        np.testing.assert_allclose(angle, solved(plain)[-1].fold_angle("crease"), rtol=1e-9)


def test_stored() -> None:
    for law in LAWS.values():
        model = strip("consistent", law, None if law.own_stiffness else K)
        assert rebuild(*describe(model)).creases == model.creases


@pytest.mark.parametrize(
    ("text", "law"),
    [
        (
            'law = { kind = "table", turns = ["0deg", "30deg"], moments = [0.0, 0.2] }',
            bh.MomentTable((0.0, math.pi / 6.0), (0.0, 0.2)),
        ),
        (
            'stiffness = 0.5\nlaw = { kind = "bilinear", knee = "30deg", beyond = -0.1 }',
            bh.Bilinear(math.pi / 6.0, -0.1),
        ),
        ('stiffness = 0.5\nlaw = { kind = "softening", peak = 0.5 }', bh.Softening(0.5)),
        (
            'Lstar = 30.0\nlaw = { kind = "elastic-plastic", yield_moment = 0.2, hardening = 0.05 }',
            bh.ElasticPlastic(0.2, 0.05),
        ),
    ],
)
def test_scene(tmp_path: Path, text: str, law: HingeLaw) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(HEAD + text + STEP)
    assert bh.load_scene(file).model.creases["crease"].law == law


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            'stiffness = 0.5\nlaw = { kind = "plastic" }',
            "creases.crease.law.kind = 'plastic' is no law of a crease",
        ),
        ('stiffness = 0.5\nlaw = { kind = "elastic-plastic" }', "yield_moment is missing"),
        ('stiffness = 0.5\nlaw = { kind = "elastic-plastic", yield_moment = -1.0 }', "yield_moment"),
        ('law = { kind = "softening", peak = 0.5 }', "either Lstar"),
        ('stiffness = 0.0\nlaw = { kind = "softening", peak = 0.5 }', "positive with a law"),
        (
            'stiffness = 1.0\nlaw = { kind = "table", turns = [0.0, 1.0], moments = [0.0, 1.0] }',
            "its own stiffness",
        ),
        (
            'law = { kind = "table", turns = [0.0, 1.0, 1.0], moments = [0.0, 1.0, 2.0] }',
            "no function of the turn",
        ),
        ('law = { kind = "table", turns = [0.1, 1.0], moments = [0.1, 1.0] }', "no turn 0 with moment 0"),
        ('law = { kind = "table", turns = [0.0, 1.0], moments = [0.0, 1.0, 2.0] }', "as many of both"),
        ('stiffness = 1.0\nlaw = { kind = "mine:Law" }', "allow-plugins"),
        ('stiffness = 1.0\nlaw = "softening"', "creases.crease.law"),
    ],
)
def test_bad_scene(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(HEAD + text + STEP)
    with pytest.raises(bh.SceneError, match=message) as caught:
        bh.load_scene(file)
    assert "\n" not in str(caught.value)


def test_refused() -> None:
    """What cannot be is told in one line."""
    model = strip("consistent", LAWS["kinematic"]).moment("crease", to=0.1)
    with pytest.raises(bh.ModelError, match="whole sheet"):
        bh.trace(model, symmetry="x", estimate=False)
    with pytest.raises(bh.ModelError, match="remember their way"):
        bh.live.Session(model)
    for name, form in (("bars-and-hinges", BarsAndHinges()), ("consistent", Consistent())):
        of_form = replace(model, formulation=name)
        system = form.system(of_form, load_steps(of_form)[0], None)
        with pytest.raises(bh.ModelError, match="law of its own"):
            form.derivatives(system, system.start(), 0.0)  # type: ignore[arg-type]
    with pytest.raises(bh.ModelError, match="released in a step that ends early"):
        bh.trace(
            strip("consistent", LAWS["kinematic"])
            .fold("crease", to=2.0)
            .step(bh.Fold("crease", rest=math.pi), until=bh.Until("fold_angle", 0.9, "crease"))
            .fold("crease", rest=3.0),
            estimate=False,
        )
    with pytest.raises((bh.ModelError, QuantityError), match="hardens"):
        bh.ElasticPlastic(0.1, 0.0, "both")


def test_yield_moment_from_a_springback() -> None:
    """`bh.calibrate` finds the constants of a law, too."""
    model = strip("bars-and-hinges", bh.ElasticPlastic(0.1, H)).fold("crease", to=math.pi - 1.0)
    data = bh.Measured("fold_angle", ((K - MY) / (K + H),), "crease", (1,), sigma=0.01)
    found = bh.calibrate(
        model.fold("crease", rest=math.pi), data, {"creases.crease.law.yield_moment": (0.1, 0.05, 0.3)}
    )
    assert found.values[0] == pytest.approx(MY, rel=1e-6)
