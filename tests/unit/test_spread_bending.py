"""Spread loads on strips: beams that bear them."""

from __future__ import annotations

import numpy as np
import pytest

import meshes
from bh import Model, Sheet, trace
from verification.studies.ch4.spread_bending import REACH, SPAN, bending, strip

FLAT = Sheet(E=4000.0, nu=0.0, t=0.381)
WIDTH = 100.0


def beam() -> float:
    """Stiffness of a beam under the spread loads: one over the integral of M^2 / E I, N/mm."""
    x = np.linspace(-0.5 * WIDTH, 0.5 * WIDTH, 20001)

    def spread(place: float) -> np.ndarray:
        at = x - place
        return np.where(np.abs(at) < REACH, np.cos(0.5 * np.pi * at / REACH) ** 2, 0.0) / REACH

    load = spread(0.0) - 0.5 * (spread(-0.5 * SPAN) + spread(0.5 * SPAN))
    step = x[1] - x[0]
    moment = np.cumsum(np.cumsum(load) * step) * step
    return float(FLAT.E * WIDTH * FLAT.t**3 / 12.0 / (moment**2).sum() / step)


@pytest.mark.parametrize("formulation", ["consistent", "shell"])
def test_a_flat_sheet_is_a_beam_in_both_directions(formulation: str) -> None:
    mesh = meshes.structured(meshes.corrugation("straight"), along=24, rows=4)
    model = Model(mesh, FLAT, formulation=formulation, contact=False).support("rigid-body")
    path = trace(model.fold("all", by=1e-4, Lstar=1e-3))
    found = bending(path, ("x", "y"))
    assert [found["x"], found["y"]] == pytest.approx([beam(), beam()], rel=0.03)


def test_loads_of_a_strip_have_the_sum_and_the_couple_of_one() -> None:
    mesh = meshes.structured(meshes.corrugation("straight"), along=12, rows=2)
    x, y = mesh.points[:, 0], mesh.points[:, 1]
    load, couple = strip(mesh, x, y - y.mean())
    assert [load.sum(), couple.sum(), couple @ x] == pytest.approx([1.0, 0.0, 1.0], abs=1e-12)
    assert load @ (y - y.mean()) == pytest.approx(0.0, abs=1e-6)
