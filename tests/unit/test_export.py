"""Folded sheets and flat patterns for other programs: what is written is what was solved."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import trimesh

import bh
import meshes
from bh.commands.cli import main
from bh.errors import InputError
from bh.paths.export import FOLDED, write_flat, write_state
from meshes.io import read_fold, read_pattern, write_gltf

SCENE = """
[pattern]
kind = "annulus_sector"
radius = [60.0, 75.0]
width = 10.0
angle = 1.0
fold = ["mountain", "valley"]
[sheet]
E = 4000.0
t = 0.127
[mesh]
along = 12
[[steps]]
fold = { crease = "all", by = 0.3, Lstar = 25.0 }
[[steps]]
fold = { crease = "all", by = 0.6, Lstar = 25.0 }
[outputs]
folded = ["glb", "stl"]
flat = ["dxf", "svg"]
"""


@pytest.fixture(scope="module")
def path() -> Any:
    pattern = meshes.annulus_sector(100.0, 10.0, 0.8)
    return bh.trace(
        bh.Model(meshes.structured(pattern, along=16), bh.Sheet(E=4000, t=0.127)).fold("crease", to=2.0)
    )


@pytest.mark.parametrize("suffix", [s for s in FOLDED if s not in (".fold", ".glb", ".inp")])
def test_triangles(path: Any, tmp_path: Path, suffix: Any) -> None:
    read = meshio.read(write_state(tmp_path / f"sheet{suffix}", list(path)))
    corners = np.sort(np.round(read.points[read.cells_dict["triangle"]].reshape(-1, 9), 4), axis=0)
    ours = np.sort(np.round(path[-1].points[path[-1].mesh.triangles].reshape(-1, 9), 4), axis=0)
    assert corners == pytest.approx(ours, abs=2e-4)
    if suffix in (".vtu", ".vtk", ".msh"):
        bending = read.cell_data["bending_energy_density"][0]
        assert bending @ path[-1].mesh.areas == pytest.approx(path[-1].energy.bending)


def test_gltf_is_in_metres_with_y_up(path: Any, tmp_path: Path) -> None:
    scene = trimesh.load(write_state(tmp_path / "sheet.glb", list(path)), process=False)
    sheet = scene.geometry["sheet"]
    x, y, z = 1e3 * np.asarray(sheet.vertices).T
    assert np.column_stack((x, -z, y)) == pytest.approx(path[-1].points, abs=1e-4)
    assert np.array_equal(sheet.faces, path[-1].mesh.triangles)
    data = (tmp_path / "sheet.glb").read_bytes()
    tree = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    (triangles,) = (p for m in tree["meshes"] for p in m["primitives"] if p["mode"] == 4)
    colours = tree["accessors"][triangles["attributes"]["COLOR_0"]]
    # from no bending (the dark end of the colours) to the most
    assert colours["min"][1] < 5
    assert colours["max"][1] > 150
    assert tree["materials"][triangles["material"]]["doubleSided"]


def test_fold_has_every_state_as_a_frame(path: Any, tmp_path: Path) -> None:
    file = write_state(tmp_path / "sheet.fold", list(path))
    frames = json.loads(file.read_text())["file_frames"]
    assert len(frames) == len(path)
    for k, state in enumerate(path):
        mesh = read_fold(file, k + 1)
        assert mesh.points == pytest.approx(state.points)
        assert mesh.fold_angles["mountain"] == pytest.approx(state.fold_angle("crease"), abs=1e-9)


def test_flat_pattern(path: Any, tmp_path: Path) -> None:
    for suffix in (".svg", ".dxf"):
        back = read_pattern(write_flat(tmp_path / f"flat{suffix}", path.model.mesh))
        assert back.creases[0].curve.length == pytest.approx(80.0, rel=1e-3)
        assert back.creases[0].fold == "mountain"
    assert read_fold(write_flat(tmp_path / "flat.fold", path.model.mesh)).flat


def test_what_cannot_be(path: Any, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="suffix"):
        write_state(tmp_path / "a.xyz", list(path))
    with pytest.raises(InputError, match="no state"):
        write_state(tmp_path / "a.obj", [])
    with pytest.raises(InputError, match="suffix"):
        write_flat(tmp_path / "a.obj", path.model.mesh)
    with pytest.raises(InputError, match=r"name it \.glb"):
        write_gltf(tmp_path / "a.gltf", path.model.mesh)
    with pytest.raises(InputError, match="points must be"):
        write_gltf(tmp_path / "a.glb", path.model.mesh, path[-1].points[:-1])
    with pytest.raises(InputError, match="colours have shape"):
        write_gltf(tmp_path / "a.glb", path.model.mesh, colours=[1, 2])


def test_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(SCENE)
    assert main(["run", "scene.toml", "-o", "out", "-q"]) == 0
    names = {file.name for file in (tmp_path / "out").iterdir()}
    assert names == {"path.bh", "result.json", "folded.glb", "folded.stl", "flat.dxf", "flat.svg"}
    assert main(["export", "scene.toml", "flat.dxf", "--facets"]) == 0
    assert main(["export", "out", "sheet.obj", "--state", "1"]) == 0
    assert main(["export", "out/path.bh", "sheet.svg"]) == 0
    assert capsys.readouterr().out.count("wrote ") == 3
    height = np.ptp(meshio.read("sheet.obj").points[:, 2])
    assert 0.0 < height < np.ptp(meshio.read("out/folded.stl").points[:, 2])
    assert main(["export", "out", "sheet.xyz"]) == 2
    assert main(["export", "out", "sheet.obj", "--state", "99"]) == 2
    assert main(["export", "none.bh", "sheet.obj"]) == 2
    assert math.isclose(read_pattern("sheet.svg").creases[0].curve.length, 60.0, rel_tol=1e-3)


def test_fold_frames_have_what_was_computed(path: Any, tmp_path: Path) -> None:
    data = json.loads(write_state(tmp_path / "sheet.fold", list(path)).read_text())
    last = data["file_frames"][-1]
    assert last["bh:energies"]["total"] == pytest.approx(path[-1].energy.total, rel=1e-15)
    assert (last["bh:step"], last["bh:lambda"]) == (1, 1.0)
    assert np.array(last["faces_bh:bendingEnergyDensity"]) @ path[-1].mesh.areas == pytest.approx(
        path[-1].energy.bending
    )
    assert all(":" in key or key.startswith(("frame_", "vertices_coords", "edges_foldAngle")) for key in last)


def test_fold_edges_are_curves_again(path: Any, tmp_path: Path) -> None:
    """The flat FOLD file of a mesh of arcs comes back as arcs, not as their chords."""
    file = write_flat(tmp_path / "flat.fold", path.model.mesh)
    (crease,) = read_pattern(file).creases
    chords = path.model.mesh.points[path.model.mesh.crease_edges("crease")][..., :2]
    straight = np.linalg.norm(chords[:, 1] - chords[:, 0], axis=1).sum()
    arc = 80.0
    assert straight < arc - 5e-3
    # a parabola through both ends and the middle of each of 16 pieces of 5 mm
    assert crease.curve.length == pytest.approx(arc, abs=1e-3)


@pytest.mark.parametrize("suffix", [".obj", ".glb"])
def test_the_flat_sheet_is_the_texture(path: Any, tmp_path: Path, suffix: str) -> None:
    scene = trimesh.load(
        write_state(tmp_path / f"sheet{suffix}", list(path)), process=False, maintain_order=True
    )
    sheet = scene.geometry["sheet"] if suffix == ".glb" else scene
    data = (tmp_path / f"sheet{suffix}").read_bytes()
    if suffix == ".glb":
        tree = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
        (part,) = (p for m in tree["meshes"] for p in m["primitives"] if p["mode"] == 4)
        accessor = tree["accessors"][part["attributes"]["TEXCOORD_0"]]
        assert (accessor["type"], accessor["count"]) == ("VEC2", len(path[-1].points))
        view = tree["bufferViews"][accessor["bufferView"]]
        start = 20 + int.from_bytes(data[12:16], "little") + 8 + view["byteOffset"]
        uv = np.frombuffer(data[start : start + view["byteLength"]], dtype="<f4").reshape(-1, 2).astype(float)
        uv[:, 1] = 1.0 - uv[:, 1]  # glTF counts v downwards
    else:
        text = data.decode().splitlines()
        uv = np.array([line.split()[1:] for line in text if line.startswith("vt ")], dtype=float)
        corners = [line.split()[1:] for line in text if line.startswith("f ")]
        assert all(corner.split("/")[0] == corner.split("/")[1] for row in corners for corner in row)
        assert np.array_equal(sheet.faces, path[-1].mesh.triangles)
    flat = path.model.mesh.points[:, :2]
    size = np.ptp(flat, axis=0).max()
    assert uv * size + flat.min(axis=0) == pytest.approx(flat, abs=1e-4)
    assert uv.max() == pytest.approx(1.0)
    assert uv.min() == pytest.approx(0.0, abs=1e-7)
