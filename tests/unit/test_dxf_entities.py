"""DXF entities: of a kind that nobody knows, and named by their handles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
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


def test_rim_and_creases_of_one_layer_are_told_apart_by_handles(tmp_path: Path) -> None:
    drawing = new(units=4)
    space = drawing.modelspace()
    space.add_lwpolyline([(0, 0), (60, 0), (60, 40), (0, 40)], close=True)
    one, two = (space.add_line((x, 0), (x, 40)).dxf.handle for x in (20, 40))
    file = tmp_path / "a.dxf"
    drawing.saveas(file)
    pattern = read_pattern(file, lines={f"handle:{one}": "valley", f"handle:{two}": "mountain"})
    folds = {round(crease.curve.point(np.zeros(1))[0, 0]): crease.fold for crease in pattern.creases}
    assert folds == {20: "valley", 40: "mountain"}
