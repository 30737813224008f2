"""Zones: two thicknesses, stiff panels, where they are told, both formulations, stress and weight, and bad input."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh import Model, ModelError, Sheet
from bh.loading.builder import load_steps
from bh.materials import LinearElastic
from bh.mechanics.consistent.formulation import Consistent
from bh.model.serialise import describe, fingerprint, rebuild
from bh.scene.load import parse_scene
from meshes import SheetMesh
from meshes.io import read_pattern
from verification.studies.solver.derivatives import differences, prediction_ratio

SHEET = Sheet(E=4000.0, nu=0.0, t=0.2, density=1000.0, strength=40.0)
LEFT = [[-1.0, -1.0], [30.0, -1.0], [30.0, 11.0], [-1.0, 11.0]]  # of the strip, up to x = 30


def strip(along: int = 24, rows: int = 2, kind: Any = "alternating") -> SheetMesh:
    return meshes.structured(meshes.strip(60.0, 10.0), along=along, rows=rows, kind=kind)


def cantilever(mesh: SheetMesh, sheet: Sheet, name: str) -> Model:
    return Model(mesh, sheet, formulation=name).support("edge:start", "xyz", clamp=True)


def two_thicknesses(load: float, E: float = 4000.0) -> float:
    """Deflection of the end: curvature P (L - x) / (E I(x)) integrated twice, thick up to the middle."""
    L, a, b, thick, thin = 60.0, 30.0, 10.0, 0.4, 0.2
    I1, I2 = b * thick**3 / 12.0, b * thin**3 / 12.0
    return load / (3.0 * E) * ((L**3 - (L - a) ** 3) / I1 + (L - a) ** 3 / I2)


@pytest.mark.parametrize(
    ("name", "kind", "tolerance"), [("consistent", "alternating", 0.01), ("shell", "mirrored", 1e-4)]
)
def test_cantilever_of_two_thicknesses(name: str, kind: str, tolerance: float) -> None:
    load = 1e-7
    model = cantilever(strip(kind=kind), SHEET, name).zone(LEFT, t=0.4)
    path = bh.trace(model.force("edge:end", total=(0.0, 0.0, load)))
    found = path[-1].displacement("edge:end")[:, 2].mean()
    assert found == pytest.approx(two_thicknesses(load), rel=tolerance)
    bare = bh.trace(cantilever(strip(kind=kind), SHEET, name).force("edge:end", total=(0.0, 0.0, load)))
    assert bare[-1].displacement("edge:end")[:, 2].mean() > 3.0 * found / 2.0


@pytest.mark.parametrize("name", ["consistent", "shell", "linear-shell"])
def test_a_zone_of_the_same_is_none(name: str) -> None:
    """Nothing changes but the smoothing across the border of the zone: energies to 1 %, of the shells to rounding."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.6), along=8, rows=2, kind="mirrored")
    model = Model(mesh, Sheet(E=4000.0, nu=0.3, t=0.2), formulation=name).fold("crease", by=1.0)
    half = model.zone([[0, 0], [200, 0], [200, 30], [0, 30]], t=0.2)
    one, two = (bh.trace(each)[-1].energy.total for each in (model, half))
    assert two == pytest.approx(one, rel=0.01 if name == "consistent" else 1e-11)


@pytest.mark.parametrize("name", ["consistent", "shell"])
def test_stiff_panel_stays_flat(name: str) -> None:
    """A sector of which one side is a thousand times as stiff: it stays nearly flat where the soft one rolls."""
    kind: Any = "staggered" if name == "consistent" else "mirrored"
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.6), along=12, rows=2, kind=kind)
    model = Model(mesh, Sheet(E=4000.0, nu=0.3, t=0.1), formulation=name)
    stiff = model.zone("face:105,5", stiff=1000.0).crease("crease", Lstar=20.0).moment("crease", to=0.005)
    state = bh.trace(stiff)[-1]
    curvature = np.abs(state.stress().curvature).max(axis=1)
    of = stiff.sections.of
    assert of is not None
    assert curvature[of == 1].max() < 0.05 * curvature[of == 0].max()


@pytest.mark.parametrize("name", ["consistent", "shell"])
def test_stress_of_zones(name: str) -> None:
    """A pulled strip of two thicknesses: one force, stresses P / (b t), and the thin part yields first."""
    model = cantilever(strip(kind="mirrored"), SHEET, name).support("all", "yz").zone(LEFT, t=0.4)
    pull = 30.0 / (4000.0 * 10.0 * 0.4) + 30.0 / (4000.0 * 10.0 * 0.2)  # mm that 1 N stretches it by
    stress = bh.trace(model.displace("edge:end", "x", pull))[-1].stress()
    of = model.sections.of
    assert of is not None
    for number, t in ((1, 0.4), (0, 0.2)):
        np.testing.assert_allclose(stress.at("middle")[of == number, 0], 1.0 / (10.0 * t), rtol=1e-3)
        np.testing.assert_allclose(stress.corners.at("top")[of == number, :, 0], 1.0 / (10.0 * t), rtol=1e-3)
        np.testing.assert_allclose(stress.strain[of == number, 0], 1.0 / (10.0 * t * 4000.0), rtol=1e-3)
    worst = stress.worst()
    assert of[worst.triangle] == 0
    assert worst.utilisation == pytest.approx(0.5 / 40.0, rel=1e-3)
    assert stress.reserve("top")[of == 1].mean() == pytest.approx(160.0, rel=2e-3)


@pytest.mark.parametrize("name", ["consistent", "shell"])
def test_weight_of_zones(name: str) -> None:
    model = cantilever(strip(kind="mirrored"), SHEET, name).zone(LEFT, t=0.4, density=2000.0)
    path = bh.trace(model.step(bh.Weight()))
    weight = 9.81e-9 * 300.0 * (1000.0 * 0.2 + 2000.0 * 0.4)
    assert path[-1].reaction("edge:start")[2] == pytest.approx(weight, rel=1e-9)


def test_gmsh_mesh_and_accuracy_keep_the_zones() -> None:
    pattern = meshes.annulus_sector(100.0, 10.0, 0.6)
    sheet = Sheet(E=4000.0, nu=0.3, t=0.1)
    areas = []
    for mesh in (meshes.structured(pattern, along=6), meshes.unstructured(pattern, size=4.0)):
        model = Model(mesh, sheet).zone("face:105,5", t=0.3)
        of = model.sections.of
        assert of is not None
        areas.append(mesh.areas[of == 1].sum())
    assert areas == pytest.approx([0.5 * 0.6 * (110.0**2 - 100.0**2)] * 2, rel=2e-3)
    model = Model(meshes.structured(pattern, along=6), sheet).zone("face:105,5", t=0.3).fold("crease", by=0.8)
    path = bh.trace(model, accuracy=0.05)
    assert path.model.zones == model.zones
    fine = Model(meshes.structured(pattern, along=48, rows=6), sheet).zone("face:105,5", t=0.3)
    assert path[-1].energy.total == pytest.approx(
        bh.trace(fine.fold("crease", by=0.8))[-1].energy.total, rel=0.05
    )


def test_derivatives() -> None:
    """Residual, tangent and rates against differences, with two sheets of which one has a grain."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.6), along=5, rows=2)
    card = Sheet.orthotropic(E1=6000, E2=2600, G12=1500, nu12=0.35, t=0.3, grain=0.4)
    model = Model(mesh, Sheet(E=4000.0, nu=0.3, t=0.2)).zone("face:105,5", card)
    model = model.support("edge:start", "xyz", clamp=True).fold("crease", to=2.4)
    system = Consistent().system(model, load_steps(model)[0], None)
    rng = np.random.default_rng(3)
    q = system.start()
    q[: system.moving] += 0.1 * rng.normal(size=system.moving)
    assert max(differences(system, q, 0.37, rng).values()) < 1e-7
    assert prediction_ratio(system, q, 0.37) == pytest.approx(4.0, rel=0.1)


def test_folded_zones_against_the_shell() -> None:
    """One side of a sector twice as thick and with a grain; energies of both formulations to 2 %."""
    pattern = meshes.annulus_sector(100.0, 10.0, 0.6)
    card = Sheet.orthotropic(E1=6000, E2=2600, G12=1500, nu12=0.35, t=0.25, grain=0.4)
    found = []
    for name, along, rows, kind in (("consistent", 24, 4, "staggered"), ("shell", 12, 2, "mirrored")):
        mesh = meshes.structured(pattern, along=along, rows=rows, kind=kind)  # type: ignore[arg-type]
        model = Model(mesh, Sheet(E=4000.0, nu=0.3, t=0.127), formulation=name).zone("face:105,5", card)
        found.append(bh.trace(model.fold("crease", by=1.0))[-1].energy.total)
    assert found[0] == pytest.approx(found[1], rel=0.02)


def test_symmetric_zones() -> None:
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.6), along=8, rows=2)
    model = Model(mesh, Sheet(E=4000.0, nu=0.3, t=0.2)).zone("face:105,5", t=0.4).fold("crease", by=1.0)
    whole, half = bh.trace(model), bh.trace(model, symmetry="y")
    assert half[-1].energy.total == pytest.approx(whole[-1].energy.total, rel=1e-9)
    other = replace(model, zones=()).zone([[0, -1], [200, -1], [200, 20], [0, 20]], t=0.4)
    with pytest.raises(ModelError, match="zones are not mirror-symmetric"):
        bh.trace(other, symmetry="y")


# ------------------------------------------------------------------------------------------ where

SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="60mm" viewBox="0 0 100 60">
<rect x="0" y="0" width="100" height="60" fill="none" stroke="#000000"/>
<path d="M50 0 L50 60" stroke="#ff0000"/>
<g id="flat stiffener"><rect x="10" y="15" width="30" height="30" fill="none" stroke="#ff00ff"/></g></svg>"""


def test_a_layer_of_the_drawing(tmp_path: Path) -> None:
    file = tmp_path / "panel.svg"
    file.write_text(SVG)
    pattern = read_pattern(file)
    mesh = meshes.unstructured(pattern, size=8.0)
    layer = next(name for name in mesh.edge_sets if name.startswith("layer:"))
    model = Model(mesh, SHEET)
    regions: list[Any] = [layer, "face:25,30", "inside:crease:flat", [[9, 14], [41, 14], [41, 46], [9, 46]]]
    for where in regions:
        of = model.zone(where, t=1.0).sections.of
        assert of is not None
        assert mesh.areas[of == 1].sum() == pytest.approx(900.0)
    of = model.zone(["face:25,30", "face:80,30"], t=1.0).sections.of
    assert of is not None
    assert mesh.areas[of == 1].sum() == pytest.approx(3900.0)
    with pytest.raises(ModelError, match="has no layer 'none' of flat lines"):
        model.zone("layer:none", t=1.0)
    with pytest.raises(ModelError, match="enclose nothing"):
        model.zone("inside:crease:m1", t=1.0)
    with pytest.raises(ModelError, match="lies on a line between two faces"):
        model.zone("face:50,30", t=1.0)


@pytest.mark.parametrize(
    ("where", "line"),
    [
        ("face:300,5", "is not on the sheet"),
        ("face:here", "write a point in it"),
        ("somewhere", "is not known; give"),
        ("inside:edge:none", "has no lines 'edge:none'"),
        ([[0.0, 20.0], [5.0, 20.0], [5.0, 25.0]], "no triangle of the mesh lies in"),
        ([[0.0, 0.0], [5.0, 5.0], [5.0, 0.0], [0.0, 5.0]], "crosses itself"),
        ([[0.0, 0.0], [5.0, 5.0]], "cannot be; give"),
        ("", "cannot be; give"),
    ],
)
def test_a_zone_that_names_nothing(where: Any, line: str) -> None:
    with pytest.raises(ModelError, match=line.replace("(", r"\(")) as error:
        Model(strip(4, 1), SHEET).zone(where, t=1.0)
    assert "\n" not in str(error.value)


def test_bad_zones() -> None:
    model = Model(strip(4, 1), SHEET).zone(LEFT, t=0.4)
    with pytest.raises(ModelError, match="zones 1 and 2 overlap at"):
        model.zone("all", t=0.3)
    with pytest.raises(ModelError, match="zone stiff = -1"):
        model.zone("all", stiff=-1.0)
    with pytest.raises(ModelError, match="a zone has no thickness"):
        model.zone("all", thickness=0.3)
    with pytest.raises(ModelError, match="bars and hinges are of one sheet all over"):
        bh.trace(
            replace(model, formulation="bars-and-hinges").support("rigid-body").displace("edge:end", "x", 0.1)
        )
    with pytest.raises(ModelError, match="zones have another thickness"):
        bh.trace(
            replace(model.support("edge:start", clamp=True), contact="thickness").displace(
                "edge:end", "x", 0.1
            )
        )

    class Changing(LinearElastic):
        def stretching(self, sheet: Sheet) -> Any:
            law: Any = LinearElastic().stretching(sheet)

            class Asked:
                energy, stress, moduli = law.energy, law.stress, law.moduli

            return Asked()

    moved = model.support("edge:start", clamp=True).displace("edge:end", "x", 0.1)
    with pytest.raises(ModelError, match="zones are those of linear materials"):
        Consistent(material=Changing()).system(model, load_steps(moved)[0], None)


# ------------------------------------------------------------------------------------------ as data

SCENE = """
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.6
[mesh]
along = 8
rows = 2
[sheet]
{sheet}
[[zones]]
{zone}
[[steps]]
fold = {{ crease = "crease", by = 1.0 }}
"""


def scene(zone: str, sheet: str = "E = 4000\nnu = 0.3\nt = 0.1") -> Model:
    return parse_scene(SCENE.format(sheet=sheet, zone=zone.replace("; ", "\n"))).model


def test_scene_and_path_file() -> None:
    model = scene('where = "face:105,5"; t = "0.3mm"; stiff = 10')
    assert model.zones[0].sheet == Sheet(E=40000.0, nu=0.3, t=0.3)
    data, arrays = describe(model)
    again = rebuild(data, arrays)
    assert again.zones == model.zones
    assert fingerprint(again) == fingerprint(model)
    assert "zones" not in describe(replace(model, zones=()))[0]  # fingerprints as ever without
    card = scene('where = [[0, 0], [200, 0], [200, 30], [0, 30]]; material = "card-300"; grain = "30deg"')
    assert card.zones[0].sheet == bh.materials.sheet("card-300", grain="30deg")
    back = scene(
        'where = "face:105,5"; E = 2000; nu = 0.1', 'material = "card-300"\ngrain = 0.5\ndensity = 700'
    )
    assert back.zones[0].sheet.grain is None
    assert back.zones[0].sheet.density == 700.0


@pytest.mark.parametrize(
    ("zone", "line"),
    [
        ("t = 0.3", "zones[0].where is missing"),
        ('where = "face:105,5"; t = -1', "zones[0].t = -1"),
        ('where = "face:105,5"; E1 = 4000', "has E1 but no grain"),
        ('where = "face:105,5"; E = 4000; E1 = 3000', "both E and E1"),
        ('where = "face:105,5"; grain = "30deg"', "E2 and G12 is missing"),
        ('where = "face:105,5"; material = "cord"', "did you mean"),
        ('where = "face:1,5"; t = 1.0', "names no face"),
        ('where = "face:105,5"; stiff = 0', "zones[0].stiff"),
    ],
)
def test_bad_scene(zone: str, line: str) -> None:
    with pytest.raises(bh.SceneError) as error:
        scene(zone)
    assert line in str(error.value)
    assert "\n" not in str(error.value)


def test_no_zone_costs_nothing() -> None:
    """One matrix for all places, as before there were zones."""
    model = cantilever(strip(4, 1), SHEET, "consistent").displace("edge:end", "x", 0.1)
    assert model.sections.of is None
    law: Any = Consistent().system(model, load_steps(model)[0], None).elements.stretching.law
    assert law.matrix.shape == (3, 3)
    assert math.isclose(law.matrix[0, 0], 800.0)
