"""The sheet of a scene: its pattern, drawn, read or made by the user's own function, and the mesh of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from bh.errors import SceneError
from bh.model.plugins import made
from bh.scene.patterns import LIBRARY, DrawingPattern
from bh.scene.reading import as_table, inside, nearest, read_table, shown, within, without
from bh.scene.tables import DrawnTable, GmshTable, MeshTable
from bh.scene.wide_creases import wide_tables, widened
from meshes import CreasePattern, SheetMesh, structured
from meshes.choices import first_mesh

if TYPE_CHECKING:
    from meshes.io.drawing import DrawingOptions

ROOM = 1.03  # thicknesses between layers that are untangled: they press on each other up to 1.005


@dataclass(frozen=True)
class Drawn:
    """What the mesh of a scene was made from.

    Attributes:
        mesh: of the sheet.
        pattern: that was meshed; None where the faces of a file are the mesh.
        file: of the drawing, or None for a pattern of the library.
        options: by which the file was read.
    """

    mesh: SheetMesh
    pattern: CreasePattern | None = None
    file: Path | None = None
    options: DrawingOptions = field(default_factory=dict)  # type: ignore[assignment]


def mesh_of(
    pattern: object,
    mesh: object,
    folder: Path,
    anew: bool = False,
    thickness: float | None = None,
    creases: dict[str, object] | None = None,
) -> Drawn:
    """The meshed sheet of a scene, and what it was made from.

    Args:
        pattern: table [pattern].
        mesh: table [mesh], or None for a coarse one that only shows the places (the mesh is chosen by the run).
        folder: where files that these name are looked for.
        anew: without a table [mesh], the faces of a FOLD file are not the mesh, but a coarse one of its pattern.
        creases: tables of creases, of which some may be strips.
        thickness: of the sheet, mm, that layers of a folded form are moved apart by; None where it is not known.

    Raises:
        SceneError: a table that is not understood, or a mesh that would only fill the memory.
        InputError: a file that cannot be read, or a pattern that cannot be meshed.
    """
    table = as_table(pattern, "pattern")
    if "file" in table:
        return _mesh_from_file(table, mesh, folder, anew, thickness, creases or {})
    drawn = widened(_drawn(table), creases or {})
    if mesh is None:
        with within("pattern"):
            return Drawn(first_mesh(drawn), drawn)
    how = _mesh_table(as_table(mesh, "mesh"))
    if isinstance(how, DrawnTable):
        raise SceneError('mesh.kind = "drawn" is for files; use along or aspect_ratio')
    return Drawn(_meshed(drawn, how), drawn)


def _drawn(table: dict[str, object]) -> CreasePattern:
    """A pattern of the library, or of the user's own: "module:function" with its arguments as keys."""
    kind = table.get("kind")
    listed = ", ".join(LIBRARY)
    if kind is None:
        raise SceneError(f"pattern.kind is missing; use one of {listed}, or give a file")
    if isinstance(kind, str) and ":" in kind:
        with within("pattern"):
            own: CreasePattern = made(kind, without(table, "kind"), CreasePattern)
            return own
    if not isinstance(kind, str) or kind not in LIBRARY:
        raise SceneError(
            f"pattern.kind = {shown(kind)} is not known{nearest(kind, LIBRARY)}; use one of {listed}"
        )
    drawn = read_table(LIBRARY[kind], table, "pattern")
    with within("pattern"):
        return drawn.draw()


def _meshed(flat: CreasePattern, how: MeshTable | GmshTable) -> SheetMesh:
    if isinstance(how, GmshTable):
        from meshes.unstructured import unstructured

        with within("mesh"):
            return unstructured(flat, size=how.size, near=how.near, growth=how.growth, seed=how.seed)
    if not flat.rails:
        raise SceneError(
            f'mesh.kind = "{how.kind}" is for creases that run across the sheet side by side, or round a hole; '
            'these do not: use kind = "gmsh" with size'
        )
    with within("mesh"):
        return structured(flat, aspect_ratio=how.aspect_ratio, along=how.along, rows=how.rows, kind=how.kind)


def _layers_apart(untangle: bool | float, thickness: float | None) -> float | None:
    """How far layers are moved apart, mm: by a little more than panels in contact keep between them."""
    if isinstance(untangle, bool):
        return ROOM * (thickness or 0.0) if untangle else None
    return untangle


def _mesh_table(table: dict[str, object]) -> MeshTable | GmshTable | DrawnTable:
    if table.get("kind") == "gmsh":
        return read_table(GmshTable, table, "mesh")
    if table.get("kind") == "drawn":
        return read_table(DrawnTable, table, "mesh")
    if "size" in table:
        raise SceneError(
            f'mesh.size = {shown(table["size"])} is for kind = "gmsh"; use along or aspect_ratio, or add that kind'
        )
    return read_table(MeshTable, table, "mesh")


def _mesh_from_file(
    table: dict[str, object],
    mesh: object,
    folder: Path,
    anew: bool,
    thickness: float | None,
    creases: dict[str, object],
) -> Drawn:
    from meshes.io import read_drawn, read_fold, read_pattern
    from meshes.io.drawing import PATTERNS

    suffix = Path(str(table["file"])).suffix.lower()
    if suffix not in PATTERNS:
        raise SceneError(
            f"pattern.file = {shown(table['file'])} is no file of a pattern; give one of {', '.join(PATTERNS)}"
        )
    given = read_table(DrawingPattern, table, "pattern")
    if given.frame is not None and suffix != ".fold":
        raise SceneError("pattern.frame is for FOLD files; remove it")
    if given.untangle is not False and (suffix != ".fold" or mesh is not None or anew):
        raise SceneError(
            "pattern.untangle is for the faces of FOLD files as they are; remove it, or [mesh] and accuracy"
        )
    file = inside(folder, given.file, "pattern.file")
    options: DrawingOptions = {
        "scale": given.scale,
        "fit": given.fit,
        "tolerance": given.tolerance,
        "gap": given.gap,
        "outline": given.outline,
        "lines": given.lines,
        "frame": given.frame,
        "sheet": given.sheet,
    }
    how = None if mesh is None else _mesh_table(as_table(mesh, "mesh"))
    own_faces = isinstance(how, DrawnTable) or (mesh is None and not anew)
    wide = wide_tables(creases)
    if wide and (isinstance(how, DrawnTable) or (suffix == ".fold" and own_faces)):
        raise SceneError(
            f"creases.{next(iter(wide))}.width: a wide crease changes the faces of the drawing; give [mesh] kind = "
            '"gmsh" with size'
        )
    with within("pattern.file"):
        if suffix == ".fold" and own_faces and given.sheet is None:
            apart = _layers_apart(given.untangle, thickness)
            return Drawn(
                read_fold(file, given.frame, scale=given.scale, fit=given.fit, untangle=apart),
            )
        if isinstance(how, DrawnTable) or (suffix == ".fold" and own_faces):
            return Drawn(read_drawn(file, **options), None, file, options)
        drawn = read_pattern(file, **options)
    drawn = widened(drawn, creases)
    with within("pattern.file"):
        if how is None:
            return Drawn(first_mesh(drawn), drawn, file, options)
    return Drawn(_meshed(drawn, how), drawn, file, options)
