"""The example of a corrugation that is crushed between plates: its load and energy, and by finer increments."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import bh
from bh.scene.load import load_scene
from bh.solvers.automatic import Automatic
from bh.solvers.load_control import LoadControl
from bh.solvers.walk import Strategy
from verification.studies.solver.contact_layers import crush

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "crushed_corrugation.toml"
COARSE = ("mesh.along=16", "mesh.rows=2")  # a fifth of the time


def crushed(*changes: str, strategy: Strategy | None = None) -> tuple[bh.Path, float, float, float]:
    """The path, the load at its end, what the sheet has gained and the work of the plate (N, N mm)."""
    model = load_scene(EXAMPLE, changes).model
    path = bh.trace(model, strategy=strategy, neighbours=False)
    assert path.reached, path.steps[-1].reason
    return path, *crush(path)


def test_crush_load_and_energy() -> None:
    path, load, gained, work = crushed(*COARSE)
    assert load == pytest.approx(9.897, rel=0.002)
    assert gained == pytest.approx(21.55, rel=0.002)
    assert work == pytest.approx(gained, rel=0.01)
    assert np.ptp(path[-1].points[:, 2]) < 0.4  # of 6.85 mm
    assert path[-1].contact_forces["lower"][2] == pytest.approx(load, rel=1e-3)


@pytest.mark.slow
def test_four_times_finer_increments() -> None:
    """The default takes some fifty increments, 0.02 of the way each."""
    path, load, gained, work = crushed()
    finer, fine, more, done = crushed(strategy=Automatic(LoadControl(first=0.005, largest=0.005)))
    assert len(finer) > 3 * len(path)
    assert load == pytest.approx(fine, rel=0.02)
    assert gained == pytest.approx(more, rel=0.02)
    assert work == pytest.approx(done, rel=0.02)


@pytest.mark.slow
def test_friction_makes_crushing_harder() -> None:
    path, load, gained, work = crushed(*COARSE, "friction=0.3")
    assert load == pytest.approx(10.64, rel=0.005)
    assert gained == pytest.approx(work, rel=0.02)
    assert path[-1].energy.friction == pytest.approx(6.0, rel=0.02)
