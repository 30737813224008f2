"""Sheets with creases that meet, end inside, or close on themselves fold: closed forms and drawings."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import bh
import meshes
from bh.analysis.contact import first_contact
from bh.mechanics.shared import kinematics
from meshes import structured, unstructured
from meshes.io import read_drawn, read_fold, read_pattern
from meshes.topology import dihedral_angles

DATA = Path(__file__).parents[1] / "data"
SHEET = bh.Sheet(E=4000.0, nu=0.3, t=0.2)
FORMULATIONS = ("bars-and-hinges", "consistent")
SECTORS = np.radians(
    (60.0, 80.0, 120.0, 100.0)
)  # opposite ones make 180 degrees: the vertex folds flat (Kawasaki)


def vertex(tmp_path: Path) -> Path:
    """Four creases that meet in the middle of a disc; one valley, the next three mountains."""
    angles = np.concatenate(([0.0], np.cumsum(SECTORS)[:-1]))
    lines = "".join(
        f'<line x1="0" y1="0" x2="{50 * math.cos(a)}" y2="{-50 * math.sin(a)}" stroke="{c}" id="c{k}"/>'
        for k, (a, c) in enumerate(zip(angles, ("blue", "red", "red", "red"), strict=True))
    )
    file = tmp_path / "vertex.svg"
    disc = '<circle r="50" stroke="black" fill="none"/>'
    head = 'xmlns="http://www.w3.org/2000/svg" width="100mm" height="100mm" viewBox="-50 -50 100 100"'
    file.write_text(f"<svg {head}>{disc}{lines}</svg>")
    return file


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_vertex_of_four_creases(tmp_path: Path, formulation: str) -> None:
    """Flat-foldable vertex: opposite fold angles are equal, tan(a/2) / tan(b/2) is constant (Tachi 2009, Eq. 3).

    One crease is folded, the others turn freely; faces may bend but need not, so there is no energy.
    """
    mesh = unstructured(read_pattern(vertex(tmp_path), gap=0.01, tolerance=0.05), size=12.0)
    model = bh.Model(mesh, SHEET, formulation=formulation)
    for name in ("m1", "m2", "m3"):
        model = model.crease(name, stiffness=0.0)
    path = bh.trace(model.fold("v1", by=0.9))
    # from flat such a vertex has two ways; the drawn one has the other sign at one crease only
    assert path.outcome == "reached"
    angle = {name: float(path[-1].fold_angle(name).mean()) for name in ("v1", "m1", "m2", "m3")}
    stiff = (
        0.5 * SHEET.bending_stiffness() * 0.9**2 * 50.0 / 12.0
    )  # the energy of a fold that bends a row of cells
    assert path[-1].energy.total < 1e-3 * stiff
    one, two = sorted((abs(math.tan(0.5 * angle["v1"])), abs(math.tan(0.5 * angle["m1"]))))
    a, b = SECTORS[0], SECTORS[1]
    # the way in which opposite creases v1 and m2 turn against each other, or m1 and m3
    ways = (
        math.cos(0.5 * (a + b)) / math.cos(0.5 * (a - b)),
        math.sin(0.5 * (a - b)) / math.sin(0.5 * (a + b)),
    )
    assert min(abs(one / two / abs(way) - 1.0) for way in ways) < 0.02
    assert abs(angle["v1"]) == pytest.approx(abs(angle["m2"]), rel=0.02)
    assert abs(angle["m1"]) == pytest.approx(abs(angle["m3"]), rel=0.02)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_creases_that_end_inside_fold_as_springs(tmp_path: Path, formulation: str) -> None:
    file = tmp_path / "dart.svg"
    file.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="60mm" viewBox="0 0 100 60">'
        '<rect width="100" height="60" stroke="black" fill="none"/>'
        '<path d="M50,60 C45,45 50,30 60,20" stroke="red" fill="none"/></svg>'
    )
    mesh = unstructured(read_pattern(file), size=6.0)
    path = bh.trace(bh.Model(mesh, SHEET, formulation=formulation).fold("all", by=1.0, Lstar=10.0))
    angle = path[-1].fold_angle("m1")
    assert path.outcome == "reached"
    assert path.stable
    assert (angle > 0.0).all()
    assert angle[0] > angle[-1]


def test_a_closed_crease_folds(tmp_path: Path) -> None:
    """A circle in a square: the disc inside cannot bend with it, so the sheet stretches or buckles, and it is told."""
    file = tmp_path / "ring.svg"
    file.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="100mm" viewBox="0 0 100 100">'
        '<rect width="100" height="100" stroke="black" fill="none"/>'
        '<circle cx="50" cy="50" r="25" stroke="red" fill="none"/></svg>'
    )
    mesh = unstructured(read_pattern(file), size=9.0)
    path = bh.trace(bh.Model(mesh, SHEET, formulation="consistent").fold("all", by=0.3, Lstar=10.0))
    assert path.outcome == "reached"
    assert path[-1].energy.stretching > 0.0


def test_springs_of_a_folded_sheet_begin_at_its_angles() -> None:
    """A tent that is made with a fold of 0.8 rad: a spring asked for that angle has nothing to do."""
    height = 20.0 * math.sin(0.4)
    half = 20.0 * math.cos(0.4)
    points = np.array([(x, y, height if x == 0.0 else 0.0) for x in (-half, 0.0, half) for y in (0.0, 30.0)])
    triangles = np.array([(0, 2, 3), (0, 3, 1), (2, 4, 5), (2, 5, 3)])
    mesh = meshes.SheetMesh(
        points, triangles, {"crease:ridge": np.array([(2, 3)])}, folds={"ridge": "mountain"}
    )
    angles = kinematics.dihedral_angles(mesh.points, mesh.topology.hinges)
    assert dihedral_angles(mesh.points, mesh.topology.hinges) == pytest.approx(angles, abs=1e-14)
    path = bh.trace(bh.Model(mesh, SHEET).fold("ridge", by=0.8, Lstar=10.0))
    assert path.outcome == "reached"
    assert path[-1].energy.total < 1e-20
    path = bh.trace(bh.Model(mesh, SHEET).fold("ridge", by=1.3, Lstar=10.0))
    assert path[-1].fold_angle("ridge") == pytest.approx(1.3, abs=1e-6)


class TestFilesOfOtherPrograms:
    """Every drawing that can fold without self-contact folds with either formulation; the other one says why not."""

    @pytest.mark.parametrize("formulation", FORMULATIONS)
    @pytest.mark.parametrize("name", ["cone_pleat", "cones", "miura", "fan", "ring_pleats"])
    def test_own_faces(self, name: str, formulation: str) -> None:
        mesh = read_drawn(DATA / f"{name}.svg", fit=200.0)
        path = bh.trace(bh.Model(mesh, SHEET, formulation=formulation).fold("all", by=0.8, Lstar=25.0))
        assert path.outcome == "reached"
        assert path.stable
        assert first_contact(path) is None

    def test_as_drawn(self) -> None:
        """The opacity of the lines of this one says 90 degrees."""
        mesh = read_drawn(DATA / "fan.svg", fit=200.0)
        path = bh.trace(bh.Model(mesh, SHEET, formulation="consistent").fold("all", by="drawn", Lstar=5.0))
        assert path.outcome == "reached"
        assert path[-1].fold_angle("mountain").mean() == pytest.approx(0.5 * math.pi, rel=0.05)

    @pytest.mark.parametrize("formulation", FORMULATIONS)
    def test_pleats_on_rulings(self, formulation: str) -> None:
        mesh = structured(read_pattern(DATA / "pleats.svg", fit=200.0), aspect_ratio=8.0)
        path = bh.trace(bh.Model(mesh, SHEET, formulation=formulation).fold("all", by=1.2, Lstar=5.0))
        assert path.outcome == "reached"
        assert path.stable
        assert first_contact(path) is None

    def test_miura_imposed(self) -> None:
        """Its angles do not fit together all at once, so panels bend; the driver takes it all the same."""
        mesh = read_drawn(DATA / "miura.svg", fit=200.0)
        path = bh.trace(bh.Model(mesh, SHEET, formulation="consistent").fold("all", by=0.8))
        assert path.outcome == "reached"
        assert path[-1].fold_angle("mountain") == pytest.approx(
            np.full(len(mesh.crease_edges("mountain")), 0.8)
        )

    def test_a_rigid_fold_unfolds_and_folds_further(self) -> None:
        mesh = read_fold(DATA / "rigid_miura.fold")
        model = bh.Model(mesh, SHEET, formulation="consistent")
        flat = bh.trace(model.fold("all", by=0.0))
        assert flat.outcome == "reached"
        assert flat[-1].energy.total < 1e-8
        spread = np.linalg.svd(flat[-1].points - flat[-1].points.mean(axis=0), compute_uv=False)
        assert spread[2] < 1e-5 * spread[0]
        more = bh.trace(model.fold("all", by=1.6, Lstar=25.0))
        assert more.outcome == "reached"
        assert more[-1].fold_angle("mountain").mean() > flat[0].fold_angle("mountain").mean()

    def test_layers_that_lie_on_each_other_are_told(self) -> None:
        """Two of the four faces of this file lie on the other two: it begins in contact."""
        path = bh.trace(bh.Model(read_fold(DATA / "layers.fold"), SHEET).fold("all", by=0.3, Lstar=25.0))
        assert path.outcome != "reached" or first_contact(path) is not None
