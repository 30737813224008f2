"""Steps downhill that hold back the hinges which would close: their turns, their gradients, and what they save."""

from __future__ import annotations

import json
import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import bh
import bh.solvers.settling
from bh.mechanics.shared.base_system import SupportedSheet
from bh.mechanics.shared.hinge_lock import ZONE
from bh.mechanics.shared.penetration import LARGEST_TURN, stops
from bh.paths.path import Path as Trace
from bh.scene.load import parse_scene
from bh.solvers.factor import Descent, Factor
from bh.solvers.stops import around
from bh.solvers.system import System

CELLS, SEED = 6, 4
SCENE = """
contact = false
[pattern]
file = "net.fold"
[sheet]
E = 4000.0
t = 0.1
[model]
formulation = "{formulation}"
strategy = "settling"
[[steps]]
fold = {{ crease = "all", by = 2.5, Lstar = 1.0 }}
"""


def net(cells: int, seed: int) -> dict[str, object]:
    """Squares with diagonals, mountains and valleys by chance: nothing of it folds flat."""
    rng = np.random.default_rng(seed)
    side = cells + 1
    faces = []
    for j in range(cells):
        for i in range(cells):
            a, b, c, d = j * side + i, j * side + i + 1, (j + 1) * side + i + 1, (j + 1) * side + i
            faces += [[a, b, c], [a, c, d]] if (i + j) % 2 else [[a, b, d], [b, c, d]]
    sides = Counter(tuple(sorted((face[k], face[(k + 1) % 3]))) for face in faces for k in range(3))
    return {
        "vertices_coords": [[10.0 * i, 10.0 * j] for j in range(side) for i in range(side)],
        "edges_vertices": [list(pair) for pair in sides],
        "edges_assignment": ["B" if sides[pair] == 1 else "MV"[int(rng.integers(2))] for pair in sides],
        "faces_vertices": faces,
    }


def folded(folder: Path, formulation: str = "bars-and-hinges") -> Trace:
    (folder / "net.fold").write_text(json.dumps(net(CELLS, SEED)))
    scene = parse_scene(SCENE.format(formulation=formulation), folder)
    return bh.trace(scene.model, strategy=scene.strategy, warn=False)


def test_hinges_are_held_back_before_they_close() -> None:
    before = np.array([1.0, 0.5 * ZONE, 2.0 * math.pi - 0.3, math.pi, 3.0])
    after = np.array([2.0 * math.pi - 0.4, 0.05 * ZONE, 0.1, math.pi - 1.5, 2.9])
    found = stops(before, after)
    assert found.hinges.tolist() == [0, 1, 2, 3]  # through closed, too near, through the other way, too far
    assert found.wanted == pytest.approx(
        [-(1.0 - 0.5 * ZONE), -0.25 * ZONE, 0.3 - 0.5 * ZONE, -0.8 * LARGEST_TURN]
    )
    assert found.taken == pytest.approx([-1.4, -0.45 * ZONE, 0.4, -1.5])
    assert not len(stops(before, before).hinges)


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
def test_turning_is_the_derivative_of_the_angles(tmp_path: Path, formulation: str) -> None:
    path = folded(tmp_path, formulation)
    system = path.system(0)
    assert isinstance(system, SupportedSheet)
    q, hinges = system.start(), np.array([3, 40, 11])
    rng = np.random.default_rng(7)
    q = q + 0.5 * rng.normal(size=len(q))
    rows = system.turning(q, 1.0, hinges)
    move = 1e-6 * rng.normal(size=len(q))
    measured = (system.angles(q + move, 1.0) - system.angles(q - move, 1.0))[hinges] / 2.0
    assert rows @ move == pytest.approx(measured, rel=1e-5)


def test_a_net_comes_to_the_same_rest_in_fewer_steps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Measured: 315 iterations in place of 450."""
    path = folded(tmp_path)

    def shortened(
        system: System, q: np.ndarray, lam: float, descent: Descent, factor: Factor, residual: np.ndarray
    ) -> Descent:
        del system, q, lam, factor, residual
        return descent

    monkeypatch.setattr(bh.solvers.settling, "around", shortened)
    before = folded(tmp_path)
    assert path.reached
    assert path.stable
    assert path[-1].energy.total == pytest.approx(before[-1].energy.total, rel=1e-8)
    assert path.iterations < 0.85 * before.iterations


def test_a_step_that_closes_nothing_is_left_alone(tmp_path: Path) -> None:
    path = folded(tmp_path)
    system = path.system(0)
    q = system.start()
    descent = Descent(np.zeros(len(q)), -1.0)
    assert around(system, q, 0.0, descent, None, np.zeros(len(q))) is descent  # type: ignore[arg-type]
