"""Linearised buckling: columns and plates, turned sheets, what a path does there, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import bh
import meshes
from bh.analysis import buckling
from bh.analysis.buckling import buckling_modes
from bh.paths.path import Path

E, L, WIDE, T, PRESS = 4000.0, 60.0, 10.0, 0.3, 0.01
EULER = math.pi**2 * E * WIDE * T**3 / 12.0 / L**2


def column(
    turn: float = 0.0, formulation: str = "consistent", along: int = 24
) -> tuple[bh.Model, bh.Displace]:
    mesh = meshes.structured(
        meshes.strip(L, WIDE, [0.5 * WIDE], "flat"), along=along, rows=max(along // 24, 1)
    )
    c, s = math.cos(turn), math.sin(turn)
    mesh = replace(mesh, points=mesh.points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))
    model = bh.Model(mesh, bh.Sheet(E=E, nu=0.0, t=T), formulation=formulation)
    model = model.support("edge:start", "xyz").support("edge:end", [[-s, c, 0.0], [0.0, 0.0, 1.0]])
    return model, bh.Displace("edge:end", [c, s, 0.0], -PRESS)


@pytest.mark.parametrize("formulation", ["consistent", "linear-shell"])
def test_a_column_has_eulers_loads(formulation: str) -> None:
    """1, 4 and 9 times pi^2 E I / L^2, with a fourth of the error on half as long cells."""
    off = []
    for along in (24, 48):
        model, press = column(formulation=formulation, along=along)
        modes = buckling_modes(Path(model), press, count=3)
        loads = np.array([mode.factor * E * WIDE * T * PRESS / L for mode in modes])
        off.append(loads / EULER / [1.0, 4.0, 9.0] - 1.0)
    assert np.abs(off[-1]).max() < 0.02
    assert np.log2(off[0] / off[1]) == pytest.approx([2.0] * 3, abs=0.1)
    first = modes[0].shape
    assert np.abs(first).max() == pytest.approx(1.0)
    x = model.mesh.points[:, 0]
    assert np.abs(np.abs(first[:, 2]) - np.sin(np.pi * x / L)).max() < 0.02


def test_loads_do_not_hang_on_the_direction_and_scale_with_the_load() -> None:
    model, press = column()
    found = [mode.factor for mode in buckling_modes(Path(model), press)]
    turned, pressed = column(turn=0.7)
    assert [m.factor for m in buckling_modes(Path(turned), pressed)] == pytest.approx(found, rel=1e-6)
    half = bh.Displace("edge:end", "x", -0.5 * PRESS)
    assert [m.factor for m in buckling_modes(Path(model), half)] == pytest.approx(
        [2.0 * f for f in found], rel=1e-6
    )


def test_all_modes_at_once_are_those_of_lanczos(monkeypatch: pytest.MonkeyPatch) -> None:
    model, press = column(along=6)
    few = [mode.factor for mode in buckling_modes(Path(model), press, count=2)]
    monkeypatch.setattr(buckling, "DENSE", 10**6)
    assert [mode.factor for mode in buckling_modes(Path(model), press, count=2)] == pytest.approx(
        few, rel=1e-8
    )


def test_the_path_loses_its_stability_there() -> None:
    model, press = column(along=12)
    factor = buckling_modes(Path(model), press, count=1)[0].factor
    for times, stable in ((0.99, True), (1.01, False)):
        pressed = model.displace("edge:end", "x", -PRESS * factor * times)
        stay = bh.LoadControl(at_bifurcation="primary")
        assert bh.trace(pressed, strategy=stay, warn=False).stable is stable


def test_a_pull_buckles_nothing() -> None:
    model, _ = column(along=8)
    assert buckling_modes(Path(model), bh.Displace("edge:end", "x", PRESS)) == []


def test_a_load_on_a_folded_sheet() -> None:
    """The state is the path's last one; the load begins there."""
    mesh = meshes.structured(meshes.strip(40, 16, [8.0], "valley"), along=10, rows=2)
    model = bh.Model(mesh, bh.Sheet(E=E, nu=0.0, t=T), formulation="consistent").support("edge:start", "x")
    ends = [int(mesh.nodes("crease:crease")[k]) for k in (0, -1)]
    model = model.support(ends, "yz").support("corner:inner-start", "z")
    press = bh.Displace("edge:end", "x", further=-PRESS)
    weak, firm = (
        buckling_modes(bh.trace(model.fold("crease", by=by, Lstar=20.0)), press, count=1)[0].factor
        for by in (0.05, 1.0)
    )
    assert firm > 1.2 * weak


def test_what_is_refused() -> None:
    model, press = column(along=6)
    with pytest.raises(bh.ModelError, match="needs a load"):
        buckling_modes(Path(model))
    with pytest.raises(bh.ModelError, match="does nothing"):
        buckling_modes(Path(model), bh.Force("edge:start", total=(1.0, 0.0, 0.0)))
    with pytest.raises(bh.ModelError, match="count = 0"):
        buckling_modes(Path(model), press, count=0)
    hanging = replace(model, supports=()).support("rigid-body")
    with pytest.raises(bh.ModelError, match="hangs free"):
        buckling_modes(Path(hanging), bh.Weight((0.0, 0.0, 0.0), density=1.0))
    bent = bh.trace(model.displace("edge:end", "x", -0.2), strategy=bh.LoadControl(at_bifurcation="primary"))
    with pytest.raises(bh.ModelError, match="not stable"):
        buckling_modes(bent, bh.Displace("edge:end", "x", further=-PRESS))


def test_imposed_creases_are_refused_where_they_have_multipliers() -> None:
    mesh = meshes.structured(meshes.strip(L, WIDE, [0.5 * WIDE], "valley"), along=6, rows=1)
    for formulation in ("consistent", "bars-and-hinges"):
        model = bh.Model(mesh, bh.Sheet(E=E, t=T), formulation=formulation).support("edge:start", "xyz")
        path = bh.trace(model.support("corner:inner-end", "yz").fold("crease", by=0.5))
        pull = bh.Force("corner:outer-end", total=(-1.0, 0.0, 0.0))
        if formulation == "consistent":
            assert buckling_modes(path, pull, count=1)[0].factor > 0.0
            continue
        with pytest.raises(bh.ModelError, match="imposed exactly"):
            buckling_modes(path, pull)
