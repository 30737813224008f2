"""What a file holds that `bh fold` can fold, and what has to be assumed so that it does.

A size where the numbers are absurd and no unit is stated, the hull where no outline is drawn, the first of several
sheets, lines joined that nearly meet: what remarks and errors of the readers advise is done, and said.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from bh.errors import InputError
from meshes import CreasePattern, SheetMesh
from meshes.io.fold import BENT
from meshes.planar import CORNER

FIT = 200.0  # mm, the longer side of a sheet whose file says no unit and whose numbers make an absurd size
STRAIGHT = 0.02  # rad that a crease turns between its ends, by which it is still straight
JOINING = re.compile(r"to join them: gap = ([0-9.e+-]+)")  # as remarks of readers advise
HEALING = re.compile(r"heal it with gap = ([0-9.e+-]+)")  # as their errors do where an outline is open
HEALED = 2e-3  # of the sheet's diagonal: a larger opening is no slip of the pen
SHEETS = re.compile(r"sheet = 1 to ([0-9]+)")  # as their errors do
KINDS = ("mountain", "valley", "flat")  # names of all creases of a kind


@dataclass
class Found:
    """What a file holds.

    Attributes:
        faces: its own, as a mesh.
        pattern: to be meshed anew, where its own faces will not do.
        why: the errors, where one of them could not be read.
    """

    faces: SheetMesh | None = None
    pattern: CreasePattern | None = None
    why: list[InputError] = field(default_factory=list)

    @property
    def sheet(self) -> SheetMesh | CreasePattern | None:
        """Faces or pattern."""
        return self.faces or self.pattern


def understood(file: Path, options: dict[str, object]) -> tuple[Found, list[str]]:
    """What a file holds, read with what it needs.

    Args:
        file: .svg, .dxf, .fold, .cp or .opx.
        options: of `meshes.io.read_pattern`; what is assumed is added.

    Returns:
        what it holds, with faces or a pattern, and one line for everything that is assumed.

    Raises:
        InputError: it cannot be read.
    """
    assumed: list[str] = []
    found = _rescued(file, _read(file, options), options, assumed)
    if found.sheet is None:
        raise found.why[0]
    if not options.keys() & {"fit", "scale"} and any(
        "states no unit" in text for text in found.sheet.remarks
    ):
        assumed.append(f"the file states no unit and would be absurdly small or large: fitted to {FIT:g} mm")
        options["fit"] = FIT
        found = _read(file, options)
    return _joined(file, found, options, assumed), assumed


def _rescued(file: Path, found: Found, options: dict[str, object], assumed: list[str]) -> Found:
    """The file read as its errors advise: with the hull as its outline, or the first of its sheets."""
    why = " ".join(map(str, found.why))
    if found.sheet is not None:
        return found
    if 'outline = "hull"' in why and "outline" not in options:
        more: dict[str, object] = {"outline": "hull"}
        words = "no closed outline is drawn: the convex hull of all lines is taken"
    elif (sheets := SHEETS.search(why)) and "sheet" not in options:
        more = {"sheet": 1}
        words = (
            f"the drawing holds {sheets[1]} sheets: the first from the top left is folded; --sheet 2 folds another, "
            "--sheet all each of them"
        )
    elif (miss := HEALING.search(why)) and "gap" not in options:
        more = {"gap": float(miss[1])}
        words = f"the outline is open by a little: its ends are joined by gap = {float(miss[1]):g} mm"
    else:
        return found
    again = _read(file, options | more)
    if again.sheet is None or ("gap" in more and float(str(more["gap"])) > HEALED * _diagonal(again.sheet)):
        return found
    options |= more
    assumed.append(words)
    return again


def _read(file: Path, options: Mapping[str, object]) -> Found:
    """Own faces first, a pattern where these will not do: creases that bend, lines that end inside, no faces."""
    from meshes.io import read_fold
    from meshes.io.drawing import ReadDrawing, read_drawing

    @cache
    def lines() -> ReadDrawing:
        return read_drawing(file, **dict(options))  # type: ignore[arg-type]

    found = Found()
    try:
        if file.suffix.lower() == ".fold" and not options.keys() & {"sheet", "outline", "gap"}:
            given = dict(options)
            found.faces = read_fold(file, given.pop("frame", None), **given)  # type: ignore[arg-type]
        else:
            found.faces = lines().faces()
    except InputError as error:
        found.why.append(error)
    if found.faces is None or (found.faces.flat and (_bent(found.faces) or _has_curves(found.faces))):
        try:
            found.pattern = lines().pattern()
        except InputError as error:
            found.why.append(error)
    return found


def _joined(file: Path, found: Found, options: dict[str, object], assumed: list[str]) -> Found:
    """The file read once more with the gap that joins lines which nearly meet, where its remarks advise one."""
    sheet = found.faces or found.pattern
    gaps = [float(gap) for text in (sheet.remarks if sheet else ()) for gap in JOINING.findall(text)]
    if not gaps or "gap" in options:
        return found
    joined = _read(file, options | {"gap": max(gaps)})
    if joined.faces is None and joined.pattern is None:
        return found
    assumed.append(f"lines that end close to others ({len(gaps)}) are joined by gap = {max(gaps):g} mm")
    options["gap"] = max(gaps)
    return joined


def _diagonal(sheet: SheetMesh | CreasePattern) -> float:
    """Of the sheet's bounding box, mm."""
    points = sheet.points if isinstance(sheet, SheetMesh) else sheet.rings[0]
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _has_curves(mesh: SheetMesh) -> bool:
    """True if edges of its file are curves, of which the faces have the chords alone."""
    return any(BENT in remark for remark in mesh.remarks)


def _bent(mesh: SheetMesh) -> bool:
    """True if a crease turns on its way, by less than a corner and where no other crease meets it: a curve."""
    drawn = [mesh.topology.boundary, *(mesh.crease_edges(name) for name in mesh.folds if name in KINDS)]
    degree = np.bincount(
        np.concatenate([np.asarray(pairs).ravel() for pairs in drawn]), minlength=len(mesh.points)
    )
    for name in mesh.creases:
        pairs = mesh.crease_edges(name)
        if name in KINDS or len(pairs) < 4:
            continue
        steps = mesh.points[pairs[:, 1], :2] - mesh.points[pairs[:, 0], :2]
        turns = np.abs(np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))))
        if turns[(turns <= CORNER) & (degree[pairs[1:, 0]] == 2)].sum() > STRAIGHT:
            return True
    return False
