"""Length and dihedral angle against an independent definition, in extended precision, on all kinds of hinges."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import meshes
from bh.mechanics.shared import kinematics

Array = NDArray[np.float64]
CHECK = settings(deadline=None, derandomize=True, max_examples=150)
QUICK = settings(deadline=None, derandomize=True, max_examples=25)
HINGE = np.array([[0, 1, 2, 3]])
BAR = np.array([[0, 1]])
LONG = np.longdouble


def hinge(dihedral: float, length: float, heights: tuple[float, float], feet: tuple[float, float]) -> Array:
    """(4, 3) wing, edge, edge, wing with the given dihedral angle below the sheet; the edge runs along y."""
    half = 0.5 * (dihedral - math.pi)  # each wing is lifted by this angle
    across, up = math.cos(half), math.sin(half)
    (ha, hb), (sa, sb) = heights, feet
    return np.array(
        [[-ha * across, sa * length, ha * up], [0, 0, 0], [0, length, 0], [hb * across, sb * length, hb * up]]
    )


def rotation(seed: int) -> Array:
    Q, R = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return np.asarray(Q * np.sign(np.linalg.det(Q)))


def angle(x: Array) -> float:
    return float(kinematics.dihedral_angles(np.ascontiguousarray(x), HINGE)[0])


def reference_angles(x: NDArray[np.longdouble]) -> NDArray[np.longdouble]:
    """Dihedral angles of hinges (k, 4, 3) by definition: the angle between the two half planes, below the sheet.

    Written with other products than the kernel: angle of the heights, and the side by which wing a leaves the plane
    of the other triangle.
    """
    a, j, k, b = (x[:, i] for i in range(4))
    e = k - j
    e = e / np.sqrt((e * e).sum(axis=1))[:, None]

    def height(wing: NDArray[np.longdouble]) -> NDArray[np.longdouble]:
        w = wing - j
        return np.asarray(w - (w * e).sum(axis=1)[:, None] * e)

    ua, ub = height(a), height(b)
    cross = np.cross(ua, ub)
    opening = np.arctan2(np.sqrt((cross * cross).sum(axis=1)), (ua * ub).sum(axis=1))
    upper_normal_b = np.cross(ub, e)  # triangle (k, j, b) is counter-clockwise from above
    above = (ua * upper_normal_b).sum(axis=1) > 0
    return np.asarray(np.where(above, 2 * np.arctan2(LONG(0), LONG(-1)) - opening, opening))


Pair = tuple[float, float]
WEIGHTS = ((1, LONG(8) / 12), (-1, LONG(-8) / 12), (2, LONG(-1) / 12), (-2, LONG(1) / 12))


def reference_gradient(x: Array, steps: Array) -> Array:
    """(12,) fourth-order differences of the definition in extended precision; `steps` (4,) one for each vertex."""
    moved, weights = [], []
    for i in range(12):
        for times, weight in WEIGHTS:
            y = x.astype(LONG).copy()
            y[i // 3, i % 3] += times * LONG(steps[i // 3])
            moved.append(y)
            weights.append(weight / LONG(steps[i // 3]))
    terms = reference_angles(np.array(moved)) * np.array(weights)
    return np.asarray(terms.reshape(12, 4).sum(axis=1), dtype=float)


def differenced_gradient(x: Array, steps: Array) -> Array:
    """(12, 12) fourth-order differences of the kernel's gradient."""
    moved, weights = [], []
    for i in range(12):
        for times, weight in WEIGHTS:
            y = x.copy()
            y[i // 3, i % 3] += times * steps[i // 3]
            moved.append(y)
            weights.append(float(weight) / steps[i // 3])
    hinges = np.arange(4 * len(moved)).reshape(-1, 4)
    g = kinematics.dihedral_gradients(np.concatenate(moved), hinges)
    return np.asarray((g * np.array(weights)[:, None]).reshape(12, 4, 12).sum(axis=1))


def sizes(x: Array) -> Array:
    """(4,) length over which the angle varies with a vertex: its height for a wing, the least length for an edge."""
    e = x[2] - x[1]
    length = float(np.linalg.norm(e))
    h = [float(np.linalg.norm(np.cross(x[w] - x[1], e))) / length for w in (0, 3)]
    lever = 1.0 + max(abs(float((x[w] - x[1]) @ e)) / length**2 for w in (0, 3))
    shortest = min(*h, length) / lever
    return np.array([h[0], shortest, shortest, h[1]])


def check_derivatives(x: Array, gradient: float = 1e-10, hessian: float = 1e-8) -> None:
    """Gradient and Hessian against differences, every entry on the scale of its own vertices."""
    size = sizes(x)
    by_entry = np.repeat(size, 3)
    g = kinematics.dihedral_gradients(x, HINGE)[0]
    exact = reference_gradient(x, 1e-4 * size)
    scaled = g * by_entry
    assert np.abs(scaled - exact * by_entry).max() <= gradient * max(1.0, np.abs(scaled).max())

    H = kinematics.dihedral_hessians(x, HINGE)[0]
    differences = differenced_gradient(x, 1e-3 * size)
    both = np.outer(by_entry, by_entry)
    assert np.array_equal(H, H.T)
    assert np.abs((H - differences) * both).max() <= hessian * max(1.0, np.abs(H * both).max())


dihedrals = st.one_of(
    st.floats(0.02, 2 * math.pi - 0.02),
    st.sampled_from(
        [0.02, 0.5 * math.pi, math.pi, math.nextafter(math.pi, 0), 1.5 * math.pi, 2 * math.pi - 0.02]
    ),
)
heights = st.floats(-3.0, 1.0).map(lambda power: 10.0**power)
feet = st.floats(-2.0, 3.0)
seeds = st.integers(0, 10_000)


# --------------------------------------------------------------------------------------- value


@CHECK
@given(dihedrals, st.tuples(heights, heights), st.tuples(feet, feet), seeds)
def test_angle_is_the_one_that_was_folded(dihedral: float, h: Pair, s: Pair, seed: int) -> None:
    x = hinge(dihedral, 1.3, h, s) @ rotation(seed).T
    assert angle(x) == pytest.approx(dihedral, abs=1e-12 * (1.0 + 1.0 / min(h)))


@CHECK
@given(seeds)
def test_angle_of_random_hinges(seed: int) -> None:
    x = np.random.default_rng(seed).normal(size=(4, 3))
    expected = float(reference_angles(x[None].astype(LONG))[0])
    assert angle(x) == pytest.approx(expected, abs=1e-12 / float(sizes(x).min()))
    assert 0.0 <= angle(x) <= 2.0 * math.pi


@QUICK
@given(st.floats(0.02, 2 * math.pi - 0.02), st.tuples(heights, heights), st.tuples(feet, feet), seeds)
def test_rigid_motion_changes_nothing(dihedral: float, h: Pair, s: Pair, seed: int) -> None:
    x = hinge(dihedral, 1.0, h, s)
    Q, shift = rotation(seed), np.random.default_rng(seed).normal(size=3)
    moved = x @ Q.T + shift
    rounding = 1e-14 * float(np.abs(moved).max()) / float(sizes(x).min())
    assert angle(moved) == pytest.approx(angle(x), abs=1e-13 + 10 * rounding)
    assert np.allclose(kinematics.bar_lengths(moved, BAR), kinematics.bar_lengths(x, BAR), rtol=1e-13, atol=0)
    g = kinematics.dihedral_gradients(x, HINGE)[0].reshape(4, 3)
    turned = kinematics.dihedral_gradients(moved, HINGE)[0].reshape(4, 3)
    assert np.abs(turned - g @ Q.T).max() <= (1e-11 + 100 * rounding) * np.abs(g).max()


@QUICK
@given(st.floats(0.02, 2 * math.pi - 0.02), st.tuples(heights, heights), st.tuples(feet, feet))
def test_derivatives_do_no_work_on_rigid_motions(dihedral: float, h: Pair, s: Pair) -> None:
    x = hinge(dihedral, 1.0, h, s)
    g = kinematics.dihedral_gradients(x, HINGE)[0].reshape(4, 3)
    scale = float(np.abs(g).max())
    assert np.abs(g.sum(axis=0)).max() <= 1e-13 * scale * 10
    assert np.abs(np.cross(x, g).sum(axis=0)).max() <= 1e-12 * scale * np.abs(x).max()
    H = kinematics.dihedral_hessians(x, HINGE)[0].reshape(4, 3, 4, 3)
    assert np.abs(H.sum(axis=2)).max() <= 1e-12 * np.abs(H).max()
    # turning the hinge by w turns the gradient: H (w x x) = w x g
    for w in np.eye(3):
        left = np.einsum("aibj,bj->ai", H, np.cross(w, x))
        assert np.abs(left - np.cross(w, g)).max() <= 1e-11 * np.abs(H).max() * np.abs(x).max()


@QUICK
@given(dihedrals, st.tuples(heights, heights), st.tuples(feet, feet))
def test_mirror_image_has_the_explementary_angle(dihedral: float, h: Pair, s: Pair) -> None:
    x = hinge(dihedral, 1.0, h, s)
    mirrored = x * np.array([1.0, 1.0, -1.0])
    assert angle(x) + angle(mirrored) == pytest.approx(2.0 * math.pi, abs=1e-13)
    # left and right wing change places: same angle, seen from the other end
    swapped = np.ascontiguousarray(x[[3, 2, 1, 0]])
    assert angle(swapped) == pytest.approx(angle(x), abs=1e-12)


def test_angle_is_continuous_through_flat() -> None:
    shifts = np.array([-1e-3, -1e-6, -1e-9, -1e-12, 0.0, 1e-12, 1e-9, 1e-6, 1e-3])
    for shift in shifts:
        x = hinge(math.pi + shift, 1.3, (1.0, 0.4), (0.3, 0.8))
        assert angle(x) - math.pi == pytest.approx(shift, abs=1e-15)
    below, above = (
        kinematics.dihedral_hessians(hinge(math.pi + d, 1.3, (1.0, 0.4), (0.3, 0.8)), HINGE)[0]
        for d in (-1e-7, 1e-7)
    )
    assert np.abs(above - below).max() < 1e-5
    flat = hinge(math.pi, 1.3, (1.0, 0.4), (0.3, 0.8))
    flat[:, 2] = 0.0
    assert angle(flat) == math.pi  # not only nearly: a flat sheet has no energy


@pytest.mark.parametrize("seed", range(20))
def test_closed_hinge_is_inside_the_turn(seed: int) -> None:
    """Wings on top of each other: 0 or 2 pi by rounding, never outside of [0, 2 pi]."""
    closed = hinge(0.0, 1.0, (0.7, 0.7), (0.2, 0.2)) @ rotation(seed).T
    phi = angle(closed)
    assert 0.0 <= phi <= 2.0 * math.pi
    assert min(phi, 2.0 * math.pi - phi) < 1e-7


def test_both_ends_of_the_turn_are_read() -> None:
    """The interval is closed: rounding turns a closed hinge into 0 or into exactly 2 pi, and both occur."""
    exactly = np.array([[1.0, 0.5, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.5, 0.0]])
    assert angle(exactly) in (0.0, 2.0 * math.pi)
    mountain, valley = exactly.copy(), exactly.copy()
    mountain[3, 2], valley[3, 2] = -1e-17, 1e-17  # wing b below or above wing a by less than can be resolved
    assert {angle(mountain), angle(valley)} == {0.0, 2.0 * math.pi}


# --------------------------------------------------------------------------------------- derivatives


@CHECK
@given(dihedrals, st.tuples(heights, heights), st.tuples(feet, feet), seeds)
def test_derivatives_of_folded_hinges(dihedral: float, h: Pair, s: Pair, seed: int) -> None:
    """All angles, also flat and nearly closed; wings from 1/1000 to 10 edges high, feet far outside the edge."""
    check_derivatives(hinge(dihedral, 1.3, h, s) @ rotation(seed).T, gradient=1e-9)


@CHECK
@given(seeds)
def test_derivatives_of_random_hinges(seed: int) -> None:
    check_derivatives(np.random.default_rng(seed).normal(size=(4, 3)), gradient=1e-9)


def test_gradient_of_a_right_angled_pair_by_hand() -> None:
    """Wings of height 2 and 1 over the middle of a unit edge: grad = m / h at the wings, half of it at each end."""
    x = np.array([[-2.0, 0.5, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.5, 0.0]])
    g = kinematics.dihedral_gradients(x, HINGE)[0].reshape(4, 3)
    assert np.allclose(g, [[0, 0, 0.5], [0, 0, -0.75], [0, 0, -0.75], [0, 0, 1.0]], atol=1e-15)


@QUICK
@given(seeds)
def test_bar_length(seed: int) -> None:
    x = np.random.default_rng(seed).normal(size=(2, 3))
    length = kinematics.bar_lengths(x, BAR)[0]
    assert length == pytest.approx(math.dist(*x), rel=1e-15)


# --------------------------------------------------------------------------------------- signs, on meshes


PATTERNS = [
    meshes.annulus_sector(100.0, 10.0, 0.7),
    meshes.full_annulus(50.0, 10.0),
    meshes.strip(30.0, 10.0, [4.0]),
]


@pytest.mark.parametrize("pattern", PATTERNS, ids=["sector", "ring", "strip"])
@pytest.mark.parametrize("kind", ["staggered", "alternating", "one-way", "mirrored"])
@pytest.mark.parametrize("rows", [1, 2])
def test_mountain_is_less_than_pi(pattern: meshes.CreasePattern, kind: str, rows: int) -> None:
    """A crease that is pushed to +z is a mountain: angle < pi; pushed to -z a valley: angle > pi."""
    mesh = meshes.structured(pattern, along=12, rows=rows, kind=kind)  # type: ignore[arg-type]
    topology = mesh.topology
    row = np.full(len(topology.edges), -1)
    row[topology.hinge_edges] = np.arange(len(topology.hinges))
    hinges = topology.hinges[row[topology.find_edges(mesh.crease_edges("crease"))]]
    assert np.abs(kinematics.dihedral_angles(mesh.points, hinges) - math.pi).max() < 1e-12
    for push in (0.3, -0.3):
        x = mesh.points.copy()
        x[mesh.nodes("crease:crease"), 2] += push
        phi = kinematics.dihedral_angles(x, hinges)
        assert (phi < math.pi - 0.01).all() if push > 0 else (phi > math.pi + 0.01).all()
