"""Painted pictures: pixels at the places where projection puts them, the nearer sheet in front, as VTK draws it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import bh
import meshes
from bh.plotting.camera import Camera
from bh.plotting.painter import AMBIENT, DIFFUSE, Lines, Surface, paint
from bh.plotting.pictures import picture

FRONT = Camera(
    np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.zeros(3), 10.0, 40.0
)  # 20 mm high, seen from above
SQUARE = np.array([[-5.0, -5.0, 0.0], [5.0, -5.0, 0.0], [5.0, 5.0, 0.0], [-5.0, 5.0, 0.0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
RED, BLUE = np.tile([0.5, 0.0, 0.0], (4, 1)), np.tile([0.0, 0.0, 0.5], (4, 1))


def test_a_square_covers_its_pixels_and_no_others() -> None:
    image = paint((200, 100), FRONT, Surface(SQUARE, HALVES, RED), [])
    painted = (image[:, :, 1] < 0.5).astype(int)
    assert painted.sum() == 50 * 50  # 5 pixels a mm
    rows, columns = np.nonzero(painted)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (25, 74, 75, 124)
    # light from the front, and from above on the left: Lambert's law
    towards = np.array([-0.8, 0.9, 0.7])
    light = AMBIENT + DIFFUSE * (0.6 + 0.55 * 0.7 / np.linalg.norm(towards))
    assert image[50, 100] == pytest.approx([0.5 * light, 0.0, 0.0], rel=1e-5)


def test_the_nearer_panel_is_in_front_whichever_comes_first() -> None:
    above = SQUARE * 0.5 + (0.0, 0.0, 3.0)
    points, colours = np.vstack((SQUARE, above)), np.vstack((RED, BLUE))
    for triangles in (np.vstack((HALVES, HALVES + 4)), np.vstack((HALVES + 4, HALVES))):
        image = paint((100, 100), FRONT, Surface(points, triangles, colours), [])
        assert image[50, 50, 2] > 0.3
        assert image[50, 50, 0] == 0.0
        assert image[35, 50, 0] > 0.3


def test_colours_of_a_scale_lie_at_their_places() -> None:
    scale = np.linspace([0.0, 0.0, 0.0], [0.5, 0.5, 0.5], 101)
    values = np.array([0.0, 1.0, 1.0, 0.0])  # rises to the right
    image = paint((100, 100), FRONT, Surface(SQUARE, HALVES, scale, values), [])
    row = image[50, 26:74, 0]
    assert (np.diff(row) >= 0.0).all()
    assert row[-1] / row[24] == pytest.approx(2.0, rel=0.06)


def test_lines_are_as_wide_as_asked_for_and_on_their_sheet() -> None:
    line = Lines(SQUARE, np.array([[0, 2]]), np.zeros((4, 3)), 4.0, 0.1)
    level = Lines(
        np.array([[-4.0, 0.0, 0.0], [4.0, 0.0, 0.0]]), np.array([[0, 1]]), np.zeros((2, 3)), 4.0, 0.1
    )
    image = paint((100, 100), FRONT, Surface(SQUARE, HALVES, RED), [line])
    assert image[50, 50].max() < 1e-6
    image = paint((100, 100), FRONT, Surface(SQUARE, HALVES, RED), [level])
    assert (image[:, 60].max(axis=1) < 1e-6).sum() == 4
    hidden = Lines(SQUARE - (0.0, 0.0, 5.0), np.array([[0, 2]]), np.zeros((4, 3)), 4.0, 0.1)
    assert paint((100, 100), FRONT, Surface(SQUARE, HALVES, RED), [hidden])[50, 50, 0] > 0.3


def test_it_is_what_vtk_draws(tmp_path: Path) -> None:
    pytest.importorskip("pyvista")
    from matplotlib.image import imread

    sheet = bh.Sheet(E=4000.0, t=0.2)
    mesh = meshes.structured(meshes.strip(60.0, 40.0, [20.0]), along=6, rows=2)
    path = bh.trace(bh.Model(mesh, sheet).fold("all", to=2.0))
    images = [
        imread(picture(path[-1], tmp_path / f"{fast}.png", size=(480, 360), fast=fast))[..., :3]
        for fast in (True, False)
    ]
    apart = np.abs(images[0] - images[1]).max(axis=2)
    assert (apart > 0.1).mean() < 0.02  # rims of lines
    assert np.median(apart) < 0.005
