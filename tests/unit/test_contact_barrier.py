"""Panels that stop each other: the barrier, what it does to a system, and what no state passes through."""

import math
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh.errors import ModelError
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.mechanics.contact.barrier import SheetBarrier, sheet_barrier
from bh.mechanics.contact.blocks import ContactBlocks
from bh.model.serialise import describe, fingerprint, rebuild

Array = NDArray[Any]
GAP = 0.1
FORMULATIONS = ("consistent", "bars-and-hinges")


def letter(name: str = "consistent", contact: Any = GAP, by: float = 2.4) -> bh.Model:
    """Three panels of a strip whose outer ones meet when both creases fold by more than 120 degrees."""
    mesh = meshes.structured(meshes.strip(10.0, 60.0, creases=[20.0, 40.0]), along=3, rows=6)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), formulation=name, contact=contact)
    return model.step(*(bh.Fold(crease, by=by, Lstar=5.0) for crease in mesh.creases))


def two_layers(distance: float) -> tuple[meshes.SheetMesh, Array]:
    """Two triangles in one mesh, one above the other and turned, and where they are."""
    flat = [[0, 0, 0], [10, 0, 0], [0, 10, 0], [21, 1, 0], [31, 2, 0], [22, 11, 0]]
    mesh = meshes.SheetMesh(np.array(flat, float), np.array([[0, 1, 2], [3, 4, 5]]))
    x = mesh.points.copy()
    x[3:] += [-20.0, 0.0, distance]
    return mesh, x


@pytest.fixture
def near() -> tuple[SheetBarrier, Array]:
    mesh, x = two_layers(0.05)
    x[3:, 2] += [0.0, 0.01, 0.02]
    return SheetBarrier(mesh, 0.0, GAP, 2.0), x


def test_gradient_and_hessian_are_those_of_the_energy(near: tuple[SheetBarrier, Array]) -> None:
    barrier, x = near
    f = np.zeros_like(x)
    assert barrier.forces(x, f) > 0.0
    v = np.random.default_rng(3).normal(size=x.shape)
    h = 1e-6
    plus, minus = np.zeros_like(x), np.zeros_like(x)
    slope = (barrier.forces(x + h * v, plus) - barrier.forces(x - h * v, minus)) / (2.0 * h)
    assert slope == pytest.approx(np.vdot(f, v), rel=1e-6)
    assert barrier.times(x, v) == pytest.approx(
        (plus - minus) / (2.0 * h), rel=1e-5, abs=1e-5 * np.abs(f).max()
    )


def test_blocks_sum_to_the_hessian(near: tuple[SheetBarrier, Array]) -> None:
    barrier, x = near
    pairs, blocks = barrier.blocks(x)
    H = np.zeros((3 * len(x), 3 * len(x)))
    for (a, b), block in zip(pairs, blocks, strict=True):
        rows = np.concatenate((3 * a + np.arange(3), 3 * b + np.arange(3)))
        H[np.ix_(rows, rows)] += block
    v = np.random.default_rng(5).normal(size=x.shape)
    assert (H @ v.ravel()).reshape(-1, 3) == pytest.approx(barrier.times(x, v), rel=1e-9, abs=1e-9)


def test_forces_and_moments_of_contact_balance(near: tuple[SheetBarrier, Array]) -> None:
    barrier, x = near
    f = np.zeros_like(x)
    barrier.forces(x, f)
    size = np.abs(f).max()
    assert np.abs(f.sum(axis=0)).max() < 1e-12 * size
    assert np.abs(np.cross(x, f).sum(axis=0)).max() < 1e-11 * size


def test_energy_is_blind_to_rigid_motions(near: tuple[SheetBarrier, Array]) -> None:
    barrier, x = near
    q, _ = np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    one = barrier.forces(x, np.zeros_like(x))
    assert barrier.forces(x @ q.T + [3.0, -2.0, 1.0], np.zeros_like(x)) == pytest.approx(one, rel=1e-9)


@pytest.mark.parametrize("offset", [0.0, 0.3])
def test_barrier_is_the_formula_of_its_module(offset: float) -> None:
    """A node above the middle of a triangle: weight, that is its share of area, times b(d)."""
    mesh = meshes.SheetMesh(
        np.array([[0, 0, 0], [10, 0, 0], [0, 10, 0], [20, 0, 0], [30, 0, 0], [20, 10, 0]], float),
        np.array([[0, 1, 2], [3, 4, 5]]),
    )
    energies = []
    distances = offset + GAP * np.array([0.3, 0.6])
    for d in distances:
        x = mesh.points.copy()
        x[3] = [3.0, 3.0, d]
        x[4], x[5] = [3.0, 4.0, d + 8.0], [4.0, 3.0, d + 8.0]
        energies.append(SheetBarrier(mesh, offset, GAP, 2.0).forces(x, np.zeros_like(x)))
    s = (distances**2 - offset**2) / (2.0 * offset * GAP + GAP**2)
    b = -((s - 1.0) ** 2) * np.log(s)
    assert energies[0] / energies[1] == pytest.approx(b[0] / b[1], rel=1e-9)


def test_nothing_is_there_beyond_the_reach_and_no_energy_where_layers_cross() -> None:
    mesh, x = two_layers(1.01 * GAP)
    barrier = SheetBarrier(mesh, 0.0, GAP, 2.0)
    assert barrier.forces(x, np.zeros_like(x)) == 0.0
    assert barrier.distance(x) == GAP
    crossed = x.copy()
    crossed[3, 2] = -0.02
    assert barrier.forces(crossed, np.zeros_like(x)) == math.inf
    assert not barrier.clear(crossed)
    assert "triangle" in barrier.meetings(crossed)
    below = x - [0.0, 0.0, 1.0] * (np.arange(6) > 2)[:, None]
    assert barrier.clear(below)
    assert barrier.free_part(x, below) == pytest.approx(0.1, abs=0.02)


def test_a_new_pattern_only_where_a_pair_is_new() -> None:
    blocks = ContactBlocks()
    pairs = np.array([[5, 2], [4, 1]])
    assert not blocks.known(pairs)
    assert blocks.known(pairs[:1])
    assert blocks.known(pairs[::-1])
    assert not blocks.known(np.array([[5, 1]]))
    assert blocks.known(pairs)  # those of before are kept
    many = np.array([[9, 0], [9, 1], [9, 2], [9, 3], [9, 4]])
    assert not blocks.known(many)
    assert not blocks.known(np.array([[8, 3]]))
    assert not blocks.known(many)  # but not when they are many more than press now


@pytest.mark.parametrize("name", FORMULATIONS)
def test_residual_and_tangent_of_a_system_with_contact(name: str) -> None:
    """Central differences of the energy and of the residual at a bent state in which panels touch."""
    model = letter(name)
    mesh = model.mesh
    system: Any = formulation(name).system(model, load_steps(model)[0], None)
    s = mesh.points[:, 1]
    x = mesh.points.copy()
    first, last = s < 20.0, s > 40.0
    turn = 2.0 * math.pi / 3.0 - 0.002
    x[first, 1], x[first, 2] = 20.0 - np.cos(turn) * (20.0 - s[first]), np.sin(turn) * (20.0 - s[first])
    x[last, 1], x[last, 2] = 40.0 + np.cos(turn) * (s[last] - 40.0), np.sin(turn) * (s[last] - 40.0)
    q = np.zeros(system.size)
    q[: system.moving] = system.displacements.unknowns(x)
    rng = np.random.default_rng(1)
    q[: system.moving] += 1e-4 * rng.normal(size=system.moving)
    contact = np.zeros_like(x)
    assert 0.0 < system.barrier.forces(system.positions(q, 1.0), contact) < math.inf
    v, h = rng.normal(size=system.size), 1e-6
    if name == "bars-and-hinges":
        v[system.moving :] = 0.0
    now, plus, minus = (system.evaluate(q + k * h * v, 1.0) for k in (0.0, 1.0, -1.0))
    assert (plus.energy - minus.energy) / (2.0 * h) == pytest.approx(now.residual @ v, rel=1e-5)
    product = system.tangent(q, 1.0, now.forces).matrix @ v
    difference = (plus.residual - minus.residual) / (2.0 * h)
    # a free sheet's matrix is grounded; both agree across the rigid motions
    assert product == pytest.approx(difference, rel=1e-4, abs=1e-5 * np.abs(difference).max())


def independent_crossings(points: Array, mesh: meshes.SheetMesh) -> Array:
    """Triangles that intersect, by the predicate of `bh.contact`, which shares nothing with the barrier."""
    from bh.analysis.contact import candidates
    from bh.analysis.triangles import intersecting

    pairs = candidates(points, mesh.triangles)
    return np.asarray(pairs[intersecting(points, mesh.triangles, pairs, 1e-9)])


@pytest.mark.parametrize("name", FORMULATIONS)
def test_a_letter_folded_beyond_meeting_does_not_pass_through_itself(name: str) -> None:
    model = letter(name)
    path = bh.trace(model)
    assert path.outcome == "reached", path.reason
    assert bh.contact.first_contact(path) is None
    assert all(len(independent_crossings(state.points, state.mesh)) == 0 for state in path)
    last = path[-1]
    assert 0.0 < sheet_barrier(model).distance(last.points) < GAP
    assert 0.0 < last.energy.contact < 0.01 * last.energy.total
    assert last.stable
    # the panels press on each other: the creases stay short of where they would rest
    assert last.fold_angle("crease-1").mean() < 2.39


def test_without_contact_the_same_letter_passes_through_itself() -> None:
    assert bh.contact.first_contact(bh.trace(letter(contact=False))) is not None


def test_what_does_not_touch_is_the_same_to_the_last_digit_but_for_the_energy_that_is_none() -> None:
    free, stopped = (bh.trace(letter(contact=contact, by=1.0))[-1] for contact in (False, GAP))
    assert np.abs(free.points - stopped.points).max() < 1e-9
    assert stopped.energy.contact == 0.0


def test_contact_is_kept_with_a_model_and_changes_no_model_without() -> None:
    model = letter()
    again = rebuild(*describe(model))
    assert again.contact == GAP
    assert fingerprint(again) == fingerprint(model)
    assert "contact" not in describe(letter(contact=False))[0]


@pytest.mark.parametrize(
    ("contact", "says"),
    [
        (0.0, "contact = 0.0 cannot be"),
        (True, "contact = True"),
        (math.nan, "contact = nan"),
        ("auto!", "'auto!'"),
    ],
)
def test_values_that_cannot_be(contact: Any, says: str) -> None:
    with pytest.raises(ModelError, match=says):
        letter(contact=contact)


def test_a_thickness_that_cannot_fit_and_a_first_state_that_meets_itself() -> None:
    with pytest.raises(ModelError, match="do not fit triangles"):
        sheet_barrier(letter(contact=50.0))
    flat = np.array([[0, 0, 0], [10, 0, 0], [0, 10, 0], [1, 1, -1], [2, 2, 1], [11, 1, 1]], float)
    mesh = meshes.SheetMesh(flat, np.array([[0, 1, 2], [3, 4, 5]]))
    model = (
        bh.Model(mesh, bh.Sheet(E=1.0, t=0.1), contact=GAP)
        .support([0, 1, 2])
        .support([3, 4])
        .support([5], "z")
        .force([5], each=(1, 0, 0))
    )
    with pytest.raises(ModelError, match=r"the first state meets itself \(edge 3-4 and triangle 0-1-2;"):
        bh.trace(model)


def test_symmetry_and_sensitivities_say_that_they_know_no_contact() -> None:
    with pytest.raises(ModelError, match="whole sheet"):
        bh.trace(letter(by=0.1), symmetry="x")


def test_a_formulation_without_contact_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bh.paths.path.Limited", int)  # an ability that it has not
    with pytest.raises(ModelError, match="formulation 'linear-shell' has no contact"):
        bh.trace(replace(letter(by=0.1), formulation="linear-shell"))


def test_a_sheet_without_contact_does_not_load_the_library() -> None:
    code = (
        "import sys, bh, meshes\n"
        "mesh = meshes.structured(meshes.strip(10.0, 20.0, creases=[10.0]), along=2)\n"
        "model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.1)).fold('crease', by=0.1)\n"
        "path = bh.trace(model)\n"
        "print('ipctk' in sys.modules)"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "False"


def test_a_way_is_looked_at_again_from_where_detection_has_stopped_short(
    near: tuple[SheetBarrier, Array], monkeypatch: pytest.MonkeyPatch
) -> None:
    # detection may stop where a pair has come to a tenth of its distance, and nothing stands in the way
    barrier, x = near
    detection = barrier._detection
    seen = iter((0.5, 0.5, 1.0))
    monkeypatch.setattr(detection, "_seen_free", lambda *_: next(seen))
    assert detection.free_part(x, x + 1.0) == 1.0
    monkeypatch.setattr(detection, "_seen_free", lambda *_: 0.5)
    assert detection.free_part(x, x + 2.0) == 0.5


def test_ways_are_clear_up_to_where_parts_begin_to_press() -> None:
    mesh, x = two_layers(5.0)
    barrier = SheetBarrier(mesh, 0.0, GAP, 2.0)
    assert barrier.begin(x)
    places = [x.copy() for _ in range(4)]
    for k, place in enumerate(places):
        place[3:, 2] -= 2.0 * k  # 5, 3, 1, -1 mm apart
    assert barrier.clear_ways(places[:3]) == 2.0
    assert 2.3 < barrier.clear_ways(places) <= 2.45  # pressing begins 0.45 of the way down
    inside = places[2].copy()
    inside[3:, 2] -= 0.95
    assert barrier.clear_ways([places[2], inside]) < 1.0


def test_a_barrier_asleep_is_none_and_wakes_up(
    near: tuple[SheetBarrier, Array],
) -> None:
    barrier, x = near
    f = np.zeros_like(x)
    with barrier.asleep():
        assert barrier.forces(x, f) == 0.0
        assert not barrier.presses(x)
        assert not f.any()
    assert barrier.forces(x, f) > 0.0


def test_time_of_looks_is_counted_by_work_not_by_the_clock() -> None:
    mesh, x = two_layers(5.0)
    down = x - [0.0, 0.0, 6.0] * (np.arange(6) > 2)[:, None]
    counted = []
    for _ in range(2):
        barrier = SheetBarrier(mesh, 0.0, GAP, 2.0)
        assert barrier.seconds == 0.0
        barrier.free_part(x, down)
        looked = barrier.seconds
        barrier.forces(x, np.zeros_like(x))
        counted.append((looked, barrier.seconds))
    assert 0.0 < counted[0][0] < counted[0][1] < 1e-3
    assert counted[0] == counted[1]


@pytest.mark.parametrize("name", FORMULATIONS)
def test_what_never_meets_takes_the_iterations_of_a_model_without_contact(name: str) -> None:
    # 118 degrees: the outer panels come to 1.2 mm of each other
    with_contact = bh.trace(letter(name, by=2.06))
    without = bh.trace(letter(name, contact=False, by=2.06))
    assert [r.lam for r in with_contact.records] == [r.lam for r in without.records]
    assert with_contact.steps[0].iterations == without.steps[0].iterations
    assert with_contact[-1].points == pytest.approx(without[-1].points, abs=1e-9)


def test_a_way_that_is_not_clear_at_all_is_taken_with_contact(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SheetBarrier, "clear_ways", lambda *_: 0.0)
    assert bh.trace(letter(by=1.0)).reached


def test_motions_are_looked_for_from_an_accepted_state_that_no_way_was_known_to() -> None:
    """A layer that is found below the other one goes round it, though nothing is known of how it got there."""
    mesh, above = two_layers(1.0)
    barrier = SheetBarrier(mesh, 0.0, 0.05, 2.0)
    far, below = above.copy(), above.copy()
    far[3:, 0] += 100.0
    below[3:, 2] -= 2.0
    round_it = []
    for z, ways in ((0.0, np.arange(0.0, 31.0, 5.0)), (2.0, np.arange(30.0, -1.0, -5.0))):
        for way in ways:
            round_it.append(below.copy())
            round_it[-1][3:] += [way, 0.0, z]

    def tried() -> bool:
        for x in round_it:
            barrier.forces(x, np.zeros_like(x))
        return barrier.passed(below, round_it[-1])

    assert barrier.begin(far)
    assert tried()  # nothing is known of a way from `far` to `below`
    assert not tried()  # but of one from `below`
    other = SheetBarrier(mesh, 0.0, 0.05, 2.0)
    assert other.begin(below)
    assert other.passed(below, above)  # straight through the other layer, where no way round was tried
