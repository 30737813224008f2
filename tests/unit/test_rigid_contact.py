"""Bars that press on a sheet without friction: derivatives, balance, and a beam on two supports."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import meshes
from bh import LoadControl, Model, ModelError, Sheet, trace
from bh.mechanics.bars_and_hinges.system import BarsAndHingesSystem
from bh.mechanics.consistent.system import ConsistentSystem
from bh.mechanics.shared.rigid_contact import RigidContact
from bh.model.actuations import Indenter, Pull, Tether
from bh.paths.path import Path
from fem.outside import ShellOutside
from fem.system import ShellSystem

SHEET = Sheet(E=4000.0, t=0.381)
FORMULATIONS = ["bars-and-hinges", "consistent"]
SHELLS = ["shell", "linear-shell"]
SPAN, WIDTH = 50.0, 5.0


def beam(formulation: str, along: int = 35) -> Model:
    """A strip 70 x 5 mm."""
    mesh = meshes.structured(meshes.strip(70.0, WIDTH, creases=[0.5 * WIDTH]), along=along)
    return Model(mesh, SHEET, formulation=formulation)


def rig(
    by: float, radius: float = 0.5, gap: float = 0.02, half: float = 0.5 * SPAN
) -> list[Indenter | Tether]:
    """Cylinders along y: two below, one above that goes down."""
    about: dict[str, Any] = {
        "azimuth": 0.5 * math.pi,
        "width": 2.0 * radius,
        "height": 2.0 * radius,
        "radius": radius,
        "gap": gap,
    }
    off = radius + gap
    return [
        Indenter("left", (35.0 - half, 2.5, -off), **about),
        Indenter("right", (35.0 + half, 2.5, -off), **about),
        Indenter("bar", (35.0, 2.5, off), by=(0.0, 0.0, -by), **about),
        Tether("all", (1e-6, 1e-6, 1e-6)),
    ]


@pytest.mark.parametrize("formulation", [*FORMULATIONS, *SHELLS])
def test_beam_on_two_supports(formulation: str) -> None:
    """F = 48 E I delta / L^3 with nu = 0; supports and bar push back in balance."""
    path = trace(
        # bars and hinges need slender cells: alpha = 5
        beam(formulation, 140 if formulation == "bars-and-hinges" else 35).step(*rig(by=1.0)),
        strategy=LoadControl(first=0.02, largest=0.2, work_mismatch=math.inf),
    )
    assert path.outcome == "reached"
    assert path.stable
    # between two states, so that what the barriers give way by at first does not count
    loads = [-path[i].contact_forces["bar"][2] for i in range(len(path))]
    moved = [record.lam for record in path.records]
    slope = (loads[-1] - np.interp(0.4, moved, loads)) / 0.6
    inertia = WIDTH * SHEET.t**3 / 12.0
    assert slope == pytest.approx(48.0 * SHEET.E * inertia / SPAN**3, rel=0.04)
    end = path[-1].contact_forces
    assert end["left"][2] + end["right"][2] == pytest.approx(-end["bar"][2], rel=1e-3)
    assert end["left"][2] == pytest.approx(end["right"][2], rel=1e-6)
    assert end["left"][0] == pytest.approx(-end["right"][0], rel=1e-6)


@pytest.mark.parametrize("formulation", [*FORMULATIONS, "shell"])
def test_reactions_carry_what_presses_on_held_nodes(formulation: str) -> None:
    """One bar presses on nodes that a support holds, another beside them: reactions and bars are in balance."""
    about: dict[str, Any] = {
        "azimuth": 0.5 * math.pi,
        "width": 1.0,
        "height": 1.0,
        "radius": 0.5,
        "gap": 0.02,
    }
    bars = [
        Indenter("held", (1.0, 2.5, 0.52), by=(0.0, 0.0, -0.05), **about),
        Indenter("free", (36.0, 2.5, 0.52), by=(0.0, 0.0, -0.5), **about),
    ]
    model = beam(formulation).support("edge:start").support([0, 1, 2, 3, 4, 5]).support("edge:end")
    state = trace(model.step(*bars)).require()[-1]
    pressed = sum(state.contact_forces.values())
    assert state.contact_forces["held"][2] < -0.1
    assert np.abs(state.reactions.sum(axis=0) + pressed).max() < 1e-6 * np.abs(pressed).max()
    resultant = np.cross(state.points, state.reactions).sum(axis=0)
    assert resultant[1] == pytest.approx(
        36.0 * state.contact_forces["free"][2] + 1.0 * state.contact_forces["held"][2], rel=0.02
    )


def test_supports_may_lie_between_nodes() -> None:
    """Points all over the edges carry the contact, so the span is that of the supports and not of the nodes."""
    slopes = []
    for half in (25.0, 25.6):  # nodes are 2 mm apart
        path = trace(
            beam("consistent").step(*rig(by=1.0, half=half)),
            strategy=LoadControl(first=0.02, largest=0.2, work_mismatch=math.inf),
        )
        loads = [-path[i].contact_forces["bar"][2] for i in range(len(path))]
        slopes.append((loads[-1] - np.interp(0.4, [r.lam for r in path.records], loads)) / 0.6)
    assert slopes[1] / slopes[0] == pytest.approx(
        (25.0 / 25.6) ** 3, rel=0.015
    )  # 0.7 mm per node would be 4 %


def test_work_of_the_bar_is_the_energy_of_sheet_and_barriers() -> None:
    path = trace(beam("bars-and-hinges").step(*rig(by=2.0)), strategy=LoadControl(first=0.01, largest=0.02))
    system, _ = path.solved()
    work = 0.0
    for a, b in zip(path.records, path.records[1:], strict=False):
        work += 0.5 * (b.lam - a.lam) * (system.power(a.q, a.lam) + system.power(b.q, b.lam))
    gained = system.evaluate(path.records[-1].q, 1.0).energy
    assert work == pytest.approx(gained, rel=2e-3)
    assert path[-1].energy.total < gained


Shaken = BarsAndHingesSystem | ConsistentSystem | ShellSystem


def shaken(formulation: str, seed: int, by: float = 0.1) -> tuple[Shaken, np.ndarray, float]:
    """A folded piece of sheet deep in a slanted bar: rounded edges, flat sides and tethers all act."""
    mesh = meshes.structured(meshes.annulus_sector(20.0, 6.0, 0.6), along=6)
    model = Model(mesh, SHEET, formulation=formulation).support("corner:inner-start", [[1.0, 0.5, 0.2]])
    bar = Indenter("bar", (19.0, 5.0, 0.6), 0.7, 4.0, 1.5, 0.5, by=(0.3, -0.2, -0.5), tilt=0.1, gap=0.4)
    model = model.crease("crease", Lstar=25.0).step(bar, Tether("edge:start", (0.5, 1.0, 2.0)))
    system = Path(model).system(0)
    assert isinstance(system, Shaken)
    q = system.start() + by * np.random.default_rng(seed).normal(size=system.size)
    return system, q, 0.4


@pytest.mark.parametrize("formulation", [*FORMULATIONS, *SHELLS])
def test_derivatives(formulation: str) -> None:
    """Gradient, Hessian, rate with lambda and power against central differences."""
    system, q, lam = shaken(formulation, 3, 0.02 if formulation in SHELLS else 0.1)
    assert np.abs(bar_forces(system, q, lam)["bar"]).max() > 1.0
    now, h = system.evaluate(q, lam), 1e-6
    matrix = system.tangent(q, lam, now.forces).matrix
    rng = np.random.default_rng(5)
    for _ in range(4):
        v = rng.normal(size=system.size)
        ahead, behind = (system.evaluate(q + s * h * v, lam) for s in (1.0, -1.0))
        slope = (ahead.energy - behind.energy) / (2.0 * h)
        assert slope == pytest.approx(float(now.residual @ v), rel=1e-6)
        difference = (ahead.residual - behind.residual) / (2.0 * h)
        assert np.abs(matrix @ v - difference).max() < 1e-5 * np.abs(difference).max()
    late, early = (system.evaluate(q, lam + s * h) for s in (1.0, -1.0))
    rate = (late.residual - early.residual) / (2.0 * h)
    assert np.abs(system.control_rate(q, lam) - rate).max() < 1e-6 * np.abs(rate).max()
    assert system.power(q, lam) == pytest.approx((late.energy - early.energy) / (2.0 * h), rel=1e-6)
    bent = (system.power(q, lam + h) - system.power(q, lam - h)) / (2.0 * h)
    assert system.control_stiffness(q, lam) == pytest.approx(bent, rel=1e-3)


def test_distance_is_that_of_a_rounded_rectangle() -> None:
    """Force direction and size at points beside, above and off the corner of a bar."""
    mesh = meshes.SheetMesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))
    bar = Indenter("bar", (0.0, 0.0, 0.0), 0.0, 4.0, 2.0, 0.5, stiffness=1.0, gap=1.0)  # along x
    contact = RigidContact(mesh, (bar,), mesh.points)

    def push(y: float, z: float) -> np.ndarray:
        x = np.tile([0.0, y, z], (3, 1))
        return np.asarray(contact.contact_forces(x, 0.0)["bar"] / contact.share.sum())

    assert push(0.0, 1.4) == pytest.approx([0.0, 0.0, 0.5 * 0.6**2])
    assert push(2.6, 0.0) == pytest.approx([0.0, 0.5 * 0.4**2, 0.0])
    corner = np.array([1.5 + 0.6, 0.5 + 0.8])  # 1 mm from the centre of the round edge: g = 0.5
    assert push(*corner) == pytest.approx([0.0, 0.6 * 0.125, 0.8 * 0.125])
    assert push(0.0, 0.9) == pytest.approx([0.0, 0.0, 0.5 + 0.1])  # inside: linear
    assert push(0.0, 2.1) == pytest.approx([0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"width": 0.0}, "width = 0"),
        ({"radius": 3.0}, "more than half"),
        ({"gap": -1.0}, "gap = -1"),
        ({"at": (0.0, 0.0)}, "three numbers"),
        ({"stiffness": float("nan")}, "stiffness = nan"),
    ],
)
def test_bad_bars(change: dict[str, object], message: str) -> None:
    good = {"name": "bar", "at": (0.0, 0.0, 0.0), "azimuth": 0.0, "width": 4.0, "height": 2.0, "radius": 0.5}
    with pytest.raises(ModelError, match=message):
        Indenter(**{**good, **change})  # type: ignore[arg-type]


def bar_forces(system: Shaken, q: np.ndarray, lam: float) -> dict[str, np.ndarray]:
    """Of the outside of a system, whosever it is."""
    outside = system.outside
    if isinstance(outside, ShellOutside):
        assert isinstance(system, ShellSystem)
        return outside.bar_forces(system.at(q, lam).x, lam)
    assert outside is not None
    return outside.contact_forces(system.positions(q, lam), lam)


def test_the_shell_presses_as_the_judged_do() -> None:
    """A folded strip under a bar across its ridge: the same force by two formulations that share nothing of it."""
    about: dict[str, Any] = {"azimuth": 0.5 * math.pi, "width": 6.0, "height": 6.0, "radius": 3.0}
    found = []
    for formulation in ("consistent", "shell"):
        mesh = meshes.structured(meshes.strip(40.0, 20.0, [10.0]), along=16, rows=4, kind="mirrored")
        model = Model(mesh, Sheet(E=4000.0, nu=0.3, t=0.2), formulation=formulation, contact=False)
        model = (
            model.support("edge:inner", "xyz").support("edge:outer", "xz").fold("crease", by=1.0, Lstar=25.0)
        )
        top = float(trace(model)[-1].crease_points("crease")[:, 2].max())
        bar = Indenter("bar", (20.0, 10.0, top + 3.1), by=(0.0, 0.0, -1.1), stiffness=10.0, **about)
        found.append(trace(model.step(bar)).require()[-1].contact_forces["bar"])
    assert found[1][2] < -0.1
    assert found[0] == pytest.approx(found[1], rel=0.05, abs=1e-3)


@pytest.mark.parametrize("formulation", [*FORMULATIONS, "shell"])
def test_a_cylinder_is_round_right_below_its_axis(formulation: str) -> None:
    """Pushed up at a point it would roll aside: F / R, missed where that point lay under the axis to the last bit."""
    mesh = meshes.structured(meshes.strip(8.0, 4.0, [2.0]), along=4, rows=1, kind="mirrored")
    about = {"azimuth": 0.0, "width": 6.0, "height": 6.0, "radius": 3.0, "gap": 0.1}
    tangents = []
    for aside in (0.0, 1e-9):
        bar = Indenter("bar", (4.0, 2.0 + aside, 3.05), by=(0.0, 0.0, 0.0), **about)
        model = Model(mesh, SHEET, formulation=formulation, contact=False).support("edge:inner", "xyz")
        system = Path(model.step(bar)).system(0)
        q = system.start()
        matrix = system.tangent(q, 1.0, system.evaluate(q, 1.0).forces).matrix
        tangents.append(np.column_stack([matrix @ v for v in np.eye(system.size)]))
    assert np.abs(tangents[0] - tangents[1]).max() < 1e-6 * np.abs(tangents[0]).max()


def test_what_the_shell_has_not() -> None:
    with pytest.raises(ModelError, match="no moulds and pulls"):
        trace(beam("shell").step(Pull(3, (0.0, 0.0, 1.0), 0.1)))
    rough = [replace(bar, friction=0.2) for bar in rig(by=1.0) if isinstance(bar, Indenter)]
    with pytest.raises(ModelError, match="no friction"):
        trace(beam("shell").step(*rough))


def test_paths_go_on_from_others() -> None:
    model = beam("bars-and-hinges").support("edge:start").support("edge:end", "z")
    path = trace(model.force("all", total=(0.0, 0.0, 0.01)))
    longer = trace(path.model.force("all", total=(0.0, 0.0, 0.02)), after=path)
    direct = trace(path.model.force("all", total=(0.0, 0.0, 0.02)))
    assert len(longer) == len(direct)
    assert np.abs(longer[-1].points - direct[-1].points).max() < 1e-9
    with pytest.raises(ModelError, match="of another model"):
        trace(beam("consistent").step(*rig(by=1.0)), after=path)
