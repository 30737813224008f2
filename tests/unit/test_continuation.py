"""Paths with limit and bifurcation points: located, passed, followed, and told; against exact curves."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh import ArcLength, Automatic, DisplacementControl, LoadControl, Model, Newton, Sheet, trace
from bh.solvers.arc_length import Displacement, Generalised
from bh.solvers.automatic import behind_limit
from bh.solvers.outcome import Outcome
from bh.solvers.points import ARC, DISPLACEMENT, LOAD, Increment, Mode, Point, fold_ahead, point
from bh.solvers.pseudo_transient import PseudoTransient
from bh.solvers.stability import leave_saddle
from bh.solvers.system import Evaluation
from bh.solvers.walk import Strategy, Walk, walk
from tests.unit.test_newton import Arch, Column, Small, Stiffening
from verification.studies.app_b.shell_folding import sheet_model
from verification.studies.solver.benchmark_systems import VonMisesTruss

Array = NDArray[np.float64]
ARCH_LIMIT = 2.0 / (3.0 * math.sqrt(3.0))


def follow(system: Any, strategy: Strategy, q: Array) -> list[Increment]:
    return list(walk(Walk(system, strategy, (point(system, q, 0.0),))))


class Absolute(Small):
    """A system without load: its residual is measured as it is."""

    def evaluate(self, q: Array, lam: float) -> Evaluation:
        now = super().evaluate(q, lam)
        return now._replace(imbalance=float(np.abs(now.residual).max()))


# --------------------------------------------------------------------------------------- critical points


@pytest.mark.parametrize("strategy", [ArcLength(), ArcLength(control=Generalised()), DisplacementControl()])
def test_limit_points_of_the_truss(strategy: ArcLength) -> None:
    """Both limit points of the snap-through, from both sides, at their exact loads; the mode is the top's."""
    truss = VonMisesTruss()
    found = follow(truss, strategy, np.zeros(1))
    assert found[-1].outcome == "reached"
    assert found[-1].point.lam == 1.0
    critical = [c for item in found for c in item.critical]
    assert [c.kind for c in critical] == ["limit", "limit"]
    assert [c.negative for c in critical] == [(0, 1), (1, 0)]
    assert critical[0].lam == pytest.approx(truss.limit(), rel=1e-6)
    assert critical[1].lam == pytest.approx(-truss.limit(), rel=1e-6)  # the truss is symmetric
    assert all(c.error < 1e-6 for c in critical)
    assert np.abs(critical[0].mode) == pytest.approx([1.0])
    for item in found:
        assert truss.load(item.point.q[0]) == pytest.approx(item.point.lam, abs=1e-7)
        assert item.point.mode == (DISPLACEMENT if isinstance(strategy, DisplacementControl) else ARC)


def test_displacement_control_of_a_chosen_unknown() -> None:
    """With a stiff spring at the load its end moves on always; with a soft one it snaps back, the top does not."""
    top = Displacement(along=lambda system: np.array([1.0, 0.0]))
    end = Displacement(along=lambda system: np.array([0.0, 1.0]))
    for spring, along, through in ((0.5, top, True), (0.5, end, True), (0.05, top, True), (0.05, end, False)):
        truss = VonMisesTruss(spring=spring)
        found = follow(truss, ArcLength(control=along, most=200), np.zeros(2))
        assert (found[-1].outcome == "reached" and found[-1].point.lam == 1.0) is through, (spring, along)


def test_bifurcation_of_the_column() -> None:
    """The straight column loses its stability at 0.3: located with its mode, and left for the bent one."""
    found = follow(Column(), Automatic(), np.zeros(2))
    critical = [c for item in found for c in item.critical]
    assert [c.kind for c in critical] == ["bifurcation"]
    assert critical[0].lam == pytest.approx(0.3, abs=1e-5)
    assert critical[0].error < 1e-5
    assert np.abs(critical[0].mode) == pytest.approx([0.0, 1.0], abs=1e-4)
    assert critical[0].negative == (0, 1)
    u, w = found[-1].point.q
    assert w * w == pytest.approx((u - 0.3) / 2.0, abs=1e-7)
    assert found[-1].stable


def test_states_are_the_same_where_critical_points_are_not_located() -> None:
    one, two = (follow(Column(), LoadControl(locate=locate), np.zeros(2)) for locate in (True, False))
    assert [item.point.q.tolist() for item in one] == [item.point.q.tolist() for item in two]
    assert sum(len(item.critical) for item in one) == 1
    assert not any(item.critical for item in two)


def test_staying_on_the_primary_branch() -> None:
    found = follow(Column(), Automatic(at_bifurcation="primary"), np.zeros(2))
    assert found[-1].point.lam == 1.0
    assert found[-1].point.q == pytest.approx([1.0, 0.0], abs=1e-9)
    assert found[-1].negative == 1
    assert [item.stable for item in found if item.point.lam > 0.3] == [False] * sum(
        item.point.lam > 0.3 for item in found
    )


def test_stopping_at_a_bifurcation() -> None:
    found = follow(Column(), Automatic(at_bifurcation="stop"), np.zeros(2))
    assert found[-1].outcome == "bifurcation"
    assert found[-1].point.lam < 0.3
    assert found[-1].critical[0].lam == pytest.approx(0.3, abs=1e-5)
    assert found[-1].note.startswith("the branch loses its stability at lambda 0.3")
    assert ";" not in found[-1].note  # nothing else was tried


def test_the_lower_branch_is_taken() -> None:
    """An asymmetric bifurcation: downhill in both senses of the mode, but deeper in one."""

    class Lopsided(Absolute):
        def internal(self, q: Array) -> tuple[float, Array, Array]:
            # straight at w = 0; w^4 / 4 - skew w^3 / 3 - u w^2 / 2 has two minima of different depth
            u, w = q
            energy = 0.5 * (u - 1.0) ** 2 * 50.0 + w**4 / 4 + 0.2 * w**3 / 3 - (u - 0.5) * w * w / 2
            gradient = np.array([50.0 * (u - 1.0) - w * w / 2, w**3 + 0.2 * w * w - (u - 0.5) * w])
            return float(energy), gradient, np.array([[50.0, -w], [-w, 3 * w * w + 0.4 * w - (u - 0.5)]])

    system = Lopsided(2, [0.0, 0.0])
    newton = Newton(unstable=True)
    saddle = newton.solve(system, np.array([1.0, 0.0]), 0.0)
    assert saddle.negative == 1
    found, note = leave_saddle(system, saddle, 0.0, Newton())
    assert note
    assert found.q[1] < 0.0
    u = 1.0 + found.q[1] ** 2 / 100.0
    assert found.q[1] == pytest.approx(-0.1 - math.sqrt(0.01 + u - 0.5), rel=1e-6)


# --------------------------------------------------------------------------------------- the default strategy


@pytest.mark.parametrize("load", [0.5, 1.0, 10.0])
def test_automatic_passes_the_limit_point_and_goes_back(load: float) -> None:
    """Through the snap by arc length, and by load control again behind it; every state on the exact curve."""
    system = Arch(load)
    found = follow(system, Automatic(), np.array([-1.0]))
    assert found[-1].outcome == "reached"
    assert found[-1].point.lam == 1.0
    assert found[-1].stable
    for item in found:
        q = float(item.point.q[0])
        assert q**3 - q == pytest.approx(load * item.point.lam, abs=1e-6)
    modes = [item.point.mode for item in found]
    if load == 10.0:
        assert modes[-1] == LOAD  # far behind the snap
        assert sum(item.jumped for item in found) == 1
    limits = [c for item in found for c in item.critical]
    assert [c.kind for c in limits] == ["limit", "limit"]
    assert [c.lam * load for c in limits] == pytest.approx([ARCH_LIMIT, -ARCH_LIMIT], rel=1e-6)


def test_load_control_alone_names_the_limit_point() -> None:
    found = follow(Arch(0.5), LoadControl(newton=Newton(globalised=0)), np.array([-1.0]))
    assert found[-1].outcome == "limit-point"
    assert found[-1].point.lam * 0.5 == pytest.approx(ARCH_LIMIT, rel=1e-3)
    assert found[-1].point.lam * 0.5 < ARCH_LIMIT


def at(lam: float, q: float, mode: Mode = LOAD, negative: int | None = 0) -> Point:
    return Point(lam, np.array([q]), np.zeros(0), 0.0, 0.0, mode, negative)


def test_a_limit_point_is_seen_coming() -> None:
    """On a parabola the estimate is good; on a straight path, or with two points, there is none."""
    run = [at(1.0 - (1.0 - q) ** 2, q) for q in (0.0, 0.5, 0.8)]
    assert fold_ahead(run, 1) == pytest.approx(1.0, abs=0.1)
    run = [at(1.0 - (1.0 - q) ** 2, q) for q in (0.6, 0.8, 0.92)]
    assert fold_ahead(run, 1) == pytest.approx(1.0, abs=0.01)
    assert fold_ahead(run[:2], 1) == math.inf
    assert fold_ahead([at(lam, lam) for lam in (0.1, 0.2, 0.3)], 1) == math.inf


def test_when_load_control_takes_over_again() -> None:
    before = [at(0.1, 1.0), at(0.2, 2.0)]
    through = [*before, at(0.21, 3.0, ARC), at(0.1, 4.0, ARC, 1), at(0.15, 5.0, ARC)]
    assert not behind_limit(through)  # stable, but lower than before
    assert behind_limit([*through, at(0.25, 6.0, ARC)])
    assert not behind_limit([*through, at(0.25, 6.0, ARC, 1)])
    assert not behind_limit([*before, at(0.21, 3.0, ARC), at(0.22, 3.1, ARC)])  # not there yet
    steady = [*before, *(at(0.21 + 0.01 * i, 3.0, ARC) for i in range(9))]
    assert behind_limit(steady)  # there was no limit point


# --------------------------------------------------------------------------------------- last resort


class Valley(Absolute):
    """Rosenbrock's: a narrow curved valley to (1, 1)."""

    def __init__(self) -> None:
        super().__init__(2, [0.0, 0.0])

    def internal(self, q: Array) -> tuple[float, Array, Array]:
        x, y = q
        energy = 100.0 * (y - x * x) ** 2 + (1.0 - x) ** 2
        gradient = np.array([-400.0 * x * (y - x * x) - 2.0 * (1.0 - x), 200.0 * (y - x * x)])
        hessian = np.array([[1200.0 * x * x - 400.0 * y + 2.0, -400.0 * x], [-400.0 * x, 200.0]])
        return float(energy), gradient, hessian


@pytest.mark.parametrize("start", [(-1.2, 1.0), (3.0, -4.0), (0.0, 5.0)])
def test_pseudo_transient_comes_to_rest(start: tuple[float, float]) -> None:
    system = Valley()
    q, now, steps = PseudoTransient().relax(system, np.array(start), 0.0, 1e-10)
    assert q == pytest.approx([1.0, 1.0], abs=1e-6)
    assert now.imbalance <= 1e-10
    assert 0 < steps <= 100


def test_newton_falls_back_on_it() -> None:
    stuck = Newton(full=1, globalised=1, transient=None).solve(Stiffening(), np.array([0.0]), 1.0)
    assert not stuck.converged
    found = Newton(full=1, globalised=1).solve(Stiffening(), np.array([0.0]), 1.0)
    assert found.converged
    assert found.q[0] == pytest.approx(2.0, rel=1e-9)
    assert found.iterations > stuck.iterations


# --------------------------------------------------------------------------------------- sheets


def column(force: float) -> Model:
    """A strip of 40 x 8 x 0.2 mm, pinned at both ends and pressed along its length."""
    strip = meshes.structured(meshes.strip(40.0, 8.0), along=20)
    model = (
        Model(strip, Sheet(E=1000.0, t=0.2), formulation="bars-and-hinges")
        .support("edge:start")
        .support("edge:end", "yz")
    )
    return model.force("edge:end", total=(-force, 0.0, 0.0))


def test_buckling_load_is_in_the_path(tmp_path: Any) -> None:
    """The bifurcation is that of Euler's column, it is stored, and it is told."""
    path = trace(column(0.06), file=tmp_path / "run.bh")
    euler = math.pi**2 * 1000.0 * 8.0 * 0.2**3 / 12.0 / 40.0**2
    assert path.outcome == "reached"
    assert path.stable
    ((step, found),) = path.critical_points
    assert step == 0
    assert found.kind == "bifurcation"
    assert found.lam * 0.06 == pytest.approx(euler, rel=0.05)
    assert any("bifurcation point" in line for line in path.remarks)
    assert any("left an unstable state" in line for line in path.remarks)
    again = bh.Path.load(tmp_path / "run.bh")
    assert [c.lam for _, c in again.critical_points] == [found.lam]
    assert again.remarks == path.remarks


def test_unstable_end_is_told() -> None:
    path = trace(column(0.06), strategy=Automatic(at_bifurcation="primary"))
    assert path.outcome == "reached"
    assert path.stable is False
    assert path.records[-1].negative == 1
    assert "the last state is not stable (1 negative mode)" in path.remarks


def test_a_thin_ring_of_bars_and_hinges_leaves_the_plane() -> None:
    """It stayed flat at 900 times the energy: modes as soft as a shift let Newton creep."""
    mesh = meshes.structured(meshes.full_annulus(100.0, 5.0), along=48)
    path = trace(Model(mesh, Sheet(E=4000.0, t=0.02), formulation="bars-and-hinges").fold("crease", to=2.2))
    assert path.outcome == "reached"
    assert path.stable
    assert path[-1].energy.total == pytest.approx(0.003976, rel=0.01)
    assert np.ptp(path[-1].points[:, 2]) > 40.0


def two_panels() -> Model:
    """Two triangles joined by a crease; one of them is held."""
    points = [[0.0, 0.0], [10.0, 0.0], [5.0, 8.0], [5.0, -8.0]]
    mesh = meshes.SheetMesh(
        np.array(points), np.array([[0, 1, 2], [1, 0, 3]]), edge_sets={"crease:door": np.array([[0, 1]])}
    )
    return Model(mesh, Sheet(E=4000.0, t=0.2), formulation="bars-and-hinges").support([0, 1, 2])


def test_a_crease_without_stiffness_is_a_mechanism() -> None:
    """Nothing resists the turn of a hinge: the path says which one, and keeps what it had."""
    path = trace(two_panels().crease("door", stiffness=0.0).force("node:3", each=(0.0, 0.0, 1e-3)))
    assert path.outcome == "mechanism"
    assert path.reason.startswith("crease 'door' turns without resistance")
    assert len(path) >= 1
    stiff = trace(two_panels().crease("door", stiffness=0.1).force("node:3", each=(0.0, 0.0, 1e-3)))
    assert stiff.outcome == "reached"


@pytest.mark.parametrize(
    ("formulation", "along", "rows"),
    [("bars-and-hinges", 32, 1), ("consistent", 16, 2), ("linear-shell", 16, 2), ("shell", 8, 1)],
)
def test_a_right_angle_takes_one_increment(formulation: str, along: int, rows: int) -> None:
    """App. B (a) from flat: six iterations by default, and the state that small increments end in."""
    model = sheet_model("a", along, rows, formulation=formulation, kind="staggered")
    model = model.fold("crease", to=0.5 * math.pi)
    small = LoadControl(first_rotation=math.radians(15.0), largest_rotation=math.radians(27.0))
    large, timid = trace(model), trace(model, strategy=Automatic(load=small))
    assert large.iterations <= 6
    assert timid.iterations > 12
    assert large[-1].energy.total == pytest.approx(timid[-1].energy.total, rel=1e-9)


def ended(system: Small, q: Array) -> list[Increment]:
    """What `Automatic` makes of an arc that ends in an unstable state at lambda = 1."""
    end = replace(point(system, q, 1.0, ARC), negative=1)
    arc = iter([Increment(end, Outcome.REACHED, 3, 0.0, 0.1)])
    passing = Automatic()._pass(arc, [], LoadControl(newton=Newton(globalised=20)), system)
    found = []
    while True:
        try:
            found.append(next(passing))
        except StopIteration as stop:
            return found if stop.value is None else [*found, stop.value]


def test_an_unstable_end_is_left_or_named() -> None:
    """The straight column beyond its load bends at the end; a hill without a valley is told."""
    (bent,) = ended(Column(), np.array([1.0, 0.0]))
    assert bent.outcome == "reached"
    assert bent.stable
    assert bent.point.q[1] ** 2 == pytest.approx((bent.point.q[0] - 0.3) / 2.0, abs=1e-7)

    class Hill(Small):
        def internal(self, q: Array) -> tuple[float, Array, Array]:
            return -0.5 * float(q @ q), -q, -np.eye(1)

    last, failure = ended(Hill(1, [0.0]), np.zeros(1))
    assert last.outcome == "reached"
    assert failure.outcome == "unstable"
    assert failure.point is last.point
    assert "no stable one" in failure.note
