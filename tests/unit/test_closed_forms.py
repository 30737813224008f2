"""Validation against closed forms: each test names the formula, and tests what the formula gives."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh import Displace, Fold, Force, Model, Sheet, trace
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.mechanics.bars_and_hinges.stiffness import (
    bar_stiffness,
    bending_hinge_stiffness,
    diagonal_factor,
    shear_exact_factor,
)
from bh.solvers.linear import linear_response
from meshes.cells import Kind
from verification.theory import cone as cone_theory
from verification.theory import shear
from verification.theory import strips as strip_theory

E, T = 1000.0, 0.1  # MPa, mm
KINDS: tuple[Kind, ...] = ("staggered", "alternating", "one-way", "mirrored")


def reached(model: Model) -> bh.State:
    path = trace(model)
    assert path.outcome == "reached", path.reason
    return path[-1]


def linear_energy(model: Model) -> float:
    """Quadratic part of the potential of the first step, N mm."""
    system = formulation(model.formulation).system(model, load_steps(model)[0], None)
    return linear_response(system, system.start()).energy


# --------------------------------------------------------------------------------------- beams


LENGTH, HEIGHT = 20.0, 2.0  # mm


def cantilever(along: int) -> Model:
    """A strip whose first column of cells is clamped (alternating right triangles)."""
    mesh = meshes.structured(meshes.strip(LENGTH, HEIGHT), along=along, kind="alternating")
    clamped = np.flatnonzero(mesh.points[:, 0] <= 1.001 * LENGTH / along)
    return (
        Model(mesh, Sheet(E=E, t=T), formulation="bars-and-hinges", contact=False)
        .support("edge:start", "xyz")
        .support(clamped.tolist(), "z")
    )


def tip_deflection(force: float) -> float:
    """w = F L^3 / (3 E I), Euler-Bernoulli."""
    return force * LENGTH**3 / (3.0 * E * HEIGHT * T**3 / 12.0)


def of_hinges(along: int) -> float:
    """Tip deflection of `along` rigid segments joined by springs E I / W, the first one clamped, over that of the beam.

    Sum of F W / (E I) (j W)^2 over the hinges j = 1 ... n - 1 from the tip.
    """
    return (1.0 - 1.0 / along) * (1.0 - 0.5 / along)


@pytest.mark.parametrize("along", [40, 80, 160])
def test_cantilever(along: int) -> None:
    """Straight and diagonal hinges in series (`theory.strips.bending_ratio_alternating`), and a chain of hinges."""
    force = 1e-7
    w = -2.0 * linear_energy(cantilever(along).force("edge:end", total=(0.0, 0.0, force))) / force
    alpha = HEIGHT * along / LENGTH
    expected = of_hinges(along) / strip_theory.bending_ratio_alternating(alpha)
    assert w / tip_deflection(force) == pytest.approx(expected, rel=0.75 / along)
    if along == 160:
        assert w == pytest.approx(tip_deflection(force), rel=0.02)


def test_cantilever_converges_to_the_beam() -> None:
    """First order in the length of a cell."""
    errors = []
    for along in (20, 40, 80, 160):
        w = -2.0 * linear_energy(cantilever(along).force("edge:end", total=(0.0, 0.0, 1.0)))
        errors.append(1.0 - w / tip_deflection(1.0))
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert (ratios > 2.0).all(), errors
    assert errors[-1] < 0.02


def test_nonlinear_path_begins_with_the_linear_response() -> None:
    """A deflection of 1/10,000 of the length: trace and linear response agree to the square of it."""
    force = 1e-7 * 10.0 / 8.0
    model = cantilever(40).force("edge:end", total=(0.0, 0.0, force))
    linear = -2.0 * linear_energy(model) / force
    state = reached(model)
    w = float(state.displacement("edge:end")[:, 2].mean())
    assert 5e-5 < w / LENGTH < 2e-4
    assert w == pytest.approx(linear, rel=1e-6)
    assert state.energy.total == pytest.approx(0.5 * force * w, rel=1e-6)
    # ten thousand times the force: much stiffer, since the tip moves on an arc
    large = reached(cantilever(40).force("edge:end", total=(0.0, 0.0, 2e4 * force)))
    assert large.displacement("edge:end")[:, 2].mean() < 0.6 * 2e4 * linear


def test_elastica() -> None:
    """Large deflection of a cantilever under a dead tip force, F L^2 / (E I) = 1: w / L = 0.30172, u / L = 0.05643.

    Bisshopp and Drucker 1945 (elliptic integrals). The bars and hinges are stiffer by the ratio of the linear case.
    """
    along = 80
    stiffness = E * HEIGHT * T**3 / 12.0 / LENGTH**2
    unit = -2.0 * linear_energy(cantilever(along).force("edge:end", total=(0.0, 0.0, 1.0)))
    softness = unit / tip_deflection(1.0)
    state = reached(cantilever(along).force("edge:end", total=(0.0, 0.0, stiffness / softness)))
    u, _, w = state.displacement("edge:end").mean(axis=0) / LENGTH
    assert w == pytest.approx(0.30172, rel=0.02)
    assert -u == pytest.approx(0.05643, rel=0.04)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("along", [5, 20, 40])
def test_strip_in_tension(kind: Kind, along: int) -> None:
    """1/2 E H t u^2 / L on every mesh and aspect ratio (nu = 0)."""
    mesh = meshes.structured(meshes.strip(LENGTH, HEIGHT), along=along, kind=kind)
    u = 1e-4
    model = (
        Model(mesh, Sheet(E=E, t=T), formulation="bars-and-hinges", contact=False)
        .support("edge:start", "xyz")
        .support("edge:end", "z")
    )
    model = model.displace("edge:end", "x", u)
    exact = strip_theory.tension(E, LENGTH, HEIGHT, T, u)
    assert exact == pytest.approx(0.5 * E * HEIGHT * T * u**2 / LENGTH)
    assert linear_energy(model) == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("alpha", [0.5, 1.0, 2.0, 4.0, 8.0])
def test_strip_in_torsion(alpha: float) -> None:
    """St Venant times (alpha + 1 / alpha)^2: one diagonal hinge a cell (Eq. 3.11) in uniform twist."""
    ratio = twist_energy(alpha, "alternating") / strip_theory.torsion(E, LENGTH, HEIGHT, T, 1e-4)
    assert ratio == pytest.approx((alpha + 1.0 / alpha) ** 2, rel=0.01)


def twist_energy(alpha: float, kind: Kind) -> float:
    mesh = meshes.structured(meshes.strip(LENGTH, HEIGHT), along=round(alpha * LENGTH / HEIGHT), kind=kind)
    down, up = (Displace(f"corner:{side}-end", "z", by) for side, by in (("inner", -1e-4), ("outer", 1e-4)))
    return linear_energy(
        Model(mesh, Sheet(E=E, t=T), formulation="bars-and-hinges", contact=False)
        .support("edge:start", "xyz")
        .step(down, up)
    )


@pytest.mark.parametrize("alpha", [2.0, 4.0, 8.0])
def test_strip_in_torsion_staggered(alpha: float) -> None:
    """2 (alpha + 1 / (4 alpha))^2: two slanted hinges a cell."""
    ratio = twist_energy(alpha, "staggered") / strip_theory.torsion(E, LENGTH, HEIGHT, T, 1e-4)
    assert ratio == pytest.approx(2.0 * (alpha + 0.25 / alpha) ** 2, rel=0.02)


# --------------------------------------------------------------------------------------- element stiffness


def test_rectangle_in_tension_and_shear() -> None:
    """Eq. 3.3 on a W x H cell: chords carry E t H / 2 each; a diagonal with the exact factor carries G = E / 2."""
    W, H = 0.7, 2.1
    side = bar_stiffness(E, T, np.array([W]), np.array([0.5 * W * H]))[0]
    assert 2.0 * side == pytest.approx(E * T * H / W)
    diagonal = math.hypot(W, H)
    k = bar_stiffness(E, T, np.array([diagonal]), np.array([W * H]))[0] * shear_exact_factor(H / W)
    gamma = 1e-3
    stretch = gamma * W * H / diagonal
    assert 0.5 * k * stretch**2 == pytest.approx(0.5 * (E / 2.0) * gamma**2 * T * W * H)


def test_calibration_factor() -> None:
    """alpha^2 / 2 + 5/4 (Eq. 3.4), and that the printed factor differs from the exact one by 1/4 - 1/(2 alpha^2)."""
    alpha = np.array([1.0, 2.0, 5.0])
    assert diagonal_factor(alpha) == pytest.approx([1.75, 3.25, 13.75])
    assert diagonal_factor(alpha) - shear_exact_factor(alpha) == pytest.approx(0.25 - 0.5 / alpha**2)
    for a in alpha:
        assert shear.UnitTruss(a, float(shear_exact_factor(a))).shear_guided() == pytest.approx(1.0)


def test_rectangle_bent_by_its_middle_hinge() -> None:
    """Eq. 3.11: a hinge across a rectangle L_h x 2 W turned by theta stores what the bent sheet would.

    Curvature theta / W over W on average: E t^3 / 24 L_h theta^2 / W.
    """
    L_h, W, theta = 3.0, 0.5, 0.01
    k = bending_hinge_stiffness(E, T, np.array([L_h]), np.array([L_h * W]))[0]
    # two triangles of area L_h W / 2 each share the hinge; half of the energy is in the diagonals beside it
    assert 0.5 * k * theta**2 == pytest.approx(2.0 * E * T**3 / 24.0 * L_h * theta**2 / W)


def square_cell() -> meshes.SheetMesh:
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    return meshes.SheetMesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))


def test_square_cell_folded_along_its_diagonal() -> None:
    """Two triangles, one hinge: imposed out-of-plane displacement turns it by w / h, energy 1/2 k (w / h)^2."""
    mesh = square_cell()
    w = 1e-5
    model = (
        Model(mesh, Sheet(E=E, t=T), formulation="bars-and-hinges", contact=False)
        .support([0, 1, 2], "xyz")
        .support([3], "x")
        .displace([3], "z", w)
    )
    k = E * T**3 / 6.0 * 2.0 / 1.0
    assert linear_energy(model) == pytest.approx(0.5 * k * (w * math.sqrt(2.0)) ** 2, rel=1e-9)


def test_square_cell_is_dead_loaded() -> None:
    """The same hinge under a dead force: w = F h^2 / k, potential - F w / 2."""
    mesh = square_cell()
    model = (
        Model(mesh, Sheet(E=E, t=T), formulation="bars-and-hinges", contact=False)
        .support([0, 1, 2], "xyz")
        .support([3], "xy")
    )
    force, k = 1e-6, E * T**3 / 3.0
    state = reached(model.force([3], each=(0.0, 0.0, force)))
    assert state.displacement("node:3")[0, 2] == pytest.approx(force * 0.5 / k, rel=1e-6)


# --------------------------------------------------------------------------------------- straight creases


SHEET = Sheet(E=4000.0, t=0.127)
D = SHEET.bending_stiffness(nu=0.0)


def folded_strip(kind: Kind, rows: int, fold: str = "mountain") -> Model:
    mesh = meshes.structured(meshes.strip(30.0, 10.0, [4.0], fold), along=8, kind=kind, rows=rows)  # type: ignore[arg-type]
    return Model(mesh, SHEET, formulation="bars-and-hinges", contact=False)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("rows", [1, 2])
@pytest.mark.parametrize(
    "how", [{"to": 1.0}, {"to": 5.0}, {"rest": 1.0, "Lstar": 5.0}], ids=["up", "down", "spring"]
)
def test_straight_crease_folds_for_nothing(kind: Kind, rows: int, how: dict[str, Any]) -> None:
    """Panels stay rigid: no bending, no stretching (relative to what the plates would store at one radian)."""
    path = trace(folded_strip(kind, rows).fold("crease", **how))
    assert path.outcome == "reached", path.reason
    state = path[-1]
    target = how.get("to", how.get("rest"))
    assert state.dihedral("crease") == pytest.approx(np.full(8, target), abs=1e-9)
    scale = 0.5 * D * 30.0 / 10.0  # N mm
    assert state.energy.stretching < 1e-12 * scale
    assert state.energy.bending < 1e-12 * scale
    assert state.energy.folding < 1e-12 * scale
    # each panel is flat, and as large as it was
    for low, high in ((0.0, 4.0), (4.0, 10.0)):
        nodes = (state.mesh.points[:, 1] >= low) & (state.mesh.points[:, 1] <= high)
        here, before = state.points[nodes], state.mesh.points[nodes]
        assert np.linalg.svd(here - here.mean(axis=0), compute_uv=False)[2] < 1e-7
        far = np.linalg.norm(here[:, None] - here[None], axis=2)
        assert np.abs(far - np.linalg.norm(before[:, None] - before[None], axis=2)).max() < 1e-7


@pytest.mark.parametrize("fold", ["mountain", "valley"])
@pytest.mark.parametrize("rest", [math.pi, 2.6, 3.9])
def test_spring_crease_with_a_moment(fold: str, rest: float) -> None:
    """k (phi - rest) = -M for a mountain (a positive moment folds as drawn), + M for a valley; sheet rigid."""
    k, moment = 0.3, 0.2  # N mm / (mm rad), N mm / mm
    model = folded_strip("staggered", 1, fold).crease("crease", stiffness=k)
    if rest != math.pi:
        model = model.fold("crease", rest=rest)
    state = reached(model.moment("crease", moment))
    sense = 1.0 if fold == "mountain" else -1.0
    assert state.dihedral("crease") == pytest.approx(np.full(8, rest - sense * moment / k), abs=1e-9)
    assert state.energy.folding == pytest.approx(0.5 * k * 30.0 * (moment / k) ** 2, rel=1e-9)
    assert state.energy.stretching + state.energy.bending < 1e-12 * state.energy.folding
    assert state.crease_moment("crease") == pytest.approx(np.full(8, -sense * moment), rel=1e-9)


def test_crease_moment_by_a_pair_of_forces() -> None:
    """A strip held along one edge, a dead force at the other: k (pi - phi) L = F w cos(turn)."""
    k, force, width, length = 0.05, 0.03, 6.0, 30.0
    model = folded_strip("staggered", 1).crease("crease", stiffness=k)
    model = model.support("edge:inner", "xyz").support("crease:crease", "z")
    state = reached(model.force("edge:outer", total=(0.0, 0.0, -force)))
    turn = float(state.fold_angle("crease").mean())
    assert turn > 0.05
    assert k * turn * length == pytest.approx(force * width * math.cos(turn), rel=2e-3)


# --------------------------------------------------------------------------------------- cones


CONE = {"D": D, "inner": 90.0, "outer": 110.0}


@cache
def folded_sector(
    along: int, angle: float = math.pi / 4, dihedral: float = math.pi / 2, kind: Kind = "staggered"
) -> bh.State:
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, angle), along=along, kind=kind)
    return reached(
        Model(mesh, SHEET, formulation="bars-and-hinges", contact=False)
        .support("crease:crease", "z")
        .support("rigid-body")
        .fold("crease", to=dihedral)
    )


def test_cone_formula() -> None:
    """Eq. 3.13 integrated by hand: kappa = cot(phi / 2) / r over both panels, r from 90 to 110."""
    r = np.linspace(90.0, 110.0, 200_001)
    phi, angle = 2.0, 0.7
    kappa = 1.0 / math.tan(0.5 * phi) / r
    by_quadrature = float(np.trapezoid(0.5 * D * kappa**2 * angle * r, r))
    assert cone_theory.bending_energy(angle=angle, dihedral=phi, **CONE) == pytest.approx(
        by_quadrature, rel=1e-9
    )


@pytest.mark.parametrize("angle", [math.pi / 4, math.pi / 2])
@pytest.mark.parametrize("dihedral", [2.4, math.pi / 2])
def test_folded_annulus_is_a_cone(angle: float, dihedral: float) -> None:
    """Energy within 3 % of U = 1/2 D theta_a ln(r_o / r_i) cot^2(phi / 2); hardly any of it stretching."""
    alpha_8 = round(8.0 * angle * 100.0 / 10.0)
    state = folded_sector(alpha_8, angle, dihedral)
    exact = cone_theory.bending_energy(angle=angle, dihedral=dihedral, **CONE)
    assert state.energy.total == pytest.approx(exact, rel=0.03)
    assert state.energy.stretching < 0.01 * exact
    # the folded crease: a circle of radius r sin(phi / 2)
    x = state.crease_points("crease")[:, :2]
    middle, ends = x[len(x) // 2], (x[0], x[-1])
    chord = float(np.linalg.norm(ends[1] - ends[0]))
    sagitta = float(np.linalg.norm(middle - 0.5 * (ends[0] + ends[1])))
    radius = (chord**2 / 4.0 + sagitta**2) / (2.0 * sagitta)
    assert radius == pytest.approx(100.0 * math.sin(0.5 * dihedral), rel=0.01)


def test_rulings_of_the_cone_meet() -> None:
    """The straight edges lie on generators: extended, both panels' rulings run through one apex each."""
    state = folded_sector(64)
    inner, crease, outer = (
        state.points[state.mesh.nodes(at)] for at in ("edge:inner", "crease:crease", "edge:outer")
    )
    for edge, count in ((inner, len(inner)), (outer, len(outer))):
        heads = edge[
            1 : count - 1
        ]  # half a cell between the nodes of the crease: their foot is the mean of two
        feet = 0.5 * (crease[:-1] + crease[1:])
        lines = heads - feet
        lines /= np.linalg.norm(lines, axis=1)[:, None]
        P = np.eye(3)[None] - lines[:, :, None] * lines[:, None, :]
        apex = np.linalg.lstsq(P.sum(axis=0), np.einsum("nij,nj->i", P, feet), rcond=None)[0]
        miss = np.linalg.norm(np.einsum("nij,nj->ni", P, apex - feet), axis=1)
        assert miss[5:-5].max() < 0.02 * 100.0  # of the distance to the apex, away from the free ends


def test_convergence_in_the_aspect_ratio() -> None:
    """Staggered meshes, alpha 2, 4, 8: the difference to a fine solution falls at least in first order.

    Measured against alpha = 64 for a half turn, where the free ends count less.
    """
    angle = math.pi / 2
    fine = folded_sector(round(64.0 * angle * 10.0), angle).energy.total
    errors = [
        abs(folded_sector(round(a * angle * 10.0), angle).energy.total / fine - 1.0) for a in (2.0, 4.0, 8.0)
    ]
    assert errors[0] / errors[1] > 2.0, errors
    assert errors[1] / errors[2] > 2.0, errors
    assert errors[2] < 0.01


def test_full_annulus_of_cones_does_not_exist() -> None:
    """A closed annulus cannot fold with its crease kept plane but by stretching: far above the cone."""
    mesh = meshes.structured(meshes.full_annulus(100.0, 10.0), along=48)
    model = (
        Model(mesh, SHEET, formulation="bars-and-hinges", contact=False)
        .support("crease:crease", "z")
        .support("rigid-body")
    )
    path = trace(model.fold("crease", to=math.pi - 0.1))
    cone = cone_theory.bending_energy(angle=2.0 * math.pi, dihedral=math.pi - 0.1, **CONE)
    if path.outcome == "reached":
        assert path[-1].energy.total > 5.0 * cone


def test_dead_loads_and_folds_superpose_when_small() -> None:
    """Linear response: the response to two loads is the sum of the responses."""
    mesh = meshes.structured(meshes.strip(LENGTH, HEIGHT), along=20, kind="alternating")
    model = (
        Model(mesh, Sheet(E=E, t=T), formulation="bars-and-hinges", contact=False)
        .support("edge:start", "xyz")
        .support("node:1", "z")
    )
    a, b = Force("corner:inner-end", each=(0.0, 0.0, 1.0)), Force("corner:outer-end", each=(0.0, 1.0, -2.0))

    def response(*step: Fold | Force) -> np.ndarray:
        loaded = model.step(*step)
        system = formulation(loaded.formulation).system(loaded, load_steps(loaded)[0], None)
        return linear_response(system, system.start()).dq

    assert response(a, b) == pytest.approx(response(a) + response(b), rel=1e-9, abs=1e-9)
