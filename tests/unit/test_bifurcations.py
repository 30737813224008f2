"""Plates and rings that leave their first shape: references against closed forms, both formulations against them."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bh
from bh.solvers.walk import walk
from verification.framework.checks import Context
from verification.studies.solver import bifurcations as case
from verification.theory import actuated as laminates
from verification.theory.free_plate import FreePlate, cross_ply, disc, isotropic
from verification.theory.rings import overcurved

PLATE = isotropic(4000.0, 0.3, 0.2)


def test_a_disc_of_uniform_curvature() -> None:
    """Freund's closed form, which Ritz has with polynomials of the second degree; Karman's equations are 4 % above."""
    k = disc(0.3, 0.2, 20.0)
    alike = np.array([k, k, 0.0])
    assert FreePlate(*PLATE, half=20.0, round=True, degree=2).critical(alike, 1.5) == pytest.approx(1.0, 1e-9)
    six, eight = (FreePlate(*PLATE, half=20.0, round=True, degree=n).critical(alike, 1.5) for n in (6, 8))
    assert eight == pytest.approx(1.0411, abs=1e-4)
    assert six == pytest.approx(eight, rel=1e-3)


def test_a_bowl_before_it_is_lost() -> None:
    """D (1 + nu) (k - k0) + E t R^4 k^3 / 192 = 0."""
    k0 = 0.8 * disc(0.3, 0.2, 20.0)
    c, least = FreePlate(*PLATE, half=20.0, round=True, degree=2).first_shape(np.array([k0, k0, 0.0]), 1.0)
    k = 3.0 * c[0] / 20.0**2  # of the Legendre polynomial (3 x^2 - 1) / 2
    D = 4000.0 * 0.2**3 / 12.0 / 0.91
    assert D * 1.3 * (k - k0) + 4000.0 * 0.2 * 20.0**4 * k**3 / 192.0 == pytest.approx(0.0, abs=1e-12)
    assert least > 0.0
    with pytest.raises(ValueError, match="not lost"):
        FreePlate(*PLATE, half=20.0, round=True, degree=2).critical(np.array([k0, k0, 0.0]), 1.0)


def test_overcurved_rods() -> None:
    """B1 = C would need m R / B1 = 1; nu = 1 has C = B1."""
    assert overcurved(1.0, 50.0, 2.0, 0.1) == pytest.approx((0.1 / 2.0) ** 2 / 50.0)
    assert overcurved(0.0, 50.0, 2.0, 0.1, waves=3) > overcurved(0.0, 50.0, 2.0, 0.1)


def test_hexagonal_disc() -> None:
    mesh = case.hexagonal_disc(20.0, 4)
    assert len(mesh.triangles) == 6 * 16
    assert float(mesh.areas.sum()) == pytest.approx(0.5 * 24 * 400.0 * math.sin(math.pi / 12.0))
    assert set(mesh.edge_sets) == {"edge:outer"}


@pytest.mark.parametrize(("formulation", "rings", "error"), [("shell", 3, 0.002), ("consistent", 4, 0.015)])
def test_a_disc_that_wants_to_be_a_bowl(formulation: str, rings: int, error: float) -> None:
    at, _ = case.lost_at(case.problems()[2].model(formulation, rings, 1.1))
    assert 1.1 * at == pytest.approx(1.0, abs=error)


def test_a_heated_cross_ply_becomes_a_cylinder() -> None:
    """Below its change of temperature a saddle, and beyond it one of two cylinders, in the shell."""
    model = case.problems()[0].model("shell", 8, 1.5)
    at, _ = case.lost_at(model)
    path = bh.trace(model, estimate=False, neighbours=False, warn=False)
    assert 1.5 * at == pytest.approx(1.0, abs=0.005)
    assert path[-1].stable
    k = laminates.cross_ply(*case.FIBRES[:3], case.SWELL, case.PLY, 1.0)
    plate = FreePlate(*cross_ply(*case.FIBRES, case.PLY), half=20.0)
    bent, least = plate.cylinder(np.array([k, -k, 0.0]), 1.5 * case.cross_ply_change())
    assert least > 0.0
    found = np.sort(np.abs(path[-1].stress().curvature[:, :2].mean(axis=0)))
    np.testing.assert_allclose(found, np.sort(np.abs(bent[:2])), rtol=0.01)
    before = [state for state in path if 1.5 * state.lam < 0.95][-1].stress().curvature.mean(axis=0)
    assert before[0] == pytest.approx(-before[1], rel=1e-3)


def test_two_modes_at_once_are_bracketed_here() -> None:
    """Where the driver tells no bifurcation, only that the branch is lost."""
    model = case.problems()[2].model("consistent", 4, 1.1)
    at, _ = case.lost_at(model)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(case, "walk", lambda task: (replace(item, critical=()) for item in walk(task)))
        again, _ = case.lost_at(model)
    assert again == pytest.approx(at, abs=1e-4)


def test_a_sheet_that_keeps_its_shape_has_no_such_load() -> None:
    assert math.isnan(case.lost_at(case.problems()[2].model("consistent", 4, 0.9))[0])


@pytest.mark.slow
def test_the_case(tmp_path: Path) -> None:
    assert all(check.passed for check in case.run(Context(tmp_path, True, lambda text: None)).checks)
