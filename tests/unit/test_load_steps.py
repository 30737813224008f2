"""Steps as ramps: what every hinge, node and support does while lambda runs, and what cannot be asked for."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh import CreaseLaw, Displace, Fold, Force, Model, ModelError, Moment, Sheet
from bh.loading.builder import load_steps
from bh.loading.load_step import LoadStep, crease_hinges
from bh.model.laws import PRESCRIBED, SHEET, SPRING
from bh.model.ramp import Ramp

STEEL = Sheet(E=4000.0, t=0.2)
K = 4000.0 * 0.2**3 / 12.0  # bending stiffness, N mm
ONE = meshes.structured(meshes.annulus_sector(40.0, 8.0, 0.6), along=4)
TWO = meshes.structured(meshes.annulus_sector((40.0, 50.0), 8.0, 0.6, ("mountain", "valley")), along=4)


def steps(model: Model) -> list[LoadStep]:
    return list(load_steps(model))


def test_ramp() -> None:
    ramp = Ramp(np.array([1.0, 2.0]), np.array([3.0, 2.0]))
    assert ramp.at(0.25).tolist() == [1.5, 2.0]
    assert ramp.at(0.0).tolist() == [1.0, 2.0]
    assert ramp.at(1.0).tolist() == [3.0, 2.0]
    assert ramp.rate.tolist() == [2.0, 0.0]


def test_no_steps_is_an_empty_program() -> None:
    assert steps(Model(ONE, STEEL)) == []


def test_crease_hinges_follow_the_crease() -> None:
    """In order along the crease, each on an edge of it."""
    hinges = ONE.topology.hinges[crease_hinges(ONE, "crease")]
    assert len(hinges) == 4
    pairs = [set(pair) for pair in ONE.crease_edges("crease").tolist()]
    assert [set(row[1:3]) for row in hinges.tolist()] == pairs


# --------------------------------------------------------------------------------------- folds


def test_imposed_angle_starts_where_the_sheet_is() -> None:
    (step,) = steps(Model(ONE, STEEL).fold("crease", to=2.0))
    at = crease_hinges(ONE, "crease")
    assert (step.law[at] == PRESCRIBED).all()
    assert (step.law == PRESCRIBED).sum() == len(at)
    assert (np.delete(step.law, at) == SHEET).all()
    assert np.isnan(step.prescribed.start[at]).all()
    assert (step.prescribed.end[at] == 2.0).all()
    assert step.rotation == pytest.approx(math.pi - 2.0)


def test_second_fold_starts_at_the_first() -> None:
    one, two = steps(Model(ONE, STEEL).fold("crease", to=2.0).fold("crease", to=1.2))
    at = crease_hinges(ONE, "crease")
    assert (two.prescribed.start[at] == 2.0).all()
    assert (two.prescribed.end[at] == 1.2).all()
    assert two.rotation == pytest.approx(0.8)
    assert one.rotation == pytest.approx(math.pi - 2.0)


def test_one_angle_an_edge_in_order() -> None:
    angles = [2.0, 2.2, 2.4, 2.6]
    (step,) = steps(Model(ONE, STEEL).fold("crease", to=angles))
    assert step.prescribed.end[crease_hinges(ONE, "crease")].tolist() == angles


def test_angles_follow_the_crease_whatever_the_numbering() -> None:
    """A crease that is drawn the other way round takes its angles from the other end."""
    pairs = ONE.crease_edges("crease")[::-1, ::-1]
    turned = replace(ONE, edge_sets={**ONE.edge_sets, "crease:crease": pairs})
    angles = [2.0, 2.2, 2.4, 2.6]
    (step,) = steps(Model(turned, STEEL).fold("crease", to=angles))
    assert step.prescribed.end[crease_hinges(turned, "crease")].tolist() == angles
    assert step.prescribed.end[crease_hinges(ONE, "crease")].tolist() == angles[::-1]


def test_spring_from_length_scale_and_from_stiffness() -> None:
    """Eq. 3.12: stiffness a length is E t^3 / (12 L*)."""
    at = crease_hinges(ONE, "crease")
    cases: list[tuple[dict[str, Any], float]] = [({"Lstar": 5.0}, K / 5.0), ({"stiffness": 0.3}, 0.3)]
    for how, expected in cases:
        (step,) = steps(Model(ONE, STEEL).fold("crease", rest=2.0, **how))
        assert (step.law[at] == SPRING).all()
        assert step.stiffness[at] == pytest.approx(np.full(4, expected), rel=1e-14)
        assert (np.delete(step.stiffness, at) == 0.0).all()
        assert (step.rest.start[at] == math.pi).all()
        assert (step.rest.end[at] == 2.0).all()


def test_poissons_ratio_does_not_stiffen_the_crease() -> None:
    """Bars and hinges take nu = 0 (3.3.2)."""
    assert CreaseLaw(Lstar=5.0).per_length(Sheet(E=4000.0, t=0.2, nu=0.38)) == pytest.approx(K / 5.0)


def test_a_spring_of_a_later_step_is_there_from_the_start() -> None:
    first, second = steps(Model(TWO, STEEL).fold("crease-1", to=2.5).fold("crease-2", rest=3.5, Lstar=5.0))
    at = crease_hinges(TWO, "crease-2")
    assert (first.law[at] == SPRING).all()
    assert (first.rest.end[at] == math.pi).all()
    assert (second.rest.end[at] == 3.5).all()
    assert (second.law[crease_hinges(TWO, "crease-1")] == PRESCRIBED).all()


def test_fold_by_follows_the_drawing() -> None:
    """Mountain below pi, valley above."""
    mountain, valley = crease_hinges(TWO, "crease-1"), crease_hinges(TWO, "crease-2")
    (step,) = steps(Model(TWO, STEEL).fold("all", by=0.7))
    assert step.prescribed.end[mountain] == pytest.approx(np.full(4, math.pi - 0.7))
    assert step.prescribed.end[valley] == pytest.approx(np.full(len(valley), math.pi + 0.7))
    (step,) = steps(Model(TWO, STEEL).fold("crease-2", by=-0.7, Lstar=3.0))
    assert step.rest.end[valley] == pytest.approx(np.full(len(valley), math.pi - 0.7))


def test_all_leaves_flat_creases_alone() -> None:
    pattern = meshes.annulus_sector((40.0, 50.0), 8.0, 0.6, ("flat", "valley"))
    mesh = meshes.structured(pattern, along=4)
    (step,) = steps(Model(mesh, STEEL).fold("all", by=0.5))
    assert (step.law[crease_hinges(mesh, "crease-1")] == SHEET).all()
    assert (step.law[crease_hinges(mesh, "crease-2")] == PRESCRIBED).all()


def test_drawn_angles() -> None:
    drawn = np.array([0.1, 0.2, 0.3, 0.4])
    mesh = replace(ONE, fold_angles={"crease": drawn})
    (step,) = steps(Model(mesh, STEEL).fold("crease", by="drawn"))
    assert step.prescribed.end[crease_hinges(mesh, "crease")] == pytest.approx(math.pi - drawn)
    with pytest.raises(ModelError, match="no fold angles"):
        load_steps(Model(ONE, STEEL).fold("crease", by="drawn"))


def test_rest_angle_of_a_law_comes_in_during_the_first_step() -> None:
    """A sheet is flat before its first step, so the springs of its creases are too."""
    made = Model(ONE, STEEL).crease("crease", stiffness=0.3, rest=2.9)
    at = crease_hinges(ONE, "crease")
    first, second = steps(made.force([0], each=(0.0, 0.0, 1e-3)).fold("crease", rest=2.0))
    for step, start, end in ((first, math.pi, 2.9), (second, 2.9, 2.0)):
        assert (step.rest.start[at] == start).all()
        assert (step.rest.end[at] == end).all()
        assert step.stiffness[at] == pytest.approx(np.full(4, 0.3))
    (only,) = steps(made.fold("crease", rest=2.0))
    assert (only.rest.start[at] == math.pi).all()
    assert (only.rest.end[at] == 2.0).all()


# --------------------------------------------------------------------------------------- loads


def test_positive_moment_folds_as_drawn() -> None:
    mountain, valley = crease_hinges(TWO, "crease-1"), crease_hinges(TWO, "crease-2")
    model = Model(TWO, STEEL).step(Moment("crease-1", 0.2), Moment("crease-2", 0.3)).moment("crease-2", 0.0)
    one, two = steps(model)
    assert (one.moment.end[mountain] == 0.2).all()
    assert (one.moment.end[valley] == -0.3).all()
    assert (two.moment.start[valley] == -0.3).all()
    assert (two.moment.end[valley] == 0.0).all()
    assert (two.moment.end[mountain] == 0.2).all()


def test_force_each_and_total() -> None:
    nodes = ONE.nodes("edge:inner")
    each, total = steps(
        Model(ONE, STEEL).force("edge:inner", each=(0.0, 0.0, 2.0)).force("edge:inner", total=(1.0, 0.0, 0.0))
    )
    assert (each.force.end[nodes] == [0.0, 0.0, 2.0]).all()
    assert (each.force.start == 0.0).all()
    assert np.delete(each.force.end, nodes, axis=0).max() == 0.0
    assert np.array_equal(total.force.start, each.force.end)
    assert total.force.end.sum(axis=0) == pytest.approx([1.0, 0.0, 0.0])  # replaces, does not add


def test_forces_stay_in_later_steps() -> None:
    model = Model(ONE, STEEL).force([0], each=(0.0, 0.0, 1.0)).fold("crease", to=2.5)
    _, second = steps(model)
    assert (second.force.start[0] == second.force.end[0]).all()
    assert second.force.end[0, 2] == 1.0


def test_displacements_run_on_from_step_to_step() -> None:
    held = Model(ONE, STEEL).support("edge:start", "xyz").support("edge:outer", "z")
    first = held.displace("node:9", "x", 0.5)
    a, b, c = steps(first.displace("node:9", (2.0, 0.0, 0.0), -0.25).fold("crease", to=3.0))
    for step, start, end in ((a, 0.0, 0.5), (b, 0.5, -0.25), (c, -0.25, -0.25)):
        assert step.constraints.fixed[9, 0]
        assert step.constraints.start[9, 0] == start
        assert step.constraints.end[9, 0] == end


def test_displacement_of_a_later_step_begins_where_the_node_is() -> None:
    """Which is not known before the step: nan."""
    held = Model(ONE, STEEL).support("edge:start", "xyz").support("edge:outer", "z")
    before, step = steps(held.fold("crease", to=3.0).displace("node:9", "x", 0.5))
    assert not before.constraints.fixed[9, 0]
    assert math.isnan(step.constraints.start[9, 0])
    assert step.constraints.end[9, 0] == 0.5


# --------------------------------------------------------------------------------------- what cannot be


@pytest.mark.parametrize(
    ("how", "says"),
    [
        ({}, "exactly one of to, by and rest"),
        ({"to": 1.0, "by": 0.5}, "exactly one"),
        ({"to": 1.0, "Lstar": 5.0}, "takes no stiffness"),
        ({"rest": 1.0, "Lstar": 5.0, "stiffness": 1.0}, "give one of them"),
        ({"rest": 1.0, "Lstar": 0.0}, "positive"),
        ({"rest": 1.0, "Lstar": math.inf}, "positive"),
        ({"rest": 1.0, "stiffness": -1.0}, "positive"),
        ({"to": 90.0}, "radians, not degrees"),
        ({"to": -0.1}, "outside"),
        ({"to": 6.4}, "outside"),
        ({"to": math.nan}, "outside"),
        ({"by": 3.2}, "outside"),
        ({"by": "paper"}, "'paper'"),
        ({"to": [2.0, math.inf]}, "outside"),
    ],
)
def test_wrong_folds(how: dict[str, Any], says: str) -> None:
    with pytest.raises(ModelError, match=says) as caught:
        Fold("rim", **how)
    assert "rim" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda m: m.fold("rim", to=2.0), "no crease 'rim'"),
        (lambda m: m.fold("crease", to=[2.0, 2.1]), "2 angles for 4 edges"),
        (lambda m: m.fold("crease", to=0.0), "closes it completely"),
        (lambda m: m.fold("crease", to=2.0 * math.pi), "closes it completely"),
        (lambda m: m.fold("crease", rest=2.0), "needs Lstar or stiffness"),
        (lambda m: m.moment("rim", 1.0), "no crease 'rim'"),
        (lambda m: m.force("rim", each=(0, 0, 1)), "no place 'rim'"),
        (lambda m: m.force([99], each=(0, 0, 1)), "node 99"),
        (lambda m: m.displace("node:99", "z", 1.0), "node:99"),
        (lambda m: m.crease("rim", Lstar=1.0), "no crease 'rim'"),
        (lambda m: m.step(), "at least one actuation"),
        (lambda m: m.support("rim").fold("crease", to=2.0), "no place 'rim'"),
    ],
)
def test_wrong_models(make: Any, says: str) -> None:
    with pytest.raises(meshes.InputError, match=says) as caught:
        load_steps(make(Model(ONE, STEEL)))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Force("a", each=(0, 0, 1), total=(0, 0, 1)), "either each or total"),
        (lambda: Force("a"), "either each or total"),
        (lambda: Force("a", each=(0, 1)), "three numbers"),
        (lambda: Force("a", total=(0, 0, math.nan)), "not finite"),
        (lambda: Moment("a", math.inf), "not finite"),
        (lambda: Displace("a", "w", 1.0), "'w'"),
        (lambda: Displace("a", (0, 0, 0), 1.0), "zero vector"),
        (lambda: Displace("a", (0, 1), 1.0), "three numbers"),
        (lambda: Displace("a", "x", math.nan), "not finite"),
        (lambda: CreaseLaw(), "either Lstar"),
        (lambda: CreaseLaw(Lstar=1.0, stiffness=1.0), "either Lstar"),
        (lambda: CreaseLaw(Lstar=-1.0), "positive Lstar"),
        (lambda: Sheet(E=0.0, t=1.0), "sheet E"),
        (lambda: Sheet(E=1.0, t=-1.0), "sheet t"),
        (lambda: Sheet(E=math.nan, t=1.0), "sheet E"),
        (lambda: Sheet(E=1.0, t=1.0, nu=-1.0), "nu"),
        (lambda: Sheet(E=1.0, t=1.0, nu=0.6), "nu"),
        (lambda: Sheet(E=1.0, t=1.0, nu=math.nan), "nu"),
    ],
)
def test_wrong_items(make: Any, says: str) -> None:
    with pytest.raises(ModelError, match=says) as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("E", [np.int64(4000), np.float32(4000.0)])
def test_numpy_numbers_are_numbers(E: Any) -> None:
    assert Sheet(E=E, t=0.2).bending_stiffness(nu=0.0) == pytest.approx(K)


def test_crease_on_the_boundary_cannot_fold() -> None:
    mesh = meshes.SheetMesh(
        np.array([[0, 0], [2, 0], [2, 1], [0, 1]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
        edge_sets={"crease:rim": np.array([[0, 1]])},
    )
    with pytest.raises(ModelError, match="boundary"):
        load_steps(Model(mesh, STEEL).fold("rim", to=2.0))


# --------------------------------------------------------------------------------------- known faults


def attempt(model: Model) -> tuple[list[LoadStep], str]:
    """The program, or why there is none."""
    try:
        return steps(model), ""
    except ModelError as refused:
        return [], str(refused)


def test_two_stiffnesses_of_one_crease() -> None:
    """Each step its own, or an error that names the crease; never silently the wrong one."""
    model = Model(ONE, STEEL).fold("crease", rest=2.5, Lstar=25.0).fold("crease", rest=2.0, Lstar=5.0)
    found, refused = attempt(model)
    if refused:
        assert "crease" in refused
    else:
        at = crease_hinges(ONE, "crease")
        assert found[0].stiffness[at] == pytest.approx(np.full(4, K / 25.0))
        assert found[1].stiffness[at] == pytest.approx(np.full(4, K / 5.0))


def test_release_of_a_held_crease_into_a_spring() -> None:
    """An imposed angle, then a spring: either done, or refused with a reason that is true."""
    found, refused = attempt(Model(ONE, STEEL).fold("crease", to=2.0).fold("crease", rest=2.0, Lstar=5.0))
    assert "needs Lstar" not in refused
    if not refused:
        assert (found[1].law[crease_hinges(ONE, "crease")] == SPRING).all()


def bent(formulation: str = "bars-and-hinges", by: float = 1.5) -> bh.Model:
    """A strip that is pushed to an arch while its crease is still ordinary sheet."""
    mesh = meshes.structured(meshes.strip(60.0, 20.0, creases=[10.0]), along=12, rows=2)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.3), formulation=formulation)
    model = model.support("edge:inner", "xyz").support("edge:outer", "xyz")
    return model.step(bh.Force("crease:crease", total=(0.0, 0.0, by)))


def test_a_crease_that_was_bent_as_sheet_is_held_with_the_moment_of_the_sheet() -> None:
    """The multiplier of an imposed angle begins with the bending moment of the hinge: the step begins in balance."""
    path = bh.trace(bent().fold("crease", by=0.05))
    system = path.system(1)
    assert path.steps[0].outcome == "reached"
    angle = np.abs(path[len(path) - 1].dihedral("crease") - np.pi)
    assert angle.max() > 1e-3
    assert system.evaluate(system.start(), 0.0).imbalance < 1e-6
    assert path.outcome == "reached"


def test_large_strains_get_a_remark() -> None:
    mesh = meshes.structured(meshes.strip(60.0, 20.0), along=12, rows=2)
    model = bh.Model(mesh, bh.Sheet(E=4.0, t=0.3)).support("edge:start", "xyz").support("edge:end", "yz")
    small, large = (bh.trace(model.displace("edge:end", "x", by)) for by in (1.0, 6.0))
    assert large[-1].strain.max() == pytest.approx(0.1, rel=0.2)
    assert any("strains reach 10%" in line for line in large.remarks)
    assert not any("strains" in line for line in small.remarks)
