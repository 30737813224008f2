"""Send a drawing to the cutter: what is cut is what was drawn, to a millionth of a millimetre.

`bh export wave.svg wave.dxf` is the command; not the mesh is written but the drawing's own curves.
"""

from pathlib import Path

import numpy as np

import bh
import meshes.io

drawing = Path(__file__).parent.parent / "wave.svg"
meshes.io.write_pattern("drawing_to_cutter.dxf", meshes.io.drawn_lines(drawing))
drawn, cut = (meshes.io.read_pattern(file) for file in (drawing, "drawing_to_cutter.dxf"))
assert [crease.name for crease in drawn.creases] == [crease.name for crease in cut.creases]
found = np.abs(drawn.rings[0] - cut.rings[0]).max()  # mm
assert found < 1e-6, found

if __name__ == "__main__":
    mesh = meshes.unstructured(cut, size=5.0)
    bh.plotting.pattern(bh.Model(mesh, bh.Sheet(E=4000, t=0.2))).savefig("drawing_to_cutter.svg")
