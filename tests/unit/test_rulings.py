"""Rulings of solved states, and meshes that follow them: where a closed form knows them, and what they mend."""

from __future__ import annotations

import numpy as np
import pytest

import bh
import meshes
from bh.analysis.rulings import curvature, rulings
from bh.formulations.state import Energy, State
from meshes import MeshError, ruled, unstructured
from meshes.curves import sample
from meshes.io import read_pattern
from meshes.topology import dihedral_angles

SHEET = bh.Sheet(E=4000.0, nu=0.0, t=0.2)
LENS = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="100mm" viewBox="0 0 100 100" fill="none">'
    '<rect width="100" height="100" stroke="black"/><path d="M0,50 C30,20 70,20 100,50" stroke="red"/>'
    '<path d="M0,50 C30,80 70,80 100,50" stroke="red"/></svg>'
)


def fold(mesh: meshes.SheetMesh, formulation: str, by: float = 0.8) -> bh.Path:
    path = bh.trace(bh.Model(mesh, SHEET, formulation=formulation).fold("all", by=by, Lstar=25.0))
    assert path.outcome == "reached"
    return path


@pytest.fixture(scope="module")
def cone() -> bh.State:
    """A folded annulus: both panels are parts of cones, ruled from the centre (Appendix A)."""
    return fold(unstructured(meshes.annulus_sector(100.0, 15.0, 1.0), size=5.0), "consistent")[-1]


def test_rulings_of_a_cone_pass_its_centre(cone):
    lines = rulings(cone, 5.0)
    assert len(lines) > 20
    ends = np.array(lines)
    middle, along = ends.mean(axis=1), ends[:, 1] - ends[:, 0]
    radial = middle / np.linalg.norm(middle, axis=1)[:, None]
    cosine = np.abs((radial * along).sum(axis=1)) / np.linalg.norm(along, axis=1)
    assert np.median(cosine) > np.cos(np.radians(3.0))
    # from the crease to an edge, and no closer to each other than asked
    radius = np.linalg.norm(ends, axis=2)
    assert (np.abs(radius - 100.0).min(axis=1) < 0.2).mean() > 0.8


def test_curvature_of_a_rolled_strip():
    """A strip laid on a cylinder: curvature 1 / radius along it, none across."""
    mesh = unstructured(meshes.strip(60.0, 10.0), size=2.5)
    points = mesh.points.copy()
    radius = 40.0
    turn = mesh.points[:, 0] / radius
    points[:, 0], points[:, 2] = radius * np.sin(turn), radius * (1.0 - np.cos(turn))
    hinges = mesh.topology.hinges
    zero = np.zeros(len(hinges))
    energy = Energy(0.0, 0.0, 0.0)
    state = State(
        mesh, 0, 1.0, points, energy, dihedral_angles(points, hinges), {}, np.zeros_like(points), zero
    )
    inner = np.abs(mesh.points[mesh.triangles].mean(axis=1)[:, 0] - 30.0) < 20.0
    bent = curvature(state)[inner]
    assert np.abs(bent[:, 0, 0]).mean() == pytest.approx(1.0 / radius, rel=0.1)
    assert np.abs(bent[:, 1, 1]).mean() < 0.1 / radius
    assert np.abs(bent[:, 0, 1]).mean() < 0.1 / radius


@pytest.fixture(scope="module")
def lens(tmp_path_factory) -> meshes.CreasePattern:
    file = tmp_path_factory.mktemp("lens") / "lens.svg"
    file.write_text(LENS)
    return read_pattern(file)


def test_bars_and_hinges_do_not_lock_on_rulings(lens):
    """By gmsh their energy is nearly twice that of the consistent formulation; along its rulings within 20 %."""
    coarse = unstructured(lens, size=4.0)
    judge = fold(coarse, "consistent")
    right = judge[-1].energy.total
    mesh = ruled(lens, rulings(judge[-1], 4.0), 4.0)
    assert mesh.kind == "ruled"
    assert mesh.areas.sum() == pytest.approx(1e4, rel=1e-6)
    assert not fold(coarse, "bars-and-hinges")[-1].energy.total < 1.7 * right
    assert fold(mesh, "bars-and-hinges")[-1].energy.total == pytest.approx(right, rel=0.2)


def test_the_mesh_keeps_creases_and_rulings(lens):
    lines = [np.array([(50.0, 72.5), (50.0, 100.0)]), np.array([(50.0, 72.4), (50.0, 27.5)])]
    mesh = ruled(lens, lines, 10.0)
    flat = mesh.edge_sets["edge:flat"]
    assert len(flat) == 2
    assert np.allclose(mesh.points[flat.ravel(), 0], 50.0, atol=0.5)
    creases = np.vstack([sample(c.curve) for c in lens.creases])
    for node in mesh.nodes("crease:mountain"):
        assert np.linalg.norm(creases - mesh.points[node, :2], axis=1).min() < 0.5


def test_what_cannot_be(lens, cone):
    with pytest.raises(MeshError, match="spacing"):
        ruled(lens, [], 0.0)
    with pytest.raises(MeshError, match="do not make a mesh"):
        ruled(lens, [np.array([(10.0, 0.0), (30.0, 34.0)]), np.array([(30.0, 0.0), (10.0, 43.0)])], 10.0)
    with pytest.raises(bh.ModelError, match="spacing"):
        rulings(cone, -1.0)
