"""Small scenes and a sweep that are solved in a second or two."""

from __future__ import annotations

from pathlib import Path

SCENE = """
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.7
[sheet]
E = 4000.0
t = 0.127
[mesh]
along = 12
rows = 1
[model]
formulation = "bars-and-hinges"
[[supports]]
at = "rigid-body"
[[steps]]
fold = { crease = "crease", by = 0.2 }
[[steps]]
fold = { crease = "crease", by = 0.3 }
[[steps]]
fold = { crease = "crease", by = 0.2 }
"""
SWEEP = """
scene = "scene.toml"
[axes.t]
key = "sheet.t"
values = [0.1, 0.12, 0.14, 0.16]
"""


def write(folder: Path) -> None:
    """Put the scene and the sweep into a folder."""
    (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
    (folder / "sweep.toml").write_text(SWEEP, encoding="utf-8")
