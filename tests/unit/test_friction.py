"""Friction against closed forms: a strip on a slope, between plates and round a drum; what it uses up; bad input."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh.commands.cli import main
from bh.errors import ModelError, SceneError
from bh.mechanics.contact.friction import Friction, Rubbing
from bh.scene.load import parse_scene
from bh.solvers.load_control import LoadControl
from tests.unit.test_moulds import box
from verification.studies.solver.contact_more import MU, SLOPE, SPRING, WEIGHT, belt, slope

Array = NDArray[np.float64]
SHEET = bh.Sheet(E=4000.0, nu=0.0, t=0.2)
MESH = meshes.structured(meshes.strip(20.0, 5.0, [2.5], ["flat"]), along=8, rows=1)


def plate(kind: str) -> bh.Indenter | bh.Mould:
    """A plate below the strip, as a bar or as a mould of triangles."""
    if kind == "bar":
        return bh.Indenter("plate", (10.0, 2.5, -1.05), 0.5 * math.pi, 100.0, 2.0, 0.5)
    return bh.Mould("plate", *box((60.0, 30.0, 2.0), (-10.0, -12.0, -2.0501)))


@pytest.mark.parametrize("kind", ["bar", "mould"])
def test_a_strip_on_a_slope_holds_until_tan_is_mu_and_slides_beyond(kind: str) -> None:
    """The plate lies along the slope, so the weight leans: its part along the slope grows to twice mu times the other.

    A soft spring says how far it slides: what friction does not hold.
    """
    path = slope(plate(kind))
    assert path.reached, path.steps[-1].reason
    slid = 0
    for state in path:
        if state.step == 0:
            continue
        way = float((state.points - MESH.points)[:, 0].mean())
        lean = SLOPE * MU * state.lam  # tan of its angle
        spring = state.contact_forces["plate"][0]
        if lean < MU:
            assert way < 0.01 * SHEET.t  # sticks: less than the slip that a contact bears
            assert spring == pytest.approx(-lean * WEIGHT, rel=0.02)
            continue
        slid += 1
        assert way == pytest.approx((lean - MU) * WEIGHT / SPRING, rel=0.002)
        assert spring == pytest.approx(-MU * state.contact_forces["plate"][2], rel=1e-3)
        assert state.energy.friction == pytest.approx(MU * WEIGHT * way, rel=0.01)
    assert slid >= 2


def test_what_sticks_does_not_creep() -> None:
    """Ten steps that change nothing move nothing."""
    model = bh.Model(MESH, SHEET, contact=False, friction=MU).spring("all", total=(0.0, 1e-3, 1e-3))
    model = model.step(plate("bar"), bh.Force("all", total=(0.0, 0.0, -WEIGHT)))
    model = model.step(plate("bar"), bh.Force("all", total=(0.9 * MU * WEIGHT, 0.0, -WEIGHT)))
    path = bh.trace(model, strategy=LoadControl(first=0.05, largest=0.05))
    ways = [float((s.points - MESH.points)[:, 0].mean()) for s in path if s.step == 1]
    assert path.reached
    assert len(ways) >= 20
    assert max(ways) < 0.01 * SHEET.t
    assert np.all(np.diff(ways) > 0.0)


def test_pushed_between_plates() -> None:
    """Plates press by a force N that the test reads; pushing takes 2 mu N, and back as much."""
    upper = bh.Indenter("upper", (10.0, 2.5, 1.05), 0.5 * math.pi, 100.0, 2.0, 0.5, by=(0.0, 0.0, -0.004))
    kept = bh.Indenter("upper", (10.0, 2.5, 1.046), 0.5 * math.pi, 100.0, 2.0, 0.5)
    model = bh.Model(MESH, SHEET, contact=False, friction=MU).spring("all", total=(1e-6, 1e-6, 1e-6))
    model = model.step(plate("bar"), upper)
    for way in (0.5, -1.0):
        model = model.step(plate("bar"), kept, bh.Displace("edge:start", "x", further=way))
    path = bh.trace(model)
    assert path.reached, path.steps[-1].reason
    ends = [[s for s in path if s.step == step][-1] for step in (1, 2)]
    for state, sign in zip(ends, (1.0, -1.0), strict=True):
        pressed = -state.contact_forces["upper"][2]
        assert pressed > 0.1
        assert state.contact_forces["plate"][2] == pytest.approx(pressed, rel=1e-3)
        assert state.reactions[:, 0].sum() == pytest.approx(sign * 2.0 * MU * pressed, rel=0.02)
    used = ends[1].energy.friction - ends[0].energy.friction
    assert used == pytest.approx(2.0 * MU * -ends[1].contact_forces["upper"][2] * 1.0, rel=0.02)


@pytest.mark.parametrize("rounds", [12, 0])
def test_friction_that_has_not_settled_is_told_also_by_a_path_from_its_file(
    rounds: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bh.solvers.lagging.LAGS", rounds)
    model = bh.Model(MESH, SHEET, contact=False, friction=MU).spring("all", total=(SPRING, SPRING, 1e-3))
    model = model.step(plate("bar"), bh.Force("all", total=(0.0, 0.0, -WEIGHT)))
    model = model.step(plate("bar"), bh.Force("all", total=(2.0 * MU * WEIGHT, 0.0, -3.0 * WEIGHT)))
    path = bh.trace(model)
    path.save(tmp_path / "path.bh")
    for told in (path, bh.Path.load(tmp_path / "path.bh")):
        assert told.reached
        found = [line for line in told.remarks if "friction had not settled" in line]
        assert len(found) == (0 if rounds else 2)
    if not rounds:
        assert "step 2: friction had not settled in" in found[1]


def test_friction_that_has_not_settled_where_a_value_ends_a_step_is_told_in_words_that_are_true() -> None:
    """That state is found between two others, without rounds for friction, so none can be counted."""
    model = bh.Model(MESH, SHEET, contact=False, friction=MU).spring("all", total=(SPRING, SPRING, 1e-3))
    model = model.step(plate("bar"), bh.Force("all", total=(0.0, 0.0, -WEIGHT)))
    until = bh.Until("displacement_x", 2e-4, "corner:inner-start")
    pushed = bh.Force("all", total=(2.0 * MU * WEIGHT, 0.0, -3.0 * WEIGHT))
    path = bh.trace(model.step(plate("bar"), pushed, until=until))
    found = [line for line in path.remarks if "friction had not settled" in line]
    assert len(found) == 1
    assert found[0].startswith(
        "step 2: friction had not settled in 1 of 2 states: its forces still change by"
    )
    assert "rounds" not in found[0]


def capstan(mu: float) -> float:
    """Force of the pulled end over that of the other, round half a turn of a drum."""
    ratio, path = belt(mu)
    assert path.reached, path.steps[-1].reason
    return ratio


@pytest.mark.slow
@pytest.mark.parametrize("mu", [0.1, 0.2, 0.3])
def test_a_strip_round_a_drum_is_eulers_belt(mu: float) -> None:
    assert capstan(mu) == pytest.approx(math.exp(mu * math.pi), rel=0.02)


@pytest.mark.slow
def test_euler_with_little_friction() -> None:
    assert capstan(0.05) == pytest.approx(math.exp(0.05 * math.pi), rel=0.02)


SCENE = """
friction = 0.3
contact = false
[pattern]
kind = "strip"
length = 20.0
width = 5.0
creases = [2.5]
fold = "flat"
[sheet]
E = 4000.0
t = 0.2
[mesh]
along = 8
[[springs]]
at = "all"
total = [0.01, 0.01, 0.001]
[[steps]]
press = { name = "plate", at = [10, 2.5, -1.05], direction = [0, 1, 0], radius = 0.5, width = 100, height = 2 }
force = { at = "all", total = [0.012, 0, -0.02] }
"""


def test_a_scene_tells_what_friction_has_used_up(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    assert main(["run", str(tmp_path / "scene.toml"), "-o", str(tmp_path / "out")]) == 0
    assert "friction has used up" in capsys.readouterr().out
    told = json.loads((tmp_path / "out" / "result.json").read_text())
    stored = bh.Path.load(tmp_path / "out" / "path.bh")
    assert stored.model.friction == 0.3
    assert told["friction_energy"] == stored[-1].energy.friction > 1e-4
    assert told["press"]["plate"][0] == pytest.approx(-0.3 * told["press"]["plate"][2], rel=1e-3)
    system, record = stored.solved(-1)  # as remembered it is in balance
    assert system.evaluate(record.q, record.lam).imbalance < 1e-7


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("friction = 0.3", "friction = -0.3", r"friction = -0.3 cannot be; give a coefficient of 0 or more"),
        (
            "friction = 0.3",
            'friction = "much"',
            r'friction = "much" cannot be; give a coefficient of 0 or more',
        ),
        (
            "height = 2",
            "height = 2, friction = -1",
            r"steps\[0\]\.press\.friction = -1 cannot be; give the coeff",
        ),
        (
            SCENE.split("[[steps]]")[1].split("force")[0],
            "\n",
            r"friction = 0.3 acts where something presses, but contact = false and no step has press; give contact",
        ),
    ],
)
def test_what_cannot_be_is_told_in_one_line(old: str, new: str, message: str) -> None:
    with pytest.raises(SceneError, match=message) as told:
        parse_scene(SCENE.replace(old, new))
    assert "\n" not in str(told.value)


def test_bad_coefficients_in_python() -> None:
    for value in (-0.1, math.nan, math.inf):
        with pytest.raises(
            ModelError, match=r"model: friction = .* cannot be; give a coefficient of 0 or more"
        ):
            bh.Model(MESH, SHEET, friction=value)
        with pytest.raises(ModelError, match="indenter 'b': friction"):
            bh.Indenter("b", (0, 0, 1), 0.0, 1.0, 1.0, 0.5, friction=value)


def test_forces_are_those_of_the_library() -> None:
    """With nothing stuck the potential is that of ipctk's `FrictionPotential`."""
    import ipctk

    from bh.mechanics.contact.barrier import SheetBarrier

    a = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    mesh = meshes.SheetMesh(
        np.vstack((a, a + np.array([0.21, 0.22, 0.05]))), np.array([[0, 1, 2], [3, 4, 5]])
    )
    barrier = SheetBarrier(mesh, 0.0, 0.1, 3.0)
    x = mesh.points
    slip = 0.003
    friction = Friction(
        [lambda x, _: barrier.rubbing(x, 0.4)], lambda x, _: x, slip, np.array([1, 2, 0, 4, 5, 3]), 0.0
    )
    friction.begin(x, 0.0)
    slides = ipctk.TangentialCollisions()
    slides.build(barrier._mesh, x, barrier._pairs(x), barrier._potential, 0.4)
    potential = ipctk.FrictionPotential(slip)
    for size in (1e-4, 1e-2):
        u = size * np.random.default_rng(3).normal(size=x.shape)
        energy, gradient = friction.forces(x + u, 0.0)
        assert gradient == pytest.approx(
            potential.gradient(slides, barrier._mesh, u).reshape(-1, 3), rel=1e-9
        )
        zero = potential(slides, barrier._mesh, np.zeros_like(u))
        assert energy == pytest.approx(potential(slides, barrier._mesh, u) - zero, rel=1e-6)
        v = np.random.default_rng(4).normal(size=x.shape)
        want = potential.hessian(slides, barrier._mesh, u) @ v.ravel()
        assert friction.times(x + u, v, 0.0).ravel() == pytest.approx(want, rel=1e-8)
        pairs, blocks = friction.blocks(x + u, 0.0)
        sums = np.zeros_like(x)
        for (high, low), block in zip(pairs, blocks, strict=True):
            both = block @ np.concatenate((v[high], v[low]))
            sums[high] += both[:3]
            sums[low] += both[3:]
        assert sums.ravel() == pytest.approx(want, rel=1e-8)


def test_what_is_remembered_gives_the_same_force() -> None:
    rubbing = Rubbing(
        np.array([[0, 0, 1, -1, -1]]),
        np.array([[1.0, -1.0, 0, 0]]),
        np.array([[0.0, 0, 1]]),
        np.array([0.5]),
        np.zeros((1, 3)),
    )

    def made() -> Friction:
        return Friction([lambda x, _: rubbing], lambda x, _: x, 0.01, np.array([1, 0]), 1.0)

    x = np.array([[0.0, 0, 0], [0, 0, 1]])
    for way, used in ((0.004, 1.0), (0.1, 1.0 + 0.5 * 0.09)):
        friction = made()
        friction.begin(x, 0.0)
        there = x + np.array([[way, 0, 0], [0, 0, 0]])
        energy, force = friction.forces(there, 0.5)
        history = friction.history_at(there, 0.5)
        assert friction.fits(history, 2)
        assert not friction.fits(history[:-1], 2)
        assert not friction.fits(history, 3)
        again = made()
        again.begin(x, 0.0)
        again.remember(history, 2)
        assert again.forces(there, 0.5)[0] == pytest.approx(energy)
        assert again.forces(there, 0.5)[1] == pytest.approx(force, rel=1e-12)
        assert history[0, 0] == pytest.approx(used)
