"""Stresses of states: closed forms, two formulations against each other, panels, yield, and what has none."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh import Displace, Force, Model, ModelError, Sheet, Weight
from bh.analysis.yielding import Yielding
from bh.analysis.yielding import yielding as yielding_of
from bh.commands.run import solve
from bh.formulations import yield_criteria
from bh.formulations.recovery import corner_values
from bh.model.serialise import describe, rebuild
from bh.paths.export import cell_data
from bh.plotting.colouring import colouring_of
from bh.scene.load import parse_scene
from meshes import SheetMesh

NAMES = ("consistent", "shell")
STEEL = Sheet(E=193_000.0, nu=0.3, t=0.1, strength=1010.0)
CARD = Sheet.orthotropic(
    E1=6000, E2=3000, G12=1640, nu12=0.3, grain="30deg", t=0.3, density=800, strength=15, strength2=7.5
)


def strip(length: float, width: float, along: int, rows: int = 2) -> SheetMesh:
    return meshes.structured(meshes.strip(length, width), along=along, rows=rows)


def pulled(sheet: Sheet, name: str, by: float = 0.004) -> bh.State:
    mesh = strip(40.0, 10.0, 16)
    model = Model(mesh, sheet, formulation=name)
    model = model.support("edge:start", "xz").support("corner:inner-start", "y").support("edge:end", "z")
    return bh.trace(model.step(Displace("edge:end", "x", by=by)))[-1]


@pytest.mark.parametrize("name", NAMES)
def test_pulled_plate(name: str) -> None:
    """E times the strain all over, nothing across, and by von Mises the same."""
    stress = pulled(STEEL, name).stress()
    green = 1e-4 + 0.5e-8
    for side in ("top", "middle", "bottom"):
        assert np.allclose(stress.at(side), [STEEL.E * green, 0.0, 0.0], atol=1e-5)
        assert np.allclose(stress.strain_at(side), [green, -0.3 * green, 0.0], atol=1e-9)
        assert np.allclose(stress.principal(side), [STEEL.E * green, 0.0], atol=1e-5)
        assert np.allclose(stress.utilisation(side), STEEL.E * green / 1010.0, rtol=1e-5)
        assert np.allclose(stress.corners.reserve(side), 1010.0 / (STEEL.E * green), rtol=1e-5)


@pytest.mark.parametrize("name", NAMES)
def test_pulled_at_an_angle_to_the_grain(name: str) -> None:
    """One stress all over, and Hill's of its parts along, across and in shear."""
    stress = pulled(CARD, name).stress()
    assert CARD.E2 is not None
    assert CARD.G12 is not None
    c, s = math.cos(math.pi / 6.0), 0.5
    E = 1.0 / (c**4 / CARD.E + (1.0 / CARD.G12 - 2.0 * 0.3 / CARD.E) * s * s * c * c + s**4 / CARD.E2)
    pull = E * (1e-4 + 0.5e-8)
    assert np.allclose(stress.at(), [pull, 0.0, 0.0], atol=2e-3 * pull)
    shear = math.sqrt(15.0 * 7.5 / 3.0)
    hill = (c * c / 15.0) ** 2 - (c * s / 15.0) ** 2 + (s * s / 7.5) ** 2 + (c * s / shear) ** 2
    assert np.allclose(stress.utilisation(), pull * math.sqrt(hill), rtol=2e-3)
    assert np.allclose(stress.equivalent(), 15.0 * pull * math.sqrt(hill), rtol=2e-3)


P = 0.01  # N


def lifted(name: str, along: int, P: float = P, strength: float | None = None) -> bh.Path:
    """A clamped strip (40 x 10 x 0.2 mm, nu = 0) with a force at its end."""
    sheet = Sheet(E=193_000.0, nu=0.0, t=0.2, strength=strength)
    model = Model(strip(40.0, 10.0, along, along // 10), sheet, formulation=name)
    return bh.trace(
        model.support("edge:start", "xyz", clamp=True).step(Force("edge:end", total=(0.0, 0.0, P)))
    )


@pytest.mark.parametrize("name", NAMES)
def test_bent_strip(name: str) -> None:
    """A clamped strip with a force P at its end: 6 P (l - x) / (b t^2) on either side, from root to end."""
    errors = []
    for along in (10, 20):
        stress = lifted(name, along)[-1].stress()
        x = stress.mesh.points[stress.mesh.triangles, 0]
        exact = 6.0 * P * (40.0 - x) / (10.0 * 0.04)
        root = float(exact.max())
        above, below = (
            np.abs(sign * stress.corners.at(side)[..., 0] - exact).max() / root
            for side, sign in (("top", -1.0), ("bottom", 1.0))
        )
        errors.append(max(above, below))
        assert np.abs(stress.at("middle")).max() < 1e-4 * root
    if name == "shell":
        assert max(errors) < 1e-4  # its moments are linear in a triangle
    else:
        assert errors[1] < 0.01
        assert math.log2(errors[0] / errors[1]) > 1.5
    assert stress.at("top")[:, 0].min() < -0.9 * root  # bent up: what was above is pressed


def test_the_shell_says_the_same_of_a_folded_sector() -> None:
    """Both sides of the panels of a curved fold."""
    mesh = meshes.annulus_sector(radius=100.0, width=10.0, angle=math.pi / 4.0)
    found = {}
    for name, along, rows in (("consistent", 48, 6), ("shell", 16, 2)):
        grid = meshes.structured(mesh, along=along, rows=rows)
        stress = bh.trace(Model(grid, STEEL, formulation=name).fold("crease", by="60deg"))[-1].stress()
        middle = grid.points[grid.triangles].mean(axis=1)
        angle = np.arctan2(middle[:, 1], middle[:, 0])
        inner = np.abs(angle - math.pi / 8.0) < 0.2
        weight = grid.areas * inner
        found[name] = [
            math.sqrt(weight @ stress.equivalent(side) ** 2 / weight.sum()) for side in ("top", "bottom")
        ]
    assert found["consistent"] == pytest.approx(found["shell"], rel=0.02)


def test_what_is_linear_is_recovered_exactly_in_every_panel() -> None:
    """Two planes that jump at a crease, on all corners of both panels; a mean across the crease would miss them."""
    mesh = meshes.structured(meshes.strip(30.0, 10.0, [4.0]), along=9, rows=3)
    state = bh.trace(Model(mesh, STEEL).fold("crease", by=0.1))[-1]
    cut = state.stress().cut
    assert len(cut) == len(mesh.crease_edges("crease"))
    above = mesh.points[mesh.triangles, 1].mean(axis=1) > 4.0

    def plane(points: NDArray[np.float64], upper: NDArray[np.bool_]) -> NDArray[np.float64]:
        return np.asarray(np.where(upper, 5.0 + 0.3 * points[..., 0], -2.0 * points[..., 1]))

    values = plane(mesh.points[mesh.triangles].mean(axis=1), above)
    got = corner_values(mesh, values[:, None], cut)[..., 0]
    assert np.allclose(got, plane(mesh.points[mesh.triangles], above[:, None]), atol=1e-9)
    assert not np.allclose(corner_values(mesh, values[:, None], cut[:0])[..., 0], got, atol=0.1)


def test_one_triangle_beside_a_crease_keeps_its_value() -> None:
    """Too few triangles for a plane: their mean."""
    mesh = meshes.structured(meshes.strip(1.0, 1.0), along=1, rows=1)
    values = np.arange(1.0, 1.0 + len(mesh.triangles))[:, None]
    every = np.arange(len(mesh.topology.hinges))
    assert np.allclose(corner_values(mesh, values, every), values[:, None])


def test_equivalent_stresses() -> None:
    """Von Mises's of plain cases, Hill's without a grain is the same; principal stresses of a pure shear."""
    stress = np.array([[100.0, 0.0, 0.0], [100.0, 100.0, 0.0], [0.0, 0.0, 10.0], [30.0, -20.0, 5.0]])
    mises = [100.0, 100.0, 10.0 * math.sqrt(3.0), math.sqrt(900 + 600 + 400 + 75)]
    assert np.allclose(yield_criteria.von_mises(stress), mises)
    assert np.allclose(yield_criteria.hill(stress, 1.0, 1.0 / math.sqrt(3.0)), mises)
    assert np.allclose(yield_criteria.principal(stress[2]), [10.0, -10.0])
    turned = yield_criteria.along_grain(stress, 0.7)
    assert np.allclose(yield_criteria.von_mises(turned), mises)
    assert np.allclose(yield_criteria.along_grain(np.array([1.0, 0.0, 0.0]), math.pi / 4.0), [0.5, 0.5, -0.5])


def test_yield_begins_where_the_closed_form_says() -> None:
    """At the root of a lifted strip, at the part of the force that its strength allows."""
    root = 6.0 * P * 40.0 / (10.0 * 0.04)
    found = yielding_of(lifted("consistent", 20, strength=0.8 * root))
    assert found.first is not None
    assert found.lam == pytest.approx(0.8, rel=0.02)
    assert found.step == 0
    assert found.first.place[0] == pytest.approx(0.0, abs=1e-9)
    assert found.largest.utilisation == pytest.approx(1.25, rel=0.02)
    assert str(found).startswith("yield begins in step 1 at lambda 0.")
    safe = yielding_of(lifted("consistent", 20, strength=2.0 * root))
    assert safe.first is None
    assert str(safe).startswith("yield: none; at most 0.505 of the strength")


def test_files_hold_stresses(tmp_path: Path) -> None:
    """Cell data of VTU files, the colours of pictures, and result.json."""
    last = lifted("consistent", 20, strength=12.0)[-1]
    cells = cell_data(last)
    assert np.array_equal(cells["moment"], last.stress().moments)
    assert np.allclose(cells["equivalent_stress_top"], last.stress().equivalent("top"))
    assert cells["reserve"].min() == pytest.approx(2.0, rel=0.1)
    colours = colouring_of(last, "utilisation", None)
    assert colours is not None
    assert colours.top == pytest.approx(0.5, rel=0.02)
    scene = parse_scene(SCENE)
    solved = solve(scene, tmp_path / "out", estimate=False)
    told = json.loads((tmp_path / "out" / "result.json").read_text())["yield"]
    assert isinstance(solved.yields, Yielding)
    assert told["largest"]["utilisation"] == solved.yields.largest.utilisation
    assert told["found"] is True
    assert 0.0 < told["first"]["lambda"] < 1.0


SCENE = """
[pattern]
kind = "annulus_sector"
radius = 16.0
width = 8.0
angle = 1.0
[sheet]
E = 193000.0
nu = 0.3
t = 0.1
strength = "500MPa"
[mesh]
along = 12
rows = 2
[[steps]]
fold = { crease = "crease", by = 1.0 }
"""


def test_bars_and_hinges_have_none(tmp_path: Path) -> None:
    """One line, of states and of runs."""
    text = SCENE.replace("[[steps]]", '[model]\nformulation = "bars-and-hinges"\n[[steps]]')
    solved = solve(parse_scene(text), tmp_path / "out", estimate=False)
    with pytest.raises(ModelError, match="bars and hinges have no stress"):
        solved.path[-1].stress()
    assert "bars and hinges have no stress" in str(solved.yields)
    assert set(cell_data(solved.path[-1])) == {
        f"{k}_energy_density" for k in ("stretching", "bending", "folding")
    }


def test_bad_input() -> None:
    """Strengths that cannot be, sides that there are none of, a grain with one strength."""
    with pytest.raises(ModelError, match="strength = -1"):
        Sheet(E=1.0, t=1.0, strength=-1.0)
    with pytest.raises(ModelError, match="strength2 and shear_strength are of a grain"):
        Sheet(E=1.0, t=1.0, strength2=1.0)
    with pytest.raises(ModelError, match="no strenght"):
        Sheet.orthotropic(E1=2, E2=1, G12=1, nu12=0.3, grain=0.0, t=1, strenght=3)
    stress = lifted("consistent", 10)[-1].stress()
    with pytest.raises(ModelError, match="no strength to compare"):
        stress.utilisation()
    with pytest.raises(ModelError, match="side 'above' is not known"):
        stress.at("above")
    one = Sheet.orthotropic(E1=2, E2=1, G12=1, nu12=0.3, grain=0.0, t=1, strength=3)
    with pytest.raises(ModelError, match="give strength2"):
        one.strengths()


def test_stored_with_its_strengths() -> None:
    """A sheet comes back from its stored form, and a table's material has its own."""
    mesh = strip(4.0, 1.0, 4)
    model = Model(mesh, CARD).support("edge:start", "xyz").step(Weight())
    assert rebuild(*describe(model)).sheet == CARD
    card = bh.materials.sheet("card-300", grain=0.0)
    assert (card.strength, card.strength2) == (15.0, 7.5)
    assert bh.materials.sheet("card-300").strength == 7.5
