"""What the shell says of a mesh before it solves, and that a sheet may lie anywhere in space."""

from dataclasses import replace

import numpy as np
import pytest

import bh
import meshes

SECTOR = meshes.annulus_sector(50.0, 10.0, 0.9)


def codes(mesh: meshes.SheetMesh, formulation: str = "shell") -> list[str]:
    return [
        remark.code
        for remark in bh.remarks(bh.Model(mesh, bh.Sheet(E=4000.0, t=0.2), formulation=formulation))
    ]


def turned(mesh: meshes.SheetMesh) -> meshes.SheetMesh:
    """The mesh, rotated in its plane by 30 degrees; its curves stay where they were, so they have to go."""
    c, s = np.cos(np.pi / 6.0), np.sin(np.pi / 6.0)
    return replace(
        mesh, points=mesh.points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]), curves={}
    )


@pytest.mark.parametrize(
    "mesh", [meshes.structured(SECTOR, along=8, kind="mirrored"), meshes.unstructured(SECTOR, size=5.0)]
)
def test_edges_that_have_lost_their_curves_are_told(mesh: meshes.SheetMesh) -> None:
    assert codes(mesh) == []
    assert codes(turned(mesh)) == ["curved-edges"]
    assert codes(turned(mesh), "linear-shell") == []  # its edges are straight in any case


def test_straight_edges_need_no_curve() -> None:
    mesh = meshes.structured(meshes.strip(60.0, 20.0, creases=[10.0]), along=8)
    assert "curved-edges" not in codes(replace(mesh, curves={}))


def spun(x: np.ndarray, angle: float, axis: int) -> np.ndarray:
    """Points, turned by an angle about an axis, and shifted."""
    turn = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn[i, i] = turn[j, j] = np.cos(angle)
    turn[i, j], turn[j, i] = -np.sin(angle), np.sin(angle)
    return x @ turn.T + [3.0, -40.0, 7.0]


@pytest.mark.parametrize("formulation", ["shell", "linear-shell"])
def test_a_sheet_may_lie_anywhere(formulation: str) -> None:
    """Turned by half a turn about x it once was "turned inside out"; off z = 0 it was refused."""
    mesh = meshes.structured(meshes.strip(40.0, 20.0, creases=[8.0]), along=6, kind="mirrored")

    def solved(points: np.ndarray) -> bh.Path:
        model = bh.Model(
            replace(mesh, points=points, curves={}),
            bh.Sheet(E=4000.0, t=0.2, nu=0.3),
            formulation=formulation,
        )
        return bh.trace(model.fold("crease", rest=2.2, Lstar=20.0))

    here = solved(mesh.points)
    assert here.outcome == "reached"
    for angle, axis in ((0.0, 0), (np.pi, 0), (0.7, 0), (2.0, 1), (0.5, 2)):
        there = solved(spun(mesh.points, angle, axis))
        assert there.outcome == "reached"
        assert there[-1].energy.total == pytest.approx(here[-1].energy.total, rel=1e-9)
        assert there[-1].fold_angle("crease").mean() == pytest.approx(
            here[-1].fold_angle("crease").mean(), rel=1e-8
        )
        edges = mesh.topology.edges
        lengths = [np.linalg.norm(np.diff(p[-1].points[edges], axis=1)[:, 0], axis=1) for p in (here, there)]
        assert np.abs(lengths[0] - lengths[1]).max() < 1e-8


def test_curves_stay_with_a_sheet_that_is_lifted() -> None:
    mesh = meshes.structured(SECTOR, along=6, kind="mirrored")

    def energy(z: float) -> float:
        lifted = replace(mesh, points=mesh.points + np.array([0.0, 0.0, z]))
        model = bh.Model(lifted, bh.Sheet(E=4000.0, t=0.2), formulation="shell").fold("crease", to=2.6)
        return bh.trace(model)[-1].energy.total

    assert energy(12.0) == pytest.approx(energy(0.0), rel=1e-9)
