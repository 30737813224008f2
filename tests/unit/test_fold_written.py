"""FOLD out, triangles out through meshio, and where files go."""

from __future__ import annotations

import json
import os
import pathlib
from typing import Any

import meshio
import numpy as np
import pytest

from meshes import FileFormatError, SheetMesh, annulus_sector, full_annulus, strip, structured
from meshes.io import FoldedFrame, read_fold, write_fold, write_mesh
from meshes.io.export import FORMATS
from tests.unit.fold_objects import SQUARE, Read, undirected


class TestWriteFold:
    def mesh(self) -> SheetMesh:
        return structured(annulus_sector([60, 80], 10, 1.2, ["mountain", "valley"]), along=5, rows=2)

    def test_the_file(self, tmp_path: pathlib.Path) -> None:
        mesh = self.mesh()
        path = tmp_path / "out.fold"
        write_fold(path, mesh, title="A sheet")
        data = json.loads(path.read_text())
        assert data["file_spec"] == 1.2
        assert data["file_title"] == "A sheet"
        assert data["frame_classes"] == ["creasePattern"]
        assert data["frame_unit"] == "mm"
        assert {len(row) for row in data["vertices_coords"]} == {2}
        assert data["edges_vertices"] == mesh.topology.edges.tolist()
        assert data["faces_vertices"] == mesh.triangles.tolist()
        assert [data["edges_assignment"].count(letter) for letter in "MV"] == [
            6,
            6,
        ]  # 4 whole cells and 2 half ones
        assert data["edges_assignment"].count("B") == int((mesh.topology.edge_triangles[:, 1] < 0).sum())
        assert "edges_foldAngle" not in data
        assert os.listdir(tmp_path) == ["out.fold"]

    def test_states(self, tmp_path: pathlib.Path) -> None:
        mesh = self.mesh()
        angles = np.linspace(-1.0, 1.0, len(mesh.topology.edges))
        lifted = mesh.points + np.array([0.0, 0.0, 1.0]) * mesh.points[:, :1] ** 2 / 50.0
        path = tmp_path / "out.fold"
        write_fold(path, mesh, frames=[("flat", mesh.points, None), ("lifted", lifted, angles)])
        data = json.loads(path.read_text())
        first, second = data["file_frames"]
        assert (first["frame_title"], first["frame_classes"]) == ("flat", ["foldedForm"])
        assert (first["frame_inherit"], first["frame_parent"]) == (True, 0)
        assert "edges_foldAngle" not in first
        np.testing.assert_allclose(second["edges_foldAngle"], -np.degrees(angles), rtol=1e-15)
        np.testing.assert_array_equal(read_fold(path, 2).points, lifted)
        np.testing.assert_array_equal(read_fold(path, 1).points, mesh.points)
        crease = read_fold(path, 2).fold_angles["m1"]
        at = mesh.topology.find_edges(mesh.edge_sets["crease:crease-1"])
        np.testing.assert_allclose(crease, angles[at], rtol=1e-14)

    def test_drawn_angles(self, tmp_path: pathlib.Path, read: Read) -> None:
        mesh = read(SQUARE)
        write_fold(tmp_path / "out.fold", mesh)
        again = read_fold(tmp_path / "out.fold")
        for name in mesh.creases:
            np.testing.assert_allclose(again.fold_angles[name], mesh.fold_angles[name], rtol=1e-15)

    def test_partly_unknown_angles(self, tmp_path: pathlib.Path, read: Read) -> None:
        write_fold(tmp_path / "out.fold", read(SQUARE, edges_foldAngle=[0, 0, 0, 0, None, -60, 45, 0]))
        angles = json.loads((tmp_path / "out.fold").read_text())["edges_foldAngle"]
        assert angles.count(None) == 1

    def test_unassigned_and_join_survive(self, tmp_path: pathlib.Path, read: Read) -> None:
        write_fold(tmp_path / "out.fold", read(SQUARE, edges_assignment=list("BBBBUJVF")))
        again = read_fold(tmp_path / "out.fold")
        assert undirected(again.edge_sets["edge:unassigned"]) == {(0, 4)}
        assert undirected(again.edge_sets["edge:join"]) == {(2, 4)}

    def test_a_folded_mesh(self, tmp_path: pathlib.Path) -> None:
        mesh = self.mesh()
        folded = SheetMesh(mesh.points + [0, 0, 1] * mesh.points[:, :1] ** 2, mesh.triangles)
        write_fold(tmp_path / "out.fold", folded)
        assert json.loads((tmp_path / "out.fold").read_text())["frame_classes"] == ["foldedForm"]
        np.testing.assert_array_equal(read_fold(tmp_path / "out.fold").points, folded.points)

    def test_keys_of_others_need_a_namespace_and_the_right_length(self, tmp_path: pathlib.Path) -> None:
        mesh = self.mesh()
        for key, value in (("energy", 1.0), ("faces_bh:density", [1.0]), ("edges_bh:angle", "x")):
            frame = FoldedFrame("bent", mesh.points, None, {key: value})
            with pytest.raises(FileFormatError, match=r"namespace|give shape|not numbers"):
                write_fold(tmp_path / "out.fold", mesh, frames=[frame])

    def test_wrong_states(self, tmp_path: pathlib.Path) -> None:
        mesh = self.mesh()
        for points, angles in (
            (mesh.points[1:], None),
            (mesh.points[:, :2], None),
            (np.full_like(mesh.points, np.nan), None),
            (mesh.points, np.zeros(3)),
            ("abc", None),
        ):
            with pytest.raises(FileFormatError, match=r"state 0 .\"bent\".*give"):
                write_fold(tmp_path / "out.fold", mesh, frames=[("bent", points, angles)])
        assert os.listdir(tmp_path) == []


def _write_any(kind: str, path: pathlib.Path, mesh: SheetMesh) -> None:
    if kind == "fold":
        write_fold(path, mesh)
    else:
        write_mesh(path.with_suffix(".vtu"), mesh)


@pytest.mark.parametrize("kind", ["fold", "vtu"])
class TestPlaces:
    """Where files go: whole or not at all."""

    def mesh(self) -> SheetMesh:
        return structured(strip(10, 4, [2]), along=3)

    def test_no_folder(self, tmp_path: pathlib.Path, kind: str) -> None:
        with pytest.raises(FileFormatError, match=r"cannot be written .*existing folder"):
            _write_any(kind, tmp_path / "absent" / f"out.{kind}", self.mesh())

    def test_a_folder_in_its_place(self, tmp_path: pathlib.Path, kind: str) -> None:
        (tmp_path / f"out.{kind}").mkdir()
        with pytest.raises(FileFormatError, match="folder or device"):
            _write_any(kind, tmp_path / f"out.{kind}", self.mesh())
        assert os.listdir(tmp_path) == [f"out.{kind}"]

    def test_a_failure_keeps_the_old_file(
        self, tmp_path: pathlib.Path, kind: str, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        path = tmp_path / f"out.{kind}"
        path.write_text("old")

        def full(*_: object) -> None:
            raise OSError(28, "No space left on device")

        monkeypatch.setattr("meshes.io.export.os.replace", full)
        with pytest.raises(FileFormatError, match="No space left"):
            _write_any(kind, path, self.mesh())
        assert path.read_text() == "old"
        assert os.listdir(tmp_path) == [path.name]

    def test_a_link_stays_a_link(self, tmp_path: pathlib.Path, kind: str) -> None:
        (tmp_path / "real").mkdir()
        link = tmp_path / f"out.{kind}"
        link.symlink_to(tmp_path / "real" / f"out.{kind}")
        _write_any(kind, link, self.mesh())
        assert link.is_symlink()
        assert (tmp_path / "real" / f"out.{kind}").is_file()

    def test_bad_path(self, tmp_path: pathlib.Path, kind: str) -> None:
        with pytest.raises(FileFormatError):
            _write_any(kind, tmp_path / f"nul\0.{kind}", self.mesh())


class TestWriteMesh:
    def mesh(self) -> SheetMesh:
        return structured(full_annulus(20, 5), along=12)

    @pytest.mark.parametrize("suffix", FORMATS)
    def test_formats(self, tmp_path: pathlib.Path, suffix: str, capfd: pytest.CaptureFixture[str]) -> None:
        mesh = self.mesh()
        path = tmp_path / f"out{suffix.upper()}"
        write_mesh(path, mesh)
        assert capfd.readouterr() == ("", "")  # libraries do not print
        assert os.listdir(tmp_path) == [path.name]
        with np.errstate(over="ignore"):  # meshio's STL reader
            back = meshio.read(path, file_format=FORMATS[suffix][0])
        corners = back.points[np.vstack([block.data for block in back.cells if block.type == "triangle"])]
        np.testing.assert_allclose(corners, mesh.points[mesh.triangles], atol=1e-12)

    @pytest.mark.parametrize("suffix", [suffix for suffix, (_, fields) in FORMATS.items() if fields])
    def test_fields(self, tmp_path: pathlib.Path, suffix: str, capfd: pytest.CaptureFixture[str]) -> None:
        mesh = self.mesh()
        points = mesh.points + np.array([0.0, 0.0, 3.0])
        fields = {
            "u": points,
            "pair": points[:, :2],
            "number": np.arange(len(points)),
            "high": points[:, 0] > 0,
        }
        cells = {"area": mesh.areas}
        path = tmp_path / f"out{suffix}"
        write_mesh(path, mesh, points, fields, cells)
        assert capfd.readouterr() == ("", "")
        back = meshio.read(path, file_format=FORMATS[suffix][0])
        np.testing.assert_allclose(back.points, points)
        np.testing.assert_allclose(back.point_data["u"], points)
        np.testing.assert_allclose(back.point_data["pair"][:, :2], points[:, :2])
        np.testing.assert_array_equal(back.point_data["number"].ravel(), np.arange(len(points)))
        np.testing.assert_array_equal(back.point_data["high"].ravel(), points[:, 0] > 0)
        np.testing.assert_allclose(np.ravel(back.cell_data["area"][0]), mesh.areas)

    @pytest.mark.parametrize(
        ("name", "arguments", "words"),
        [
            ("out.xyz", {}, "suffix '.xyz' is not known; use one of .vtu, .vtk"),
            ("out", {}, "suffix '' is not known"),
            ("out.stl", {"node_fields": {"a": np.zeros(36)}}, ".stl files hold no fields"),
            ("out.vtu", {"node_fields": {"a": np.zeros(3)}}, "node field 'a' has shape (3,); give (36,)"),
            ("out.vtu", {"node_fields": {"a": np.zeros((36, 3, 3))}}, "node field 'a' has shape (36, 3, 3)"),
            ("out.vtu", {"node_fields": {"a": 1.0}}, "node field 'a' has shape ()"),
            ("out.vtu", {"cell_fields": {"b": np.zeros(36)}}, "cell field 'b' has shape (36,); give (48,)"),
            ("out.vtu", {"cell_fields": {"b": ["x"] * 48}}, "cell field 'b' is not an array of numbers"),
            ("out.vtu", {"cell_fields": {"b": [[1], [1, 2]]}}, "cell field 'b' is not an array of numbers"),
            (
                "out.vtu",
                {"cell_fields": {"b": np.zeros(48, complex)}},
                "cell field 'b' is not an array of numbers",
            ),
            ("out.vtk", {"node_fields": {"a b": np.zeros(36)}}, "spaces in field names"),
            ("out.vtu", {"points": np.zeros((3, 3))}, "points"),
            ("out.vtu", {"points": np.full((36, 3), np.inf)}, "finite"),
        ],
    )
    def test_errors(self, tmp_path: pathlib.Path, name: str, arguments: dict[str, Any], words: str) -> None:
        with pytest.raises(FileFormatError) as caught:
            write_mesh(tmp_path / name, self.mesh(), **arguments)
        assert words in str(caught.value)
        assert str(caught.value).isprintable()
        assert os.listdir(tmp_path) == []
