"""Pinches: profile, what each step does with it, both formulations, and what cannot be asked for."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meshes
from bh import Fold, Model, ModelError, Pinch, Sheet, trace
from bh.loading.builder import load_steps
from bh.loading.load_step import crease_hinges
from bh.model.laws import PRESCRIBED, SPRING
from bh.model.pinch import Chain, chain, parts
from fem.state import ShellState

PLATE = Sheet(E=4000.0, t=0.5)
ONE = meshes.structured(meshes.annulus_sector(100.0, 5.0, 1.0), along=40)
TWO = meshes.structured(meshes.annulus_sector((100.0, 105.0), 5.0, 1.0, ("mountain", "valley")), along=40)
RIGHT, CLOSED = 0.5 * math.pi, math.pi / 14.0
BOTH = ("bars-and-hinges", "consistent")


def folded(formulation: str = "consistent") -> Model:
    return Model(ONE, PLATE, formulation=formulation).fold("crease", rest=RIGHT, Lstar=2.0)


# --------------------------------------------------------------------------------------- profile


def test_means_of_the_raised_cosine_are_its_integral() -> None:
    s = np.linspace(0.0, 100.0, 41)
    line = Chain(np.column_stack((s[:-1], s[1:])), closed=False)
    mean, ends = parts(line, 0.5, 20.0, "cosine")
    fine = (np.arange(400000) + 0.5) / 4000.0
    w = np.where(np.abs(fine - 50.0) < 10.0, np.cos(np.pi * (fine - 50.0) / 20.0) ** 2, 0.0)
    exact = w.reshape(40, -1).mean(axis=1)
    assert mean == pytest.approx(exact / exact.max(), abs=1e-6)
    assert mean.max() == 1.0
    assert np.count_nonzero(mean) == 8
    assert ends[19, 1] == ends[20, 0] == 1.0
    assert ends[17] == pytest.approx(np.cos(np.pi * np.array([7.5, 5.0]) / 20.0) ** 2)


def test_a_pinch_of_a_ring_goes_round() -> None:
    ring = meshes.structured(meshes.full_annulus(20.0, 5.0), along=48)
    line = chain(ring, "crease")
    assert line.closed
    at_start, _ = parts(line, 0.0, 30.0, "cosine")
    half, _ = parts(line, 0.5, 30.0, "cosine")
    assert np.roll(at_start, 24) == pytest.approx(half, abs=1e-12)


def test_grip_holds_whole_edges() -> None:
    line = chain(ONE, "crease")
    mean, _ = parts(line, 0.5, 20.0, "grip")
    assert set(mean.tolist()) == {0.0, 1.0}
    assert mean.sum() == 8


# --------------------------------------------------------------------------------------- the program


def test_zone_is_held_and_the_rest_of_the_crease_is_not() -> None:
    _, step = load_steps(folded().pinch("crease", to=CLOSED, length=20.0))
    at = crease_hinges(ONE, "crease")
    assert (step.law[at] == PRESCRIBED).sum() == 8
    assert (step.law[at] == SPRING).sum() == 32
    now = np.full(len(step.law), 1.5)  # the sheet is not quite at its rest angle
    ramp = step.prescribed_angles(now)
    inside = at[step.law[at] == PRESCRIBED]
    mean, _ = parts(chain(ONE, "crease"), 0.5, 20.0, "cosine")
    assert (ramp.start[inside] == 1.5).all()
    assert ramp.end[inside] == pytest.approx(1.5 + mean[mean > 0] * (CLOSED - 1.5))
    assert step.rotation == pytest.approx(RIGHT - CLOSED)


def test_ends_of_edges_carry_the_profile_itself() -> None:
    _, step = load_steps(folded().pinch("crease", to=CLOSED, length=20.0))
    ramp = step.prescribed_angles(np.full((len(step.law), 2), RIGHT))
    at = crease_hinges(ONE, "crease")[16:24]
    assert ramp.end[at[3], 1] == ramp.end[at[4], 0] == pytest.approx(CLOSED)
    assert ramp.end[at[0], 0] == pytest.approx(RIGHT)
    assert (ramp.end[at[:-1], 1] == ramp.end[at[1:], 0]).all()


def test_an_earlier_pinch_stays() -> None:
    *_, last = load_steps(folded().pinch("crease", at=0.3, length=20.0).pinch("crease", at=0.7, length=20.0))
    now = np.full(len(last.law), 0.7)
    held = last.prescribed_angles(now)
    first = crease_hinges(ONE, "crease")[8:16]
    assert (held.start[first] == 0.7).all()
    assert (held.end[first] == 0.7).all()


def test_fold_and_pinch_in_one_step_go_to_the_profile_of_the_fold() -> None:
    together = (Pinch("crease", to=CLOSED, length=20.0), Fold("crease", rest=RIGHT, Lstar=2.0))
    (step,) = load_steps(Model(ONE, PLATE, formulation="bars-and-hinges").step(*together))
    mean, _ = parts(chain(ONE, "crease"), 0.5, 20.0, "cosine")
    inside = crease_hinges(ONE, "crease")[mean > 0]
    end = step.prescribed_angles(np.full(len(step.law), math.pi)).end
    assert end[inside] == pytest.approx(RIGHT + mean[mean > 0] * (CLOSED - RIGHT))


def test_all_goes_to_the_side_of_each_crease() -> None:
    model = (
        Model(TWO, PLATE, formulation="bars-and-hinges")
        .fold("all", by=RIGHT, Lstar=2.0)
        .pinch("all", by=math.pi - CLOSED, length=20.0)
    )
    path = trace(model)
    assert path.outcome == "reached"
    assert path[-1].dihedral("crease-1").min() == pytest.approx(CLOSED)
    assert path[-1].dihedral("crease-2").max() == pytest.approx(2.0 * math.pi - CLOSED)


# --------------------------------------------------------------------------------------- solved


@pytest.mark.parametrize("formulation", BOTH)
def test_angle_is_reached_and_the_profile_met(formulation: str) -> None:
    path = trace(folded(formulation).pinch("crease", to=CLOSED, length=20.0))
    assert path.outcome == "reached"
    before = [state for state in path if state.step == 0][-1].dihedral("crease")
    after = path[-1].dihedral("crease")
    mean, _ = parts(chain(ONE, "crease"), 0.5, 20.0, "cosine")
    inside = mean > 0
    assert after[inside] == pytest.approx((before + mean * (CLOSED - before))[inside], abs=1e-9)
    assert after.min() == pytest.approx(CLOSED, abs=1e-9)
    assert after == pytest.approx(after[::-1], abs=1e-7)  # mirror symmetry


@pytest.mark.parametrize("formulation", BOTH)
def test_opening_a_pinch_gives_the_folded_sheet_back(formulation: str) -> None:
    path = trace(
        folded(formulation).pinch("crease", to=CLOSED, length=20.0).fold("crease", rest=RIGHT, Lstar=2.0)
    )
    assert path.outcome == "reached"
    start = [state for state in path if state.step == 0][-1]
    assert path[-1].energy.total == pytest.approx(start.energy.total, rel=1e-7)
    assert path[-1].dihedral("crease") == pytest.approx(start.dihedral("crease"), abs=1e-7)


@pytest.mark.parametrize("formulation", BOTH)
def test_one_step_or_two_is_one_state_for_a_held_crease(formulation: str) -> None:
    base = Model(ONE, PLATE, formulation=formulation)
    two = trace(base.fold("crease", to=RIGHT).pinch("crease", to=CLOSED, length=20.0))[-1]
    one = trace(base.step(Fold("crease", to=RIGHT), Pinch("crease", to=CLOSED, length=20.0)))[-1]
    assert one.energy.total == pytest.approx(two.energy.total, rel=1e-7)


def test_at_once_or_in_sequence() -> None:
    first, second = (Pinch("crease", at=at, to=CLOSED, length=20.0) for at in (0.3, 0.7))
    at_once = trace(folded().step(first, second))
    one_by_one = trace(folded().step(first).step(second))
    # between the zones the sheet is soft, so the start of the second pinch hardly depends on the first
    assert at_once.outcome == one_by_one.outcome == "reached"
    assert at_once[-1].energy.total == pytest.approx(one_by_one[-1].energy.total, rel=0.01)


def test_rest_angles_alone_do_not_reach_the_angle() -> None:
    path = trace(folded().pinch("crease", to=CLOSED, length=20.0, how="rest"))
    assert path.outcome == "reached"
    assert CLOSED + 0.1 < path[-1].dihedral("crease").min() < RIGHT - 0.5


@pytest.mark.parametrize("formulation", BOTH)
def test_couples_close_the_crease_until_the_angle_is_reached(formulation: str) -> None:
    how: dict[str, Any] = {
        "length": 20.0,
        "how": "couple",
        "couple": 600.0 if formulation == BOTH[0] else 150.0,
    }
    path = trace(folded(formulation).pinch("crease", to=CLOSED, **how))
    assert path.outcome == "reached"
    last = path[-1]
    assert last.dihedral("crease").min() == pytest.approx(CLOSED, abs=2e-4)
    assert 0.0 < last.lam < 1.0
    assert last.dihedral("crease") == pytest.approx(last.dihedral("crease")[::-1], abs=1e-6)
    # nothing is held: the angle goes back smoothly, and every edge is a spring still
    assert (load_steps(path.model)[1].law[crease_hinges(ONE, "crease")] == SPRING).all()


def test_couples_of_a_pinch_follow_its_profile() -> None:
    _, step = load_steps(folded().pinch("crease", to=CLOSED, length=20.0, how="couple", couple=30.0))
    mean, _ = parts(chain(ONE, "crease"), 0.5, 20.0, "cosine")
    at = crease_hinges(ONE, "crease")
    assert step.moment.end[at] == pytest.approx(30.0 * mean)
    assert (step.moment.start == 0.0).all()
    two = Model(TWO, PLATE, formulation="bars-and-hinges").fold("all", by=RIGHT, Lstar=2.0)
    _, step = load_steps(two.pinch("all", length=20.0, how="couple", couple=30.0))
    assert step.moment.end[crease_hinges(TWO, "crease-2")].min() == pytest.approx(-30.0)


def test_energy_of_a_pinch_is_the_work_of_its_angles() -> None:
    """Fine increments: the change of energy is the integral of moment times angle over the zone."""
    from bh import LoadControl

    path = trace(
        folded().pinch("crease", to=CLOSED, length=20.0),
        strategy=LoadControl(largest_rotation=math.radians(3.0), first_rotation=math.radians(1.0)),
    )
    states = [state for state in path if state.step == 1]
    inside = np.isin(np.arange(40), np.arange(16, 24))
    ends = ONE.points[ONE.crease_edges("crease")]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    work = 0.0
    for a, b in pairwise(states):
        moment = 0.5 * (a.crease_moment("crease") + b.crease_moment("crease"))
        turned = b.dihedral("crease") - a.dihedral("crease")
        work -= float(np.sum((moment * turned * length)[inside]))
    gained = states[-1].energy.total - states[0].energy.total
    assert abs(work) == pytest.approx(gained, rel=5e-3)


def test_shell_has_the_profile_itself() -> None:
    """Its fold angles are linear along an edge, and meet at nodes; the sheet beyond is the consistent one's."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 5.0, 1.0), along=20, rows=1)
    model = Model(mesh, PLATE, formulation="shell").fold("crease", rest=RIGHT, Lstar=2.0)
    path = trace(model.pinch("crease", to=CLOSED, length=30.0))
    assert path.outcome == "reached"
    last = path[-1]
    assert isinstance(last, ShellState)
    along = last.fold_angles_along("crease")
    assert along[9, 1] == along[10, 0] == pytest.approx(math.pi - CLOSED)
    inside = slice(8, 12)
    assert along[inside][:-1, 1] == pytest.approx(along[inside][1:, 0], abs=1e-3)


def test_a_saved_path_knows_its_pinch(tmp_path: Path) -> None:
    from bh import Path

    path = trace(folded().pinch("crease", to=CLOSED, length=20.0), file=tmp_path / "path.bh")
    again = Path.load(tmp_path / "path.bh")
    assert again.model.steps == path.model.steps
    assert (again[-1].points == path[-1].points).all()


def test_a_scene_says_the_same() -> None:
    from bh.scene.load import parse_scene

    scene = parse_scene(
        """
        [pattern]
        kind = "annulus_sector"
        radius = 100
        width = 5
        angle = 1.0
        [sheet]
        E = 4000
        t = 0.5
        [mesh]
        along = 40
        [model]
        formulation = "consistent"
        [[steps]]
        fold = { crease = "crease", rest = 1.5707963267948966, Lstar = 2.0 }
        [[steps]]
        pinch = { crease = "crease", at = 0.5, to = 0.2243994752564138, length = 20.0 }
        """
    )
    assert scene.model.steps == folded().pinch("crease", to=CLOSED, length=20.0).steps


# --------------------------------------------------------------------------------------- what cannot be


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"at": 1.2}, ["outside the crease", "0 to 1"]),
        ({"to": 0.0}, ["beyond what it can"]),
        ({"to": 12.9}, ["beyond what it can", "degrees"]),
        ({"to": 1.0, "by": 1.0}, ["to and by"]),
        ({"length": -3.0}, ["positive length"]),
        ({"length": math.nan}, ["positive length"]),
        ({"how": "force"}, ["imposed or rest or couple"]),
        ({"how": "couple"}, ["give both or neither"]),
        ({"couple": 3.0}, ["give both or neither"]),
        ({"how": "couple", "couple": -1.0}, ["positive number in N mm / mm"]),
        ({"profile": "hat"}, ["cosine or grip"]),
        ({"at": 0.05, "length": 20.0}, ["leaves the crease", "give at from 0.1 to 0.9"]),
        ({"length": 200.0}, ["leaves the crease", "shorter length"]),
        ({"length": 3.0}, ["shorter than two edges"]),
        ({"to": 6.0}, ["other side", "0.2832"]),
    ],
)
def test_bad_pinches_are_told_in_one_line(how: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(ModelError) as error:
        load_steps(folded().pinch("crease", **how))
    message = str(error.value)
    assert "\n" not in message
    for word in ["crease 'crease'", *words]:
        assert word in message


def test_a_crease_that_is_not_folded_cannot_be_pinched() -> None:
    with pytest.raises(ModelError, match="fold it before"):
        load_steps(Model(ONE, PLATE, formulation="bars-and-hinges").pinch("crease"))


def test_rest_angles_need_a_spring() -> None:
    with pytest.raises(ModelError, match="imposed there"):
        load_steps(
            Model(ONE, PLATE, formulation="bars-and-hinges")
            .fold("crease", to=RIGHT)
            .pinch("crease", how="rest")
        )


def test_pinches_that_contradict() -> None:
    zone = [Pinch("crease", at=0.5, length=20.0), Pinch("crease", at=0.55, length=20.0)]
    with pytest.raises(ModelError, match=r"contradict each other \(at 0.5 and 0.55\)"):
        load_steps(folded().step(*zone))
    assert load_steps(folded().step(zone[0], zone[0]))  # said twice


def test_a_crease_of_many_lines_has_no_way_along_it() -> None:
    from dataclasses import replace

    sets = {**TWO.edge_sets}
    sets["crease:mountains"] = np.vstack((sets["crease:crease-1"], sets["crease:crease-2"]))
    mesh = replace(TWO, edge_sets=sets)
    model = (
        Model(mesh, PLATE, formulation="bars-and-hinges")
        .fold("mountains", rest=RIGHT, Lstar=2.0)
        .pinch("mountains")
    )
    with pytest.raises(ModelError, match="not one line"):
        load_steps(model)
