"""The shell's system: derivatives, rigid motions, frames, patch tests, creases, and what it refuses."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import bh
import meshes
from bh.loading.builder import load_steps
from bh.model.model import Model
from bh.model.sheet import Sheet
from fem import system as system_module
from fem.assembly import build_pattern
from fem.kirchhoff_love import LinearShell, Shell
from fem.rigid import free_rigid_motions
from fem.shell import carried_frames, first_frames, shell_elements
from fem.state import ShellState
from fem.system import ShellSystem
from meshes import SheetMesh
from meshes.curved import lift
from verification.studies.solver.patch_tests import strain_energy_density
from verification.theory.shell_benchmarks import rectangle

PATCHES = (
    Sheet(E=10.0, nu=0.3, t=0.5),
    Sheet.orthotropic(E1=10.0, E2=4.0, G12=2.5, nu12=0.4, grain=0.5, t=0.5),
)
MYLAR = Sheet(E=4000.0, nu=0.38, t=0.127)
SECTOR = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.6), along=5, rows=2, kind="mirrored")


def distorted(mesh: SheetMesh, amount: float = 0.25) -> SheetMesh:
    """Inner nodes moved at random; the boundary and what lies on a curve kept."""
    moved = np.setdiff1d(np.arange(len(mesh.points)), mesh.topology.boundary)
    for name in mesh.curves:
        moved = np.setdiff1d(moved, mesh.edge_sets[name])
    points = mesh.points.copy()
    size = math.sqrt(mesh.areas.min())
    points[moved, :2] += amount * size * np.random.default_rng(3).uniform(-1, 1, (len(moved), 2))
    return replace(mesh, points=points)


def system_of(model: Model, shell: type[Shell] = Shell) -> ShellSystem:
    return shell().system(model, load_steps(model)[0], None)


def held() -> Model:
    model = Model(SECTOR, MYLAR, formulation="shell")
    model = model.support("corner:inner-start", "xyz").support("corner:outer-start", "yz")
    return model.support("edge:inner", "z").support("edge:outer", [[0.0, 0.1, 1.0]])


CASES = {
    "imposed angle": held().fold("crease", to=2.0),
    "spring and its rest angle": held().crease("crease", stiffness=0.02, rest=2.5).fold("crease", rest=2.0),
    "moment": held().crease("crease", stiffness=0.01).moment("crease", to=0.02),
    "force": held().crease("crease", stiffness=0.0).force("crease:crease", total=(0.0, 0.1, 0.2)),
    "moved support": held().displace("corner:outer-end", [1.0, 1.0, 0.5], 0.7),
    "free sheet": Model(SECTOR, MYLAR, formulation="shell").fold("crease", to=2.0),
}


@pytest.mark.parametrize("shell", [Shell, LinearShell])
@pytest.mark.parametrize("name", CASES)
def test_derivatives(name: str, shell: type[Shell]) -> None:
    """Residual, tangent, rate and power against central differences at a state far from equilibrium."""
    system = system_of(CASES[name], shell)
    random = np.random.default_rng(1)
    q = system.start() + 0.3 * random.normal(size=system.size)
    v, lam, h = random.normal(size=system.size), 0.4, 1e-6
    here = system.evaluate(q, lam)
    ahead, behind = system.evaluate(q + h * v, lam), system.evaluate(q - h * v, lam)
    assert here.residual @ v == pytest.approx((ahead.energy - behind.energy) / (2 * h), rel=1e-6)
    change = (ahead.residual - behind.residual) / (2 * h)
    product = system.tangent(q, lam, here.forces).matrix @ v
    np.testing.assert_allclose(product, change, atol=1e-7 * np.abs(change).max())
    h = 1e-4
    later, earlier = system.evaluate(q, lam + h), system.evaluate(q, lam - h)
    rate = (later.residual - earlier.residual) / (2 * h)
    np.testing.assert_allclose(system.control_rate(q, lam), rate, atol=1e-6 * max(np.abs(rate).max(), 1e-3))
    power = (later.energy - earlier.energy) / (2 * h)
    assert system.power(q, lam) == pytest.approx(power, rel=1e-6, abs=1e-7 * abs(here.energy))
    h = 1e-3
    second = system.power(q, lam + h) - system.power(q, lam - h)
    assert system.control_stiffness(q, lam) == pytest.approx(second / (2 * h), rel=1e-4, abs=1e-6)


def test_predicted_forces_are_those_of_the_linearised_measures() -> None:
    system = system_of(CASES["imposed angle"])
    random = np.random.default_rng(2)
    q, v, h = 0.1 * random.normal(size=system.size), random.normal(size=system.size), 1e-6
    ahead, behind = system.evaluate(q + h * v, 0.5).forces, system.evaluate(q - h * v, 0.5).forces
    now = system.evaluate(q, 0.5)
    tangent = system.tangent(q, 0.5, now.forces)
    system.evaluate(2.0 * q, 0.5)  # a tangent belongs to its state, whatever is asked of the system then
    change = tangent.predicted_forces(now.forces, v) - now.forces
    np.testing.assert_allclose(change, (ahead - behind) / (2 * h), atol=1e-6 * np.abs(change).max())


def rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]]) / np.linalg.norm(
        axis
    )
    return np.asarray(np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k)


@pytest.mark.parametrize("angle", [0.5, 2.0])
def test_rigid_motion_stores_nothing(angle: float) -> None:
    """A turned and shifted sheet; edge rotations are what makes curvatures vanish (they enter linearly)."""
    elements = shell_elements(lift(distorted(SECTOR)), MYLAR)
    R = rotation(np.array([1.0, 2.0, 0.5]), angle)
    x = elements.mesh.nodes @ R.T + [3.0, -2.0, 5.0]
    frames = first_frames(elements.mesh)
    still = np.zeros((len(elements.areas), 3, 2))
    strain, curvature = elements.measures(x, still, frames)
    B = elements.gradients(x, frames)
    gamma = np.zeros_like(still)
    for j in range(3):
        block = B[:, 9 + 3 * j : 11 + 3 * j, 18 + 2 * j : 20 + 2 * j]
        gamma[:, j] = -np.linalg.solve(block, curvature[:, 3 * j : 3 * j + 2, None])[..., 0]
    assert np.abs(gamma).max() > 0.3
    strain, curvature = elements.measures(x, gamma, frames)
    forces = elements.forces(strain, curvature)
    bent, _ = elements.measures(1.001 * elements.mesh.nodes, still, frames)
    assert np.abs(strain).max() < 1e-10 * np.abs(bent).max()
    assert np.abs(forces[:, 9:]).max() < 1e-10 * MYLAR.bending_stiffness()


def test_carried_frames_change_nothing() -> None:
    """Measures at any state are the same with frames that went along, and alpha then is zero."""
    system = system_of(CASES["force"])
    q = 0.3 * np.random.default_rng(4).normal(size=system.size)
    here = system.at(q, 0.2)
    c, e = system.components, system.elements
    frames = carried_frames(e.mesh, system.frames, here.x, c.alpha(here.components))
    again = here.components.copy()
    again[c.first_alpha : c.first_beta] = 0.0
    gamma = c.gather(again)[:, 18:].reshape(-1, 3, 2)
    forces = e.forces(*e.measures(here.x, gamma, frames))
    np.testing.assert_allclose(forces, here.forces, atol=1e-9 * np.abs(here.forces).max())
    assert np.abs(c.alpha(here.components)).max() > 0.5


@pytest.mark.parametrize("sheet", PATCHES)
def test_membrane_patch(sheet: Sheet) -> None:
    """A homogeneous deformation has the energy of its constant Green strain: exactly in straight triangles, whose
    pulled-back strain is constant, and nearly in those with a curved edge."""
    elements = shell_elements(lift(distorted(SECTOR)), sheet)
    A = np.array([[1.1, 0.05], [-0.1, 0.9], [0.3, 0.2]])
    x = elements.mesh.nodes[:, :2] @ A.T
    strain, _ = elements.measures(x, np.zeros((len(elements.areas), 3, 2)), first_frames(elements.mesh))
    green = 0.5 * (A.T @ A - np.eye(2))
    density = strain_energy_density(sheet, green)
    energy = 0.5 * np.einsum("tk,tkl,tl->t", strain, elements.membrane, strain)
    np.testing.assert_allclose(energy, density * elements.areas, rtol=3e-4)
    straight = (
        np.abs(
            elements.loops.inside / elements.loops.inside[:, :1]
            - elements.tables.weights / elements.tables.weights[0]
        ).max(axis=1)
        < 1e-12
    )
    assert 0 < straight.sum() < len(straight)
    np.testing.assert_allclose(energy[straight], (density * elements.areas)[straight], rtol=1e-12)


@pytest.mark.parametrize("sheet", PATCHES)
def test_bending_patch(sheet: Sheet) -> None:
    """Small quadratic deflections of a distorted mesh have the energy of their constant curvature, exactly."""
    mesh = distorted(rectangle(4.0, 3.0, 4, 3))
    elements = shell_elements(lift(mesh), sheet)
    x, size = elements.mesh.nodes.copy(), 1e-6
    H = size * np.array([[1.0, 0.4], [0.4, -0.6]])
    x[:, 2] = 0.5 * np.einsum("na,ab,nb->n", x[:, :2], H, x[:, :2])
    # rotation of each edge about its tangent: slope of w toward the right-hand side of the edge
    ends = mesh.points[mesh.topology.edges, :2]
    tangent = ends[:, 1] - ends[:, 0]
    right = np.column_stack((tangent[:, 1], -tangent[:, 0])) / np.linalg.norm(tangent, axis=1)[:, None]
    alpha = np.einsum("ea,ab,ekb->ek", right, H, ends)
    gamma = alpha[elements.loops.edges] * elements.loops.sides[..., None]
    gamma = np.where(elements.loops.sides[..., None] > 0, gamma, gamma[..., ::-1])
    _, curvature = elements.measures(x, gamma, first_frames(elements.mesh))
    energy = 0.5 * np.einsum("tk,tkl,tl->t", curvature, elements.bending, curvature)
    density = sheet.t**2 / 12.0 * strain_energy_density(sheet, H)
    np.testing.assert_allclose(energy, density * elements.areas, rtol=1e-6)


def test_moments_and_membrane_forces_of_constant_states() -> None:
    """A strip pulled at its end (nu > 0): N_xx is the load a length, all else vanishes."""
    mesh = distorted(rectangle(4.0, 1.0, 6, 2))
    model = Model(mesh, Sheet(E=1000.0, nu=0.3, t=0.1), formulation="shell")
    model = model.support("edge:start", "x").support("node:0", "y").support("all", "z")
    model = model.force("edge:end", total=(0.01, 0.0, 0.0))
    path = bh.trace(model)
    assert path.outcome == "reached"
    last = path[-1]
    assert isinstance(last, ShellState)
    expected = np.tile([0.01, 0.0, 0.0], (len(mesh.triangles), 1))
    np.testing.assert_allclose(last.membrane_forces, expected, atol=2e-5)
    assert path[-1].reaction("edge:start")[0] == pytest.approx(-0.01, rel=1e-6)


@pytest.mark.parametrize("formulation", ["band", "sparse"])
def test_both_patterns_hold_the_same_matrix(formulation: str, monkeypatch: pytest.MonkeyPatch) -> None:
    system = system_of(CASES["spring and its rest angle"])
    q = 0.1 * np.random.default_rng(5).normal(size=system.size)
    now = system.evaluate(q, 0.3)
    expected = system.tangent(q, 0.3, now.forces).matrix
    other = system_of(CASES["spring and its rest angle"])
    monkeypatch.setattr(system_module, "build_pattern", partial(build_pattern, banded=formulation == "band"))
    matrix = other.tangent(q, 0.3, other.evaluate(q, 0.3).forces).matrix
    assert other._pattern.banded == (formulation == "band")
    v = np.random.default_rng(6).normal(size=system.size)
    np.testing.assert_allclose(matrix @ v, expected @ v, atol=1e-9 * np.abs(expected @ v).max())
    flat = other.tangent(other.start(), 0.0, np.zeros_like(now.forces)).matrix
    np.testing.assert_allclose(flat @ flat.factorise().solve(v), v, atol=1e-6)


@pytest.mark.parametrize("shell", [Shell, LinearShell])
def test_rigid_motions_change_no_measure_of_a_bent_sheet(shell: type[Shell]) -> None:
    """The closed form for the edges' rotations, against the gradients of what elements measure."""
    system = system_of(Model(SECTOR, MYLAR, formulation=shell.name).fold("crease", by=1.0), shell)
    q = system.start() + 0.3 * np.random.default_rng(1).normal(size=system.size)
    here = system.at(q, 0.5)
    Z = free_rigid_motions(system.components, system.elements, system.frames, here.x)
    assert np.allclose(Z.T @ Z, np.eye(6), rtol=0.0, atol=1e-14)
    for motion in Z.T:
        whole = np.zeros(len(system.components.number))
        whole[system.components.free] = motion
        rate = np.einsum("tkj,tj->tk", here.B, system.components.gather(whole))
        assert np.abs(rate).max() < 1e-13 * np.abs(here.B).max()
