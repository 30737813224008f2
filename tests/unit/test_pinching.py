"""Bend and twist of pinched sheets: the mid-plane in closed form, the patterns of 5.5.3, the map and the design."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import bh
import meshes
from bh import State
from bh.analysis.midplane import MidPlane, midplane
from bh.applications.pinching import (
    PATTERNS,
    DesignError,
    Pinching,
    ResponseMap,
    design,
    respond,
    shipped,
)
from verification.studies.ch5.pinching import proportion

SOURCE_WAY = Pinching(zone=10.0, profile="grip", rows=1, formulation="bars-and-hinges")
COARSE = Pinching(cell=2.0, rows=1)


# --------------------------------------------------------------------------------------- the mid-plane


def strip_at(points: np.ndarray) -> State:
    """A state of a strip of one straight crease whose nodes are at given places."""
    mesh = meshes.structured(meshes.strip(100.0, 10.0, [5.0]), along=50)
    path = bh.trace(
        bh.Model(mesh, bh.Sheet(E=4000.0, t=0.5), formulation="bars-and-hinges").fold("crease", to=3.0)
    )
    return replace(path[-1], points=points)


FLAT = meshes.structured(meshes.strip(100.0, 10.0, [5.0]), along=50).points


def test_flat_strip_is_straight_and_plain() -> None:
    plane = midplane(strip_at(FLAT))
    assert plane.bending() == pytest.approx(math.pi)
    assert plane.twist([0.0, 0.3, 1.0]) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert plane.inner[0] == pytest.approx([0.0, 2.5, 0.0])
    assert plane.outer[-1] == pytest.approx([100.0, 7.5, 0.0])


def test_a_helicoid_twists_by_its_angle() -> None:
    """Sections turned by 0.004 rad/mm about the mid-line: 0.2 rad from the middle to the end."""
    x, y = FLAT[:, 0], FLAT[:, 1] - 5.0
    turn = 0.004 * (x - 50.0)
    plane = midplane(strip_at(np.column_stack((x, y * np.cos(turn), y * np.sin(turn)))))
    assert plane.twist([0.0, 0.5, 1.0]) == pytest.approx([-0.2, 0.0, 0.2], abs=2e-3)
    assert plane.bending() == pytest.approx(math.pi)


def test_an_arc_bends_by_half_its_angle() -> None:
    """The angle at the middle of an arc of sector angle a is pi - a / 2."""
    x, y = FLAT[:, 0], FLAT[:, 1] - 5.0
    a = (x - 50.0) / 80.0
    r = 80.0 - y
    plane = midplane(strip_at(np.column_stack((r * np.sin(a), -r * np.cos(a), 0.0 * x))))
    assert plane.bending() == pytest.approx(math.pi - 0.5 * 100.0 / 80.0, abs=1e-3)
    assert plane.twist(1.0) == pytest.approx(0.0, abs=1e-12)


def test_bend_and_twist_do_not_change_with_a_rigid_motion() -> None:
    found = respond(meshes.parallel_creases(0.01, 100.0, 5.0, 2), COARSE)
    state = found.path[-1]
    plane = midplane(state)
    turn = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    moved = midplane(replace(state, points=state.points @ turn.T + np.array([5.0, -7.0, 11.0])))
    assert moved.bending() == pytest.approx(plane.bending(), abs=1e-12)
    assert moved.twist() == pytest.approx(plane.twist(), abs=1e-12)


def test_a_sheet_without_creases_has_no_mid_plane() -> None:
    mesh = meshes.structured(meshes.strip(100.0, 10.0), along=10)
    path = bh.trace(
        bh.Model(mesh, bh.Sheet(E=4000.0, t=0.5), formulation="bars-and-hinges")
        .support("edge:start")
        .displace("edge:end", "z", 1.0)
    )
    with pytest.raises(bh.ModelError, match="without creases"):
        midplane(path[-1])


def test_direction_of_the_mid_line_is_taken_about_the_pinch() -> None:
    u = np.linspace(0.0, 1.0, 11)
    line = np.column_stack((u, 0.0 * u, 0.0 * u))
    plane = MidPlane(u, line, line + np.array([0.0, 1.0, 0.0]))
    assert plane.twist([1.0], at=0.0) == pytest.approx([0.0])


# --------------------------------------------------------------------------------------- the four patterns


@pytest.mark.parametrize("how", [SOURCE_WAY, replace(COARSE, rows=2)], ids=["as the source", "consistent"])
def test_the_four_patterns_do_what_they_are_said_to(how: Pinching) -> None:
    """5.5.3: twist only, bend only, neither, both; in degrees, with the one that bends and twists as the measure."""
    found = {name: respond(pattern(), how) for name, pattern in PATTERNS.items()}
    bend = {name: math.degrees(each.bend) for name, each in found.items()}
    twist = {name: abs(math.degrees(each.twist)) for name, each in found.items()}
    assert twist["twist"] > 2.0 * twist["both"]
    assert abs(bend["twist"]) < 0.1 * bend["both"]
    assert bend["bend"] > bend["both"]
    assert twist["bend"] < 0.5 * twist["both"]
    assert twist["neither"] < 1e-3
    assert bend["neither"] < 0.3 * bend["both"]
    assert bend["both"] > 5.0
    assert twist["both"] > 1.0


def test_valley_first_turns_the_twist_round() -> None:
    one, other = (
        respond(meshes.parallel_creases(0.01, 100.0, 5.0, 2, folds), COARSE)
        for folds in (("mountain", "valley"), ("valley", "mountain"))
    )
    assert other.twist == pytest.approx(-one.twist, rel=1e-6)
    assert other.bend == pytest.approx(one.bend, rel=1e-6)


# --------------------------------------------------------------------------------------- map and design


def test_the_shipped_map_is_what_simulations_give() -> None:
    table = shipped()
    i, j, k = 1, 1, 4  # two creases, 5 mm, 0.01 /mm
    found = respond(
        meshes.parallel_creases(table.curvatures[k], table.length, table.spacings[j], int(table.creases[i]))
    )
    assert found.bend == pytest.approx(table.bend[i, j, k], rel=1e-6)
    assert found.twist == pytest.approx(table.twist[i, j, k], rel=1e-6)


def test_the_map_between_its_points() -> None:
    """Splines give its points back, and what lies between them to a few per cent."""
    table = shipped()
    assert isinstance(table, ResponseMap)
    assert table.at(2, 5.0, 0.01) == pytest.approx((table.bend[1, 1, 4], table.twist[1, 1, 4]))
    bend, twist = table.at(2, 5.0, 0.0088)
    found = respond(meshes.parallel_creases(0.0088, table.length, 5.0, 2))
    assert bend == pytest.approx(found.bend, rel=0.02)
    assert twist == pytest.approx(found.twist, rel=0.02)


@pytest.mark.parametrize(("bend", "twist"), [(8.0, -4.0), (6.0, 3.0), (14.0, -7.0)])
def test_a_design_does_what_was_asked_for(bend: float, twist: float) -> None:
    found = design(bend=math.radians(bend), twist=math.radians(twist))
    assert found.response.path.outcome == "reached"
    assert math.degrees(found.response.bend) == pytest.approx(bend, abs=0.5)
    assert math.degrees(found.response.twist) == pytest.approx(twist, abs=0.5)
    again = respond(found.pattern)
    assert again.bend == found.response.bend


def test_what_no_pattern_does() -> None:
    with pytest.raises(DesignError, match=r"no pattern of the map bends by 90 .* the nearest does"):
        design(bend=math.radians(90.0), twist=0.0)
    with pytest.raises(DesignError, match="numbers in rad"):
        design(bend=math.nan, twist=0.0)


def test_proportion_of_a_line() -> None:
    exact = proportion([0.0, 1.0, 2.0], [0.0, 3.0, 6.0])
    assert (exact.slope, exact.r2) == pytest.approx((3.0, 1.0))
    assert proportion([0.0, 1.0, 2.0], [1.0, 1.0, 1.5]).r2 < 0.0
