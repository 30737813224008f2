"""Units that people type: one place reads them, everything takes them, plain numbers do not pay."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import bh
import meshes
from bh.commands.cli import main
from bh.errors import InputError, SceneError
from bh.scene.json_schema import schema
from bh.scene.load import parse_scene
from bh.scene.toml_text import read_toml
from meshes.quantities import UNITS, Kind, QuantityError, number, numbers, of_any_kind, spoken

ROOT = Path(__file__).resolve().parents[2]
SCENE = """
[pattern]
kind = "annulus_sector"
radius = {radius}
width = {width}
angle = {angle}
[sheet]
E = {E}
t = {t}
[mesh]
along = 8
rows = 2
[[supports]]
at = "edge:start"
clamp = true
[[steps]]
fold = {{ crease = "crease", by = {by}, Lstar = {Lstar} }}
[[steps]]
force = {{ at = "corner:outer-end", total = [0, 0, {force}] }}
until = {{ observable = "fold_angle", of = "crease", value = {value} }}
"""
PLAIN = {"radius": "101.6", "width": "12.7", "angle": str(math.pi / 4), "E": "4000.0", "t": "0.2",
         "by": str(math.pi / 3),
         "Lstar": "25.0", "force": "0.00980665", "value": str(math.pi / 6)}  # fmt: skip
TYPED = {"radius": '"4in"', "width": '"0.5 in"', "angle": '"45deg"', "E": '"4GPa"', "t": '"0.02cm"', "by": '"60°"',
         "Lstar": '"0.025m"', "force": '"1gf"', "value": '"30 degrees"'}  # fmt: skip


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("60deg", "angle", math.pi / 3),
        ("1.05rad", "angle", 1.05),
        ("-.5 turn", "angle", -math.pi),
        ("3in", "length", 76.2),
        ("0.5mm", "length", 0.5),
        ("3cm", "length", 30.0),
        ("1e-3 m", "length", 1.0),
        ("100µm", "length", 0.1),
        ("4GPa", "modulus", 4000.0),
        ("580 ksi", "modulus", 3998.9592300376494),
        ("4e3 N/mm^2", "modulus", 4000.0),
        ("4e3 N/mm²", "modulus", 4000.0),
        ("1 lbf", "force", 4.4482216152605),
        ("0.2 N mm/mm", "couple", 0.2),
        ("0.2N mm/(mm rad)", "stiffness", 0.2),
        ("10/m", "curvature", 0.01),
        ("0.01 mm^-1", "curvature", 0.01),
        ("2mJ", "energy", 2.0),
        ("2min", "time", 120.0),
    ],
)
def test_texts_are_numbers_in_the_units_of_the_project(text: str, kind: Kind, value: float) -> None:
    assert number(text, kind) == pytest.approx(value, rel=1e-12)
    assert of_any_kind(text) == pytest.approx(value, rel=1e-12)
    assert numbers([text, 3.0, [text]], kind) == [number(text, kind), 3.0, [number(text, kind)]]


@pytest.mark.parametrize(
    ("text", "kind", "told"),
    [
        ("3 inchs", "length", '"3 inchs" is no length: write 3in'),
        ("4 gpa", "modulus", '"4 gpa" is no modulus: write 4GPa'),
        ("60 degs", "angle", '"60 degs" is no angle: write 60deg'),
        ("60 grad", "angle", "is no angle: write one such as 60deg or 1.05rad"),
        ("5g", "force", '"5g" is no force: write 5gf'),
        ("3N", "length", '"3N" is no length: write one such as 0.5mm, 3cm or 3in'),
        ("3deg", "length", '"3deg" is no length: write one such as'),
        ("3mm/mm", "angle", "is no angle"),
        ("60", "angle", '"60" has no unit: write 60deg, or the number without quotes'),
        ("", "length", '"" is no length'),
        ("mm", "length", '"mm" is no length'),
        ("3 mm**9**9**9**9**9**9", "length", "is no length"),
        ("3mm/0", "length", "is no length"),
        ("3 )(", "length", "is no length"),
        ("3 " + "m" * 37 + "!", "length", "is no length"),  # not tried in every division into words
        ("3 __import__('os')", "length", "is no length"),
        ("1" * 5000 + "mm", "length", "is no length"),
    ],
)
def test_what_is_no_quantity_is_told_with_the_mend(text: str, kind: Kind, told: str) -> None:
    with pytest.raises(QuantityError) as caught:
        number(text, kind)
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 200


def test_every_name_of_a_unit_is_understood() -> None:
    for kind, unit in UNITS.items():
        for name in unit.known:
            if not name.startswith("1/"):
                assert number(f"2 {name}", kind) == pytest.approx(2.0 * number(f"1{name}", kind))
        assert spoken("2.5", kind) == 2.5


def test_a_scene_takes_units_everywhere() -> None:
    plain, typed = parse_scene(SCENE.format(**PLAIN)), parse_scene(SCENE.format(**TYPED))
    np.testing.assert_allclose(typed.model.mesh.points, plain.model.mesh.points, rtol=0, atol=1e-12)
    assert typed.model.sheet == plain.model.sheet
    for one, other in zip(typed.model.steps, plain.model.steps, strict=True):
        assert repr(one) == repr(other)
    assert typed.model.steps[1].until.value == pytest.approx(math.pi / 6, rel=1e-15)  # type: ignore[union-attr]
    jsonschema.validate(read_toml(SCENE.format(**TYPED)), schema())
    jsonschema.validate(read_toml(SCENE.format(**PLAIN)), schema())


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("t", '"3 inchs"', 'sheet.t = "3 inchs" is no length: write 3in'),
        ("radius", '["4in", "5 inchs"]', 'pattern.radius = "5 inchs" is no length: write 5in'),
        ("by", '"60 degs"', 'steps[0].fold.by = "60 degs" is no angle: write 60deg'),
        ("by", "60", 'angles are radians, not degrees: write "60deg"'),
        ("by", '"drwan"', 'steps[0].fold.by = "drwan" cannot be; give a fold angle in rad'),
        ("force", '"1 gramm"', 'steps[1].force.total = "1 gramm" is no force'),
        ("value", '"3mm"', 'steps[1].until: until fold_angle: value = "3mm" is no angle'),
        ("t", '"1e999mm"', 'sheet.t = "1e999mm" cannot be; give the thickness in mm'),
        ("angle", '"400deg"', 'pattern.angle = "400deg" cannot be'),
    ],
)
def test_scenes_name_key_value_and_mend(key: str, value: str, told: str) -> None:
    with pytest.raises(SceneError) as caught:
        parse_scene(SCENE.format(**PLAIN | {key: value}))
    assert told in str(caught.value)


def test_python_takes_units_and_keeps_numbers() -> None:
    assert bh.Sheet(E="4GPa", t="0.2mm") == bh.Sheet(E=4000.0, t=0.2)
    assert bh.Fold("c", by="60deg", Lstar="1in") == bh.Fold("c", by=number("60deg", "angle"), Lstar=25.4)
    assert bh.Fold("c", to=["60deg", 1.0]).to == [number("60deg", "angle"), 1.0]
    assert bh.Displace("all", "x", "1in").by == 25.4
    assert bh.Force("all", total=["1N", 0, "2 N"]).total == [1.0, 0, 2.0]
    assert bh.Moment("c", "0.2N").to == 0.2
    assert bh.Pinch("c", by="90deg", length="2cm").length == 20.0
    assert bh.CreaseLaw(Lstar="25mm", rest="90deg").rest == pytest.approx(math.pi / 2)
    assert bh.Until("fold_angle", "30deg", of="c").value == pytest.approx(math.pi / 6)
    assert bh.depth("1cm").value == 10.0
    one, other = meshes.parallel_creases("10/m", "5cm", "5mm"), meshes.parallel_creases(0.01, 50.0, 5.0)
    np.testing.assert_allclose(one.rings[0], other.rings[0], atol=1e-12)
    assert meshes.unstructured(meshes.strip("2cm", "1cm"), size="5mm").size == pytest.approx(
        math.hypot(20, 10)
    )
    with pytest.raises(InputError, match=r'sheet: t = "0.2 milimeters" is no length: write 0\.2mm'):
        bh.Sheet(E=4000.0, t="0.2 milimeters")
    with pytest.raises(InputError, match="until energy: value"):
        bh.Until("energy", "2kg")
    with pytest.raises(InputError, match="only numbers are compared"):
        bh.Until("meshes:strip", "2mm")


def test_commands_take_units(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fold", "x.svg", "--angle", "60 degs"]) == 2
    assert '"60 degs" is no angle: write 60deg' in capsys.readouterr().err
    assert main(["segments", "-o", str(tmp_path / "x.nc"), "--zone", "4 kmm"]) == 2
    assert "is no length" in capsys.readouterr().err


def remarks(pattern: Any, **sheet: Any) -> list[str]:
    model = bh.Model(meshes.structured(pattern, along=8, rows=2), bh.Sheet(**sheet))
    model = model.fold("crease", to=3.0)
    return [remark.text for remark in bh.remarks(model) if remark.code == "unlikely"]


def test_numbers_that_cannot_be_meant_are_remarked_on() -> None:
    pattern = meshes.annulus_sector(100.0, 10.0, 0.8)
    assert remarks(pattern, E=4000.0, t=0.2) == []
    assert 'write E = "6GPa"' in remarks(pattern, E=6.0, t=0.2)[0]
    assert "stiffer than diamond" in remarks(pattern, E=4e9, t=0.2)[0]
    assert "no thin sheet" in remarks(pattern, E=4000.0, t="3m")[0]
    assert 'write t = "0.0002m"' in remarks(pattern, E=4000.0, t=0.0002)[0]
    model = bh.Model(meshes.structured(pattern, along=8), bh.Sheet(E=4000.0, t=0.2)).displace(
        "edge:end", "z", "1m"
    )
    assert any("times the size of the sheet" in remark.text for remark in bh.remarks(model))


def test_scenes_with_plain_numbers_do_not_load_the_library() -> None:
    code = (
        "import sys; from bh.scene.load import parse_scene\n"
        f"parse_scene({SCENE.format(**PLAIN)!r})\nfirst = 'pint' in sys.modules\n"
        f"parse_scene({SCENE.format(**TYPED)!r})\n"
        "import json; print(json.dumps([first, 'pint' in sys.modules]))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert json.loads(done.stdout) == [False, True]
