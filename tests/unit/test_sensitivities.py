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
from bh.analysis.node_sensitivities import of_nodes
from bh.analysis.sensitivities import (
    Energy,
    FoldAngle,
    Observable,
    OfNodes,
    OfPoints,
    Position,
    Stiffness,
    of,
)
from bh.analysis.situation import Situation
from bh.analysis.stiffness_probe import Probe
from bh.applications.polish import polish
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


def pinched(formulation: str) -> Build:
    """Width, thickness, L*, rest angle, pinched angle: the pinch goes on from the angles that the fold came to."""

    def build(p: Array) -> bh.Model:
        model = supported(formulation, 100.0, p[0], p[1]).fold("crease", rest=p[3], Lstar=p[2])
        return model.pinch("crease", to=p[4], length=30.0).force(TIP, each=[0.0, 0.0, 1e-3])

    return build


DESIGNS: dict[str, tuple[Callable[[str], Build], list[float]]] = {
    "held": (held, [100.0, 8.0, 0.2, 1.9]),
    "spring": (spring, [8.0, 0.2, 10.0, 1.6]),
    "displaced": (displaced, [0.6, 2.0, 0.15]),
    "pinched": (pinched, [8.0, 0.2, 10.0, 1.9, 1.2]),
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
    from bh.mechanics.bars_and_hinges.derivatives import BarHingeDerivatives

    build, p = held("bars-and-hinges"), np.array(DESIGNS["held"][1])
    path = bh.trace(build(p), strategy=EXACT)
    whole = of(path, build, p, [Energy("stretching")])[0].gradient
    kept = BarHingeDerivatives.residual_to_data

    def without(self: BarHingeDerivatives, v: Array, w: Array) -> dict[str, Array]:
        return {**kept(self, v, w), "bar_stiffness": np.zeros_like(self.length)}

    monkeypatch.setattr(BarHingeDerivatives, "residual_to_data", without)
    assert np.abs(of(path, build, p, [Energy("stretching")])[0].gradient / whole - 1.0).max() > 1e-3


def test_a_function_of_nodes_by_complex_step() -> None:
    build, p = held("consistent"), np.array(DESIGNS["held"][1])
    path = bh.trace(build(p), strategy=EXACT)
    a, b = 0, int(path.model.mesh.nodes(TIP)[0])

    def distance(x: NDArray[np.float64 | np.complex128]) -> complex:
        return complex(np.sqrt(((x[1] - x[0]) * (x[1] - x[0])).sum()))

    def whole(points: Array) -> tuple[float, Array]:
        away = points[b] - points[a]
        gradient = np.zeros_like(points)
        gradient[b], gradient[a] = away / np.linalg.norm(away), -away / np.linalg.norm(away)
        return float(np.linalg.norm(away)), gradient

    one, two = of(path, build, p, [OfNodes([a, b], distance), OfPoints(whole)])
    assert one.value == pytest.approx(two.value)
    assert one.gradient == pytest.approx(two.gradient, rel=1e-9)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_polishing_meets_targets(formulation: str) -> None:
    """Tip and energy of another design, from 5 % beside it, with fewer targets than parameters."""
    build = held(formulation)
    aim, start = np.array([100.0, 8.0, 0.2, 1.9]), np.array([104.0, 8.4, 0.19, 1.85])
    targets: list[Observable] = [Position(TIP, "x"), Position(TIP, "y"), Energy()]
    at = Situation(bh.trace(build(aim)), -1)
    wanted = [(item, item.value(at)) for item in targets]
    allowed = [1e-4, 1e-4, 1e-6]
    found = polish(build, start, wanted, allowed, bounds=([90, 7, 0.1, 1.0], [110, 9, 0.3, 2.5]))
    assert found.outcome == "reached"
    assert found.solves <= 8
    assert (np.abs(found.missed) <= allowed).all()
    again = Situation(bh.trace(build(found.design)), -1)
    assert [item.value(again) for item in targets] == pytest.approx([value for _, value in wanted], rel=1e-5)


def test_polishing_says_where_it_stops() -> None:
    build, p = held("bars-and-hinges"), np.array(DESIGNS["held"][1])
    far = [(Position(TIP, "x"), 500.0)]
    bounds = ([95, 7, 0.1, 1.5], [105, 9, 0.3, 2.2])
    found = polish(build, p, far, 0.1, bounds=bounds)
    assert found.outcome == "no descent"  # at the bounds
    assert ((found.design == bounds[0]) | (found.design == bounds[1])).any()
    assert polish(build, p, far, 0.1, bounds=bounds, most=2).outcome == "limit of solves"
    with pytest.raises(InputError, match="outside its bounds"):
        polish(build, p, far, 0.1, bounds=([0] * 4, [1] * 4))
    with pytest.raises(InputError, match="at least one target and positive tolerances"):
        polish(build, p, far, 0.0)
    with pytest.raises(InputError, match="scale must be 4 positive numbers"):
        polish(build, p, far, 0.1, scale=[1.0])


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

    def turning(q: Array) -> bh.Model:
        mesh = meshes.structured(meshes.annulus_sector(100.0, 8.0, 0.6), along=8)
        model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.2), formulation="bars-and-hinges").support(
            "corner:inner-start", "xyz"
        )
        model = model.support("corner:outer-start", [[q[0], 1, 0], [0, 0, 1]]).support(
            "corner:inner-end", "z"
        )
        return model.fold("crease", to=2.0)

    oblique = bh.trace(turning(np.array([0.3])))
    with pytest.raises(InputError, match="directions of oblique supports change"):
        of(oblique, turning, [0.3], [Energy()])

    def until(q: Array) -> bh.Model:
        target = bh.Until("fold_angle", 1.0, "crease")
        return supported("bars-and-hinges", q[0], q[1], q[2]).fold("crease", to=1.0, until=target)

    ended = bh.trace(until(p))
    assert ended.outcome == "reached"
    with pytest.raises(InputError, match="has no sensitivities; give it its end"):
        of(ended, until, p, [Energy()])
    shell = bh.trace(replace(build(p), formulation="shell"))
    with pytest.raises(InputError, match="formulation 'shell' has no sensitivities"):
        of(shell, lambda q: replace(build(q), formulation="shell"), p, [Energy()])
    several = bh.LoadControl(largest_rotation=0.2, first_rotation=0.2)
    stepped = bh.trace(build(p).fold("crease", to=1.5), strategy=several)
    middle = next(i for i, record in enumerate(stepped.records) if record.step == 1 and record.lam < 1.0)
    with pytest.raises(InputError, match="depends on the step before; take its end"):
        of(stepped, lambda q: build(q).fold("crease", to=1.5), p, [Energy()], index=middle)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("name", ["held", "spring"])
def test_all_nodes_at_once(formulation: str, name: str) -> None:
    """The chain rule with any smooth move of the nodes gives what `of` gives for that move."""
    make, start = DESIGNS[name]
    base = make(formulation)(np.array(start))
    flat = base.mesh.points

    def moved(p: Array) -> bh.Model:
        x, y = flat[:, 0], flat[:, 1]
        shift = np.column_stack((p[0] * np.sin(y / 30.0), p[1] * x * y / 1000.0, 0.0 * x))
        return replace(base, mesh=replace(base.mesh, points=flat + shift))

    path = bh.trace(base, strategy=EXACT)
    observables: list[Observable] = [
        Position(TIP, "x"),
        Energy(),
        FoldAngle("crease", 2),
        Stiffness(TIP, "z"),
    ]
    found = of_nodes(path, observables)
    expected = of(path, moved, [0.0, 0.0], observables, steps=[1e-2, 1e-2])
    x, y = flat[:, 0], flat[:, 1]
    for item, known in zip(found, expected, strict=True):
        mine = [float(item.gradient[:, 0] @ np.sin(y / 30.0)), float(item.gradient[:, 1] @ (x * y / 1000.0))]
        scale = max(float(np.abs(known.gradient).max()), 1e-3 * abs(known.value))
        assert np.abs(mine - known.gradient).max() < 1e-7 * scale
    whole = found[1].gradient.sum(axis=0)  # to move the whole sheet changes no energy
    assert np.abs(whole).max() < 1e-7 * np.abs(found[1].gradient).max()


def test_nodes_of_pinched_sheets_are_refused() -> None:
    build = pinched("bars-and-hinges")
    path = bh.trace(build(np.array(DESIGNS["pinched"][1])))
    with pytest.raises(InputError, match="a pinched zone depends on all nodes"):
        of_nodes(path, [Energy()])
