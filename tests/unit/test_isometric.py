"""Isometric theory: frames, generators, development, regression, energies, against closed forms and against `bh`."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh.analysis import relations
from bh.analysis.isometric import FoldedCrease, InterpolatingSpline, Panel, of_crease, of_flat, of_mesh, relax
from meshes.errors import InputError
from verification.theory import cone

Array = NDArray[np.float64]
SHEET = bh.Sheet(E=4000.0, nu=0.38, t=0.127)
D = SHEET.bending_stiffness()


def helix(u: Array) -> Array:
    return np.column_stack((np.cos(u), np.sin(u), 0.3 * u))


def wave(u: Array) -> Array:
    return np.column_stack((u, 5.0 * np.sin(u / 10.0), 0.0 * u))


@cache
def twisted() -> FoldedCrease:
    """Everything varies: curvature, dihedral angle and torsion."""
    return of_flat(
        lambda s: 0.01 + 0.005 * np.sin(s / 20.0),
        lambda s: math.pi / 2 + 0.2 * np.cos(s / 30.0),
        60.0,
        torsion=lambda s: 0.002 * np.cos(s / 25.0),
        start=(3.0, -2.0),
        heading=0.4,
    )


FOLDS: dict[str, Callable[[], FoldedCrease]] = {
    "twisted": twisted,
    "helix": lambda: of_crease(helix, 2.0, interval=(0.0, 4.0)),
    "valley": lambda: of_crease(helix, 4.0, interval=(0.0, 4.0)),
    "inflection": lambda: of_crease(wave, lambda u: 2.0 + 0.1 * np.cos(u / 10.0), interval=(-30.0, 30.0)),
    "planar": lambda: of_crease(
        lambda u: np.column_stack((50 * np.cos(u), 50 * np.sin(u), 0 * u)),
        lambda u: 1.2 + 0.3 * u,
        interval=(0.0, 5.0),
    ),
}


def first_form_gaps(fold: FoldedCrease, v: float) -> tuple[float, float]:
    """Largest differences between folded and flat panel in |x,u|^2 and x,u . x,v; relative."""
    worst = [0.0, 0.0]
    for panel in fold.panels:
        for distance in (0.0, 0.5 * v, v):
            at = np.full(len(fold.u), distance)
            x, y = (
                InterpolatingSpline().derivatives(fold.u, points, fold.u, 1)[1]
                for points in (panel.surface(at), panel.development(at))
            )
            gap = np.abs((x**2).sum(axis=1) - (y**2).sum(axis=1)).max()
            shear = np.abs((x * panel.generator).sum(axis=1) - (y * panel.flat_generator).sum(axis=1)).max()
            worst = [
                max(worst[0], gap / (fold.speed**2).max()),
                max(worst[1], shear / fold.speed.max()),
            ]
    return worst[0], worst[1]


@pytest.mark.parametrize("name", FOLDS)
def test_the_development_is_an_isometry(name: str) -> None:
    """The first fundamental form is that of the flat sheet; both panels keep the crease's geodesic curvature."""
    fold = FOLDS[name]()
    reach = 0.3 * min(fold.largest_width, fold.arc_length[-1])
    assert max(first_form_gaps(fold, reach)) < 1e-8
    turn = InterpolatingSpline().derivatives(fold.u, fold.tangent, fold.u, 1)[1] / fold.speed[:, None]
    flat = (
        InterpolatingSpline().derivatives(fold.u, fold.flat_heading[:, None], fold.u, 1)[1, :, 0] / fold.speed
    )
    scale = np.abs(fold.curvature).max()
    for conormal, sign in zip(fold.conormals, (1.0, -1.0), strict=True):
        geodesic = sign * np.einsum("kc,kc->k", turn, conormal)
        assert np.abs(geodesic - flat).max() < 1e-6 * scale
        assert np.abs(geodesic - fold.geodesic_curvature).max() < 1e-6 * scale


def test_an_isometry_it_would_not_be_with_the_signs_as_printed() -> None:
    """A.12 with the torsion's sign of the source: the normals turn about the generators."""
    fold = twisted()
    printed = relations.generator_angles(
        fold.curvature, -fold.torsion, fold.dihedral, fold.fold_rate, fold.speed
    )
    for angles, least, most in ((fold.generator_angles, 0.0, 1e-7), (printed, 0.5, 1.0)):
        for angle, conormal in zip(angles, fold.conormals, strict=True):
            g = np.cos(angle)[:, None] * fold.tangent + np.sin(angle)[:, None] * conormal
            rate = InterpolatingSpline().derivatives(fold.u, g, fold.u, 1)[1]
            out = np.einsum("kc,kc->k", np.cross(fold.tangent, g), rate) / np.linalg.norm(rate, axis=1)
            assert least <= np.abs(out).max() <= most


@pytest.mark.parametrize("name", FOLDS)
def test_frames(name: str) -> None:
    """Eq. A.5 for the frame, normals across both panels, the dihedral angle between them below the sheet."""
    fold = FOLDS[name]()
    frame = np.stack((fold.tangent, fold.normal, fold.binormal), axis=1)
    assert np.einsum("kic,kjc->kij", frame, frame) == pytest.approx(np.tile(np.eye(3), (len(fold.u), 1, 1)))
    assert np.linalg.det(frame) == pytest.approx(1.0)
    rate = InterpolatingSpline().derivatives(fold.u, frame.reshape(-1, 9), fold.u, 1)[1].reshape(-1, 3, 3)
    zero = np.zeros_like(fold.u)
    kappa, tau = fold.curvature, fold.torsion
    matrix = np.array([[zero, kappa, zero], [-kappa, zero, tau], [zero, -tau, zero]])
    expected = fold.speed[:, None, None] * np.einsum("ijk,kjc->kic", matrix, frame)
    inner = slice(4, -4)
    scale = float((fold.speed * np.hypot(kappa, tau)).max())
    assert np.abs(rate - expected)[inner].max() < 2e-4 * scale  # at inflections torsion is interpolated
    for normal, conormal, panel in zip(fold.normals, fold.conormals, fold.panels, strict=True):
        assert np.cross(fold.tangent, conormal) * panel.sign == pytest.approx(normal, abs=1e-12)
        assert np.einsum("kc,kc->k", panel.generator, normal) == pytest.approx(0.0, abs=1e-12)
        assert np.einsum("kc,kc->k", panel.generator, fold.tangent) == pytest.approx(np.cos(panel.angle))
        assert (np.einsum("kc,kc->k", panel.generator, conormal) >= 0.0).all()
    left, right = fold.conormals
    assert np.einsum("kc,kc->k", left, right) == pytest.approx(np.cos(fold.dihedral))
    below = -np.sign(np.einsum("kc,kc->k", left + right, fold.binormal))
    assert (below == np.sign(math.pi - fold.dihedral)).all()  # mountain panels go down


def test_both_ways_round() -> None:
    """Flat -> folded -> flat gives back curvature, torsion and generators."""
    one = twisted()
    two = of_crease(one.points, one.dihedral, u=one.u, start=one.start, heading=one.heading)
    assert two.curvature == pytest.approx(one.curvature, abs=1e-8)
    assert two.torsion == pytest.approx(one.torsion, abs=1e-6)
    assert two.flat_points == pytest.approx(one.flat_points, abs=1e-7)
    assert two.left.angle == pytest.approx(one.left.angle, abs=1e-4)
    other = of_crease(one.points, one.dihedral, u=np.exp(one.u / 100.0))  # another parameter, other speed
    assert other.right.kappa == pytest.approx(one.right.kappa, rel=1e-3)


def test_symbolic_creases() -> None:
    sympy = pytest.importorskip("sympy")
    u = sympy.Symbol("u")
    exact = of_crease((sympy.cos(u), sympy.sin(u), 0.3 * u), 1.8 + 0.1 * sympy.sin(u), interval=(0.0, 4.0))
    called = of_crease(helix, lambda u: 1.8 + 0.1 * np.sin(u), interval=(0.0, 4.0))
    assert exact.torsion == pytest.approx(0.3 / 1.09, rel=1e-13)
    assert called.torsion == pytest.approx(exact.torsion, rel=1e-6)
    assert called.left.angle == pytest.approx(exact.left.angle, abs=1e-6)
    with pytest.raises(InputError, match="expression of one symbol, but has 2: u, w"):
        of_crease((sympy.cos(u), sympy.Symbol("w"), u), 1.8, interval=(0.0, 4.0))


def test_samples_with_noise() -> None:
    """A scanned crease: half a micrometre of noise on 120 mm, generators within a degree with a smoothing spline."""
    u = np.linspace(0.0, 120.0, 241)
    fold = of_flat(0.01, lambda s: 1.5 + 0.1 * np.cos(s / 40.0), 120.0, samples=241)
    noisy = fold.points + 5e-4 * np.random.default_rng(0).normal(size=fold.points.shape)
    smooth = of_crease(noisy, fold.dihedral, u=u, up=(0, 0, 1), method=bh.isometric.SmoothingSpline())
    rough = of_crease(noisy, fold.dihedral, u=u, up=(0, 0, 1))
    inner = slice(25, -25)
    assert np.degrees(np.abs(smooth.left.angle - fold.left.angle)[inner]).max() < 2.0
    assert np.degrees(np.abs(rough.left.angle - fold.left.angle)[inner]).max() > 20.0


# --------------------------------------------------------------------------------------- closed forms


@pytest.mark.parametrize("phi", [0.6, math.pi / 2, 2.5, 4.5])
def test_the_cone(phi: float) -> None:
    """Eq. 3.13, its energy, its apex as regression curve, and every point of the folded annulus."""
    fold = of_flat(0.01, phi, 80.0, start=(100.0, 0.0), heading=math.pi / 2)
    cot = 1.0 / math.tan(0.5 * phi)
    assert fold.left.regression == pytest.approx(100.0, rel=1e-7)
    assert np.isinf(fold.right.regression).all()
    assert fold.largest_width == pytest.approx(100.0, rel=1e-6)
    for panel, v in ((fold.left, 30.0), (fold.right, 40.0)):
        r = 100.0 - panel.sign * v
        height = r * abs(math.cos(0.5 * phi))  # d_a of Eq. 3.13, from the apex along the axis
        tangent = math.tan(0.5 * phi)
        exact = 1.0 / (tangent * height * math.sqrt(1.0 + tangent**2))
        assert panel.curvature(np.full(len(fold.u), v)) == pytest.approx(panel.sign * exact, rel=1e-7)
        assert exact == pytest.approx(cot / r)
    exact = cone.bending_energy(D, 0.8, 90.0, 110.0, phi)
    assert fold.bending_energy(SHEET, 10.0) == pytest.approx(exact, rel=1e-9)
    assert fold.bending_energy(SHEET, 10.0, nu=0.0) == pytest.approx(exact * (1.0 - 0.38**2), rel=1e-9)
    if phi > math.pi:
        return
    radius, azimuth = np.meshgrid(np.linspace(91.0, 109.0, 7), np.linspace(0.0, 0.8, 9))
    flat = np.column_stack(((radius * np.cos(azimuth)).ravel(), (radius * np.sin(azimuth)).ravel()))
    placed = fold.place(flat)
    known = cone.folded_points(radius.ravel(), azimuth.ravel(), 100.0, phi)
    gaps = np.linalg.norm(placed[:, None] - placed, axis=2) - np.linalg.norm(known[:, None] - known, axis=2)
    assert np.abs(gaps).max() < 1e-8


def test_fig_a7() -> None:
    """Planar with varying angle: gamma_L + gamma_R = pi; helix, constant angle: equal; planar and constant: pi / 2."""
    ends = (0.0, 15.0 * math.pi / 8.0)

    def circle(u: Array) -> Array:
        return np.column_stack((np.cos(u), np.sin(u), 0.0 * u))

    unfolding = of_crease(circle, lambda u: 0.3 * math.pi + 0.1 * u, interval=ends)
    assert unfolding.left.angle + unfolding.right.angle == pytest.approx(math.pi, abs=1e-7)
    assert np.abs(unfolding.left.angle - 0.5 * math.pi).max() > 0.05
    uniform = of_crease(helix, 0.6 * math.pi, interval=ends)
    assert uniform.left.angle == pytest.approx(uniform.right.angle, abs=1e-9)
    assert np.abs(uniform.left.angle - 0.5 * math.pi).min() > 0.1
    both = of_crease(circle, 0.6 * math.pi, interval=ends)
    for panel in both.panels:
        assert panel.angle == pytest.approx(0.5 * math.pi, abs=1e-7)
    for fold in (unfolding, uniform, both):
        assert fold.largest_width > 0.2  # that of the figure
        mesh, folded = fold.ruled_mesh(0.2)
        assert fold.place(mesh.points) == pytest.approx(folded, abs=1e-6)


def test_curvature_of_the_surface() -> None:
    """kappa_2 from the second fundamental form of the ruled surface by its definition; kappa_1 along g is zero."""
    fold = twisted()
    spline = InterpolatingSpline()
    for panel in fold.panels:
        for v in (0.0, 8.0):
            x = panel.surface(np.full(len(fold.u), v))
            xu, xuu = spline.derivatives(fold.u, x, fold.u, 2)[1:]
            xuv = spline.derivatives(fold.u, panel.generator, fold.u, 1)[1]
            normal = panel.normal  # the same along a generator
            first = np.array(
                [
                    [(xu * xu).sum(1), (xu * panel.generator).sum(1)],
                    [(xu * panel.generator).sum(1), np.ones(len(xu))],
                ]
            )
            second = np.array(
                [[(xuu * normal).sum(1), (xuv * normal).sum(1)], [(xuv * normal).sum(1), 0.0 * fold.u]]
            )
            shape = np.linalg.solve(np.moveaxis(first, -1, 0), np.moveaxis(second, -1, 0))
            inner = slice(5, -5)
            assert np.abs(np.linalg.det(shape))[inner].max() < 1e-8 * np.abs(panel.kappa).max() ** 2 * 100
            assert panel.curvature(np.full(len(fold.u), v))[inner] == pytest.approx(
                np.trace(shape, axis1=1, axis2=2)[inner], rel=1e-5
            )


def test_energy_is_the_integral_over_the_surface() -> None:
    """Against a fine mesh: sum of 1/2 D kappa_2^2 over its triangles' areas; trimming at the ends included."""
    fold = twisted()
    v = fold.reach(12.0)
    total = 0.0
    t = (np.arange(40) + 0.5) / 40
    for panel, reach in zip(fold.panels, v, strict=True):
        at = reach[:, None] * t
        area = panel.speed[:, None] * np.sin(panel.angle)[:, None] * (1 - panel.convergence[:, None] * at)
        total += np.trapezoid((0.5 * D * panel.curvature(at) ** 2 * area).mean(axis=1) * reach, fold.u)
    assert fold.bending_energy(SHEET, 12.0) == pytest.approx(total, rel=1e-4)


# --------------------------------------------------------------------------------------- widths, places, degenerate


def test_regression_curves_bound_the_width() -> None:
    fold = of_flat(0.02, 2.0, 60.0)
    with pytest.raises(InputError, match=r"generators of the left panel meet at u = .*narrower than 50 mm"):
        fold.bending_energy(SHEET, 51.0)
    left, right = fold.reach(51.0, trim=True)
    assert left == pytest.approx(0.999 * 50.0)
    assert right == pytest.approx(51.0)
    assert fold.bending_energy(SHEET, 49.0) < fold.bending_energy(SHEET, 51.0, trim=True)
    with pytest.raises(InputError, match="reaches its regression curve, 50 mm along"):
        fold.left.curvature(np.full(len(fold.u), 50.0))
    with pytest.raises(InputError, match="lies beyond the regression curve of the left panel"):
        fold.place([[-5.6, 58.3]])
    with pytest.raises(InputError, match="reaches its regression curve"):
        fold.ruled_mesh(51.0)
    assert fold.ruled_mesh(51.0, trim=True)[0].areas.min() > 0.0


def test_generators_that_meet_touch_on_the_regression_curve() -> None:
    """Neighbouring generators intersect where `regression` says."""
    fold = of_crease(wave, lambda u: 2.0 + 0.1 * np.cos(u / 10.0), interval=(-30.0, 30.0), samples=4001)
    for panel in fold.panels:
        v = 0.5 * (panel.regression[1:] + panel.regression[:-1])
        i = np.flatnonzero(v < 100.0)
        a, b = panel.flat_crease[i], panel.flat_crease[i + 1]
        g, h = panel.flat_generator[i], panel.flat_generator[i + 1]
        cross = g[:, 0] * h[:, 1] - g[:, 1] * h[:, 0]
        at = ((b - a)[:, 0] * h[:, 1] - (b - a)[:, 1] * h[:, 0]) / cross
        assert at == pytest.approx(v[i], rel=2e-3)


@pytest.mark.parametrize("name", FOLDS)
def test_places_keep_lengths(name: str) -> None:
    """Small triangles anywhere on the flat sheet keep their sides; also beyond the last generators."""
    fold = FOLDS[name]()
    width = 0.5 * min(fold.largest_width, 0.3 * fold.arc_length[-1])
    mesh, folded = fold.mesh(width, along=40, rows=3)
    crease = mesh.nodes("crease:crease")
    assert folded[crease] == pytest.approx(
        InterpolatingSpline().through(fold.u, fold.points)(np.linspace(fold.u[0], fold.u[-1], 41)), abs=1e-7
    )
    rng = np.random.default_rng(2)
    middle = mesh.points[mesh.triangles].mean(axis=1)[:, :2]
    ends = fold.flat_points[[0, -1]]
    middle = np.concatenate((middle, ends + 0.2 * width * rng.normal(size=(2, 2))))
    step = 1e-3 * width
    for direction in ([1.0, 0.0], [0.6, 0.8], [-0.8, 0.6]):
        ahead = fold.place(middle + step * np.array(direction))
        here = fold.place(middle)
        assert np.linalg.norm(ahead - here, axis=1) == pytest.approx(step, rel=1e-5)


def test_straight_inflected_and_flat_creases_are_finite() -> None:
    def s_curve(u: Array) -> Array:  # a straight middle between two opposite bends
        bend = np.maximum(np.abs(u) - 5.0, 0.0) ** 5 * 1e-4
        return np.column_stack((u, np.sign(u) * bend, 0.0 * u))

    folds = [
        of_crease(lambda u: np.column_stack((u, 0 * u, 0 * u)), 2.0, interval=(0.0, 50.0)),
        of_crease(wave, 2.0, interval=(-30.0, 30.0)),
        of_crease(s_curve, 2.0, interval=(-10.0, 10.0)),
        of_flat(0.01, math.pi, 50.0),
        of_flat(0.0, 1.0, 50.0),
    ]
    for fold in folds:
        for panel in fold.panels:
            for values in (panel.angle, panel.generator, panel.kappa, panel.normal, panel.convergence):
                assert np.isfinite(values).all()
        assert np.isfinite(fold.bending_energy(SHEET, 0.5))
        assert np.isfinite(fold.place([[1.0, 0.1]])).all()
    assert folds[0].bending_energy(SHEET, 5.0) < 1e-15
    assert folds[3].bending_energy(SHEET, 5.0) < 1e-15
    # generators cross an inflection at a right angle where the fold is uniform, and the binormal does not turn over
    for panel in folds[1].panels:
        assert panel.angle == pytest.approx(0.5 * math.pi, abs=1e-6)
    assert (folds[1].binormal @ folds[1].binormal[0] > 0.999).all()
    assert folds[1].curvature.min() < -0.04 < 0.04 < folds[1].curvature.max()


# --------------------------------------------------------------------------------------- against `bh`


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
def test_the_isometric_sheet_is_a_good_first_guess(formulation: str) -> None:
    """Fewer iterations from it than folding from flat in increments of 15 to 27 degrees takes, to the same state."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.785), along=16, rows=2)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), formulation=formulation).fold(
        "crease", to=math.pi / 2
    )
    steady = bh.LoadControl(first_rotation=math.radians(15.0), largest_rotation=math.radians(27.0))
    path = bh.trace(model, strategy=steady)
    guess = of_mesh(mesh, "crease", math.pi / 2).place(mesh.points)
    found = relax(model, guess)
    assert found.converged
    assert found.iterations < path.iterations
    assert found.state.energy.total == pytest.approx(path[-1].energy.total, rel=1e-9)
    assert found.moved.max() < 1.0


def test_a_thin_sheet_folds_isometrically() -> None:
    """The isometric sheet as truth, for a crease that is no arc: to micrometres."""
    mesh = meshes.structured(meshes.parabolic_canopy(60.0, 30.0, creases=1, sag=4.0), along=32, rows=3)
    fold = of_mesh(mesh, "crease", 2.2)
    nodes = mesh.nodes("crease:crease")
    known = fold.place(mesh.points[nodes])
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.05), formulation="consistent").fold("crease", to=2.2)
    path = bh.trace(model)
    assert path.outcome == "reached"
    found = path[-1].points[nodes]
    gaps = np.linalg.norm(found[:, None] - found, axis=2) - np.linalg.norm(known[:, None] - known, axis=2)
    assert np.abs(gaps).max() < 3e-3  # mm, on a crease of 60 mm whose ends come together by 0.18 mm
    flat = mesh.points[nodes]
    shortened = np.linalg.norm(flat[-1] - flat[0]) - np.linalg.norm(found[-1] - found[0])
    assert shortened == pytest.approx(0.18, abs=0.005)


def test_the_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    """What docs/isometric.md shows first."""
    page = (Path(__file__).resolve().parents[2] / "docs" / "isometric.md").read_text(encoding="utf-8")
    exec(page.split("```python\n")[1].split("```")[0], {})
    assert len(capsys.readouterr().out.splitlines()) > 5


def test_bad_input() -> None:
    with pytest.raises(InputError, match="u = 0 cannot be folded without stretching; give angles between"):
        of_flat(0.01, 0.0, 50.0)
    with pytest.raises(InputError, match="angles are radians, not degrees"):
        of_flat(0.01, 90.0, 50.0)
    with pytest.raises(InputError, match="needs its parameters u, or the interval"):
        of_crease(helix, 2.0)
    with pytest.raises(InputError, match=r"the interval \(3, 1\) of a crease is empty"):
        of_crease(helix, 2.0, interval=(3.0, 1.0))
    with pytest.raises(InputError, match="the crease has shape"):
        of_crease(np.zeros((9, 2)), 2.0, u=np.arange(9.0))
    with pytest.raises(InputError, match="the crease stops"):
        of_crease(lambda u: np.column_stack((u**3, u**3, u**3)), 2.0, interval=(-1.0, 1.0))
    with pytest.raises(InputError, match="the dihedral angle is not finite at u = 0"):
        of_crease(helix, lambda u: np.where(u > 0, 2.0, np.nan), interval=(0.0, 1.0))
    with pytest.raises(InputError, match="width = -1"):
        twisted().reach(-1.0)
    with pytest.raises(InputError, match="length = 0"):
        of_flat(0.01, 2.0, 0.0)
    ring = meshes.structured(meshes.full_annulus(50.0, 5.0), along=20)
    with pytest.raises(InputError, match="crease 'crease' is closed"):
        of_mesh(ring, "crease", 2.0)
    assert isinstance(twisted().left, Panel)
