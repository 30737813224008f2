"""Sheets lifted to second order: middle nodes lie on their curves, and bad meshes are refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import bh
import meshes
from bh.model.serialise import describe, rebuild
from meshes import Arc, MeshError, Polyline, SheetMesh
from meshes.curved import lift
from meshes.curves import Curve

SECTOR = meshes.structured(meshes.annulus_sector(100.0, 10.0, 1.0), along=4, rows=2, kind="mirrored")


def test_middle_nodes_lie_on_the_curves() -> None:
    mesh = lift(SECTOR)
    for name, radius in (("edge:inner", 90.0), ("crease:crease", 100.0), ("edge:outer", 110.0)):
        nodes = mesh.linear.nodes(name)
        assert len(nodes) == 9
        np.testing.assert_allclose(np.linalg.norm(mesh.nodes[nodes], axis=1), radius, rtol=1e-14)
        angle = np.arctan2(mesh.nodes[nodes, 1], mesh.nodes[nodes, 0])
        np.testing.assert_allclose(np.diff(angle), 0.125, rtol=1e-12)


def test_other_edges_stay_straight() -> None:
    mesh = lift(SECTOR)
    on_curves = np.concatenate([SECTOR.topology.find_edges(SECTOR.edge_sets[n]) for n in SECTOR.curves])
    rest = np.setdiff1d(np.arange(len(SECTOR.topology.edges)), on_curves)
    ends = SECTOR.points[SECTOR.topology.edges[rest]]
    np.testing.assert_array_equal(mesh.nodes[len(SECTOR.points) + rest], ends.mean(axis=1))


def test_linear_mesh_has_the_same_places() -> None:
    fine = lift(SECTOR).linear
    assert len(fine.triangles) == 4 * len(SECTOR.triangles)
    assert dict(fine.corners) == dict(SECTOR.corners)
    assert (fine.points[fine.triangles[:, 0]] != fine.points[fine.triangles[:, 1]]).any(axis=1).all()
    for name, pairs in SECTOR.edge_sets.items():
        halves = fine.edge_sets[name]
        np.testing.assert_array_equal(halves[::2, 0], pairs[:, 0])
        np.testing.assert_array_equal(halves[1::2, 1], pairs[:, 1])
        np.testing.assert_array_equal(halves[::2, 1], halves[1::2, 0])


def parabola_mesh(curve: Curve) -> SheetMesh:
    points = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 4.0], [2.0, 0.0], [0.0, 4.0]])
    triangles = np.array([[0, 3, 1], [3, 2, 1], [0, 1, 4], [1, 2, 4]])
    return SheetMesh(points, triangles, {"crease:c": np.array([[0, 1], [1, 2]])}, curves={"crease:c": curve})


def test_a_curve_known_by_its_points_only() -> None:
    """Middle nodes of a sampled parabola: on it, halfway in arc length."""
    x = np.linspace(0.0, 2.0, 4001)
    mesh = lift(parabola_mesh(Polyline(np.column_stack((x, x**2)))))
    at = mesh.nodes[len(mesh.sheet.points) + mesh.sheet.topology.find_edges(np.array([[0, 1], [1, 2]]))]
    np.testing.assert_allclose(at[:, 1], at[:, 0] ** 2, atol=1e-5)

    def length(x: np.ndarray) -> np.ndarray:
        return np.asarray(0.5 * x * np.sqrt(1 + 4 * x**2) + 0.25 * np.arcsinh(2 * x))

    np.testing.assert_allclose(
        length(at[:, 0]), [[0.5, 0.0], [0.5, 0.5]] @ length(np.array([1.0, 2.0])), rtol=1e-4
    )


def test_a_closed_curve_goes_the_short_way() -> None:
    ring = meshes.structured(meshes.full_annulus(100.0, 10.0), along=16, kind="mirrored")
    circle = Polyline(Arc((0.0, 0.0), 100.0, 0.0, 2.0 * math.pi).point(np.linspace(0.0, 1.0, 16 * 64 + 1)))
    mesh = lift(replace(ring, curves={"crease:crease": circle}))
    radius = np.linalg.norm(mesh.nodes[mesh.linear.nodes("crease:crease")], axis=1)
    np.testing.assert_allclose(radius, 100.0, rtol=1e-4)


def test_a_mesh_off_its_curve_is_refused() -> None:
    with pytest.raises(MeshError, match=r"'crease:crease' are .* mm off its curve; mesh along the curve"):
        lift(replace(SECTOR, curves={"crease:crease": Arc((0.0, 0.0), 101.0, 0.0, 1.0)}))
    with pytest.raises(MeshError, match="off its curve"):
        lift(parabola_mesh(Polyline(np.array([[0.0, 0.0], [2.0, 4.0]]))))


def test_a_folded_sheet_is_refused() -> None:
    with pytest.raises(MeshError, match="takes only a sheet that is flat"):
        lift(
            replace(
                SECTOR,
                points=SECTOR.points + [[0.0, 0.0, 0.1]] * (np.arange(len(SECTOR.points)) == 3)[:, None],
            )
        )


def test_a_mesh_too_coarse_for_its_curve_is_refused() -> None:
    """An arc that bulges over the far side of its thin triangle."""
    points = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 0.2], [0.0, -1.0]])
    start = math.atan2(0.5, 1.0)
    arc = Arc((0.0, -0.5), math.sqrt(1.25), start, math.pi - 2 * start)
    crease = {"crease:c": np.array([[0, 1]])}
    sheet = SheetMesh(points, np.array([[0, 2, 1], [1, 3, 0]]), crease, curves={"crease:c": arc})
    with pytest.raises(MeshError, match="turned inside out by its curved edge; use a finer mesh"):
        lift(sheet)


SHAPES = {
    "arcs": SECTOR,
    "graphs": meshes.structured(meshes.sine_tessellation(creases=2), along=8, rows=2),
    "gmsh": meshes.unstructured(meshes.annulus_sector(100.0, 10.0, 1.0), size=8.0),
}


def moved(mesh: SheetMesh, seed: int, far: float = 1e3, scale: float = 1.0) -> tuple[SheetMesh, np.ndarray]:
    """A copy that was turned about any axis, and where its own nodes `p` go: scale * p @ turn.T + shift."""
    random = np.random.default_rng(seed)
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    shift = far * random.normal(size=3)
    copy = replace(mesh, points=scale * mesh.points @ turn.T + shift)
    return copy, scale * lift(mesh).nodes @ turn.T + shift


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize(("far", "scale"), [(0.0, 1.0), (1e3, 1.0), (1e8, 1.0), (1e2, 1e-3), (1e3, 25.4)])
def test_a_mesh_that_was_moved_keeps_its_curves(name: str, far: float, scale: float) -> None:
    copy, nodes = moved(SHAPES[name], 1, far, scale)
    size = copy.size
    assert np.abs(lift(copy).nodes - nodes).max() < 1e-12 * size + 1e-15 * far


def test_a_moved_mesh_keeps_its_curves_in_files() -> None:
    copy, nodes = moved(SECTOR, 2)
    model = bh.Model(copy, bh.Sheet(E=4000.0, t=0.1))
    read = rebuild(*describe(model)).mesh
    np.testing.assert_allclose(lift(read).nodes, nodes, atol=1e-9)
    assert "drawn" not in describe(bh.Model(SECTOR, bh.Sheet(E=4000.0, t=0.1)))[1]


def test_a_mesh_of_another_shape_has_lost_its_curves() -> None:
    stretched = replace(SECTOR, points=SECTOR.points * [1.0, 1.01, 1.0])
    with pytest.raises(MeshError, match="off its curve"):
        lift(stretched)
