"""Laminates: A, B, D by hand, sandwiches, coupling in both formulations, heat, derivatives, bad input."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh import Expand, Model, ModelError, Sheet
from bh.loading.builder import load_steps
from bh.mechanics.consistent.formulation import Consistent
from bh.model.laminate import free_shape, matrices
from bh.model.serialise import describe, fingerprint, rebuild
from bh.scene.load import parse_scene
from fem.kirchhoff_love import Shell
from fem.sections import matrices as shell_matrices
from meshes import SheetMesh
from verification.studies.solver.derivatives import differences, prediction_ratio

KINDS: dict[str, Any] = {"consistent": "staggered", "shell": "mirrored"}
FIBRE: dict[str, Any] = {"E1": 130000.0, "E2": 9000.0, "G12": 5000.0, "nu12": 0.3, "expansion": [-1e-7, 3e-5]}


def ply(degrees: float, t: float = 0.125) -> Sheet:
    return Sheet.orthotropic(**FIBRE, grain=f"{degrees}deg", t=t)


CROSS = bh.laminate([ply(0), ply(90)])
STEEL = Sheet(E=200000.0, nu=0.3, t=0.1, expansion=1.2e-5)
BRASS = Sheet(E=100000.0, nu=0.3, t=0.2, expansion=1.9e-5)


def strip(name: str, along: int = 16, rows: int = 2) -> SheetMesh:
    return meshes.structured(meshes.strip(40.0, 10.0), along=along, rows=rows, kind=KINDS[name])


def timoshenko(change: float) -> float:
    """Curvature of a narrow bimetal strip, 1 / mm (Timoshenko 1925, Eq. 4), plies at the bottom and the top."""
    m, n = STEEL.t / BRASS.t, STEEL.E / BRASS.E
    h = STEEL.t + BRASS.t
    assert isinstance(BRASS.expansion, float)
    assert isinstance(STEEL.expansion, float)
    k = 6.0 * (BRASS.expansion - STEEL.expansion) * change * (1.0 + m) ** 2
    return k / (h * (3.0 * (1.0 + m) ** 2 + (1.0 + m * n) * (m**2 + 1.0 / (m * n))))


# ------------------------------------------------------------------------------------------ matrices


def test_matrices_by_hand() -> None:
    """[0/90] of two plies t: A11 = t (Q11 + Q22), B11 = t^2 (Q22 - Q11) / 2, D11 = t^3 (Q11 + Q22) / 3."""
    t = 0.125
    scale = 1.0 - 0.09 * 9000.0 / 130000.0
    Q11, Q22 = 130000.0 / scale, 9000.0 / scale
    assert CROSS.plies is not None
    A, B, D = matrices(CROSS.plies)
    assert B is not None
    assert A[0, 0] == pytest.approx(t * (Q11 + Q22))
    assert B[0, 0] == pytest.approx(t**2 / 2.0 * (Q22 - Q11))
    assert B[1, 1] == pytest.approx(-B[0, 0])
    assert D[0, 0] == pytest.approx(t**3 / 3.0 * (Q11 + Q22))
    assert matrices([ply(0), ply(90), ply(90), ply(0)])[1] is None


@pytest.mark.parametrize("angles", [(0, 90), (30, -30), (0, 45, -45, 90), (20,)])
def test_the_shell_has_the_same_matrices(angles: tuple[float, ...]) -> None:
    """Two independent codes of lamination theory."""
    sheet = bh.laminate([ply(angle, 0.1 + 0.01 * k) for k, angle in enumerate(angles)])
    assert sheet.plies is not None
    A, B, D = matrices(sheet.plies)
    found = shell_matrices((sheet,))
    np.testing.assert_allclose(found.A[0], A, atol=1e-10 * A.max())
    np.testing.assert_allclose(found.D[0], D, atol=1e-10 * D.max())
    assert (B is None) == (found.B is None)
    if B is not None and found.B is not None:
        np.testing.assert_allclose(found.B[0], B, atol=1e-9 * np.abs(B).max())


def test_a_laminate_of_one_material_is_a_sheet() -> None:
    plain = Sheet(E=4000.0, nu=0.3, t=0.3)
    three = bh.laminate([replace(plain, t=0.1)] * 3)
    assert (three.E, three.nu, three.t) == pytest.approx((4000.0, 0.3, 0.3))
    found = []
    for name in ("consistent", "shell"):
        mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.6), along=6, rows=2, kind=KINDS[name])
        pair = [bh.trace(Model(mesh, s, formulation=name).fold("crease", by=0.8)) for s in (plain, three)]
        found.append([path[-1].energy.total for path in pair])
    for one, other in found:
        assert other == pytest.approx(one, rel=1e-9)


# ------------------------------------------------------------------------------------------ coupling


@pytest.mark.parametrize(
    ("name", "angles"),
    [
        ("consistent", (0, 90)),
        ("consistent", (30, -30)),
        ("shell", (0, 90)),
        ("shell", (30, -30)),
    ],
)
def test_a_pulled_laminate_bends_and_twists(name: str, angles: tuple[float, float]) -> None:
    """A small pull on a free sheet: e and k of [[A, -B], [-B, D]]^-1 (N, 0), everywhere, on any mesh."""
    sheet = bh.laminate([ply(angle) for angle in angles])
    assert sheet.plies is not None
    A, B, D = matrices(sheet.plies)
    assert B is not None
    pull = 1e-5
    both = np.linalg.solve(np.block([[A, -B], [-B, D]]), [pull, 0.0, 0.0, 0.0, 0.0, 0.0])
    # given as what its plies would want; the balance of the whole is that of the pull
    mesh = strip(name, 8, 2)
    wanted = Expand(by=tuple(both[:3].tolist()), through=tuple(both[3:].tolist()), axes=0.0)
    path = bh.trace(Model(mesh, sheet, formulation=name).step(wanted))
    assert path.iterations <= 10  # rounded strains turn edges, too: 1732 where that is not known
    state = path[-1]
    stress = state.stress()
    np.testing.assert_allclose(
        stress.curvature, [both[3:]] * len(mesh.triangles), atol=2e-3 * np.abs(both[3:]).max()
    )
    assert np.abs(stress.forces).max() < 2e-3 * pull
    model = (
        Model(mesh, sheet, formulation=name).support("edge:start", "x").support("corner:inner-start", "yz")
    )
    model = model.support("corner:outer-start", "z").support("corner:inner-end", "z")
    path = bh.trace(model.force("edge:end", total=(pull * 10.0, 0.0, 0.0)))
    middle = np.abs(mesh.points[mesh.triangles].mean(axis=1)[:, 0] - 20.0) < 8.0
    found = path[-1].stress().curvature[middle].mean(axis=0)
    np.testing.assert_allclose(found, both[3:], atol=0.05 * np.abs(both[3:]).max())


@pytest.mark.parametrize("made", [Consistent, Shell])
def test_derivatives(made: Any) -> None:
    """Residual, tangent, rates with lambda and predicted forces against differences, away from equilibrium."""
    name = "consistent" if made is Consistent else "shell"
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.6), along=3, rows=1, kind=KINDS[name])
    model = Model(mesh, bh.laminate([ply(20), ply(-70, 0.2)]), formulation=name)
    model = model.zone("face:105,5", Sheet(E=4000.0, nu=0.3, t=0.2, expansion=1e-3))
    model = model.support("edge:start", "xyz", clamp=True).crease("crease", Lstar=8.0)
    model = model.support([int(mesh.nodes("corner:outer-end")[0])], [[0.6, 0.8, 0.0]])
    model = model.step(Expand(by=[0.002, 0.001, 0.003], through=0.01))
    model = model.step(Expand(change=4.0), bh.Displace("corner:inner-end", "z", 1.0))
    system = made().system(model, load_steps(model)[1], None)
    rng = np.random.default_rng(3)
    q = system.start()
    moving = getattr(system, "moving", system.size)
    q[:moving] += 0.02 * rng.normal(size=moving)
    assert max(differences(system, q, 0.37, rng).values()) < 1e-6
    assert prediction_ratio(system, q, 0.37) == pytest.approx(4.0, rel=0.2)


def test_both_formulations() -> None:
    """A folded sector of an unsymmetric laminate: energies to 2 %; without its coupling they would differ by more."""
    found = []
    for name, along, rows in (("consistent", 24, 4), ("shell", 12, 2)):
        mesh = meshes.structured(
            meshes.annulus_sector(100.0, 10.0, 0.6), along=along, rows=rows, kind=KINDS[name]
        )
        sheet = bh.laminate([ply(10, 0.05), ply(-60, 0.05)])
        found.append(bh.trace(Model(mesh, sheet, formulation=name).fold("crease", by=1.0))[-1].energy.total)
    assert found[0] == pytest.approx(found[1], rel=0.02)


# ------------------------------------------------------------------------------------------ heat


@pytest.mark.parametrize("name", ["consistent", "shell"])
def test_heated_bimetal(name: str) -> None:
    """A narrow strip of steel below brass (Timoshenko 1925): the ends go down, and nothing else is stored."""
    sheet = bh.laminate([STEEL, BRASS])
    state = bh.trace(Model(strip(name), sheet, formulation=name).step(Expand(change=100.0)))[-1]
    curvature = state.stress().curvature
    # alike in both directions, a plate has the strip's curvature: nu is that of both metals
    np.testing.assert_allclose(curvature[:, 0].mean(), -timoshenko(100.0), rtol=0.02)
    assert state.points[:, 2].mean() > state.points[state.mesh.nodes("edge:end"), 2].mean()


@pytest.mark.parametrize("name", ["consistent", "shell"])
def test_heated_cross_ply(name: str) -> None:
    """[0/90] under heat: a small square has k_x = -k_y of lamination theory (Jones 1999, 4.4)."""
    assert CROSS.plies is not None
    change = 1.0
    wanted = free_shape(CROSS.plies, [np.array([-1e-7, 3e-5, 0.0]), np.array([3e-5, -1e-7, 0.0])])[1]
    assert wanted[0] == pytest.approx(-wanted[1])
    mesh = meshes.structured(meshes.strip(10.0, 10.0), along=6, rows=6, kind=KINDS[name])
    state = bh.trace(Model(mesh, CROSS, formulation=name).step(Expand(change=change)))[-1]
    np.testing.assert_allclose(state.stress().curvature.mean(axis=0)[:2], wanted[:2], rtol=2e-3)
    assert state.energy.total < 1e-6 * 0.5 * 1e4 * 100.0 * float(wanted @ wanted)


# ------------------------------------------------------------------------------------------ as data

SCENE = """
[pattern]
kind = "strip"
length = 40.0
width = 10.0
[mesh]
along = 8
[sheet]
plies = [{plies}]
{sheet}
[[steps]]
expand = {{ change = 10 }}
"""
ONE = '{ E = "200GPa", nu = 0.3, t = 0.1, expansion = 1.2e-5 }'
TWO = '{ E = "100GPa", nu = 0.3, t = 0.2, expansion = 1.9e-5 }'


def test_scene_and_path_file() -> None:
    model = parse_scene(SCENE.format(plies=f"{ONE}, {TWO}", sheet="")).model
    assert model.sheet == bh.laminate([STEEL, BRASS])
    data, arrays = describe(model)
    again = rebuild(data, arrays)
    assert again.sheet == model.sheet
    assert fingerprint(again) == fingerprint(model)


@pytest.mark.parametrize(
    ("plies", "sheet", "line"),
    [
        ("", "", "sheet: a laminate is made of sheets, one or more"),
        (ONE, "t = 0.2", "has plies and t"),
        (ONE + ", { E = 1000 }", "", "sheet.plies[1].t is missing"),
        (
            "{ E1 = 6000, E2 = 3000, G12 = 1500, nu12 = 1.5, grain = 0, t = 0.1 }",
            "",
            "the moduli are not definite",
        ),
        ("{ E = 1000, t = 0.1 }", "", "the sheet has no expansion"),
    ],
)
def test_bad_scene(plies: str, sheet: str, line: str) -> None:
    with pytest.raises(bh.SceneError) as error:
        parse_scene(SCENE.format(plies=plies, sheet=sheet))
    assert line in str(error.value)
    assert "\n" not in str(error.value)


def test_what_takes_no_laminates_says_so() -> None:
    mesh = strip("consistent", 4, 1)
    even = meshes.structured(meshes.strip(40.0, 10.0), along=4, rows=2, kind="alternating")
    model = Model(mesh, CROSS).support("rigid-body").step(Expand(change=1.0))
    with pytest.raises(ModelError, match="alike in all directions"):
        bh.trace(
            replace(model, formulation="bars-and-hinges", steps=())
            .support("edge:start")
            .displace("edge:end", "x", 0.1)
        )
    with pytest.raises(ModelError, match="a laminate is not solved by halves"):
        bh.trace(replace(model, mesh=even), symmetry="x")
    state = bh.trace(model)[-1]
    with pytest.raises(ModelError, match="every ply of a laminate has its own stress"):
        state.stress().at("top")
    assert np.isfinite(state.stress().strain_at("top")).all()
    with pytest.raises(ModelError, match="not coupled"):
        bh.sensitivities.of(bh.trace(model), lambda p: model, [1.0], [bh.sensitivities.Energy()])
    with pytest.raises(ModelError, match=r"is 0\.25 mm thick, not 0\.3"):
        replace(CROSS, t=0.3)
    assert math.isclose(model.zone("all", stiff=2.0).zones[0].sheet.E, 2.0 * CROSS.E, rel_tol=1e-9)
