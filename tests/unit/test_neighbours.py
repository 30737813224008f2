"""Other stable states beside the end of a step: exact wells, who looks for them, and what a path says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path as FilePath
from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh.commands import cli
from bh.errors import InputError
from bh.mechanics.bars_and_hinges.system import BarsAndHingesSystem
from bh.mechanics.consistent.system import ConsistentSystem
from bh.scene.load import parse_scene
from bh.solvers import neighbours
from bh.solvers.factor import Factor
from bh.solvers.matrices import BandMatrix
from bh.solvers.modes import softness
from bh.solvers.neighbours import look_around, nearly_neutral, neighbour
from bh.solvers.newton import Newton
from bh.solvers.points import Factorised, Point, point
from bh.solvers.system import Evaluation
from bh.solving import follow
from bh.sweep.scenes import SceneTask
from tests.unit.test_newton import Small
from verification.framework.random_scenes import part_of
from verification.studies.solver import branches
from verification.studies.solver.branch_scenes import drawn

Array = NDArray[np.float64]


class Wells(Small):
    """Two wells in w, near 2 and 4, the second lower by some 2 `tilt`; u is a stiff spring beside."""

    tilt = 0.05
    stiff = 40.0

    def internal(self, q: Array) -> tuple[float, Array, Array]:
        u, w = q[0], q[1] - 3.0
        energy = 0.5 * self.stiff * u * u + 0.25 * (w * w - 1.0) ** 2 - self.tilt * w
        gradient = np.array([self.stiff * u, w**3 - w - self.tilt])
        return float(energy), gradient, np.array([[self.stiff, 0.0], [0.0, 3.0 * w * w - 1.0]])

    def evaluate(self, q: Array, lam: float) -> Evaluation:
        energy, gradient, _ = self.internal(q)
        return Evaluation(energy, gradient, float(np.abs(gradient).max()), gradient)


def at(system: Wells, w: float) -> Point:
    found = Newton().solve_full(system, np.array([0.0, w]), 0.0)
    assert found.stable
    return point(system, found.q, 0.0, negative=0)


def factorised(system: Wells, here: Point) -> Factorised:
    kept = Newton(keep=True).solve_full(system, here.q, here.lam).factorised
    assert kept is not None
    assert Newton().solve_full(system, here.q, here.lam).factorised is None
    return kept


def test_the_lower_well_is_found() -> None:
    system = Wells(2, [0.0, 0.0])
    high, low = at(system, 2.0), at(system, 4.0)
    found = neighbour(system, high, Newton())
    assert found is not None
    assert found.lower == pytest.approx(high.energy - low.energy, rel=1e-9)
    assert 0.09 < found.lower < 0.11
    assert "of lower energy is within reach" in str(found)
    other = neighbour(system, low, Newton())
    assert other is not None
    assert other.lower == pytest.approx(-found.lower, rel=1e-9)
    assert "higher" in str(other)


def test_mirror_images_and_single_wells_are_no_neighbours() -> None:
    system = Wells(2, [0.0, 0.0])
    system.tilt = 0.0
    assert neighbour(system, at(system, 4.0), Newton()) is None
    system.tilt = 3.0  # only one is left
    assert neighbour(system, at(system, 4.7), Newton()) is None


def test_who_is_looked_at() -> None:
    """In doubt, or where a mode hardly resists; never where the state is not stable anyway."""
    system = Wells(2, [0.0, 0.0])
    here = at(system, 2.0)
    assert not nearly_neutral(system, factorised(system, here))
    assert look_around(system, here, False, Newton()) == ""
    assert "lower energy" in look_around(system, here, True, Newton())
    assert look_around(system, replace(here, negative=1), True, Newton()) == ""
    system.stiff = 1e4
    assert nearly_neutral(system, factorised(system, here))
    assert "lower energy" in look_around(system, here, False, Newton())
    assert "lower energy" in look_around(system, here, False, Newton(), factorised(system, here))


def test_a_path_says_so(tmp_path: FilePath) -> None:
    """A soft strip whose first increment is cut ends 0.1 % above a state that finer increments find."""
    model = drawn(69).model
    path = bh.trace(model, file=tmp_path / "path.bh")
    lines = [line for line in path.remarks if "lower energy is within reach" in line]
    assert len(lines) == 1
    assert lines[0].startswith("step 1: a stable state")
    assert path.reached
    assert path.reason == ""
    assert bh.Path.load(tmp_path / "path.bh").remarks == path.remarks
    silent = bh.trace(model, neighbours=False)
    assert not any("within reach" in line for line in silent.remarks)
    assert silent[-1].energy == path[-1].energy
    assert silent.iterations == path.iterations


@pytest.mark.parametrize("name", ["bars-and-hinges", "consistent"])
@pytest.mark.parametrize("symmetry", [None, "y"])
def test_the_look_makes_nothing_anew(
    name: str, symmetry: Literal["y"] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A step that ends well is looked at through the tangent and the factor that its stability was seen from."""
    made = {"factors": 0, "evaluations": 0, "tangents": 0}

    def counted(owner: type, method: str, what: str) -> None:
        plain = getattr(owner, method)

        def counting(*arguments: object) -> object:
            made[what] += 1
            return plain(*arguments)

        monkeypatch.setattr(owner, method, counting)

    looks: list[float] = []

    def looked(factor: Factor, primal: int) -> float:
        looks.append(softness(factor, primal))
        return looks[-1]

    monkeypatch.setattr(neighbours, "softness", looked)
    counted(BandMatrix, "factorise", "factors")
    for owner in (BarsAndHingesSystem, ConsistentSystem):
        counted(owner, "evaluate", "evaluations")
        counted(owner, "tangent", "tangents")
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.5), along=8, rows=1)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, nu=0.0, t=0.1), formulation=name).fold("crease", by=0.5)
    bh.trace(model, symmetry=symmetry, neighbours=False)
    alone = dict(made)
    made.update(dict.fromkeys(made, 0))
    path = bh.trace(model, symmetry=symmetry)
    assert path.reached
    assert made == alone
    assert min(made.values()) > 0
    assert len(looks) == 1
    assert looks[0] > neighbours.SOFT


SCENE = """
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.5
[sheet]
E = 4000.0
t = 0.1
[mesh]
along = 8
[model]
formulation = "bars-and-hinges"
{}
[[steps]]
fold = {{ crease = "crease", by = 0.3 }}
[[steps]]
fold = {{ crease = "crease", by = 0.2 }}
"""


@pytest.mark.parametrize(("key", "looks"), [("", []), ("true", [True, True]), ("false", None)])
@pytest.mark.parametrize("way", ["run", "sweep", "accuracy"])
def test_a_scene_asks_for_the_look(
    way: str, key: str, looks: list[bool] | None, tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`[model] neighbours`: true looks beside every step, false at none; left out, where there is reason to."""
    asked: list[bool] = []

    def looked(system: object, here: object, doubtful: bool, *_: object) -> str:
        asked.append(doubtful)
        return "seen"

    monkeypatch.setattr(follow, "look_around", looked)
    text = SCENE.format(f"neighbours = {key}" if key else "")
    if way == "accuracy":
        text = "accuracy = 0.1\n" + text.replace("[mesh]\nalong = 8\n", "").replace(
            "bars-and-hinges", "consistent"
        )
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    if way == "sweep":
        task = SceneTask(text, {"t": ("sheet.t",)}, tmp_path)
        assert task({"t": 0.12}).reason == ""
    else:
        words = ["run", str(tmp_path / "scene.toml"), "-o", str(tmp_path / "out"), "-q", "--no-estimate"]
        assert cli.main(words) == 0
        remarks = bh.Path.load(tmp_path / "out" / "path.bh").remarks
        assert any("seen" in line for line in remarks) == (looks is not None)
    assert asked == ([] if looks is None else looks or [False, False])


def test_the_look_is_true_or_false() -> None:
    with pytest.raises(InputError, match=r"model\.neighbours"):
        parse_scene(SCENE.format('neighbours = "often"'))
    assert parse_scene(SCENE.format("neighbours = true")).neighbours is True
    assert parse_scene(SCENE.format("")).neighbours is None


def test_rows_are_judged() -> None:
    row = branches.Row(0, "a scene", "reached", "reached", apart=0.1)
    told = replace(row, told=("step 1: a stable state of lower energy is within reach",))
    assert row.silent
    assert not told.silent
    assert not replace(row, apart=1e-5).silent
    case = branches.judged([row, told, replace(row, apart=float("nan"), outcome="stalled")])
    assert [check.value for check in case.checks[:3]] == [1, 2, 0]
    assert not case.checks[0].passed  # of three scenes none may be silent
    assert branches.judged([row] * 2 + [told] * 498).checks[0].passed
    assert not branches.judged([row] * 3 + [told] * 497).checks[0].passed


def test_a_part_of_the_scenes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(branches.PART, raising=False)
    assert part_of("BH_BRANCHES", 500, 500) == range(500)
    monkeypatch.setenv(branches.PART, "100:200")
    assert part_of("BH_BRANCHES", 500, 500) == range(100, 200)
    monkeypatch.setenv(branches.PART, "200:900")
    with pytest.raises(InputError, match="two numbers such as 100:200"):
        part_of("BH_BRANCHES", 500, 500)
    assert drawn(7).words == drawn(7).words != drawn(8).words
