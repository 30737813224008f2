"""SVG and DXF crease patterns: what lines stand for, what is healed, what is refused, what is written."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from ezdxf.filemanagement import new, readfile

import meshes
from meshes import CreasePattern, FileFormatError, structured, unstructured
from meshes.curves import sample
from meshes.io import read_drawn, read_pattern, write_pattern
from meshes.unstructured import sheet_area

DATA = Path(__file__).parents[1] / "data"
SQUARE = '<rect x="0" y="0" width="100" height="60" stroke="black" fill="none"/>'


def svg(tmp_path: Path, body: str, head: str = 'width="100mm" height="60mm" viewBox="0 0 100 60"') -> Path:
    file = tmp_path / "sheet.svg"
    space = 'xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
    file.write_text(f"<svg {space} {head}>{body}</svg>", encoding="utf-8")
    return file


def line(x1: float, y1: float, x2: float, y2: float, look: str = 'stroke="red"') -> str:
    return f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" {look}/>'


def folds(pattern: CreasePattern) -> dict[str, str]:
    return {crease.name: crease.fold for crease in pattern.creases}


def refused(tmp_path: Path, body: str, **options: Any) -> str:
    with pytest.raises(FileFormatError) as caught:
        read_pattern(svg(tmp_path, body), **options)
    message = str(caught.value)
    assert message.startswith(str(tmp_path))
    assert "\n" not in message
    return message


class TestMeaning:
    @pytest.mark.parametrize(
        ("look", "fold"),
        [
            ('stroke="red"', "mountain"),
            ('stroke="#0000FF"', "valley"),
            ('style="stroke:rgb(230,10,10)"', "mountain"),
            ('stroke="#2030d0"', "valley"),
            ('stroke="magenta"', "flat"),
            ('stroke="black" stroke-dasharray="4 2"', "valley"),
            ('stroke="black" stroke-dasharray="6 2 1 2"', "mountain"),
        ],
    )
    def test_colours_and_dashes(self, tmp_path: Path, look: str, fold: str) -> None:
        pattern = read_pattern(svg(tmp_path, SQUARE + line(40, 0, 60, 60, look)))
        assert [crease.fold for crease in pattern.creases] == [fold]

    def test_layers_come_before_colours(self, tmp_path: Path) -> None:
        body = f'<g inkscape:label="Valley folds">{line(40, 0, 60, 60)}</g>'
        assert folds(read_pattern(svg(tmp_path, SQUARE + body))) == {"v1": "valley"}

    def test_a_mapping_comes_before_all(self, tmp_path: Path) -> None:
        file = svg(
            tmp_path,
            SQUARE + f'<g id="scores">{line(40, 0, 60, 60)}</g>' + line(70, 0, 80, 60, 'stroke="#888"'),
        )
        for lines, wanted in (
            ({"red": "valley", "#888888": "ignore"}, {"v1": "valley"}),
            (
                {"layer:scores": "valley", "red": "flat", "#888": "mountain"},
                {"m1": "mountain", "v1": "valley"},
            ),
        ):
            assert folds(read_pattern(file, lines=lines)) == wanted

    def test_facets_are_no_creases(self, tmp_path: Path) -> None:
        pattern = read_pattern(svg(tmp_path, SQUARE + line(0, 30, 100, 30, 'stroke="yellow"')))
        assert not pattern.creases
        assert len(pattern.facets) == 1
        mesh = unstructured(pattern, size=10.0)
        assert np.allclose(mesh.points[mesh.nodes("edge:facet"), 1], 30.0)

    def test_opacity_is_the_fold_angle(self, tmp_path: Path) -> None:
        body = line(30, 0, 30, 60, 'stroke="red" stroke-opacity="0.5"') + line(60, 0, 60, 60, 'stroke="blue"')
        mesh = structured(read_pattern(svg(tmp_path, SQUARE + body)), along=4, kind="alternating")
        assert mesh.fold_angles["m1"] == pytest.approx(np.full(4, math.pi / 2))
        assert mesh.fold_angles["v1"] == pytest.approx(np.full(4, -math.pi))

    @pytest.mark.parametrize(
        ("lines", "words"),
        [
            ({"mauve": "mountain"}, ["mauve", "names no line"]),
            ({"red": "hill"}, ["hill", "mountain, valley"]),
            ({"dash:wavy": "valley"}, ["dash:wavy"]),
        ],
    )
    def test_bad_mappings(self, tmp_path: Path, lines: dict[str, str], words: list[str]) -> None:
        message = refused(tmp_path, SQUARE, lines=lines)
        assert all(word in message for word in words)

    def test_unknown_colour_is_named(self, tmp_path: Path) -> None:
        message = refused(tmp_path, SQUARE + line(40, 0, 60, 60, 'stroke="#808080" id="odd"'))
        assert "'odd'" in message
        assert "#808080" in message
        assert "lines = {" in message


class TestUnits:
    @pytest.mark.parametrize(
        ("head", "size"),
        [
            ('width="100mm" height="60mm" viewBox="0 0 100 60"', 100.0),
            ('width="20cm" height="12cm" viewBox="0 0 100 60"', 200.0),
            ('viewBox="0 0 100 60"', 100.0 * 25.4 / 96.0),
            ('width="50mm" height="30mm" viewBox="0 0 100 60"', 50.0),
        ],
    )
    def test_svg(self, tmp_path: Path, head: str, size: float) -> None:
        ring = read_pattern(svg(tmp_path, SQUARE, head)).rings[0]
        assert np.ptp(ring, axis=0) == pytest.approx([size, 0.6 * size], rel=1e-6)
        assert ring.min(axis=0) == pytest.approx([0.0, 0.0])

    def test_scale_and_fit(self, tmp_path: Path) -> None:
        file = svg(tmp_path, SQUARE, 'viewBox="0 0 100 60"')
        assert sheet_area(read_pattern(file, scale=2.0)) == pytest.approx(4 * 6000.0)
        assert sheet_area(read_pattern(file, fit=50.0)) == pytest.approx(1500.0)
        many: list[dict[str, Any]] = [{"scale": -1.0}, {"fit": math.nan}, {"scale": 1.0, "fit": 2.0}]
        for wrong in many:
            with pytest.raises(FileFormatError, match=r"scale|fit"):
                read_pattern(file, **wrong)

    def test_fit_measures_curves(self, tmp_path: Path) -> None:
        disc = '<path d="M0,30 C0,-10 100,-10 100,30 C100,70 0,70 0,30 Z" stroke="black" fill="none"/>'
        ring = read_pattern(svg(tmp_path, disc), fit=80.0).rings[0]
        assert np.ptp(ring, axis=0).max() == pytest.approx(80.0, rel=1e-4)

    def test_what_is_seen_is_what_is_read(self, tmp_path: Path) -> None:
        """y points down on paper and up in the sheet: nothing is mirrored."""
        pattern = read_pattern(svg(tmp_path, SQUARE + line(0, 10, 100, 20)))
        assert sample(pattern.creases[0].curve)[np.array([0, -1])] == pytest.approx(
            np.array([[0, 50], [100, 40]])
        )

    @pytest.mark.parametrize(("unit", "size"), [(4, 100.0), (1, 2540.0), (5, 1000.0), (0, 100.0)])
    def test_dxf(self, tmp_path: Path, unit: int, size: float) -> None:
        drawing = new(units=unit)
        drawing.modelspace().add_lwpolyline([(5, 5), (105, 5), (105, 65), (5, 65)], close=True)
        drawing.saveas(tmp_path / "a.dxf")
        ring = read_pattern(tmp_path / "a.dxf").rings[0]
        assert np.ptp(ring, axis=0)[0] == pytest.approx(size)
        assert ring.min() == pytest.approx(5.0 * size / 100.0)  # a DXF file keeps its coordinates


class TestCurves:
    def test_tolerance(self, tmp_path: Path) -> None:
        """A quarter turn of radius 50 keeps within the tolerance, and needs more points for a smaller one."""
        body = SQUARE + '<path d="M10,0 A50,50 0 0,0 60,50 L60,60" stroke="red"/>'
        counts = []
        for tolerance in (0.1, 0.001):
            points = sample(read_pattern(svg(tmp_path, body), tolerance=tolerance).creases[0].curve)
            arc = points[points[:, 1] > 10.0]
            middle = 0.5 * (arc[1:] + arc[:-1])
            off = 50.0 - np.linalg.norm(middle - (60.0, 60.0), axis=1)
            assert off.max() <= 1.02 * tolerance
            assert off.max() >= 0.2 * tolerance
            counts.append(len(points))
        assert counts[1] > 5 * counts[0]

    def test_dxf_curves(self, tmp_path: Path) -> None:
        drawing = new(units=4)
        space = drawing.modelspace()
        space.add_lwpolyline([(0, 0), (100, 0), (100, 60), (0, 60)], close=True)
        space.add_circle((50, 30), 10, dxfattribs={"color": 1})
        space.add_arc((0, 0), 20, 0, 90, dxfattribs={"color": 5})
        space.add_lwpolyline([(80, 0, 0, 0, 0.3), (80, 60)], dxfattribs={"layer": "Mountain"})
        space.add_text("a note")
        drawing.saveas(tmp_path / "a.dxf")
        pattern = read_pattern(tmp_path / "a.dxf")
        lengths = {crease.name: crease.curve.length for crease in pattern.creases}
        bulge = 60.0 / math.sin(2 * math.atan(0.3)) * 2 * math.atan(0.3)
        assert lengths["m1"] == pytest.approx(20 * math.pi, rel=1e-3)
        assert lengths["m2"] == pytest.approx(bulge, rel=1e-3)
        assert lengths["v1"] == pytest.approx(10 * math.pi, rel=1e-3)
        assert pattern.creases[0].curve.closed


class TestHealing:
    def test_gaps_and_t_junctions(self, tmp_path: Path) -> None:
        """The outline has open corners, one crease stops short of it, another overshoots, two meet in a T."""
        body = (
            line(0.1, 0, 100, 0, 'stroke="black"') + line(100, 0.1, 100, 60, 'stroke="black"')
            + line(99.9, 60, 0, 60, 'stroke="black"') + line(0, 59.9, 0, 0, 'stroke="black"')
            + line(40, 0.1, 40, 60.1) + line(40.1, 30, 100, 30, 'stroke="blue"')
        )  # fmt: skip
        pattern = read_pattern(svg(tmp_path, body), gap=0.2)
        assert folds(pattern) == {"m1": "mountain", "m2": "mountain", "v1": "valley"}
        mesh = unstructured(pattern, size=10.0)
        assert mesh.areas.sum() == pytest.approx(6000.0, rel=5e-3)
        ends = {tuple(np.round(sample(c.curve)[k], 6)) for c in pattern.creases for k in (0, -1)}
        assert len(ends) == 4  # three on the outline and the T

    def test_open_outline_is_named(self, tmp_path: Path) -> None:
        body = '<path id="frame" d="M0,3 L0,60 L100,60 L100,0 L0,0" stroke="black"/>' + line(50, 0, 50, 60)
        message = refused(tmp_path, body)
        assert "'frame'" in message
        assert "ends loosely at (0, 57)" in message
        assert "gap = 3.2" in message
        assert folds(read_pattern(svg(tmp_path, body), gap=3.2)) == {"m1": "mountain"}

    def test_crossings_get_a_vertex(self, tmp_path: Path) -> None:
        pattern = read_pattern(
            svg(tmp_path, SQUARE + line(0, 0, 100, 60) + line(0, 60, 100, 0, 'stroke="blue"'))
        )
        assert len(pattern.creases) == 4
        assert {tuple(np.round(sample(c.curve)[-1], 6)) for c in pattern.creases} | {
            tuple(np.round(sample(c.curve)[0], 6)) for c in pattern.creases
        } >= {(50.0, 30.0)}

    def test_lines_drawn_twice(self, tmp_path: Path) -> None:
        again = line(40, 0, 60, 60) + line(60, 60, 40, 0) + line(45, 15, 55, 45)
        pattern = read_pattern(svg(tmp_path, SQUARE + again))
        assert [c.curve.length for c in pattern.creases] == pytest.approx([math.hypot(20, 60)])
        upper = read_pattern(
            svg(tmp_path, SQUARE + line(40, 0, 60, 60) + line(60, 60, 40, 0, 'stroke="blue"'))
        )
        assert [c.fold for c in upper.creases] == ["valley"]  # what is drawn later is what one sees
        (remark,) = [text for text in upper.remarks if "lie over each other" in text]
        assert "(mountain)" in remark
        assert "(valley)" in remark

    def test_what_sticks_out_a_little_is_cut_off(self, tmp_path: Path) -> None:
        file = svg(tmp_path, SQUARE + line(40, -0.5, 40, 60))  # ten times the gap
        pattern = read_pattern(file)
        assert [c.curve.length for c in pattern.creases] == pytest.approx([60.0])
        assert any("stick out of the sheet by up to 0.5 mm" in text for text in pattern.remarks)
        mesh = read_drawn(file)
        assert mesh.areas.sum() == pytest.approx(6000.0)
        assert mesh.folds["m1"] == "mountain"

    def test_a_curve_drawn_twice(self, tmp_path: Path) -> None:
        curve = '<path d="M40,0 C60,20 60,40 40,60" stroke="red"/>'
        assert len(read_pattern(svg(tmp_path, SQUARE + curve + curve)).creases) == 1

    def test_near_misses_are_remarked(self, tmp_path: Path) -> None:
        pattern = read_pattern(svg(tmp_path, SQUARE + line(50, 0, 50, 59.5)), gap=0.1)
        (remark,) = pattern.remarks
        assert "ends inside the sheet at (50, 0.5)" in remark
        assert "gap = 0.5" in remark

    @pytest.mark.parametrize(
        ("body", "words"),
        [
            ("", ["no line"]),
            (line(0, 0, 100, 0), ["no closed outline"]),
            (SQUARE + line(50, 0, 50, 80), ["leaves the sheet at (50, -10)"]),
            (SQUARE + '<rect x="200" y="0" width="50" height="60" stroke="black"/>', ["2 separate sheets"]),
        ],
        ids=["empty", "open", "outside", "two"],
    )
    def test_what_cannot_be(self, tmp_path: Path, body: str, words: list[str]) -> None:
        message = refused(tmp_path, body)
        assert all(word in message for word in words), message

    def test_files_that_cannot_be(self, tmp_path: Path) -> None:
        (tmp_path / "a.svg").write_text("this is no drawing")
        (tmp_path / "a.dxf").write_text("neither is this")
        (tmp_path / "b.svg").write_text(
            '<svg xmlns="http://www.w3.org/2000/svg"><path d="M 0 0 L" stroke="red"/></svg>'
        )
        (tmp_path / "c.svg").mkdir()
        for name in ("a.svg", "a.dxf", "b.svg", "c.svg", "none.svg", "none.dxf", "sheet.pdf"):
            with pytest.raises(FileFormatError) as caught:
                read_pattern(tmp_path / name)
            assert "\n" not in str(caught.value)
            assert name in str(caught.value)


class TestNetworks:
    def test_holes_and_closed_creases(self, tmp_path: Path) -> None:
        body = (
            SQUARE
            + '<circle cx="30" cy="30" r="8" stroke="black"/><circle cx="70" cy="30" r="12" stroke="red"/>'
        )
        pattern = read_pattern(svg(tmp_path, body))
        assert len(pattern.rings) == 2
        assert pattern.creases[0].curve.closed
        mesh = unstructured(pattern, size=4.0)
        assert mesh.areas.sum() == pytest.approx(6000.0 - 64.0 * math.pi, rel=1e-2)
        radius = np.linalg.norm(mesh.points[mesh.nodes("crease:m1"), :2] - (70.0, 30.0), axis=1)
        assert radius == pytest.approx(np.full(len(radius), 12.0), abs=1e-2)

    def test_a_crease_from_a_hole_to_the_rim(self, tmp_path: Path) -> None:
        body = SQUARE + '<circle cx="50" cy="30" r="8" stroke="black"/>' + line(50, 0, 50, 22)
        mesh = unstructured(read_pattern(svg(tmp_path, body)), size=5.0)
        assert len(mesh.crease_edges("m1")) >= 4

    def test_creases_that_end_inside_and_meet(self, tmp_path: Path) -> None:
        body = SQUARE + line(0, 0, 50, 30) + line(100, 0, 50, 30) + line(50, 30, 50, 45, 'stroke="blue"')
        mesh = unstructured(read_pattern(svg(tmp_path, body)), size=6.0)
        assert set(mesh.creases) == {"mountain", "valley", "m1", "m2", "v1"}
        assert len(mesh.crease_edges("mountain")) == len(mesh.crease_edges("m1")) + len(
            mesh.crease_edges("m2")
        )
        assert mesh.folds["mountain"] == "mountain"

    def test_corners_of_creases_and_outlines_are_nodes(self, tmp_path: Path) -> None:
        body = SQUARE + '<polyline points="0,20 33,41 66,20 100,41" stroke="red" fill="none"/>'
        mesh = unstructured(read_pattern(svg(tmp_path, body)), size=7.0)
        for corner in ((0, 0), (100, 60), (33, 19), (66, 40)):
            assert np.linalg.norm(mesh.points[:, :2] - corner, axis=1).min() < 1e-9

    def test_black_lines_inside_are_facets(self, tmp_path: Path) -> None:
        pattern = read_pattern(svg(tmp_path, SQUARE + line(50, 0, 50, 60, 'stroke="black"')))
        assert len(pattern.facets) == 1
        assert "1 boundary lines lie inside" in pattern.remarks[0]

    def test_drawn_faces(self, tmp_path: Path) -> None:
        body = SQUARE + line(0, 30, 100, 30) + line(50, 0, 50, 60, 'stroke="yellow"')
        mesh = read_drawn(svg(tmp_path, body))
        assert (len(mesh.points), len(mesh.triangles), mesh.kind) == (9, 8, "drawn")
        assert len(mesh.crease_edges("m1")) == 2
        assert len(mesh.edge_sets["edge:flat"]) == 2


class TestRails:
    def test_pleats(self, tmp_path: Path) -> None:
        body = SQUARE + "".join(
            f'<path d="M{x},0 C{x + 8},20 {x + 8},40 {x},60" stroke="{colour}" fill="none"/>'
            for x, colour in ((60, "red"), (20, "red"), (40, "blue"))
        )
        pattern = read_pattern(svg(tmp_path, body))
        assert [crease.name for crease in pattern.creases] == ["m1", "v1", "m2"]
        assert [name for name, _ in pattern.edges] == ["inner", "outer", "start", "end"]
        mesh = structured(pattern, along=12)
        assert mesh.areas.sum() == pytest.approx(6000.0)
        assert np.allclose(mesh.points[mesh.nodes("edge:inner"), 0], 0.0)
        assert np.allclose(mesh.points[mesh.nodes("edge:start"), 1], 0.0)
        assert set(mesh.nodes("edge:boundary")) == set(mesh.topology.boundary.ravel())

    def test_rings(self, tmp_path: Path) -> None:
        body = "".join(
            f'<circle cx="50" cy="50" r="{r}" stroke="{c}" fill="none"/>'
            for r, c in ((30, "blue"), (10, "black"), (40, "black"), (20, "red"))
        )
        pattern = read_pattern(svg(tmp_path, body))
        assert pattern.closed
        assert [crease.name for crease in pattern.creases] == ["m1", "v1"]
        assert structured(pattern, along=40).areas.sum() == pytest.approx(math.pi * 1500.0, rel=1e-2)

    @pytest.mark.parametrize(
        "body",
        [
            line(0, 0, 100, 60) + line(0, 60, 100, 0),
            line(50, 0, 50, 30),
            line(30, 0, 0, 30) + line(60, 0, 100, 30) + line(40, 60, 100, 50),
            '<polyline points="0,20 50,40 100,20" stroke="red" fill="none"/>',
        ],
        ids=["crossing", "open", "not side by side", "with a corner"],
    )
    def test_none(self, tmp_path: Path, body: str) -> None:
        assert not read_pattern(svg(tmp_path, SQUARE + body)).rails


class TestWriting:
    @pytest.mark.parametrize("suffix", [".svg", ".dxf"])
    def test_units_and_layers(self, tmp_path: Path, suffix: str) -> None:
        file = tmp_path / f"out{suffix}"
        write_pattern(file, meshes.annulus_sector([60.0, 80.0], 10.0, 1.2, ["mountain", "valley"]))
        if suffix == ".dxf":
            drawing = readfile(file)
            assert drawing.header["$INSUNITS"] == 4
            arcs = {
                e.dxf.layer: e.dxf.radius
                for e in drawing.modelspace().query("ARC")
                if e.dxf.layer != "boundary"
            }
            assert arcs == {"mountain": 60.0, "valley": 80.0}
            assert drawing.layers.get("mountain").dxf.linetype == "MOUNTAIN"
        else:
            text = file.read_text()
            assert 'inkscape:label="mountain"' in text
            assert "stroke-dasharray" in text
            assert " A80,80 " in text
        back = read_pattern(file)
        assert folds(back) == {"m1": "mountain", "v1": "valley"}
        assert [c.curve.length for c in back.creases] == pytest.approx([72.0, 96.0], rel=1e-4)
        assert back.rails

    def test_perforated(self, tmp_path: Path) -> None:
        write_pattern(tmp_path / "p.dxf", meshes.strip(100.0, 20.0, [10.0]), perforate=(3.0, 1.0))
        dashes = [e for e in readfile(tmp_path / "p.dxf").modelspace() if e.dxf.layer == "mountain"]
        points = np.array(
            [[tuple(p)[:2] for p in (e.dxf.start, e.dxf.end)] for e in dashes if e.dxftype() == "LINE"]
        )
        assert len(dashes) == 25
        assert points[:, :, 0].min() == 0.0
        assert points[:, :, 0].max() == pytest.approx(100.0)
        cut = np.abs(points[:, 1, 0] - points[:, 0, 0])
        assert cut == pytest.approx(np.full(25, 3.0), rel=0.02)

    @pytest.mark.parametrize("suffix", [".svg", ".dxf"])
    @pytest.mark.parametrize("dashes", [(3.0, 1.0), (2.0, 2.0), (1.0, 0.5)])
    def test_perforated_comes_back_as_what_it_was(
        self, tmp_path: Path, suffix: str, dashes: tuple[float, float]
    ) -> None:
        """A wave and a crease with a corner: dashes lie on both sides of it, so that it is not cut off."""
        u = np.linspace(0.0, 1.0, 61)
        wave = meshes.Polyline(np.column_stack((100.0 * u, 45.0 + 4.0 * np.sin(2.0 * np.pi * u))))
        corner = meshes.Polyline(np.array([[0.0, 10.0], [41.3, 10.0], [60.0, 28.0], [100.0, 12.0]]))
        pattern = meshes.CreasePattern(
            rings=(np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 60.0], [0.0, 60.0]]),),
            creases=(meshes.Crease("m1", wave), meshes.Crease("v1", corner, "valley")),
        )
        write_pattern(tmp_path / f"p{suffix}", pattern, perforate=dashes)
        back = read_pattern(tmp_path / f"p{suffix}")
        assert folds(back) == {"m1": "mountain", "v1": "valley"}
        for crease in pattern.creases:
            (found,) = (c for c in back.creases if c.fold == crease.fold)
            assert found.curve.length == pytest.approx(crease.curve.length, rel=1e-3)
            line, again = (shapely.LineString(meshes.curves.sample(c.curve)) for c in (crease, found))
            assert line.hausdorff_distance(again) < 0.03
        assert len(back.remarks) == 1

    def test_a_mesh(self, tmp_path: Path) -> None:
        mesh = structured(meshes.strip(100.0, 20.0, [10.0], "valley"), along=10)
        write_pattern(tmp_path / "m.svg", mesh, facets=True)
        back = read_drawn(tmp_path / "m.svg")
        assert len(back.triangles) == len(mesh.triangles)
        assert back.folds["valley"] == "valley"

    def test_what_cannot_be(self, tmp_path: Path) -> None:
        pattern = meshes.strip(100.0, 20.0)
        cases: list[tuple[str, dict[str, Any], str]] = [
            ("a.pdf", {}, "suffix"), ("a.svg", {"perforate": (0.0, 1.0)}, "perforate"), ("no/a.svg", {}, "folder"),
        ]  # fmt: skip
        for name, options, word in cases:
            with pytest.raises(FileFormatError, match=word):
                write_pattern(tmp_path / name, pattern, **options)


class TestFilesOfOtherPrograms:
    """Files as drawing programs write them (tests/data/README.md); numbers are counted in the files."""

    def test_pleats(self) -> None:
        """Creases in no order, in groups within groups whose names are not ASCII, lengths without a unit."""
        pattern = read_pattern(DATA / "pleats.svg")
        assert list(folds(pattern).values()) == ["valley", "mountain", "valley", "mountain"]
        assert len(pattern.rails) == 6
        assert sheet_area(pattern) == pytest.approx(400.0 * 320.0 * (25.4 / 96.0) ** 2, rel=1e-5)

    def test_miura(self) -> None:
        """6 columns and 5 rows of panels, drawn as zigzags and short lines; each vertex inside has degree four."""
        mesh = read_drawn(DATA / "miura.svg")
        degree = np.bincount(
            np.concatenate([mesh.crease_edges(c) for c in ("mountain", "valley")]).ravel(),
            minlength=len(mesh.points),
        )
        rim = np.zeros(len(mesh.points), dtype=bool)
        rim[mesh.nodes("edge:boundary")] = True
        assert (degree[~rim] == 4).all()
        assert (~rim).sum() == 5 * 4
        # two groups turn it by a quarter, back and forth; without one of them the sides change places
        assert np.ptp(mesh.points[:, :2], axis=0) == pytest.approx(np.array([558.0, 350.0]) * 25.4 / 96.0)

    def test_circular_pleat(self) -> None:
        """Every segment is a line of its own, in either direction, with coordinates of two decimals."""
        mesh = read_drawn(DATA / "ring_pleats.svg")
        assert len(mesh.triangles) == 2 * 5 * 24
        assert len(mesh.crease_edges("mountain")) == len(mesh.crease_edges("valley")) == 2 * 24
        # 5 rings of 24 panels, each with a side and a diagonal in yellow
        assert len(mesh.edge_sets["edge:boundary"]) == 2 * 24
        assert len(mesh.edge_sets["edge:flat"]) == 2 * 5 * 24

    def test_angles_and_short_lines(self) -> None:
        """Two creases part by 0.8 units on a sheet of 3,600; their opacity says 90 degrees."""
        mesh = read_drawn(DATA / "fan.svg")
        assert len(mesh.crease_edges("mountain")) == len(mesh.crease_edges("valley")) == 24
        assert len(mesh.triangles) == 6 * 24 - 1
        assert np.abs(mesh.fold_angles["valley"]) == pytest.approx(np.full(24, math.pi / 2))

    def test_cones(self) -> None:
        """Rulings in black inside the sheet; the end of one misses its vertex by 0.07 of 340 units."""
        pattern = read_pattern(DATA / "cones.svg")
        assert "38 boundary lines lie inside" in pattern.remarks[0]
        mesh = read_drawn(DATA / "cones.svg")
        assert (len(mesh.points), len(mesh.triangles)) == (3 * 21, 2 * 2 * 20)

    def test_facets_that_cross(self) -> None:
        """Lines that cross in one point are cut there, and a view box beside the sheet does not matter."""
        mesh = read_drawn(DATA / "cone_pleat.svg")
        assert (len(mesh.points), len(mesh.triangles)) == (12, 11)


def test_area_is_kept(tmp_path: Path) -> None:
    """Faces of the drawn mesh fill the polygon of the drawing."""
    body = SQUARE + line(0, 20, 100, 40) + line(30, 0, 70, 60, 'stroke="blue"')
    mesh = read_drawn(svg(tmp_path, body))
    assert shapely.polygons(mesh.points[mesh.triangles][:, :, :2]).size == len(mesh.triangles)
    assert mesh.areas.sum() == pytest.approx(6000.0)


def test_places_by_coordinates(tmp_path: Path) -> None:
    mesh = read_drawn(svg(tmp_path, SQUARE + line(0, 20, 100, 40)))
    (node,) = mesh.nodes("near:99,1.5")
    assert mesh.points[node] == pytest.approx([100.0, 0.0, 0.0])
    wrong = {
        "near:1": "two lengths",
        "near:a,b": "two lengths",
        "near:500,0": "from the sheet",
        "near:nan,0": "mm",
    }
    for place, words in wrong.items():
        with pytest.raises(meshes.MeshError, match=words):
            mesh.nodes(place)


def test_dxf_blocks_and_splines(tmp_path: Path) -> None:
    """A block that is inserted turned and scaled, a spline, a layer that is off, and a polyline in inches."""
    drawing = new(units=4)
    block = drawing.blocks.new("leaf")
    block.add_line((0, 0), (1, 0), dxfattribs={"color": 5})
    space = drawing.modelspace()
    space.add_lwpolyline([(0, 0), (100, 0), (100, 60), (0, 60)], close=True)
    space.add_blockref("leaf", (10, 10), dxfattribs={"xscale": 40, "yscale": 40, "rotation": 90})
    space.add_spline([(40, 10), (60, 20), (60, 40), (40, 50)], dxfattribs={"layer": "M"})
    drawing.layers.add("off").off()
    space.add_line((0, 0), (500, 500), dxfattribs={"layer": "off", "color": 3})
    drawing.saveas(tmp_path / "a.dxf")
    pattern = read_pattern(tmp_path / "a.dxf")
    assert folds(pattern) == {"m1": "mountain", "v1": "valley"}
    assert sample(pattern.creases[1].curve) == pytest.approx(np.array([[10, 10], [10, 50]]))
    assert sample(pattern.creases[0].curve)[0] == pytest.approx([40.0, 10.0])


def test_svg_groups_uses_and_transforms(tmp_path: Path) -> None:
    body = (
        SQUARE + '<defs><path id="p" d="M0,0 V60" stroke="red"/></defs><use href="#p" x="30"/>'
        '<g transform="translate(60,0) scale(2,1)" stroke="blue"><path d="M5,0 L5,60"/></g>'
        '<style>.s { stroke: #ff0000; }</style><path class="s" d="M90,0 L90,60"/><text x="5" y="5">a note</text>'
        '<path d="M20,0 V60" stroke="red" visibility="hidden"/><g display="none"><path d="M1,0 V60" stroke="red"/></g>'
        '<rect width="100" height="60" fill="#eee" stroke="none"/>'
    )
    pattern = read_pattern(svg(tmp_path, body))
    found = {crease.name: sample(crease.curve)[0, 0] for crease in pattern.creases}
    assert found == pytest.approx({"m1": 30.0, "v1": 70.0, "m2": 90.0})


class TestLinesThatEndInside:
    """Faces of drawings whose creases end in the middle of a panel are cut there by facet lines."""

    BODY = '<rect width="100" height="60" stroke="black" fill="none"/>'

    def test_a_crease_that_ends_inside_is_kept_and_tied(self, tmp_path: Path) -> None:
        mesh = read_drawn(svg(tmp_path, self.BODY + '<path d="M0 30 H50" stroke="red"/>'))
        assert mesh.areas.sum() == pytest.approx(6000.0)
        (pair,) = mesh.crease_edges("m1")
        assert sorted(mesh.points[pair][:, 0]) == pytest.approx([0.0, 50.0])
        assert any(remark.startswith("facet lines (1) lead on") for remark in mesh.remarks)
        assert len(mesh.points) == 6  # no node is added

    def test_a_crease_that_floats_is_tied_at_both_ends(self, tmp_path: Path) -> None:
        mesh = read_drawn(svg(tmp_path, self.BODY + '<path d="M30 30 H70" stroke="blue"/>'))
        assert mesh.areas.sum() == pytest.approx(6000.0)
        assert len(mesh.crease_edges("v1")) == 1
        assert any(remark.startswith("facet lines (2) lead on") for remark in mesh.remarks)
