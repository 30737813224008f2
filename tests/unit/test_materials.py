"""Materials of the consistent formulation.

A linear one in general form, a rubber, and a law of bending that is not linear.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh import Displace, Fold, Model, Sheet
from bh.errors import ModelError
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.materials import Constant, Law, LinearElastic
from bh.mechanics.consistent.formulation import Consistent
from bh.mechanics.consistent.system import ConsistentSystem
from bh.solvers.linear import linear_response
from verification.studies.solver.derivatives import differences, prediction_ratio
from verification.studies.solver.patch_tests import distorted

Array = NDArray[np.float64]
RUBBER = Sheet(E=3.0, nu=0.5, t=0.2)


@dataclass(frozen=True)
class NeoHooke:
    """Incompressible plane stress: mu t / 2 (tr C + 1 / det C - 3) with C = 1 + 2 E and mu = E / 3."""

    mu_t: float

    def _measure(self, strain: Array) -> tuple[Array, Array]:
        """det C (k,) and its gradient (k, 3)."""
        c1, c2, c3 = 1.0 + 2.0 * strain[:, 0], 1.0 + 2.0 * strain[:, 1], strain[:, 2]
        return c1 * c2 - c3**2, np.column_stack((2.0 * c2, 2.0 * c1, -2.0 * c3))

    def energy(self, strain: Array) -> Array:
        J, _ = self._measure(strain)
        return np.asarray(0.5 * self.mu_t * (2.0 * strain[:, 0] + 2.0 * strain[:, 1] + 1.0 / J - 1.0))

    def stress(self, strain: Array) -> Array:
        J, g = self._measure(strain)
        return np.asarray(0.5 * self.mu_t * (np.array([2.0, 2.0, 0.0]) - g / J[:, None] ** 2))

    def moduli(self, strain: Array) -> Array:
        J, g = self._measure(strain)
        H = np.array([[0.0, 4.0, 0.0], [4.0, 0.0, 0.0], [0.0, 0.0, -2.0]])
        twice = 2.0 * g[:, :, None] * g[:, None, :] / J[:, None, None] ** 3
        return np.asarray(0.5 * self.mu_t * (twice - H / J[:, None, None] ** 2))


class Rubber:
    """Stretches as a neo-Hookean sheet, bends as its small strains do."""

    def stretching(self, sheet: Sheet) -> Law:
        return NeoHooke(sheet.E * sheet.t / 3.0)

    def bending(self, sheet: Sheet) -> Law:
        return LinearElastic().bending(sheet)


@dataclass(frozen=True, eq=False)
class Stiffening:
    """q / 2 + b q^2 / 4 with q = e.C.e."""

    C: Array
    b: float

    def _measure(self, strain: Array) -> tuple[Array, Array]:
        m = strain @ self.C
        return np.einsum("ki,ki->k", m, strain), m

    def energy(self, strain: Array) -> Array:
        q, _ = self._measure(strain)
        return np.asarray(0.5 * q + 0.25 * self.b * q**2)

    def stress(self, strain: Array) -> Array:
        q, m = self._measure(strain)
        return np.asarray((1.0 + self.b * q)[:, None] * m)

    def moduli(self, strain: Array) -> Array:
        q, m = self._measure(strain)
        return np.asarray(
            (1.0 + self.b * q)[:, None, None] * self.C + 2.0 * self.b * m[:, :, None] * m[:, None, :]
        )


@dataclass(frozen=True)
class StiffeningBend:
    """Bends by `Stiffening`; b = 0 is the linear law in the general form."""

    b: float = 1.0
    also_stretching: bool = False

    def stretching(self, sheet: Sheet) -> Law:
        linear = LinearElastic().stretching(sheet)
        return Stiffening(linear.matrix, self.b) if self.also_stretching else linear

    def bending(self, sheet: Sheet) -> Law:
        return Stiffening(LinearElastic().bending(sheet).matrix, self.b)


def rubber() -> Consistent:
    return Consistent(material=Rubber())


def general() -> Consistent:
    """The linear material by the way of all others."""
    return Consistent(material=StiffeningBend(0.0, also_stretching=True))


def stiffening() -> Consistent:
    return Consistent(material=StiffeningBend(2e4))


def named(make: Callable[[], Consistent]) -> str:
    return f"{__name__}:{make.__name__}"


@pytest.fixture(autouse=True)
def importable(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, __name__, sys.modules[__name__])


# --------------------------------------------------------------------------------------- laws


@pytest.mark.parametrize(
    "law",
    [NeoHooke(2.0), Stiffening(np.diag([2.0, 3.0, 1.0]), 0.7), LinearElastic().stretching(RUBBER)],
    ids=["neo-Hooke", "stiffening", "linear"],
)
def test_laws_belong_to_their_derivatives(law: Law) -> None:
    strain = 0.1 * np.random.default_rng(1).normal(size=(7, 3))
    h = 1e-6
    for i, unit in enumerate(np.eye(3)):
        slope = (law.energy(strain + h * unit) - law.energy(strain - h * unit)) / (2.0 * h)
        np.testing.assert_allclose(slope, law.stress(strain)[:, i], atol=1e-8)
        rate = (law.stress(strain + h * unit) - law.stress(strain - h * unit)) / (2.0 * h)
        np.testing.assert_allclose(rate, law.moduli(strain)[:, :, i], atol=1e-7)


def test_small_strains_of_rubber_are_linear() -> None:
    np.testing.assert_allclose(
        NeoHooke(RUBBER.E * RUBBER.t / 3.0).moduli(np.zeros((1, 3)))[0],
        LinearElastic().stretching(RUBBER).matrix,
        atol=1e-14,
    )


# --------------------------------------------------------------------------------------- systems


def folded(make: Callable[[], Consistent], sheet: Sheet, **how: object) -> Model:
    mesh = meshes.structured(meshes.annulus_sector(40.0, 8.0, 0.6), along=6, rows=2, **how)  # type: ignore[arg-type]
    return Model(mesh, sheet, formulation=named(make))


@pytest.mark.parametrize("make", [rubber, general, stiffening])
@pytest.mark.parametrize("kind", ["held", "spring", "clamped"])
def test_derivatives(make: Callable[[], Consistent], kind: str) -> None:
    """Residual, tangent, rates with lambda and predicted forces against differences, away from equilibrium."""
    model = folded(make, RUBBER)
    if kind == "held":
        model = model.fold("crease", to=2.5)
    elif kind == "spring":
        model = (
            model.support("edge:start", "xyz")
            .support("corner:inner-end", "z")
            .fold("crease", rest=2.3, Lstar=8.0)
        )
    else:
        model = model.support("edge:start", [[0.0, 0.3, 1.0]], clamp=True).support(
            "corner:inner-start", "xyz"
        )
        model = model.step(Fold("crease", to=2.6), Displace("corner:outer-end", (1.0, 1.0, 0.0), 0.4))
    system = formulation(model.formulation).system(model, load_steps(model)[0], None)
    assert isinstance(system, ConsistentSystem)
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        q = system.start()
        q[: system.moving] += 0.1 * rng.normal(size=system.moving)
        q[system.moving :] += 0.05 * rng.normal(size=system.size - system.moving)
        assert max(differences(system, q, 0.37, rng).values()) < 1e-7
        assert prediction_ratio(system, q, 0.37) == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("kind", ["staggered", "alternating"])
def test_linear_law_is_the_same_either_way(kind: str) -> None:
    """Constants with condensed rotations, and a law that is asked at every state with all rotations kept."""
    models = [
        replace(folded(general, RUBBER, kind=kind), formulation=name)
        for name in (named(general), "consistent")
    ]
    paths = [bh.trace(model.fold("crease", to=2.2)) for model in models]
    assert paths[0].outcome == paths[1].outcome == "reached"
    assert paths[0].unknowns > paths[1].unknowns
    one, two = (path[-1] for path in paths)
    for part in ("stretching", "bending"):
        assert getattr(one.energy, part) == pytest.approx(getattr(two.energy, part), rel=1e-8)
        np.testing.assert_allclose(
            one.energy_density[part], two.energy_density[part], rtol=1e-5, atol=1e-9 * two.energy.total
        )
    np.testing.assert_allclose(one.crease_moments, two.crease_moments, rtol=1e-6)


def test_halves() -> None:
    model = folded(stiffening, RUBBER).fold("crease", to=2.2)
    whole, half = bh.trace(model), bh.trace(model, symmetry="y")
    assert half[-1].energy.total == pytest.approx(whole[-1].energy.total, rel=1e-8)
    assert half.outcome == "reached"


@pytest.mark.parametrize("stretch", [0.8, 1.3, 2.0])
def test_uniaxial_stretch(stretch: float) -> None:
    """Energy and force of a strip of rubber in any stretch: W = mu t / 2 (l^2 + 2 / l - 3)."""
    mesh = distorted("staggered", 1)
    model = Model(mesh, RUBBER, formulation=named(rubber)).support("all", "z").support("edge:start", "x")
    model = model.support("corner:inner-start", "y").displace("edge:end", "x", 3.0 * (stretch - 1.0))
    path = bh.trace(model)
    assert path.outcome == "reached"
    state, mu_t = path[-1], RUBBER.E * RUBBER.t / 3.0
    exact = 0.5 * mu_t * (stretch**2 + 2.0 / stretch - 3.0) * 6.0
    assert state.energy.stretching == pytest.approx(exact, rel=1e-9)
    assert state.energy_density["stretching"] == pytest.approx(
        np.full(len(mesh.triangles), exact / 6.0), rel=1e-7
    )
    force = mu_t * (stretch - 1.0 / stretch**2) * 2.0
    assert state.reaction("edge:end")[0] == pytest.approx(force, rel=1e-7)
    assert np.ptp(state.points[:, 1]) == pytest.approx(2.0 / math.sqrt(stretch), rel=1e-8)


def test_small_strains_are_the_linear_sheet() -> None:
    """One response of a sheet of rubber to a small load is that of the linear one."""
    models = [folded(rubber, RUBBER), replace(folded(rubber, RUBBER), formulation="consistent")]
    energies = []
    for model in models:
        held = (
            model.support("edge:start", "xyz")
            .support("corner:inner-end", "z")
            .force("edge:end", total=(1e-6, 2e-6, 1e-6))
        )
        system = formulation(held.formulation).system(held, load_steps(held)[0], None)
        energies.append(linear_response(system, system.start()).energy)
    assert energies[0] == pytest.approx(energies[1], rel=1e-10)


def test_bending_that_stiffens() -> None:
    """A strip rolled up to a uniform curvature k, away from its ends: q / 2 + b q^2 / 4 an area with q = D k^2."""
    length, curvature, sheet = 10.0, 0.1, replace(RUBBER, nu=0.0)
    mesh = meshes.structured(meshes.strip(length, 1.0), along=40, rows=1)
    model = Model(mesh, sheet, formulation=named(stiffening)).force("edge:end", each=(0.0, 0.0, 0.0))
    angle = curvature * mesh.points[:, 0]
    arc = np.column_stack((np.sin(angle), curvature * mesh.points[:, 1], 1.0 - np.cos(angle))) / curvature
    system = formulation(model.formulation).system(model, load_steps(model)[0], None)
    assert isinstance(system, ConsistentSystem)
    found = system.internal(arc, system.rotations_at(arc, 0.0), 0.0)
    assert np.abs(found.r).max() < 1e-10 * np.abs(found.forces).max()
    density = system.bending_by_triangle(found.theta) / mesh.areas
    centre = mesh.points[mesh.triangles].mean(axis=1)[:, 0]
    inside = (centre > 3.0) & (centre < 7.0)
    q, b = sheet.bending_stiffness() * curvature**2, 2e4
    assert b * q > 0.3
    assert density[inside] == pytest.approx(np.full(inside.sum(), 0.5 * q + 0.25 * b * q**2), rel=0.01)


def test_sensitivities_are_of_linear_materials() -> None:
    path = bh.trace(folded(rubber, RUBBER).fold("crease", to=2.5))
    with pytest.raises(ModelError, match="linear materials"):
        bh.sensitivities.of(path, lambda d: path.model, [1.0], [bh.sensitivities.Energy()])


def test_constant_law_is_told_by_its_type() -> None:
    """What is a `Constant` is assembled from constants; its moduli are those of every strain."""
    law = LinearElastic().stretching(RUBBER)
    assert isinstance(law, Constant)
    assert law.moduli(np.zeros((2, 3))).shape == (2, 3, 3)
