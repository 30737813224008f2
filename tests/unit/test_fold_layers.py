"""Flat-folded FOLD files: layers moved apart by their order, opened, and what cannot be."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import bh
import meshes
from bh.analysis.triangles import intersecting
from bh.scene.load import load_scene
from meshes.errors import FileFormatError
from meshes.io import read_fold
from meshes.io.fold_nested import WEDGE, drawn_apart

SHEET = (
    '[sheet]\nE = 3000.0\nnu = 0.3\nt = 0.3\n[[steps]]\nfold = { crease = "all", by = 0.0, Lstar = 5.0 }\n'
)


def pleats(count: int, width: float = 20.0, height: float = 15.0) -> dict[str, object]:
    """A map of `count` panels in a row, folded to and fro and pressed flat; panel k lies on panel k - 1."""
    x = [width * (k % 2) for k in range(count + 1)]
    edges = [[2 * k, 2 * k + 1] for k in range(count + 1)]
    edges += [[2 * k + r, 2 * k + 2 + r] for k in range(count) for r in (0, 1)]
    inner = ["V" if k % 2 else "M" for k in range(1, count)]
    return {
        "file_spec": 1.2,
        "frame_classes": ["foldedForm"],
        "frame_unit": "mm",
        "vertices_coords": [[each, y] for each in x for y in (0.0, height)],
        "edges_vertices": edges,
        "edges_assignment": ["B", *inner, "B", *["B"] * (2 * count)],
        "faces_vertices": [[2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1] for k in range(count)],
        # a face with an odd number lies with its lower side up
        "faceOrders": [[f, g, -1 if g % 2 else 1] for f in range(count) for g in range(f)],
    }


def written(tmp_path: Path, form: dict[str, object]) -> Path:
    file = tmp_path / "form.fold"
    file.write_text(json.dumps(form))
    return file


def all_pairs(count: int) -> np.ndarray:
    return np.array([(i, j) for i in range(count) for j in range(i + 1, count)])


@pytest.mark.parametrize("count", [2, 3, 5])
def test_layers_lie_in_their_order_and_do_not_meet(tmp_path: Path, count: int) -> None:
    mesh = read_fold(written(tmp_path, pleats(count)), untangle=0.3)
    z = mesh.points[:, 2].reshape(-1, 2)
    for side in (z[::2], z[1::2]):  # creases and borders that lie on each other
        assert (np.diff(side, axis=0) > 0.3 - 1e-9).all()
    pairs = all_pairs(len(mesh.triangles))
    assert not intersecting(mesh.points, mesh.triangles, pairs, 1e-9).any()
    flat = np.array(pleats(count)["vertices_coords"])
    assert mesh.points[:, :2] == pytest.approx(flat, abs=1e-9)


def test_without_it_the_form_is_told_and_orders_are_needed(tmp_path: Path) -> None:
    form = pleats(3)
    with pytest.raises(FileFormatError, match="untangle = true"):
        read_fold(written(tmp_path, form))
    with pytest.raises(FileFormatError, match=r"faceOrders\[0\] is a list of 3; give two faces below 3"):
        read_fold(written(tmp_path, {**form, "faceOrders": [[1, 0, 7]]}), untangle=0.3)
    del form["faceOrders"]
    with pytest.raises(FileFormatError, match="no faceOrders to untangle"):
        read_fold(written(tmp_path, form), untangle=0.3)


def test_an_order_that_cannot_be_names_two_faces(tmp_path: Path) -> None:
    form = pleats(3)
    form["faceOrders"] = [[1, 0, 1], [2, 1, -1], [0, 2, 1]]  # one over the other, in a ring
    with pytest.raises(FileFormatError, match=r"layers 0\.3 mm apart do not fit between faces \d and \d"):
        read_fold(written(tmp_path, form), untangle=0.3)


def test_a_map_opens_and_nothing_passes_through(tmp_path: Path) -> None:
    """Four panels with contact from the first state on; opened they lie in a plane as long as all of them."""
    written(tmp_path, pleats(4))
    file = tmp_path / "map.toml"
    file.write_text(f'contact = "thickness"\n[pattern]\nfile = "form.fold"\nuntangle = true\n{SHEET}')
    model = load_scene(file).model
    path = bh.trace(model)
    assert path.outcome == "reached"
    assert path.model.contact == "thickness"
    pairs = all_pairs(len(model.mesh.triangles))
    for state in path:
        assert not intersecting(state.points, state.mesh.triangles, pairs, 1e-9).any()
    size = np.sort(np.linalg.svd(path[-1].points - path[-1].points.mean(axis=0), compute_uv=False))
    assert size[0] < 0.02 * size[2]
    ends = path[-1].points[[0, 8]]
    assert float(np.linalg.norm(ends[1] - ends[0])) == pytest.approx(80.0, rel=1e-2)


def test_the_distance_is_the_sheets_own_or_given(tmp_path: Path) -> None:
    written(tmp_path, pleats(2))
    file = tmp_path / "map.toml"
    for value, apart in (("true", 0.309), ("0.5", 0.5)):
        file.write_text(f'[pattern]\nfile = "form.fold"\nuntangle = {value}\n{SHEET}')
        mesh = load_scene(file).model.mesh
        assert float(np.ptp(mesh.points[:, 2])) >= apart - 1e-9
    file.write_text(
        f'[pattern]\nfile = "form.fold"\nuntangle = true\n[mesh]\nkind = "gmsh"\nsize = 5.0\n{SHEET}'
    )
    with pytest.raises(bh.SceneError, match=r"pattern.untangle is for the faces of FOLD files as they are"):
        load_scene(file)


def test_a_cube_opens_to_its_net(tmp_path: Path) -> None:
    """Six squares that are joined along five edges; sides that are not joined lie on each other in the cube."""
    a = 20.0
    net = [(1, 0), (0, 1), (1, 1), (2, 1), (1, 2), (1, 3)]  # a cross
    corners = sorted({(x + i, y + j) for x, y in net for i in (0, 1) for j in (0, 1)})
    at = {corner: k for k, corner in enumerate(corners)}
    faces = [[at[x, y], at[x + 1, y], at[x + 1, y + 1], at[x, y + 1]] for x, y in net]

    def folded(x: float, y: float) -> list[float]:
        """The middle square lies at z = 0, its neighbours stand on it."""
        if x < 1 or x > 2:
            return [a * min(max(x, 1), 2), a * y, a * (1 - x if x < 1 else x - 2)]
        if y < 1 or 2 < y <= 3:
            return [a * x, a * min(max(y, 1), 2), a * (1 - y if y < 1 else y - 2)]
        return [a * x, a * y, 0.0] if y <= 2 else [a * x, a * (5 - y), a]

    sides: dict[tuple[int, int], int] = {}
    for face in faces:
        for k in range(4):
            pair = (min(face[k], face[k - 1]), max(face[k], face[k - 1]))
            sides[pair] = sides.get(pair, 0) + 1
    form = {
        "file_spec": 1.2,
        "frame_classes": ["foldedForm"],
        "frame_unit": "mm",
        "vertices_coords": [folded(*corner) for corner in corners],
        "edges_vertices": [list(pair) for pair in sides],
        "edges_assignment": ["B" if count == 1 else "V" for count in sides.values()],
        "faces_vertices": faces,
    }
    mesh = read_fold(written(tmp_path, form))
    assert len(mesh.crease_edges("valley")) == 5
    path = bh.trace(bh.Model(mesh, bh.Sheet(E=3000.0, nu=0.3, t=0.3)).fold("all", by=0.0, Lstar=5.0))
    assert path.outcome == "reached"
    assert bh.contact.first_contact(path) is None
    x = path[-1].points
    assert float(np.linalg.svd(x - x.mean(axis=0), compute_uv=False)[2]) < 1e-2 * a
    assert float(path[-1].fold_angle("valley").max()) < 0.02
    assert math.dist(x[at[1, 0]], x[at[1, 4]]) == pytest.approx(4.0 * a, rel=1e-3)
    assert isinstance(mesh, meshes.SheetMesh)


MAP = Path(__file__).resolve().parents[2] / "examples" / "map.toml"


def turns(mesh: meshes.SheetMesh, node: int) -> float:
    """Sum of the angles of the triangles round a node, rad."""
    total = 0.0
    for triangle in mesh.triangles.tolist():
        if node in triangle:
            k = triangle.index(node)
            u, v = (mesh.points[triangle[(k + n) % 3]] - mesh.points[node] for n in (1, 2))
            total += math.acos(float(u @ v) / float(np.linalg.norm(u) * np.linalg.norm(v)))
    return total


def test_a_map_that_is_folded_twice_across_opens_and_nothing_passes_through() -> None:
    """Creases that lie one inside the other are drawn apart, so that all of it still lies flat."""
    model = load_scene(MAP).model
    mesh = model.mesh
    centre, width = 40, 30.0
    assert turns(mesh, centre) == pytest.approx(
        2.0 * math.pi, abs=0.05
    )  # layers are moved out of their plane, too
    path = bh.trace(model)
    assert path.outcome == "reached"
    pairs = all_pairs(len(mesh.triangles))
    for state in path:
        assert not intersecting(state.points, mesh.triangles, pairs, 1e-9).any()
    angles = [float(path[0].fold_angle(name).mean()) for name in ("m1", "v1", "v2", "v3")]
    assert min(abs(angle) for angle in angles) > 2.8
    assert max(abs(float(path[-1].fold_angle(name).mean())) for name in ("m1", "v1", "v2", "v3")) < 0.1
    size = np.linalg.svd(path[-1].points - path[-1].points.mean(axis=0), compute_uv=False)
    assert size[2] < 0.03 * size[1]
    corners = path[-1].points[[0, 8, 72, 80]]
    assert math.dist(corners[0], corners[3]) == pytest.approx(2.0 * width * math.sqrt(2.0), rel=0.03)
    assert math.dist(corners[1], corners[2]) == pytest.approx(2.0 * width * math.sqrt(2.0), rel=0.03)


def test_nested_creases_are_turned_about_the_corner_that_they_share() -> None:
    """In the plane angles sum to a full turn, and the inner crease goes inwards as far as the outer one outwards."""
    a, d = 20.0, 0.1
    points = [[0, 0], [a, 0], [a, a], [0, a], [a, a], [a, 0], [a, a], [0, a], [a, a]]
    x = np.column_stack((np.array(points, float), np.zeros(9)))
    rings = [[0, 1, 2, 3], [0, 3, 4, 5], [0, 5, 6, 7], [0, 7, 8, 1]]
    orders = [(1, 0, 1), (2, 1, -1), (3, 2, 1), (2, 0, 1), (3, 0, 1), (3, 1, -1)]
    moved = drawn_apart(x, rings, orders, d)
    assert moved[5] - x[5] == pytest.approx([0.0, 0.5 * WEDGE * d, 0.0])  # the inner crease, of faces 1 and 2
    assert moved[1] - x[1] == pytest.approx([0.0, -0.5 * WEDGE * d, 0.0])
    assert np.delete(moved, [1, 5], axis=0) == pytest.approx(np.delete(x, [1, 5], axis=0))
    # without a corner in common what is inside goes inwards, and nothing else moves
    flap = np.array([[0, 0], [a, 0], [a, a], [0, a], [a, a], [0, a], [5, 0], [15, 0], [15, 9], [5, 9]], float)
    y = np.column_stack((flap, np.zeros(10)))
    rings, orders = [[0, 1, 2, 3], [1, 0, 5, 4], [6, 7, 8, 9]], [(2, 0, 1), (2, 1, 1), (1, 0, 1)]
    moved = drawn_apart(y, rings, orders, d)
    assert (moved - y)[6:8] == pytest.approx(np.array([[0.0, WEDGE * d, 0.0]] * 2))
    assert np.delete(moved, [6, 7], axis=0) == pytest.approx(np.delete(y, [6, 7], axis=0))


def test_four_panels_without_inner_points_stand_in_wedges(tmp_path: Path) -> None:
    a = 20.0
    form = {
        "file_spec": 1.2,
        "frame_classes": ["foldedForm"],
        "frame_unit": "mm",
        "vertices_coords": [[0, 0], [a, 0], [a, a], [0, a], [a, a], [a, 0], [a, a], [0, a], [a, a]],
        "faces_vertices": [[0, 1, 2, 3], [0, 3, 4, 5], [0, 5, 6, 7], [0, 7, 8, 1]],
        "edges_vertices": [[0, 3], [0, 5], [0, 7], [0, 1]],
        "edges_assignment": ["M", "V", "M", "M"],
        "faceOrders": [[1, 0, 1], [2, 1, -1], [3, 2, 1], [2, 0, 1], [3, 0, 1], [3, 1, -1]],
    }
    mesh = read_fold(written(tmp_path, form), untangle=0.1)
    assert not intersecting(mesh.points, mesh.triangles, all_pairs(8), 1e-9).any()


def test_layers_that_are_too_thick_for_nested_creases_name_a_face() -> None:
    with pytest.raises(
        FileFormatError, match=r"layers 1\.5 mm apart do not fit: creases inside one another.*face \d+"
    ):
        read_fold(MAP.with_suffix(".fold"), untangle=1.5)


def test_layers_nearer_than_contact_allows_are_told_apart_from_ones_that_meet(tmp_path: Path) -> None:
    written(tmp_path, pleats(3))
    file = tmp_path / "map.toml"
    file.write_text(f'contact = "thickness"\n[pattern]\nfile = "form.fold"\nuntangle = 0.1\n{SHEET}')
    with pytest.raises(bh.ModelError, match=r"parts of the first state are nearer than 0\.2955 mm \(nodes "):
        bh.trace(load_scene(file).model)
