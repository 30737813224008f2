"""Onto the stable branch behind a bifurcation: exact branches, the sense in which lambda rises, a ring that buckles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meshes
from bh import Automatic, LoadControl, Model, Newton, Sheet, trace
from bh.mechanics.consistent.formulation import ConstantStrain
from bh.solvers.branching import Branch, onto_stable_branch
from bh.solvers.outcome import Critical, Outcome
from bh.solvers.points import point
from tests.unit.test_newton import Column, Small

Array = NDArray[np.float64]


def branch_of(system: Any, lam: float, newton: Newton | None = None) -> Branch:
    return onto_stable_branch(system, point(system, np.zeros(system.size), 0.0), lam, newton or Newton())


def test_the_bent_column() -> None:
    """The straight column is stable up to 0.3; the states found are bent, stable, in order: w^2 = (u - 0.3) / 2."""
    found = branch_of(Column(), 1.0)
    assert len(found.points) >= 2
    for there in found.points:
        u, w = there.q
        assert w * w == pytest.approx((u - 0.3) / 2.0, abs=1e-7)
        assert there.negative == 0
    lams = [0.3, *(there.lam for there in found.points)]
    assert lams == sorted(lams)
    (begins,) = found.critical
    assert begins.kind is Critical.BIFURCATION
    assert begins.lam == pytest.approx(0.3, abs=1e-3)
    assert abs(begins.lam - 0.3) <= begins.error
    assert np.abs(begins.mode) == pytest.approx([0.0, 1.0], abs=1e-6)
    assert found.iterations > 0


def test_no_bifurcation_is_none() -> None:
    """Below 0.3 nothing begins; a branch that ends at a limit point cannot be followed, and nothing is said of it."""
    assert branch_of(Column(), 0.2).points == ()
    assert branch_of(Column(), 0.2).critical == ()

    class Softening(Small):
        def internal(self, q: Array) -> tuple[float, Array, Array]:
            (u,) = q
            return float(u * u / 2 - u**3 / 3), np.array([u - u * u]), np.array([[1.0 - 2.0 * u]])

    found = branch_of(Softening(1, [1.0]), 1.0)  # the largest load is 1/4
    assert found.points == ()
    assert found.critical == ()


class Skewed(Small):
    """Straight up to 0.3, then a branch whose lambda rises in one sense of w only: w^2 - skew w = (u - 0.3) / 2."""

    skew = 0.5

    def internal(self, q: Array) -> tuple[float, Array, Array]:
        u, w = q
        s = 4.0 * self.skew / 3.0
        energy = 0.5 * u * u + (0.3 - u) * w * w + w**4 + s * w**3
        gradient = np.array([u - w * w, 2 * (0.3 - u) * w + 4 * w**3 + 3 * s * w * w])
        curvature = 2 * (0.3 - u) + 12 * w * w + 6 * s * w
        return float(energy), gradient, np.array([[1.0, -2 * w], [-2 * w, curvature]])


@pytest.mark.parametrize("skew", [0.5, -0.5])
def test_the_sense_in_which_lambda_rises(skew: float) -> None:
    system = Skewed(2, [1.0, 0.0])
    system.skew = skew
    found = branch_of(system, 0.6)
    assert found.points
    for there in found.points:
        assert there.q[1] * skew > 0.0
        assert there.negative == 0
        assert there.lam > 0.3


def test_a_branch_that_runs_backwards_is_not_taken() -> None:
    """Subcritical: w^4 with the other sign. There is a bifurcation, and no stable branch at it."""

    class Backwards(Small):
        def internal(self, q: Array) -> tuple[float, Array, Array]:
            u, w = q
            energy = 0.5 * u * u + (0.3 - u) * w * w - w**4 + w**6
            gradient = np.array([u - w * w, 2 * (0.3 - u) * w - 4 * w**3 + 6 * w**5])
            curvature = 2 * (0.3 - u) - 12 * w * w + 30 * w**4
            return float(energy), gradient, np.array([[1.0, -2 * w], [-2 * w, curvature]])

    found = branch_of(Backwards(2, [1.0, 0.0]), 0.5)
    assert found.points == ()
    assert [c.kind for c in found.critical] == [Critical.BIFURCATION]


def test_load_control_goes_over() -> None:
    """Where the energy cannot be minimised in time the branch is taken, to the same end, and nothing has jumped."""
    ring = Model(
        meshes.structured(meshes.full_annulus([60.0, 75.0], 15.0, ["mountain", "valley"]), along=24, rows=2),
        Sheet(E=4000.0, nu=0.3, t=0.2),
        formulation=ConstantStrain.name,
    ).fold("all", by=0.6, Lstar=25.0)
    path = trace(ring, strategy=Automatic(LoadControl(newton=Newton(globalised=5, transient=None))))
    assert path.outcome is Outcome.REACHED
    assert path.stable
    begins = [c for _, c in path.critical_points]
    assert [c.kind for c in begins] == [Critical.BIFURCATION]
    behind = [r for r in path.records if r.note.startswith("the stable branch")]
    assert [r.note for r in behind] == [f"the stable branch that begins at lambda {begins[0].lam:.6g}"]
    assert behind[0].lam < 1.1 * begins[0].lam
    assert not any(record.jumped for record in path.records)
    assert all(record.negative == 0 for record in path.records if record.lam >= behind[0].lam)
    assert path[-1].energy.total == pytest.approx(trace(ring)[-1].energy.total, rel=1e-8)


def test_phase_of_a_buckled_ring_is_left_alone() -> None:
    """Its waves may turn round the ring at no cost; steps of Newton's method along that mode would be rounding."""
    mesh = meshes.structured(meshes.full_annulus(100.0, 10.0), along=126, rows=2)
    path = trace(Model(mesh, Sheet(E=4000.0, t=0.127)).fold("crease", to=2.2))
    assert path.outcome is Outcome.REACHED
    assert path.stable
    buckled = path.records[2:]
    assert max(record.iterations for record in buckled) <= 8
    assert not any(record.cuts for record in buckled)
