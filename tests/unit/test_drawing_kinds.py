"""Kinds of drawings that trip readers up, each with its right value: what a browser draws is what is read."""

from __future__ import annotations

import gzip
import io
import os
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import shapely
from ezdxf.document import Drawing
from ezdxf.filemanagement import new

import bh
from meshes import CreasePattern
from meshes.curves import sample
from meshes.errors import FileFormatError
from meshes.io import read_drawn, read_pattern

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
PAGE = HEAD + 'width="120mm" height="80mm" viewBox="0 0 120 80" fill="none">'
RIM = '<rect width="120" height="80" stroke="black"/>'
RED = '<path d="M0,40 C40,55 80,55 120,40" stroke="red"/>'


def svg(folder: Path, body: str, head: str = PAGE, name: str = "drawing.svg") -> Path:
    file = folder / name
    file.write_text(f"{head}{body}</svg>", encoding="utf-8")
    return file


def area(pattern: CreasePattern) -> float:
    return float(shapely.Polygon(pattern.rings[0], pattern.rings[1:]).area)


def size(pattern: CreasePattern) -> tuple[float, float]:
    width, height = np.ptp(pattern.rings[0], axis=0).tolist()
    return width, height


def lengths(pattern: CreasePattern) -> dict[str, float]:
    found: dict[str, float] = {}
    for crease in pattern.creases:
        found[crease.fold] = found.get(crease.fold, 0.0) + crease.curve.length
    return found


def refused(read: Callable[[], object]) -> str:
    with pytest.raises(FileFormatError) as caught:
        read()
    message = str(caught.value)
    assert "\n" not in message
    return message


# --- SVG -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shape", "hole"),
    [
        ('<rect x="50" y="30" width="20" height="16" transform="rotate(35 60 38)" stroke="black"/>', 320.0),
        (
            '<ellipse cx="60" cy="38" rx="12" ry="6" transform="rotate(50 60 38)" stroke="black"/>',
            72.0 * np.pi,
        ),
        ('<circle cx="50" cy="38" r="6" transform="skewX(20)" stroke="black"/>', 36.0 * np.pi),
        (
            '<polygon points="50,30 70,30 60,46" transform="rotate(10) translate(5 -8)" stroke="black"/>',
            160.0,
        ),
    ],
)
def test_rotated_and_skewed_shapes_keep_their_area(tmp_path: Path, shape: str, hole: float) -> None:
    """Rotations and shears of unit determinant keep areas."""
    pattern = read_pattern(svg(tmp_path, RIM + shape))
    assert area(pattern) == pytest.approx(9600.0 - hole, abs=0.2)


def test_symbols_are_placed_by_their_viewbox(tmp_path: Path) -> None:
    symbol = '<symbol id="s" viewBox="0 0 12 8"><path d="M0,4 L12,4" stroke="red"/></symbol>'
    use = '<use xlink:href="#s" width="60" height="40" y="20"/><use href="#s" x="60" y="20" width="60" height="40"/>'
    pattern = read_pattern(svg(tmp_path, RIM + symbol + use))
    assert lengths(pattern) == {"mountain": pytest.approx(120.0, abs=1e-6)}


def test_percentages_are_of_the_page(tmp_path: Path) -> None:
    body = '<rect width="100%" height="100%" stroke="black"/><line x1="0" y1="50%" x2="100%" y2="50%" stroke="red"/>'
    pattern = read_pattern(svg(tmp_path, body, HEAD + 'width="12cm" height="8cm" fill="none">'))
    assert size(pattern) == pytest.approx((120.0, 80.0))
    assert lengths(pattern) == {"mountain": pytest.approx(120.0)}


def test_a_namespace_is_no_attribute(tmp_path: Path) -> None:
    head = PAGE.replace("<svg ", '<svg xmlns:x="http://ns.example.com/Extensibility/1.0/" ')
    pattern = read_pattern(svg(tmp_path, RIM + RED, head))
    assert area(pattern) == pytest.approx(9600.0)
    assert len(pattern.rings) == 1


@pytest.mark.parametrize(
    "colour",
    ["rgb(255 0 0)", "hsl(0 100% 50%)", "rgb(100%, 0%, 0%)", "red !important", "#f00f", "color(srgb 1 0 0)"],
)
def test_colours_of_css_4(tmp_path: Path, colour: str) -> None:
    pattern = read_pattern(svg(tmp_path, RIM + RED.replace('"red"', f'"{colour}"')))
    assert list(lengths(pattern)) == ["mountain"]


def test_current_colour(tmp_path: Path) -> None:
    pattern = read_pattern(svg(tmp_path, f'<g color="blue">{RED.replace("red", "currentColor")}</g>' + RIM))
    assert list(lengths(pattern)) == ["valley"]


@pytest.mark.parametrize("colour", ["var(--fold)", "url(#gradient)", "oklch(0.6 0.2 30)", "rouge"])
def test_colours_that_are_not_understood_are_named(tmp_path: Path, colour: str) -> None:
    file = svg(tmp_path, RIM + RED.replace('"red"', f'"{colour}"'))
    message = refused(lambda: read_pattern(file))
    assert colour in message
    assert "not understood" in message
    named = svg(tmp_path, RIM + f'<g id="mountain">{RED.replace("red", colour)}</g>')
    assert list(lengths(read_pattern(named))) == ["mountain"]


def test_clip_paths_clip(tmp_path: Path) -> None:
    clip = '<defs><clipPath id="c"><rect width="120" height="80"/></clipPath></defs>'
    style = "<style>.k{clip-path:url(#c)}</style>"
    for group in ('<g clip-path="url(#c)">', '<g class="k">', '<g style="clip-path: url(#c)">'):
        body = clip + style + RIM + group + '<line x1="-30" y1="40" x2="150" y2="40" stroke="red"/></g>'
        assert lengths(read_pattern(svg(tmp_path, body))) == {"mountain": pytest.approx(120.0, abs=1e-3)}
    whole = clip + RIM + f'<g clip-path="url(#c)">{RED}</g>'  # cuts nothing off: curves stay curves
    assert lengths(read_pattern(svg(tmp_path, whole))) == {"mountain": pytest.approx(122.76, abs=0.01)}


def test_illustrators_pixels_are_remarked(tmp_path: Path) -> None:
    head = "<!-- Generator: Adobe Illustrator 24.3.0 -->" + HEAD + 'width="340px" height="227px" fill="none">'
    file = tmp_path / "ai.svg"
    file.write_text(
        head + '<rect width="340" height="227" stroke="black"/>' + RED + "</svg>", encoding="utf-8"
    )
    remarks = " ".join(read_pattern(file).remarks)
    assert "1/72 inch" in remarks
    scale = float(remarks.split("scale = ")[1].split()[0])
    assert size(read_pattern(file, scale=scale * 1.0))[0] == pytest.approx(340.0 * 25.4 / 72.0, rel=1e-4)


def test_a_sheet_without_a_unit_that_cannot_be_meant(tmp_path: Path) -> None:
    body = '<path stroke="black" d="M0 0H1V.6H0Z"/><path stroke="red" d="M0 .3Q.5 .45 1 .3"/>'
    file = svg(tmp_path, body, HEAD + 'viewBox="0 0 1 .6" fill="none">')
    assert "states no unit" in " ".join(read_pattern(file).remarks)
    fitted = read_pattern(file, fit=200.0)
    assert size(fitted)[0] == pytest.approx(200.0)
    assert not fitted.remarks


@pytest.mark.parametrize("packed", ["gzip", "utf-16", "svgz"])
def test_packed_and_other_encodings(tmp_path: Path, packed: str) -> None:
    text = f"{PAGE}{RIM}{RED}</svg>"
    file = tmp_path / ("drawing.svgz" if packed == "svgz" else "drawing.svg")
    if packed == "utf-16":
        file.write_bytes(f'<?xml version="1.0" encoding="utf-16"?>{text}'.encode("utf-16"))
    else:
        file.write_bytes(gzip.compress(text.encode()))
    assert lengths(read_pattern(file)) == {"mountain": pytest.approx(122.76, abs=0.01)}


# --- what lines stand for ------------------------------------------------------------------------------------


def test_a_rim_that_is_drawn_as_a_crease_becomes_the_boundary(tmp_path: Path) -> None:
    pattern = read_pattern(svg(tmp_path, RIM.replace("black", "red") + RED))
    (remark,) = pattern.remarks
    assert "drawn as mountain but is the rim" in remark
    assert area(pattern) == pytest.approx(9600.0)
    assert len(pattern.creases) == 1
    laser = read_pattern(svg(tmp_path, RIM.replace("black", "red") + RED.replace("red", "blue")))
    assert '"#ff0000" = "cut"' in laser.remarks[0]


def test_hull_of_a_drawing_without_outline(tmp_path: Path) -> None:
    file = svg(tmp_path, '<path d="M0,20H100" stroke="red"/><path d="M0,40L50,45L100,60" stroke="blue"/>')
    assert 'outline = "hull"' in refused(lambda: read_pattern(file))
    pattern = read_pattern(file, outline="hull")
    assert area(pattern) == pytest.approx(3000.0)
    assert "hull" in " ".join(pattern.remarks)
    loops = '<path d="M0,20L50,0L100,20L50,40L0,20M50,40V60" stroke="red"/>'  # closed lines, and one that stands out
    assert 'outline = "hull"' in refused(lambda: read_pattern(svg(tmp_path, loops, name="loops.svg")))
    out = svg(tmp_path, RIM + '<path d="M0,20H190" stroke="red"/>', name="out.svg")
    assert 'outline = "hull"' not in refused(lambda: read_pattern(out))
    assert "outline = 'box' is not known" in refused(lambda: read_pattern(file, outline="box"))


SIX = "".join(
    f'<g transform="translate({50 * i} {40 * j})"><rect width="40" height="30" stroke="black"/>'
    f'<path d="M0,{5 + 5 * i}h{40}" stroke="{"red" if (i + j) % 2 == 0 else "blue"}"/></g>'
    for j in range(2)
    for i in range(3)
)


def test_one_of_several_sheets(tmp_path: Path) -> None:
    file = svg(tmp_path, SIX)
    message = refused(lambda: read_pattern(file))
    assert "holds 6 separate sheets (at (20, " in message
    assert "sheet = 1 to 6" in message
    for number in range(1, 7):
        pattern = read_pattern(file, sheet=number)
        column, row = (number - 1) % 3, (number - 1) // 3
        assert list(lengths(pattern)) == ["mountain" if (column + row) % 2 == 0 else "valley"]
        assert pattern.rings[0].min(axis=0) == pytest.approx([0.0, 0.0], abs=1e-9)
        (crease,) = pattern.creases
        assert sample(crease.curve)[:, 1] == pytest.approx(25.0 - 5.0 * column)
    assert size(read_pattern(file, sheet=2, fit=120.0)) == pytest.approx((120.0, 90.0))
    mesh = read_drawn(file, sheet=5)
    assert mesh.areas.sum() == pytest.approx(1200.0)
    assert "sheet = 7 cannot be; the drawing holds the sheets 1 to 6" in refused(
        lambda: read_pattern(file, sheet=7)
    )


def test_a_sheet_keeps_its_place_in_a_dxf_file(tmp_path: Path) -> None:
    def two(drawing: Drawing) -> None:
        red_line(drawing)
        space = drawing.modelspace()
        space.add_lwpolyline([(200, 10), (260, 10), (260, 50), (200, 50)], close=True)
        space.add_line((200, 30), (260, 30), dxfattribs={"color": 5})

    pattern = read_pattern(dxf(tmp_path, two), sheet=2)
    assert pattern.rings[0].min(axis=0) == pytest.approx([200.0, 10.0])
    assert lengths(pattern) == {"valley": pytest.approx(60.0)}


@pytest.mark.parametrize(
    "line",
    ["M30,40 Q60,55 90,40", "M0,40 Q40,60 80,40", "M30,20 C30,60 90,60 90,20", "M20,40 h40 v20"],
)
def test_lines_that_end_inside_are_tied_to_others(tmp_path: Path, line: str) -> None:
    """Faces of the drawing are made where a crease floats in a face, or bends back to itself."""
    mesh = read_drawn(svg(tmp_path, f'{RIM}<path d="{line}" stroke="red"/>'), tolerance=0.3)
    assert mesh.areas.sum() == pytest.approx(9600.0)
    assert any("facet lines" in remark for remark in mesh.remarks)
    corners = mesh.points[mesh.triangles]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert (2.0 * mesh.areas / sides.max(axis=1)).min() > 0.1  # mm, no slivers along the curve


def test_characters_that_cannot_be_printed_are_escaped_in_messages(tmp_path: Path) -> None:
    (tmp_path / "a.dxf").write_bytes(b"  0\nSECTION\n  2\nENTITIES\n  3\x000\nLINE\n  0\nENDSEC\n  0\nEOF\n")
    with pytest.raises(FileFormatError) as told:
        read_pattern(tmp_path / "a.dxf")
    assert str(told.value).isprintable()


def test_perforated_creases_are_joined_with_one_remark(tmp_path: Path) -> None:
    x = np.arange(0.0, 119.0, 4.0)
    wave = 40.0 + 8.0 * np.sin(2.0 * np.pi * np.column_stack((x, x + 2.8)) / 120.0)
    dashes = "".join(
        f"M{a:.3f},{p:.3f} L{a + 2.8:.3f},{q:.3f} "
        for a, (p, q) in zip(x.tolist(), wave.tolist(), strict=True)
    )
    pattern = read_pattern(svg(tmp_path, RIM + f'<path d="{dashes}" stroke="red"/>'))
    assert list(pattern.remarks) == ["30 dashes in line are taken as 1 perforated crease"]
    (crease,) = pattern.creases
    ends = sample(crease.curve)[[0, -1], 0]
    assert sorted(ends.tolist()) == pytest.approx([0.0, 120.0], abs=0.01)
    exact = 40.0 + 8.0 * np.sin(2.0 * np.pi * sample(crease.curve)[:, 0] / 120.0)
    assert np.abs(80.0 - sample(crease.curve)[:, 1] - exact).max() < 0.2


def test_a_perforated_fan_comes_back_up_to_its_tip(tmp_path: Path) -> None:
    """Seven creases of dashes and gaps of 3 and 1 mm that meet at (60, 0) on the rim, mountains and valleys in turn."""
    rays = []
    for k in range(7):
        angle = np.pi * (k + 1) / 8
        along = np.array([np.cos(angle), np.sin(angle)])
        reach = min(60.0 / max(abs(along[0]), 1e-9), 80.0 / along[1])
        dashes = [
            "M{:.3f},{:.3f} L{:.3f},{:.3f}".format(*(60.0, 0.0) + s * along, *(60.0, 0.0) + e * along)
            for s, e in ((s, min(s + 3.0, reach)) for s in np.arange(0.0, reach, 4.0).tolist())
        ]
        rays.append(f'<path d="{" ".join(dashes)}" stroke="{("red", "blue")[k % 2]}"/>')
    pattern = read_pattern(svg(tmp_path, RIM + "".join(rays)))
    (remark,) = pattern.remarks
    assert remark.endswith("dashes in line are taken as 7 perforated creases")
    assert [crease.fold for crease in pattern.creases].count("mountain") == 4
    assert len(pattern.creases) == 7
    for crease in pattern.creases:
        ends = sample(crease.curve)[[0, -1]]
        assert np.linalg.norm(ends - [60.0, 80.0], axis=1).min() < 0.01  # the tip, seen from +z
        assert np.linalg.norm(ends[1] - ends[0]) > 59.0


def test_creases_in_line_that_meet_others_are_no_dashes(tmp_path: Path) -> None:
    lines = "".join(f"M{20 * k},40 h10 M{20 * k + 10},0 v80 M{20 * k + 20},0 v80" for k in range(6))
    pattern = read_pattern(svg(tmp_path, RIM + f'<path d="{lines}" stroke="red"/>'))
    assert not [remark for remark in pattern.remarks if "perforated" in remark]


def test_layers_of_laser_shops(tmp_path: Path) -> None:
    layers = f'<g id="CUT">{RIM}</g><g id="SCORE">{RED.replace("red", "black")}</g>'
    pattern = read_pattern(svg(tmp_path, layers))
    assert list(lengths(pattern)) == ["mountain"]
    assert "layer 'SCORE' does not say which way" in pattern.remarks[0]
    german = f'<g id="Rand">{RIM}</g><g id="Talfalten">{RED.replace("red", "black")}</g>'
    assert "mountain" not in lengths(read_pattern(svg(tmp_path, german.replace("Talfalten", "Tal falte"))))


def test_one_line_by_its_own_name(tmp_path: Path) -> None:
    body = RIM.replace("black", "red") + RED.replace("<path ", '<path id="fold-1" ')
    pattern = read_pattern(svg(tmp_path, body), lines={"id:fold-1": "valley", "red": "boundary"})
    assert list(lengths(pattern)) == ["valley"]
    assert not pattern.remarks


# --- DXF -----------------------------------------------------------------------------------------------------


def dxf(folder: Path, draw: Callable[[Drawing], None], units: int | None = 4) -> Path:
    drawing = new("R2010", units=units or 0)
    space = drawing.modelspace()
    space.add_lwpolyline([(0, 0), (120, 0), (120, 80), (0, 80)], close=True)
    draw(drawing)
    file = folder / "drawing.dxf"
    drawing.saveas(file)
    if units is None:
        text = file.read_text(encoding="utf-8").replace("$INSUNITS", "$XXSUNITS")
        file.write_text(text, encoding="utf-8")
    return file


def red_line(drawing: Drawing) -> None:
    drawing.modelspace().add_line((0, 40), (120, 40), dxfattribs={"color": 1})


def test_a_file_without_units_is_in_mm(tmp_path: Path) -> None:
    assert size(read_pattern(dxf(tmp_path, red_line, units=None))) == pytest.approx((120.0, 80.0))


def test_metres_that_cannot_be_meant_are_remarked(tmp_path: Path) -> None:
    pattern = read_pattern(dxf(tmp_path, red_line, units=6))
    assert size(pattern)[0] == pytest.approx(120_000.0)
    assert "1.2e+05 mm long" in pattern.remarks[0]


def test_blocks_take_layer_and_colour_of_their_reference(tmp_path: Path) -> None:
    def draw(drawing: Drawing) -> None:
        inner = drawing.blocks.new("inner")
        inner.add_line((0, 0), (60, 0), dxfattribs={"layer": "0", "color": 256})  # by layer, of the reference
        inner.add_line((60, 0), (120, 0), dxfattribs={"layer": "0", "color": 0})  # by block
        outer = drawing.blocks.new("outer")
        outer.add_blockref("inner", (0, 0), dxfattribs={"layer": "0", "color": 0})
        drawing.layers.add("folds", color=1)
        space = drawing.modelspace()
        space.add_blockref("outer", (0, 40), dxfattribs={"layer": "folds", "color": 1})
        space.add_blockref("outer", (0, 60), dxfattribs={"layer": "valley", "color": 5})

    found = lengths(read_pattern(dxf(tmp_path, draw)))
    assert found == {"mountain": pytest.approx(120.0), "valley": pytest.approx(120.0)}


def test_blocks_in_themselves_and_bombs_are_refused_at_once(tmp_path: Path) -> None:
    def loop(drawing: Drawing) -> None:
        one, two = drawing.blocks.new("one"), drawing.blocks.new("two")
        one.add_blockref("two", (0, 0))
        two.add_blockref("one", (1, 1))
        drawing.modelspace().add_blockref("one", (0, 0))

    file = dxf(tmp_path, loop)
    assert "contains itself" in refused(lambda: read_pattern(file))

    def bomb(drawing: Drawing) -> None:
        for level in range(12):
            block = drawing.blocks.new(f"b{level}")
            for k in range(10):
                if level:
                    block.add_blockref(f"b{level - 1}", (k, 0))
                else:
                    block.add_line((0, 40), (120, 40))
        drawing.modelspace().add_blockref("b11", (0, 0))

    file = dxf(tmp_path, bomb)
    began = time.process_time()
    assert "more than" in refused(lambda: read_pattern(file))
    assert time.process_time() - began < 10.0  # writing out what is allowed takes 40 s

    def rows(drawing: Drawing) -> None:
        drawing.blocks.new("one").add_line((0, 40), (120, 40))
        insert = drawing.modelspace().add_blockref("one", (0, 0))
        insert.grid(size=(1000, 1000), spacing=(1.0, 1.0))

    file = dxf(tmp_path, rows)
    assert "more than" in refused(lambda: read_pattern(file))


def test_closed_periodic_splines_end_at_their_domain(tmp_path: Path) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 9)[:-1]
    ring = np.column_stack((60 + 30 * np.cos(angle), 40 + 20 * np.sin(angle), np.zeros(8)))

    def draw(drawing: Drawing) -> None:
        spline = drawing.modelspace().add_spline(dxfattribs={"color": 1, "flags": 11, "degree": 3})
        spline.control_points = [*ring.tolist(), *ring[:3].tolist()]
        spline.knots = list(range(-3, 12))

    pattern = read_pattern(dxf(tmp_path, draw))
    (crease,) = pattern.creases
    points = sample(crease.curve)
    assert crease.curve.closed
    # where a uniform cubic passes its control points: (P[i-1] + 4 P[i] + P[i+1]) / 6
    share = (4.0 + 2.0 * np.cos(np.pi / 4.0)) / 6.0
    half = share * np.array([30.0, 20.0])
    assert points.min(axis=0) == pytest.approx(np.array([60.0, 40.0]) - half, abs=0.02)
    assert points.max(axis=0) == pytest.approx(np.array([60.0, 40.0]) + half, abs=0.02)


def test_dimensions_and_what_has_no_length_are_skipped(tmp_path: Path) -> None:
    def draw(drawing: Drawing) -> None:
        red_line(drawing)
        space = drawing.modelspace()
        space.add_linear_dim(base=(0, -10), p1=(0, 0), p2=(120, 0)).render()
        space.add_line((5, 5), (5, 5))
        space.add_lwpolyline([(7, 7)])
        space.add_lwpolyline([])
        space.add_circle((9, 9), 0.0)
        space.add_arc((9, 9), 5.0, 10.0, 10.0 + 1e-9)
        space.add_spline([])

    pattern = read_pattern(dxf(tmp_path, draw))
    assert area(pattern) == pytest.approx(9600.0)
    assert lengths(pattern) == {"mountain": pytest.approx(120.0)}


def test_an_empty_model_space_names_the_paper_space(tmp_path: Path) -> None:
    drawing = new("R2010")
    drawing.layout("Layout1").add_line((0, 0), (10, 0))
    file = tmp_path / "paper.dxf"
    drawing.saveas(file)
    assert "'Layout1'" in refused(lambda: read_pattern(file))


# --- ORIPA and Oriedita --------------------------------------------------------------------------------------


def test_cp_and_opx(tmp_path: Path) -> None:
    rows = [
        (1, -200, -200, 200, -200),
        (1, 200, -200, 200, 200),
        (1, 200, 200, -200, 200),
        (1, -200, 200, -200, -200),
        (2, -200, 0, 200, 0),
        (3, 0, -200, 0, 0),
    ]
    file = tmp_path / "bird.cp"
    file.write_text("\n".join(" ".join(map(str, row)) for row in rows), encoding="utf-8")
    pattern = read_pattern(file)
    assert lengths(pattern) == {"mountain": pytest.approx(400.0), "valley": pytest.approx(200.0)}
    below = next(c for c in pattern.creases if c.fold == "valley")
    assert sample(below.curve)[:, 1].max() == pytest.approx(200.0)  # y counts downwards in the file
    names = ("type", "x0", "y0", "x1", "y1")
    objects = "".join(
        '<void index="0"><object class="oripa.OriLineProxy">'
        + "".join(
            f'<void property="{n}"><double>{v}</double></void>' for n, v in zip(names, row, strict=True)
        )
        + "</object></void>"
        for row in [(float(a), *rest) for a, *rest in rows]
    )
    other = tmp_path / "bird.opx"
    other.write_text(f'<java><object class="oripa.DataSet">{objects}</object></java>', encoding="utf-8")
    assert lengths(read_pattern(other)) == lengths(pattern)
    file.write_text("2 0 0 nonsense 1\n", encoding="utf-8")
    assert "line 1 is not a kind and two points" in refused(lambda: read_pattern(file))


# --- what is no drawing --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "begin", "words"),
    [
        ("a.svg", b"%PDF-1.5", "a PDF"),
        ("a.dxf", b"AC1027\0\0", "a DWG drawing"),
        ("a.svg", b"\x89PNG\r\n", "a picture in PNG"),
        ("a.dxf", b"PK\x03\x04", "a ZIP archive"),
    ],
)
def test_files_of_other_kinds_are_named(tmp_path: Path, name: str, begin: bytes, words: str) -> None:
    (tmp_path / name).write_bytes(begin + bytes(100))
    assert words in refused(lambda: read_pattern(tmp_path / name))


def test_a_file_of_no_known_name_is_named_by_its_content(tmp_path: Path) -> None:
    (tmp_path / "a.ai").write_bytes(b"%PDF-1.5\xff")
    with pytest.raises(bh.SceneError, match=r"this is a PDF .*, not a scene or a drawing; open it there"):
        bh.load_scene(tmp_path / "a.ai")


def test_bombs_are_refused_within_seconds(tmp_path: Path) -> None:
    levels = "".join(
        f'<g id="l{k}">' + "".join(f'<use href="#l{k - 1}"/>' for _ in range(10)) + "</g>"
        for k in range(1, 12)
    )
    entities = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, 12))
    bombs = {
        "use": f'{PAGE}<g id="l0"><path d="M0,0L1,1" stroke="red"/></g>{levels}</svg>',
        "self": f'{PAGE}{RIM}<g id="a"><use href="#a"/></g></svg>',
        "entity": f'<!DOCTYPE svg [<!ENTITY e0 "xxxxxxxxxx">{entities}]>{PAGE}<text>&e11;</text></svg>',
    }
    for name, text in bombs.items():
        file = tmp_path / f"{name}.svg"
        file.write_text(text, encoding="utf-8")
        began = time.process_time()
        refused(partial(read_pattern, file))
        assert time.process_time() - began < 20.0, name  # a bomb that goes off takes hours
    packed = io.BytesIO()
    with gzip.GzipFile(fileobj=packed, mode="wb") as file_:
        file_.write(bytes(80 * 2**20))
    (tmp_path / "zip.svg").write_bytes(packed.getvalue())
    assert "megabytes, more than 32" in refused(lambda: read_pattern(tmp_path / "zip.svg"))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.svg"
    os.mkfifo(pipe)
    assert "no plain file" in refused(lambda: read_pattern(pipe))


def test_entities_of_the_outside_are_not_read(tmp_path: Path) -> None:
    secret = tmp_path / "secret.txt"
    secret.write_text("M0,0L1,1", encoding="utf-8")
    text = f'<!DOCTYPE svg [<!ENTITY s SYSTEM "{secret.as_uri()}">]>{PAGE}{RIM}<path d="&s;" stroke="red"/></svg>'
    file = tmp_path / "outside.svg"
    file.write_text(text, encoding="utf-8")
    refused(lambda: read_pattern(file))


# --- against a renderer --------------------------------------------------------------------------------------

RENDERED = {
    "rotated": '<g transform="rotate(12 60 40) skewX(8)">'
    '<rect x="30" y="20" width="40" height="24" rx="6" stroke="black"/>'
    '<ellipse cx="50" cy="32" rx="9" ry="4" transform="rotate(30 50 32)" stroke="red"/></g>',
    "nested": '<svg x="20" y="10" width="60" height="50" viewBox="0 0 30 50" preserveAspectRatio="xMinYMax slice">'
    '<rect x="2" y="20" width="20" height="25" stroke="black" stroke-width="0.6"/>'
    '<path d="M-9 30q20 20 50 0" stroke="blue" stroke-width="0.6"/></svg>',
    "symbols": '<symbol id="s" viewBox="0 0 10 20"><path d="M1,1 h8 v18 h-8z" stroke="black" stroke-width="0.3"/>'
    '<path d="M1 9 a4 4 0 0 1 8 0" stroke="red" stroke-width="0.3"/></symbol>'
    '<use href="#s" x="10" y="5" width="40" height="60" transform="rotate(5)"/>',
    "clipped": '<clipPath id="c" transform="translate(4 0)"><circle cx="50" cy="40" r="25"/></clipPath>'
    '<g clip-path="url(#c)" transform="translate(6 2)"><path d="M0 40H120M50 0V80" stroke="red"/></g>'
    '<rect x="10" y="10" width="90" height="60" stroke="black"/>',
}


@pytest.mark.parametrize("name", list(RENDERED))
def test_it_is_what_a_renderer_draws(tmp_path: Path, name: str) -> None:
    """Pixels of a browser-grade renderer and of the strokes as read: fewer than 1 % of the inked ones differ."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt
    import resvg_py

    from meshes.io.svg import read_svg

    zoom = 8
    page = PAGE.replace("fill=", 'stroke-width="1.2" fill=')
    text = f"{page}{RENDERED[name]}</svg>"
    file = tmp_path / "drawing.svg"
    file.write_text(text, encoding="utf-8")
    page = text.replace('width="120mm" height="80mm"', f'width="{120 * zoom}" height="{80 * zoom}"')
    drawn = plt.imread(io.BytesIO(bytes(resvg_py.svg_to_bytes(svg_string=page, background="#ffffff"))))
    ink = drawn[..., :3].min(axis=-1) < 0.5
    found = read_svg(file)
    y, x = np.mgrid[0 : 80 * zoom, 0 : 120 * zoom]
    pixels = shapely.points((x.ravel() + 0.5) / zoom, -(y.ravel() + 0.5) / zoom)
    lines = shapely.union_all([shapely.LineString(s.sample(1e-3) * found.unit) for s in found.strokes])
    near = shapely.dwithin(lines, pixels, 0.6).reshape(ink.shape)
    wide = shapely.dwithin(lines, pixels, 1.1).reshape(ink.shape)
    thin = shapely.dwithin(lines, pixels, 0.2).reshape(ink.shape)
    assert ink.sum() > 1000
    assert (ink & ~wide).sum() < 0.01 * ink.sum()  # nothing is drawn where nothing was read
    assert (thin & ~ink).sum() < 0.01 * thin.sum()  # and nothing was read where nothing is drawn
    assert near.any()
