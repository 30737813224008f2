"""DXF entities of a kind that nobody knows."""

from __future__ import annotations

from pathlib import Path

import pytest
from ezdxf.filemanagement import new

from meshes.io import read_pattern


@pytest.mark.parametrize("kind", ["ARcDbEntity", "NOTHING"])
def test_entities_of_no_known_kind_draw_nothing(tmp_path: Path, kind: str) -> None:
    """They have no layer: such a file ended in a traceback."""
    drawing = new(units=4)
    space = drawing.modelspace()
    space.add_lwpolyline([(0, 0), (60, 0), (60, 40), (0, 40)], close=True)
    space.add_line((30, 0), (30, 40), dxfattribs={"color": 1})
    space.add_line((0, 20), (10, 20), dxfattribs={"color": 1, "layer": "last"})
    file = tmp_path / "a.dxf"
    drawing.saveas(file)
    before, _, rest = file.read_text().rpartition("LINE\n")  # the last one
    file.write_text(f"{before}{kind}\n{rest}")
    pattern = read_pattern(file)
    assert len(pattern.creases) == 1
