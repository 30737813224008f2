"""Creases of solved sheets: rates of the differences, signs and frames, fold rate, generators against Eq. A.12."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh.analysis import relations
from bh.analysis.creases import FiniteDifferences, SmoothingSpline, along, curve_of, panel_generators
from bh.formulations.state import State
from meshes.errors import InputError

Array = NDArray[np.float64]


def circle(u: Array) -> tuple[Array, Array, Array]:
    return np.column_stack((50 * np.cos(u / 50), 50 * np.sin(u / 50), 0 * u)), 0 * u + 1 / 50, 0 * u


def helix(u: Array) -> tuple[Array, Array, Array]:
    return (
        np.column_stack((16 * np.cos(u / 20), 16 * np.sin(u / 20), 0.6 * u)),
        0 * u + 16 / 400,
        0 * u + 12 / 400,
    )


def parabola(u: Array) -> tuple[Array, Array, Array]:
    x = 20 * np.sinh(u / 40)  # not a polynomial of the parameter: differences would be exact
    return np.column_stack((x, 0 * u, 0.02 * x**2)), 0.04 / (1 + (0.04 * x) ** 2) ** 1.5, 0 * u


CURVES: dict[str, Callable[[Array], tuple[Array, Array, Array]]] = {
    "circle": circle,
    "helix": helix,
    "parabola": parabola,
}


def even(count: int) -> Array:
    return np.linspace(-40.0, 40.0, count + 1)


def staggered(count: int) -> Array:
    """The node line beside a staggered crease: half a cell at both ends."""
    return 80.0 * np.concatenate(([0.0], (np.arange(count) + 0.5) / count, [1.0])) - 40.0


@pytest.mark.parametrize("nodes", [even, staggered])
@pytest.mark.parametrize("name", CURVES)
def test_errors_fall_with_the_fourth_power(name: str, nodes: Callable[[int], Array]) -> None:
    """Everywhere, the ends included."""
    errors = []
    for count in (40, 80, 160):
        u = nodes(count)
        points, kappa, tau = CURVES[name](u)
        found = curve_of(points, u)
        errors.append((np.abs(found.curvature - kappa).max(), np.abs(found.torsion - tau).max()))
    bend, twist = np.array(errors).T
    assert (np.log2(bend[:-1] / bend[1:]) > 3.7).all()
    if name == "helix":
        assert (np.log2(twist[:-1] / twist[1:]) > 3.7).all()
    else:
        assert twist.max() < 1e-12  # plane curves have no torsion
    assert errors[-1][0] < 1e-5 * kappa.max()


def test_the_end_error_is_named() -> None:
    """Larger errors are where `one_sided` says, three samples at either end, and by the factors of the docstring."""
    u = even(80)
    points, kappa, tau = helix(u)
    found = curve_of(points, u)
    assert np.flatnonzero(found.one_sided).tolist() == [0, 1, 2, 78, 79, 80]
    inner = ~found.one_sided
    for value, exact, factor in ((found.curvature, kappa, 15), (found.torsion, tau, 190)):
        error = np.abs(value - exact)
        assert error.max() / error[inner].max() == pytest.approx(factor, rel=0.2)


def test_signs_and_frame() -> None:
    """A right-handed helix has positive torsion; t, n, b are right-handed and n points to the axis."""
    u = even(40)
    found = curve_of(helix(u)[0], u)
    mirrored = curve_of(helix(u)[0] * [1, 1, -1], u)
    assert found.torsion == pytest.approx(12 / 400, rel=1e-3)
    assert mirrored.torsion == pytest.approx(-12 / 400, rel=1e-3)
    axis = np.column_stack((-np.cos(u / 20), -np.sin(u / 20), 0 * u))
    assert np.abs(found.normal - axis).max() < 1e-3
    assert np.cross(found.tangent, found.normal) == pytest.approx(found.binormal, abs=1e-12)
    assert found.speed == pytest.approx(1.0, abs=1e-4)


def test_any_rising_parameter_gives_the_same() -> None:
    u = even(160)
    points, kappa, tau = helix(u)
    for other in (np.arange(161.0), np.exp(u / 50)):
        found = curve_of(points, other)
        assert found.curvature == pytest.approx(kappa, rel=1e-4)
        assert found.torsion == pytest.approx(tau, rel=2e-3)


def test_closed_curves_have_no_ends() -> None:
    points, kappa, _ = circle(np.linspace(0.0, 100 * math.pi, 61))
    found = curve_of(points, closed=True)
    assert not found.one_sided.any()
    assert np.ptp(found.curvature) < 1e-12
    assert found.curvature == pytest.approx(kappa, rel=1e-5)


def test_straight_and_inflected_curves_have_no_nan() -> None:
    u = even(40)
    straight = curve_of(np.column_stack((u, 0 * u, 0 * u)), u)
    assert np.abs(straight.curvature).max() < 1e-12
    assert (straight.torsion == 0.0).all()
    assert np.cross(straight.tangent, straight.normal) == pytest.approx(straight.binormal)
    wave = curve_of(np.column_stack((u, 5 * np.sin(u / 10), 0 * u)), u)  # a node at the inflection
    for field in (wave.torsion, wave.normal, wave.curvature):
        assert np.isfinite(field).all()
    assert np.abs(wave.torsion).max() < 1e-9


def test_smoothing_takes_out_noise() -> None:
    """Noise of 1 micrometre at steps of 1 mm: torsion is lost to differences and found by the spline."""
    u = even(80)
    points, kappa, tau = helix(u)
    noisy = points + 1e-3 * np.random.default_rng(0).normal(size=points.shape)
    rough, smooth = curve_of(noisy, u), curve_of(noisy, u, SmoothingSpline())
    inner = slice(8, -8)
    error = [np.sqrt(np.mean((c.torsion - tau)[inner] ** 2)) for c in (rough, smooth)]
    assert error[0] > 0.02
    assert error[1] < 0.1 * error[0]
    assert np.abs(smooth.curvature - kappa)[inner].max() < 0.1 * np.abs(rough.curvature - kappa)[inner].max()
    exact = curve_of(points, u, SmoothingSpline(0.0))
    assert exact.torsion[inner] == pytest.approx(tau[inner], abs=1e-6)


# --------------------------------------------------------------------------------------- relations 5.3-5.6, A.12


def test_relations_are_inverse_to_each_other() -> None:
    rng = np.random.default_rng(1)
    flat, phi = rng.uniform(0.001, 0.02, 50), rng.uniform(0.3, 3.0, 50)
    left, right, speed = rng.uniform(0.3, 2.8, 50), rng.uniform(0.3, 2.8, 50), rng.uniform(0.5, 2.0, 50)
    kappa = relations.folded_curvature(flat, phi)
    assert relations.flat_curvature(kappa, phi) == pytest.approx(flat)
    assert relations.dihedral_of(flat, kappa) == pytest.approx(phi)
    assert relations.dihedral_of(flat, kappa, valley=True) == pytest.approx(2 * math.pi - phi)
    tau = relations.torsion_of(flat, phi, left, right)
    rate = relations.fold_rate_of(flat, phi, left, right, speed)
    assert relations.torsion_from_fold_rate(rate, left, right, speed) == pytest.approx(tau)
    found = relations.generator_angles(kappa, tau, phi, rate, speed)
    assert found[0] == pytest.approx(left)
    assert found[1] == pytest.approx(right)


def test_observations_of_a4() -> None:
    """A planar crease has gamma_L + gamma_R = pi, a constant fold gamma_L = gamma_R, both pi / 2 (source A.4)."""
    kappa, rate, tau = np.full(5, 0.01), np.linspace(-0.01, 0.01, 5), np.linspace(-0.004, 0.006, 5)
    left, right = relations.generator_angles(kappa, 0.0, 1.8, rate)
    assert left + right == pytest.approx(math.pi)
    left, right = relations.generator_angles(kappa, tau, 1.8, 0.0)
    assert left == pytest.approx(right)
    for side in relations.generator_angles(kappa, 0.0, 1.8, 0.0):
        assert side == pytest.approx(math.pi / 2)
    assert np.isnan(relations.torsion_from_fold_rate(0.0, left, right)).all()


def test_generators_where_nothing_bends() -> None:
    """0 / 0 is interpolated, twist without bending runs along the crease."""
    left, right = relations.generator_angles([0.01, 0.0, 0.01], [0.01, 0.0, -0.01], 2.0, 0.0)
    assert left[1] == pytest.approx(0.5 * (left[0] + left[2]))
    assert np.isfinite(right).all()
    left, _ = relations.generator_angles([0.01, 0.0], [0.0, 0.01], 2.0, 0.0)
    assert left[1] == pytest.approx(math.pi, abs=1e-9)
    for side in relations.generator_angles(np.zeros(3), 0.0, math.pi, 0.0):
        assert side == pytest.approx(math.pi / 2)


# --------------------------------------------------------------------------------------- solved sheets


@cache
def folded(to: float | None = None) -> State:
    """A thin sector; `to` None folds it to 90 degrees with a slow change of 0.2 rad along the crease."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 1.2), along=60, rows=6)
    at = (np.arange(60) + 0.5) / 60
    angle = math.pi / 2 + 0.1 * np.cos(math.pi * at) if to is None else to
    path = bh.trace(
        bh.Model(mesh, bh.Sheet(E=4000.0, t=0.05), formulation="consistent").fold("crease", to=angle)
    )
    assert path.outcome == "reached"
    return path[-1]


@pytest.mark.parametrize("to", [math.pi / 2, 1.5 * math.pi])
def test_profile_of_a_uniform_fold(to: float) -> None:
    profile = along(folded(to), "crease")
    inner = slice(5, -5)
    assert profile.u[-1] == pytest.approx(120.0, rel=1e-4)
    assert profile.flat_curvature == pytest.approx(0.01, rel=1e-4)
    assert profile.signed_curvature[inner] == pytest.approx(profile.isometric_curvature[inner], rel=3e-3)
    assert profile.dihedral == pytest.approx(to, abs=1e-9)
    assert np.abs(profile.fold_rate).max() < 1e-9
    far = slice(20, -20)  # the free ends twist a little (source A.4)
    assert np.abs(profile.torsion[far]).max() < 2e-3 * profile.curvature.max()
    # the crease turns to the left about the upper side, mountain or valley
    assert (profile.signed_curvature > 0.0).all()
    assert np.einsum("kc,kc->k", profile.up, profile.curve.binormal)[inner] == pytest.approx(1.0, abs=1e-3)
    for side in profile.generator_angles:
        assert np.degrees(side[far]) == pytest.approx(90.0, abs=0.1)


def test_fold_rate_is_the_derivative_of_what_is_imposed() -> None:
    profile = along(folded(), "crease")
    u = profile.u / profile.u[-1]
    assert profile.dihedral == pytest.approx(math.pi / 2 + 0.1 * np.cos(math.pi * u), abs=1e-7)
    exact = -0.1 * math.pi / profile.u[-1] * np.sin(math.pi * u)
    assert profile.fold_rate == pytest.approx(exact, abs=2e-3 * np.abs(exact).max())


def test_generators_of_the_panels_are_those_of_the_crease() -> None:
    """Least curvature of either panel against A.12 from the crease alone; with the sign of tau as printed it misses."""
    profile = along(folded(), "crease")
    inner = slice(12, -12)
    printed = relations.generator_angles(
        profile.signed_curvature, -profile.torsion, profile.dihedral, profile.fold_rate, profile.curve.speed
    )
    for side, ours, theirs in zip(("left", "right"), profile.generator_angles, printed, strict=True):
        found = panel_generators(folded(), "crease", side)
        assert np.abs(found.kappa_1 / found.kappa_2)[inner].max() < 0.01
        estimate = np.interp(profile.u, found.u, found.angle)[inner]
        assert np.degrees(np.ptp(estimate)) > 2.0
        assert np.degrees(np.abs(estimate - ours[inner])).max() < 0.4
        assert np.degrees(np.abs(estimate - theirs[inner])).max() > 2.0


def test_the_same_crease_drawn_the_other_way() -> None:
    """Reversed, left and right change places and the signed curvature its sign; curvature and torsion stay."""
    from dataclasses import replace

    state = folded()
    mesh = state.mesh
    pairs = {**mesh.edge_sets, "crease:crease": mesh.crease_edges("crease")[::-1, ::-1]}
    turned = replace(state, mesh=replace(mesh, edge_sets=pairs))
    one, two = along(state, "crease"), along(turned, "crease")
    assert two.signed_curvature == pytest.approx(-one.signed_curvature[::-1])
    assert two.torsion == pytest.approx(one.torsion[::-1], abs=1e-9)
    assert two.fold_rate == pytest.approx(-one.fold_rate[::-1], abs=1e-9)
    inner = slice(8, -8)
    for mine, other in zip(two.generator_angles, one.generator_angles[::-1], strict=True):
        assert mine[inner] == pytest.approx(math.pi - other[::-1][inner], abs=1e-6)
    left = panel_generators(turned, "crease", "left")
    right = panel_generators(state, "crease", "right")
    assert left.angle == pytest.approx(math.pi - right.angle[::-1])


def test_a_full_annulus_is_closed() -> None:
    mesh = meshes.structured(meshes.full_annulus(50.0, 5.0), along=40)
    path = bh.trace(
        bh.Model(mesh, bh.Sheet(E=4000.0, t=0.1), formulation="bars-and-hinges").fold("crease", to=2.9)
    )
    profile = along(path[-1], "crease")
    assert len(profile.u) == 41
    assert not profile.curve.one_sided.any()
    assert profile.curvature[0] == pytest.approx(profile.curvature[-1], rel=1e-9)
    assert profile.flat_curvature == pytest.approx(1 / 50, rel=5e-3)


def test_bad_input() -> None:
    state = folded()
    short = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.5), along=4)
    few = bh.trace(
        bh.Model(short, bh.Sheet(E=4000.0, t=0.1), formulation="bars-and-hinges").fold("crease", to=3.0)
    )[-1]
    with pytest.raises(InputError, match="5 points give no derivative of order 3; give at least 7"):
        along(few, "crease")
    with pytest.raises(InputError, match="no crease 'nonsense'; its creases: crease"):
        along(state, "nonsense")
    with pytest.raises(InputError, match="side 'top' of crease 'crease' is not known; use left or right"):
        panel_generators(state, "crease", "top")
    with pytest.raises(InputError, match="too few for a quintic spline"):
        along(few, "crease", SmoothingSpline())
    with pytest.raises(InputError, match="deviation = -1"):
        SmoothingSpline(-1.0)
    with pytest.raises(InputError, match="parameters u that rise"):
        curve_of(np.zeros((8, 3)), np.zeros(8))
    with pytest.raises(InputError, match="finite array"):
        curve_of(np.zeros(8))
    assert isinstance(bh.creases.FiniteDifferences(), FiniteDifferences)
