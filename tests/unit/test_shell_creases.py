"""Creases of the shell: imposed, elastic, free, moment-driven; several steps; free sheets; bad input."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh.errors import InputError, ModelError
from bh.loading.builder import load_steps
from bh.model.actuations import Displace, Fold, Moment
from bh.model.model import Model
from bh.model.sheet import Sheet
from bh.paths.path import Path
from bh.solvers.load_control import LoadControl
from fem.kirchhoff_love import Shell, follow
from fem.loads import EdgeMoments
from fem.state import ShellState
from fem.system import ShellSystem
from verification.theory.shell_benchmarks import clamped_sheet, rectangle

MYLAR = Sheet(E=4000.0, nu=0.38, t=0.127)
D = MYLAR.bending_stiffness()
SECTOR = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.4), along=6, kind="mirrored")
STRIP = meshes.structured(meshes.strip(30.0, 20.0, [10.0]), along=3, kind="alternating")
ONE_STEP = LoadControl(first_rotation=2.0, largest_rotation=2.0)


def sheet(mesh: meshes.SheetMesh = SECTOR) -> Model:
    return Model(mesh, MYLAR, formulation="shell")


def solve(model: Model, strategy: LoadControl | None = None) -> Path:
    path = bh.trace(model, strategy=strategy)
    assert path.outcome == "reached", path.reason
    return path


def test_straight_crease_folds_without_energy() -> None:
    path = solve(sheet(STRIP).fold("crease", to=1.0))
    last = path[-1]
    np.testing.assert_allclose(last.dihedral("crease"), 1.0, rtol=1e-14)
    assert last.energy.total < 1e-12 * D
    a, b = last.points[STRIP.corners["corner:inner-start"]], last.points[STRIP.corners["corner:outer-start"]]
    assert np.linalg.norm(a - b) == pytest.approx(2 * 10.0 * math.sin(0.5), rel=1e-9)  # two wings of 10 mm
    middle = last.points[STRIP.nodes("crease:crease")].mean(axis=0)
    assert middle[2] > 0.5 * (a + b)[2] + 8.0  # a mountain goes up


def test_valley_is_the_mirror_of_mountain() -> None:
    valley = meshes.structured(
        meshes.annulus_sector(100.0, 10.0, 0.4, folds="valley"), along=6, kind="mirrored"
    )
    up, down = solve(sheet().fold("crease", by=0.8)), solve(sheet(valley).fold("crease", by=0.8))
    np.testing.assert_allclose(down[-1].points, up[-1].points * [1, 1, -1], atol=1e-6)
    np.testing.assert_allclose(down[-1].fold_angle("crease"), -0.8, rtol=1e-12)
    np.testing.assert_allclose(down[-1].crease_moment("crease"), -up[-1].crease_moment("crease"), rtol=1e-5)


def test_moment_is_the_rate_of_energy() -> None:
    """d U / d beta = int m ds along the path of an imposed angle (Simpson's rule over three states)."""
    steps = sheet()
    angles = 0.7 + 0.05 * np.arange(3)
    for angle in angles:
        steps = steps.fold("crease", by=float(angle))
    path = solve(steps)
    ends = [s for s in path if s.lam == 1.0]
    pairs = SECTOR.topology.find_edges(SECTOR.crease_edges("crease"))
    system = path.system(0)
    assert isinstance(system, ShellSystem)
    lengths = system.elements.lengths[pairs]
    moments = [float(s.crease_moment("crease") @ lengths) for s in ends]
    work = 0.05 / 3.0 * (moments[0] + 4.0 * moments[1] + moments[2])
    assert work == pytest.approx(ends[2].energy.total - ends[0].energy.total, rel=2e-5)


def test_one_step_and_many_meet() -> None:
    """Whether the frames begin anew on the way does not change what is found."""
    once = solve(sheet().fold("crease", by=1.5), ONE_STEP)
    often = solve(sheet().fold("crease", by=0.4).fold("crease", by=0.9).fold("crease", by=1.5))
    assert len(once) == 2
    assert often[-1].energy.total == pytest.approx(once[-1].energy.total, rel=1e-9)
    np.testing.assert_allclose(often[-1].crease_moment("crease"), once[-1].crease_moment("crease"), rtol=1e-5)


def test_stiff_spring_is_a_held_crease_and_both_balance() -> None:
    held = solve(sheet().fold("crease", by=0.9))[-1]
    stiff = solve(sheet().crease("crease", stiffness=1e3).fold("crease", rest=math.pi - 0.9))[-1]
    assert stiff.energy.bending == pytest.approx(held.energy.bending, rel=1e-4)
    np.testing.assert_allclose(stiff.crease_moment("crease"), held.crease_moment("crease"), rtol=1e-3)
    turn = math.pi - 0.9 - stiff.dihedral("crease")  # a spring's moment is k (phi - rest)
    np.testing.assert_allclose(stiff.crease_moment("crease"), -1e3 * turn, rtol=1e-9)


def test_spring_with_given_rest_angle_is_the_moment_that_it_makes() -> None:
    """k (beta - beta_R) = m: a rest angle of m / k and a couple of m on a spring at rest flat do the same."""
    soft = sheet().crease("crease", stiffness=0.01).support("corner:inner-start", "xyz")
    soft = soft.support("corner:outer-start", "yz").support("corner:inner-end", "z")
    by_rest = solve(soft.fold("crease", rest=math.pi - 0.8))[-1]
    by_couple = solve(soft.moment("crease", to=0.008))[-1]
    np.testing.assert_allclose(by_couple.points, by_rest.points, atol=1e-5)
    assert by_couple.energy.bending == pytest.approx(by_rest.energy.bending, rel=1e-7)


def test_free_hinge_carries_no_moment() -> None:
    model = (
        sheet(STRIP).crease("crease", stiffness=0.0).support("edge:inner", "xyz").support("edge:outer", "yz")
    )
    model = model.support("node:0", "xyz")
    path = solve(model.displace("crease:crease", "z", 1e-3))
    assert path[-1].fold_angle("crease").mean() == pytest.approx(2e-4, rel=1e-3)
    assert np.abs(path[-1].crease_moment("crease")).max() == 0.0


def test_released_crease_stays_until_its_spring_is_turned() -> None:
    """A prescribed crease that becomes a spring begins in equilibrium."""
    model = sheet().fold("crease", by=0.8).fold("crease", rest=math.pi - 0.8, stiffness=0.02)
    path = solve(model)
    begin = [s for s in path if s.step == 0][-1]
    system = path.system(1)
    assert system.evaluate(system.start(), 0.0).imbalance < 1e-6
    assert path[-1].energy.bending < begin.energy.bending
    assert path[-1].fold_angle("crease").mean() < 0.8


def test_angles_an_edge() -> None:
    angles = math.pi - np.linspace(0.6, 0.8, 6)
    last = solve(sheet().fold("crease", to=tuple(angles)))[-1]
    np.testing.assert_allclose(last.dihedral("crease"), angles, rtol=1e-13)


def test_crease_that_ends_inside_the_sheet() -> None:
    """A small constant angle that drops to zero at the end node is a dislocation of slopes: curvatures go with 1 / r
    and the energy grows by D beta^2 (3 + nu) (1 - nu) / (8 pi) for every e-fold of refinement.

    From w = c r theta sin(theta) + k r ln(r) cos(theta) with c = beta / (2 pi), k = -c (1 + nu) / 2 from equilibrium.
    """
    energies, beta = [], 0.01
    for along in (8, 16, 32):
        mesh = meshes.structured(
            meshes.strip(40.0, 20.0, [10.0]), along=along, rows=along // 4, kind="alternating"
        )
        pairs = mesh.crease_edges("crease")
        short = replace(mesh, edge_sets={**mesh.edge_sets, "crease:crease": pairs[: along // 2]})
        last = solve(sheet(short).fold("crease", by=beta))[-1]
        np.testing.assert_allclose(last.fold_angle("crease"), beta, rtol=1e-12)
        energies.append(last.energy.total)
    rate = D * beta**2 * (3.0 + MYLAR.nu) * (1.0 - MYLAR.nu) / (8.0 * math.pi)
    np.testing.assert_allclose(np.diff(energies), rate * math.log(2.0), rtol=2e-3)


def test_free_sheet_needs_no_support() -> None:
    """Reactions vanish, and the energy is that of the sheet on six statically determinate supports."""
    free = solve(sheet().fold("crease", by=1.2))[-1]
    model = sheet().support("corner:inner-start", "xyz").support("corner:outer-start", "yz")
    fixed = solve(model.support("corner:inner-end", "z").fold("crease", by=1.2))[-1]
    assert np.abs(free.reactions).max() == 0.0
    assert fixed.energy.total == pytest.approx(free.energy.total, rel=1e-8)
    shift = free.points.mean(axis=0) - SECTOR.points.mean(axis=0)
    assert np.linalg.norm(shift) < 3.0


def test_reactions_balance_forces() -> None:
    model = sheet().crease("crease", stiffness=0.05).support("edge:inner", "xyz").support("edge:outer", "z")
    last = solve(model.force("crease:crease", total=(0.0, 0.0, 0.02)))[-1]
    np.testing.assert_allclose(last.reaction(), [0.0, 0.0, -0.02], atol=1e-9)


def test_state_reads_the_crease() -> None:
    path = solve(sheet().fold("crease", by=0.9))
    last = path[-1]
    assert isinstance(last, ShellState)
    curve = last.crease_curve("crease", points=3)
    np.testing.assert_array_equal(curve[::2], last.crease_points("crease"))
    np.testing.assert_allclose(last.fold_angles_along("crease"), 0.9, rtol=1e-12)
    system = path.system(0)
    assert isinstance(system, ShellSystem)
    assert last.energy_density["bending"] @ system.elements.areas == pytest.approx(last.energy.bending)
    assert np.abs(last.dihedral_angles - math.pi).max() > 0.5  # the crease, measured at all hinges
    others = np.delete(last.dihedral_angles, np.flatnonzero(~np.isnan(last.crease_moments)))
    assert np.abs(others - math.pi).max() < 0.2


def test_end_moment_rolls_a_strip() -> None:
    """A clamped strip under an end couple takes the same moment everywhere."""
    model = clamped_sheet(rectangle(12.0, 1.0, 8), Sheet(E=1.2e6, nu=0.0, t=0.1))
    model = model.force("corner:low-end", each=(0.0, 0.0, 0.0))
    states, increments = follow(model, [EdgeMoments((("edge:end", 0.0, 10.0),))])
    assert increments[-1].outcome == "reached"
    assert states[-1].moments[:, 0].mean() == pytest.approx(10.0, rel=1e-3)
    assert states[-1].points[-1, 2] > 3.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sheet(STRIP).support("all", "xyz").fold("crease", to=2.0), "nothing can move"),
        (lambda: sheet().moment("crease", to=1.0), "no spring crease; give its crease a stiffness"),
        (lambda: sheet().force("edge:inner", total=(0.0, 0.0, 1.0)), "not in equilibrium"),
    ],
)
def test_bad_models_are_refused(make: object, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        bh.trace(make())  # type: ignore[operator]


def test_bad_edge_moments_are_refused() -> None:
    model = clamped_sheet(rectangle(4.0, 1.0, 2), MYLAR).force("edge:end", total=(0.0, 0.0, 1e-4))
    with pytest.raises(ModelError, match="no edge set 'edge:left'; use one of edge:start, edge:end"):
        follow(model, [EdgeMoments((("edge:left", 0.0, 1.0),))])
    model = sheet().fold("crease", to=2.0)
    with pytest.raises(ModelError, match="'crease:crease' lies inside"):
        follow(model, [EdgeMoments((("crease:crease", 0.0, 1.0),))])


def test_states_of_bars_cannot_begin_a_step_of_the_shell() -> None:
    bars = solve(Model(SECTOR, MYLAR, formulation="bars-and-hinges").fold("crease", by=0.1))[-1]
    model = sheet().fold("crease", by=0.2)
    with pytest.raises(ModelError, match="begins at a state of the shell"):
        Shell().system(model, load_steps(model)[0], bars)


def test_a_free_hinge_is_named() -> None:
    """Nothing resists a couple on a free hinge between flat wings: the path says which crease turns."""
    model = (
        sheet(STRIP)
        .crease("crease", stiffness=0.0)
        .support("edge:inner", "xyz")
        .support("crease:crease", "xyz")
    )
    path = bh.trace(model.support("rigid-body").moment("crease", to=1e-3))
    assert path.outcome == "mechanism"
    assert "crease 'crease' turns" in path.reason


def test_a_clamp_that_slides_is_a_plane_of_symmetry() -> None:
    """Half of a sector, its end free to move in the plane of symmetry but not to turn out of it: half the energy."""
    whole = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.8), along=12, kind="alternating")
    half = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.4), along=6, kind="alternating")
    normal = [[-math.sin(0.4), math.cos(0.4), 0.0]]
    model = sheet(half).support("edge:end", normal, clamp=True).support("rigid-body").fold("crease", by=1.0)
    energy = solve(sheet(whole).fold("crease", by=1.0))[-1].energy.total
    assert 2.0 * solve(model)[-1].energy.total == pytest.approx(energy, rel=2e-4)
    loose = sheet(half).support("edge:end", normal).support("rigid-body").fold("crease", by=1.0)
    assert 2.0 * solve(loose)[-1].energy.total < 0.99 * energy


def test_a_crease_that_ends_inside_says_so() -> None:
    """The imposed angle is allowed, with a remark; one that fades out, or a spring, needs none."""
    mesh = meshes.structured(meshes.strip(40.0, 20.0, [10.0]), along=8, rows=2, kind="alternating")
    pairs = mesh.crease_edges("crease")
    short = replace(mesh, edge_sets={**mesh.edge_sets, "crease:crease": pairs[:4]})
    end = int(pairs[3, 1])
    (remark,) = solve(sheet(short).fold("crease", by=0.01)).remarks
    assert remark.startswith("crease 'crease' (edge ")
    assert f"ends inside the sheet at node {end} " in remark
    assert "\n" not in remark
    assert solve(sheet(short).fold("crease", by=(0.01, 0.01, 0.005, 0.0005))).remarks == []
    assert solve(sheet(short).crease("crease", stiffness=1e-3).moment("crease", to=1e-5)).remarks == []
    assert solve(sheet(mesh).fold("crease", by=0.01)).remarks == []


# --------------------------------------------------------------------------------------- bad input, in one line


def off_its_curve() -> meshes.SheetMesh:
    points = SECTOR.points.copy()
    points[SECTOR.crease_edges("crease")[2, 0], :2] *= 1.002
    return replace(SECTOR, points=points)


def across_triangles() -> meshes.SheetMesh:
    pairs = SECTOR.crease_edges("crease")
    across = np.array([[pairs[0, 0], pairs[2, 0]]])
    return replace(SECTOR, edge_sets={**SECTOR.edge_sets, "crease:crease": across})


def on_the_boundary() -> meshes.SheetMesh:
    return replace(SECTOR, edge_sets={**SECTOR.edge_sets, "crease:rim": SECTOR.edge_sets["edge:inner"]})


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (across_triangles, ("'crease:crease'", "not joined by an edge", "mesh along that line")),
        (lambda: sheet(off_its_curve()).fold("crease", by=0.1), ("'crease:crease'", "0.2 mm off its curve")),
        (
            lambda: Model(SECTOR, Sheet(E=4000.0, nu=0.38, t=0.0), formulation="shell"),
            ("t = 0.0", "positive"),
        ),
        (
            lambda: sheet().support("edge:inner", "xyz").displace("edge:inner", "z", 1.0),
            ("node 0", "fixed and displaced along the same direction", "remove"),
        ),
        (
            lambda: (
                sheet()
                .support("edge:start", "xyz")
                .step(Displace("edge:end", "z", 1.0), Displace("corner:inner-end", "z", 2.0))
            ),
            ("displaced by 1 and by 2 mm", "remove one"),
        ),
        (
            lambda: sheet().step(Fold("crease", to=2.0), Fold("all", by=0.5)),
            ("crease 'crease'", "given 2 and 2.64159 rad in one step (1)", "step of its own"),
        ),
        (
            lambda: (
                sheet()
                .crease("crease", stiffness=0.1)
                .step(Moment("crease", to=0.1), Moment("crease", to=0.2))
            ),
            ("crease 'crease'", "given 0.1 and 0.2 N mm / mm in one step (1)"),
        ),
        (lambda: sheet().support("edge:inner", "z").fold("crease", by=0.1), ("leave 3 of 6", "add supports")),
        (lambda: sheet().fold("fold", by=0.1), ("no crease 'fold'", "its creases: crease")),
        (lambda: sheet().moment("fold", to=0.1), ("no crease 'fold'", "its creases: crease")),
        (lambda: sheet().crease("fold", stiffness=0.1).fold("crease", by=0.1), ("no crease 'fold'",)),
        (lambda: sheet().force("crease:fold", total=(0.0, 0.0, 1.0)), ("no place 'crease:fold'",)),
        (lambda: sheet(on_the_boundary()).fold("rim", by=0.1), ("'rim'", "along the boundary")),
    ],
)
def test_bad_input_is_refused_in_one_line(make: Callable[[], Any], words: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as caught:
        bh.trace(make())
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message
