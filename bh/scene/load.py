"""Scene files: TOML to a `Model`, with errors that name the key, its value and what is allowed.

Every error is a `SceneError` of one line. Keys are told as dotted paths; entries of [[steps]] and
[[supports]] count from 0, so that `steps[0]` is the first step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bh.errors import InputError, SceneError
from bh.formulations.observables import Until
from bh.formulations.registry import formulation, names
from bh.loading.program import program
from bh.loading.symmetry import Plane, check, mirror
from bh.model.actuations import Actuation, Displace, Force
from bh.model.model import CreaseLaw, Model, Sheet
from bh.model.plugins import made
from bh.model.refinement import Goal
from bh.model.serialise import ACTUATIONS as MAKERS
from bh.model.supports import Holding, RigidBody, Support, directions, select
from bh.scene.patterns import LIBRARY, DrawingPattern, FilePattern
from bh.scene.reading import (
    as_table,
    as_tables,
    as_tuple,
    check_keys,
    nearest,
    one_line,
    one_or_more,
    read_table,
    read_toml,
    shown,
    within,
    without,
)
from bh.scene.tables import (
    ACTUATIONS,
    CreaseTable,
    DrawnTable,
    GmshTable,
    MeshTable,
    ModelTable,
    OutputsTable,
    SheetTable,
    SupportTable,
    UntilTable,
)
from bh.scene.wanted_accuracy import wanted_accuracy
from meshes import CreasePattern, SheetMesh, structured
from meshes.cells import first_mesh

SECTIONS = ("pattern", "sheet", "mesh", "model", "supports", "creases", "steps", "outputs", "accuracy",
            "symmetry")  # fmt: skip
LARGEST_MESH = 4_000_000  # triangles; a sheet of that many takes some ten gigabytes to solve
LONGEST_FILE = 20_000_000  # bytes


@dataclass(frozen=True)
class Outputs:
    """What `bh run` writes beside the result: pictures, the path (PVD, VTU), the folded sheet, the flat pattern."""

    pictures: bool = False
    vtu: bool = False
    fold: bool = False
    folded: tuple[str, ...] = ()
    flat: tuple[str, ...] = ()


@dataclass(frozen=True)
class Scene:
    """A scene that is ready to be solved: `bh.trace(scene.model)`.

    Attributes:
        model: checked; its steps can be programmed (`bh.loading.builder`), nothing is solved.
        outputs: what a run is to write.
        accuracy: the wanted accuracy, or None: `bh.trace(scene.model, accuracy=scene.accuracy)`.
        symmetry: the plane of a scene to be solved by halves, or None: `bh.trace(..., symmetry=scene.symmetry)`.
        name: the file's name without its suffix.
        source: the file, or None for a scene that was parsed from text.
    """

    model: Model
    outputs: Outputs
    name: str = "scene"
    source: Path | None = None
    accuracy: Goal | None = None
    symmetry: Plane | None = None


def load_scene(path: str | Path) -> Scene:
    """Read a scene file.

    Raises:
        SceneError: it cannot be read, or asks for what cannot be; one line that begins with the file's name.
    """
    path = Path(path)
    if path.suffix.lower() == ".fold":
        raise SceneError(
            one_line(
                f"'{path}' is a pattern, not a scene; name it in a scene file: [pattern] file = \"{path.name}\" "
                "(see examples/miura.toml)"
            )
        )
    if path.suffix.lower() == ".bh":
        raise SceneError(one_line(f"'{path}' is a solved path, not a scene; look at it with `bh view`"))
    try:
        with path.open("rb") as file:
            content = file.read(LONGEST_FILE + 1)
        if len(content) > LONGEST_FILE:
            raise SceneError(f"the file is longer than {LONGEST_FILE // 10**6} MB; give a scene file (TOML)")
        text = content.decode("utf-8-sig")
        scene = _scene(text, path.parent)
    except FileNotFoundError as error:
        raise SceneError(one_line(f"there is no scene file '{path}'; check the name")) from error
    except IsADirectoryError as error:
        raise SceneError(one_line(f"'{path}' is a folder; give the scene file (TOML) in it")) from error
    except UnicodeDecodeError as error:
        raise SceneError(
            one_line(f"{path}: byte {error.start} is not UTF-8; save the file as UTF-8 text")
        ) from error
    except InputError as error:
        raise SceneError(one_line(f"{path}: {error}")) from error
    except (OSError, ValueError) as error:  # rights, a null character in the name
        why = getattr(error, "strerror", None) or error
        raise SceneError(one_line(f"the scene file '{path}' cannot be read ({why})")) from error
    return replace(scene, name=path.stem, source=path)


def parse_scene(text: str, folder: str | Path = ".", name: str = "scene") -> Scene:
    """A scene from its text; `folder` is where files that it names are looked for.

    Raises:
        SceneError: the text is not TOML, or what it asks for cannot be; one line that begins with `name`.
    """
    try:
        return replace(_scene(text, Path(folder)), name=name)
    except InputError as error:
        raise SceneError(one_line(f"{name}: {error}")) from error


def scene_from_tables(tables: dict[str, Any], folder: str | Path = ".", name: str = "scene") -> Scene:
    """A scene from its tables as `tomllib` reads them: what a sweep changes between points.

    Raises:
        SceneError: as `parse_scene`.
    """
    try:
        return replace(_from_tables(tables, Path(folder)), name=name)
    except InputError as error:
        raise SceneError(one_line(f"{name}: {error}")) from error


def _scene(text: str, folder: Path) -> Scene:
    return _from_tables(read_toml(text), folder)


def _from_tables(data: dict[str, Any], folder: Path) -> Scene:
    check_keys("", data, SECTIONS)
    for key in ("pattern", "sheet", "steps"):
        if key not in data:
            raise SceneError(f"{key} is missing; add a table {'[[steps]]' if key == 'steps' else f'[{key}]'}")
    sheet = read_table(SheetTable, data["sheet"], "sheet")
    how = read_table(ModelTable, data.get("model", {}), "model")
    name = _formulation(how.formulation)
    outputs = read_table(OutputsTable, data.get("outputs", {}), "outputs")
    supports = as_tables(data.get("supports", []), "supports")
    creases = as_table(data.get("creases", {}), "creases")
    model = Model(
        mesh=_mesh(data["pattern"], data.get("mesh"), folder),
        sheet=Sheet(E=sheet.E, t=sheet.t, nu=sheet.nu),
        supports=tuple(_support(item, f"supports[{i}]") for i, item in enumerate(supports)),
        steps=tuple(_step(item, f"steps[{i}]") for i, item in enumerate(as_tables(data["steps"], "steps"))),
        creases={crease: _crease(item, f"creases.{crease}") for crease, item in creases.items()},
        formulation=name,
        hinge_lock=how.hinge_lock,
    )
    _check(model)
    accuracy = wanted_accuracy(data, model)
    return Scene(model, Outputs(**{name: as_tuple(value) for name, value in outputs}), accuracy=accuracy,
                 symmetry=_symmetry(model, data["symmetry"]) if "symmetry" in data else None)  # fmt: skip


def _symmetry(model: Model, data: Any) -> Plane:
    """A letter, or a normal."""
    if not isinstance(data, str | list):
        raise SceneError(f'symmetry = {shown(data)} cannot be; give "x", "y" or a normal [x, y, 0]')
    with within("symmetry"):
        check(model, program(model), mirror(model.mesh, data))
    return data if isinstance(data, str) else tuple(data)


# --- from tables to descriptions ----------------------------------------------------------------------------


def _formulation(name: str) -> str:
    known = names()
    if name not in known and ":" not in name:
        listed = ", ".join(known) or "none; install the project with pip first"
        raise SceneError(
            f"model.formulation = {shown(name)} is not known{nearest(name, known)}; use one of {listed}"
        )
    return name


def _mesh(pattern: Any, mesh: Any, folder: Path) -> SheetMesh:
    table = as_table(pattern, "pattern")
    if "file" in table:
        return _mesh_from_file(table, mesh, folder)
    drawn = _drawn(table)
    if mesh is None:
        with within("pattern"):
            return first_mesh(drawn)
    how = _mesh_table(as_table(mesh, "mesh"))
    if isinstance(how, DrawnTable):
        raise SceneError('mesh.kind = "drawn" is for SVG and DXF files; use along or aspect_ratio')
    return _meshed(drawn, how)


def _drawn(table: dict[str, Any]) -> CreasePattern:
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
        from meshes.unstructured import sheet_area, unstructured

        _check_triangles(sheet_area(flat) / (0.433 * how.size**2))  # equilateral ones
        with within("mesh"):
            return unstructured(flat, size=how.size, near=how.near, growth=how.growth, seed=how.seed)
    if not flat.rails:
        raise SceneError(
            f'mesh.kind = "{how.kind}" is for creases that run across the sheet side by side, or round a hole; '
            'these do not: use kind = "gmsh" with size'
        )
    _check_size(flat, how)
    with within("mesh"):
        return structured(flat, aspect_ratio=how.aspect_ratio, along=how.along, rows=how.rows, kind=how.kind)


def _mesh_table(table: dict[str, Any]) -> MeshTable | GmshTable | DrawnTable:
    if table.get("kind") == "gmsh":
        return read_table(GmshTable, table, "mesh")
    if table.get("kind") == "drawn":
        return read_table(DrawnTable, table, "mesh")
    if "size" in table:
        raise SceneError(
            f'mesh.size = {shown(table["size"])} is for kind = "gmsh"; use along or aspect_ratio, or add that kind'
        )
    return read_table(MeshTable, table, "mesh")


def _mesh_from_file(table: dict[str, Any], mesh: Any, folder: Path) -> SheetMesh:
    name = shown(table["file"])
    suffix = Path(str(table["file"])).suffix.lower()
    if suffix in (".svg", ".dxf"):
        return _mesh_from_drawing(read_table(DrawingPattern, table, "pattern"), mesh, folder)
    stored = read_table(FilePattern, table, "pattern")
    if suffix != ".fold":
        raise SceneError(f"pattern.file = {name} is no file of a pattern; give .svg, .dxf or .fold")
    if mesh is not None:
        raise SceneError(f"mesh: {name} brings its own faces, and they are the mesh; remove [mesh]")
    from meshes.io import read_fold

    with within("pattern.file"):
        return read_fold(folder / stored.file, stored.frame)


def _mesh_from_drawing(table: DrawingPattern, mesh: Any, folder: Path) -> SheetMesh:
    from meshes.io import read_drawn, read_pattern

    options = {name: value for name, value in table if name != "file"}
    if mesh is None:
        with within("pattern.file"):
            return first_mesh(read_pattern(folder / table.file, **options))
    how = _mesh_table(as_table(mesh, "mesh"))
    with within("pattern.file"):
        if isinstance(how, DrawnTable):
            return read_drawn(folder / table.file, **options)
        drawn = read_pattern(folder / table.file, **options)
    return _meshed(drawn, how)


def _check_size(pattern: CreasePattern, how: MeshTable) -> None:
    """Refuse what would only fill the memory; `structured` decides the exact numbers."""
    panels = len(pattern.rails) - 1
    along = float(how.along or 0)
    if how.aspect_ratio is not None:
        length = max(rail.length for rail in pattern.rails)
        # at one end and in the middle: panels can taper
        inner, outer = (rail.point(np.array([0.0, 0.5])) for rail in (pattern.rails[0], pattern.rails[-1]))
        height = float(np.linalg.norm(outer - inner, axis=1).max()) / panels
        along = how.aspect_ratio * length / height * how.rows
    _check_triangles(2.0 * along * how.rows * panels)


def _check_triangles(triangles: float) -> None:
    if triangles > LARGEST_MESH:
        raise SceneError(f"mesh: this is some {triangles:.2g} triangles; ask for fewer than {LARGEST_MESH:,}")


def _support(item: Any, at: str) -> Holding:
    if isinstance(item, dict) and ":" in str(item.get("kind")):
        with within(at):
            held: Holding = made(item["kind"], without(item, "kind"), Holding)
            return held
    table = read_table(SupportTable, item, at)
    if table.at == "rigid-body":
        return RigidBody()
    place = table.at if isinstance(table.at, str) else tuple(table.at)
    if table.fix is None:
        return Support(place, clamp=table.clamp)
    fix: Any = table.fix
    if not isinstance(fix, str):
        vectors = fix if isinstance(fix[0], list) else [fix]
        fix = tuple(_direction(vector, f"{at}.fix") for vector in vectors)
    with within(f"{at}.fix"):
        directions(fix)
    return Support(place, fix, table.clamp)


def _crease(item: Any, at: str) -> CreaseLaw:
    table = read_table(CreaseTable, item, at)
    with within(at):
        return CreaseLaw(table.Lstar, table.stiffness, table.rest)


def _step(item: Any, at: str) -> tuple[Actuation | Until, ...]:
    step = as_table(item, at)
    check_keys(at, {key: step[key] for key in step if ":" not in key}, (*ACTUATIONS, "until"))
    if not set(step) - {"until"}:
        raise SceneError(f"{at} is empty; add one of {', '.join(ACTUATIONS)}")
    found: list[Actuation | Until] = []
    for key, value in step.items():
        if key == "until":
            found.append(_until(value, f"{at}.until"))
            continue
        for where, each in one_or_more(value, f"{at}.{key}"):
            found.append(_actuation(key, each, where))
    return tuple(found)


def _until(item: Any, at: str) -> Until:
    table = read_table(UntilTable, item, at)
    with within(at):
        if table.depth is not None:
            return Until("depth", table.depth, tolerance=table.tolerance)
        assert table.observable is not None
        assert table.value is not None
        return Until(table.observable, table.value, table.of, table.tolerance)


def _actuation(key: str, item: Any, at: str) -> Actuation:
    if ":" in key:
        with within(at):
            own: Actuation = made(key, as_table(item, at), Actuation)
            return own
    given = {name: as_tuple(value) for name, value in read_table(ACTUATIONS[key], item, at)}
    if isinstance(given.get("direction"), tuple):
        given["direction"] = _direction(given["direction"], f"{at}.direction")
    with within(at):
        return MAKERS[key](**given)


def _direction(vector: Sequence[float], at: str) -> tuple[float, ...]:
    """The vector over its largest component, so that very small and very large ones keep their direction."""
    largest = max(abs(component) for component in vector)
    if largest == 0.0:
        raise SceneError(f"{at} = {shown(list(vector))} is the zero vector; give it a direction")
    return tuple(component / largest for component in vector)


def _check(model: Model) -> None:
    """Are all places and creases there, can the steps be programmed? Errors tell where in the scene it is."""
    mesh = model.mesh
    for name in model.creases:
        with within(f"creases.{name}"):
            mesh.crease_edges(name)
    for i, support in enumerate(model.supports):
        if isinstance(support, Support):
            with within(f"supports[{i}].at"):
                select(mesh, support.at)
    for i, actuations in enumerate(model.steps):
        for item in actuations:
            key = type(item).__name__.lower()
            crease = getattr(item, "crease", "all")
            if crease != "all":
                with within(f"steps[{i}].{key}.crease"):
                    mesh.crease_edges(crease)
            if isinstance(item, Force | Displace):
                with within(f"steps[{i}].{key}.at"):
                    select(mesh, item.at)
    try:
        steps = program(model)
    except InputError:
        for i in range(len(model.steps)):  # the first step that the sheet cannot take
            with within(f"steps[{i}]"):
                program(replace(model, steps=model.steps[: i + 1]))
        raise
    for i, step in enumerate(steps):
        if step.constraints.rigid_body and step.force.end.any():  # forces on a free sheet have to balance
            with within(f"steps[{i}]"):
                formulation(model.formulation).system(model, step, None)
