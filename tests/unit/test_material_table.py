"""The table of real materials: by name in Python and in scenes, as the page lists it, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import bh
from bh import ModelError, Sheet
from bh.materials import MATERIALS, material, sheet
from bh.scene.load import parse_scene

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "materials.md").read_text(encoding="utf-8")
SCENE = """
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.6
[mesh]
along = 8
[sheet]
{sheet}
[[steps]]
fold = {{ crease = "crease", by = 1.0 }}
"""


def read(keys: str) -> Sheet:
    return parse_scene(SCENE.format(sheet=keys.replace(", ", "\n"))).model.sheet


def rows() -> list[str]:
    """The table of the page."""
    found = [
        "| name | | E | nu | E2 | G12 | t | density | strength |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, stock in MATERIALS.items():
        numbers = (stock.E, stock.nu, stock.E2, stock.G12, stock.t, stock.density, stock.strength)
        cells = ("" if value is None else f"{value:g}" for value in numbers)
        found.append(f"| `{name}` | {stock.about} | {' | '.join(cells)} |")
    return found


def test_page_lists_the_table() -> None:
    assert "\n".join(rows()) in PAGE


@pytest.mark.parametrize("name", MATERIALS)
def test_every_material_is_a_sheet(name: str) -> None:
    stock = MATERIALS[name]
    plain = sheet(name)
    assert plain.grain is None
    assert (plain.t, plain.density) == (stock.t, stock.density)
    assert -1.0 < plain.nu <= 0.5
    assert read(f'material = "{name}"') == plain
    if stock.grained:
        turned = sheet(name, grain="30deg")
        assert turned.grain == pytest.approx(math.pi / 6)
        assert turned.bending_stiffness() == pytest.approx(plain.bending_stiffness(), rel=1e-12)
        assert read(f'material = "{name}", grain = "30deg"') == turned
    else:
        with pytest.raises(ModelError, match="alike in all directions"):
            sheet(name, grain=0.5)


def test_what_may_be_given_beside_the_name() -> None:
    found = read('material = "card-300", t = "0.4mm", density = 700, grain = 0.5')
    assert found == Sheet.orthotropic(
        E1=6000.0,
        E2=3000.0,
        G12=1642.0,
        nu12=0.3,
        grain=0.5,
        t=0.4,
        density=700.0,
        strength=15.0,
        strength2=7.5,
    )
    assert bh.materials.sheet("pet", t="0.2mm").t == 0.2


def test_shear_of_paper_is_that_of_baum() -> None:
    for name in ("paper-80", "card-160", "card-300", "pp-film"):
        stock = material(name)
        assert stock.E2 is not None
        assert pytest.approx(0.387 * math.sqrt(stock.E * stock.E2), rel=1e-3) == stock.G12


def test_tightest_radius() -> None:
    """Steel of 0.1 mm, 1010 MPa: a strain of 0.52 % at t / 2 over the radius."""
    assert material("spring-steel").tightest_radius(0.1) == pytest.approx(0.05 / (1010.0 / 193000.0))
    with pytest.raises(ModelError, match="no stress is known"):
        material("board").tightest_radius()


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        ('material = "card-30"', "did you mean 'card-300'"),
        ('material = "card-300", E = 3000', "has material and E"),
        ('material = "pet", grain = 0.5', "alike in all directions"),
        ('material = "pet", t = -1', "sheet.t = -1"),
        ('material = "pet", density = 0', "sheet.density = 0"),
        ("material = 3, t = 0.2", "sheet.material = 3"),
        ("E = 3000", "sheet.t is missing"),
    ],
)
def test_bad_input(keys: str, line: str) -> None:
    with pytest.raises(bh.SceneError) as error:
        read(keys)
    assert line in str(error.value)
    assert "\n" not in str(error.value)


def test_density_must_be_positive() -> None:
    with pytest.raises(ModelError, match="sheet density = -1"):
        Sheet(E=4000.0, t=0.1, density=-1.0)
