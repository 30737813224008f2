"""Polylines of many short segments are curves for the mesher; corners, polygons and rulings stay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from meshes.curves import Array, sample
from meshes.io import drawn_lines, read_drawn, read_pattern
from meshes.io.fine_lines import smooth
from meshes.pattern import CreasePattern
from meshes.planar import DrawnLine

RIM = '<rect width="120" height="80" stroke="black"/>'
X = np.linspace(0.0, 120.0, 201)
WAVE = np.column_stack((X, 40.0 + 10.0 * np.sin(np.pi * X / 60.0)))


def svg(folder: Path, body: str) -> Path:
    file = folder / "sheet.svg"
    file.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="120mm" height="80mm" viewBox="0 0 120 80" fill="none">'
        f"{RIM}{body}</svg>"
    )
    return file


def path(points: Array, colour: str = "red", digits: int = 2) -> str:
    at = " ".join(f"{x:.{digits}f},{y:.{digits}f}" for x, y in points.tolist())
    return f'<path d="M{at}" stroke="{colour}"/>'


def crease(pattern: CreasePattern) -> Array:
    (only,) = pattern.creases
    return sample(only.curve)


def roughness(points: Array) -> float:
    """Largest change of the curvature from vertex to vertex, 1/mm."""
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    turns = np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])))
    return float(np.abs(np.diff(turns / (0.5 * (lengths[1:] + lengths[:-1])))).max())


def test_two_hundred_segments_are_one_curve(tmp_path: Path) -> None:
    pattern = read_pattern(svg(tmp_path, path(WAVE)))
    points = crease(pattern)
    true = 40.0 - 10.0 * np.sin(np.pi * points[:, 0] / 60.0)  # y points up in the sheet
    assert np.abs(points[:, 1] - true).max() < 0.01
    assert roughness(points) < 0.2 * roughness(np.round(WAVE, 2))
    (remark,) = pattern.remarks
    assert "1 line is taken as a smooth curve within 0.018 mm of the ends of 200 short segments" in remark
    assert pattern.rails, "it still runs across the sheet"


def test_segments_that_are_lines_of_their_own(tmp_path: Path) -> None:
    """Drawn in any order and direction; a ring, too."""
    order = np.random.default_rng(1).permutation(200)
    ends = [WAVE[[k, k + 1]] if k % 3 else WAVE[[k + 1, k]] for k in order.tolist()]
    pattern = read_pattern(svg(tmp_path, "".join(path(pair, digits=6) for pair in ends)))
    points = crease(pattern)
    assert np.abs(points[:, 1] - (40.0 - 10.0 * np.sin(np.pi * points[:, 0] / 60.0))).max() < 0.01
    assert "of the ends of 200 short segments" in pattern.remarks[0]
    turn = np.linspace(0.0, 2.0 * np.pi, 121)
    ring = np.column_stack((60.0 + 30.0 * np.cos(turn), 40.0 + 30.0 * np.sin(turn)))
    body = "".join(path(ring[k : k + 2], "blue", 6) for k in range(120))
    points = crease(read_pattern(svg(tmp_path, body)))
    assert np.array_equal(points[0], points[-1])
    assert np.abs(np.hypot(*(points - (60.0, 40.0)).T) - 30.0).max() < 0.01


def test_corners_stay(tmp_path: Path) -> None:
    x = np.linspace(0.0, 1.0, 41)
    bow = np.column_stack((60.0 * x, 40.0 + 40.0 * x * (1.0 - x)))
    two = np.vstack((bow, bow[1:] + np.array((60.0, 0.0))))
    points = crease(read_pattern(svg(tmp_path, path(two, digits=4))))
    away = np.linalg.norm(points - (60.0, 40.0), axis=1)
    assert away.min() < 1e-9


def test_straight_sides_between_round_corners_stay(tmp_path: Path) -> None:
    """A spline through both would swing out beside the straight segments."""
    turn = np.linspace(0.0, 0.5 * np.pi, 25)
    corner = 8.0 * np.column_stack((np.cos(turn), np.sin(turn)))
    arcs = [corner @ np.array([(c, s), (-s, c)]) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
    middles = np.array([(90.0, 60.0), (30.0, 60.0), (30.0, 20.0), (90.0, 20.0)])
    ring = np.vstack([arc + middle for arc, middle in zip(arcs, middles, strict=True)])
    points = crease(read_pattern(svg(tmp_path, path(np.vstack((ring, ring[:1])), digits=6))))
    assert points.min(axis=0) == pytest.approx([22.0, 12.0], abs=0.01)
    assert points.max(axis=0) == pytest.approx([98.0, 68.0], abs=0.01)


@pytest.mark.parametrize("sides", [24, 40])
def test_polygons_stay(tmp_path: Path, sides: int) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, sides + 1)
    ring = np.column_stack((60.0 + 30.0 * np.cos(turn), 40.0 + 30.0 * np.sin(turn)))
    pattern = read_pattern(svg(tmp_path, path(ring, digits=6)))
    assert not pattern.remarks
    assert len(crease(pattern)) == sides + 1


def test_segments_with_rulings_stay(tmp_path: Path) -> None:
    few = WAVE[::5]
    rulings = "".join(path(np.array([(x, 0.0), (x, y)]), "yellow", 4) for x, y in few[1:-1].tolist())
    pattern = read_pattern(svg(tmp_path, path(few, digits=4) + rulings))
    assert not pattern.remarks
    assert len(crease(pattern)) == len(few)


def test_lines_that_meet_its_vertices_still_do(tmp_path: Path) -> None:
    x, y = WAVE[77]
    body = path(WAVE, digits=4) + path(np.array([(x, y), (x, 80.0)]), "blue", 4)
    pattern = read_pattern(svg(tmp_path, body))
    ends = {tuple(np.round(sample(c.curve)[k], 6)) for c in pattern.creases for k in (0, -1)}
    assert len(pattern.creases) == 3
    assert len(ends) == 4  # the rim three times, and one place where all three meet


def test_what_is_exported_is_what_was_drawn(tmp_path: Path) -> None:
    lines = drawn_lines(svg(tmp_path, path(WAVE)))
    (line,) = (each for each in lines if each.layer == "mountain")
    assert sample(line.curve)[:, 0] == pytest.approx(X, abs=1e-9)
    assert read_drawn(svg(tmp_path, path(WAVE))).areas.sum() == pytest.approx(9600.0)


def test_straight_lines_and_curves_of_their_own_are_left() -> None:
    straight = DrawnLine(np.column_stack((X, 0.0 * X)), "mountain", "one")
    kept, remarks = smooth([straight], 0.1, 1e-3, 120.0)
    assert kept == [straight]
    assert not remarks
