"""How ends of designs move with what is not made exactly."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("xarray")
from dataclasses import replace

from bh.applications.inverse.converged import Converged
from bh.applications.inverse.models import model
from bh.applications.inverse.pieces import VARIED
from bh.applications.inverse.problems import Design
from bh.applications.inverse.simulate import simulate
from bh.applications.inverse.tolerances import (
    Region,
    Spreads,
    Tolerance,
    made,
    predicted,
    region,
    sampled,
    tolerance,
)
from bh.applications.inverse.variants import STEPS

DESIGN = Design(np.array([0.009]), np.array([105.0]), np.array([True]))
EDGE, ROWS = 5.0, 1


@pytest.fixture(scope="module")
def found() -> Tolerance:
    return tolerance(model(), DESIGN, edge=EDGE, rows=ROWS)


def test_the_ellipsoid_is_that_of_its_moves() -> None:
    """Two things along x and y: semi-axes are their movements times the root of chi square of three."""
    moves = {"a": np.array([0.3, 0.0, 0.0]), "b": np.array([0.0, -0.4, 0.0])}
    size, directions = Tolerance(moves, {}).axes(0.95)
    np.testing.assert_allclose(size, np.array([0.4, 0.3, 0.0]) * 2.795483, atol=1e-6)
    np.testing.assert_allclose(np.abs(directions[:, 0]), [0.0, 1.0, 0.0], atol=1e-12)


def test_small_errors_have_the_ellipsoid_of_first_order() -> None:
    """A thousandth of the default spreads, so that nothing is bent; 4,000 strips tell a semi-axis to some 3 %."""
    spreads = Spreads(*(0.001 * value for value in vars(Spreads()).values()))
    first = predicted(model(), DESIGN.k0, DESIGN.length, DESIGN.pinched, spreads).one().axes()[0]
    np.testing.assert_allclose(region(model(), DESIGN, spreads).axes, first, rtol=0.06)


def test_a_region_holds_its_share_where_ends_lie_on_an_arc() -> None:
    """Ends on a circle of 100 mm, 12 mm to and fro: the ellipsoid is as thick as the arc is bent."""
    turn = np.random.default_rng(3).normal(scale=0.12, size=4000)
    apart = 100.0 * np.column_stack((np.sin(turn), np.cos(turn) - 1.0, np.zeros(4000)))
    where = Region.of(apart, 0.9)
    assert where.holds(apart).mean() == pytest.approx(0.9, abs=1e-3)
    assert where.axes[0] > 20.0
    assert 1.0 < where.axes[1] < 5.0
    assert -1.0 < where.middle[1] < -0.5  # half the square of the turn


def test_a_strip_with_errors_is_the_chain_with_errors() -> None:
    """All that can be off at once, on the mesh of the strip: the chain of pieces moves as the whole strip does."""
    found = model()
    assert isinstance(found, Converged)
    chains = found.on_mesh(0)
    setting = replace(found.setting, edge=2.5, rows=2)
    design, off = made(DESIGN, setting, Spreads(), np.random.default_rng(2))
    moved = simulate(*design.lists(), off).t - simulate(*DESIGN.lists(), setting).t
    amounts = {name: np.array([getattr(off, name) - getattr(setting, name)]) for name in STEPS}
    ends = [
        chains.made(amount).forward(cut.k0[None], cut.length[None], cut.pinched[None], check=False)[0][0, -1]
        for cut, amount in ((design, amounts), (DESIGN, {}))
    ]
    np.testing.assert_allclose(ends[0] - ends[1], moved, atol=0.05 * float(np.linalg.norm(moved)))


def test_moves_are_those_of_strips(found: Tolerance) -> None:
    """Whole strips made otherwise end where the first order says, the cut crease too; E is of no account."""
    setting = replace(model().setting, edge=EDGE, rows=ROWS)
    base = simulate(*DESIGN.lists(), setting).t
    thick = simulate(*DESIGN.lists(), replace(setting, t=setting.t + 0.002)).t
    np.testing.assert_allclose(found.moves["t"] + found.bent["t"], thick - base, atol=1e-9)
    stiff = simulate(*DESIGN.lists(), replace(setting, E=1.3 * setting.E)).t
    np.testing.assert_allclose(stiff, base, atol=1e-5)
    curved = simulate([0.009 + 1e-4], [105.0], [True], setting).t - base
    np.testing.assert_allclose(
        10.0 * found.moves["k0 of segment 1"], curved, atol=0.15 * float(np.linalg.norm(curved))
    )
    assert set(found.moves) == {*VARIED, "k0 of segment 1", "length of segment 1"}


def test_without_a_pinch_its_angle_is_of_no_account() -> None:
    plain = replace(DESIGN, pinched=np.array([False]))
    assert set(tolerance(model(), plain, Spreads(Lstar=0.0, t=0.0, k0=0.0), edge=EDGE, rows=ROWS).moves) == {
        "fold",
        "length of segment 1",
    }


@pytest.mark.slow
def test_strips_lie_in_the_ellipsoid(found: Tolerance) -> None:
    """Of 200 strips with random errors 95 % should; and their scatter is that of the ellipsoid."""
    ends = sampled(model(), DESIGN, 200, edge=EDGE, rows=ROWS)
    apart = ends - simulate(*DESIGN.lists(), replace(model().setting, edge=EDGE, rows=ROWS)).t
    far = np.einsum("ij,jk,ik->i", apart, np.linalg.inv(found.covariance), apart)
    assert 0.90 <= float((far <= 7.814728).mean()) <= 0.99
    size, directions = found.axes(0.95)
    scatter = (apart @ directions).std(axis=0)
    np.testing.assert_allclose(scatter, size / 2.795483, rtol=0.15)
