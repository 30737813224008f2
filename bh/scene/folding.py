"""The scene that folds a file as it is: what `bh fold` runs, and what `bh check` and `bh init` make of a drawing.

The file says how far (its fold angles), else 80 % of the way: 144 degrees at every crease, as springs, so that the
sheet finds its balance where not all angles can be had at once. Springs are about eight times as stiff as a panel
bends, so that panels stay nearly flat. What is assumed is said in remarks, and stands in the scene, to be edited.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bh.errors import InputError
from bh.materials.table import MATERIALS as STOCK
from bh.scene.foldable import Found, understood
from bh.scene.toml_text import written
from meshes import CreasePattern, MeshError, SheetMesh
from meshes.cells import RuledCells
from meshes.choices import choices, cut, panel_width
from meshes.unstructured import sheet_area

PERCENT = 80.0  # of the way, where neither the user nor the file says how far
FULLY = math.radians(170.0)  # drawn angles beyond that mean folded flat: then 80 % of them, too
STIFFER = 8.0  # crease springs against the bending of a panel
STRAIN = 4e-3  # that a spring, one radian off its angle, may make in the narrowest panel
THIN = 0.05  # thickness over the width of a panel, at most, of the sheet that is taken for card
CREASES = 12  # curved creases of which an accuracy can be afforded
ROWS = 4.0  # of cells in a panel between curved creases
SECONDS = 15.0  # of a run to an accuracy
COARSE = 2e-3  # of the diagonal: chords of curves of which the drawing's own faces are made
MATERIALS: Mapping[str, tuple[float, float, float, str]] = {
    "paper": (4000.0, 0.3, 0.1, "paper, 80 g/m2"),
    "card": (3500.0, 0.3, 0.3, "card, 250 g/m2"),
    "board": (3000.0, 0.3, 1.0, "solid board"),
    "pet": (4500.0, 0.38, 0.2, "polyester film"),
    "pp": (1400.0, 0.4, 0.5, "polypropylene sheet"),
    "aluminium": (70000.0, 0.33, 0.2, "aluminium sheet"),
    "steel": (200000.0, 0.3, 0.1, "steel shim"),
}


@dataclass(frozen=True)
class Wish:
    """How a file is to be folded.

    Attributes:
        angle: fold angle of every crease, rad; None for what the file says, or `percent`.
        percent: of the drawn angles, or of 180 degrees; None for the drawn angles as they are, or 80 without any.
        material: one of `MATERIALS` or of the table of materials; None for card, or paper where card is thick for the
            panels.
        fit: longer side of the sheet, mm.
        scale: mm a unit of the drawing.
        frame: of a FOLD file.
        sheet: which of several sheets that are drawn, from 1.
        write: formats of the folded sheet, such as "glb".
        contact: panels of a net of faces stop each other, too, which takes its time; other sheets do so anyway.
    """

    angle: float | None = None
    percent: float | None = None
    material: str | None = None
    fit: float | None = None
    scale: float | None = None
    frame: int | str | None = None
    sheet: int | None = None
    write: tuple[str, ...] = ()
    contact: bool = False


PASSING = "panels of a net may pass through each other; without this line they stop, which takes its time"


@dataclass(frozen=True)
class Proposal:
    """A scene that may fold a file.

    Attributes:
        text: TOML.
        mesh: in words, what it is solved on.
        assumed: one line for each thing that neither file nor user has said.
    """

    text: str
    mesh: str
    assumed: tuple[str, ...]


def proposals(file: str | os.PathLike[str], wish: Wish | None = None) -> list[Proposal]:
    """Scenes that may fold a file, the most promising first; they look for it in their own folder.

    Args:
        file: .svg, .dxf, .fold, .cp or .opx.
        wish: how to fold it; None for the defaults.

    Returns:
        the scenes, at least one.

    Raises:
        InputError: it cannot be read, has no crease, or no mesh can be made of it; one line.
    """
    wish = wish or Wish()
    _check(wish)
    options: dict[str, object] = {
        key: value
        for key, value in (
            ("fit", wish.fit),
            ("scale", wish.scale),
            ("frame", wish.frame),
            ("sheet", wish.sheet),
        )
        if value is not None
    }
    found, assumed = understood(Path(file), options)
    return _proposed(Path(file), wish, found, options, assumed)


def _check(wish: Wish) -> None:
    if wish.material is not None and wish.material not in (*MATERIALS, *STOCK):
        raise InputError(
            f"material '{wish.material}' is not known; use one of {', '.join(MATERIALS)}, "
            f"or of the table of materials: {', '.join(name for name in STOCK if name not in MATERIALS)}"
        )
    if wish.angle is not None and wish.percent is not None:
        raise InputError("an angle and a percentage are both given; give one of them")
    if wish.angle is not None and not 0.0 < wish.angle < math.pi:
        raise InputError(
            f"an angle of {math.degrees(wish.angle):g} degrees cannot be; give 0 to 180, such as 60deg"
        )
    if wish.percent is not None and not 0.0 < wish.percent <= 100.0:
        raise InputError(f"{wish.percent:g} percent cannot be; give more than 0, up to 100")


def _numbers(material: str) -> tuple[float, float, float, str]:
    """(E, nu, t, about) of a name; of a grained one of the table the means, since no grain is known here."""
    if material in MATERIALS:
        return MATERIALS[material]
    sheet = STOCK[material].sheet()
    return round(sheet.E, 1), round(sheet.nu, 3), sheet.t, STOCK[material].about


def _proposed(
    file: Path,
    wish: Wish,
    found: Found,
    options: Mapping[str, object],
    assumed: list[str],
) -> list[Proposal]:
    sheet = found.faces or found.pattern
    assert sheet is not None
    folded = [fold for fold in sheet.folds.values() if fold in ("mountain", "valley")]
    if not folded:
        raise InputError(
            f"{file}: there is no mountain or valley crease to fold; draw creases in red and blue, or say what the "
            'lines stand for in a scene: lines = { "#00aa00" = "valley" } (bh init --drawing writes one)'
        )
    width = _width(found)
    material = wish.material or ("card" if MATERIALS["card"][2] <= THIN * width else "paper")
    young, nu, t, about = _numbers(material)
    if material != wish.material:
        assumed.append(f"{about}: no material is given")
    spring = max(width / STIFFER, t**2 / (12.0 * STRAIN * _narrowest(found, width)))
    step, words = _step(wish, sheet, spring)
    if t > 0.1 * width:
        assumed.append(
            f"{about} of {t:g} mm is thick for panels of about {width:.2g} mm: no thin sheet any more"
        )
    scenes = []
    for mesh, in_words, formulation in _meshes(found, width):
        lines = [
            f"# {file.name} folded by `bh fold`; edit it, and run it by `bh run`. mm, N, rad; docs/scenes.md.",
            *(f"# assumed: {line}" for line in (*assumed, words)),
            "",
            *(
                [f"contact = false                  # {PASSING}", ""]
                if formulation and not wish.contact
                else []
            ),
            *([mesh, ""] if mesh.startswith("accuracy") else []),
            "[pattern]",
            f"file = {written(file.name)}",
            *(f"{key} = {written(value)}" for key, value in options.items()),
            *(
                [f"tolerance = {_tolerance(found):.3g}"]
                if "drawn" in mesh and file.suffix.lower() != ".fold"
                else []
            ),
            "",
            f"[sheet]                          # {about}",
            f"E = {young}",
            f"nu = {0.0 if formulation == 'bars-and-hinges' else nu}",
            f"t = {t}",
            "",
            *(["[mesh]", mesh, ""] if not mesh.startswith("accuracy") else []),
            "[model]",
            *([f'formulation = "{formulation}"'] if formulation else []),
            *(
                ['strategy = "settling"          # nets snap: each state is where the sheet comes to rest']
                if formulation
                else []
            ),
            "",
            "[[steps]]",
            step,
            "",
            "[outputs]",
            "pictures = true",
            *([f"folded = {written(wish.write)}"] if wish.write else []),
            "",
        ]
        scenes.append(Proposal("\n".join(lines), in_words, (*assumed, words)))
    return scenes


def _step(wish: Wish, sheet: SheetMesh | CreasePattern, length: float) -> tuple[str, str]:
    """The fold of the step, and in words how far it goes and why."""
    spring = f"Lstar = {length:.3g}"
    if wish.angle is not None:
        return f'fold = {{ crease = "all", by = {wish.angle:.6g}, {spring} }}', (
            f"springs at every crease want {math.degrees(wish.angle):g} degrees, as asked for"
        )
    drawn = _drawn_angles(sheet)
    known = drawn[~np.isnan(drawn)]
    if not len(known):
        percent = PERCENT if wish.percent is None else wish.percent
        angle = math.pi * min(percent / 100.0, 1.0 - 1e-6)
        origin = "the file gives no fold angles" if wish.percent is None else "as asked for"
        return f'fold = {{ crease = "all", by = {angle:.6g}, {spring} }}', (
            f"springs at every crease want {math.degrees(angle):.0f} degrees, {percent:g} % of the way ({origin})"
        )
    fully = bool((known > FULLY).any())
    percent = wish.percent if wish.percent is not None else PERCENT if fully else 100.0
    origin = (
        "as asked for"
        if wish.percent is not None
        else "they close completely"
        if fully
        else "as the file says"
    )
    some = "" if len(known) == len(drawn) else "; creases without an angle are taken as closing completely"
    part = f", part = {percent / 100.0:g}" if percent != 100.0 else ""
    return f'fold = {{ crease = "all", by = "drawn"{part}, {spring} }}', (
        f"springs at every crease want {percent:g} % of the drawn angles ({origin}){some}"
    )


def _drawn_angles(sheet: SheetMesh | CreasePattern) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Sizes of the drawn angles of mountains and valleys, rad, nan where there is none."""
    if isinstance(sheet, CreasePattern):
        values = [math.nan if c.angle is None else c.angle for c in sheet.creases if c.fold != "flat"]
        return np.array(values)
    parts = [
        np.abs(sheet.fold_angles.get(name, np.full(len(sheet.crease_edges(name)), np.nan)))
        for name in sheet.creases
        if sheet.folds.get(name) != "flat"
    ]
    return np.concatenate([np.asarray(part) for part in parts])


def _meshes(found: Found, width: float) -> list[tuple[str, str, str]]:
    """(tables of the mesh, the same in words, formulation or "" for the program's own choice), the best first."""
    drawn = [
        ('kind = "drawn"', "the faces of the drawing", "bars-and-hinges"),
        ('kind = "drawn"', "the faces of the drawing, which may bend", "consistent"),
    ]
    pattern = found.pattern
    if pattern is None:
        return drawn
    scenes = []
    if len(pattern.creases) <= CREASES:
        scenes.append(
            (
                f"accuracy = {{ within = 0.05, seconds = {SECONDS:g} }}",
                "mesh and formulation of the program's choice, to 5 % of the energy",
                "",
            )
        )
        scenes += _ruled(pattern) if pattern.rails else []
    ruled = found.faces is not None and len(pattern.facets) >= len(pattern.creases)
    if ruled:
        scenes += drawn
    size = max(width, math.sqrt(sheet_area(pattern)) / 60.0)
    for finer in (1.0, 2.0, 4.0):
        words = f"triangles of {size / finer:.3g} mm by gmsh"
        scenes.append((f'kind = "gmsh"\nsize = {size / finer:.4g}', words, "consistent"))
    if found.faces is not None and not ruled:
        scenes += drawn
    return scenes


def _ruled(pattern: CreasePattern) -> list[tuple[str, str, str]]:
    """A mesh along rulings, four rows a panel, if there is one."""
    for cells in choices(pattern, "staggered", ROWS):
        if not isinstance(cells, RuledCells):
            break
        try:
            cut(pattern, cells)
        except MeshError:
            continue
        table = f'kind = "{cells.kind}"\nalong = {cells.along}\nrows = {cells.rows}'
        return [(table, str(cells), "consistent")]
    return []


def _width(found: Found) -> float:
    """Width of a typical panel, mm."""
    if found.pattern is not None:
        return panel_width(found.pattern)
    assert found.faces is not None
    mesh = found.faces
    names = [name for name in ("mountain", "valley") if name in mesh.creases]
    pairs = np.vstack(
        [mesh.crease_edges(name) for name in names or mesh.creases[:1]] + [mesh.topology.boundary]
    )
    lengths = np.linalg.norm(mesh.points[pairs[:, 0]] - mesh.points[pairs[:, 1]], axis=1)
    area = float(mesh.areas.sum())
    half = len(mesh.topology.boundary)
    return max(area / float(lengths.sum() - 0.5 * lengths[-half:].sum()), 2e-3 * math.sqrt(area))


def _narrowest(found: Found, width: float) -> float:
    """Height of the narrowest face that is no sliver, mm; where faces are not known a third of a panel's width."""
    if found.faces is None:
        return width / 3.0
    corners = found.faces.points[found.faces.triangles]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    heights = 2.0 * found.faces.areas / sides.max(axis=1)
    return max(float(np.quantile(heights, 0.02)), width / 10.0)


def _tolerance(found: Found) -> float:
    sheet = found.faces.points if found.faces is not None else found.pattern.rings[0]  # type: ignore[union-attr]
    return COARSE * float(np.linalg.norm(np.ptp(sheet, axis=0)))
