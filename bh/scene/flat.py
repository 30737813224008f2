"""The flat pattern of a scene for the cutter: what was drawn, not the mesh that was made of it. mm."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from bh.errors import InputError
from bh.model.actuations import Fold
from bh.model.pinch import Pinch
from bh.model.step import Step
from bh.scene.load import Scene
from meshes import CreasePattern
from meshes.curves import Array, Line
from meshes.io import read_pattern
from meshes.io.drawing import DrawingOptions
from meshes.io.flat_lines import FlatLine, drawn_lines, flat_lines, with_angles
from meshes.io.writing import TEXT, Note, write_pattern

Angles = Literal["layer", "text"]
TICK = 3.0  # mm that the mark of a pinch reaches to either side of its crease


@dataclass(frozen=True)
class Cutting:
    """How a flat pattern is written.

    Attributes:
        facets: also lines along which the sheet does not fold.
        perforate: creases cut up into dashes of (cut, left), mm, or None.
        kerf: width of the beam, mm.
        units: of the file.
        angles: fold angles as names of layers, or as texts beside the creases; None for neither.
        marks: pinches of the scene as short lines across their creases, on a layer "pinch".
    """

    facets: bool = False
    perforate: tuple[float, float] | None = None
    kerf: float = 0.0
    units: Literal["mm", "in"] = "mm"
    angles: Angles | None = None
    marks: bool = False


def write_flat_pattern(
    file: str | os.PathLike[str], source: Scene | Path, how: Cutting | None = None
) -> Path:
    """Write the flat pattern of a scene, or of a drawing, to an .svg or .dxf file: its own curves, holes and layers.

    A scene whose mesh is the faces of a FOLD file, or was put together in Python, is drawn along the edges of its mesh.

    Args:
        file: its suffix says the format.
        source: a scene with its pattern, or the file of a drawing.
        how: kerf, perforation, units, marks and angles; None for none of these, in mm.

    Returns:
        the absolute path of the file.

    Raises:
        InputError: options that cannot be, a mesh that is not flat, a place that cannot be written to.
    """
    how = how or Cutting()
    if how.angles is not None and how.angles not in get_args(Angles):
        raise InputError(f"angles = '{how.angles}' is not known; use {' or '.join(get_args(Angles))}")
    lines, pattern = _lines(source) if isinstance(source, Scene) else _read(source, {})
    steps = source.model.steps if isinstance(source, Scene) else ()
    notes: list[Note] = []
    if how.angles is not None:
        angles = fold_angles(steps, pattern) if pattern is not None else {}
        if pattern is None or not angles:
            raise InputError(
                f"'{file}': no fold angle is known; fold the creases of the scene by one angle each, or draw them"
            )
        if how.angles == "layer":
            lines = with_angles(lines, pattern, angles)
        else:
            notes = list(_notes(pattern, angles))
    if how.marks:
        marks = list(_marks(steps, pattern)) if pattern is not None else []
        if not marks:
            raise InputError(f"'{file}': there is no pinch in this scene to mark")
        lines += marks
    write_pattern(
        file,
        lines,
        facets=how.facets,
        perforate=how.perforate,
        kerf=how.kerf,
        units=how.units,
        angle_layers=how.angles == "layer",
        notes=notes,
    )
    return Path(file).resolve()


def fold_angles(steps: Sequence[Step], pattern: CreasePattern) -> dict[str, float]:
    """Fold angles of creases, rad, not negative: the last that a step asks for, else the drawn one.

    Args:
        steps: of a model; angles that differ from edge to edge are left out.
        pattern: has the creases.

    Returns:
        By crease.
    """
    found = {crease.name: crease.angle for crease in pattern.creases if crease.angle is not None}
    for step in steps:
        for fold in step.actuations:
            if isinstance(fold, Fold) and (angle := _angle(fold)) is not None:
                found |= dict.fromkeys(_creases(pattern, fold.crease), angle)
    return found


def _angle(fold: Fold) -> float | None:
    dihedral = fold.to if fold.to is not None else fold.rest
    if isinstance(dihedral, int | float):
        return abs(math.pi - dihedral)
    return abs(fold.by) if isinstance(fold.by, int | float) else None


def _creases(pattern: CreasePattern, name: str) -> list[str]:
    """The creases that a name stands for: one, a group, or all that are drawn as mountain or valley."""
    if name == "all":
        return [crease.name for crease in pattern.creases if crease.fold != "flat"]
    groups = dict(pattern.groups)
    members = groups.get(f"crease:{name}", (f"crease:{name}",))
    known = {crease.name for crease in pattern.creases}
    return [member for part in members if (member := part.removeprefix("crease:")) in known]


def _lines(scene: Scene) -> tuple[list[FlatLine], CreasePattern | None]:
    drawn = scene.drawn
    if drawn is None:
        return flat_lines(scene.model.mesh), None
    if drawn.file is None:
        return flat_lines(drawn.mesh if drawn.pattern is None else drawn.pattern), drawn.pattern
    return _read(drawn.file, drawn.options, drawn.pattern)


def _read(
    file: Path, options: DrawingOptions, pattern: CreasePattern | None = None
) -> tuple[list[FlatLine], CreasePattern]:
    """The lines of a drawing, and its pattern where that is not known."""
    return drawn_lines(file, **options), pattern or read_pattern(file, **options)


def _notes(pattern: CreasePattern, angles: dict[str, float]) -> Iterator[Note]:
    """A text beside the middle of every crease with an angle, such as "m1 60 deg"."""
    for crease in pattern.creases:
        if crease.name in angles:
            x, y = crease.curve.point(np.array([0.5]))[0].tolist()
            yield Note(f"{crease.name} {math.degrees(angles[crease.name]):.4g} deg", (x, y + 0.3 * TEXT))


def _marks(steps: Sequence[Step], pattern: CreasePattern) -> Iterator[FlatLine]:
    """Lines across the creases where they are pinched: a long one at the middle of a zone, short ones at its ends."""
    curves = {crease.name: crease.curve for crease in pattern.creases}
    pinches = [each for step in steps for each in step.actuations if isinstance(each, Pinch)]
    for number, pinch in enumerate(pinches, start=1):
        for name in _creases(pattern, pinch.crease):
            curve = curves[name]
            half = 0.5 * (0.2 if pinch.length is None else pinch.length / curve.length)
            for part, reach in ((pinch.at - half, 0.5), (pinch.at, 1.0), (pinch.at + half, 0.5)):
                if 0.0 <= part <= 1.0:
                    points = curve.point(np.clip(np.array([part - 1e-4, part, part + 1e-4]), 0.0, 1.0))
                    yield FlatLine("pinch", f"pinch {number}", _across(points, reach * TICK))


def _across(points: Array, reach: float) -> Line:
    """The line across a curve at the second of three of its points, `reach` to either side, mm."""
    along = points[2] - points[0]
    normal = reach * np.array([-along[1], along[0]]) / np.linalg.norm(along)
    a, b = points[1] - normal, points[1] + normal
    return Line((float(a[0]), float(a[1])), (float(b[0]), float(b[1])))
