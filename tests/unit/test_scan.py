"""Scans: read, registered to the noise level, measured; every bad input is one line."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh.applications import scan
from meshes import InputError
from meshes.errors import FileFormatError
from verification.studies.ch3.scan import DENSITY, NOISE, corners, folded_sector, sampled, scanned
from verification.studies.ch3.scan import MOTION as OF_THE_CASE
from verification.theory import cone

Array = NDArray[np.float64]
MOTION = scan.Motion.about((0.0, 80.0, 0.0), (0.7, -1.1, 0.4), (25.0, -60.0, 10.0))


@cache
def sheet() -> bh.State:
    return folded_sector("bars-and-hinges", math.pi / 4)


def start(state: bh.State, wrong: float = 1.0) -> scan.Motion:
    """Three corners picked by hand on the moved scan, some `wrong` mm off."""
    at = corners(state)[:3]
    return scan.picked(MOTION.apply(at) + np.random.default_rng(3).normal(0.0, wrong, (3, 3)), at)


def left_over(found: scan.Registration) -> Array:
    """(6,) translation of the scan's centre and rotation vector that are left of the motion."""
    from scipy.spatial.transform import Rotation

    left = found.motion.after(MOTION)
    turn = Rotation.from_matrix(left.rotation).as_rotvec()
    return np.concatenate((left.apply(found.centre) - found.centre, turn))


# --------------------------------------------------------------------------------------- registration


def test_clean_scan_is_found_exactly() -> None:
    cloud = MOTION.apply(sampled(sheet(), 1.0, 1))
    found = scan.register(cloud, sheet(), start(sheet()), trim=math.inf)
    # without noise, points at the ends hold the sheet only where it is overstepped
    assert np.abs(found.motion.after(MOTION).apply(sheet().points) - sheet().points).max() < 0.05
    assert scan.distances(found.motion.apply(cloud), sheet()).max < 1e-3


@pytest.mark.parametrize("seed", [1, 2])
def test_known_motion_within_the_noise(seed: int) -> None:
    """Noise, holes and strays; every sixth of the motion within four of its standard errors, the picks a mm wrong."""
    cloud = MOTION.apply(scanned(sampled(sheet(), 0.5 * DENSITY, seed), seed))
    found = scan.register(cloud, sheet(), start(sheet()))
    error = left_over(found)
    assert (np.abs(error) < 4.0 * found.standard_error).all()
    # the smallest is the one across the sheet: noise / sqrt(n) over the mean slope
    assert found.standard_error[:3].min() == pytest.approx(NOISE / math.sqrt(len(cloud)) / 0.71, rel=0.1)
    moved = found.motion.after(MOTION).apply(sheet().points) - sheet().points
    assert math.sqrt((moved**2).sum(axis=1).mean()) < 0.5 * NOISE
    assert found.noise == pytest.approx(0.987 * NOISE, rel=0.03)  # normal, cut at three standard deviations
    # the picks alone are far worse
    assert np.abs(start(sheet()).after(MOTION).apply(sheet().points) - sheet().points).max() > 5.0 * NOISE


def test_trimming_is_needed() -> None:
    """Without it strays draw the scan away by many standard errors."""
    cloud = MOTION.apply(scanned(sampled(sheet(), 4.0, 1), 1, strays=0.2))
    robust = scan.register(cloud, sheet(), start(sheet()))
    plain = scan.register(cloud, sheet(), start(sheet()), trim=math.inf)
    ratio = [np.abs(left_over(found) / robust.standard_error).max() for found in (robust, plain)]
    assert ratio[0] < 4.0
    assert ratio[1] > 20.0


def test_slide_is_drawn_back() -> None:
    """Only the points beyond its ends hold a sheet that slides in itself: at first some must be left in."""
    state = folded_sector("bars-and-hinges", 0.5 * math.pi)
    motion = scan.Motion.about(state.points.mean(axis=0), *OF_THE_CASE)
    cloud = motion.apply(scanned(sampled(state, 2.0, 22), 22))
    picks = np.random.default_rng(22).normal(0.0, 1.0, (3, 3))
    found = scan.register(
        cloud, state, scan.picked(motion.apply(corners(state)[:3]) + picks, corners(state)[:3])
    )
    assert np.abs(found.motion.after(motion).apply(state.points) - state.points).max() < 0.2


def test_same_scan_same_answer() -> None:
    cloud = MOTION.apply(scanned(sampled(sheet(), 4.0, 1), 1))
    one, two = (scan.register(cloud, sheet(), start(sheet())) for _ in range(2))
    assert (one.motion.rotation == two.motion.rotation).all()
    assert (one.motion.translation == two.motion.translation).all()


def test_align_is_exact() -> None:
    points = np.random.default_rng(1).normal(size=(5, 3))
    found = scan.align(points, MOTION.apply(points))
    np.testing.assert_allclose(found.rotation, MOTION.rotation, atol=1e-14)
    np.testing.assert_allclose(found.translation, MOTION.translation, atol=1e-12)
    assert np.linalg.det(found.rotation) == pytest.approx(1.0)
    mirrored = scan.align(points, points * (1.0, 1.0, -1.0))
    assert np.linalg.det(mirrored.rotation) == pytest.approx(1.0)  # never a reflection


def test_motions() -> None:
    assert MOTION.angle == pytest.approx(np.linalg.norm((0.7, -1.1, 0.4)))
    point = np.array([[1.0, 2.0, 3.0]])
    np.testing.assert_allclose(MOTION.inverse().after(MOTION).apply(point), point, atol=1e-13)
    np.testing.assert_allclose(
        MOTION.after(MOTION).apply(point), MOTION.apply(MOTION.apply(point)), atol=1e-12
    )


# --------------------------------------------------------------------------------------- distances


def flat() -> bh.State:
    mesh = meshes.structured(meshes.strip(20.0, 10.0, (5.0,)), along=4)
    return bh.trace(bh.Model(mesh, bh.Sheet(E=1.0, t=0.1)).fold("crease", to=math.pi))[-1]


def test_distances_of_a_plate() -> None:
    """Above the plate the height, beyond an edge the way to the edge; and the way back to the nearest point."""
    cloud = np.array([(5.0, 5.0, 0.3), (23.0, 4.0, 4.0), (10.0, 2.0, -0.2)])
    found = scan.distances(cloud, flat())
    np.testing.assert_allclose(found.values, (0.3, 5.0, 0.2), atol=1e-6)
    assert (found.mean, found.median, found.max) == pytest.approx((5.5 / 3.0, 0.3, 5.0), abs=1e-6)
    assert found.standard_deviation == pytest.approx(np.std([0.3, 5.0, 0.2]), abs=1e-6)
    back = scan.distances(cloud[:1], flat(), "sheet-to-cloud", spacing=0.5)
    expected = np.linalg.norm(back.points - cloud[0], axis=1)
    np.testing.assert_allclose(back.values, expected)
    assert back.max == pytest.approx(math.hypot(15.0, 5.0, 0.3), abs=1e-6)  # the far corner is a node


def test_enriched_mesh_is_as_fine_as_asked() -> None:
    from scipy.spatial import cKDTree

    points = scan.Surface(flat()).enriched(0.5)
    x, y = np.meshgrid(np.linspace(0.0, 20.0, 41), np.linspace(0.0, 10.0, 21))
    every = np.column_stack((x.ravel(), y.ravel(), np.zeros(x.size)))
    assert cKDTree(points).query(every)[0].max() <= 0.5 / math.sqrt(
        3.0
    )  # of triangles with edges of 0.5 or less
    assert len(points) < 10_000


def test_noise_has_the_distances_of_its_law() -> None:
    """Mean, median and standard deviation of |N(0, sigma)| from points to the surface."""
    state = flat()
    random = np.random.default_rng(2)
    points = np.column_stack(
        (random.uniform(1.0, 19.0, 40_000), random.uniform(1.0, 9.0, 40_000), np.zeros(40_000))
    )
    found = scan.distances(points + random.normal(0.0, NOISE, points.shape), state)
    assert found.mean == pytest.approx(NOISE * math.sqrt(2.0 / math.pi), rel=0.02)
    assert found.median == pytest.approx(0.67449 * NOISE, rel=0.02)
    assert found.standard_deviation == pytest.approx(NOISE * math.sqrt(1.0 - 2.0 / math.pi), rel=0.02)


def test_hole_counts_only_from_the_sheet() -> None:
    points = sampled(sheet(), DENSITY, 1)
    holed = points[np.linalg.norm(points - points[0], axis=1) > 5.0]
    there, back = scan.distances(holed, sheet()), scan.distances(holed, sheet(), "sheet-to-cloud")
    assert there.max < 1e-5
    assert 4.0 < back.max < 5.5


def test_exact_cones_are_isometric() -> None:
    """The theory's points keep lengths along generators and arcs, and the solved sheet lies on them."""
    r, a = np.full(401, 93.0), np.linspace(0.0, 0.8, 401)
    arc = cone.folded_points(r, a, 100.0, 1.2)
    assert np.linalg.norm(np.diff(arc, axis=0), axis=1).sum() == pytest.approx(93.0 * 0.8, rel=1e-5)
    ends = cone.folded_points(np.array([90.0, 100.0, 110.0]), np.zeros(3), 100.0, 1.2)
    np.testing.assert_allclose(np.linalg.norm(np.diff(ends, axis=0), axis=1), 10.0)
    one, two = ends[0] - ends[1], ends[2] - ends[1]
    assert math.acos(one @ two / 100.0) == pytest.approx(1.2)  # the dihedral angle


def test_compare_and_picture(tmp_path: Path) -> None:
    cloud = MOTION.apply(scanned(sampled(sheet(), 4.0, 1), 1))
    found = scan.compare(cloud, sheet(), start(sheet()), spacing=2.0)
    assert found.strays == pytest.approx(0.05 / 1.05 * len(cloud), rel=0.25)
    kept = found.cloud_to_sheet.of(found.registration.kept)
    assert kept.mean == pytest.approx(0.0797 * NOISE / 0.1, rel=0.05)
    assert found.cloud_to_sheet.max > 5.0 > kept.max
    file = scan.picture(kept, tmp_path / "scan.png", size=(400, 300))
    assert file.stat().st_size > 5000
    with pytest.raises(InputError, match=r"not a \.png"):
        scan.picture(kept, tmp_path / "scan.jpg")


# --------------------------------------------------------------------------------------- files and bad input

PLY = (
    "ply\nformat ascii 1.0\nelement vertex {n}\n"
    + "".join(f"property float {x}\n" for x in "xyz")
    + "end_header\n{rows}"
)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.ply", PLY.format(n=3, rows="1 2 3\n4 5 6\n7 8 9\n")),
        ("a.xyz", "1 2 3\n4 5 6\n7 8 9\n"),
        ("a.csv", "x,y,z,intensity\n1,2,3,0.5\n4,5,6,0.5\n7,8,9,0.5\n"),
        ("a.txt", "# a scan\n1 2 3 255 0 0 # red\n4;5;6\n\n7 8 9\n"),
    ],
)
def test_reading(name: str, text: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    points = scan.read_cloud(tmp_path / name)
    np.testing.assert_array_equal(points, [(1, 2, 3), (4, 5, 6), (7, 8, 9)])
    np.testing.assert_allclose(scan.read_cloud(tmp_path / name, unit=25.4, every=2), points[::2] * 25.4)


@pytest.mark.parametrize("suffix", [".ply", ".stl"])
def test_reading_what_was_written(suffix: str, tmp_path: Path) -> None:
    from meshes.io import write_mesh

    write_mesh(tmp_path / f"sheet{suffix}", sheet().mesh, sheet().points)
    points = scan.read_cloud(tmp_path / f"sheet{suffix}")
    assert scan.distances(points, sheet()).max < 1e-4
    assert scan.distances(points, sheet(), "sheet-to-cloud", spacing=100.0).max < 1e-4


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.ply", "", "empty"),
        ("a.ply", "hello\n", "not a whole PLY file"),
        ("a.ply", PLY.format(n=3, rows="1 2 3\n4 5 6\n"), "2 of 3 points"),
        ("a.ply", PLY.format(n=2, rows="1 nan 3\n4 5 6\n"), "point 0 is not finite"),
        ("a.stl", "hello\n", "not a whole STL file"),
        ("a.xyz", "1 2 3\nhello\n", "line 2"),
        ("a.xyz", "1 2\n", "line 1 has 2 numbers"),
        ("a.xyz", "1 2 inf\n", "point 0 is not finite"),
        ("a.xyz", "# nothing\n", "holds no points"),
        ("a.pdf", "1 2 3\n", ".ply, .xyz"),
    ],
)
def test_bad_files(name: str, text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    one_line(words, lambda: scan.read_cloud(tmp_path / name))


def test_no_file(tmp_path: Path) -> None:
    one_line("No such file", lambda: scan.read_cloud(tmp_path / "none.ply"))
    with pytest.raises(FileFormatError):
        scan.read_cloud(tmp_path / "none.ply")


def one_line(words: str, call: object) -> None:
    with pytest.raises(InputError) as caught:
        call()  # type: ignore[operator]
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


LINE = [(0.0, 0.0, 0.0), (1.0, 1.0, 0.0), (2.0, 2.0, 0.0)]
TRIANGLE = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]


@pytest.mark.parametrize(
    ("words", "call"),
    [
        ("picked on the scan lie on one line", lambda: scan.picked(LINE, TRIANGLE)),
        ("picked on the sheet lie on one line", lambda: scan.picked(TRIANGLE, LINE)),
        ("at least 3", lambda: scan.picked(TRIANGLE[:2], TRIANGLE[:2])),
        ("give as many", lambda: scan.picked(TRIANGLE, [*TRIANGLE, (1.0, 1.0, 1.0)])),
        ("point 1 is not finite", lambda: scan.picked([TRIANGLE[0], (np.nan, 0.0, 0.0), TRIANGLE[2]], TRIANGLE)),
        ("holds no points", lambda: scan.distances([], flat())),
        ("not an array of numbers", lambda: scan.distances("cloud.ply", flat())),
        ("at least 6", lambda: scan.register(TRIANGLE, flat())),
        ("not a state", lambda: scan.register(np.zeros((9, 3)), "sheet")),  # type: ignore[arg-type]
        ("trim", lambda: scan.register(np.zeros((9, 3)), flat(), trim=0.0)),
        ("way 'there'", lambda: scan.distances(TRIANGLE, flat(), "there")),  # type: ignore[arg-type]
        ("spacing", lambda: scan.distances(TRIANGLE, flat(), "sheet-to-cloud", spacing=0.0)),
        ("spacing", lambda: scan.distances(TRIANGLE, flat(), "sheet-to-cloud", spacing=1e-6)),
        ("slide", lambda: scan.register([(x, y, 0.0) for x in (5.0, 9.0, 15.0) for y in (3.0, 6.0)], flat())),
    ],
)  # fmt: skip
def test_bad_input(words: str, call: object) -> None:
    one_line(words, call)
