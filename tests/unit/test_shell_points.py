"""Point functions and reference tables of the shell's elements."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from fem import points
from fem.spaces import (
    CORNERS,
    EDGES,
    MOMENTS,
    NORMALS,
    STRAINS,
    edge_points,
    gradients,
    hessians,
    regge_interpolation,
    shapes,
    tables,
)

# Python cannot call the functions themselves, which spares every first run three entrances


@njit
def edge_angle(tau, c, t0, d0, g):  # type: ignore[no-untyped-def]
    return points.edge_angle(tau, c, t0, d0, g)


@njit
def edge_angle_hessian(tau, c, t0, H):  # type: ignore[no-untyped-def]
    points.edge_angle_hessian(tau, c, t0, H)


@njit
def curvature_hessian(p, r, y, H):  # type: ignore[no-untyped-def]
    points.curvature_hessian(p, r, y, H)


def unit(v: np.ndarray) -> np.ndarray:
    return np.asarray(v / np.linalg.norm(v))


def angle(z: np.ndarray, t0: np.ndarray, d0: np.ndarray) -> tuple[float, np.ndarray]:
    g = np.empty((2, 3))
    return edge_angle(z[:3].copy(), z[3:].copy(), t0, d0, g), g.ravel()


@pytest.mark.parametrize("case", range(4))
def test_derivatives_of_the_edge_angle(case: int) -> None:
    random = np.random.default_rng(case)
    z, t0 = random.normal(size=6), unit(random.normal(size=3))
    d0 = unit(np.cross(t0, random.normal(size=3)))
    _, g = angle(z, t0, d0)
    H = np.empty((2, 2, 3, 3))
    edge_angle_hessian(z[:3].copy(), z[3:].copy(), t0, H)
    h = 1e-6
    steps = [(angle(z + h * e, t0, d0), angle(z - h * e, t0, d0)) for e in np.eye(6)]
    np.testing.assert_allclose(g, [(a[0] - b[0]) / (2 * h) for a, b in steps], atol=2e-8 * np.abs(g).max())
    hessian = np.array([(a[1] - b[1]) / (2 * h) for a, b in steps])
    np.testing.assert_allclose(
        H.transpose(0, 2, 1, 3).reshape(6, 6), hessian, atol=1e-7 * np.abs(hessian).max()
    )


def test_the_edge_angle_is_the_slope_of_the_outside() -> None:
    """Edge along x, sheet on its left (+y) tilted down towards the inside: the outside rises by that angle."""
    for tilt in (-2.0, -0.3, 0.0, 0.7, 3.0):
        z = np.array([2.0, 0.0, 0.0, 0.4, 3.0 * np.cos(tilt), -3.0 * np.sin(tilt)])
        theta, _ = angle(z, np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
        assert theta == pytest.approx(tilt, abs=1e-14)


def test_a_turned_frame_shifts_the_edge_angle() -> None:
    """Two frames that differ by a turn about t0 give angles that differ by that turn, wherever the edge has gone."""
    random = np.random.default_rng(5)
    t0, z = unit(random.normal(size=3)), random.normal(size=6)
    d0 = unit(np.cross(t0, random.normal(size=3)))
    turned = np.cos(0.4) * d0 - np.sin(0.4) * np.cross(t0, d0)
    shift = angle(z, t0, d0)[0] - angle(z, t0, turned)[0]
    assert np.mod(shift, 2 * np.pi) == pytest.approx(0.4, abs=1e-14)


def test_hessian_of_the_curvature() -> None:
    z = np.random.default_rng(6).normal(size=9)
    H = np.empty((3, 3, 3, 3))
    curvature_hessian(z[:3].copy(), z[3:6].copy(), z[6:].copy(), H)

    def f(z: np.ndarray) -> float:
        return float(unit(np.cross(z[:3], z[3:6])) @ z[6:])

    h, e = 1e-4, np.eye(9)
    values = [
        [f(z + h * (a + b)) - f(z + h * (a - b)) - f(z - h * (a - b)) + f(z - h * (a + b)) for a in e]
        for b in e
    ]
    np.testing.assert_allclose(
        H.transpose(0, 2, 1, 3).reshape(9, 9), np.array(values) / (4 * h * h), atol=1e-6 * np.abs(H).max()
    )


def test_shape_functions() -> None:
    nodes = np.vstack((CORNERS, [edge_points(j, np.array([0.5]))[0] for j in range(3)]))
    np.testing.assert_allclose(shapes(nodes), np.eye(6), atol=1e-15)
    at = np.random.default_rng(7).random((5, 2)) / 2
    h = 1e-5
    for b in range(2):
        step = h * np.eye(2)[b]
        np.testing.assert_allclose(
            gradients(at)[:, :, b], (shapes(at + step) - shapes(at - step)) / (2 * h), atol=1e-9
        )
        difference = (gradients(at + step) - gradients(at - step)) / (2 * h)
        np.testing.assert_allclose(
            np.broadcast_to(hessians()[:, :, b], difference.shape), difference, atol=1e-9
        )


def test_moment_and_strain_tensors_live_on_one_edge() -> None:
    np.testing.assert_allclose(np.einsum("ia,jab,ib->ij", NORMALS, MOMENTS, NORMALS), np.eye(3), atol=1e-15)
    np.testing.assert_allclose(np.einsum("ia,jab,ib->ij", EDGES, STRAINS, EDGES), np.eye(3), atol=1e-15)


def test_regge_interpolation_keeps_linear_strains() -> None:
    """Positions (x, y) -> A (x, y) have the constant metric A^T A, which the interpolant has to give back exactly."""
    nodes = np.vstack((CORNERS, [edge_points(j, np.array([0.5]))[0] for j in range(3)]))
    A = np.random.default_rng(8).normal(size=(3, 2))
    x = nodes @ A.T
    coefficients = 0.5 * np.einsum("cij,ia,ja->c", regge_interpolation(), x, x)
    expected = 0.5 * np.einsum("ka,ab,kb->k", EDGES, A.T @ A, EDGES)
    np.testing.assert_allclose(coefficients, np.repeat(expected, 3), atol=1e-13)


def test_regge_interpolation_keeps_the_stretch_of_an_edge() -> None:
    """Tangential strain on an edge depends on the three nodes of that edge alone: continuous between triangles."""
    Q = regge_interpolation()
    for edge in range(3):
        own = [(edge + 1) % 3, (edge + 2) % 3, 3 + edge]
        other = [i for i in range(6) if i not in own]
        for k in range(2):
            assert np.abs(Q[3 * edge + k][other]).max() < 1e-13
            assert np.abs(Q[3 * edge + k][np.ix_(own, own)]).max() > 0.1


def test_quadrature() -> None:
    t = tables()
    assert t.weights.sum() == pytest.approx(0.5)
    assert t.edge_weights.sum() == pytest.approx(1.0)
    assert t.edge_weights @ t.s**5 == pytest.approx(1 / 6)
    assert t.weights @ (t.factors[:, 0, 0] ** 4) == pytest.approx(1 / 30)
