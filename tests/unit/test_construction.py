"""Grids that reach beyond the sheet, outlines that are open by a little, and nets of many lines."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from bh.scene.foldable import understood
from meshes.errors import InputError
from meshes.io import read_pattern
from meshes.io.drawing import read_drawing

PAGE = '<svg xmlns="http://www.w3.org/2000/svg" width="200mm" height="200mm" viewBox="0 0 200 200" fill="none">{}</svg>'
OUTLINE = '<rect x="60" y="60" width="80" height="60" stroke="black"/>'
CREASE = '<line x1="100" y1="60" x2="100" y2="120" stroke="red"/>'


def line(*ends: float, colour: str = "black") -> str:
    x, y, u, v = ends
    return f'<line x1="{x}" y1="{y}" x2="{u}" y2="{v}" stroke="{colour}"/>'


def written(folder: Path, *shapes: str) -> Path:
    file = folder / "sheet.svg"
    file.write_text(PAGE.format("".join(shapes)), encoding="utf-8")
    return file


def test_a_grid_in_the_outlines_colour_is_left_out(tmp_path: Path) -> None:
    grid = [line(10, y, 190, y) for y in range(20, 190, 20)] + [
        line(x, 10, x, 190) for x in range(25, 190, 20)
    ]
    pattern = read_pattern(written(tmp_path, *grid, OUTLINE, CREASE))
    assert np.ptp(pattern.rings[0], axis=0) == pytest.approx([80.0, 60.0])
    assert not pattern.facets
    (remark,) = (text for text in pattern.remarks if "construction" in text)
    assert remark.startswith(f"{len(grid)} lines in the outline's colour (first line 1")


def test_a_black_line_within_the_sheet_stays(tmp_path: Path) -> None:
    pattern = read_pattern(written(tmp_path, OUTLINE, CREASE, line(70, 60, 70, 120)))
    assert len(pattern.facets) == 1
    assert not any("construction" in text for text in pattern.remarks)


def test_loose_lines_alone_are_no_outline(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="ends loosely"):
        read_pattern(written(tmp_path, line(10, 10, 100, 10), line(20, 5, 20, 80), CREASE))


@pytest.mark.parametrize(("miss", "healed"), [(0.15, True), (6.0, False)])
def test_an_outline_that_is_open_by_a_little_is_closed(tmp_path: Path, miss: float, healed: bool) -> None:
    ends = [(60, 60, 140, 60), (140, 60, 140, 120), (140, 120, 60, 120), (60, 120, 60, 60 + miss)]
    file = written(tmp_path, *(line(*each) for each in ends), CREASE)
    if not healed:
        with pytest.raises(InputError, match=r"heal it with gap = 6\.3"):
            understood(file, {})
        return
    options: dict[str, object] = {}
    found, assumed = understood(file, options)
    assert found.sheet is not None
    assert options == {"gap": 0.16}
    assert assumed == ["the outline is open by a little: its ends are joined by gap = 0.16 mm"]


def test_a_net_of_five_thousand_crossings_is_read_in_seconds(tmp_path: Path) -> None:
    """Each crossing looked through all nodes before: 14 s of processor time for these."""
    at = [60.5 + i for i in range(72)]
    cross = [line(60, 60 + 60 * (x - 60) / 80, 140, 60 + 60 * (x - 60) / 80, colour="red") for x in at]
    cross += [line(x, 60, x, 120, colour="blue") for x in at]
    file = written(tmp_path, OUTLINE, *cross)
    began = time.process_time()
    read = read_drawing(file)
    assert len(read.graph.points) == 72 * 72 + 4 * 72 + 4
    assert time.process_time() - began < 10.0


@pytest.mark.parametrize(
    ("width", "fine"), [("200mm", True), ("1e2 PX", True), ("100%", True), ("200.5h> 1.8mm", False)]
)
def test_a_page_whose_width_is_no_length_is_refused(tmp_path: Path, width: str, fine: bool) -> None:
    """A browser ignores such a width and fills its window."""
    file = written(tmp_path, OUTLINE, CREASE)
    file.write_text(
        file.read_text(encoding="utf-8").replace("200mm", width.replace(">", "&gt;"), 1), encoding="utf-8"
    )
    if fine:
        read_drawing(file)
        return
    with pytest.raises(InputError, match=r"width = '200\.5h> 1\.8mm', which is no length"):
        read_drawing(file)


@pytest.mark.parametrize(
    "words",
    ["translate(70, strok0)", "translate(70,0", "turn(3)", "scale(1 2) rotate()", "matrix(1,0,0,1,5,nan)"],
)
def test_a_transform_that_a_browser_ignores_is_refused(tmp_path: Path, words: str) -> None:
    file = written(
        tmp_path, OUTLINE, CREASE, f'<g transform="{words}">', line(80, 60, 80, 120, colour="blue"), "</g>"
    )
    with pytest.raises(InputError, match=r"transform = .* is not understood"):
        read_drawing(file)


@pytest.mark.parametrize(
    "words", ["translate(2)", " matrix(1-0 0,1 .5e0-.5) , rotate(0 3,4)", "scale(1,1)skewX( 0 )", "none", ""]
)
def test_transforms_as_programs_write_them(tmp_path: Path, words: str) -> None:
    file = written(
        tmp_path, OUTLINE, CREASE, f'<g transform="{words}">', line(80, 70, 80, 100, colour="blue"), "</g>"
    )
    assert len(read_drawing(file).lines) == 3


def test_a_dxf_file_that_ends_in_its_header_is_one_line(tmp_path: Path) -> None:
    file = tmp_path / "short.dxf"
    file.write_text("0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1032\n9\n$EXTMIN\n10\n0.0\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"short\.dxf: .*ends"):
        read_drawing(file)
