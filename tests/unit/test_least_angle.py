"""How far a crease closes: 2 asin(t / (2 h)) between panels that stop each other, within the lock where they do not."""

from __future__ import annotations

import math

import numpy as np
import pytest

import bh
import meshes
from bh.loading.load_step import crease_hinges
from bh.mechanics.shared.kinematics import dihedral_angles


@pytest.mark.parametrize(
    ("rows", "t", "formulation"),
    [(1, 0.2, "consistent"), (2, 0.2, "consistent"), (2, 0.4, "consistent"), (2, 0.2, "bars-and-hinges")],
)
def test_a_crease_that_springs_press_shut(rows: int, t: float, formulation: str) -> None:
    mesh = meshes.structured(meshes.strip(20.0, 20.0, [10.0]), along=8, rows=rows)
    (crease,) = mesh.creases
    sheet = bh.Sheet(E=4000.0, nu=0.0, t=t)

    def closed(contact: bool) -> float:
        model = bh.Model(
            mesh, sheet, contact="thickness" if contact else False, formulation=formulation
        ).fold(crease, rest=0.0, Lstar=20.0)
        path = bh.trace(model, neighbours=False)
        assert path.reached
        angles = dihedral_angles(path[-1].points, mesh.topology.hinges)[crease_hinges(mesh, crease)]
        assert np.ptp(angles) < 1e-3
        return float(angles.mean())

    told = bh.contact.least_angle(mesh, crease, t)
    assert told == pytest.approx(np.full(8, 2.0 * math.asin(0.5 * t * rows / 10.0)))
    assert closed(contact=True) == pytest.approx(float(told[0]), rel=0.02)
    if rows == 1:
        assert 0.0 < closed(contact=False) < math.radians(2.0)  # the lock alone
