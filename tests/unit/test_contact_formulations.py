"""Contact in every formulation: energy and its derivatives, reactions in balance, stability, nothing passed through."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh.analysis.contact import first_contact
from bh.solvers.modes import count_negative

FORMULATIONS = ("consistent", "bars-and-hinges", "linear-shell", "shell")
GAP = 0.1


@lru_cache(maxsize=8)
def pressed(name: str) -> bh.Path:
    """Three panels whose outer ones fold onto the middle one, which is held at its ends, until they press."""
    mesh = meshes.structured(meshes.strip(10.0, 60.0, creases=[20.0, 40.0]), along=3, rows=2)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), formulation=name, contact=GAP)
    for crease, fix in (("crease-1", "xyz"), ("crease-2", "xyz")):
        model = model.support(f"crease:{crease}", fix)
    return bh.trace(
        model.step(
            *(bh.Fold(crease, by=by, Lstar=5.0) for crease, by in zip(mesh.creases, (2.5, 2.2), strict=True))
        ),
        warn=False,
    )


@pytest.mark.parametrize("name", FORMULATIONS)
def test_panels_press_and_nothing_passes_through(name: str) -> None:
    path = pressed(name)
    assert path.outcome == "reached", path.reason
    assert 0.0 < path[-1].energy.contact < 0.01 * path[-1].energy.total
    assert path[-1].energy.total == pytest.approx(
        sum((path[-1].energy.stretching, path[-1].energy.bending, path[-1].energy.folding))
    )
    assert first_contact(path) is None


@pytest.mark.parametrize("name", FORMULATIONS)
def test_residual_and_tangent_are_derivatives_of_the_energy(name: str) -> None:
    """What contact adds to them, as that is small beside what stretching does."""
    path = pressed(name)
    system: Any
    system, _ = path.solved()
    q = path.records[-1].q
    v, h = np.random.default_rng(5).normal(size=system.size), 1e-6
    if name == "bars-and-hinges":
        v[system.moving :] = 0.0
    assert system.pressing(q, 1.0)
    forces = system.evaluate(q, 1.0).forces

    def added(at: np.ndarray) -> tuple[float, np.ndarray]:
        now = system.evaluate(at, 1.0)
        with system.unhindered():
            free = system.evaluate(at, 1.0)
        return now.energy - free.energy, now.residual - free.residual

    (_, residual), (above, plus), (below, minus) = (added(q + k * h * v) for k in (0.0, 1.0, -1.0))
    assert (above - below) / (2.0 * h) == pytest.approx(residual @ v, rel=1e-4)
    product = system.tangent(q, 1.0, forces).matrix @ v
    with system.unhindered():
        product -= system.tangent(q, 1.0, forces).matrix @ v
    difference = (plus - minus) / (2.0 * h)
    assert np.abs(difference).max() > 0.0
    assert product == pytest.approx(difference, rel=1e-3, abs=1e-4 * np.abs(difference).max())


@pytest.mark.parametrize("name", FORMULATIONS)
def test_reactions_are_in_balance_while_panels_press(name: str) -> None:
    """No load: supports and panels in contact are all there is, and the latter push and pull nothing as a whole."""
    state = pressed(name)[-1]
    force = state.reactions
    size = np.abs(force).sum()
    assert size > 1e-3
    assert force.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-6 * size)
    moment = np.cross(state.points, force).sum(axis=0)
    assert moment == pytest.approx(np.zeros(3), abs=1e-5 * size * 20.0)


@pytest.mark.parametrize("name", FORMULATIONS)
def test_negative_modes_are_those_of_the_hessian_with_contact(name: str) -> None:
    path = pressed(name)
    system: Any
    system, _ = path.solved()
    q = path.records[-1].q
    matrix = system.tangent(q, 1.0, system.evaluate(q, 1.0).forces).matrix
    dense = np.column_stack([matrix @ unit for unit in np.eye(system.size)])
    assert dense == pytest.approx(dense.T, abs=1e-9 * np.abs(dense).max())
    assert count_negative(matrix) == int(
        (np.linalg.eigvalsh(dense[: system.primal, : system.primal]) < 0.0).sum()
    )
    assert path[-1].stable == (count_negative(matrix) == 0)
    with system.unhindered():  # the barrier stiffens the sheet where panels press
        free = system.tangent(q, 1.0, system.evaluate(q, 1.0).forces).matrix
        without = np.column_stack([free @ unit for unit in np.eye(system.size)])
    stiffer = np.linalg.eigvalsh(dense - without)
    assert stiffer.max() > 0.0
    assert stiffer.max() > 10.0 * abs(stiffer.min())


def test_the_linear_shell_is_the_consistent_formulation_with_contact_too() -> None:
    one, other = pressed("consistent")[-1], pressed("linear-shell")[-1]
    assert one.energy.total == pytest.approx(other.energy.total, rel=1e-3)
    assert one.points == pytest.approx(other.points, abs=0.02)


def test_a_shell_with_friction_is_refused() -> None:
    model = replace(pressed("linear-shell").model, friction=0.3)
    with pytest.raises(bh.ModelError, match="the shell knows no friction"):
        bh.trace(model)


@pytest.mark.slow
def test_a_letter_by_the_shell_slips_where_its_edges_meet_head_on_and_goes_on() -> None:
    """Both outer panels fold alike; it stalled at 0.878, where ways were looked for from a state long before."""
    mesh = meshes.structured(meshes.strip(10.0, 60.0, creases=[20.0, 40.0]), along=3, rows=6)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), formulation="shell", contact="auto")
    path = bh.trace(model.step(*(bh.Fold(c, by=2.4, Lstar=5.0) for c in mesh.creases)), warn=False)
    assert path.reached, path.reason
    assert first_contact(path) is None
    assert path[-1].energy.contact > 0.0
    assert sum(record.iterations for record in path.records) < 400  # 859 to where it stalled
