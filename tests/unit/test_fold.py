"""FOLD in: sets, chains, faces, frames and curved edges."""

from __future__ import annotations

import json
import math
import pathlib
from typing import Any

import numpy as np
import pytest

from bh.scene.folding import proposals
from meshes import CreasePattern, FileFormatError
from meshes.io import read_fold, read_pattern
from tests.unit.asked import winding
from tests.unit.fold_objects import DATA, SQUARE, Read, pairs, undirected


class TestSets:
    def test_assignments(self, read: Read) -> None:
        mesh = read(SQUARE)
        assert mesh.kind == "imported"
        assert mesh.points[:, :2].tolist() == SQUARE["vertices_coords"]
        assert pairs(mesh, "crease:mountain") == [[0, 4], [4, 2]]
        assert pairs(mesh, "crease:valley") == [[1, 4]]
        assert pairs(mesh, "edge:flat") == [[4, 3]]
        assert undirected(mesh.edge_sets["edge:boundary"]) == {(0, 1), (1, 2), (2, 3), (0, 3)}
        assert dict(mesh.folds) == {
            "mountain": "mountain",
            "m1": "mountain",
            "valley": "valley",
            "v1": "valley",
        }
        assert set(mesh.edge_sets) == {
            "crease:mountain", "crease:m1", "crease:valley", "crease:v1", "edge:flat", "edge:boundary",
        }  # fmt: skip

    def test_fold_angles_are_mountain_positive_radians(self, read: Read) -> None:
        mesh = read(SQUARE)
        np.testing.assert_allclose(mesh.fold_angles["m1"], np.radians([90.0, 60.0]), rtol=1e-15)
        np.testing.assert_allclose(mesh.fold_angles["mountain"], np.radians([90.0, 60.0]), rtol=1e-15)
        np.testing.assert_allclose(mesh.fold_angles["v1"], np.radians([-45.0]), rtol=1e-15)
        assert not read(SQUARE, edges_foldAngle=None).fold_angles

    def test_unknown_fold_angles_are_nan(self, read: Read) -> None:
        angles = read(SQUARE, edges_foldAngle=[0, 0, 0, 0, None, -60, 45, 0]).fold_angles["m1"]
        assert np.isnan(angles).tolist() == [True, False]

    def test_angles_stand_in_for_assignments(self, read: Read) -> None:
        mesh = read(SQUARE, edges_assignment=None)
        assert pairs(mesh, "crease:mountain") == [[0, 4], [4, 2]]
        assert pairs(mesh, "crease:valley") == [[1, 4]]
        assert undirected(mesh.edge_sets["edge:unassigned"]) == {(3, 4)}

    def test_unassigned_join_and_unlisted(self, read: Read) -> None:
        mesh = read(
            SQUARE,
            edges_vertices=SQUARE["edges_vertices"][4:7],
            edges_assignment=["U", "J", "V"],
            edges_foldAngle=None,
        )
        assert undirected(mesh.edge_sets["edge:unassigned"]) == {
            (0, 4),
            (3, 4),
        }  # one is not in the file at all
        assert undirected(mesh.edge_sets["edge:join"]) == {(2, 4)}
        assert len(mesh.edge_sets["edge:boundary"]) == 4

    def test_cut_on_the_boundary_is_boundary(self, read: Read) -> None:
        mesh = read(SQUARE, edges_assignment=["C", "U", "J", "F", "M", "M", "V", "F"])
        assert len(mesh.edge_sets["edge:boundary"]) == 4
        assert not {"edge:unassigned", "edge:join"} & set(mesh.edge_sets)

    def test_vertices_without_faces_are_dropped(self, read: Read) -> None:
        coords = [[7, 7], *SQUARE["vertices_coords"]]
        mesh = read(
            vertices_coords=coords,
            faces_vertices=[[v + 1 for v in face] for face in SQUARE["faces_vertices"]],
            edges_vertices=[[1, 5]],
            edges_assignment=["M"],
        )
        assert mesh.points[:, :2].tolist() == SQUARE["vertices_coords"]
        assert pairs(mesh, "crease:m1") == [[0, 4]]


class TestChains:
    def test_a_bend_is_passed_and_the_first_edge_gives_the_direction(self, read: Read) -> None:
        """A crease of three edges with corners, listed out of order and in mixed directions."""
        mesh = read(
            vertices_coords=[[0, 0], [3, 0], [3, 2], [0, 2], [0, 1], [1, 1.5], [2, 0.5], [3, 1]],
            edges_vertices=[
                [5, 6], [5, 4], [7, 6], [0, 1], [1, 7], [7, 2], [2, 3], [3, 4], [4, 0],
            ],
            edges_assignment=list("MMMBBBBBB"),
        )  # fmt: skip
        assert pairs(mesh, "crease:m1") == [[4, 5], [5, 6], [6, 7]]
        assert "crease:m2" not in mesh.edge_sets

    def test_a_chain_that_starts_in_its_middle(self, read: Read) -> None:
        """The first edge of the file has two neighbours behind it and one ahead."""
        mesh = read(
            vertices_coords=[[0, 0], [4, 0], [4, 2], [0, 2], [0, 1], [1, 1.5], [2, 0.5], [3, 1.5], [4, 1]],
            edges_vertices=[
                [6, 7], [4, 5], [8, 7], [5, 6], [0, 1], [1, 8], [8, 2], [2, 3], [3, 4], [4, 0],
            ],
            edges_assignment=list("VVVVBBBBBB"),
        )  # fmt: skip
        assert pairs(mesh, "crease:v1") == [[4, 5], [5, 6], [6, 7], [7, 8]]

    def test_straight_lines_go_through_a_crossing(self, read: Read) -> None:
        """Four mountains at a vertex: two straight lines, not four, however they are listed."""
        coords = [[0, 0], [2, 0], [4, 0], [0, 2], [2, 2], [4, 2], [0, 4], [2, 4], [4, 4]]
        rim = [[0, 1], [1, 2], [2, 5], [5, 8], [8, 7], [7, 6], [6, 3], [3, 0]]
        mesh = read(
            vertices_coords=coords,
            edges_vertices=[[4, 1], [3, 4], [5, 4], [7, 4], *rim],
            edges_assignment=["M"] * 4 + ["B"] * 8,
            edges_foldAngle=[-1, -2, -3, -4] + [0] * 8,
        )
        assert pairs(mesh, "crease:m1") == [[7, 4], [4, 1]]
        assert pairs(mesh, "crease:m2") == [[3, 4], [4, 5]]
        assert pairs(mesh, "crease:mountain") == [[7, 4], [4, 1], [3, 4], [4, 5]]
        np.testing.assert_allclose(np.degrees(mesh.fold_angles["mountain"]), [4, 1, 2, 3])
        np.testing.assert_allclose(np.degrees(mesh.fold_angles["m2"]), [2, 3])

    def test_three_creases_without_a_straight_pair_end_at_their_vertex(self, read: Read) -> None:
        mesh = read(
            vertices_coords=[[0, 0], [4, 0], [2, 4], [2, 1]],
            edges_vertices=[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
            edges_assignment=list("BBBVVV"),
        )
        assert [name for name in mesh.creases if name != "valley"] == ["v1", "v2", "v3"]

    def test_other_assignments_do_not_end_a_chain(self, read: Read) -> None:
        mesh = read(SQUARE)  # a valley and a flat edge meet the mountains at vertex 4
        assert len(pairs(mesh, "crease:m1")) == 2

    def test_closed_line(self, read: Read) -> None:
        mesh = read(_rings([1.0, 2.0, 3.0], "BMB", 6))
        ring = mesh.edge_sets["crease:m1"]
        assert len(ring) == 6
        assert ring[:, 1].tolist() == np.roll(ring[:, 0], -1).tolist()


class TestFaces:
    @pytest.mark.parametrize("flips", [(), (0,), (1, 3), (0, 1, 2), (0, 1, 2, 3)])
    def test_orientation_is_made_consistent(self, read: Read, flips: tuple[int, ...]) -> None:
        faces = [face[::-1] if i in flips else face for i, face in enumerate(SQUARE["faces_vertices"])]
        mesh = read(SQUARE, faces_vertices=faces)
        assert (winding(mesh) > 0).all()
        assert mesh.areas.sum() == pytest.approx(4.0)

    def test_orientation_in_space_follows_most_faces(self, read: Read) -> None:
        coords = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [1, 1, 1]]
        up = read(SQUARE, vertices_coords=coords, faces_vertices=[[0, 4, 1], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
        assert (winding(up) > 0).all()
        down = read(
            SQUARE, vertices_coords=coords, faces_vertices=[[0, 1, 4], [4, 2, 1], [2, 4, 3], [3, 4, 0]]
        )
        assert (winding(down) < 0).all()

    @pytest.mark.parametrize("turn", range(4))
    def test_a_quadrilateral_is_cut_along_its_shorter_diagonal(self, read: Read, turn: int) -> None:
        coords = [[0, 0], [3, 0], [4, 1], [0, 2]]  # 0-2 is 4.1 long, 1-3 is 3.6
        mesh = read(vertices_coords=coords, faces_vertices=[np.roll(range(4), turn).tolist()])
        assert undirected(mesh.edge_sets["edge:facet"]) == {(1, 3)}

    @pytest.mark.parametrize("turn", range(4))
    def test_of_equal_diagonals_the_one_at_the_smallest_number_is_taken(self, read: Read, turn: int) -> None:
        ring = np.roll([3, 1, 0, 2], turn).tolist()
        coords = np.empty((4, 2))
        coords[[3, 1, 0, 2]] = np.array([[0, 0], [0.3, 0], [0.3, 0.1], [0, 0.1]])
        mesh = read(vertices_coords=coords.tolist(), faces_vertices=[ring])
        assert undirected(mesh.edge_sets["edge:facet"]) == {(0, 3)}

    def test_a_concave_quadrilateral_is_cut_inside(self, read: Read) -> None:
        mesh = read(vertices_coords=[[0, 0], [4, 3], [0, 6], [1, 3]], faces_vertices=[[0, 1, 2, 3]])
        assert undirected(mesh.edge_sets["edge:facet"]) == {(1, 3)}  # 0-2 runs outside
        assert mesh.areas.sum() == pytest.approx(9.0)

    def test_a_quadrilateral_in_space(self, read: Read) -> None:
        coords = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 1.5]]  # 0-2 is 2.83 long, 1-3 is 3.2
        mesh = read(vertices_coords=coords, faces_vertices=[[0, 1, 2, 3]])
        assert undirected(mesh.edge_sets["edge:facet"]) == {(0, 2)}

    @pytest.mark.parametrize(
        ("coords", "area"),
        [
            ([[0, 0], [1, 0], [3, 0], [1, 4]], 6.0),  # a triangle with a vertex on a side
            ([[0, 0], [1, 0], [2, 0], [3, 0], [1.5, 4]], 6.0),
            ([[0, 0], [3, 0], [2, 4 / 3], [1.5, 2], [0, 4], [0, 3], [0, 1]], 6.0),  # on two sides
            ([[0, 0], [1, 0], [2, 0], [3, 0], [3, 1], [3, 3], [2, 3], [1, 3], [0, 3], [0, 2]], 9.0),
            ([[0, 0], [4, 0], [4, 3], [3, 3], [3, 1], [1, 1], [1, 3], [0, 3]], 8.0),  # a U
            (
                [[0.1, 0], [0.2, 1e-17], [0.3, -1e-17], [0.7, 0], [0.4, 0.5]],
                0.15,
            ),  # straight but for rounding
        ],
    )
    @pytest.mark.parametrize("tilted", [False, True])
    def test_polygons(self, read: Read, coords: list[list[float]], area: float, tilted: bool) -> None:
        count = len(coords)
        points = np.column_stack((coords, np.zeros(count)))
        if tilted:  # into a plane through no axis
            q, _ = np.linalg.qr(np.array([[1.0, 2.0, 3.0], [0.5, -1.0, 1.0], [2.0, 0.3, -1.0]]))
            points = points @ q + [5.0, 6.0, 7.0]
        mesh = read(vertices_coords=points.tolist(), faces_vertices=[list(range(count))])
        assert len(mesh.triangles) == count - 2
        assert mesh.areas.sum() == pytest.approx(area, rel=1e-12)
        assert mesh.areas.min() > 1e-3
        assert undirected(mesh.edge_sets["edge:boundary"]) == {
            tuple(sorted((i, (i + 1) % count))) for i in range(count)
        }
        assert len(mesh.edge_sets["edge:facet"]) == count - 3

    def test_triangles_between_curves_are_well_shaped(self, read: Read) -> None:
        """A crescent of 2 x 40 vertices: Delaunay triangles join neighbours across, no fans from one vertex."""
        angle = np.linspace(0.0, 1.0, 40)
        inner, outer = (np.column_stack((r * np.cos(angle), r * np.sin(angle))) for r in (10.0, 11.0))
        coords = np.vstack((inner, outer[::-1]))
        mesh = read(vertices_coords=coords.tolist(), faces_vertices=[list(range(79, -1, -1))])
        assert np.bincount(mesh.triangles.ravel()).max() <= 5
        across = mesh.points[mesh.topology.edges[:, 0]] - mesh.points[mesh.topology.edges[:, 1]]
        assert np.linalg.norm(across, axis=1).max() < 1.2

    def test_units(self, read: Read) -> None:
        sizes = {
            "mm": 1.0,
            "unit": 1.0,
            "cm": 10.0,
            "m": 1000.0,
            "in": 25.4,
            "pt": 25.4 / 72,
            "um": 1e-3,
            "nm": 1e-6,
        }
        for unit, size in sizes.items():
            mesh = read(SQUARE, frame_unit=unit)
            np.testing.assert_allclose(np.ptp(mesh.points, axis=0), [2 * size, 2 * size, 0], rtol=1e-14)
            assert mesh.areas.sum() == pytest.approx(4 * size**2)

    def test_byte_order_mark(self, tmp_path: pathlib.Path) -> None:
        path = tmp_path / "bom.fold"
        path.write_bytes(b"\xef\xbb\xbf" + json.dumps(SQUARE).encode())
        assert len(read_fold(path).triangles) == 4


def _rings(radii: list[float], letters: str, count: int) -> dict[str, Any]:
    """Concentric regular polygons, edges only."""
    turn = 2 * math.pi / count
    return {
        "vertices_coords": [
            [r * math.cos(i * turn), r * math.sin(i * turn)] for r in radii for i in range(count)
        ],
        "edges_vertices": [
            [k * count + i, k * count + (i + 1) % count] for k in range(len(radii)) for i in range(count)
        ],
        "edges_assignment": [letter for letter in letters for _ in range(count)],
    }


def _polygon_area(radius: float, count: int) -> float:
    return 0.5 * count * radius**2 * math.sin(2 * math.pi / count)


class TestEdgesOnly:
    def test_the_same_as_with_faces(self, read: Read) -> None:
        mesh, other = read(SQUARE), read(SQUARE, faces_vertices=None)
        assert undirected(other.topology.edges) == undirected(mesh.topology.edges)
        for name in mesh.edge_sets:
            assert undirected(other.edge_sets[name]) == undirected(mesh.edge_sets[name])
        assert (winding(other) > 0).all()

    def test_annulus_has_a_hole(self, read: Read) -> None:
        mesh = read(_rings([1.0, 2.0, 3.0, 4.0], "BMVB", 24))
        assert mesh.areas.sum() == pytest.approx(_polygon_area(4.0, 24) - _polygon_area(1.0, 24))
        assert len(mesh.edge_sets["edge:boundary"]) == 48
        assert set(mesh.creases) == {"mountain", "m1", "valley", "v1"}
        assert len(mesh.points) - len(mesh.topology.edges) + len(mesh.triangles) == 0

    def test_a_disc_without_borders_has_none(self, read: Read) -> None:
        mesh = read(_rings([1.0, 2.0], "MU", 12))
        assert mesh.areas.sum() == pytest.approx(_polygon_area(2.0, 12))

    def test_a_sheet_inside_a_hole_is_a_second_sheet(self, read: Read) -> None:
        with pytest.raises(FileFormatError, match="one sheet"):
            read(_rings([1.0, 2.0, 3.0], "BBB", 12))

    @pytest.mark.parametrize(
        ("changes", "words"),
        [
            ({"edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 2], [1, 3]]}, "edges 4 and 5 cross"),
            ({"edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 4]]}, "edge 4 (0-4) hangs loose"),
            (
                {"edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 2], [1, 4]]},
                "vertex 4 lies on edge 4 (0-2)",
            ),
            ({"edges_vertices": [[0, 1], [1, 2]]}, "hangs loose"),
            (
                {"vertices_coords": [[0, 0, 0], [2, 0, 0], [2, 2, 1], [0, 2, 0], [1, 1, 0]]},
                "no faces_vertices",
            ),
        ],
    )
    def test_not_plane(self, read: Read, changes: dict[str, Any], words: str) -> None:
        with pytest.raises(FileFormatError) as caught:
            read(
                {"vertices_coords": SQUARE["vertices_coords"], "edges_vertices": SQUARE["edges_vertices"]},
                **changes,
            )
        assert words in str(caught.value)

    def test_border_inside_the_sheet(self, read: Read) -> None:
        with pytest.raises(FileFormatError, match=r"edge 6 \(1-4\) is assigned B but does not part"):
            read(SQUARE, faces_vertices=None, edges_assignment=list("BBBBMMBF"))


class TestFrames:
    FRAMES = (
        {"frame_inherit": True, "frame_parent": 0, "vertices_coords": [[x, y, 1.0 * (x == y == 1)] for x, y in
                                                                      SQUARE["vertices_coords"]]},
        {"frame_inherit": True, "frame_parent": 1, "frame_unit": "cm", "edges_foldAngle": None},
        {"vertices_coords": [[0, 0], [1, 0], [0, 1]], "faces_vertices": [[0, 1, 2]]},
    )  # fmt: skip

    def test_frames_count_from_the_key_frame(self, read: Read) -> None:
        file = {**SQUARE, "file_frames": list(self.FRAMES)}
        assert read(file).flat
        assert read(file, 0).flat
        assert read(file, 1).points[4].tolist() == [1.0, 1.0, 1.0]
        assert read(file, 3).areas.tolist() == [0.5]

    def test_inheritance_of_the_inherited(self, read: Read) -> None:
        mesh = read({**SQUARE, "file_frames": list(self.FRAMES)}, 2)
        assert mesh.points[4].tolist() == [10.0, 10.0, 10.0]
        assert pairs(mesh, "crease:m1") == [[0, 4], [4, 2]]
        assert not mesh.fold_angles  # null overrides what would be inherited

    def test_default_is_the_first_frame_with_vertices(self, read: Read) -> None:
        mesh = read({"file_spec": 1.2, "file_frames": [{"frame_title": "empty"}, self.FRAMES[2]]})
        assert mesh.areas.tolist() == [0.5]

    @pytest.mark.parametrize(
        ("frames", "frame", "words"),
        [
            ([], 1, "no frame 1; the file has frames 0 to 0"),
            ([{}], -1, "no frame -1"),
            ([{}], True, "no frame True"),
            ([{}], "0", 'no frame titled "0"'),
            ([{}], 1, "vertices_coords"),
            ([3], None, "file_frames[0] is 3"),
            ({"a": 1}, None, "file_frames is an object"),
            ([{"frame_inherit": True, "frame_parent": 1}], 1, "inherits from itself"),
            (
                [{"frame_inherit": True, "frame_parent": 2}, {"frame_inherit": True, "frame_parent": 1}],
                1,
                "inherits from itself",
            ),
            ([{"frame_inherit": True}], 1, "frame_parent of frame 1 is null"),
            ([{"frame_inherit": True, "frame_parent": 5}], 1, "frame_parent of frame 1 is 5"),
            ([{"frame_inherit": 1, "frame_parent": 0}], 1, "frame_inherit of frame 1 is 1"),
            (
                [{"frame_inherit": True, "frame_parent": 0, "edges_vertices": [[0, 1]]}],
                1,
                "edges_foldAngle has 8 entries for 1",
            ),
        ],
    )
    def test_wrong_frames(self, read: Read, frames: list[Any], frame: int, words: str) -> None:
        with pytest.raises(FileFormatError) as caught:
            read({**SQUARE, "file_frames": frames}, frame)
        assert words in str(caught.value)


def test_a_folded_form() -> None:
    """Two pages at a right angle, each with a flap that lies on it, with the order of the layers."""
    mesh = read_fold(DATA / "layers.fold")
    assert len(mesh.points) == 6
    assert mesh.triangles.tolist() == [[0, 2, 1], [0, 1, 3], [0, 4, 2], [0, 3, 5]]
    assert pairs(mesh, "crease:m1") == [[0, 2]]
    assert undirected(mesh.edge_sets["crease:valley"]) == {(0, 1), (0, 3)}
    assert len(mesh.edge_sets["edge:boundary"]) == 6
    assert not mesh.flat


def test_a_rigidly_folded_form() -> None:
    """Three by three panels of a Miura fold, rounded to six decimals: every panel gets a diagonal."""
    mesh = read_fold(DATA / "rigid_miura.fold")
    assert (len(mesh.points), len(mesh.triangles)) == (16, 18)
    counts = {name: len(mesh.edge_sets[name]) for name in ("crease:mountain", "crease:valley", "edge:facet")}
    assert counts == {"crease:mountain": 6, "crease:valley": 6, "edge:facet": 9}
    assert len(mesh.edge_sets["edge:boundary"]) == 12
    # the sign of every fold in space is as drawn: normals part at a mountain, so its far wing lies below
    a, b, c = (mesh.points[mesh.triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    topology = mesh.topology
    for name, sign in (("crease:mountain", -1), ("crease:valley", 1)):
        for edge in topology.find_edges(mesh.edge_sets[name]):
            hinge = topology.hinges[topology.hinge_edges.tolist().index(edge)]
            height = normals[topology.edge_triangles[edge, 0]] @ (
                mesh.points[hinge[3]] - mesh.points[hinge[1]]
            )
            assert height * sign > 0


CURVED: dict[str, Any] = {
    "vertices_coords": [[0, 0], [50, 0], [100, 0], [100, 60], [50, 60], [0, 60]],
    "edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 0], [1, 4]],
    "edges_assignment": list("BBBBBBM"),
    "faces_vertices": [[0, 1, 4, 5], [1, 2, 3, 4]],
}


class TestCurvedEdges:
    """Control points of edges that are Bezier curves: an extension of the format."""

    def pattern(self, tmp_path: pathlib.Path, **keys: Any) -> CreasePattern:
        (tmp_path / "curved.fold").write_text(json.dumps(CURVED | keys))
        return read_pattern(tmp_path / "curved.fold")

    @pytest.mark.parametrize("key", ["edges_controlPoints", "edges_bh:controlPoints"])
    def test_quadratic(self, tmp_path: pathlib.Path, key: str) -> None:
        (crease,) = self.pattern(tmp_path, **{key: [None] * 6 + [[[70, 30]]]}).creases
        # a parabola of height h = 10 over the chord c = 60
        h, c = 10.0, 60.0
        root = math.hypot(c, 4.0 * h)
        length = 0.5 * root + c**2 / (8.0 * h) * math.log((4.0 * h + root) / c)
        assert crease.curve.length == pytest.approx(length, rel=2e-4)
        assert crease.curve.point(np.array([0.5]))[0] == pytest.approx([60.0, 30.0], abs=0.01)

    def test_cubic_in_another_plane(self, tmp_path: pathlib.Path) -> None:
        points = [[x, 0, y] for x, y in CURVED["vertices_coords"]]
        bends = [None] * 6 + [[[70, 0, 20], [30, 0, 40]]]
        pattern = self.pattern(tmp_path, vertices_coords=points, edges_controlPoints=bends)
        x, y = pattern.creases[0].curve.point(np.linspace(0.0, 1.0, 101)).T
        assert np.ptp(x) == pytest.approx(11.547, abs=0.02)  # 60 s (1 - s) (1 - 2 s) to both sides
        assert np.ptp(y) == pytest.approx(60.0)

    def test_faces_say_that_they_have_chords(self, tmp_path: pathlib.Path) -> None:
        self.pattern(tmp_path, edges_controlPoints=[None] * 6 + [[[70, 30]]])
        (remark,) = read_fold(tmp_path / "curved.fold").remarks
        assert "1 edge of the file drawn as curves" in remark

    def test_bh_fold_meshes_the_curves(self, tmp_path: pathlib.Path) -> None:
        self.pattern(tmp_path, edges_controlPoints=[None] * 6 + [[[70, 30]]])
        assert "faces" not in proposals(tmp_path / "curved.fold")[0].mesh
        self.pattern(tmp_path, edges_controlPoints=[None] * 7)
        assert "faces" in proposals(tmp_path / "curved.fold")[0].mesh

    @pytest.mark.parametrize(
        "bends", [[None] * 6, [[[1, 2]] * 3] * 7, [[["x", 2]]] * 7, [3] * 7, "x", [[[1]]] * 7]
    )
    def test_what_cannot_be(self, tmp_path: pathlib.Path, bends: Any) -> None:
        with pytest.raises(FileFormatError, match="controlPoints"):
            self.pattern(tmp_path, edges_controlPoints=bends)
