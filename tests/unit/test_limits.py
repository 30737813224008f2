"""Bombs: small files that ask for much get one line before time or memory is taken, and the limit can be raised."""

from __future__ import annotations

import json
import math
import os
import time
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
import shapely
from ezdxf.filemanagement import new
from numpy.typing import NDArray

import bh
import meshes
from bh.sweep.file import load_sweep
from meshes.choices import first_mesh
from meshes.errors import FileFormatError, InputError
from meshes.io import read_fold, read_pattern, svg
from meshes.io.fold_frame import Frame
from meshes.io.loose_ends import _Sight, tie_ends
from meshes.limits import Limits, limits
from meshes.topology import Ints

REST = """
[sheet]
E = 4000.0
t = 0.2
"""
STEP = """
[[steps]]
fold = { crease = "all", by = 0.3, Lstar = 40.0 }
"""
ANNULUS = '[pattern]\nkind = "annulus_sector"\nradius = {}\nwidth = 10.0\nangle = 1.0\n'
PAGE = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="100mm" viewBox="0 0 100 100">'
    '<rect width="100" height="100" fill="none" stroke="black"/>{}</svg>'
)


def scene(pattern: str, mesh: str = "along = 8", steps: int = 1) -> str:
    return f"{pattern}\n[mesh]\n{mesh}\n{REST}{STEP * steps}"


SCENES = {
    "radii": (scene(ANNULUS.format([20.0 + i for i in range(5_000)])), "5,000 creases, more than 1,000"),
    "heights": (
        scene(
            '[pattern]\nkind = "strip"\nlength = 9.0\nwidth = 9.0\n'
            f"creases = {[9.0 * (i + 1) / 5_002 for i in range(5_000)]}"
        ),
        "5,000 creases, more than 1,000",
    ),
    "pieces": (
        scene(
            f'[pattern]\nkind = "parallel_creases"\ncurvature = {[1e-4] * 9_000}\nlength = {[0.01] * 9_000}'
        ),
        "9,000 pieces, more than 1,000",
    ),
    "along": (scene(ANNULUS.format(40.0), "along = 999999"), "some 4e+06 triangles, more than 250,000"),
    "rows": (scene(ANNULUS.format(40.0), "along = 600\nrows = 999"), "some 2.4e+06 triangles"),
    "aspect": (
        scene(ANNULUS.format(40.0), "aspect_ratio = 1e4\nrows = 99"),
        "triangles, more than 250,000",
    ),
    "size": (scene(ANNULUS.format(40.0), 'kind = "gmsh"\nsize = 1e-4'), "triangles, more than 250,000"),
    "near": (
        scene(ANNULUS.format(40.0), 'kind = "gmsh"\nsize = 5.0\nnear = { "crease:crease" = 1e-6 }'),
        "triangles, more than 250,000",
    ),
    "growth": (
        scene(
            ANNULUS.format(40.0),
            'kind = "gmsh"\nsize = 5.0\nnear = { "crease:crease" = 0.05 }\ngrowth = 1e-9',
        ),
        "triangles, more than 250,000",
    ),
    "steps": (scene(ANNULUS.format(40.0), steps=2_000), "2,000 steps, more than 1,000"),
}


@pytest.mark.parametrize("name", SCENES)
def test_scenes_that_ask_for_too_much_are_refused_at_once(tmp_path: Path, name: str) -> None:
    text, words = SCENES[name]
    file = tmp_path / "bomb.toml"
    file.write_text(text, encoding="utf-8")
    began = time.process_time()
    with pytest.raises(InputError) as refusal:
        bh.load_scene(file)
    assert time.process_time() - began < 5.0
    line = str(refusal.value)
    assert words in line
    assert "BH_LIMIT_" in line
    assert "\n" not in line


def lines(*ends: tuple[float, float, float, float]) -> str:
    return "".join(f'<line x1="{a}" y1="{b}" x2="{c}" y2="{d}" stroke="red"/>' for a, b, c, d in ends)


def wave(count: int) -> str:
    return " ".join(f"{1.0 + 98.0 * i / count:.4f},{50.0 + (i % 7):.1f}" for i in range(count))


# name: (what is drawn, words of the refusal)
DRAWINGS = {
    "entities": ("<g/>" * 250, "more than 200"),
    "lines": (lines(*((1.0, 1.0 + i, 2.0, 1.0 + i) for i in range(60))), "61 lines, more than 50"),
    "crossings": (
        lines(*((0, i, 100, i) for i in range(1, 21)), *((i, 0, i, 100) for i in range(1, 21))),
        "crossings, more than 300",
    ),
    "points": (f'<polyline fill="none" stroke="red" points="{wave(25_000)}"/>', "more than 2,000"),
    "chords": (
        '<path fill="none" stroke="red" d="M 1 1 ' + "C 90 1 1 90 90 90 C 1 90 90 1 1 1 " * 30 + '"/>',
        "vertices, more than 2,000",
    ),
}
LOWER = {"ENTITIES": "200", "LINES": "50", "CROSSINGS": "300", "VERTICES": "2000"}


@pytest.mark.parametrize("name", DRAWINGS)
def test_drawings_that_hold_too_much_are_refused_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Limits are lowered here, so that the drawings are small; `bh verify attack` takes the whole ones."""
    drawn, words = DRAWINGS[name]
    for limit, value in LOWER.items():
        monkeypatch.setenv(f"BH_LIMIT_{limit}", value)
    file = tmp_path / "bomb.svg"
    file.write_text(PAGE.format(drawn), encoding="utf-8")
    began = time.process_time()
    with pytest.raises(InputError) as refusal:
        read_pattern(file)
    assert time.process_time() - began < 5.0
    assert words in str(refusal.value)
    assert "BH_LIMIT_" in str(refusal.value)


def test_arrays_and_splines_of_dxf_are_counted_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BH_LIMIT_ENTITIES", "2000")
    array = new()
    array.blocks.new("empty")
    many = {"row_count": 30_000, "column_count": 30_000, "row_spacing": 1, "column_spacing": 1}
    array.modelspace().add_blockref("empty", (0, 0), dxfattribs=many)
    spline = new()
    spline.modelspace().add_open_spline([(i, i % 5) for i in range(3_000)])
    crowd = new()
    for i in range(3_000):
        crowd.modelspace().add_line((0, i), (1, i))
    nested = new()
    nested.blocks.new("b0")  # with nothing in it: no line ever comes out
    for level in range(1, 40):
        block = nested.blocks.new(f"b{level}")
        for x in (0, 1):
            block.add_blockref(f"b{level - 1}", (x, 0))
    nested.modelspace().add_blockref("b39", (0, 0))
    bombs = ((array, "entities"), (spline, "control points"), (crowd, "entities"), (nested, "entities"))
    for drawing, words in bombs:
        file = tmp_path / "bomb.dxf"
        drawing.saveas(file)
        began = time.process_time()
        with pytest.raises(InputError, match=f"{words}, more than"):
            read_pattern(file)
        assert time.process_time() - began < 5.0


def test_rows_of_a_cp_file_are_counted_first(tmp_path: Path) -> None:
    file = tmp_path / "bomb.cp"
    file.write_text("2 0 0 1 1\n" * 30_000, encoding="utf-8")
    with pytest.raises(InputError, match="30,000 entities, more than 20,000"):
        read_pattern(file)


def test_vertices_edges_and_faces_of_a_fold_file_are_counted_first(tmp_path: Path) -> None:
    file = tmp_path / "bomb.fold"
    corners = [[0, 0], [1, 0], [0, 1]]
    frames = {
        "vertices_coords": {"vertices_coords": [[0, 0]] * 30_000},
        "edges_vertices": {"vertices_coords": corners, "edges_vertices": [[0, 0]] * 30_000},
        "faces_vertices": {"vertices_coords": corners, "faces_vertices": [[0, 0, 0]] * 30_000},
    }
    for key, frame in frames.items():
        file.write_text(json.dumps(frame), encoding="utf-8")
        with pytest.raises(InputError, match=f"{key} of this frame has 30,000 entities, more than 20,000"):
            read_fold(file)


def test_frames_of_a_fold_file_are_counted_first(tmp_path: Path) -> None:
    """Each inherits from the one before: 100,000 of them took minutes."""
    chain = [{"frame_inherit": True, "frame_parent": number} for number in range(5_000)]
    sheet = {"vertices_coords": [[0, 0], [1, 0], [1, 1]], "faces_vertices": [[0, 1, 2]]}
    (tmp_path / "bomb.fold").write_text(json.dumps({**sheet, "file_frames": chain}), encoding="utf-8")
    with pytest.raises(FileFormatError, match="5,001 frames, more than 1,000"):
        read_fold(tmp_path / "bomb.fold")
    (tmp_path / "long.fold").write_text(json.dumps({**sheet, "file_frames": chain[:999]}), encoding="utf-8")
    (tmp_path / "many.fold").write_text('{"x": [' + "{}," * 300_000 + "{}]}", encoding="utf-8")
    with pytest.raises(FileFormatError, match="more than 200,000 objects"):
        read_fold(tmp_path / "many.fold")
    assert len(read_fold(tmp_path / "long.fold").triangles) == 1  # 999 of them are read in a second


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names")
def test_a_pipe_is_no_fold_file(tmp_path: Path) -> None:
    """It would be waited for."""
    os.mkfifo(tmp_path / "pipe.fold")
    with pytest.raises(InputError, match="no plain file"):
        read_fold(tmp_path / "pipe.fold")


def test_a_thousand_sines_are_meshed_in_seconds() -> None:
    """Lengths along a curve of 2,049 vertices are added up once, not with every point that is asked for."""
    began = time.process_time()
    first_mesh(meshes.sine_tessellation(creases=250, amplitude=0.001))
    assert time.process_time() - began < 5.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a = [" + "0," * 200 + "]", "202 entries, more than 100.*BH_LIMIT_ENTRIES"),
        ("".join(f"k{i} = 1\n" for i in range(60)), "120 entries, more than 100.*BH_LIMIT_ENTRIES"),
        ("a." * 40 + "a = 1", "a key of 41 parts with dots, more than 16; write tables of fewer"),
        ("['a' . " + '"b".' * 40 + "a]", "a key of 42 parts with dots, more than 16"),
        ('a = "' + "x" * 4000 + '"', "longer than 0.004 MB.*BH_LIMIT_ENTRIES"),
        (r'"\"\\".' * 20 + "a = 1", "a key of 21 parts with dots, more than 16"),
    ],
)
def test_toml_is_counted_before_it_is_parsed(
    text: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of scenes and sweeps; tomllib is not called."""
    monkeypatch.setenv("BH_LIMIT_ENTRIES", "100")
    monkeypatch.setattr("bh.scene.toml_text.tomllib.loads", Mock(side_effect=AssertionError("it was parsed")))
    file = tmp_path / "bomb.toml"
    file.write_text(text, encoding="utf-8")
    for read in (bh.load_scene, load_sweep):
        with pytest.raises(InputError, match=words):
            read(file)


def test_limits_are_raised_and_lowered_by_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    assert limits() == Limits()
    monkeypatch.setenv("BH_LIMIT_CREASES", "2")
    with pytest.raises(InputError, match="3 creases, more than 2"):
        meshes.annulus_sector([40.0, 50.0, 60.0], 5.0, 1.0)
    monkeypatch.setenv("BH_LIMIT_CREASES", "3")
    assert len(meshes.annulus_sector([40.0, 50.0, 60.0], 5.0, 1.0).creases) == 3
    for word in ("no", "0", "-1", "1e3", "9" * 30):
        monkeypatch.setenv("BH_LIMIT_CREASES", word)
        with pytest.raises(InputError, match=r"BH_LIMIT_CREASES = .* cannot be; give a whole number from 1"):
            limits()


def test_a_graded_mesh_has_as_many_triangles_as_expected() -> None:
    """The estimate that near = ... is refused by is within a factor of two of what gmsh makes."""
    from meshes.unstructured import _expected, _sizes

    pattern = meshes.annulus_sector(40.0, 10.0, 1.0)
    near = {"crease:crease": 0.1}
    curves = {f"crease:{crease.name}": crease.curve for crease in pattern.creases}
    expected = _expected(pattern, curves, _sizes(curves, 5.0, near, 0.3))
    made = len(meshes.unstructured(pattern, size=5.0, near=near).triangles)
    assert 0.5 * made < expected < 2.0 * made


def test_scribbles_are_refused_before_anything_is_made_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Dashes are joined, and vertices looked for on edges, in times that grow with the square of their number."""

    def never(*_: object) -> None:
        raise AssertionError("the scribble was worked on")

    monkeypatch.setattr("meshes.io.drawing.join_dashes", never)
    random = np.random.default_rng(1)
    ends = random.uniform(1.0, 99.0, (400, 4)).round(3)
    drawing = tmp_path / "scribble.svg"
    drawing.write_text(PAGE.format(lines(*map(tuple, ends.tolist()))), encoding="utf-8")
    frame = tmp_path / "scribble.fold"
    points = ends.reshape(-1, 2).tolist()
    edges = [[2 * i, 2 * i + 1] for i in range(400)]
    frame.write_text(
        json.dumps({"vertices_coords": points, "edges_vertices": edges, "edges_assignment": ["V"] * 400}),
        encoding="utf-8",
    )
    with pytest.raises(InputError, match="crossings, more than 10,000"):
        read_pattern(drawing)
    with pytest.raises(InputError, match="crossings, more than 10,000"):
        read_fold(frame)


def test_lines_of_a_drawing_need_no_path_each(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two thousand lines of one colour: the reader makes no path of them, and looks at the colour once."""
    import tinycss2.color5

    lines = "".join(
        f'<line x1="1" y1="{k / 21}" x2="99" y2="{k / 21}" stroke="red"/>' for k in range(1, 2_000)
    )
    (tmp_path / "lines.svg").write_text(PAGE.format(lines), encoding="utf-8")
    placed = Mock(wraps=svg._placed)
    colours = Mock(wraps=tinycss2.color5.parse_color)
    monkeypatch.setattr(svg, "_placed", placed)
    monkeypatch.setattr(tinycss2.color5, "parse_color", colours)
    svg._colour_of.cache_clear()
    strokes = svg.read_svg(tmp_path / "lines.svg").strokes
    assert len(strokes) == 2_000
    assert strokes[1].sample(1.0) == pytest.approx(strokes[1].sample(1e-9))
    assert placed.call_count < 10
    assert colours.call_count < 10


def test_panels_are_measured_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """However many meshes are tried on a pattern."""
    pattern = meshes.annulus_sector([40.0, 50.0], 10.0, 1.0)
    first_mesh(pattern)
    monkeypatch.setattr(type(pattern.rails[0]), "length", property(lambda _: 1 / 0))
    assert len(pattern.panel_sizes[0]) == 3


LINE = '<line x1="1" y1="1" x2="9" y2="9" stroke="red"/>'
PATH = '<path id="p" fill="none" stroke="red" d="M 1 1 L 2 2 L 3 3"/>'
MANY = " ".join(f'a{n}=""' for n in range(200))
USE = '<use href="#p"/>'
CLIP = '<clipPath id="c"><path d="{}"/></clipPath>'
CLIPPED = LINE.replace("/>", ' clip-path="url(#c)"/>')
ANGLES = [1.01 * n * math.pi for n in range(99)]
STAR = "M" + " L".join(f"{50 + 40 * math.cos(angle):.3f} {50 + 40 * math.sin(angle):.3f}" for angle in ANGLES)


# a clip path of eight bars, which leave eight pieces of a line across
COMB = CLIP.format(" ".join(f"M{i} 0 h.5 v99 h-.5 Z" for i in range(1, 9)))


@pytest.mark.parametrize(
    ("name", "most", "inside", "words"),
    [
        (
            "transforms",
            100,
            f'<g transform="{"rotate(1) " * 40}">{3 * LINE}</g>',
            "120 transforms, more than 100",
        ),
        (
            "transforms",
            100,
            f'<g transform="translate(1{" " * 900},1)">{9 * LINE}</g>',
            "transforms, more than 100",
        ),
        (
            "transforms",
            100,
            f"<style>g{{transform:{'rotate(1) ' * 40}}}</style><g>{3 * LINE}</g>",
            "transforms, more",
        ),
        ("attributes", 1000, f"<g {MANY}>{9 * LINE}</g>", "attributes, more than"),
        ("attributes", 1000, f"<style>{'*{a:b}' * 200}</style>{9 * LINE}", "attributes, more than 1,000"),
        (
            "style_characters",
            50,
            f"<style>{'a{' * 50}</style>{LINE}",
            "sheets of this drawing has 100 style char",
        ),
        (
            "attribute_characters",
            1500,
            LINE.replace("red", "r" * 2000),
            "'stroke' of an element has 2,000 attribute",
        ),
        ("vertices", 20, f"<defs>{PATH}</defs>{9 * USE}", "vertices, more"),
        ("clips", 5, CLIP.format("M0 0 L9 0 L9 9 Z") + 9 * CLIPPED, "6 clips, more than 5"),
        ("clip_vertices", 10, CLIP.format("M0 0 L5 0 L5 5 Z") + 9 * CLIPPED, "clip vertices, more than 10"),
        ("clips", 5, COMB + CLIPPED, "once its lines are clipped, has 8 clips, more than 5"),
        ("clips", 5, f"<style>a{{b:{'(' * 5000}{')' * 5000}}}</style>{LINE}", "brackets in brackets"),
        ("clips", 5, CLIP.format(STAR) + CLIPPED, "crosses itself more than 50 times"),
    ],
)
def test_svg_files_are_counted_before_they_are_read(
    name: str, most: int, inside: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(f"BH_LIMIT_{name.upper()}", str(most))
    file = tmp_path / "bomb.svg"
    file.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 99 99">{inside}</svg>', encoding="utf-8"
    )
    with pytest.raises(FileFormatError, match=words):
        svg.read_svg(file)


def test_loose_ends_are_counted_and_many_are_tied_in_no_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Short cuts on a sheet: every end is tied by a flat edge that crosses nothing, and looks no farther than it must.

    The work is counted by the lines that are met on the way: some 500 for each end.
    """
    corners = [(0.0, 0.0), (20.0, 0.0), (20.0, 16.0), (0.0, 16.0)]
    marks = [end for x in range(2, 18) for y in range(2, 14) for end in ((x, y), (x + 0.4, y + 0.2))]
    points = np.array([(x, y, 0.0) for x, y in [*corners, *marks]])
    edges = [(0, 1), (1, 2), (2, 3), (0, 3), *((k, k + 1) for k in range(4, len(points), 2))]
    frame = Frame(points, edges, ["B"] * 4 + ["C"] * (len(marks) // 2), None, [])
    met: list[int] = []
    in_the_way = _Sight._in_the_way

    def counted(sight: _Sight, end: int, others: Ints, segments: Ints) -> NDArray[np.bool_]:
        met.append(len(segments))
        return in_the_way(sight, end, others, segments)

    monkeypatch.setattr(_Sight, "_in_the_way", counted)
    tied = tie_ends(frame)
    assert sum(met) < 700 * len(marks)
    assert set(np.ravel(tied.edges[len(edges) :]).tolist()) >= set(range(4, len(points)))
    lines = shapely.linestrings(points[np.array(tied.edges), :2])
    one, two = shapely.STRtree(lines).query(lines, predicate="crosses")
    assert len(one) == len(two) == 0
    monkeypatch.setenv("BH_LIMIT_LOOSE_ENDS", "100")
    with pytest.raises(FileFormatError, match="384 loose ends, more than 100"):
        tie_ends(frame)


def test_what_draws_no_line_is_not_read(tmp_path: Path) -> None:
    """Pictures, long texts of editors, and paths' numbers on a group; style sheets keep their lines' colours."""
    sheet = "/* made by */ .a , line.b { stroke : #00f !important } @media print { .a { stroke: red } } c{c{"
    inside = (
        f'<style>{sheet}</style><image width="1" height="1" href="data:image/png;base64,{"A" * 50_000}"/>'
        f'<g d="M 1 1 L 2 2" data-editor="{"x" * 50_000}"><path stroke="red"/></g>'
        '<line class="a" x1="1" y1="1" x2="9" y2="9"/><line class="b" x1="1" y1="1" x2="9" y2="9"/>'
    )
    file = tmp_path / "odd.svg"
    file.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 99 99">{inside}</svg>', encoding="utf-8"
    )
    assert [stroke.colour for stroke in svg.read_svg(file).strokes] == [(0, 0, 255)] * 2


def test_references_to_blocks_count_as_what_ezdxf_makes_of_them(tmp_path: Path) -> None:
    """Refused before ezdxf reads them; 19,000 of them took 11 s of processor time."""
    references = "0\nINSERT\n2\nB\n10\n0\n20\n0\n" * 7_000
    file = tmp_path / "bomb.dxf"
    file.write_text(f"0\nSECTION\n2\nENTITIES\n{references}0\nENDSEC\n0\nEOF\n", encoding="utf-8")
    began = time.process_time()
    with pytest.raises(FileFormatError, match=r"this drawing has 21,\d* entities, more than 20,000"):
        read_pattern(file)
    assert time.process_time() - began < 1.0


@pytest.mark.parametrize(
    "name",
    [
        "entries",
        "triangles",
        "entities",
        "frames",
        "attributes",
        "transforms",
        "lines",
        "vertices",
        "crossings",
    ],
)
def test_security_says_the_limits(name: str) -> None:
    page = (Path(__file__).parents[2] / "SECURITY.md").read_text(encoding="utf-8")
    assert f"{getattr(Limits(), name):,} {name}" in page
