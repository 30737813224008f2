"""Creases that are strips: their lines, closed forms, the sharp limit in both formulations, scenes, and bad input."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh.analysis.contact import Panels
from bh.model.serialise import describe, rebuild
from bh.plotting.charts import pattern as pattern_chart
from bh.scene.load import parse_scene
from bh.scene.report import _figure as report_figure
from bh.scene.report import report
from bh.sweep.measures import Measure
from bh.sweep.scenes import SceneTask
from meshes.curves import Arc, Line, Polyline, sample

SHEET = bh.Sheet(E=4000.0, nu=0.3, t=0.2)
SECTOR = meshes.annulus_sector(100.0, 10.0, 0.6)
SCENE = """
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.6
[sheet]
E = 4000.0
nu = 0.3
t = 0.2
[mesh]
kind = "alternating"
along = 12
rows = 2
[creases.crease]
width = "1.5mm"
Lstar = 20
[[steps]]
fold = { crease = "crease", rest = "2.1rad" }
"""


def mesh_of(
    pattern: meshes.CreasePattern, along: int, rows: int, kind: Any = "alternating"
) -> meshes.SheetMesh:
    return meshes.structured(pattern, along=along, rows=rows, kind=kind)


def test_lines_beside_curves() -> None:
    """Lines and arcs stay exact; other curves are offset to their own distance, and all end on the outline."""
    flat = meshes.wide_creases(meshes.strip(60.0, 20.0, [10.0]), "1mm")
    assert [c.curve for c in flat.creases] == [Line((0.0, 9.5), (60.0, 9.5)), Line((0.0, 10.5), (60.0, 10.5))]
    arcs = [c.curve for c in meshes.wide_creases(SECTOR, 2.0).creases]
    assert [arc.radius for arc in arcs if isinstance(arc, Arc)] == [99.0, 101.0]
    wave = meshes.wide_creases(meshes.sine_tessellation(creases=2), {"crease-2": 1.5})
    assert [c.name for c in wave.creases] == ["crease-1", "crease-2-right", "crease-2-left"]
    import shapely

    middle = shapely.LineString(sample(meshes.sine_tessellation(creases=2).creases[1].curve))
    for crease in wave.creases[1:]:
        assert isinstance(crease.curve, Polyline)
        inner = crease.curve.vertices[5:-5]
        assert np.allclose(shapely.distance(middle, shapely.points(inner)), 0.75, atol=1e-4)
        assert np.allclose(crease.curve.vertices[[0, -1], 0], [0.0, 100.0], atol=1e-9)


@pytest.mark.parametrize(
    ("pattern", "width", "area"),
    [
        (meshes.strip(60.0, 30.0, [10.0, 20.0]), 2.0, 120.0),
        (meshes.full_annulus(50.0, 10.0), 2.0, 200.0 * math.pi),
        (meshes.sine_tessellation(creases=2), 1.5, None),
    ],
)
def test_strips_in_meshes_of_all_kinds(
    pattern: meshes.CreasePattern, width: float, area: float | None
) -> None:
    name = pattern.creases[0].name
    wide = meshes.wide_creases(pattern, width)
    for mesh in (mesh_of(wide, 64, 1), meshes.unstructured(wide, size=3.0)):
        model = bh.Model(mesh, SHEET).wide_crease(name, t=0.1)
        of = model.sections.of
        assert of is not None
        length = pattern.creases[0].curve.length
        assert mesh.areas[of == 1].sum() == pytest.approx(area or width * length, rel=0.01)
        assert rebuild(*describe(model)).zones == model.zones


def cantilever(formulation: str, width: float, k: float, load: float) -> tuple[float, float]:
    """Rise of the end of a clamped strip whose middle is a crease of that width (0: sharp), and its closed form, mm."""
    pattern = meshes.strip(20.0, 40.0, [20.0])
    flat = bh.Sheet(E=4000.0, nu=0.0, t=0.2)
    along, rows, kind = (8, 8, "alternating") if formulation == "consistent" else (4, 4, "mirrored")
    mesh = mesh_of(meshes.wide_creases(pattern, width) if width else pattern, along, rows, kind)
    model = bh.Model(mesh, flat, formulation=formulation).support("edge:inner", "xyz", clamp=True)
    model = model.wide_crease("crease", stiffness=k) if width else model.crease("crease", stiffness=k)
    state = bh.trace(
        model.step(bh.LineForce("edge:outer", (0.0, 0.0, load))), estimate=False, neighbours=False
    )[-1]
    D, a = flat.bending_stiffness(), 20.0
    within = (width**3 / 12.0 + width * a**2) / width / k if width else a**2 / k
    return float(state.displacement("edge:outer")[:, 2].mean()), load * (within + (2.0 * a) ** 3 / (3.0 * D))


@pytest.mark.parametrize(("formulation", "tolerance"), [("consistent", 5e-3), ("shell", 1e-4)])
def test_closed_form_and_the_sharp_limit(formulation: str, tolerance: float) -> None:
    """The strip turns by M / k and the sheet's own share: off the sharp crease by w^2 / (12 a^2) only, order 2."""
    k, load = 0.2, 1e-7
    for width in (4.0, 0.0):
        found, exact = cantilever(formulation, width, k, load)
        assert found == pytest.approx(exact, rel=tolerance)
    wide, half, sharp = (cantilever(formulation, width, k, load)[1] for width in (4.0, 2.0, 0.0))
    assert (wide - sharp) / (half - sharp) == pytest.approx(4.0, rel=1e-6)


def folded(formulation: str, width: float, along: int, rows: int, kind: str) -> bh.State:
    mesh = mesh_of(meshes.wide_creases(SECTOR, width) if width else SECTOR, along, rows, kind)
    model = bh.Model(mesh, SHEET, formulation=formulation)
    if width:
        model = model.wide_crease("crease", Lstar=20.0).fold("crease", rest=math.pi - 1.0)
    else:
        model = model.fold("crease", rest=math.pi - 1.0, Lstar=20.0)
    return bh.trace(model, estimate=False, neighbours=False).require()[-1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("formulation", "along", "rows", "kind"),
    [("consistent", 64, 4, "alternating"), ("shell", 24, 2, "mirrored")],
)
def test_curved_crease_goes_to_the_sharp_one(formulation: str, along: int, rows: int, kind: str) -> None:
    """Fold angles at a rate of 1.5 or more, energies to 5 % at half a millimetre; a mountain stays a mountain."""
    sharp, *wide = (folded(formulation, width, along, rows, kind) for width in (0.0, 2.0, 1.0, 0.5))
    off = [sharp.fold_angle("crease").mean() - state.fold_angle("crease").mean() for state in wide]
    assert 0.0 < off[2] < off[1] < off[0] < 0.03
    assert math.log2(off[0] / off[1]) > 1.5
    assert wide[2].energy.total == pytest.approx(sharp.energy.total, rel=0.05)
    assert wide[0].energy.total > 1.5 * sharp.energy.total  # a wide strip of a curved crease has to stretch


@pytest.mark.slow
def test_both_formulations_of_a_wide_crease() -> None:
    one = folded("consistent", 1.0, 96, 8, "alternating")
    two = folded("shell", 1.0, 48, 2, "mirrored")
    assert one.energy.total == pytest.approx(two.energy.total, rel=0.02)
    assert one.fold_angle("crease").mean() == pytest.approx(two.fold_angle("crease").mean(), rel=1e-3)


def test_scene(tmp_path: Path) -> None:
    scene = parse_scene(SCENE)
    assert scene.model.zones[0].where == "strip:crease"
    every = parse_scene(SCENE.replace("creases.crease", "creases.all"))
    assert every.model.zones == scene.model.zones
    made = parse_scene(SCENE.replace("Lstar = 20", "stiff = 0.1"))
    assert abs(made.model.zones[0].sheet.E - 400.0) < 1e-9
    state = bh.trace(scene.model, estimate=False, neighbours=False)[-1]
    assert state.fold_angle("crease").mean() == pytest.approx(math.pi - 2.1, rel=0.05)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('width = "1.5mm"', "width = -1", "creases.crease.width = -1 cannot be"),
        ('width = "1.5mm"', 'width = "1.5kg"', "creases.crease.width"),
        ('width = "1.5mm"', "width = 30", "is 30 mm wide and leaves the sheet"),
        (
            "Lstar = 20",
            "Lstar = 20\nt = 0.1",
            "creases.crease has Lstar, from which its thickness follows, and t; leave out one",
        ),
        ("Lstar = 20", "", "needs Lstar or stiffness, or what its strip is made of"),
        ("Lstar = 20", "Lstar = 20\nrest = 2", "unknown key creases.crease.rest"),
        ("creases.crease", "creases.cease", "did you mean 'crease'"),
        ("rest =", "to =", "is a strip and has no line whose angle could be imposed: give rest"),
        (
            'fold = { crease = "crease", rest = "2.1rad" }',
            'pinch = { crease = "crease" }',
            "is a strip, not a line",
        ),
        (
            "[mesh]",
            '[model]\nformulation = "bars-and-hinges"\n[mesh]',
            "zones or wide creases by 'consistent' or",
        ),
    ],
)
def test_bad_input_is_one_line(old: str, new: str, said: str) -> None:
    with pytest.raises(bh.InputError, match=said) as caught:
        bh.trace(parse_scene(SCENE.replace(old, new)).model)
    assert "\n" not in str(caught.value)


def two(text: str) -> str:
    """The scene of a plain strip of two creases, with these tables of creases."""
    pattern = '[pattern]\nkind = "strip"\nlength = 60\nwidth = 30\ncreases = [10, 20]\n'
    mesh = '[sheet]\nE = 4000.0\nt = 0.2\n[mesh]\nkind = "alternating"\nalong = 8\nrows = 1\n'
    return f'{pattern}{mesh}{text}\n[[steps]]\nfold = {{ crease = "all", rest = 2.5 }}'


def test_one_wide_crease_beside_a_sharp_one() -> None:
    """Either is folded alone, and both by "all"; the table for all leaves creases with a table of their own."""
    model = parse_scene(two("[creases.all]\nwidth = 2\nLstar = 20\n[creases.crease-2]\nLstar = 5")).model
    assert model.mesh.creases == ("crease-1-right", "crease-1-left", "crease-2")
    for crease, folded in (("crease-1", "1"), ("crease-2", "2"), ("all", "12")):
        state = bh.trace(replace(model, steps=()).fold(crease, rest=2.5), estimate=False, neighbours=False)[
            -1
        ]
        for number in "12":
            angle = state.fold_angle(f"crease-{number}").mean()
            assert angle == pytest.approx(math.pi - 2.5 if number in folded else 0.0, abs=1e-6)
            assert state.dihedral(f"crease-{number}").mean() == pytest.approx(math.pi - angle, abs=1e-12)


def test_angles_of_wide_creases_are_read_as_those_of_sharp_ones() -> None:
    """A sweep has them in place of the two flat lines, and can measure them; steps can end by them."""
    text = two("[creases.all]\nwidth = 2\nLstar = 20\n[creases.crease-2]\nLstar = 5")
    model = parse_scene(text).model
    for observable in ("fold_angle", "dihedral"):
        Measure("angle", observable, "crease-1").check(model)
    with pytest.raises(bh.InputError, match="is a strip, not a line"):
        Measure("moment", "moment", "crease-1").check(model)
    until = bh.Until("fold_angle", 0.3, of="crease-1")
    step = replace(model.steps[0], until=until)
    path = bh.trace(replace(model, steps=(step,)), estimate=False, neighbours=False).require()
    assert path[-1].fold_angle("crease-1").mean() == pytest.approx(0.3, abs=1e-5)
    measured = SceneTask(text, {}).measure(path)
    assert {k for k in measured if k.startswith("dihedral_")} == {
        f"dihedral_crease-{n}{end}" for n in "12" for end in ("", "_min", "_max")
    }


def test_a_strip_is_told_once() -> None:
    """What is given beside a sheet is not left out; strips are taken out of zones in any order, not out of strips."""
    mesh = mesh_of(meshes.wide_creases(SECTOR, 1.0), 12, 2)
    model, other = bh.Model(mesh, SHEET), bh.Sheet(E=2000.0, t=0.1)
    assert model.wide_crease("crease", sheet=other, stiff=0.5).zones[0].sheet.E == 1000.0
    with pytest.raises(bh.InputError, match="has Lstar, from which its thickness follows, and sheet;"):
        model.wide_crease("crease", Lstar=20.0, sheet=other)
    with pytest.raises(bh.InputError, match="no wide crease 'no'"):
        model.wide_crease("no", sheet=other)
    for made in (
        model.zone("all", t=0.3).wide_crease("crease", t=0.1),
        model.wide_crease("crease", t=0.1).zone("all", t=0.3),
    ):
        assert made.sections.of is not None
        t = np.array([sheet.t for sheet in made.sections.sheets])[made.sections.of]
        assert set(t) == {0.1, 0.3}
    with pytest.raises(bh.InputError, match="zones 1 and 2 overlap at"):
        _ = model.wide_crease("crease", t=0.1).wide_crease("crease", t=0.05).sections


def test_patterns_that_cannot() -> None:
    cross = meshes.CreasePattern(
        rings=(np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]]),),
        creases=(
            meshes.Crease("a", Line((0.0, 10.0), (20.0, 10.0))),
            meshes.Crease("b", Line((10.0, 10.0), (10.0, 20.0))),
        ),
    )
    tight = meshes.strip(20.0, 20.0, [10.0])
    cases: tuple[tuple[meshes.CreasePattern, Any, str], ...] = (
        (cross, {"a": 1.0}, "crease 'a' is 1 mm wide and meets crease 'b'"),
        (cross, {"b": 1.0}, r"crease 'b' ends at \(10, 10\) inside the sheet"),
        (tight, {"crease": "nan"}, "nan"),
        (tight, {"no": 1.0}, "no single crease 'no'"),
        (meshes.strip(60.0, 30.0, [14.0, 16.0]), 3.0, "meets crease"),
        (meshes.full_annulus(5.0, 4.9), 11.0, "turns on less than half its width"),
    )
    for pattern, width, said in cases:
        with pytest.raises(bh.InputError, match=said):
            meshes.wide_creases(pattern, width)


def test_a_strip_in_a_zone_is_in_place_of_that_zone() -> None:
    """It turns as the sharp crease and the zone's sheet do: a zone of everything is a sheet of that thickness."""
    mesh = mesh_of(meshes.wide_creases(meshes.strip(20.0, 40.0, [20.0]), 2.0), 4, 2)
    around = bh.Sheet(E=4000.0, nu=0.3, t=0.3)
    plain, zoned = bh.Model(mesh, around), bh.Model(mesh, SHEET).zone("all", t=0.3)
    k = 0.2
    made = zoned.wide_crease("crease", stiffness=k).zones[1].sheet
    assert made == plain.wide_crease("crease", stiffness=k).zones[0].sheet
    assert 2.0 / made.bending_stiffness() == pytest.approx(1.0 / k + 2.0 / around.bending_stiffness())
    # Lstar is that of the sheet of the model, as of sharp creases
    by_length = zoned.wide_crease("crease", Lstar=SHEET.bending_stiffness(nu=0.0) / k).zones[1].sheet
    assert by_length.t == pytest.approx(made.t, rel=1e-12)
    text = SCENE.replace("[mesh]", '[[zones]]\nwhere = "all"\nt = 0.3\n[mesh]').replace(
        "Lstar = 20", "stiffness = 0.2"
    )
    in_scene = parse_scene(text).model
    plain = bh.Model(in_scene.mesh, around).wide_crease("crease", stiffness=k)
    assert in_scene.zones[1].sheet == plain.zones[0].sheet


def test_strips_across_zones_and_zones_behind_strips_are_refused() -> None:
    mesh = mesh_of(meshes.wide_creases(meshes.strip(20.0, 40.0, [20.0]), 2.0), 4, 2)
    half = [[0.0, 0.0], [10.0, 0.0], [10.0, 40.0], [0.0, 40.0]]
    model = bh.Model(mesh, SHEET)
    with pytest.raises(bh.InputError, match="wide crease 'crease' lies in zone 1 and the sheet around it"):
        model.zone(half, t=0.3).wide_crease("crease", Lstar=20.0)
    strip = model.wide_crease("crease", Lstar=20.0)
    with pytest.raises(
        bh.InputError, match=r"wide crease 'crease' has Lstar or stiffness .*give sheet and zones before"
    ):
        strip.zone("all", t=0.3)
    assert strip.zone("all", t=SHEET.t).sections.of is not None
    assert strip.zone("face:5,5", t=0.3).sections.of is not None


def test_messages_name_the_crease_that_was_drawn_and_the_mend() -> None:
    pattern = meshes.wide_creases(meshes.strip(60.0, 30.0, [10.0, 20.0]), {"crease-1": 2.0})
    with pytest.raises(bh.InputError, match="19 mm wide and meets crease 'crease-1', which is wide, too;"):
        meshes.wide_creases(pattern, {"crease-2": 19.0})
    mesh = mesh_of(pattern, 8, 1)
    with pytest.raises(bh.InputError, match=r"no crease 'no'; its creases: crease-1, crease-2$"):
        mesh.crease_edges("no")
    with pytest.raises(
        bh.InputError, match="'crease-1' has a width, so it is a strip, not a line: fold it by rest"
    ):
        bh.trace(bh.Model(mesh, SHEET).step(bh.Moment("crease-1", 0.1)))
    model = bh.Model(mesh, SHEET).wide_crease("crease-1", Lstar=20.0)
    with pytest.raises(
        bh.InputError, match="'crease-1' has Lstar, but crease 'crease-1' is a strip: leave Lstar out"
    ):
        bh.trace(model.fold("crease-1", rest=2.5, Lstar=5.0))
    with pytest.raises(bh.InputError, match=r"'all' has Lstar, but .* lines for each of them .creases.NAME"):
        bh.trace(model.fold("all", rest=2.5, Lstar=5.0))
    with pytest.raises(bh.InputError, match="'all' has by, but crease 'crease-1' is a strip"):
        bh.trace(model.fold("all", by=0.5))
    with pytest.raises(bh.InputError, match="has Lstar and stiffness, which are two ways"):
        model.wide_crease("crease-1", Lstar=20.0, stiffness=1.0)


def test_reports_tell_wide_creases_by_their_own_name() -> None:
    """The two lines that stand for one are no creases that somebody drew."""
    scene = parse_scene(two("[creases.crease-1]\nwidth = 2\nLstar = 20\n[creases.crease-2]\nLstar = 5"))
    mesh = scene.model.mesh
    lines = report(scene)
    assert "crease crease-1: a strip, 60 mm long and 2 mm wide" in lines
    assert not any("-left" in line or "-right" in line for line in lines)
    assert "2 creases" in repr(mesh)
    assert "2 creases" in repr(scene.model)
    panels = Panels.of(mesh)
    named = [panels.name(i).partition(" (")[2] for i in range(len(panels.creases))]
    assert sorted(named) == [
        "at crease-1)",
        "at crease-2)",
        "between crease-1 and crease-2)",
        "strip of crease-1)",
    ]
    legend = pattern_chart(scene.model).axes[0].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["wide crease", "mountain crease"]
    labels = [text.get_text() for text in report_figure(scene).legends[0].get_texts()]
    assert labels == ["boundary", "wide crease", "mountain"]


@pytest.mark.parametrize("given", [{"by": 1.0}, {"rest": 2.0}, {"rest": 2.0, "Lstar": 20.0}])
@pytest.mark.parametrize("side", ["left", "right"])
def test_one_edge_of_a_strip_is_not_folded(side: str, given: dict[str, Any]) -> None:
    """It was, without a word."""
    mesh = mesh_of(meshes.wide_creases(meshes.strip(40.0, 20.0, [10.0]), 2.0), 8, 2)
    model = bh.Model(mesh, SHEET).wide_crease("crease", Lstar=20.0)
    with pytest.raises(bh.ModelError, match="one edge of the strip of wide crease 'crease' and stays flat"):
        bh.trace(model.fold(f"crease-{side}", **given))


def test_a_strip_of_another_sheet_says_what_has_changed() -> None:
    mesh = mesh_of(meshes.wide_creases(meshes.strip(40.0, 20.0, [10.0]), 2.0), 8, 2)
    model = bh.Model(mesh, SHEET).wide_crease("crease", Lstar=20.0).fold("crease", rest=2.0)
    with pytest.raises(bh.ModelError, match="the sheet there is another one now"):
        bh.trace(replace(model, sheet=replace(SHEET, t=2.0 * SHEET.t)))
