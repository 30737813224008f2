"""Pinches of any intensity: simulated at angles between those of the data, and what more they reach."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("xarray")
from bh.applications.inverse.graded import ReachGraded, intensities
from bh.applications.inverse.simulate import SETTING, SegmentTask
from bh.applications.inverse.surrogate import shipped
from bh.applications.inverse.transforms import angles, matrix


def test_ends_of_the_axis() -> None:
    """Nothing at a = 0, the data set of full pinches at a = 1."""
    k0, length = np.array([0.004, -0.011, 0.0]), np.array([210.0, 141.0, 300.0])
    t, r = intensities().local(k0, length, 0.0)
    t0, r0 = shipped().local(k0, length, False)
    np.testing.assert_allclose(t, t0, atol=1e-9)
    np.testing.assert_allclose(r, r0, atol=1e-9)
    t, r = intensities().local(k0, length, 1.0)
    t1, r1 = shipped().local(k0, length, True)
    np.testing.assert_allclose(t, t1, atol=1e-9)
    np.testing.assert_allclose(r, r1, atol=1e-9)


@pytest.mark.parametrize(
    ("k0", "length", "a"), [(0.0037, 233.0, 0.6), (-0.0141, 121.0, 0.4), (0.0, 180.0, 0.9)]
)
def test_between(k0: float, length: float, a: float) -> None:
    pinch = SETTING.fold - a * (SETTING.fold - SETTING.pinch)
    found = SegmentTask()({"k0": k0, "length": length, "pinch": pinch})
    t, r = intensities().local(k0, length, a)
    assert np.linalg.norm(t - found["t"]) < 0.5
    turn = angles(r.T @ matrix(found["uvw"]))
    assert np.linalg.norm(turn) < math.radians(0.5)


def test_one_segment_reaches_a_point() -> None:
    """With its intensity a single segment has three variables: it meets points beside the surface of full pinches."""
    graded = intensities()
    target = graded.forward([0.006], [160.0], [0.45])[0][-1]
    x, missed = ReachGraded(graded, 1, target=target).best(starts=1500)
    assert missed < 1e-3
    k0, length, a = ReachGraded(graded, 1).split(x)
    np.testing.assert_allclose([k0[0], length[0], a[0]], [0.006, 160.0, 0.45], rtol=0.2)


def test_points_of_the_data() -> None:
    """The shipped intensities are those that `build_intensities` would simulate."""
    import xarray

    from bh.applications.inverse.graded import SHIPPED
    from bh.sweep.segments import intensity_points

    points = intensity_points(shipped())
    with xarray.open_dataset(SHIPPED, engine="h5netcdf") as data:
        for name, values in zip(points.names, points.values, strict=True):
            np.testing.assert_allclose(data[name].values, np.array(values, dtype=float), rtol=1e-12)
