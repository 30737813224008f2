"""The flat crease pattern of a FOLD file as lines of a drawing, so that it can be healed, scaled and meshed anew.

Mountain, valley and the other letters become the colours that `meshes.io.strokes` knows; fold angles become the
opacity of a line, as in Origami Simulator's drawings.
"""

from __future__ import annotations

import math
import os
from functools import partial

import numpy as np

from meshes.curves import Array
from meshes.errors import FileFormatError
from meshes.io.fold_frame import UNITS, check, laid_flat, load, select
from meshes.io.strokes import Colour, Stroke, Strokes, always

LEAST, MOST = 8, 4096  # chords of an edge that is a curve
COLOURS: dict[str, Colour | None] = {
    "B": None,
    "M": (255, 0, 0),
    "V": (0, 0, 255),
    "C": (0, 255, 0),
    "F": (255, 255, 0),
    "U": (255, 0, 255),
    "J": (255, 255, 0),
}


def read_fold_lines(path: str | os.PathLike[str], frame: int | str | None = None) -> Strokes:
    """The edges of one frame as strokes, in the unit of the frame.

    Args:
        path: of the .fold file.
        frame: as for `meshes.io.read_fold`.

    Raises:
        FileFormatError: the file cannot be read, or its frame is no flat pattern with edges.
    """
    chosen = select(load(path), frame)
    found = laid_flat(check(chosen))
    if not found.flat:
        raise FileFormatError(
            "the frame is folded (it lies in no plane), so it is no pattern to mesh anew; choose a flat frame, or use "
            "the faces of the file as they are: leave out [mesh] and accuracy"
        )
    if not found.edges:
        raise FileFormatError("the frame has no edges_vertices, so it is no pattern to mesh anew; add edges")
    unit = chosen.get("frame_unit", "unit")
    points = found.points[:, :2] / UNITS[unit]
    strokes = []
    for number, ((a, b), letter) in enumerate(zip(found.edges, found.letters, strict=True)):
        angle = math.nan if found.angles is None else abs(found.angles[number])
        opacity = 1.0 if math.isnan(angle) or letter not in "MV" else angle / 180.0
        ends = points[[a, b]]
        bend = found.bends.get(number)
        strokes.append(
            Stroke(
                always(ends) if bend is None else partial(_bezier, ends, bend[:, :2] / UNITS[unit]),
                f"edge {number}",
                COLOURS[letter],
                opacity=opacity,
                key=f"id:{number}",
            )
        )
    return Strokes(strokes, UNITS[unit], stated=unit != "unit")


def _bezier(ends: Array, bend: Array, tolerance: float) -> Array:
    """Points (k, 2) of a Bezier curve with one or two control points `bend`, whose chords stay within a tolerance."""
    poles = np.vstack((ends[:1], bend, ends[1:]))
    degree = len(poles) - 1
    # a chord over a part 1/n of the parameter is off by no more than the second derivative / (8 n^2)
    most = degree * (degree - 1) * float(np.linalg.norm(np.diff(poles, 2, axis=0), axis=1).max())
    count = max(LEAST, math.ceil(math.sqrt(min(most / (8.0 * tolerance), MOST**2))))
    u = np.linspace(0.0, 1.0, count + 1)[:, None]
    curve = np.repeat(poles[:, None, :], count + 1, axis=1)
    for _ in range(degree):  # de Casteljau
        curve = (1.0 - u) * curve[:-1] + u * curve[1:]
    return np.asarray(curve[0])
