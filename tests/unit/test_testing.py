"""`bh.testing`: checks of one's own sheets, the pytest plugin around them, and that both cost nothing until used."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

import bh
import meshes
from bh.analysis.richardson import judged
from bh.testing import (
    Verdict,
    assert_converges,
    assert_energy_converges,
    assert_reached,
    assert_same_shape,
    assert_stable,
    assert_values_converge,
    levels,
)
from verification.framework.records import KEYS

pytest_plugins = ["pytester"]
ROOT = Path(__file__).resolve().parents[2]
SHEET = bh.Sheet(E=4000.0, nu=0.38, t=0.127)
SECTOR = meshes.annulus_sector(100.0, 10.0, 0.3)
HALVED = (1.0, 0.5, 0.25, 0.125)


def folded(rows: int, **options: Any) -> bh.Model:
    mesh = meshes.structured(SECTOR, along=2 * rows, rows=rows)
    return bh.Model(mesh, SHEET, **options).fold("crease", to=2.4)


def powers(rate: float, sizes: tuple[float, ...] = HALVED, limit: float = 3.0) -> list[float]:
    return [limit + 0.2 * size**rate for size in sizes]


# ------------------------------------------------------------------------------------------ what values say


@pytest.mark.parametrize("rate", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("sizes", [(1.0, 0.5, 0.25), (1.0, 0.6, 0.5), HALVED])
def test_a_power_law_is_read_exactly_on_any_sizes(rate: float, sizes: tuple[float, ...]) -> None:
    found = judged(powers(rate, sizes), sizes)
    assert found.verdict is Verdict.CONVERGES
    assert found.limit.value == pytest.approx(3.0, abs=1e-9)
    assert found.limit.rate == pytest.approx(rate, abs=0.02)
    assert abs(found.values[-1] - 3.0) <= found.limit.bar


@pytest.mark.parametrize(
    ("values", "verdict"),
    [
        ([1.0, 0.9, 0.93], Verdict.TURNS),
        ([1.0, 0.9, 0.93, 0.94], Verdict.TURNS),
        ([1.0, 0.9, 0.8], Verdict.DRIFTS),
        ([1.0, 1.1, 1.1 + 0.1 / 2.0**5.2], Verdict.TOO_FAST),  # 5.2 was once shown as an order
        ([1.0, 1.0, 1.0 + 1e-12], Verdict.EXACT),
        ([1.0, 1.5, 1.505, 1.5051], Verdict.TOO_FAST),
        ([3.0, 2.0, 1.95, 1.92], Verdict.SCATTERS),
    ],
)
def test_no_order_where_none_can_be_trusted(values: list[float], verdict: Verdict) -> None:
    found = judged(values, HALVED[: len(values)])
    assert found.verdict is verdict
    assert math.isnan(found.limit.rate)
    assert bool(found.reason) == (verdict is not Verdict.EXACT)


def test_with_a_known_limit_the_order_is_the_least_of_all_pairs() -> None:
    found = judged([3.1, 3.05, 3.01], HALVED[:3], 3.0)
    assert found.orders == pytest.approx((1.0, math.log2(5.0)))
    assert found.limit.rate == pytest.approx(1.0)
    assert judged([3.1, 2.95, 3.01], HALVED[:3], 3.0).verdict is Verdict.TURNS


# ------------------------------------------------------------------------------------------ the checks


def test_the_energy_of_a_model_that_refines_itself() -> None:
    """Values by hand and by the check are the same, and the known limit is in its bar."""
    found = assert_energy_converges(folded(2), order=1.0, within=0.1)
    by_hand = [bh.trace(folded(rows))[-1].energy.total for rows in (2, 4, 8)]
    assert found.values == pytest.approx(by_hand, rel=1e-9)
    assert found.sizes[0] / found.sizes[1] == pytest.approx(2.0)
    fine = bh.trace(folded(16))[-1].energy.total
    assert abs(found.limit.value - fine) < found.limit.bar
    again = assert_energy_converges(folded, (2, 4, 8), frozen=found.limit.value, within=0.1)
    assert again.limit == found.limit


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"order": 2.5}, r"value: converges at order 2\.00, 2\.5 asked"),
        (
            {"within": 1e-4},
            r"the limit is not bracketed: 3 \+- 0\.016 \(0\.521 %\), 0\.01 % asked; add a level",
        ),
        ({"frozen": 3.1}, r"the frozen reference moved: 3\.1 before, 3 now \(3\.23 %, 0\.1 % allowed\)"),
        ({"expected": 2.9, "within": 0.01}, r"the finest value 3\.0125 is 3\.88 % off the expected 2\.9"),
    ],
)
def test_what_fails_says_why_with_a_table(asked: dict[str, float], told: str) -> None:
    values = powers(2.0)[:3]
    with pytest.raises(AssertionError, match=told) as caught:
        assert_values_converge(values, HALVED[:3], **asked)  # type: ignore[arg-type]
    rows = str(caught.value).splitlines()
    assert [word in rows[1] for word in ("size", "value", "order")] == [True] * 3
    assert "3.0125" in rows[4]
    assert_values_converge(values, HALVED[:3], order=1.9, frozen=3.0)


def test_values_that_turn_fail_and_show_no_order() -> None:
    with pytest.raises(AssertionError, match="values turn, so no order can be trusted") as caught:
        assert_values_converge([1.0, 0.9, 0.93], HALVED[:3], order=1.0)
    assert "converges at" not in str(caught.value)


def test_levels_that_do_not_refine_are_refused_in_one_line() -> None:
    calls: tuple[tuple[Callable[[], object], str], ...] = (
        (
            lambda: assert_energy_converges(folded, (2, 1, 4)),
            "do not refine: level 1 has 10 triangles, level 2 has 36",
        ),
        (lambda: assert_energy_converges(folded, (1, 1, 2)), "one stands twice"),
        (lambda: assert_energy_converges(folded, (1, 2)), "too few"),
        (
            lambda: assert_energy_converges(folded, levels=cast("tuple[int, ...]", 3)),
            "levels = 3 are no list",
        ),
        (lambda: assert_energy_converges(folded(1), (1, 2, 2.5)), "whole numbers from 1"),
        (lambda: assert_energy_converges(folded, part="torsion"), "energy has no part 'torsion'"),
        (lambda: assert_values_converge([1.0, 2.0, 3.0], [1.0, 2.0, 3.0]), "sizes that fall"),
    )
    for call, told in calls:
        with pytest.raises(bh.ModelError, match=told) as caught:
            call()
        assert "\n" not in str(caught.value)
    mesh = folded(1).mesh
    bare = bh.Model(meshes.SheetMesh(mesh.points, mesh.triangles), SHEET)
    with pytest.raises(bh.ModelError, match="cannot be refined"):
        assert_energy_converges(bare)


def test_any_quantity_of_a_state() -> None:
    found = assert_converges(
        folded,
        (2, 4, 8),
        quantity=lambda state: float(np.ptp(state.points[:, 2])),
        name="height",
        unit="mm",
        within=0.2,
    )
    assert found.values[-1] == np.ptp(bh.trace(folded(8))[-1].points[:, 2])


def test_reached_and_stable() -> None:
    model = folded(2)
    path = assert_reached(model)
    assert isinstance(path, bh.Path)
    assert assert_stable(path) is path[-1]
    assert assert_stable(path[-1]) is path[-1]
    path.steps[-1] = type(path.steps[-1])(bh.Outcome.STALLED, "no more")
    with pytest.raises(AssertionError, match=r"step 1 of 1: stalled \(no more\)"):
        assert_reached(path)
    with pytest.raises(AssertionError, match="level 4: step 1 of 1: stalled"):
        assert_energy_converges(lambda rows: path if rows == 4 else folded(rows), (1, 2, 4))
    with pytest.raises(AssertionError, match="stalled"):
        assert_stable(path)


def test_same_shape_on_other_meshes_and_by_another_formulation() -> None:
    """Moved away by a rigid motion, on another mesh, by the shell; and the other way round where they differ."""
    coarse, fine = bh.trace(folded(4)), bh.trace(folded(8))
    shell = bh.trace(folded(4, formulation="shell"))
    assert assert_same_shape(coarse, fine, 0.1).largest > 1e-4
    assert assert_same_shape(coarse, shell, 0.1).mesh is coarse[-1].mesh
    assert assert_same_shape(coarse[-1], coarse[-1], 1e-12, in_place=True).largest == 0.0
    flatter = bh.trace(bh.Model(folded(4).mesh, SHEET).fold("crease", to=2.8))
    with pytest.raises(AssertionError, match=r"shapes differ: largest distance .* mm at .*; 0\.1 mm asked"):
        assert_same_shape(coarse, flatter, 0.1)
    with pytest.raises(bh.ModelError, match="same flat sheet"):
        assert_same_shape(
            coarse,
            bh.trace(
                bh.Model(meshes.structured(meshes.strip(20.0, 5.0, [2.5]), along=4), SHEET).fold(
                    "crease", to=3.0
                )
            ),
            1.0,
        )


# ------------------------------------------------------------------------------------------ the plugin

OWN = """
import bh, meshes, pytest
from bh.testing import assert_energy_converges, assert_stable

def sheet(rows):
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.3), along=2 * rows, rows=rows)
    return bh.Model(mesh, bh.Sheet(E=4000.0, nu=0.38, t=0.127)).fold("crease", to=2.4)

@pytest.mark.levels(2, 4, 8)
def test_good():
    assert len(assert_energy_converges(sheet, order=1.0, within=0.1).values) == 3

@pytest.mark.levels(2, 4, 8)
def test_bad():
    assert_energy_converges(sheet, order=9.0, within=0.1)

def test_other():
    assert_stable(sheet(2))
"""


def test_plugin_marker_cache_summary_and_json(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(OWN)
    plugin = ("-p", "bh.testing.plugin", "-p", "no:benchmark", "--strict-markers")
    first = pytester.runpytest_inprocess(*plugin, "--bh-json", "out/checks.json")
    first.assert_outcomes(passed=2, failed=1)
    first.stdout.fnmatch_lines(
        [
            "*total energy: converges at order *, 9 asked*",
            "*level*triangles*total energy / N mm*change*order*time / s",
            "*cached",  # what the test before has solved
            "*checks of folded sheets*",
            "FAILED *::test_bad: total energy: * N mm, order *, 3 levels",
            "passed *::test_good: total energy: *",
            "passed *::test_other: stability: stable",
        ]
    )
    assert "bh/testing" not in first.stdout.str(), "the failure is shown in the user's own code"
    records = json.loads((pytester.path / "out/checks.json").read_text())["checks"]
    assert [record["passed"] for record in records] == [False, True, True]
    assert all(tuple(record) == KEYS for record in records)
    assert records[1]["params"]["order"] > 1.0
    assert records[0]["value"] == pytest.approx(records[1]["value"], rel=1e-12)
    assert len(list(pytester.path.glob(".pytest_cache/d/bh-levels/*.bh"))) == 3, "one a level, for all tests"
    anew = pytester.runpytest_inprocess(*plugin, "--bh-no-cache", "-k", "bad")
    anew.assert_outcomes(failed=1, deselected=2)
    assert "cached" not in anew.stdout.str()


def test_the_example_of_a_project_of_ones_own(pytester: pytest.Pytester) -> None:
    shutil.copytree(ROOT / "examples" / "own_project", pytester.path, dirs_exist_ok=True)
    pytester.runpytest_inprocess("-p", "bh.testing.plugin", "-p", "no:benchmark").assert_outcomes(passed=3)


def test_solved_levels_are_filed_by_their_input_and_never_for_code_of_ones_own() -> None:
    key = levels._key(folded(2))
    assert key == levels._key(folded(2))
    assert key != levels._key(folded(4))
    assert key != levels._key(folded(2, formulation="shell"))
    assert levels._key(folded(2, formulation="own:Formulation")) is None
    mesh = folded(2).mesh
    until = bh.Until("own:function", 1.0)
    assert levels._key(bh.Model(mesh, SHEET).step(bh.Fold("crease", to=2.4), until=until)) is None


def test_plugin_is_registered_and_loads_nothing() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["project"]["entry-points"]["pytest11"] == {"bh.testing.plugin": "bh.testing.plugin"}
    code = (
        "import json, pytest, sys; old = set(sys.modules); import bh.testing.plugin; "
        "print(json.dumps(sorted(set(sys.modules) - old)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    loaded = {name.split(".")[0] for name in json.loads(done.stdout)}
    assert "bh" in loaded
    assert not loaded & {"numpy", "scipy", "numba", "meshes", "fem", "verification", "pydantic"}


@pytest.mark.parametrize(
    ("check", "of", "asked", "told"),
    [
        (assert_energy_converges, folded, {"within": 5}, "5 holds for all values; .* 0.05 is 5 %"),
        (assert_energy_converges, folded, {"within": -1}, "within = -1 cannot be; give a positive number"),
        (assert_energy_converges, folded, {"order": "2"}, "order = '2' cannot be; give a positive number"),
        (
            assert_converges,
            folded,
            {"quantity": lambda state: state.points, "name": "tip"},
            r"tip is a ndarray of shape \(\d+, 3\) and no number",
        ),
        (assert_stable, "out", {}, "a str cannot be checked; give a model, a path or a state"),
        (assert_reached, folded, {}, "a function cannot be checked"),
        (assert_same_shape, folded(1), {"two": folded(2), "within": "1deg"}, '"1deg" is no length'),
    ],
)
def test_wrong_use_is_one_line(check: Any, of: object, asked: dict[str, object], told: str) -> None:
    with pytest.raises(bh.InputError, match=told) as caught:
        check(of, **asked)
    assert "\n" not in str(caught.value)


def test_a_distance_may_have_a_unit() -> None:
    assert assert_same_shape(folded(1), folded(2), within="1mm").largest < 1.0
    with pytest.raises(AssertionError, match=r"1e-05 mm asked"):
        assert_same_shape(folded(1), folded(2), within="0.01um")
