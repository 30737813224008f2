"""Every kind of system: derivatives that belong together, band and sparse alike, free bodies, imposed angles."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh import Displace, Fold, Force, Model, Moment, Sheet, trace
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.mechanics.bars_and_hinges.system import BarsAndHingesSystem
from bh.mechanics.shared import sparsity as patterns
from bh.model.sheet import ElementStiffness
from bh.solvers.linear import linear_response
from bh.solvers.matrices import FreeBodyMatrix
from bh.solvers.saddle import MultiplierMatrix
from verification.studies.solver.derivatives import differences, prediction_ratio

Array = NDArray[np.float64]
SHEET = Sheet(E=4000.0, t=0.2)
DIAGONAL = (1.0, 1.0, 0.0)


def sector(along: int = 5, **how: Any) -> meshes.SheetMesh:
    return meshes.structured(meshes.annulus_sector(40.0, 8.0, 0.6), along=along, **how)


def two_creases() -> meshes.SheetMesh:
    return meshes.structured(meshes.annulus_sector((40.0, 50.0), 8.0, 0.6, ("mountain", "valley")), along=5)


def clamped(mesh: meshes.SheetMesh) -> Model:
    return (
        Model(mesh, SHEET, formulation="bars-and-hinges")
        .support("edge:start", "xyz")
        .support("corner:inner-end", "z")
    )


def held_at_corners(mesh: meshes.SheetMesh) -> Model:
    """Three corners take the six rigid motions (App. B); the creases can fold."""
    model = (
        Model(mesh, SHEET, formulation="bars-and-hinges")
        .support("corner:inner-start", "xyz")
        .support("corner:outer-start", "yz")
    )
    return model.support("corner:inner-end", "z")


def balanced(mesh: meshes.SheetMesh, size: float) -> tuple[Force, Force]:
    """Two dead forces that pull the corners of the inner edge apart, in equilibrium by symmetry also when folded."""
    a, b = (mesh.corners[f"corner:inner-{end}"] for end in ("start", "end"))
    pull = size * (mesh.points[b] - mesh.points[a]) / np.linalg.norm(mesh.points[b] - mesh.points[a])
    return Force([a], each=tuple(-pull)), Force([b], each=tuple(pull))


def given_stiffness(model: Model) -> Model:
    """Bars with Green's strain and random stiffness, hinges likewise (`Model.from_arrays`)."""
    rng = np.random.default_rng(9)
    edges, hinges = len(model.mesh.topology.edges), len(model.mesh.topology.hinges)
    given = ElementStiffness(rng.uniform(500.0, 2000.0, edges), rng.uniform(1.0, 9.0, hinges), green=True)
    return replace(model, stiffness=given)


def kinds() -> dict[str, Model]:
    mesh, pair = sector(), two_creases()
    oblique = (
        Model(mesh, SHEET, formulation="bars-and-hinges")
        .support("corner:inner-start", [[1.0, 2.0, 0.5], [0.0, 1.0, -1.0], [1.0, 0.0, 0.0]])
        .support("edge:outer", [[0.2, 0.1, 1.0]])
        .support("corner:outer-end", [[1.0, -1.0, 0.3], [1.0, 1.0, 0.0]])
    )
    return {
        "free, spring crease": Model(mesh, SHEET, formulation="bars-and-hinges").fold(
            "crease", rest=2.3, Lstar=8.0
        ),
        "free, prescribed crease": Model(mesh, SHEET, formulation="bars-and-hinges").fold("crease", to=2.3),
        "free, moment": Model(mesh, SHEET, formulation="bars-and-hinges")
        .crease("crease", stiffness=0.4)
        .moment("crease", 0.2),
        "free, forces": Model(mesh, SHEET, formulation="bars-and-hinges").step(
            Fold("crease", to=2.6), *balanced(mesh, 0.01)
        ),
        "free, all z held": Model(mesh, SHEET, formulation="bars-and-hinges")
        .support("crease:crease", "z")
        .support("rigid-body")
        .fold("crease", rest=2.0, Lstar=20.0),
        "point and rigid body": Model(mesh, SHEET, formulation="bars-and-hinges")
        .support("corner:outer-end", "xyz")
        .support("rigid-body")
        .fold("crease", to=2.5),
        "supported, spring crease": clamped(mesh).fold("crease", rest=2.3, Lstar=8.0),
        "supported, prescribed crease": clamped(mesh).fold("crease", to=3.9),
        "supported, no fold": clamped(mesh).force("edge:end", total=(0.0, 0.02, 0.05)),
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
        .step(
            Fold("crease-1", rest=2.6, Lstar=5.0),
            Moment("crease-1", 0.05),
            Displace("corner:outer-end", DIAGONAL, 0.1),
        )
        .step(Fold("crease-2", to=3.5), Moment("crease-1", -0.05), Force("edge:end", each=(0.0, 0.0, 0.002)))
        .displace("corner:outer-end", DIAGONAL, -0.2),
        "green, free": given_stiffness(Model(mesh, SHEET, formulation="bars-and-hinges")).fold(
            "crease", rest=2.5, stiffness=1.0
        ),
        "green, oblique, displaced": given_stiffness(oblique).displace("corner:inner-end", DIAGONAL, 0.4),
        "2 rows, alternating": Model(
            sector(4, rows=2, kind="alternating"), SHEET, formulation="bars-and-hinges"
        ).fold("crease", to=2.5),
    }


KINDS = kinds()
PRESCRIBED = [name for name in KINDS if "prescribed" in name or "everything" in name]
FREE = [
    "free, spring crease",
    "free, prescribed crease",
    "free, moment",
    "free, forces",
    "2 rows, alternating",
]


@cache
def solved(name: str) -> bh.Path:
    path = trace(KINDS[name])
    assert path.outcome == "reached", f"{name}: {path.outcome}, {path.reason}"
    return path


def system_of(path: bh.Path, step: int) -> BarsAndHingesSystem:
    system = path.system(step)
    assert isinstance(system, BarsAndHingesSystem)
    return system


def systems(name: str) -> list[tuple[BarsAndHingesSystem, Array, float]]:
    """System, unknowns and lambda of the last state of every step."""
    path = solved(name)
    last = {record.step: record for record in path.records}
    return [(system_of(path, step), record.q, record.lam) for step, record in last.items()]


def disturbed(system: BarsAndHingesSystem, q: Array, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    held = system.size - system.primal
    return q + np.concatenate((0.05 * rng.normal(size=system.primal), 0.1 * rng.normal(size=held)))


def dense(matrix: Any, n: int) -> Array:
    return np.column_stack([matrix @ column for column in np.eye(n)])


# --------------------------------------------------------------------------------------- derivatives


def control_is_quadratic(system: BarsAndHingesSystem) -> bool:
    """Dead loads alone give a power that does not depend on lambda."""
    return bool(
        np.abs(system.elements.rest.rate).max() > 0.0
        or np.abs(system.displacements.prescribed_rate).max() > 0.0
    )


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("seed", [1, 2])
def test_derivatives(name: str, seed: int) -> None:
    """Residual = d energy, tangent = d residual, and the same for lambda; away from equilibrium."""
    for system, q, lam in systems(name):
        errors = differences(system, disturbed(system, q, seed), 0.37 * lam, np.random.default_rng(seed))
        assert set(errors) == {"residual", "tangent", "control rate", "power", "control stiffness"}
        if not control_is_quadratic(system):
            errors.pop("control stiffness")  # zero: no relative error
            assert system.control_stiffness(q, lam) == 0.0
        assert max(errors.values()) < 1e-7, errors


@pytest.mark.parametrize("name", KINDS)
def test_tangent_is_symmetric(name: str) -> None:
    for system, q, lam in systems(name):
        q = disturbed(system, q, 3)
        matrix = system.tangent(q, lam, system.evaluate(q, lam).forces).matrix
        A = dense(matrix, system.size)
        # what is stored is the augmented matrix; taking the penalty out again leaves its rounding errors
        stored = dense(matrix.augmented, system.primal) if isinstance(matrix, MultiplierMatrix) else A
        assert np.abs(A - A.T).max() <= 1e-14 * np.abs(stored).max()
        assert (
            np.linalg.matrix_rank(A[: system.primal, : system.primal]) > system.primal // 2
        )  # there is something


@pytest.mark.parametrize("name", KINDS)
def test_energy_is_that_of_the_state(name: str) -> None:
    """Potential at equilibrium = elastic energy of the state less the work of the dead loads."""
    path = solved(name)
    for record, state in zip(path.records, path, strict=True):
        system = system_of(path, record.step)
        e = system.elements
        turn = state.dihedral_angles[e.source] - e.rest.at(record.lam)
        loads = float(e.couple.at(record.lam) @ turn)
        loads -= float(np.vdot(system.force.at(record.lam), state.points - state.mesh.points))
        potential = system.evaluate(record.q, record.lam).energy
        size = abs(state.energy.total) + abs(loads)
        assert potential == pytest.approx(state.energy.total + loads, rel=1e-9, abs=1e-9 * size + 1e-20)


@pytest.mark.parametrize("name", KINDS)
def test_predicted_forces_are_first_order(name: str) -> None:
    """Halving the increment quarters the error of the predicted element forces."""
    for system, q, lam in systems(name):
        assert prediction_ratio(system, q, lam) == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("name", KINDS)
def test_states_are_in_equilibrium(name: str) -> None:
    """Every accepted state satisfies its equations, and says whether it is stable."""
    path = solved(name)
    for record in path.records:
        system = system_of(path, record.step)
        now = system.evaluate(record.q, record.lam)
        assert now.imbalance <= 1e-8
        # relative to the bars' forces, above what rounding of 1e-14 makes of stiffness times size
        typical = np.sqrt(np.mean(now.forces[: len(system.elements.bars)] ** 2))
        rounding = 1e-14 * system.elements.bar_stiffness.max() * 50.0
        assert np.abs(now.residual[: system.primal]).max() <= 1e-6 * typical + rounding
        assert np.abs(now.residual[system.primal :]).max(initial=0.0) < 1e-9  # rad
        assert record.stable in ((True, None) if record.lam == 0.0 else (True,))


# --------------------------------------------------------------------------------------- band and sparse


def force_storage(monkeypatch: pytest.MonkeyPatch, banded: bool) -> None:
    monkeypatch.setattr(patterns, "band_is_cheaper", lambda n, bandwidth: banded)


@pytest.mark.parametrize("name", KINDS)
def test_band_and_sparse_agree(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model = KINDS[name]
    found = []
    for banded in (True, False):
        force_storage(monkeypatch, banded)
        path = trace(model)
        assert path.outcome == "reached"
        assert system_of(path, 0)._pattern.banded is banded  # the choice was forced
        found.append(path)
    one, two = found
    assert len(one) == len(two)
    points = np.array([[state.points for state in path] for path in found])
    assert np.abs(points[0] - points[1]).max() < 1e-7  # mm: two Newton solutions, each within its tolerance
    assert one[-1].energy.total == pytest.approx(two[-1].energy.total, rel=1e-10)

    responses = []
    for banded in (True, False):
        force_storage(monkeypatch, banded)
        system = formulation(model.formulation).system(model, load_steps(model)[0], None)
        q = one.records[0].q
        A = system.tangent(q, 0.0, system.evaluate(q, 0.0).forces).matrix
        b = np.random.default_rng(0).normal(size=system.size)
        b[system.primal :] = 0.0
        responses.append((dense(A, system.size), linear_response(system, q).dq[: system.primal], A @ b))
    # with multipliers the rounding of the penalty (gamma over the stiffness of a bending sheet) comes on top: 1.4e-9
    # with the band and 0.5e-9 with the sparse factor, against a solution in extended precision
    tolerance = 4e-9 if system.size > system.primal else 1e-10
    for x, y in zip(*responses, strict=True):
        assert np.abs(x - y).max() <= tolerance * np.abs(x).max()


@pytest.mark.parametrize("banded", [True, False])
def test_order_is_a_permutation(banded: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A scrambled numbering gives the same matrix in the user's order, whatever the order inside."""
    force_storage(monkeypatch, banded)
    system, q, lam = systems("supported, spring crease")[0]
    system = BarsAndHingesSystem(KINDS["supported, spring crease"], system.load_step, None)
    order = system._pattern.order
    assert np.array_equal(np.sort(order), np.arange(system.primal))
    assert not np.array_equal(order, np.arange(system.primal))
    A = dense(system.tangent(q, lam, system.evaluate(q, lam).forces).matrix, system.size)
    # column by column by differences: entries stand where the unknowns are
    h = 1e-5
    for i in (0, 1, 7, system.primal - 1):
        e = h * np.eye(system.size)[i]
        column = (system.evaluate(q + e, lam).residual - system.evaluate(q - e, lam).residual) / (2.0 * h)
        assert np.abs(column - A[:, i]).max() <= 1e-6 * np.abs(A).max()


# --------------------------------------------------------------------------------------- free bodies


@pytest.mark.parametrize("banded", [True, False])
@pytest.mark.parametrize("name", FREE)
def test_free_body_solves_the_singular_system(
    name: str, banded: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """For loads in equilibrium: K x = b exactly, and x has no rigid part; at the flat and at the folded state."""
    force_storage(monkeypatch, banded)
    model = KINDS[name]
    path = trace(model)
    system = system_of(path, 0)
    loaded = np.abs(system.force.end).max() > 0.0
    for record in (path.records[0], path.records[-1]):
        matrix = system.tangent(record.q, record.lam, system.evaluate(record.q, record.lam).forces).matrix
        if isinstance(matrix, MultiplierMatrix):
            matrix = matrix.augmented
        assert isinstance(matrix, FreeBodyMatrix)
        n, Z = system.primal, matrix.Z
        assert Z.shape == (n, 6)
        assert np.abs(Z.T @ Z - np.eye(6)).max() < 1e-13
        K = dense(matrix, n)
        if not loaded or record.lam == 0.0:  # dead loads stiffen against rotations
            assert np.abs(K @ Z).max() <= 1e-7 * np.abs(K).max()
            assert np.sum(np.abs(np.linalg.eigvalsh(K)) < 1e-9 * np.abs(K).max()) >= 6
        b = np.random.default_rng(1).normal(size=n)
        b -= Z @ (Z.T @ b)
        x = matrix.factorise().solve(b)
        assert np.abs(Z.T @ x).max() <= 1e-13 * np.linalg.norm(x)
        if not loaded or record.lam == 0.0:
            assert np.abs(K @ x - b).max() <= 1e-8 * np.abs(K).max() * np.abs(x).max()
            least = np.linalg.lstsq(K, b, rcond=1e-12)[0]
            assert np.abs(x - least).max() <= 1e-5 * np.abs(least).max()


def test_unbalanced_part_of_a_load_is_left_out() -> None:
    """What a free body cannot carry does not move it."""
    system, q, lam = systems("free, spring crease")[0]
    matrix = system.tangent(q, lam, system.evaluate(q, lam).forces).matrix
    push = np.tile([0.3, -1.0, 2.0], len(system.mesh.points))
    assert np.abs(matrix.factorise().solve(push)).max() < 1e-9


# --------------------------------------------------------------------------------------- multipliers


@pytest.mark.parametrize("name", PRESCRIBED)
def test_multipliers_solve_the_saddle(name: str) -> None:
    """Against a dense solve of [[K + gamma G^T G, G^T], [G, 0]]: constraints met, first row exact."""
    for system, q, lam in systems(name):
        if system.size == system.primal:
            continue
        matrix = system.tangent(q, lam, system.evaluate(q, lam).forces).matrix
        assert isinstance(matrix, MultiplierMatrix)
        n, A = system.primal, dense(matrix, system.size)
        assert A[n:, n:] == pytest.approx(-np.diag(matrix.compliance), abs=0.0)
        rng = np.random.default_rng(5)
        b = np.concatenate((np.zeros(n), 1e-3 * rng.normal(size=system.size - n)))
        b[:n] = A[:n] @ np.concatenate((1e-3 * rng.normal(size=n), 1e-2 * rng.normal(size=system.size - n)))
        if isinstance(matrix.augmented, FreeBodyMatrix):
            b[:n] -= matrix.augmented.Z @ (matrix.augmented.Z.T @ b[:n])
        x = matrix.factorise().solve(b)
        expected = np.linalg.lstsq(A, b, rcond=1e-13)[0]
        if isinstance(matrix.augmented, FreeBodyMatrix):
            expected[:n] -= matrix.augmented.Z @ (matrix.augmented.Z.T @ expected[:n])
        assert np.abs((A @ x - b)[n:]).max() <= 1e-6 * np.abs(b[n:]).max()
        assert np.abs((A @ x - b)[:n]).max() <= 1e-7 * np.abs(A).max() * np.abs(x[:n]).max()
        assert np.abs(x[:n] - expected[:n]).max() <= 2e-3 * np.abs(expected[:n]).max()  # inexact by design
        assert np.abs(x[n:] - expected[n:]).max() <= 1e-3 * np.abs(expected[n:]).max()


@pytest.mark.parametrize("name", PRESCRIBED)
def test_linear_response_is_exact_enough(name: str) -> None:
    """One solve that nobody corrects: against a dense solve, at the flat sheet and where the step ends."""
    path = solved(name)
    for index in (0, len(path) - 1):
        record = path.records[index]
        system = system_of(path, record.step)
        matrix = system.tangent(record.q, record.lam, system.evaluate(record.q, record.lam).forces).matrix
        rate = system.control_rate(record.q, record.lam)
        n, A = system.primal, dense(matrix, system.size)
        expected = np.linalg.lstsq(A, -rate, rcond=1e-13)[0]
        got = linear_response(system, record.q, record.lam).dq
        if isinstance(matrix, MultiplierMatrix) and isinstance(matrix.augmented, FreeBodyMatrix):
            expected[:n] -= matrix.augmented.Z @ (matrix.augmented.Z.T @ expected[:n])
        assert np.abs(got[:n] - expected[:n]).max() <= 1e-4 * np.abs(expected[:n]).max()
        assert rate @ got == pytest.approx(rate @ expected, rel=1e-4)


@pytest.mark.parametrize("force", [(0.0, 0.0, 1e-4), (1.0, 0.0, 0.0)])
def test_multipliers_without_a_gap(force: tuple[float, float, float]) -> None:
    """A prescribed crease that does not move: the iteration on the multipliers must come to an end."""
    model = clamped(sector()).step(Fold("crease", to=math.pi), Force("corner:outer-end", each=force))
    system = formulation(model.formulation).system(model, load_steps(model)[0], None)
    q = system.start()
    A = dense(system.tangent(q, 0.0, system.evaluate(q, 0.0).forces).matrix, system.size)
    rate = system.control_rate(q, 0.0)
    assert np.abs(rate[system.primal :]).max() == 0.0
    expected = np.linalg.solve(A, -rate)
    got = linear_response(system, q).dq
    assert np.isfinite(got).all()
    assert np.abs(got - expected)[: system.primal].max() <= 1e-7 * np.abs(expected[: system.primal]).max()
