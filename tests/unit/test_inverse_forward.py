"""Frames, angles and chains of Ch. 6 against scipy's Rotation; folded segments against the arc; simulated ones."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bh.applications.inverse.segments import DesignError, Domain, beyond, folded, folded_transforms, grid
from bh.applications.inverse.simulate import SegmentTask, model, simulate
from bh.applications.inverse.transforms import angles, chain, frame, matrix, relative

# --- rotations ----------------------------------------------------------------------------------------------


def test_matrix_is_scipys() -> None:
    uvw = np.random.default_rng(1).uniform(-math.pi, math.pi, (200, 3))
    np.testing.assert_allclose(matrix(uvw), Rotation.from_euler("xyz", uvw).as_matrix(), atol=1e-14)


def test_angles_are_scipys() -> None:
    r = Rotation.random(500, random_state=2)
    np.testing.assert_allclose(angles(r.as_matrix()), r.as_euler("xyz"), atol=1e-12)


@pytest.mark.parametrize("v", [0.5 * math.pi, -0.5 * math.pi])
@pytest.mark.parametrize("off", [0.0, 1e-15, 1e-12])
def test_gimbal_lock(v: float, off: float) -> None:
    """A vertical tangent, exactly or nearly: w = 0, and the angles give the rotation back."""
    r = Rotation.from_euler("xyz", [0.3, v - math.copysign(off, v), 0.5])
    found = angles(r.as_matrix())
    assert found[2] == 0.0
    assert found[1] == pytest.approx(v, abs=1e-9)
    np.testing.assert_allclose(matrix(found), r.as_matrix(), atol=1e-9)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # scipy tells of the lock
        assert math.remainder(found[0] - r.as_euler("xyz")[0], 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


def printed(r: np.ndarray) -> np.ndarray:
    """Eq. 6.14 to 6.16 as they are printed."""
    xz = r[2, 0]
    v = -np.arcsin(xz)
    if xz == 1.0:
        return np.array([np.arctan2(-r[0, 1], -r[0, 2]), v, 0.0])
    if xz == -1.0:
        return np.array([np.arctan2(r[0, 1], r[0, 2]), v, 0.0])
    c = np.cos(v)
    return np.array([np.arctan2(r[2, 1] / c, r[2, 2] / c), v, np.arctan2(r[1, 0] / c, r[0, 0] / c)])


def test_where_the_printed_equations_differ() -> None:
    """Not in exact arithmetic; next to a vertical tangent arcsin loses half of the digits, or its argument passes 1."""
    ordinary = Rotation.random(100, random_state=3).as_matrix()
    np.testing.assert_allclose([printed(r) for r in ordinary], angles(ordinary), atol=1e-9)
    exact = np.array(
        [[0.0, math.sin(0.4), math.cos(0.4)], [0.0, math.cos(0.4), -math.sin(0.4)], [-1.0, 0.0, 0.0]]
    )
    np.testing.assert_allclose(printed(exact), angles(exact), atol=1e-15)
    v = 0.5 * math.pi - 1e-7
    near = matrix([0.3, v, 0.5])
    assert abs(angles(near)[1] - v) < 1e-15
    assert 1e-11 < abs(printed(near)[1] - v) < 1e-8
    near[2, 0] = np.nextafter(-1.0, -2.0)  # what rounding can make
    with np.errstate(invalid="ignore"):
        assert np.isnan(printed(near)).all()
    assert np.isfinite(angles(near)).all()


def test_frame_of_a_section() -> None:
    """A mountain fold that runs along +x: tangent, from the right to the left edge, up."""
    found = frame([0, 0, 0], [0, 1, -1], [0, -1, -1])
    np.testing.assert_allclose(found, np.eye(3), atol=1e-15)
    turn = Rotation.random(random_state=4).as_matrix()
    np.testing.assert_allclose(frame([0, 0, 0], turn @ [0, 1, -1], turn @ [0, -1, -1]), turn, atol=1e-14)


def test_chain_is_a_product_of_motions() -> None:
    """Against 4 x 4 matrices, for several designs at once; `relative` undoes a step."""
    rng = np.random.default_rng(5)
    t, r = rng.normal(size=(7, 3, 3)), Rotation.random(21, random_state=6).as_matrix().reshape(7, 3, 3, 3)
    points, frames = chain(t, r, origin=[1.0, 2.0, 3.0], start=r[0, 0])
    for d in range(7):
        here = np.eye(4)
        here[:3, :3], here[:3, 3] = r[0, 0], [1.0, 2.0, 3.0]
        for i in range(3):
            step = np.eye(4)
            step[:3, :3], step[:3, 3] = r[d, i], t[d, i]
            here = here @ step
            np.testing.assert_allclose(points[d, i + 1], here[:3, 3], atol=1e-13)
            np.testing.assert_allclose(frames[d, i + 1], here[:3, :3], atol=1e-13)
    back = relative((points[:, 1], frames[:, 1]), (points[:, 2], frames[:, 2]))
    np.testing.assert_allclose(back[0], t[:, 1], atol=1e-13)
    np.testing.assert_allclose(back[1], r[:, 1], atol=1e-13)


# --- folded segments ----------------------------------------------------------------------------------------


def test_folded_segment_is_the_arc() -> None:
    """Eq. 6.6 to 6.8 as printed, and the limit of a straight crease."""
    k0, length = np.array([0.004, -0.01, 0.02]), np.array([150.0, 200.0, 105.0])
    k = k0 / math.sin(math.pi / 4)
    t, uvw = folded(k0, length)
    np.testing.assert_allclose(t[:, 0], np.sin(np.abs(k) * length) / np.abs(k), rtol=1e-13)
    np.testing.assert_allclose(t[:, 1], (1.0 - np.cos(np.abs(k) * length)) / k, rtol=1e-12)
    np.testing.assert_allclose(uvw, np.column_stack((0 * k, 0 * k, k * length)), rtol=1e-14)
    assert folded(0.0, 100.0)[0].tolist() == [100.0, 0.0, 0.0]
    tiny = folded(1e-12, 100.0)[0]
    np.testing.assert_allclose(tiny[:2], [100.0, 0.5 * 1e-12 * math.sqrt(2.0) * 100.0**2], rtol=1e-12)


def test_an_arc_in_pieces_is_the_arc() -> None:
    whole, _ = folded(0.006, 300.0)
    points, frames = chain(*folded_transforms(np.full(3, 0.006), np.array([120.0, 80.0, 100.0])))
    np.testing.assert_allclose(points[-1], whole, atol=1e-12)
    np.testing.assert_allclose(angles(frames[-1])[2], 0.006 * 300.0 * math.sqrt(2.0), atol=1e-13)


def test_grid_is_the_sources() -> None:
    k0, length = grid()
    assert len(k0) == 2487
    assert Domain().holds(k0, length).all()
    assert set(zip(k0.round(9), length, strict=True)) == set(zip((-k0).round(9), length, strict=True))
    more, at = beyond()
    assert not Domain().holds(more, at).any()


# --- pinched segments by simulation -------------------------------------------------------------------------


def test_a_folded_strip_is_close_to_the_arc() -> None:
    """Bars and hinges without a pinch: the plane arc to within one per cent of the length (the source: 0.6 %)."""
    found = simulate([0.01], [100.0], [False])
    t, r = (x[()] for x in folded_transforms(0.01, 100.0))
    assert np.linalg.norm(found.t - t) < 1.0
    assert np.abs(found.r - r).max() < 0.02


def test_pinched_segments_are_mirror_images() -> None:
    right, left = (SegmentTask()({"k0": k0, "length": 100.0}) for k0 in (0.01, -0.01))
    mirror = np.array([1.0, -1.0, 1.0])
    np.testing.assert_allclose(right["t"], mirror * left["t"], atol=1e-6)
    np.testing.assert_allclose(right["uvw"], -mirror * left["uvw"], atol=1e-6)
    np.testing.assert_allclose(right["end_dihedral"], 0.5 * math.pi, atol=math.radians(1.0))
    assert right["stable"] == left["stable"] == 1.0
    # the pinch bends the crease further: the whole turn is larger than that of the arc
    assert right["uvw"][2] > 0.01 * 100.0 * math.sqrt(2.0)


def test_pinches_are_where_they_should_be() -> None:
    """The smallest dihedral angle is pi / 14, in the middle of each pinched segment."""
    found = simulate([0.004, -0.004, 0.0], [100.0, 120.0, 100.0], [True, False, True])
    angle = found.path[-1].dihedral("crease")
    cells = len(angle)
    low = np.flatnonzero(angle < 1.001 * math.pi / 14)
    assert angle.min() == pytest.approx(math.pi / 14, abs=1e-9)
    middles = (low + 0.5) / cells * 320.0
    assert {round(m / 10.0) * 10 for m in middles} == {50, 270}
    crease = found.crease()
    np.testing.assert_allclose(crease[0], 0.0, atol=1e-9)
    np.testing.assert_allclose(crease[-1], found.t, atol=1e-9)


def test_bad_designs() -> None:
    with pytest.raises(DesignError, match="one of each"):
        model([0.01], [100.0, 100.0], [True])
    with pytest.raises(DesignError, match=r"meets itself.*turns by 371 degrees in all"):
        model([0.012, 0.012, 0.012], [180.0, 180.0, 180.0], [False] * 3)
