"""Scene files: TOML to a `Model`, with errors that name the key, its value and what is allowed.

Every error is a `SceneError` of one line. Keys are told as dotted paths; entries of [[steps]] and
[[supports]] count from 0, so that `steps[0]` is the first step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bh.errors import InputError, SceneError
from bh.formulations.registry import formulation, names
from bh.loading.builder import load_steps
from bh.loading.symmetry import Plane, check, mirror
from bh.model.actuations import Displace, Force, Tether
from bh.model.crease_law import CreaseLaw
from bh.model.loads import Couple
from bh.model.model import Model, Place
from bh.model.plugins import consent, made
from bh.model.refinement import Goal
from bh.model.serialise import ACTUATIONS as MAKERS
from bh.model.step import Actuation, Step
from bh.model.supports import Constraint, Hold, RigidBody, Support, directions, select
from bh.model.until import Until
from bh.scene.bodies import BODIES, body
from bh.scene.changes import set_keys
from bh.scene.contact import check_friction, contact_of, friction_of
from bh.scene.crease_tables import crease_law
from bh.scene.loads import check_springs, not_flat, springs_of
from bh.scene.meshing import Drawn, mesh_of
from bh.scene.moving import moved
from bh.scene.reading import (
    arguments,
    as_table,
    as_tables,
    check_keys,
    nearest,
    one_line,
    one_or_more,
    places,
    read_table,
    shown,
    within,
    without,
)
from bh.scene.sheets import sheet_of, zones_of
from bh.scene.tables import (
    ACTUATIONS,
    CreaseTable,
    ModelTable,
    OutputsTable,
    SupportTable,
    UntilTable,
)
from bh.scene.toml_text import read_toml, toml_bytes, waits
from bh.scene.wanted_accuracy import wanted_accuracy
from bh.scene.wide_creases import strips_of, wide_tables
from bh.solvers.settling import Settling
from bh.solvers.walk import Strategy
from meshes.io.files import refuse_others
from meshes.limits import check_limit

SECTIONS = (
    "pattern",
    "sheet",
    "mesh",
    "model",
    "supports",
    "springs",
    "imperfection",
    "creases",
    "steps",
    "outputs",
    "accuracy",
    "symmetry",
    "contact",
    "friction",
    "zones",
)
ACTING = {**ACTUATIONS, **BODIES}
CHANGES = ("support", "hold", "release")  # keys of a step beside its actuations


@dataclass(frozen=True)
class Outputs:
    """What `bh run` writes beside the result.

    Attributes:
        pictures: of the folded sheet.
        vtu: the path, a file a state and a list of them (PVD).
        fold: the path as a FOLD file.
        folded: formats of the folded sheet, such as "glb".
        flat: formats of the flat pattern, such as "svg".
    """

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
        symmetry: the plane of symmetry of a scene, or None: `bh.trace(..., symmetry=scene.symmetry)`.
        strategy: of the increments, or None for the default: `bh.trace(..., strategy=scene.strategy)`.
        neighbours: whether to look beside the ends of steps: `bh.trace(..., neighbours=scene.neighbours)`.
        name: the file's name without its suffix.
        source: the file, or None for a scene that was parsed from text.
        drawn: what the mesh was made from, or None for a scene that was put together in Python.
    """

    model: Model
    outputs: Outputs
    name: str = "scene"
    source: Path | None = None
    accuracy: Goal | None = None
    symmetry: Plane | None = None
    strategy: Strategy | None = None
    neighbours: bool | None = None
    drawn: Drawn | None = None


def load_scene(path: str | Path, changes: Sequence[str] = ()) -> Scene:
    """Read a scene file.

    Args:
        path: of the file (TOML); patterns that it names are looked for in its folder.
        changes: keys that are set before it is read, such as "mesh.rows=4" (`bh.scene.changes`).

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
    if waits(path):
        raise SceneError(one_line(f"'{path}' is a pipe, which may never end; give a file"))
    try:
        content = toml_bytes(path)
        refuse_others(content, "a scene or a drawing")
        text = content.decode("utf-8-sig")
        scene = _scene(text, path.parent, changes)
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

    Args:
        text: TOML.
        folder: where files that it names are looked for.
        name: of the scene, for messages and results.

    Raises:
        SceneError: the text is not TOML, or what it asks for cannot be; one line that begins with `name`.
    """
    try:
        return replace(_scene(text, Path(folder)), name=name)
    except InputError as error:
        raise SceneError(one_line(f"{name}: {error}")) from error


def scene_from_tables(tables: dict[str, object], folder: str | Path = ".", name: str = "scene") -> Scene:
    """A scene from its tables as `tomllib` reads them: what a sweep changes between points.

    Args:
        tables: keys and values of TOML.
        folder: where files that they name are looked for.
        name: of the scene, for messages and results.

    Raises:
        SceneError: as `parse_scene`.
    """
    try:
        return replace(_from_tables(tables, Path(folder)), name=name)
    except InputError as error:
        raise SceneError(one_line(f"{name}: {error}")) from error


def _scene(text: str, folder: Path, changes: Sequence[str] = ()) -> Scene:
    tables = read_toml(text)
    set_keys(tables, changes)
    return _from_tables(tables, folder)


def _from_tables(data: dict[str, object], folder: Path) -> Scene:
    check_keys("", data, SECTIONS)
    for key in ("pattern", "sheet", "steps"):
        if key not in data:
            raise SceneError(f"{key} is missing; add a table {'[[steps]]' if key == 'steps' else f'[{key}]'}")
    sheet = sheet_of(data["sheet"])
    zones = zones_of(as_tables(data.get("zones", []), "zones"), sheet)
    how = read_table(ModelTable, data.get("model", {}), "model")
    name = _formulation(how.formulation)
    steps = as_tables(data["steps"], "steps")
    check_limit("steps", len(steps), "this scene", SceneError)
    outputs = read_table(OutputsTable, data.get("outputs", {}), "outputs")
    supports = as_tables(data.get("supports", []), "supports")
    creases = as_table(data.get("creases", {}), "creases")
    asked = [_steps(item, f"steps[{i}]", folder) for i, item in enumerate(steps)]
    numbers = [i for i, legs in enumerate(asked) for _ in legs]
    wide = wide_tables(creases)
    drawn = mesh_of(data["pattern"], data.get("mesh"), folder, "accuracy" in data, sheet.t, creases)
    model = Model(
        mesh=not_flat(data, drawn.mesh),
        sheet=sheet,
        zones=(*zones, *strips_of(drawn.mesh, wide, sheet, zones)),
        supports=tuple(_support(item, f"supports[{i}]") for i, item in enumerate(supports)),
        steps=tuple(step for legs in asked for step in legs),
        creases={
            name: _crease(item, f"creases.{name}") for name, item in creases.items() if name not in wide
        },
        formulation=name,
        hinge_lock=how.hinge_lock,
        contact=contact_of(data.get("contact", "auto")),
        friction=friction_of(data.get("friction", 0.0)),
        springs=springs_of(data.get("springs", [])),
    )
    check_springs(model)
    check_friction(model)
    _check_names(model, numbers)
    _check_steps(model, numbers)
    return Scene(
        model,
        Outputs(**arguments(outputs)),
        accuracy=wanted_accuracy(data, model),
        symmetry=_symmetry(model, data["symmetry"]) if "symmetry" in data else None,
        strategy=Settling() if how.strategy == "settling" else None,
        neighbours=how.neighbours,
        drawn=drawn,
    )


def _symmetry(model: Model, data: object) -> Plane:
    """A letter, or a normal."""
    if not isinstance(data, str | list):
        raise SceneError(f'symmetry = {shown(data)} cannot be; give "x", "y" or a normal [x, y, 0]')
    with within("symmetry"):
        check(model, load_steps(model), mirror(model.mesh, data))
    return data if isinstance(data, str) else tuple(data)


# --- from tables to descriptions ----------------------------------------------------------------------------


def _formulation(name: str) -> str:
    known = names()
    if name not in known and ":" not in name:
        listed = ", ".join(known) or "none; install the project with pip first"
        raise SceneError(
            f"model.formulation = {shown(name)} is not known{nearest(name, known)}; use one of {listed}"
        )
    if ":" in name:
        with within("model.formulation"):
            consent(name)
    return name


def _support(item: object, at: str) -> Constraint:
    if isinstance(item, dict) and ":" in str(item.get("kind")):
        with within(at):
            own: Constraint = made(item["kind"], without(item, "kind"), Constraint)
            return own
    table = read_table(SupportTable, item, at)
    if table.at == "rigid-body":
        return RigidBody()
    place = table.at if isinstance(table.at, str) else tuple(table.at)
    if table.fix is None:
        return Support(place, clamp=table.clamp)
    fix = table.fix if isinstance(table.fix, str) else _vectors(table.fix, f"{at}.fix")
    with within(f"{at}.fix"):
        directions(fix)
    return Support(place, fix, table.clamp)


def _vectors(fix: list[float] | list[list[float]], at: str) -> tuple[tuple[float, ...], ...]:
    """A direction, or a list of directions, as a tuple of them."""
    vectors = [each for each in fix if isinstance(each, list)]
    numbers = [each for each in fix if not isinstance(each, list)]
    return tuple(_direction(vector, at) for vector in vectors or [numbers])


def _crease(item: object, at: str) -> CreaseLaw:
    table = read_table(CreaseTable, item, at)
    with within(at):
        law = None if table.law is None else crease_law(table.law, f"{at}.law")
        return CreaseLaw(table.Lstar, table.stiffness, table.rest, law)


def _steps(item: object, at: str, folder: Path) -> tuple[Step, ...]:
    """The step of a table, or those of its move."""
    step = as_table(item, at)
    check_keys(at, {key: step[key] for key in step if ":" not in key}, (*ACTING, "move", "until", *CHANGES))
    if not set(step) - {"until"}:
        raise SceneError(f"{at} is empty; add one of {', '.join((*ACTING, 'move', *CHANGES))}")
    if "move" in step:
        return moved(step, at, *_changes(step, at))
    return (_step(step, at, folder),)


def _step(step: dict[str, object], at: str, folder: Path) -> Step:
    found: list[Actuation] = []
    until = None
    support, release = _changes(step, at)
    for key, value in step.items():
        if key in CHANGES:
            continue
        if key == "until":
            until = _until(value, f"{at}.until")
            continue
        for where, each in one_or_more(value, f"{at}.{key}"):
            found.append(body(key, each, where, folder) if key in BODIES else _actuation(key, each, where))
    with within(at):
        return Step(tuple(found), until, support, release)


def _changes(step: dict[str, object], at: str) -> tuple[tuple[Constraint, ...], tuple[Place, ...]]:
    """Supports that come in with a step, and places that it releases."""
    support: list[Constraint] = []
    if "support" in step:
        support += [_support(each, where) for where, each in one_or_more(step["support"], f"{at}.support")]
    if "hold" in step:
        support += [Hold(place) for place in places(step["hold"], f"{at}.hold")]
    return tuple(support), places(step["release"], f"{at}.release") if "release" in step else ()


def _until(item: object, at: str) -> Until:
    table = read_table(UntilTable, item, at)
    with within(at):
        if table.depth is not None:
            return Until("depth", table.depth, tolerance=table.tolerance)
        assert table.observable is not None
        assert table.value is not None
        if ":" in table.observable:
            consent(table.observable)
        return Until(table.observable, table.value, table.of, table.tolerance)


def _actuation(key: str, item: object, at: str) -> Actuation:
    if ":" in key:
        with within(at):
            own: Actuation = made(key, as_table(item, at), Actuation)
            return own
    table = read_table(ACTING[key], item, at)
    given = arguments(table)
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


def _check_place(model: Model, support: Constraint, at: str) -> None:
    if isinstance(support, Support | Hold):
        with within(at):
            select(model.mesh, support.at)


def _check_names(model: Model, numbers: Sequence[int]) -> None:
    """Are all places and creases there? Errors tell where in the scene it is, by the `numbers` of its steps."""
    mesh = model.mesh
    for name in model.creases:
        with within(f"creases.{name}"):
            mesh.crease_edges(name)
    for i, support in enumerate(model.supports):
        _check_place(model, support, f"supports[{i}].at")
    for i, asked in zip(numbers, model.steps, strict=True):
        for support in asked.support:
            _check_place(
                model, support, f"steps[{i}].{'hold' if isinstance(support, Hold) else 'support.at'}"
            )
        for item in asked.actuations:
            key = type(item).__name__.lower()
            crease = getattr(item, "crease", "all")
            if crease != "all" and not (key == "fold" and crease in mesh.wide_creases):
                with within(f"steps[{i}].{key}.crease"):
                    mesh.crease_edges(crease)
            if isinstance(item, Force | Displace | Tether | Couple):
                with within(f"steps[{i}].{key}.at"):
                    select(mesh, item.at)


def _check_steps(model: Model, numbers: Sequence[int]) -> None:
    """Can the steps be programmed? Errors tell which of the scene cannot, by the `numbers` of its steps."""
    try:
        steps = load_steps(model)
    except InputError:
        for i in range(len(model.steps)):  # the first step that the sheet cannot take
            with within(f"steps[{numbers[i]}]"):
                load_steps(replace(model, steps=model.steps[: i + 1]))
        raise
    for i, step in enumerate(steps):
        if any(each.looks_back for each in model.steps[1 : i + 1]):
            break  # what is held in these is known when it has been solved
        if step.constraints.rigid_body and step.force.end.any():  # forces on a free sheet have to balance
            with within(f"steps[{numbers[i]}]"):
                formulation(model.formulation).system(model, step, None)
