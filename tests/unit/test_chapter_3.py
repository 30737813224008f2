"""The studies of the source's Chapter 3 on a few small meshes; the whole of each through `bh verify`."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from verification import fig3_10


def test_lifted_annulus_is_softest_on_the_coarse_mesh_of_bars() -> None:
    """Fig. 3.10 (d): long cells lock; the converged force is lower still."""
    forces = [fig3_10.lift(alpha, 1, "alternating", "bars-and-hinges").force[-1] for alpha in (1.0, 2.0, 4.0)]
    assert forces == sorted(forces)
    fine = fig3_10.lift(1.0, 4, "alternating", "consistent")
    assert fine.path.outcome == "reached"
    assert 0.10 < fine.force[-1] < 0.75 * forces[0]


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
def test_work_of_the_lifting_force_is_the_energy_gained(formulation: str) -> None:
    """What the tip's force does on its way is stored; the held end does no work. And the end does not move."""
    item = fig3_10.lift(1.0, 1, "alternating", formulation, by=10.0)
    states = [item.folded, *(state for state in item.path if state.step == 1)]
    gained = item.lifted.energy.total - item.folded.energy.total
    work = PchipInterpolator(item.rise, item.force).integrate(0.0, item.rise[-1])
    assert item.rise[-1] == pytest.approx(10.0, abs=1e-9)
    assert work == pytest.approx(gained, rel=0.02)
    nodes = item.folded.mesh.nodes("edge:start")
    assert np.abs(states[-1].points[nodes] - item.folded.points[nodes]).max() < 1e-9
