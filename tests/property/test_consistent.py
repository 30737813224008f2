"""The consistent formulation: derivatives that belong together, invariance, and eliminated rotations."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh import Displace, Fold, Force, Model, Moment, Sheet, trace
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.mechanics.consistent import elements as consistent_elements
from bh.mechanics.consistent.patches import patches
from bh.mechanics.consistent.system import ConsistentSystem
from bh.mechanics.shared import sparsity as pattern
from bh.solvers.linear import linear_response
from verification.studies.solver.derivatives import differences, prediction_ratio, random_rotation

Array = NDArray[np.float64]
SHEET = Sheet(E=4000.0, t=0.2, nu=0.3)
DIAGONAL = (1.0, 1.0, 0.0)


def sector(along: int = 5, **how: Any) -> meshes.SheetMesh:
    return meshes.structured(meshes.annulus_sector(40.0, 8.0, 0.6), along=along, **how)


def two_creases() -> meshes.SheetMesh:
    return meshes.structured(meshes.annulus_sector((40.0, 50.0), 8.0, 0.6, ("mountain", "valley")), along=5)


def curved(mesh: meshes.SheetMesh) -> meshes.SheetMesh:
    """A sheet that is made curved: rolled up a little, and crumpled."""
    points = mesh.points.copy()
    points[:, 2] = 0.01 * points[:, 0] ** 2 + 0.2 * np.random.default_rng(8).normal(size=len(points))
    return replace(mesh, points=points)


def sheet(mesh: meshes.SheetMesh) -> Model:
    return Model(mesh, SHEET, formulation="consistent")


def clamped(mesh: meshes.SheetMesh) -> Model:
    return sheet(mesh).support("edge:start", "xyz").support("corner:inner-end", "z")


def held_at_corners(mesh: meshes.SheetMesh) -> Model:
    model = sheet(mesh).support("corner:inner-start", "xyz").support("corner:outer-start", "yz")
    return model.support("corner:inner-end", "z")


def kinds() -> dict[str, Model]:
    mesh, pair = sector(), two_creases()
    oblique = (
        sheet(mesh)
        .support("corner:inner-start", [[1.0, 2.0, 0.5], [0.0, 1.0, -1.0], [1.0, 0.0, 0.0]])
        .support("edge:outer", [[0.2, 0.1, 1.0]])
        .support("corner:outer-end", [[1.0, -1.0, 0.3], [1.0, 1.0, 0.0]])
    )
    slope = sheet(mesh).support("edge:start", "xyz", clamp=True)
    symmetric = sheet(mesh).support("edge:start", "y", clamp=True).support("corner:inner-start", "xz")
    return {
        "free, spring crease": sheet(mesh).fold("crease", rest=2.3, Lstar=8.0),
        "free, prescribed crease": sheet(mesh).fold("crease", to=2.3),
        "free, moment": sheet(mesh).crease("crease", stiffness=0.4).moment("crease", 0.2),
        "free hinge, moment": sheet(mesh).crease("crease", stiffness=0.0).moment("crease", 0.02),
        "spring crease": clamped(mesh).fold("crease", rest=2.3, Lstar=8.0),
        "prescribed crease": clamped(mesh).fold("crease", to=3.9),
        "no fold": clamped(mesh).force("edge:end", total=(0.0, 0.02, 0.05)),
        "oblique, spring crease": oblique.fold("crease", rest=2.3, Lstar=8.0),
        "oblique, prescribed crease": oblique.fold("crease", to=2.3),
        "displaced": clamped(mesh).displace("corner:outer-end", "z", 0.4),
        "displaced obliquely, prescribed crease": clamped(mesh).step(
            Fold("crease", to=2.8), Displace("corner:outer-end", DIAGONAL, 0.3)
        ),
        "everything": held_at_corners(pair).step(
            Fold("crease-1", rest=2.5, Lstar=5.0),
            Fold("crease-2", to=3.6),
            Force("edge:end", each=(0.0, 0.001, 0.002)),
        ),
        "several steps": held_at_corners(pair)
        .step(Fold("crease-1", rest=2.6, Lstar=5.0), Moment("crease-1", 0.05))
        .step(Fold("crease-2", to=3.5), Moment("crease-1", -0.05), Force("edge:end", each=(0.0, 0.0, 0.002)))
        .fold("crease-1", to=2.9)
        .fold("crease-1", rest=2.7, Lstar=5.0),
        "clamped edge, prescribed crease": slope.fold("crease", to=2.6),
        "clamped edge, force": slope.force("edge:end", total=(0.0, 0.02, 0.05)),
        "symmetry, spring crease": symmetric.support("corner:inner-end", "z").fold(
            "crease", rest=2.3, Lstar=8.0
        ),
        "2 rows, alternating": sheet(sector(4, rows=2, kind="alternating")).fold("crease", to=2.5),
        "curved, prescribed crease": sheet(curved(mesh)).fold("crease", to=2.9),
        "curved, spring crease": clamped(curved(mesh)).fold("crease", rest=2.3, Lstar=8.0),
    }


KINDS = kinds()


@cache
def solved(name: str) -> bh.Path:
    path = trace(KINDS[name])
    assert path.outcome == "reached", f"{name}: {path.outcome}, {path.reason}"
    return path


def system_of(path: bh.Path, step: int) -> ConsistentSystem:
    system = path.system(step)
    assert isinstance(system, ConsistentSystem)
    return system


def first_system(model: Model) -> ConsistentSystem:
    system = formulation(model.formulation).system(model, load_steps(model)[0], None)
    assert isinstance(system, ConsistentSystem)
    return system


def systems(name: str) -> list[tuple[ConsistentSystem, Array, float]]:
    """System, unknowns and lambda of the last state of every step."""
    path = solved(name)
    last = {record.step: record for record in path.records}
    return [(system_of(path, step), record.q, record.lam) for step, record in last.items()]


def disturbed(system: ConsistentSystem, q: Array, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    return q + np.concatenate(
        (0.05 * rng.normal(size=system.moving), 0.05 * rng.normal(size=system.size - system.moving))
    )


def dense(matrix: Any, n: int) -> Array:
    return np.column_stack([matrix @ column for column in np.eye(n)])


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("seed", [1, 2])
def test_derivatives(name: str, seed: int) -> None:
    """Residual = d energy, tangent = d residual, and the same for lambda; away from equilibrium."""
    for system, q, lam in systems(name):
        errors = differences(system, disturbed(system, q, seed), 0.37 * lam, np.random.default_rng(seed))
        if system.control_stiffness(q, lam) == 0.0:  # dead loads: power does not depend on lambda
            errors.pop("control stiffness")
        assert max(errors.values()) < 1e-7, errors


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_derivatives_of_a_thick_sheet_that_slides_in_its_clamp(seed: int) -> None:
    """Thick, so that bending is not lost beside stretching; the nodes of the clamped edge move in every way."""
    mesh = sector(rows=2)
    model = (
        replace(sheet(mesh), sheet=replace(SHEET, t=20.0)).support("node:7", "xyz").support("node:9", "xy")
    )
    model = model.support("edge:start", [[0.0, 0.3, 1.0]], clamp=True).fold("crease", to=2.3)
    system = first_system(model)
    rng = np.random.default_rng(seed)
    q = np.concatenate((rng.normal(size=system.moving), 0.3 * rng.normal(size=system.size - system.moving)))
    assert max(differences(system, q, 0.37, rng).values()) < 1e-8


@pytest.mark.parametrize("name", KINDS)
def test_predicted_forces_are_first_order(name: str) -> None:
    """Halving the increment quarters the error of the predicted element forces."""
    for system, q, lam in systems(name):
        assert prediction_ratio(system, q, lam) == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("name", KINDS)
def test_energy_is_that_of_the_state(name: str) -> None:
    """Potential at equilibrium = energies of the state, by triangle and in total, less the work of the dead loads."""
    path = solved(name)
    for record, state in zip(path.records, path, strict=True):
        system = system_of(path, record.step)
        e, area = system.elements, state.mesh.areas
        for kind, density in state.energy_density.items():
            assert float(density @ area) == pytest.approx(state.energy.as_dict()[kind], rel=1e-9, abs=1e-15)
        turn = state.dihedral_angles[e.springs] - e.spring_rest.at(record.lam)
        loads = float(e.couple.at(record.lam) @ turn)
        loads -= float(np.vdot(system.force.at(record.lam), state.points - state.mesh.points))
        size = abs(state.energy.total) + abs(loads)
        potential = system.evaluate(record.q, record.lam).energy
        assert potential == pytest.approx(state.energy.total + loads, rel=1e-9, abs=1e-9 * size + 1e-20)


@pytest.mark.parametrize("name", KINDS)
def test_states_are_in_equilibrium(name: str) -> None:
    path = solved(name)
    # a spring on a curved sheet is made flat: it does not begin in equilibrium
    for record in path.records[name == "curved, spring crease" :]:
        system = system_of(path, record.step)
        now = system.evaluate(record.q, record.lam)
        assert now.imbalance <= 1e-8
        rotations = np.abs(now.residual[system.moving :]).max(initial=0.0)
        assert (
            rotations <= 1e-9 * np.abs(system.elements.B_triangle).max()
        )  # N mm against stiffness times 1 rad
        assert record.stable in ((True, None) if record.lam == 0.0 else (True,))


@pytest.mark.parametrize("name", ["several steps", "curved, prescribed crease"])
def test_a_step_begins_where_the_one_before_ended(name: str) -> None:
    """The rotations are found again from the positions, so that equilibrium and energy go on."""
    path = solved(name)
    model = KINDS[name]
    for step in range(1, len(model.steps)):
        last = max(i for i, record in enumerate(path.records) if record.step == step - 1)
        system = path.system(step)
        now = system.evaluate(system.start(), 0.0)
        assert now.imbalance < 1e-6  # a prescribed crease gives its moment to a spring, or takes it
        before = path[last]
        state = formulation("consistent").observe(model, system, system.start(), 0.0)
        assert state.energy.bending == pytest.approx(before.energy.bending, rel=1e-7)
        creases = ~np.isnan(before.crease_moments)
        assert np.abs(state.dihedral_angles - before.dihedral_angles)[creases].max(initial=0.0) < 1e-8


def test_flat_start_needs_no_rotations() -> None:
    system, _, _ = systems("free, prescribed crease")[0]
    assert not system.start().any()


# --------------------------------------------------------------------------------------- hinges that close


def nearly_closed(angle: float, held: bool) -> tuple[ConsistentSystem, Array]:
    """A strip with a straight crease, one half turned about it until `angle` (rad) is left."""
    mesh = meshes.structured(meshes.strip(6.0, 4.0, creases=(2.0,)), along=4)
    model = sheet(mesh).support("corner:inner-start", [[1.0, 0.5, 0.2]]).support("rigid-body")
    model = model.step(
        Displace("corner:inner-end", (0.3, 0.2, 1.0), 0.02),
        Fold("crease", to=angle) if held else Fold("crease", rest=1.0, Lstar=3.0),
    )
    system = first_system(model)
    x = mesh.points.copy()
    turned = x[:, 1] > 2.0
    y = x[turned, 1] - 2.0
    x[turned, 1], x[turned, 2] = 2.0 - y * math.cos(angle), -y * math.sin(angle)
    q = np.zeros(system.size)
    q[: system.moving] = system.displacements.components(x - mesh.points)
    return system, q


@pytest.mark.parametrize("angle", [0.01, 0.03, 2.0 * math.pi - 0.01])
def test_locks_belong_to_their_derivatives(angle: float) -> None:
    system, q = nearly_closed(angle, held=False)
    q[: system.moving] += 1e-4 * np.random.default_rng(3).normal(size=system.moving)
    q[system.moving :] += 0.05 * np.random.default_rng(4).normal(size=system.size - system.moving)
    now = system.internal(system.positions(q, 0.4), q[system.moving :], 0.4)
    assert now.lock > 0.0
    errors = differences(system, q, 0.4, np.random.default_rng(5))
    assert max(errors.values()) < 1e-4, (
        errors
    )  # the law of the lock is steep beside the step of the differences
    assert "touch" in system.contact(q, 0.4)
    obstacle = system.obstacle(q, 0.4)
    assert obstacle is not None
    assert obstacle[0] == "contact"
    tangent = system.tangent(q, 0.4, now.forces)
    v = np.random.default_rng(6).normal(size=system.size)
    wrong = []
    for step in (2e-5, 1e-5):
        ahead = tangent.predicted_forces(now.forces, step * v)
        wrong.append(float(np.abs(ahead - system.evaluate(q + step * v, 0.4).forces).max()))
    assert wrong[0] / wrong[1] == pytest.approx(4.0, rel=0.1)


def test_held_creases_and_open_hinges_have_no_lock() -> None:
    for system, q in (nearly_closed(0.01, held=True), nearly_closed(0.2, held=False)):
        assert system.internal(system.positions(q, 0.4), q[system.moving :], 0.4).lock == 0.0
        assert system.contact(q, 0.4) == ""


def test_passing_through_is_seen() -> None:
    (system, q), (_, other) = nearly_closed(0.3, held=False), nearly_closed(2.0 * math.pi - 0.3, held=False)
    assert "crease 'crease'" in system.penetration(q, 0.4, other, 0.4)
    assert "would pass through" in system.objection(q, 0.4, other, 0.4)
    assert system.penetration(q, 0.4, q, 0.4) == ""


def test_spring_presses_shut() -> None:
    """A spring whose rest is shut ends within the zone of the lock, in equilibrium."""
    path = trace(sheet(sector()).fold("crease", rest=0.0, Lstar=0.05))
    assert path[-1].dihedral("crease").min() > 0.0
    assert path.outcome in ("reached", "contact")


# --------------------------------------------------------------------------------------- invariance


@pytest.mark.parametrize("name", ["spring crease", "curved, spring crease", "everything", "no fold"])
def test_energy_is_blind_to_rigid_motions(name: str) -> None:
    """Energy, moments and rotations' residual at turned and shifted positions, without any tolerance for size."""
    system, q, lam = systems(name)[0]
    q = disturbed(system, q, 3)
    x, alpha = system.positions(q, lam), q[system.moving :]
    rng = np.random.default_rng(6)
    Q, shift = random_rotation(rng), 30.0 * rng.normal(size=3)
    one, two = system.internal(x, alpha, lam), system.internal(x @ Q.T + shift, alpha, lam)
    assert two.bending == pytest.approx(one.bending, rel=1e-11)
    assert two.stretching == pytest.approx(one.stretching, rel=1e-10)
    assert np.abs(two.f - one.f @ Q.T).max() <= 1e-10 * np.abs(one.f).max()
    assert np.abs(two.r - one.r).max() <= 1e-11 * np.abs(one.r).max() + 1e-12
    assert np.abs(one.f.sum(axis=0)).max() <= 1e-12 * np.abs(one.f).max()
    assert np.abs(np.cross(x, one.f).sum(axis=0)).max() <= 1e-12 * np.abs(one.f).max() * np.abs(x).max()


def test_mirrored_fold() -> None:
    """Mountain and valley are alike: the same energies, angles beyond flat."""
    down, up = (
        solved("free, prescribed crease")[-1],
        trace(sheet(sector()).fold("crease", to=2 * math.pi - 2.3))[-1],
    )
    assert up.energy.total == pytest.approx(down.energy.total, rel=1e-8)
    assert up.energy.stretching == pytest.approx(down.energy.stretching, rel=1e-6)
    assert (
        np.abs(up.crease_moment("crease") + down.crease_moment("crease")).max()
        < 1e-6 * np.abs(down.crease_moment("crease")).max()
    )


def test_renumbering_does_not_matter() -> None:
    """Which side of an edge measures its turn, and which triangles are joined, follow the numbering."""
    mesh = sector(6, rows=2, kind="alternating")
    order = np.random.default_rng(2).permutation(len(mesh.points))
    new = np.empty_like(order)
    new[order] = np.arange(len(order))
    other = meshes.SheetMesh(
        mesh.points[order],
        new[mesh.triangles][::-1],
        edge_sets={name: new[pairs] for name, pairs in mesh.edge_sets.items()},
        folds=mesh.folds,
    )
    one, two = (trace(sheet(m).fold("crease", to=2.4))[-1] for m in (mesh, other))
    assert two.energy.total == pytest.approx(one.energy.total, rel=1e-9)
    assert two.energy.stretching == pytest.approx(one.energy.stretching, rel=1e-6)


# --------------------------------------------------------------------------------------- patches, band and sparse


@pytest.mark.parametrize(
    "name", ["everything", "clamped edge, prescribed crease", "2 rows, alternating", "curved, spring crease"]
)
def test_patches_do_not_matter(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Single triangles, pairs and fours: other unknowns, the same states to the last digits."""
    found = []
    for joined in (0, 1, 2):
        monkeypatch.setattr(
            consistent_elements,
            "patches",
            partial(patches, joined=joined),
        )
        found.append(trace(KINDS[name]))
    sizes = [path.unknowns for path in found]
    assert sizes[0] > sizes[1] > sizes[2]
    for path in found[1:]:
        one, two = found[0][-1], path[-1]
        assert two.energy.total == pytest.approx(one.energy.total, rel=1e-10)
        for kind, density in one.energy_density.items():
            assert (
                np.abs(two.energy_density[kind] - density).max()
                <= 1e-6 * one.energy.total / one.mesh.areas.min()
            )
        assert np.nan_to_num(two.crease_moments) == pytest.approx(
            np.nan_to_num(one.crease_moments), rel=1e-5, abs=1e-7
        )


def test_pairs_condense_exactly() -> None:
    """B of a pair is the minimum over the rotation inside, for random angles, free edges included."""
    mesh = sector(4)
    model = sheet(mesh).fold("crease", to=2.0)
    system = first_system(model)
    e = system.elements
    rng = np.random.default_rng(0)
    theta = rng.normal(size=e.rotation.shape) * (e.patches.kind != 0)
    direct = system.bending_by_triangle(theta).sum()
    assert 0.5 * np.einsum("ca,cab,cb->", theta, e.patches.B, theta) == pytest.approx(direct, rel=1e-11)
    shares = e.patches.shares
    for _ in range(20):  # any other share of an angle inside costs more
        inner = np.flatnonzero(e.patches.inner.any(axis=1))
        patch = int(rng.choice(inner))
        half = shares[patch] @ theta[patch]
        members = e.patches.members[patch]
        first, second = _inner_half_edges(mesh, members)

        def cost(h: Array, members: Array = members) -> float:
            return sum(
                0.5 * float(h[3 * m : 3 * m + 3] @ e.B_triangle[t] @ h[3 * m : 3 * m + 3])
                for m, t in enumerate(members)
            )

        other = half.copy()
        other[first] += 0.1
        other[second] -= 0.1
        assert cost(other) > cost(half)


def _inner_half_edges(mesh: meshes.SheetMesh, members: Array) -> tuple[int, int]:
    edges = mesh.topology.triangle_edges[members].ravel()
    shared = next(edge for edge in edges if (edges == edge).sum() == 2)
    first, second = np.flatnonzero(edges == shared)
    return int(first), int(second)


@pytest.mark.parametrize("name", ["everything", "oblique, prescribed crease", "free, spring crease"])
def test_band_and_sparse_agree(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model = KINDS[name]
    responses = []
    for banded in (True, False):
        monkeypatch.setattr(pattern, "band_is_cheaper", lambda n, bandwidth, banded=banded: banded)
        system = first_system(model)
        assert system._pattern.banded is banded
        q = solved(name).records[0].q
        A = dense(system.tangent(q, 0.0, system.evaluate(q, 0.0).forces).matrix, system.size)
        assert np.abs(A - A.T).max() <= 1e-14 * np.abs(A).max()
        responses.append((A, linear_response(system, q).dq))
    for x, y in zip(*responses, strict=True):
        assert np.abs(x - y).max() <= 1e-9 * np.abs(x).max()
