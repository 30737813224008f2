"""Adjoint sensitivities against finite differences of whole solutions, for both formulations."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh.analysis import sensitivities
from bh.analysis.sensitivities import (
    Energy,
    FoldAngle,
    Observable,
    OfPoints,
    Position,
    Situation,
    Stiffness,
    of,
)
from bh.analysis.stiffness_probe import Probe
from meshes.errors import InputError

Array = NDArray[np.float64]
Build = Callable[[Array], bh.Model]
FORMULATIONS = ("bars-and-hinges", "consistent")
TIP = "corner:outer-end"
EXACT = bh.Automatic(load=bh.LoadControl(newton=bh.Newton(tolerance=1e-11)))


def supported(formulation: str, radius: float, width: float, t: float, angle: float = 0.6) -> bh.Model:
    mesh = meshes.structured(
        meshes.annulus_sector(radius, width, angle), along=8, rows=1 if formulation == FORMULATIONS[0] else 2
    )
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=t, nu=0.3), formulation=formulation)
    model = model.support("corner:inner-start", "xyz").support("corner:outer-start", "yz")
    return model.support("corner:inner-end", "z")


def held(formulation: str) -> Build:
    """Radius, width, thickness and the imposed angle."""
    return lambda p: supported(formulation, p[0], p[1], p[2]).fold("crease", to=p[3])


def spring(formulation: str) -> Build:
    """Width, thickness, L* and rest angle, with a force that depends on the design in a second step."""

    def build(p: Array) -> bh.Model:
        model = supported(formulation, 100.0, p[0], p[1])
        model = model.fold("crease", rest=p[3], Lstar=p[2])
        return model.force(TIP, each=[0.0, 0.0, 1e-3 * p[0]])

    return build


def displaced(formulation: str) -> Build:
    """Sector angle, a prescribed displacement, and a couple on the crease; an oblique support."""

    def build(p: Array) -> bh.Model:
        mesh = meshes.structured(meshes.annulus_sector(100.0, 8.0, p[0]), along=8, rows=1)
        model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.2), formulation=formulation)
        model = model.support("corner:inner-start", "xyz").support(
            "corner:outer-start", [[0.3, 1, 0], [0, 0, 1]]
        )
        model = model.support("corner:inner-end", "z").crease("crease", Lstar=5.0)
        return model.moment("crease", p[2]).displace(TIP, "z", by=p[1])

    return build


DESIGNS: dict[str, tuple[Callable[[str], Build], list[float]]] = {
    "held": (held, [100.0, 8.0, 0.2, 1.9]),
    "spring": (spring, [8.0, 0.2, 10.0, 1.6]),
    "displaced": (displaced, [0.6, 2.0, 0.15]),
}


def spread(points: Array) -> tuple[float, Array]:
    """Mean square distance of the nodes from their middle, mm^2: does not feel rigid motions."""
    away = points - points.mean(axis=0)
    return float((away**2).sum() / len(points)), 2.0 * away / len(points)


OBSERVABLES: list[Observable] = [
    Position(TIP, "x"),
    Position("edge:end", [0.6, 0.0, 0.8]),
    Energy(),
    Energy("bending"),
    FoldAngle("crease"),
    FoldAngle("crease", 3),
    Stiffness("corner:outer-start", "x"),
    OfPoints(spread),
]


def differences(build: Build, p: Array, observables: list[Observable]) -> Array:
    """(observables, k) sixth-order differences of solved states."""
    out = np.zeros((len(observables), len(p)))
    for i in range(len(p)):
        h = 1e-3 * p[i]
        for weight, offset in zip(sensitivities.SIXTH, sensitivities.OFFSETS, strict=True):
            q = p.copy()
            q[i] += offset * h
            path = bh.trace(build(q), strategy=EXACT)
            assert path.outcome == "reached"
            at = Situation(path, -1)
            out[:, i] += weight / h * np.array([observable.value(at) for observable in observables])
    return out


@pytest.mark.parametrize("name", DESIGNS)
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_against_differences_of_solutions(formulation: str, name: str) -> None:
    """To 1e-5 of the largest entry with each parameter in units of itself; most are better than 1e-8."""
    make, start = DESIGNS[name]
    build, p = make(formulation), np.array(start)
    path = bh.trace(build(p), strategy=EXACT)
    assert path.outcome == "reached"
    exact = differences(build, p, OBSERVABLES) * p
    found = of(path, build, p, OBSERVABLES)
    at = Situation(path, -1)
    for observable, mine, theirs in zip(OBSERVABLES, found, exact, strict=True):
        scale = max(float(np.abs(theirs).max()), 1e-6 * abs(mine.value))
        assert mine.value == pytest.approx(observable.value(at), rel=1e-9)
        assert np.abs(mine.gradient * p - theirs).max() < 1e-5 * scale, observable
        assert (mine.error * p).max() < 1e-8 * scale, observable


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_free_sheets(formulation: str) -> None:
    """Without supports what rigid motions leave alone has sensitivities; a place in space has none."""

    def build(p: Array) -> bh.Model:
        mesh = meshes.structured(meshes.annulus_sector(p[0], 8.0, 0.6), along=8, rows=2)
        return bh.Model(mesh, bh.Sheet(E=4000.0, t=p[1]), formulation=formulation).fold("crease", to=2.0)

    p = np.array([100.0, 0.2])
    path = bh.trace(build(p), strategy=EXACT)
    observables: list[Observable] = [Energy(), OfPoints(spread)]
    exact = differences(build, p, observables)
    for mine, theirs in zip(of(path, build, p, observables), exact, strict=True):
        assert mine.gradient == pytest.approx(theirs, rel=1e-6)
    with pytest.raises(InputError, match="when the sheet moves as a rigid body"):
        of(path, build, p, [Position(TIP, "z")])


def test_near_closed_where_locks_act() -> None:
    """A stiff crease with its rest angle near zero comes within two degrees: the lock depends on the design too."""

    def build(p: Array) -> bh.Model:
        return supported("bars-and-hinges", 100.0, 8.0, p[0], 0.3).fold("crease", rest=p[1], Lstar=p[2])

    p = np.array([0.2, 0.01, 0.01])
    path = bh.trace(build(p), strategy=EXACT)
    assert path.outcome == "reached"
    assert path[-1].energy.lock > 0.0
    observables: list[Observable] = [FoldAngle("crease"), Energy()]
    exact = differences(build, p, observables) * p
    for mine, theirs in zip(of(path, build, p, observables), exact, strict=True):
        assert np.abs(mine.gradient * p - theirs).max() < 1e-5 * np.abs(theirs).max()


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_closed_forms(formulation: str) -> None:
    """Bending energy goes with t^3 while the shape stays; the stiffness is that of the probe."""
    build, p = held(formulation), np.array(DESIGNS["held"][1])
    p[2] = 0.02  # so thin that hardly anything stretches
    path = bh.trace(build(p), strategy=EXACT)
    energy, stiffness, angle = of(path, build, p, [Energy(), Stiffness(TIP, "z"), FoldAngle("crease")])
    assert energy.gradient[2] * p[2] / energy.value == pytest.approx(3.0, abs=2e-2)
    loaded = Probe(path).at([int(path.model.mesh.nodes(TIP)[0])]).loaded([0.0, 0.0, 1.0])
    assert stiffness.value == pytest.approx(float(loaded), rel=1e-6)
    assert angle.gradient == pytest.approx([0.0, 0.0, 0.0, -1.0], abs=1e-9)


def test_an_error_in_the_kernels_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out how the bars' stiffness changes with the design: the check above must fail."""
    from bh.mechanics.bar_hinge_design import BarHingeDesign

    build, p = held("bars-and-hinges"), np.array(DESIGNS["held"][1])
    path = bh.trace(build(p), strategy=EXACT)
    whole = of(path, build, p, [Energy("stretching")])[0].gradient
    kept = BarHingeDesign.residual_to_data

    def without(self: BarHingeDesign, v: Array, w: Array) -> dict[str, Array]:
        return {**kept(self, v, w), "bar_stiffness": np.zeros_like(self.length)}

    monkeypatch.setattr(BarHingeDesign, "residual_to_data", without)
    assert np.abs(of(path, build, p, [Energy("stretching")])[0].gradient / whole - 1.0).max() > 1e-3


def test_the_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    """What docs/sensitivities.md shows."""
    page = (Path(__file__).resolve().parents[2] / "docs" / "sensitivities.md").read_text(encoding="utf-8")
    exec(page.split("```python\n")[1].split("```")[0], {})
    assert capsys.readouterr().out.startswith("80.9")


def test_bad_input() -> None:
    build, p = held("bars-and-hinges"), np.array(DESIGNS["held"][1])
    path = bh.trace(build(p))
    with pytest.raises(InputError, match="makes another mesh"):
        of(path, build, p * 1.1, [Energy()])
    with pytest.raises(InputError, match="another sheet or formulation"):
        of(path, build, [*p[:2], 0.3, p[3]], [Energy()])
    with pytest.raises(InputError, match="list of finite numbers"):
        of(path, build, [math.nan], [Energy()])
    with pytest.raises(InputError, match="steps must be 4 positive numbers"):
        of(path, build, p, [Energy()], steps=[0.1])
    with pytest.raises(InputError, match="energy 'heat' is not known"):
        Energy("heat")
    with pytest.raises(InputError, match="has 8 edges, none of number 9"):
        of(path, build, p, [FoldAngle("crease", 9)])
    with pytest.raises(InputError, match="is not one direction"):
        of(path, build, p, [Position(TIP, "xy")])
    with pytest.raises(InputError, match="a function of points has shape"):
        of(path, build, p, [OfPoints(lambda x: (1.0, np.zeros(3)))])

    def finer(q: Array) -> bh.Model:
        model = build(q)
        if q[0] == p[0]:
            return model
        return replace(model, mesh=meshes.structured(meshes.annulus_sector(q[0], q[1], 0.6), along=9))

    with pytest.raises(InputError, match="keep the number of cells fixed"):
        of(path, finer, p, [Energy()])
    shell = bh.trace(replace(build(p), formulation="shell"))
    with pytest.raises(InputError, match="formulation 'shell' has no sensitivities"):
        of(shell, lambda q: replace(build(q), formulation="shell"), p, [Energy()])
    stepped = bh.trace(build(p).fold("crease", to=1.5))
    middle = next(i for i, record in enumerate(stepped.records) if record.step == 1 and record.lam < 1.0)
    with pytest.raises(InputError, match="depends on the step before; take its end"):
        of(stepped, lambda q: build(q).fold("crease", to=1.5), p, [Energy()], index=middle)
