"""Pictures, curves and series of solved paths, without a display."""

from __future__ import annotations

import os
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh import plotting
from bh.plotting import offscreen, pictures
from bh.plotting.camera import camera_of
from meshes.errors import InputError


def drawable() -> bool:
    try:
        offscreen.window()
    except plotting.PlotError:
        return False
    return True


needs_opengl = pytest.mark.skipif(
    not drawable(), reason="no OpenGL library: apt-get install libegl1 libgl1-mesa-dri"
)


@pytest.fixture(scope="module")
def path() -> bh.Path:
    """A sector with a spring crease, folded in two steps."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 20.0, np.pi / 2), along=24)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127))
    return bh.trace(model.fold("crease", rest=2.2, Lstar=25.0).fold("crease", rest=1.8))


def pixels(file: Path) -> NDArray[np.float64]:
    from matplotlib.image import imread

    return imread(file)[..., :3]


# --- pictures ---------------------------------------------------------------------------------------------------


@needs_opengl
def test_picture_shows_the_whole_sheet(path: bh.Path, tmp_path: Path) -> None:
    file = plotting.picture(path[-1], tmp_path / "sheet.png", size=(480, 360), caption=False)
    image = pixels(file)
    assert image.shape == (360, 480, 3)
    drawn = np.asarray((image < 0.97).any(axis=2))[: 360 - 59]  # above the colour bar
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    assert rows[0] > 2
    assert rows[-1] < len(drawn) - 3
    assert columns[0] > 2
    assert columns[-1] < 480 - 3
    # it fills the picture in one direction at least
    assert np.ptp(columns) > 0.88 * 480 or np.ptp(rows) > 0.88 * len(drawn)
    saturation = np.ptp(image, axis=2)[: 360 - 59]
    assert (saturation > 0.2).mean() > 0.05  # coloured sheet
    assert (image[: 360 - 59].max(axis=2) < 0.2).sum() > 100  # the dark crease


@needs_opengl
def test_picture_is_the_same_again_and_leaves_nothing_else(path: bh.Path, tmp_path: Path) -> None:
    first = plotting.picture(path[-1], tmp_path / "a.png", size=(320, 240)).read_bytes()
    assert plotting.picture(path[-1], tmp_path / "a.png", size=(320, 240)).read_bytes() == first
    assert [file.name for file in tmp_path.iterdir()] == ["a.png"]


@needs_opengl
@pytest.mark.parametrize(
    "options",
    [
        {"colour": "total"},
        {"colour": "folding"},
        {"colour": None},
        {"top": 1e-6},
        {"camera": (0.3, 0.9)},
        {"caption": "of $ sorts"},
    ],
)
def test_options_change_the_picture(path: bh.Path, tmp_path: Path, options: dict[str, Any]) -> None:
    plain = pixels(plotting.picture(path[-1], tmp_path / "a.png", size=(240, 180)))
    other = pixels(plotting.picture(path[-1], tmp_path / "b.png", size=(240, 180), **options))
    assert plain.shape == other.shape
    assert not np.array_equal(plain, other)


@needs_opengl
def test_lines_without_a_length_are_no_fault() -> None:
    """Two nodes that have met make a line that has no tube: nothing is drawn of it."""
    import pyvista as pv

    plotter = pv.Plotter(off_screen=True)
    pictures._tubes(plotter, pv.PolyData(np.zeros((2, 3)), lines=[2, 0, 1]), 0.1)
    assert not plotter.actors
    plotter.close()


def test_flat_sheet_has_no_colours(path: bh.Path, tmp_path: Path) -> None:
    image = pixels(plotting.picture(path[0], tmp_path / "flat.png", size=(240, 180)))
    assert np.ptp(image, axis=2).max() < 0.15


@needs_opengl
def test_environment_stays_as_it_was(
    path: bh.Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("VTK_DEFAULT_OPENGL_WINDOW", raising=False)
    plotting.picture(path[-1], tmp_path / "a.png", size=(160, 120))
    assert "VTK_DEFAULT_OPENGL_WINDOW" not in os.environ
    assert capfd.readouterr() == ("", "")  # VTK tells of every library it cannot find


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda s, f: plotting.picture(s, f / "a.png", "heat"),
            "colour 'heat' is not known; use one of stretching",
        ),
        (lambda s, f: plotting.picture(s, f / "a.jpg"), "is not a .png file"),
        (lambda s, f: plotting.picture(s, f / "a.png", size=(0, 10)), "size 0 x 10 cannot be"),
        (lambda s, f: plotting.picture([s], f / "a.png"), r"list is not a state; give .* path\[-1\]"),  # type: ignore[arg-type]
        (lambda s, f: plotting.picture(s, f / "a.png", top=float("nan")), "top = nan cannot be"),
    ],
)
def test_pictures_that_cannot_be_are_refused(
    path: bh.Path, tmp_path: Path, call: Callable[[bh.State, Path], object], message: str
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        call(path[-1], tmp_path)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


@needs_opengl
def test_places_that_cannot_be_written_are_refused(path: bh.Path, tmp_path: Path) -> None:
    (tmp_path / "folder.png").mkdir()
    for place in (tmp_path / "missing" / "a.png", tmp_path / "folder.png"):
        with pytest.raises(InputError, match=place.name):
            plotting.picture(path[-1], place, size=(160, 120))
    assert [file.name for file in tmp_path.iterdir()] == ["folder.png"]


def test_machine_without_opengl_is_told_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(offscreen, "library", lambda name: None)
    offscreen.egl_works.cache_clear()
    try:
        with pytest.raises(plotting.PlotError, match="apt-get install libegl1 libgl1-mesa-dri"):
            offscreen.window()
    finally:
        offscreen.egl_works.cache_clear()


def test_window_needs_a_display(path: bh.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("DISPLAY", "")
    with pytest.raises(InputError, match=r"no display .* use bh\.plotting\.picture"):
        path.plot()


def test_camera_keeps_z_up_and_sees_the_upper_side(path: bh.Path) -> None:
    for state in (path[0], path[-1]):
        camera = camera_of(state, 4 / 3, None)
        axes = np.array((camera.across, camera.up, camera.back))
        assert np.allclose(axes @ axes.T, np.eye(3))
        assert camera.across[2] == 0.0
        assert camera.up[2] > 0.0
        assert camera.back[2] > 0.0
        seen = (state.points - camera.centre) @ axes.T
        assert np.abs(seen[:, 0]).max() < camera.half_height * 4 / 3
        assert np.abs(seen[:, 1]).max() < camera.half_height


# --- curves -----------------------------------------------------------------------------------------------------


def test_curves_show_the_energies(path: bh.Path) -> None:
    axes = plotting.curves(path).axes[0]
    lines = {
        str(line.get_label()): line for line in axes.get_lines() if not str(line.get_label()).startswith("_")
    }
    assert set(lines) == {"total", "bending", "stretching", "folding"}
    assert np.allclose(lines["folding"].get_xdata(), path.lambdas)
    assert np.asarray(lines["folding"].get_ydata())[-1] == path[-1].energy.folding
    assert "N mm" in axes.get_ylabel()


def test_kinds_that_stay_zero_are_left_out() -> None:
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.8), along=8)
    path = bh.trace(bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127)).fold("crease", to=3.0))
    labels = [line.get_label() for line in plotting.curves(path).axes[0].get_lines()]
    assert "folding" not in labels
    assert "bending" in labels


# --- series -----------------------------------------------------------------------------------------------------


def test_series_holds_every_state(path: bh.Path, tmp_path: Path) -> None:
    import meshio

    file = plotting.export_series(path, tmp_path / "new", "fold")
    entries = list(ET.parse(file).getroot().iter("DataSet"))
    assert [float(entry.get("timestep", "")) for entry in entries] == path.lambdas.tolist()
    for entry, state in zip(entries, path, strict=True):
        mesh = meshio.read(file.parent / entry.get("file", ""))
        assert np.array_equal(mesh.points, state.points)
        assert np.array_equal(mesh.point_data["displacement"], state.displacement())
        assert np.array_equal(
            mesh.point_data["bending_energy_density"], state.nodal_energy_density("bending")
        )
        for kind in ("stretching", "bending", "folding"):
            total = mesh.cell_data[f"{kind}_energy_density"][0] @ state.mesh.areas
            assert total == pytest.approx(getattr(state.energy, kind), abs=1e-15)


def test_series_replaces_an_older_one(path: bh.Path, tmp_path: Path) -> None:
    (tmp_path / "path").mkdir()
    (tmp_path / "path" / "0099.vtu").write_text("old")
    plotting.export_series(path, tmp_path)
    assert len(list((tmp_path / "path").iterdir())) == len(path)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["path", "path.pvd"]


def test_broken_series_changes_nothing(
    path: bh.Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plotting.export_series(path, tmp_path)
    before = {file.name: file.read_bytes() for file in tmp_path.rglob("*.*")}
    calls = []

    def full_disk(*arguments: Any) -> None:
        calls.append(arguments)
        if len(calls) == 3:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(pictures, "write_mesh", full_disk)
    with pytest.raises(InputError, match="No space left on device") as caught:
        plotting.export_series(path, tmp_path)
    assert "\n" not in str(caught.value)
    assert {file.name: file.read_bytes() for file in tmp_path.rglob("*.*")} == before


def test_series_that_cannot_be_are_refused(path: bh.Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for name, folder, message in (
        ("../a", tmp_path, "name '../a'"),
        ("a", tmp_path / "file", "cannot be written"),
    ):
        with pytest.raises(InputError, match=message):
            plotting.export_series(path, folder, name)
    with pytest.raises(InputError, match="no states"):
        plotting.export_series(bh.Path(path.model), tmp_path)
    with pytest.raises(InputError, match="no states"):
        plotting.curves(bh.Path(path.model))


def test_heavy_libraries_are_imported_when_needed() -> None:
    code = "import sys, bh.plotting; print({'pyvista', 'vtk', 'matplotlib', 'meshio'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
