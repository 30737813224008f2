"""The tools of the hard cases by themselves: closed forms, the dense referee, meshes, views."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import meshes
from bh import Model, trace
from bh.mechanics.shared.kinematics import dihedral_angles
from verification.studies.solver.benchmark_systems import VonMisesTruss
from verification.studies.solver.dense_origami import DenseOrigami, Law, hinge_angles, hinge_gradients
from verification.studies.solver.hard_cases.arches import arch_model, truss_model
from verification.studies.solver.hard_cases.assemblages import (
    Assemblage,
    eggbox_bending,
    extremes,
    miura_bistable,
)
from verification.studies.solver.hard_cases.parameters import condition_number, supported
from verification.studies.solver.hard_cases.pinching import PINCHED, crease_curvature, pinched_crease
from verification.studies.solver.hard_cases.random_meshes import random_mesh, worst_aspect
from verification.studies.solver.hard_cases.roll_up import CLOSING, LENGTH, ends, roll_model
from verification.studies.solver.hard_cases.same_answer import renumbered
from verification.studies.solver.hard_cases.two_creases import folded
from verification.theory import rolled
from verification.theory.arch import SineArch

ASSEMBLAGES = pytest.mark.parametrize("make", [miura_bistable, eggbox_bending])


# ------------------------------------------------------------------------------------ closed forms


def test_arch_load_is_stationary_energy() -> None:
    """dU/db = -q L / 2 and dU/dc = 0 for the energy of both modes, by central differences."""
    arch = SineArch(L=100.0, h=3.0, EI=400.0, EA=4000.0)

    def energy(b: float, c: float) -> float:
        strain = (b**2 + 4.0 * c**2 - arch.h**2) * math.pi**2 / (4.0 * arch.L**2)
        bending = (math.pi / arch.L) ** 4 * ((b - arch.h) ** 2 + 16.0 * c**2) * arch.L / 4.0
        return arch.EI * bending + 0.5 * arch.EA * arch.L * strain**2

    step = 1e-4
    for b in (2.5, 0.4, -1.0, -3.5):
        slope = (energy(b + step, 0.0) - energy(b - step, 0.0)) / (2.0 * step)
        assert -2.0 * slope / arch.L == pytest.approx(float(arch.load(b)), rel=1e-6)
    b = arch.bifurcation()
    sway = energy(b, 1e-3) - 2.0 * energy(b, 0.0) + energy(b, -1e-3)
    assert abs(sway) < 1e-4 * abs(energy(0.9 * b, 1e-3) - 2.0 * energy(0.9 * b, 0.0) + energy(0.9 * b, -1e-3))


def test_arch_limits_are_extremes_of_the_load() -> None:
    arch = SineArch(L=100.0, h=1.2, EI=4000.0 / 12.0, EA=4000.0)
    b = np.linspace(-1.2, 1.2, 200_001)
    load = arch.load(b)
    top, bottom = arch.limits()
    inside = slice(1, -1)
    turning = b[inside][np.diff(np.sign(np.diff(load))) != 0.0]
    assert sorted(turning) == pytest.approx(sorted((top, bottom)), abs=2e-5)
    assert math.isnan(SineArch(L=100.0, h=0.5, EI=4000.0 / 12.0, EA=4000.0).limits()[0])


@pytest.mark.parametrize("turn", [0.0, 1.0, math.pi, 5.0, 2.0 * math.pi])
def test_rolled_strip_is_an_arc(turn: float) -> None:
    """Against the integral of (cos, sin) of the slope along the strip."""
    L = 7.0
    s = np.linspace(0.0, L, 100_001)
    slope = turn * (s / L - 0.5)
    x, y = (
        np.trapezoid(np.cos(slope), s),
        np.trapezoid(np.sin(slope[: len(s) // 2 + 1]), s[: len(s) // 2 + 1]),
    )
    assert rolled.chord(L, turn / L) == pytest.approx(float(x), abs=1e-8)
    assert rolled.sag(L, turn / L) == pytest.approx(float(-y), abs=1e-8)


# ------------------------------------------------------------------------------------ the dense referee


def test_referee_measures_the_same_angles() -> None:
    x = np.random.default_rng(3).normal(size=(40, 4, 3))
    ours = dihedral_angles(x.reshape(-1, 3), np.arange(160).reshape(-1, 4)[:, [2, 0, 1, 3]].copy())
    assert hinge_angles(x) == pytest.approx(ours, abs=1e-12)


def test_referee_gradients_are_derivatives() -> None:
    x = np.random.default_rng(4).normal(size=(40, 4, 3))
    g = hinge_gradients(x)
    for corner in range(4):
        for axis in range(3):
            step = np.zeros((4, 3))
            step[corner, axis] = 1e-6
            turn = np.mod(hinge_angles(x + step) - hinge_angles(x - step) + math.pi, 2.0 * math.pi) - math.pi
            assert turn / 2e-6 == pytest.approx(g[:, corner, axis], rel=1e-5, abs=1e-6)


@ASSEMBLAGES
@pytest.mark.parametrize("law", ["quadratic", "published"])
def test_referee_tangent_is_the_derivative_of_its_forces(make: Callable[[], Assemblage], law: Law) -> None:
    rng = np.random.default_rng(5)
    given = make()
    # a narrow linear range, so that hinges beyond it are tried too
    referee = replace(given.referee(law), linear=(math.radians(130.0), math.radians(230.0)))
    u, v = 0.02 * rng.normal(size=given.points.shape), rng.normal(size=given.points.shape)
    by_hand = (referee.forces(u + 1e-6 * v) - referee.forces(u - 1e-6 * v)).ravel() / 2e-6
    assert referee.stiffness(u) @ v.ravel() == pytest.approx(by_hand, rel=1e-6, abs=1e-5)
    assert np.abs(given.referee(law).forces(np.zeros_like(u))).max() < 1e-10


def test_referee_follows_the_truss() -> None:
    """Both limit points of von Mises' truss, by the exact curve."""
    truss = VonMisesTruss()
    points = np.array([[-truss.span, 0.0, 0.0], [truss.span, 0.0, 0.0], [0.0, 0.0, truss.rise]])
    held = np.array([[True] * 3, [True] * 3, [True, True, False]])
    load = np.zeros((3, 3))
    load[2, 2] = -truss.force
    length = math.hypot(truss.span, truss.rise)
    referee = DenseOrigami(
        points,
        np.array([[0, 2], [1, 2]]),
        truss.stiffness * length,
        np.zeros((0, 4), dtype=np.int64),
        np.zeros(0),
        held,
        load,
    )
    states = [(lam, -float(u[2, 2])) for lam, u in referee.follow(0.05, 60)]
    lam, w = np.array(states).T
    assert w[-1] > 2.0 * truss.rise
    assert truss.load(w) == pytest.approx(lam, abs=1e-8)
    found = extremes(lam, w)
    assert [load for load, _ in found] == pytest.approx([truss.limit(), -truss.limit()], rel=1e-2)


@ASSEMBLAGES
def test_assemblages_are_those_of_the_paper(make: Callable[[], Assemblage]) -> None:
    """Panels of edge 2 and 60 degrees; loads and supports as its text and figures show them."""
    given = make()
    x = given.points[given.panels]
    sides = np.roll(x, -1, axis=1) - x
    assert np.linalg.norm(sides, axis=2) == pytest.approx(np.full((100, 4), 2.0))
    corner = np.degrees(np.arccos(np.abs(np.sum(sides[:, 0] * sides[:, 1], axis=1)) / 4.0))
    assert corner == pytest.approx(np.full(100, 60.0))
    assert (
        np.abs(np.einsum("pi,pi->p", np.cross(sides[:, 0], sides[:, 1]), sides[:, 2])).max() < 1e-12
    )  # flat
    loaded = np.flatnonzero(given.load.any(axis=1))
    assert given.load[loaded].tolist() == [[0.0, 0.0, -1.0]] * len(loaded)
    supported = np.flatnonzero(given.held.any(axis=1)).tolist()
    if make is miura_bistable:  # nodes are numbered column by column, 11 in each
        assert loaded.tolist() == [60]
        assert supported == [*range(0, 11, 2), *range(110, 121, 2)]
        assert given.held.sum() == 3 + 5 * 2 + 2 + 5
    else:
        assert loaded.tolist() == [5, 115]
        assert supported == [26, 28, 92, 94]
        assert given.held.sum() == 3 + 2 + 2 + 1


@ASSEMBLAGES
def test_small_load_balances_in_the_referee(make: Callable[[], Assemblage]) -> None:
    given = make()
    path = trace(given.model(0.4))
    assert path.outcome == "reached"
    unbalanced = 0.4 * given.load - given.referee("quadratic").forces(path[-1].points - given.points)
    assert np.abs(unbalanced[~given.held]).max() < 1e-6
    assert np.abs(given.mesh.topology.hinges).shape == (280, 4)


# ------------------------------------------------------------------------------------ scenes, small


def test_condition_number() -> None:
    path = trace(supported(1.0))
    system = path.system(0)
    q = path.records[-1].q
    K = system.tangent(q, 1.0, system.evaluate(q, 1.0).forces).matrix
    assert condition_number(path) == pytest.approx(
        np.linalg.cond(np.array([K @ e for e in np.eye(len(q))])), rel=1e-3
    )


@pytest.mark.parametrize("slender", [1.0, 6.0, 40.0])
def test_random_mesh_fills_the_sector(slender: float) -> None:
    mesh = random_mesh(7, slender)
    chords = mesh.areas.sum() / (math.pi / 4.0 * 100.0 * 20.0)
    assert 0.97 < chords <= 1.0
    assert len(meshes.topology.boundary_loops(mesh.topology)) == 1
    crease = mesh.points[mesh.nodes("crease:crease")]
    assert np.linalg.norm(crease, axis=1) == pytest.approx(100.0)
    assert worst_aspect(mesh) > slender


@pytest.mark.parametrize("slender", [2.0, 8.0])
def test_random_mesh_folds(slender: float) -> None:
    path = trace(
        Model(random_mesh(8, slender), supported(1.0).sheet, formulation="bars-and-hinges").fold(
            "crease", to=2.0
        )
    )
    assert path.outcome == "reached"


def test_renumbered_is_the_same_sheet() -> None:
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.5), along=6)
    other, new = renumbered(mesh, 3)
    assert not np.array_equal(new, np.arange(len(new)))
    assert np.array_equal(other.points[new], mesh.points)
    assert np.sort(other.areas) == pytest.approx(np.sort(mesh.areas))
    assert other.crease_edges("crease").tolist() == new[mesh.crease_edges("crease")].tolist()


def test_pinch_closes_only_its_zone() -> None:
    path = trace(pinched_crease(0.01, along=40))
    phi = path[-1].dihedral("crease")
    zone = np.isclose(phi, PINCHED, atol=1e-9)
    assert path.outcome == "reached"
    assert zone.tolist() == [18 <= i < 22 for i in range(40)]
    assert (phi[~zone] > PINCHED).all()


def test_curvature_of_a_circle() -> None:
    t = np.linspace(0.0, 1.0, 30)
    circle = 5.0 * np.column_stack((np.cos(t), np.sin(t), np.zeros(30)))
    assert crease_curvature(circle) == pytest.approx(np.full(24, 0.2), rel=1e-9)


def test_fighting_creases_yield_where_they_curve_more() -> None:
    path = trace(folded(("mountain", "mountain"), 10.0, 1.0, along=16))
    curved, straighter = (float(path[-1].fold_angle(f"crease-{i}").mean()) for i in (1, 2))
    assert path.outcome == "reached"
    assert curved < 0.5 * straighter < 0.5


def test_half_a_roll() -> None:
    """Half the closing moment makes a half circle, and its ends are 2 / pi of the length apart."""
    path = trace(roll_model(48, 0.5 * CLOSING))
    assert path.outcome == "reached"
    assert ends(path)[-1] == pytest.approx(2.0 / math.pi * LENGTH, rel=0.03)
    assert path[-1].points[:-3, 2].min() == pytest.approx(-LENGTH / math.pi, rel=0.03)


def test_arch_and_truss_snap_through() -> None:
    """A load above the limit leaves neither standing."""
    arch = SineArch(100.0, 1.2, 4000.0 * 4.0 / 12.0, 16000.0)
    path = trace(arch_model(1.2, 32, 2.0 * float(arch.load(arch.limits()[0]))))
    assert path.outcome == "reached"
    assert path[-1].points[:, 2].min() < -1.2
    truss = VonMisesTruss(spring=0.5)
    path = trace(truss_model(truss).force([3], each=(0.0, 0.0, -truss.force)))
    assert path.outcome == "reached"
    assert path[-1].points[2, 2] < -truss.rise
