"""Sheets that are not at rest as drawn: cylinders without energy, invariance, derivatives, the shell, bad input."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh import Expand, Model, ModelError, Sheet
from bh.loading.builder import load_steps
from bh.mechanics.consistent.formulation import Consistent
from bh.model.serialise import describe, rebuild
from bh.scene.load import parse_scene
from fem.kirchhoff_love import Shell
from meshes import SheetMesh
from verification.studies.solver.derivatives import differences, prediction_ratio

PLAIN = Sheet(E=4000.0, nu=0.3, t=0.2)
KINDS: dict[str, Any] = {"consistent": "staggered", "shell": "mirrored", "linear-shell": "mirrored"}


def strip(name: str, along: int = 12, rows: int = 1) -> SheetMesh:
    return meshes.structured(meshes.strip(60.0, 10.0), along=along, rows=rows, kind=KINDS[name])


def sector(name: str, along: int = 5, rows: int = 2) -> SheetMesh:
    return meshes.structured(
        meshes.annulus_sector(100.0, 10.0, 0.6), along=along, rows=rows, kind=KINDS[name]
    )


def grown(mesh: SheetMesh, name: str, *steps: Expand, sheet: Sheet = PLAIN) -> bh.Path:
    model = Model(mesh, sheet, formulation=name)
    for step in steps:
        model = model.step(step)
    path = bh.trace(model)
    assert path.reached
    return path


# ------------------------------------------------------------------------------------------ shapes at rest


@pytest.mark.parametrize("name", ["consistent", "shell"])
def test_a_strip_that_is_curved_at_rest_is_a_cylinder_without_energy(name: str) -> None:
    """Radius 20 mm, 3 rad of it: no energy, and the chord 2 R sin(3 / 2)."""
    kind: Any = "alternating" if name == "consistent" else "mirrored"
    mesh = meshes.structured(meshes.strip(60.0, 10.0), along=24, rows=1, kind=kind)
    state = grown(mesh, name, Expand(through=[0.05, 0.0]))[-1]
    flat = 10.0 * 60.0 * 0.5 * PLAIN.bending_stiffness() * 0.05**2  # of the sheet that is held flat
    assert state.energy.total < 1e-12 * flat
    start, end = (state.points[mesh.nodes(f"edge:{side}")].mean(axis=0) for side in ("start", "end"))
    assert np.linalg.norm(end - start) == pytest.approx(40.0 * math.sin(1.5), rel=2e-3)
    middle = state.points[np.abs(mesh.points[:, 0] - 30.0) < 1.5, 2].mean()
    assert 0.5 * (start[2] + end[2]) > middle  # positive: the edges go up
    np.testing.assert_allclose(state.stress().curvature, [[0.05, 0.0, 0.0]] * len(mesh.triangles), atol=1e-9)
    assert np.abs(state.stress().at("top")).max() < 1e-6


@pytest.mark.parametrize("name", ["consistent", "shell", "linear-shell"])
def test_a_sheet_that_only_swells_has_no_stress(name: str) -> None:
    """One strain all over: a free sheet follows it, whatever its mesh, and a second step takes it away again."""
    path = grown(sector(name), name, Expand(by=[0.02, 0.01, 0.004]), Expand(by=0.0))
    swollen = next(s for s in reversed(list(path)) if s.step == 0)
    scale = 4000.0 * 0.2 * 0.02**2 * swollen.mesh.areas.sum()
    assert swollen.energy.total < 1e-12 * scale
    np.testing.assert_allclose(
        swollen.stress().strain, [[0.02, 0.01, 0.004]] * len(swollen.mesh.triangles), atol=1e-9
    )
    assert path[-1].energy.total < 1e-12 * scale
    edges = swollen.mesh.topology.edges
    length = [
        np.linalg.norm(np.diff(x[edges], axis=1)[:, 0], axis=1)
        for x in (path[-1].points, swollen.mesh.points)
    ]
    np.testing.assert_allclose(length[0], length[1], rtol=1e-8)


@pytest.mark.parametrize("name", ["consistent", "shell"])
def test_a_strip_that_cannot_swell_pushes(name: str) -> None:
    """Held at both ends and in its plane: the force is -E t b by, and a tension that is imposed takes it away."""
    by = 1e-3
    model = Model(strip(name), replace(PLAIN, nu=0.0), formulation=name).support("all", "yz")
    model = model.support("edge:start", "x").support("edge:end", "x")
    state = bh.trace(model.step(Expand(by=[by, 0.0])))[-1]
    assert state.reaction("edge:end")[0] == pytest.approx(-4000.0 * 0.2 * 10.0 * by, rel=1e-9)
    assert state.energy.total == pytest.approx(0.5 * 4000.0 * 0.2 * by**2 * 600.0, rel=1e-9)
    np.testing.assert_allclose(state.stress().at("middle")[:, 0], -4.0, rtol=1e-9)
    np.testing.assert_allclose(state.stress().strain, 0.0, atol=1e-12)


@pytest.mark.parametrize("name", ["consistent", "shell"])
def test_a_clamped_strip_that_is_curved_at_rest_has_its_moment(name: str) -> None:
    """Held flat by clamps at both ends: M_xx = -D through, M_yy = -nu D through, where it is uniform."""
    model = Model(strip(name, 12, 2), PLAIN, formulation=name).support("all", "xyz")
    model = model.support("edge:start", clamp=True).support("edge:end", clamp=True)
    model = model.support("edge:inner", clamp=True).support("edge:outer", clamp=True)
    model = model.step(Expand(through=[0.01, 0.0]))
    free = replace(model, supports=model.supports[1:])
    state = bh.trace(free)[-1]
    D = PLAIN.bending_stiffness()
    np.testing.assert_allclose(state.stress().moments[:, 0], -0.01 * D, rtol=1e-9)
    np.testing.assert_allclose(state.stress().moments[:, 1], -0.003 * D, rtol=1e-9)
    assert state.energy.bending == pytest.approx(0.5 * D * 1e-4 * 600.0, rel=1e-9)


def test_creases_of_a_curved_sheet_tell_their_own_angle() -> None:
    """A spring crease in a sheet that is curved at rest is at rest flat, and says so; an imposed one is imposed."""
    mesh = meshes.structured(meshes.parallel_creases(0.0, 30.0, 10.0, 1), along=6, rows=2, kind="alternating")
    crease = mesh.creases[0]
    model = Model(mesh, PLAIN).crease(crease, Lstar=5.0).step(Expand(through=[0.0, 0.02]))
    state = bh.trace(model)[-1]
    assert state.energy.total < 1e-15
    np.testing.assert_allclose(state.fold_angle(crease), 0.0, atol=1e-8)
    path = bh.trace(Model(mesh, PLAIN).step(Expand(through=[0.0, 0.02])).fold(crease, by=0.5))
    np.testing.assert_allclose(path[-1].fold_angle(crease), 0.5, atol=1e-12)
    assert path[-1].energy.total < 1e-12


# ------------------------------------------------------------------------------------------ derivatives, invariance


@pytest.mark.parametrize("made", [Consistent, Shell])
def test_derivatives(made: Any) -> None:
    """Residual, tangent, rates with lambda and predicted forces against differences, away from equilibrium."""
    name = "consistent" if made is Consistent else "shell"
    model = Model(sector(name, 3, 1), PLAIN, formulation=name).support("edge:start", "xyz", clamp=True)
    model = model.crease("crease", Lstar=8.0).displace("edge:end", "z", 1.0)
    model = replace(model, steps=())
    model = model.step(Expand(by=[0.02, 0.01, 0.003], through=0.01, where="face:105,5"))
    both = (Expand(by=0.01, through=[0.0, 0.03]), bh.Displace("edge:end", "z", 1.0))
    model = model.step(*both)
    step = load_steps(model)[1]
    system = made().system(model, step, None)
    rng = np.random.default_rng(3)
    q = system.start()
    moving = getattr(system, "moving", system.size)
    q[:moving] += 0.02 * rng.normal(size=moving)
    assert max(differences(system, q, 0.37, rng).values()) < 1e-6
    assert prediction_ratio(system, q, 0.37) == pytest.approx(4.0, rel=0.2)


@pytest.mark.parametrize("name", ["consistent", "shell"])
def test_turned_with_its_grain(name: str) -> None:
    """Sheet, grain and what it wants turned together: the same energies."""
    card = Sheet.orthotropic(E1=6000, E2=2600, G12=1500, nu12=0.35, t=0.3, grain=0.3, expansion=[0.001, 0.02])
    found = []
    for turn in (0.0, 0.9):
        mesh = sector(name)
        c, s = math.cos(turn), math.sin(turn)
        points = mesh.points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        mesh = replace(mesh, points=points, curves={}, spans=None)
        sheet = replace(card, grain=0.3 + turn)
        where = [tuple(np.array([[c, -s], [s, c]]) @ at) for at in ((0, 0), (200, 0), (200, 30), (0, 30))]
        step = Expand(change=1.0, through=[0.002, 0.001], where=where)
        found.append(grown(mesh, name, step, sheet=sheet)[-1].energy)
    for part in ("stretching", "bending"):
        assert getattr(found[1], part) == pytest.approx(getattr(found[0], part), rel=1e-7)
    assert found[0].total > 1e-4


def test_both_formulations() -> None:
    """One side of a sector swells across the crease and curls; energies of a fine mesh and the shell to 3 %."""
    step = Expand(by=0.004, through=0.004, where="face:105,5")
    energies = [
        grown(sector(n, a, r), n, step)[-1].energy.total
        for n, a, r in (("consistent", 24, 4), ("shell", 12, 2))
    ]
    assert energies[0] == pytest.approx(energies[1], rel=0.03)


@dataclass(frozen=True)
class Linear(bh.Actuation):
    """A strain that grows across the strip, by its corners: e_xx = slope y is the bending of a beam in its plane."""

    slope: float

    def apply(self, builder: bh.StepBuilder) -> None:
        corners = builder.mesh.points[builder.mesh.triangles]
        strain = np.zeros(corners.shape)
        strain[..., 0] = self.slope * corners[..., 1]
        rows = np.arange(len(corners))
        builder.grow(rows, strain, np.zeros_like(strain))


@pytest.mark.parametrize(("name", "tolerance"), [("consistent", 0.02), ("shell", 1e-4)])
def test_a_strain_that_varies(name: str, tolerance: float) -> None:
    """e_xx = a y bends a flat strip in its plane to the curvature a without stress (but for second order)."""
    a = 1e-5
    model = Model(strip(name, 24, 8), PLAIN, formulation=name).support("all", "z").support("rigid-body")
    state = bh.trace(model.step(Linear(a)))[-1]
    mesh = state.mesh
    low, mid, high = (state.displacement(f"near:{x},0")[0, 1] for x in (0, 30, 60))
    assert (low - 2.0 * mid + high) / 900.0 == pytest.approx(-a, rel=tolerance)
    assert len(mesh.triangles) > 300


# ------------------------------------------------------------------------------------------ as data


def test_path_files_and_resuming(tmp_path: Path) -> None:
    """A run that is stopped after its first step and taken up again has the same bits."""
    model = Model(sector("consistent", 3, 1), PLAIN).step(Expand(through=0.002)).fold("crease", by=0.3)
    whole = bh.trace(model, file=tmp_path / "whole.bh")
    bh.trace(replace(model, steps=model.steps[:1]), file=tmp_path / "part.bh")
    part = bh.trace(model, file=tmp_path / "part.bh", resume=True)
    np.testing.assert_array_equal(part[-1].points, whole[-1].points)
    again = bh.Path.load(tmp_path / "whole.bh")
    assert again.model.steps == model.steps
    assert again[-1].energy.total == whole[-1].energy.total


SCENE = """
[pattern]
kind = "strip"
length = 60.0
width = 10.0
[mesh]
along = 8
[sheet]
E = 4000
t = 0.2
{sheet}
[[steps]]
expand = {{ {expand} }}
"""


def test_scene() -> None:
    text = SCENE.format(sheet="expansion = 1e-3", expand='change = 20, through = "10/m", where = "face:30,5"')
    scene = parse_scene(text)
    assert scene.model.steps[0].actuations == (Expand(through=0.01, change=20.0, where="face:30,5"),)
    data, arrays = describe(scene.model)
    assert rebuild(data, arrays) == scene.model or rebuild(data, arrays).steps == scene.model.steps
    growth = load_steps(scene.model)[0].growth
    assert growth is not None
    np.testing.assert_allclose(growth.end[0, :, :, 0], 0.02)
    np.testing.assert_allclose(growth.end[1, :, :, 1], 0.01)


@pytest.mark.parametrize(
    ("sheet", "expand", "line"),
    [
        ("", "change = 20", "the sheet has no expansion"),
        ("expansion = [1, 2, 3]", "change = 20", "sheet: sheet expansion = "),
        ("", "by = 2.0", "steps[0].expand: expand by = 2 cannot be"),
        ("", "by = [0.1, 0.1, 0.1, 0.1]", "steps[0].expand.by"),
        ("", 'where = "face:300,5"', "names no face"),
        ("", "through = true", "steps[0].expand.through"),
    ],
)
def test_bad_scene(sheet: str, expand: str, line: str) -> None:
    with pytest.raises(bh.SceneError) as error:
        parse_scene(SCENE.format(sheet=sheet, expand=expand))
    assert line in str(error.value)
    assert "\n" not in str(error.value)


def test_what_cannot_expand_says_so() -> None:
    model = Model(sector("consistent"), PLAIN).step(Expand(by=0.01))
    with pytest.raises(ModelError, match="bars and hinges are at rest as they are drawn"):
        bh.trace(replace(model, formulation="bars-and-hinges"))
    with pytest.raises(ModelError, match="a sheet that expands is not solved by halves"):
        bh.trace(model, symmetry="y")
    with pytest.raises(ModelError, match="3 rows do not fit"):
        bh.trace(replace(model, steps=()).step(Expand(by=[[0.1, 0.1, 0.0]] * 3)))
    path = bh.trace(model)
    with pytest.raises(ModelError, match="sheets at rest as drawn"):
        bh.sensitivities.of(path, lambda p: model, [1.0], [bh.sensitivities.Energy()])
    mesh = sector("consistent")
    bent = replace(mesh, points=mesh.points[:, [2, 0, 1]], curves={}, spans=None)
    with pytest.raises(ModelError, match="measured from its flat shape"):
        bh.trace(Model(bent, PLAIN).step(Expand(by=0.01)))
