"""The shell on stress-free surfaces that are not flat."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
from bh.errors import ModelError
from bh.loading.builder import load_steps
from fem.kirchhoff_love import CurvedShell, Shell, follow, linear_response
from fem.shell import first_frames, maps, shell_elements
from fem.spaces import tables
from fem.system import ShellSystem
from meshes.curved import QuadraticMesh, lay_on, lift
from meshes.errors import MeshError
from verification.theory import curved_shells as curved
from verification.theory.shell_benchmarks import FULL_MOMENT, grid, rectangle

Array = NDArray[np.float64]
SHEET = bh.Sheet(E=1000.0, nu=0.3, t=0.1)


def bowl(at: Array) -> Array:
    """A surface with double curvature of both signs, from a chart that is not isometric."""
    x, y = at[:, 0] + 0.1 * at[:, 1] ** 2, 1.3 * at[:, 1]
    return np.column_stack((x, y, 0.2 * x**2 - 0.15 * x * y + 0.1 * np.sin(2.0 * y)))


def surface() -> QuadraticMesh:
    return lay_on(rectangle(2.0, 1.5, 4, 3), bowl)


def rotation() -> Array:
    turn, _ = np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))
    return np.asarray(turn * np.sign(np.linalg.det(turn)))


def loaded(mesh: QuadraticMesh) -> ShellSystem:
    model = bh.Model(mesh.sheet, SHEET, formulation="shell", contact=False)
    model = model.support("edge:start", "xyz", clamp=True).force("edge:end", total=(0.1, 0.2, -0.3))
    return CurvedShell(mesh).system(model, load_steps(model)[0], None)


def test_a_surface_is_at_rest_where_it_lies() -> None:
    """No energy and no force before the load, and the area of the surface, not of its chart."""
    system = loaded(surface())
    here = system.evaluate(system.start(), 0.0)
    assert here.energy == 0.0
    assert np.abs(here.residual).max() == 0.0
    fine = lay_on(rectangle(2.0, 1.5, 32, 24), bowl)
    exact = float(fine.sheet.areas.sum())  # of 1,536 flat triangles
    assert float(system.elements.areas.sum()) == pytest.approx(exact, rel=3e-4)


def test_rigid_motion_of_a_surface_stores_nothing() -> None:
    elements = shell_elements(surface(), SHEET)
    x = elements.mesh.nodes @ rotation().T + [3.0, -2.0, 5.0]
    frames = first_frames(elements.mesh)
    still = np.zeros((len(elements.areas), 3, 2))
    _, curvature = elements.measures(x, still, frames)
    B = elements.gradients(x, frames)
    gamma = np.zeros_like(still)
    for j in range(3):
        block = B[:, 9 + 3 * j : 11 + 3 * j, 18 + 2 * j : 20 + 2 * j]
        gamma[:, j] = -np.linalg.solve(block, curvature[:, 3 * j : 3 * j + 2, None])[..., 0]
    assert np.abs(gamma).max() > 0.3
    strain, curvature = elements.measures(x, gamma, frames)
    other, _ = elements.measures(1.001 * elements.mesh.nodes, still, frames)
    assert np.abs(strain).max() < 1e-10 * np.abs(other).max()
    assert np.abs(elements.forces(strain, curvature)[:, 9:]).max() < 1e-9 * SHEET.bending_stiffness()


def test_derivatives_on_a_surface() -> None:
    """Residual and tangent against central differences at a state far from equilibrium."""
    system = loaded(surface())
    random = np.random.default_rng(1)
    q = system.start() + 0.05 * random.normal(size=system.size)
    v, h = random.normal(size=system.size), 1e-6
    here = system.evaluate(q, 0.4)
    ahead, behind = system.evaluate(q + h * v, 0.4), system.evaluate(q - h * v, 0.4)
    assert here.residual @ v == pytest.approx((ahead.energy - behind.energy) / (2 * h), rel=1e-6)
    change = (ahead.residual - behind.residual) / (2 * h)
    product = system.tangent(q, 0.4, here.forces).matrix @ v
    np.testing.assert_allclose(product, change, atol=1e-7 * np.abs(change).max())


def test_a_plane_from_a_crooked_chart_is_the_flat_sheet() -> None:
    """Stretched, sheared and turned in space by the chart, it does what the same flat mesh does."""
    chart = rectangle(2.0, 1.5, 4, 3)
    A = rotation()[:, :2] @ np.array([[1.2, 0.4], [0.1, 0.7]])
    mesh = lay_on(chart, lambda at: at @ A.T)
    push = tuple(0.02 * np.linalg.cross(A[:, 0], A[:, 1]))
    flat = bh.Model(
        replace(chart, points=chart.points[:, :2] @ A.T), SHEET, formulation="shell", contact=False
    )
    states = []
    for model, shell in ((flat, Shell()), (replace(flat, mesh=mesh.sheet), CurvedShell(mesh))):
        pushed = model.support("edge:start", "xyz", clamp=True).force("edge:end", total=push)
        states.append(follow(pushed, shell=shell)[0][-1])
    assert np.abs(states[0].points - flat.mesh.points).max() > 0.3
    np.testing.assert_allclose(states[1].points, states[0].points, atol=1e-9)
    assert states[1].energy.total == pytest.approx(states[0].energy.total, rel=1e-10)


def test_a_cylinder_is_the_flat_sheet_that_rolled_itself_up() -> None:
    """Natural curvature brings the flat sheet to the cylinder; from there a force moves both alike."""
    along, curvature, push = 12, math.pi / 4.0 / 2.0, (0.0, 0.002, 0.004)
    chart = rectangle(2.0, 1.0, along, 6)

    def roll(at: Array) -> Array:
        angle, radius = curvature * at[:, 0], 1.0 / curvature
        return np.column_stack((radius * np.sin(angle), at[:, 1], radius * (1.0 - np.cos(angle))))

    thin = replace(SHEET, t=0.02)
    flat = bh.Model(chart, thin, formulation="shell", contact=False).support("edge:start", "xyz", clamp=True)
    flat = flat.step(bh.Expand(through=(curvature, 0.0))).force("edge:end", total=push)
    states, _ = follow(flat)
    rolled = next(state for state in states if state.step == 0 and state.lam == 1.0)
    mesh = lay_on(chart, roll)
    model = bh.Model(mesh.sheet, thin, formulation="shell", contact=False)
    model = model.support("edge:start", "xyz", clamp=True).force("edge:end", total=push)
    end = follow(model, shell=CurvedShell(mesh))[0][-1]
    np.testing.assert_allclose(rolled.points, mesh.sheet.points, atol=3e-4)
    one, other = end.points - mesh.sheet.points, states[-1].points - rolled.points
    assert np.abs(one).max() > 0.1
    np.testing.assert_allclose(one, other, atol=5e-3 * np.abs(one).max())


def test_axes_of_a_surface_measure_it() -> None:
    """The maps into tangent planes have the metric of the surface, and turn nothing inside out."""
    mesh, slopes = surface(), tables(2).slopes
    F = maps(mesh, slopes)
    three = np.einsum("tnc,qnd->tqcd", mesh.nodes[mesh.triangles], slopes)
    np.testing.assert_allclose(
        np.einsum("tqca,tqcb->tqab", F, F), np.einsum("tqca,tqcb->tqab", three, three), atol=1e-12
    )
    assert (np.linalg.det(F) > 0.0).all()


def test_moments_of_a_surface_are_those_of_its_closed_form() -> None:
    """The opened ring has the couple in every triangle: the trace of the moments, for their axes differ."""
    benchmark, moments = curved.opened_ring(24)
    state = follow(benchmark.model, moments, shell=benchmark.shell)[0][-1]
    couple = -curved.OPENED * FULL_MOMENT
    bent = state.moments[:, 0] + state.moments[:, 1]
    np.testing.assert_allclose(bent, couple, rtol=0.02)


def test_the_opened_ring_converges_with_order_four() -> None:
    energy, x, z = curved.opened_ring_exact()
    errors = []
    for along in (12, 24):
        benchmark, moments = curved.opened_ring(along)
        states, _ = follow(benchmark.model, moments, shell=benchmark.shell)
        tip = states[-1].points[list(benchmark.at)].mean(axis=0)
        errors.append((abs(states[-1].energy.total / energy - 1.0), math.hypot(tip[0] - x, tip[2] - z)))
    rates = np.log2(errors[0]) - np.log2(errors[1])
    np.testing.assert_allclose(rates, 4.0, atol=0.2)


@pytest.mark.parametrize("name", ["hole", "closed"])
def test_pinched_hemispheres(name: str) -> None:
    """MacNeal and Harder's displacements, and the same outward as inward by symmetry."""
    make = {"hole": curved.open_hemisphere, "closed": curved.closed_hemisphere}[name]
    benchmark = make(16)
    moved, _ = linear_response(benchmark.model, benchmark.shell)
    out, inward = (float(moved[at, axis]) for axis, at in enumerate(benchmark.at))
    assert out == pytest.approx(-inward, rel=1e-6)
    assert out == pytest.approx({"hole": 0.0940, "closed": 0.0924}[name], rel=0.01)


def test_linear_response_is_the_slope_of_the_path() -> None:
    benchmark = curved.twisted_strip(12, 0.32, "z")
    moved, unknowns = linear_response(benchmark.model, benchmark.shell)
    small = replace(benchmark.model, steps=()).force("edge:end", total=(0.0, 0.0, 1e-3))
    states, increments = follow(small, shell=benchmark.shell)
    slope = (states[-1].points - benchmark.mesh.sheet.points) / 1e-3
    assert unknowns == len(increments[-1].point.q)
    np.testing.assert_allclose(slope, moved, atol=1e-5 * np.abs(moved).max())


def test_the_hook_as_a_beam_is_softer_by_its_torsion() -> None:
    """0.63 t / w of the twist, which is nearly all of it."""
    ratio = curved.hook_beam(thin=True) / curved.hook_beam(thin=False)
    assert ratio == pytest.approx(1.0 - 0.063, abs=2e-3)


def test_a_surface_refuses_what_it_cannot_be() -> None:
    chart = rectangle(2.0, 1.5, 4, 3)
    with np.errstate(invalid="ignore"):
        for odd in (lambda at: at, lambda at: np.column_stack((at, np.sqrt(at[:, 0] - 1.0)))):
            with pytest.raises(MeshError, match="finite points"):
                lay_on(chart, odd)
    with pytest.raises(MeshError, match="no area"):
        lay_on(chart, lambda at: np.column_stack((at[:, :1], 0.0 * at)))
    mesh = surface()
    other = bh.Model(surface().sheet, SHEET, formulation="shell")
    step = load_steps(other.support("edge:start", "xyz").force("edge:end", total=(0, 0, 1)))[0]
    with pytest.raises(ModelError, match="another mesh than the surface"):
        CurvedShell(mesh).system(other, step, None)
    zone = bh.SheetZone("all", bh.Sheet(E=1.0, nu=0.0, t=1.0))
    zoned = replace(bh.Model(mesh.sheet, SHEET, formulation="shell"), zones=(zone,))
    with pytest.raises(ModelError, match="one isotropic material"):
        CurvedShell(mesh).elements(zoned)


def test_named_places_of_a_chart_are_those_of_its_surface() -> None:
    chart = grid(lambda u, v: np.column_stack((u, v)), 3, 2)
    mesh = lay_on(chart, bowl)
    assert dict(mesh.sheet.corners) == dict(chart.corners)
    assert set(mesh.sheet.edge_sets) == set(chart.edge_sets)
    np.testing.assert_allclose(mesh.nodes, bowl(lift(chart).planar))
    assert not mesh.flat
