"""Nearest points of a surface: as VTK finds them, by hand on one triangle, and on every number of triangles."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from bh.analysis.nearest import LEAF, boxes

Array = NDArray[np.float64]
TRIANGLE = np.array([(0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 3.0, 0.0)])


@pytest.mark.parametrize(
    ("point", "nearest"),
    [
        ((1.0, 1.0, 2.0), (1.0, 1.0, 0.0)),  # over its inside
        ((1.0, -2.0, 0.5), (1.0, 0.0, 0.0)),  # beside each side
        ((-1.0, 1.0, 0.5), (0.0, 1.0, 0.0)),
        ((2.0 + 3.0, 1.5 + 4.0, 1.0), (2.0, 1.5, 0.0)),
        ((-1.0, -1.0, 0.0), (0.0, 0.0, 0.0)),  # beyond each corner
        ((6.0, -1.0, 0.0), (4.0, 0.0, 0.0)),
        ((-1.0, 5.0, 0.0), (0.0, 3.0, 0.0)),
    ],
)
def test_one_triangle(point: tuple[float, float, float], nearest: tuple[float, float, float]) -> None:
    found, cells = boxes(TRIANGLE, np.array([[0, 1, 2]])).nearest(np.array([point]))
    np.testing.assert_allclose(found, [nearest], atol=1e-15)
    assert cells.tolist() == [0]


def soup(count: int, seed: int) -> tuple[Array, NDArray[np.int64]]:
    """Triangles of all sizes anywhere in a cube of 10 mm."""
    random = np.random.default_rng(seed)
    middle, size = random.uniform(0.0, 10.0, (count, 1, 3)), 10.0 ** random.uniform(-1.5, 0.5, (count, 1, 1))
    points = middle + size * random.normal(size=(count, 3, 3))
    return points.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


@pytest.mark.parametrize("count", [1, 2, LEAF, LEAF + 1, 17, 100, 1000])
def test_as_vtk_finds_them(count: int) -> None:
    """Of another program: distances to rounding, and each point lies on the triangle that is named."""
    import pyvista as pv

    points, triangles = soup(count, count)
    queries = np.random.default_rng(0).uniform(-5.0, 15.0, (2000, 3))
    found, cells = boxes(points, triangles).nearest(queries)
    _, expected = pv.PolyData.from_regular_faces(points, triangles).find_closest_cell(
        queries, return_closest_point=True
    )
    apart = np.linalg.norm(queries - found, axis=1)
    np.testing.assert_allclose(apart, np.linalg.norm(queries - expected, axis=1), atol=1e-12)
    own, _ = zip(
        *(
            boxes(points, triangles[[c]]).nearest(f[None])
            for c, f in zip(cells[:50], found[:50], strict=True)
        ),
        strict=True,
    )
    np.testing.assert_allclose(np.vstack(own), found[:50], atol=1e-12)


def test_no_points() -> None:
    found, cells = boxes(TRIANGLE, np.array([[0, 1, 2]])).nearest(np.empty((0, 3)))
    assert found.shape == (0, 3)
    assert cells.shape == (0,)
