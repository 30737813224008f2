"""The stiffness probe against dense condensation, closed forms, rigid turns of the model, and its bad inputs."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh import LoadControl, Model, Path, Sheet, trace
from bh.analysis.stiffness_probe import Probe, Stiffness, sphere
from bh.formulations import registry
from bh.loading.builder import load_steps
from bh.solvers.linear import linear_response

Array = NDArray[np.float64]
FORMULATIONS = ("bars-and-hinges", "consistent", "linear-shell", "shell")
SHEET = Sheet(E=4000.0, t=0.127, nu=0.0)
ANGLE = math.pi / 4


@cache
def folded(formulation: str, how: str = "held", support: str = "rigid-body") -> Path:
    """A sector folded to 120 degrees: crease held exactly or with a spring; free, or on oblique supports."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, ANGLE), along=8, rows=2)
    model = Model(mesh, SHEET, formulation=formulation)
    if support == "rigid-body":
        model = model.support("rigid-body")
    else:
        model = model.support("corner:inner-start", "xyz").support(
            "corner:outer-start", [[0.3, 1.0, 0.0], [0, 0, 1]]
        )
        model = model.support("corner:inner-end", "z")
    goal = 2.0 * math.pi / 3.0
    path = trace(
        model.fold("crease", to=goal) if how == "held" else model.fold("crease", rest=goal, Lstar=10.0)
    )
    assert path.outcome == "reached"
    return path


def unit_loads(probe: Probe, nodes: list[int]) -> Array:
    out = []
    for node in nodes:
        for axis in np.eye(3):
            force = np.zeros_like(probe.points)
            force[node] = axis
            out.append(probe.system.loads(force))
    return np.array(out).T


def dense(probe: Probe) -> Array:
    return np.column_stack([probe.matrix @ unit for unit in np.eye(len(probe.q))])


def condensed(K: Array, keep: NDArray[np.integer], drop: NDArray[np.integer]) -> Array:
    """K_kk - K_kr K_rr^-1 K_rk of unknowns `keep`, those of `drop` held."""
    rest = np.setdiff1d(np.arange(len(K)), np.concatenate((keep, drop)))
    return np.asarray(
        K[np.ix_(keep, keep)]
        - K[np.ix_(keep, rest)] @ np.linalg.solve(K[np.ix_(rest, rest)], K[np.ix_(rest, keep)])
    )


# --------------------------------------------------------------------------------------- against dense matrices


@pytest.mark.parametrize("how", ["held", "spring"])
@pytest.mark.parametrize("support", ["rigid-body", "oblique"])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_against_dense_condensation(formulation: str, support: str, how: str) -> None:
    """Held creases (multipliers), free bodies and oblique supports; two nodes with another edge held."""
    path = folded(formulation, how, support)
    mesh = path.model.mesh
    probe = Probe(path, hold="edge:start")
    # a dense matrix of a free body is singular, but not with an edge held
    nodes = [int(mesh.nodes("crease:crease")[-1]), int(mesh.nodes("edge:outer")[4])]
    K = dense(probe)
    keep = np.argmax(unit_loads(probe, nodes), axis=0)
    held = unit_loads(probe, mesh.nodes("edge:start").tolist())
    drop = np.unique(np.flatnonzero(np.abs(held).max(axis=1) > 0.0))
    expected = condensed(K, keep, drop)
    found = probe.reduced((nodes, "xyz"))
    assert np.abs(found - expected).max() <= 1e-8 * np.abs(expected).max()
    assert np.abs(found - found.T).max() == 0.0
    one = probe.at(nodes[:1]).matrix
    assert np.abs(one - condensed(K, keep[:3], drop)).max() <= 1e-8 * np.abs(one).max()


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_loaded_and_guided_are_solves_of_the_driver(formulation: str) -> None:
    """1 / (n.C.n) is a dead force in a step of its own, n.K.n a prescribed displacement with the node held across."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, ANGLE), along=8, rows=2)
    model = (
        Model(mesh, SHEET, formulation=formulation)
        .support("edge:start", "xyz")
        .support("corner:inner-end", "z")
    )
    model = model.fold("crease", rest=2.0, Lstar=10.0)
    path = trace(model)
    node = int(mesh.nodes("crease:crease")[-1])
    at = Probe(path).at([node])
    n = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
    form = registry.formulation(formulation)

    def energy(*actuations: Any) -> float:
        loaded = model.step(*actuations)
        system = form.system(loaded, load_steps(loaded)[-1], path[-1])
        return linear_response(system, system.start()).energy

    assert float(at.loaded(n)) == pytest.approx(-0.5 / energy(bh.Force([node], each=tuple(n))), rel=1e-7)
    shift = path[-1].displacement(f"node:{node}")[0]
    moves = [bh.Displace([node], axis, float(shift[k] + n[k])) for k, axis in enumerate("xyz")]
    assert float(at.guided(n)) == pytest.approx(2.0 * energy(*moves), rel=1e-7)
    assert float(at.loaded(n)) <= float(at.guided(n))


def test_free_bodies_resist_only_forces_in_equilibrium() -> None:
    path = folded("consistent")
    mesh = path.model.mesh
    probe = Probe(path)
    ends = [int(mesh.nodes("crease:crease")[k]) for k in (0, -1)]
    assert np.abs(probe.at(ends[:1]).matrix).max() == 0.0
    assert float(probe.at(ends[:1]).loaded([1.0, 2.0, 0.0])) == 0.0
    K = probe.reduced((ends, "xyz"))
    along = probe.points[ends[1]] - probe.points[ends[0]]
    along /= np.linalg.norm(along)
    values = np.linalg.eigvalsh(K)
    assert (np.abs(values[:5]) <= 1e-9 * values[5]).all()  # two points have one length and nothing else
    apart = np.concatenate((-along, along)) / math.sqrt(2.0)
    assert apart @ K @ apart == pytest.approx(values[5], rel=1e-9)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_mechanisms_are_named_and_cost_nothing(formulation: str) -> None:
    """A flat strip whose crease has no stiffness, held on one side: the other turns freely; no mode suffers."""
    mesh = meshes.structured(meshes.strip(20.0, 10.0, [5.0]), along=6, rows=2)
    low = np.flatnonzero(mesh.points[:, 1] < 4.0).tolist()
    model = Model(mesh, Sheet(E=1000.0, t=0.2), formulation=formulation).support(low, "xyz")
    modes, stiff = {}, {}
    for stiffness in (0.0, 1e-7):
        path = trace(model.crease("crease", stiffness=stiffness).force("edge:outer", total=(0.0, 1e-9, 0.0)))
        probe = Probe(path, 0)
        modes[stiffness], stiff[stiffness] = probe.modes(3), probe.at("corner:outer-end")
    assert float(stiff[0.0].loaded([0.0, 0.0, 1.0])) == 0.0
    assert 0.0 < float(stiff[1e-7].loaded([0.0, 0.0, 1.0])) < 1e-6
    assert float(stiff[0.0].guided([1.0, 1.0, 0.0])) == pytest.approx(
        float(stiff[1e-7].guided([1.0, 1.0, 0.0])), rel=1e-6
    )
    assert [mode.free for mode in modes[0.0]] == [True, False, False]
    assert modes[0.0][0].name == "crease 'crease' turns"
    for one, two in zip(modes[0.0][1:], modes[1e-7][1:], strict=True):
        assert one.eigenvalue == pytest.approx(two.eigenvalue, rel=1e-5)


def test_unstable_states_have_negative_stiffness() -> None:
    """A strip pressed beyond its buckling load, kept straight by symmetry: a negative eigenvalue, no frequency."""
    mesh = meshes.structured(meshes.strip(40.0, 4.0), along=20)
    model = Model(mesh, Sheet(E=1000.0, t=0.2), formulation="consistent")
    model = model.support("edge:start", "xyz", clamp=True).support("edge:end", "yz")
    load = (
        4.0 * math.pi**2 * 1000.0 * (4.0 * 0.2**3 / 12.0) / 40.0**2
    )  # clamped at one end: 2.05 of pi^2 E I / L^2
    path = trace(
        model.force("edge:end", total=(-load, 0.0, 0.0)), strategy=bh.Automatic(at_bifurcation="primary")
    )
    assert path[-1].stable is False
    first = Probe(path).modes(2, density=1000.0)
    assert min(mode.eigenvalue for mode in first) < 0.0
    assert any(math.isnan(mode.frequency) for mode in first)
    before = Probe(path, 0).modes(2, density=1000.0)
    assert min(mode.eigenvalue for mode in before) > 0.0


def test_a_loaded_path_gives_the_same(tmp_path: FilePath) -> None:
    short = LoadControl(first_rotation=0.3, largest_rotation=0.3)  # several states
    path = trace(folded("consistent", "spring").model, strategy=short)
    path.save(tmp_path / "path.db")
    again = Path.load(tmp_path / "path.db")
    for index in (0, 2, -1):
        one, two = (Probe(p, index, hold="edge:start").at("edge:end").matrix for p in (path, again))
        assert (one == two).all()


# --------------------------------------------------------------------------------------- closed forms


def strip(rows: int, along: int, length: float = 40.0, width: float = 4.0, held: bool = True) -> Path:
    """A flat strip by the consistent formulation, clamped at its start; the path is its flat state."""
    mesh = meshes.structured(meshes.strip(length, width), along=along, rows=rows)
    model = Model(mesh, Sheet(E=1000.0, t=0.2), formulation="consistent")
    model = model.support("edge:start", "xyz", clamp=True) if held else model.support("rigid-body")
    return trace(model.force("edge:end", total=(0.0, 0.0, 0.0)))


def test_strip_in_tension_and_bending() -> None:
    """EA / L, 3 E I / L^3 both ways (in its plane with the shear that a beam of Timoshenko has)."""
    E, L, H, t = 1000.0, 40.0, 4.0, 0.2
    probe = Probe(strip(16, 160), 0)
    end = probe.at("edge:end")
    assert float(end.loaded([1.0, 0.0, 0.0])) == pytest.approx(E * H * t / L, rel=2e-3)
    across = 3.0 * E * (H * t**3 / 12.0) / L**3
    assert float(end.loaded([0.0, 0.0, 1.0])) == pytest.approx(across, rel=5e-3)
    inertia = t * H**3 / 12.0
    flexible = L**3 / (3.0 * E * inertia) + L / (5.0 / 6.0 * 0.5 * E * H * t)
    assert float(end.loaded([0.0, 1.0, 0.0])) == pytest.approx(1.0 / flexible, rel=0.02)
    # an end that cannot turn: 12 E I / L^3
    fixed = probe.at("edge:end", turning=False)
    assert float(fixed.loaded([0.0, 1.0, 0.0])) == pytest.approx(
        1.0 / (L**3 / (12.0 * E * inertia) + L / (5.0 / 6.0 * 0.5 * E * H * t)), rel=0.03
    )


@pytest.mark.parametrize("held", [True, False])
def test_frequencies_of_a_strip(held: bool) -> None:
    """beta^2 / (2 pi L^2) sqrt(E I / (rho A)) out of plane: 1.8751 and 4.6941 clamped, 4.7300 and 7.8532 free."""
    E, L, t, density = 1000.0, 40.0, 0.2, 1200.0
    probe = Probe(strip(2, 80, held=held), 0)
    unit = math.sqrt(E * t**2 / 12.0 / (density * 1e-12)) / (2.0 * math.pi * L**2)
    modes = probe.modes(4 if held else 10, density)
    if not held:
        assert [mode.free for mode in modes] == [True] * 6 + [False] * 4
        assert all(
            mode.frequency == 0.0 and mode.name.startswith("the whole sheet moves") for mode in modes[:6]
        )
        modes = modes[6:]
    # those that move out of the plane, and not by twisting, which leaves the middle line where it is
    middle = np.abs(probe.points[:, 1] - 2.0) < 1e-6
    bending = [m for m in modes if np.abs(m.shape[middle, 2]).max() > 0.5 * np.abs(m.shape).max()]
    assert len(bending) >= 2
    betas = (1.8751, 4.6941) if held else (4.7300, 7.8532)
    for mode, beta in zip(bending[:2], betas, strict=True):
        assert mode.frequency == pytest.approx(beta**2 * unit, rel=0.01)
    assert [m.frequency for m in modes] == sorted(m.frequency for m in modes)


@pytest.mark.parametrize("support", ["rigid-body", "oblique"])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_modes_against_a_dense_pencil(formulation: str, support: str) -> None:
    """Eigenvalues of the condensed matrix, with held creases, oblique supports, and more nodes held."""
    path = folded(formulation, "held", support)
    mesh = path.model.mesh
    for hold in ((), "edge:start"):
        probe = Probe(path, hold=hold)
        K = dense(probe)
        loads = unit_loads(probe, list(range(len(mesh.points))))
        massive = np.flatnonzero(np.abs(loads).max(axis=1) > 0.0)
        held = unit_loads(probe, mesh.nodes("edge:start").tolist()) if hold else np.zeros((len(K), 1))
        kept = np.setdiff1d(massive, np.flatnonzero(np.abs(held).max(axis=1) > 0.0))
        rest = np.setdiff1d(np.arange(len(K)), massive)
        across = K[np.ix_(rest, kept)]
        C = K[np.ix_(kept, kept)]
        if formulation != "bars-and-hinges":  # rotations follow
            C = C - across.T @ np.linalg.solve(K[np.ix_(rest, rest)], across)
        else:  # multipliers: only motions that leave the held angles are there
            _, sizes, right = np.linalg.svd(across)
            basis = right[int((sizes > 1e-9 * sizes[0]).sum()) :].T
            C = basis.T @ C @ basis
        exact = np.linalg.eigvalsh(C)
        exact = exact[np.argsort(np.abs(exact))]
        modes = probe.modes(9)
        free = sum(mode.free for mode in modes)
        assert free == (6 if support == "rigid-body" and not hold else 0)
        found = np.array([mode.eigenvalue for mode in modes])
        assert found[free:] == pytest.approx(exact[free:9], rel=1e-5)
        shapes = np.array([mode.shape.ravel() for mode in modes])
        assert np.abs(shapes @ shapes.T - np.eye(9)).max() < 1e-10


# --------------------------------------------------------------------------------------- invariance


@pytest.mark.parametrize("formulation", FORMULATIONS[:2])  # the shell takes sheets in z = 0
def test_turning_the_model_turns_the_stiffness(formulation: str) -> None:
    from dataclasses import replace

    Q, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    Q = Q * np.sign(np.linalg.det(Q))
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, ANGLE), along=6)
    found = []
    for turned in (mesh, replace(mesh, points=mesh.points @ Q.T)):
        model = Model(turned, SHEET, formulation=formulation).support("rigid-body")
        path = trace(model.fold("crease", rest=2.0, Lstar=10.0))
        found.append(Probe(path, hold="edge:start").at("edge:end").matrix)
    assert np.abs(Q @ found[0] @ Q.T - found[1]).max() <= 1e-6 * np.abs(found[0]).max()


def test_directions_on_the_sphere() -> None:
    assert sphere(0.0, 0.0) == pytest.approx([0.0, 0.0, 1.0])
    assert sphere(math.pi / 2, math.pi / 2) == pytest.approx([0.0, 1.0, 0.0])
    assert sphere(np.zeros((3, 1)), np.zeros(4)).shape == (3, 4, 3)
    made = Stiffness(np.diag([1.0, 4.0, 16.0]), np.zeros((3, 0)))
    n = sphere(0.0, math.pi / 4)
    assert float(made.guided(n)) == pytest.approx(8.5)
    assert float(made.loaded(n)) == pytest.approx(1.0 / (0.5 + 0.5 / 16.0))
    assert made.principal[0].tolist() == [1.0, 4.0, 16.0]


def test_supports_are_infinitely_stiff() -> None:
    path = folded("bars-and-hinges", "held", "oblique")
    corner = Probe(path).at("corner:inner-end")
    assert float(corner.loaded([0.0, 0.0, 2.0])) == math.inf
    assert float(corner.guided([0.0, 1.0, 1.0])) == math.inf
    assert 0.0 < float(corner.loaded([0.0, 1.0, 0.0])) < math.inf
    assert float(corner.loaded([0.0, 1.0, 1.0])) > float(corner.loaded([0.0, 1.0, 0.0]))
    assert corner.principal[0][2] == math.inf
    assert float(Probe(path).at("corner:inner-start").loaded([1.0, 2.0, 3.0])) == math.inf


# --------------------------------------------------------------------------------------- bad input


@pytest.mark.parametrize(
    ("what", "word"),
    [
        (lambda p: Probe(p.model), "give bh.trace"),
        (lambda p: Probe(p, 99), "states"),
        (lambda p: Probe(p).reduced(), "nothing"),
        (lambda p: Probe(p).reduced(("corner:inner-end", "z")), "fixed along z"),
        (lambda p: Probe(p).reduced(("node:5", "xx")), "each once"),
        (lambda p: Probe(p).reduced(("node:9", "x"), ("node:9", [[1, 0, 0]])), "named twice along x"),
        (lambda p: Probe(p).at("node:9999"), "9999"),
        (lambda p: Probe(p).at("edge:start"), "fixed along"),
        (lambda p: Probe(p, hold="edge:end").at("crease:crease"), "fixed while it is probed"),
        (lambda p: Probe(p).modes(0), "count = 0"),
        (lambda p: Probe(p).modes(3, density=-1.0), "density = -1"),
        (lambda p: Probe(p).at("node:9").loaded([0, 0, 0]), "zero vector"),
        (lambda p: Probe(p).at("node:9").guided([1, 2]), "three finite numbers"),
    ],
)
def test_bad_input(what: Any, word: str) -> None:
    with pytest.raises(bh.InputError, match=word) as caught:
        what(folded("bars-and-hinges", "held", "oblique"))
    assert "\n" not in str(caught.value)


def test_public() -> None:
    assert bh.stiffness_probe.Probe is Probe


def test_the_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    page = (FilePath(__file__).resolve().parents[2] / "docs" / "stiffness.md").read_text(encoding="utf-8")
    exec(page.split("```python\n")[1].split("```")[0], {})
    assert capsys.readouterr().out.count(" Hz ") == 4
