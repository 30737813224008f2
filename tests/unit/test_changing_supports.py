"""Supports that come and go during a run: held as it lies, let go of, judged where a step begins; displaced further."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bh
import meshes
from bh import Displace, Fold, Force, Hold, Model, ModelError, RigidBody, Sheet, Support, trace
from bh.analysis.situation import Situation
from bh.commands.cli import main
from bh.loading.builder import load_steps
from bh.loading.tethers import left
from bh.model.serialise import describe, fingerprint, rebuild
from bh.scene.load import parse_scene
from bh.scene.report import report

SHEET = Sheet(E=4000.0, nu=0.3, t=0.2)
STRIP = meshes.structured(meshes.strip(60.0, 10.0, [5.0]), along=4)
SECTOR = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.6), along=6)
SLOPES = ["consistent", "shell"]
SCENE = """
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.5
[sheet]
E = 4000.0
t = 0.2
[mesh]
along = 4
[[steps]]
fold = {{ crease = "crease", to = 2.4 }}
[[steps]]
{change}
[[steps]]
force = {{ at = "corner:outer-end", total = [0.0, 0.0, {force}] }}
"""


def ends(path: bh.Path) -> list[bh.State]:
    """The last state of every step."""
    assert path.outcome == "reached", path.reason
    return [[state for state in path if state.step == k][-1] for k in range(len(path.steps))]


def folded(formulation: str) -> Model:
    return Model(SECTOR, SHEET, formulation=formulation).fold("crease", to=2.2)


def slope_or_nodes(formulation: str, at: str) -> Hold | Support:
    return Hold(at) if formulation in SLOPES else Support(at)


# ------------------------------------------------------------------------------------------ held as it lies


@pytest.mark.parametrize("formulation", [*SLOPES, "bars-and-hinges"])
def test_held_as_it_lies_loaded_and_let_go(formulation: str) -> None:
    """Clamped where it lies the sheet stays; a force meets it; the end takes over, and what let go leaves no trace."""
    start, end = (slope_or_nodes(formulation, at) for at in ("edge:start", "edge:end"))
    model = folded(formulation).step(support=start)
    model = model.force("edge:end", total=(0.0, 0.0, 0.02))
    model = model.step(Force("edge:end", total=(0.0, 0.0, 0.0)), support=end)
    model = model.step(release="edge:start").step(release=end)
    # at last the end is held with the shape that it had under load, then nowhere
    free, held, loaded, taken, one, none = ends(trace(model))
    np.testing.assert_allclose(held.points, free.points, atol=1e-9)
    assert held.energy.total == pytest.approx(free.energy.total, rel=1e-9)
    assert loaded.energy.total > 1.02 * free.energy.total
    np.testing.assert_allclose(loaded.reaction("edge:start"), [0.0, 0.0, -0.02], atol=1e-9)
    np.testing.assert_allclose(taken.points, loaded.points, atol=1e-9)
    np.testing.assert_allclose(taken.reaction("edge:end"), [0.0, 0.0, 0.02], atol=1e-9)
    np.testing.assert_allclose(one.displacement("edge:end"), loaded.displacement("edge:end"), atol=1e-9)
    assert free.energy.total < one.energy.total < loaded.energy.total
    # held nowhere it is the free sheet again, turned
    assert none.energy.total == pytest.approx(free.energy.total, rel=1e-9)
    assert np.abs(none.reactions).max() < 1e-9
    span = [np.linalg.norm(s.points[:, None] - s.points[None], axis=-1) for s in (free, none)]
    np.testing.assert_allclose(span[1], span[0], atol=1e-6)
    assert np.linalg.norm(none.displacement("edge:start") - free.displacement("edge:start")) > 0.1


@pytest.mark.parametrize("formulation", SLOPES)
def test_a_turned_strip_is_as_stiff_as_a_flat_one(formulation: str) -> None:
    """Turned by 30 degrees about its end and clamped as it lies: F L^3 / (3 E I), as clamped from the beginning."""
    turn, small = math.radians(30.0), 1e-4
    free = Model(STRIP, SHEET, formulation=formulation)
    turned = free.support("edge:start").displace("edge:end", "z", 60.0 * math.sin(turn))
    turned = turned.step(hold="edge:start", release="edge:end")
    normal = np.array([-math.sin(turn), 0.0, math.cos(turn)])
    path = trace(turned.force("edge:end", total=tuple(small * normal)))
    before, clamped, loaded = ends(path)
    np.testing.assert_allclose(clamped.points, before.points, atol=1e-9)
    assert before.energy.total < 1e-12
    sag = ((loaded.points - clamped.points) @ normal)[STRIP.nodes("edge:end")].mean()
    flat = ends(trace(free.support("edge:start", clamp=True).force("edge:end", total=(0.0, 0.0, small))))[-1]
    assert sag == pytest.approx(flat.displacement("edge:end")[:, 2].mean(), rel=1e-6)
    assert sag == pytest.approx(small * 60.0**3 * 12.0 / (3.0 * 4000.0 * 10.0 * 0.2**3), rel=0.1)


@pytest.mark.parametrize("formulation", SLOPES)
def test_a_clamp_that_is_let_go_of_loses_its_couple_bit_by_bit(formulation: str) -> None:
    """Residual and power follow lambda, and nothing jumps where the step begins."""
    model = Model(STRIP, SHEET, formulation=formulation).support("edge:start", clamp=True)
    model = model.displace("edge:end", "z", 6.0).step(release="edge:start", support=Support("edge:start"))
    path = trace(model)
    bent, free = ends(path)
    assert free.energy.total < 1e-12 < 0.005 < bent.energy.total  # hinged at one end, it is straight again
    system = path.system(1)
    begin = system.evaluate(system.start(), 0.0)
    assert begin.imbalance < 1e-8
    record = next(r for r in path.records if r.step == 1)
    q, lam, h = record.q, record.lam, 1e-4
    low, high = (system.evaluate(q, lam + d) for d in (-h, h))
    assert system.power(q, lam) == pytest.approx((high.energy - low.energy) / (2.0 * h), rel=1e-6)
    rate = (high.residual - low.residual) / (2.0 * h)
    np.testing.assert_allclose(system.control_rate(q, lam), rate, atol=1e-6 * np.abs(rate).max())
    assert np.abs(rate).max() > 0.0


def test_a_released_displacement_springs_back() -> None:
    model = Model(STRIP, SHEET).support("edge:start", clamp=True).displace("edge:end", "z", 6.0)
    bent, free = ends(trace(model.step(release="edge:end")))
    assert bent.energy.total > 0.005
    assert free.energy.total < 1e-12
    np.testing.assert_allclose(free.points, STRIP.points, atol=1e-8)


def test_redundant_support_is_released() -> None:
    """Of a folded sheet on three nodes and one too many: its force goes, the energy becomes that of the free sheet."""
    held = Model(SECTOR, SHEET).support([0]).support([3], "yz").support([20], "z").support([10], "z")
    held = held.fold("crease", to=2.2)
    before, after = ends(trace(held.step(release=[[10]])))
    free = trace(folded("consistent"))[-1]
    assert before.energy.total > 1.001 * free.energy.total
    assert abs(before.reactions[10, 2]) > 1e-4
    assert np.abs(after.reactions).max() < 1e-8
    assert after.energy.total == pytest.approx(free.energy.total, rel=1e-7)


# ------------------------------------------------------------------------------------------ further


@pytest.mark.parametrize("formulation", SLOPES)
def test_displaced_further(formulation: str) -> None:
    """`further` is from where the node is, `by` from the stress-free sheet; both keep it there later."""
    model = Model(STRIP, SHEET, formulation=formulation).support("edge:start", clamp=True)
    model = model.force("edge:end", total=(0.0, 0.0, 0.002))
    start = trace(model)[-1].displacement("edge:end")[:, 2]
    moved = model.displace("edge:end", "z", further=1.0).displace("edge:end", "z", further=0.5)
    path = trace(moved.step(Force("edge:end", total=(0.0, 0.0, 0.0))).displace("edge:end", "z", by=2.0))
    sag = [state.displacement("edge:end")[:, 2] for state in ends(path)]
    assert start.mean() > 0.1
    np.testing.assert_allclose(sag[1], start + 1.0, atol=1e-9)
    np.testing.assert_allclose(sag[2], start + 1.5, atol=1e-9)
    np.testing.assert_allclose(sag[3], start + 1.5, atol=1e-9)
    np.testing.assert_allclose(sag[4], 2.0, atol=1e-9)


# ------------------------------------------------------------------------------------------ judged where it begins


def test_whether_supports_are_enough_is_judged_where_the_step_begins() -> None:
    """Three nodes of the crease lie on a line in the flat strip, and do not in a folded sector."""
    on_line = [Support([n]) for n in STRIP.nodes("crease:crease")[[0, 2, 4]].tolist()]
    flat = Model(STRIP, SHEET).support("rigid-body").fold("all", by=0.0)
    with pytest.warns(bh.NotReachedWarning, match="mechanism"):
        path = trace(flat.step(release="rigid-body", support=on_line))
    assert path.outcome == "mechanism"
    assert (
        "where step 2 begins, the supports leave 1 of 6 rigid motions free (rotation about x)" in path.reason
    )
    assert path[-1].step == 0
    straight = SECTOR.nodes("edge:start")[[0, 1, 2]].tolist()  # a radius
    folds = folded("consistent").step(support=[Support([n]) for n in straight])
    assert trace(folds).outcome == "reached"
    with pytest.raises(bh.ModelError, match="the supports leave 1 of 6"):
        load_steps(Model(SECTOR, SHEET).support(straight).fold("crease", to=2.2))
    with pytest.raises(bh.ModelError, match="the supports leave 3 of 6"):  # too few wherever they are
        load_steps(folded("consistent").step(support=Support([0])))


# ------------------------------------------------------------------------------------------ kept and read


def changing() -> Model:
    model = folded("consistent").step(Fold("crease", to=2.3), hold="edge:start", support=RigidBody())
    return model.displace("corner:outer-end", "z", further=0.5).step(
        release=["edge:start", "corner:outer-end"]
    )


def test_described_and_resumed(tmp_path: Path) -> None:
    model = changing()
    again = rebuild(*describe(model))
    assert fingerprint(again) == fingerprint(model)
    assert again.steps == model.steps
    assert "further" not in str(describe(model.displace("node:3", "z", by=1.0))[0]["steps"][-1])
    file = tmp_path / "path.bh"
    whole = trace(model, file=file)
    loaded = bh.Path.load(file)
    np.testing.assert_allclose(loaded[-1].points, whole[-1].points, atol=1e-12)
    short = replace(model, steps=model.steps[:2])
    first = trace(short, file=tmp_path / "short.bh")
    more = trace(model, after=first)
    np.testing.assert_allclose(more[-1].points, whole[-1].points, atol=1e-9)


def test_scenes() -> None:
    change = 'hold = "edge:start"\ndisplace = { at = "edge:end", direction = "z", further = 1.0 }'
    scene = parse_scene(SCENE.format(change=change, force=0.0))
    assert scene.model.steps[1] == bh.Step(
        (Displace("edge:end", "z", further=1.0),), None, (Hold("edge:start"),)
    )
    assert any(
        line.startswith("step 2: displace edge:end (direction = z, further = 1.0), hold edge:start")
        for line in report(scene)
    )
    change = 'release = [[0, 1], "edge:start"]\n'
    change += 'support = [{ at = [0, 1], fix = "z" }, { at = "edge:start", clamp = true }]'
    model = parse_scene(
        'supports = [{ at = [0, 1] }, { at = "edge:start" }]\n' + SCENE.format(change=change, force=0.01)
    ).model
    assert model.steps[1].release == ((0, 1), "edge:start")
    assert model.steps[1].support == (Support((0, 1), "z"), Support("edge:start", clamp=True))


TIP = '{ at = "corner:outer-start", direction = "z", '
EDGE = '{ at = "edge:start", direction = "z"'
UNTIL = 'until = { observable = "largest_fold", of = "crease", value = 0.3 }'
WRONG = [
    ('release = "edge:end"', "steps[1]: release: nothing is held at 'edge:end', nor elsewhere"),
    ('hold = "edge:start"\nrelease = "edge:end"', "nothing is held at 'edge:end', nor elsewhere"),
    ('hold = "edge:nowhere"', "steps[1].hold: "),
    ('support = { at = "edge:nowhere" }', "steps[1].support.at: "),
    ("hold = 3", "steps[1].hold = 3 cannot be; give a place"),
    ("release = [-1]", "steps[1].release = [-1] cannot be; give a place"),
    ('support = { at = "edge:start", fix = "w" }', "steps[1].support.fix: "),
    (f'hold = "edge:start"\ndisplace = {TIP} further = 1.0 }}', "is fixed and displaced"),
    (f'hold = "edge:start"\ndisplace = {TIP} by = 1.0 }}', "is fixed and displaced"),
    (f"displace = {EDGE} }}", "needs either by (mm from the stress-free position) or further"),
    (f"displace = {EDGE}, by = 1.0, further = 1.0 }}", "needs either by"),
    ('support = { at = "node:1" }', "steps[1]: the supports leave 3 of 6 rigid motions free"),
    (f'hold = "edge:start"\nrelease = "edge:start"\n{UNTIL}', "has to be complete"),
]


@pytest.mark.parametrize(("change", "says"), WRONG)
def test_what_cannot_be(change: str, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.toml").write_text(SCENE.format(change=change, force=0.0))
    assert main(["run", str(tmp_path / "a.toml"), "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1


def test_what_cannot_be_in_python() -> None:
    model = folded("consistent").step(hold="edge:start")
    with pytest.raises(ModelError, match="is fixed and displaced"):  # before anything is solved
        load_steps(model.displace("corner:outer-start", "z", further=1.0))
    with pytest.raises(ModelError, match="by halves"):
        trace(model, symmetry="y")
    with pytest.raises(ModelError, match="have no slope at an edge to clamp"):
        trace(replace(model, formulation="bars-and-hinges"))
    with pytest.raises(ModelError, match="or supports that change"):
        bh.Step(())
    with pytest.raises(ModelError, match="a step takes supports such as"):
        model.step(support=["edge:start"])  # type: ignore[list-item]
    path = trace(model)
    with pytest.raises(ModelError, match="supports that change"):
        Situation(path, -1)


# ------------------------------------------------------------------------------------------ let go of under load


def shape(state: bh.State) -> np.ndarray:
    """(n, n) distances of all nodes, mm: the shape without where it lies."""
    return np.asarray(np.linalg.norm(state.points[:, None] - state.points[None], axis=-1))


@pytest.mark.parametrize(
    ("formulation", "by"),
    [("consistent", 0.35), ("consistent", 1.5), ("bars-and-hinges", 1.5), ("shell", 0.8)],
)
def test_what_a_crease_was_folded_through_is_let_go_of(formulation: str, by: float) -> None:
    """An edge held flat while the sheet folds is let go of: the sheet becomes the one that was folded without it."""
    mesh = meshes.structured(meshes.annulus_sector(101.6, 10.0, 1.0472), along=6, rows=2)
    sheet = Model(mesh, Sheet(E=4200.0, nu=0.2, t=0.3), formulation=formulation)
    free = trace(sheet.fold("crease", by=by), estimate=False)[-1]
    places = ["edge:start", "corner:outer-end"]
    held = sheet.support("edge:start", clamp=formulation in SLOPES).support("corner:outer-end", "z")
    path = trace(held.fold("crease", by=by).step(release=places), estimate=False)
    before, after = ends(path)
    assert before.energy.total > 5.0 * free.energy.total
    assert path.stable
    assert after.energy.total == pytest.approx(free.energy.total, rel=1e-6)
    np.testing.assert_allclose(shape(after), shape(free), atol=1e-6 * mesh.size)


@pytest.mark.parametrize("formulation", [*SLOPES, "bars-and-hinges"])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_strip_let_go_of_between_two_wells_falls_into_the_nearer_one(formulation: str, side: float) -> None:
    """A buckled strip held beside its hilltop falls into the well on that side, and says where it snaps."""
    mesh = meshes.structured(meshes.strip(60.0, 10.0, [5.0]), along=8)
    middle = np.flatnonzero(np.abs(mesh.points[:, 0] - 30.0) < 1e-9).tolist()
    clamp = formulation in SLOPES
    model = Model(mesh, SHEET, formulation=formulation).support("edge:start", clamp=clamp)
    model = model.support("edge:end", "yz", clamp=clamp).displace(middle, "z", 6.0)
    model = model.displace("edge:end", "x", -1.2).step(release=[middle])
    path = trace(model.displace(middle, "z", 0.2 * side).step(release=[middle]), estimate=False)
    *_, up, held, free = ends(path)
    assert path.stable
    assert held.energy.total > 1.5 * up.energy.total
    assert free.energy.total == pytest.approx(up.energy.total, rel=1e-6)
    height = [float(state.points[middle, 2].mean()) for state in (up, free)]
    assert height[0] > 4.0
    assert height[1] == pytest.approx(side * height[0], rel=1e-6)
    snaps = [line for line in path.remarks if "the sheet snaps where it is let go of" in line]
    assert len(snaps) == sum(record.jumped for record in path.records if record.step == len(path.steps) - 1)
    assert snaps or formulation != "consistent"
    for line in snaps:
        fall = float(line.split("falls by ")[1].split()[0])
        assert 0.0 < fall < held.energy.total - free.energy.total


def test_what_is_left_of_tethers() -> None:
    lam, h = 0.3, 1e-4
    assert left(0.0) == 1.0
    assert left(1.0) == 0.0
    for order in (0, 1):
        slope = (left(lam + h, order) - left(lam - h, order)) / (2.0 * h)
        assert left(lam, order + 1) == pytest.approx(slope, rel=1e-5)
