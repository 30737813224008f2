"""Energies frozen with version 0.1.0. These are regressions, not truths: they say that nothing has changed.

What is true is tested in `tests/unit/test_closed_forms.py` and by the cases of `verification`. If a number here moves
for a good reason (another stiffness, another mesh), check it there, write the reason into docs/decisions.md and freeze
it anew.
"""

from __future__ import annotations

import math

import pytest

import bh
import meshes
from bh import LoadControl, Model, Sheet, trace
from verification.studies.app_b import appendix_b

SAME = 1e-8  # relative; solutions by other increments differ by 1e-10 at most
SHEET = Sheet(E=4000.0, t=0.127)


def solve(model: Model, strategy: LoadControl | None = None) -> bh.Path:
    path = trace(model, strategy=strategy)
    assert path.outcome == "reached", path.reason
    return path


def assert_energy(state: bh.State, stretching: float, bending: float, folding: float) -> None:
    """N mm, to 1e-8 of the total, and each kind to 1e-6 of itself."""
    total = stretching + bending + folding
    assert state.energy.total == pytest.approx(total, rel=SAME)
    for kind, value in (("stretching", stretching), ("bending", bending), ("folding", folding)):
        assert getattr(state.energy, kind) == pytest.approx(value, rel=1e-6, abs=SAME * total), kind


def free_annulus() -> Model:
    """examples/free_annulus.toml"""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, math.pi / 2), along=64)
    return Model(mesh, SHEET, formulation="bars-and-hinges").fold("crease", rest=1.57, Lstar=25.0)


def full_annulus() -> Model:
    """examples/full_annulus.toml: it must buckle out of plane."""
    mesh = meshes.structured(meshes.full_annulus(100.0, 10.0), along=128)
    return Model(mesh, SHEET, formulation="bars-and-hinges").fold("crease", rest=2.2, Lstar=25.0)


def test_appendix_b_a() -> None:
    path = solve(appendix_b.model("a"))
    assert_energy(path[-1], 6.015832507460427e-05, 0.05333601579552741, 0.0)
    assert path.iterations <= 35  # 16 when this was written
    assert path.unknowns == 520


def test_appendix_b_d() -> None:
    path = solve(appendix_b.model("d"))
    assert_energy(path[-1], 4.526049780543518e-06, 0.05331246207644538, 0.0)
    assert path.iterations <= 35
    assert path.unknowns == 648


def test_free_annulus_with_a_spring() -> None:
    path = solve(free_annulus())
    assert_energy(path[-1], 3.892227551814676e-06, 0.09953540748338238, 0.004628828870281022)
    assert path.iterations <= 35


@pytest.mark.parametrize("name", ["a", "d", "free"])
def test_energies_do_not_depend_on_the_increments(name: str) -> None:
    """Twice as many increments end in the same state."""
    model = free_annulus() if name == "free" else appendix_b.model(name)
    fine = LoadControl(first_rotation=0.1, largest_rotation=0.2)
    one, two = solve(model), solve(model, fine)
    assert len(two) > len(one)
    assert two[-1].energy.total == pytest.approx(one[-1].energy.total, rel=SAME)


@pytest.mark.slow
def test_full_annulus_buckles() -> None:
    """A saddle with two waves; frozen for this mesh only: the energy depends on its aspect ratio (about 2)."""
    path = solve(full_annulus())
    assert_energy(path[-1], 0.084798150546806, 1.559822689275832, 1.264775030827969)
    assert path[-1].stable is True
    crease = path[-1].crease_points("crease")
    assert abs(crease[:, 2].max() - crease[:, 2].min()) > 20.0  # mm
