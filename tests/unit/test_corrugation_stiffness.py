"""Depth, second moments and bending tests of folded corrugations (source 4.4, 4.5)."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

import bh
from bh import ModelError
from bh.applications.corrugation.bending import Rig, _turn, second_stage, settle, three_point
from bh.applications.corrugation.folded import Folded
from bh.applications.corrugation.folding import POLYESTER, fold
from bh.applications.corrugation.sections import bottom_up, rectangles, section_moments, top_down
from bh.formulations.observables import depth_of


@cache
def folded(kind: str) -> Folded:
    return fold(kind, 6.0, along=24, rows=1, formulation="bars-and-hinges")


@pytest.mark.parametrize("kind", ["straight", "parabolic-edge", "elliptical-edge"])
def test_folded_to_depth_and_laid_down(kind: str) -> None:
    """Between the planes z = 0 and z = 6 mm, still in equilibrium."""
    sheet = folded(kind)
    z = {fold: [] for fold in ("mountain", "valley")}  # type: ignore[var-annotated]
    for name in sheet.mesh.creases:
        z[sheet.mesh.folds[name]].append(sheet.points[sheet.mesh.nodes(f"crease:{name}"), 2])
    assert np.concatenate(z["valley"]).min() == pytest.approx(0.0, abs=1e-9)
    assert np.concatenate(z["mountain"]).max() == pytest.approx(6.0, abs=1e-4)
    up = depth_of(sheet.path[-1])[1]
    assert up == pytest.approx([0.0, 0.0, 1.0], abs=1e-6)
    system, record = sheet.path.solved()
    assert system.evaluate(record.q, record.lam).imbalance < 1e-7


def test_rectangles_against_a_box_section() -> None:
    """Level and upright rectangles, and the parallel axis theorem: an I beam, and a sheet at 45 degrees."""
    t, h, b = 0.5, 20.0, 10.0
    beam = np.array([[[0, 0], [0, h]], [[-b / 2, h], [b / 2, h]], [[-b / 2, 0], [b / 2, 0]]], dtype=float)
    exact = t * h**3 / 12.0 + 2.0 * (b * t**3 / 12.0 + b * t * (h / 2.0) ** 2)
    moment, area = rectangles(beam, t)
    assert moment == pytest.approx(exact, rel=1e-12)
    assert area == pytest.approx(t * (h + 2.0 * b))
    s = 8.0
    slanted = np.array([[[0.0, 0.0], [s / math.sqrt(2), s / math.sqrt(2)]]])
    assert rectangles(slanted, t)[0] == pytest.approx(s * t / 24.0 * (s**2 + t**2))
    assert rectangles(np.zeros((0, 2, 2)), t) == (0.0, 0.0)
    # one segment cut in pieces is the same sheet
    pieces = np.array([[[0, 0], [1, 1]], [[1, 1], [3, 3]]], dtype=float)
    whole = np.array([[[0, 0], [3, 3]]], dtype=float)
    thin = 1e-4  # own thickness terms do not add up
    assert rectangles(pieces, thin)[0] == pytest.approx(rectangles(whole, thin)[0], rel=1e-6)


def test_straight_about_x_is_the_bare_sheet() -> None:
    """I = W t^3 / 12 = 0.461 mm^4 (4.4.1): level sections of slanted panels are thicker, which Eq. 4.6 does not see."""
    exact = 100.0 * POLYESTER.t**3 / 12.0
    assert exact == pytest.approx(0.461, abs=5e-4)
    assert top_down(folded("straight"), 0.0) == pytest.approx(exact, rel=1e-6)


def test_straight_about_y_is_the_zigzag() -> None:
    """Five panels of 20 mm, 6 mm deep: A h^2 / 12 and what the odd panel shifts the axis by."""
    d, t, n = 6.0, POLYESTER.t, 5
    area = 20.0 * t
    own = area * d**2 / 12.0 + area * t**2 / 12.0 * (1.0 - (d / 20.0) ** 2)
    assert top_down(folded("straight"), 0.5 * math.pi) == pytest.approx(n * own, rel=1e-4)
    whole = section_moments(folded("straight"), 0.5 * math.pi, 20)
    assert whole.area == pytest.approx(n * area, rel=1e-6)
    assert np.ptp(whole.moment) < 1e-6 * whole.moment.max()


def test_top_down_does_not_depend_on_the_number_of_sections() -> None:
    few, many = (top_down(folded("parabolic-edge"), 0.7, count) for count in (60, 240))
    assert few == pytest.approx(many, rel=0.01)
    assert top_down(folded("parabolic-edge"), 0.7) == pytest.approx(
        top_down(folded("parabolic-edge"), math.pi - 0.7), rel=1e-3
    )


def test_bottom_up_of_straight_creases() -> None:
    """All bars run along x: I_y is that of one unit section, I_x nothing (Eq. 4.6, 4.17-4.19)."""
    found = bottom_up(folded("straight"))
    d, t, s = 6.0, POLYESTER.t, 20.0
    unit = 2.0 * s * t / 12.0 * (d**2 + t**2 * (1.0 - (d / s) ** 2))
    assert found.y == pytest.approx(unit, rel=1e-4)
    assert found.x == pytest.approx(0.0, abs=1e-6)
    assert found.weight.sum() == pytest.approx(1.0)
    assert found.about(math.pi / 4) == pytest.approx((found.x + found.y) / math.sqrt(2.0))
    held = np.zeros(len(folded("straight").points), dtype=bool)
    held[folded("straight").mesh.nodes("crease:crease-1")] = True
    assert len(bottom_up(folded("straight"), held).moment) == len(found.moment) // 2


def test_rests_on_three_points() -> None:
    """Nothing over the supports is below them; a level sheet turned by hand comes back; and `_turn` raises along it."""
    sheet = folded("parabolic-edge")
    along, across = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    points = settle(sheet, along, across, 50.0)
    over = points[np.abs(points[:, 1]) >= 25.0]
    assert over[:, 2].min() > -1e-9
    assert (over[:, 2] < 0.02).sum() >= 3
    up = np.array([-0.1, -0.2, 1.0]) / math.sqrt(1.05)
    turned = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]) @ _turn(up).T
    assert turned[:, 2] == pytest.approx(np.array([0.1, 0.2]) / math.sqrt(1.05))
    assert np.allclose(_turn(up) @ _turn(up).T, np.eye(3))


def test_second_stage_of_a_made_up_curve() -> None:
    """Soft, then 3 N/mm, then a peak and a fall: the slope in between is found."""
    x = np.array([0.0, 0.5, 1.0, 3.0, 3.5, 4.5, 6.0])
    y = np.array([0.1, 0.3, 1.0, 7.0, 7.6, 4.0, 3.0])
    slope, r2, window, peak = second_stage(x, y)
    assert peak == 7.6
    assert slope == pytest.approx(3.0, rel=1e-9)
    assert r2 == pytest.approx(1.0)
    assert 1.0 < window[0] < window[1] < 3.0
    assert math.isnan(second_stage(x[:2], y[:2])[0])


@pytest.mark.parametrize(("azimuth", "low", "high"), [(0.5 * math.pi, 1.0, 4.5), (0.0, 0.05, 0.6)])
def test_three_point_bending_of_the_straight_one(azimuth: float, low: float, high: float) -> None:
    """About y some N/mm, about x next to nothing (Fig. 4.8 a); supports and bar are in balance in every state."""
    test = three_point(folded("straight"), azimuth, Rig(travel=3.0))
    assert test.outcome == "reached"
    assert low < test.stiffness < high
    assert test.displacement[0] == 0.0
    assert test.load[0] == pytest.approx(0.1)
    end = test.path[-1].contact_forces
    assert sum(end.values())[2] == pytest.approx(0.0, abs=5e-3)  # type: ignore[index]
    assert end["left"][2] > 0.0 < end["right"][2]


def test_impossible_tests_are_one_line() -> None:
    for how, message in (
        ({"span": -1.0}, "span = -1"),
        ({"bar": 60.0}, "does not fit"),
        ({"tape": -1.0}, "tape = -1"),
    ):
        with pytest.raises(ModelError, match=message):
            Rig(**how)  # type: ignore[arg-type]
    with pytest.raises(ModelError, match="both supports"):
        three_point(folded("straight"), 0.0, Rig(span=300.0))
    with pytest.raises(ModelError, match=r"cannot be folded 60 mm deep|direction of the depth"):
        fold("straight", 60.0, along=8, rows=1, formulation="bars-and-hinges")
    held = bh.trace(
        bh.Model(folded("straight").mesh, POLYESTER, formulation="bars-and-hinges")
        .support([0, 1, 30, 31])
        .fold("all", by=0.1, Lstar=25.0)
    )
    with pytest.raises(ModelError, match="free sheet"):
        bh.corrugation.laid(held)
