"""A scene in the window: its sheet without its steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from bh.errors import InputError
from bh.scene.load import parse_scene
from bh.scene.toml_text import key_of, read_toml, toml_bytes, written
from bh.studio.sheets import LONGEST, MOST_TRIANGLES, LiveSheet, live

SCENE = ".toml"
# tables that say what the sheet is; the window writes sheet and supports itself
KEPT = ("pattern", "mesh", "model")
OTHERS = ("sheet", "supports", "creases", "steps", "outputs", "contact", "symmetry", "accuracy")


def of_scene(file: Path) -> LiveSheet:
    """The sheet of a scene: pattern, mesh, material, supports and creases; its steps are left out.

    Args:
        file: a scene, with the drawing that it names beside it.

    Raises:
        InputError: it cannot be read, is no scene, or has what the window cannot keep.
    """
    name = file.name
    try:
        text = toml_bytes(file).decode()
    except (OSError, ValueError) as error:
        raise InputError(f"'{file}' cannot be read ({getattr(error, 'strerror', None) or error})") from error
    data = read_toml(text)
    pattern = data.get("pattern")
    drawing = pattern.get("file") if isinstance(pattern, dict) else None
    if drawing is not None and Path(str(drawing)).name != str(drawing):
        raise InputError(f"'{name}' names '{drawing}'; put the drawing beside the scene")
    other = next((key for key in data if key not in (*KEPT, *OTHERS)), None)
    if other is not None:
        raise InputError(
            f"'{name}' has '{other}', which the window does not keep; take it out, or `bh run {name}`"
        )
    if "mesh" not in data:
        raise InputError(
            f"'{name}' has no mesh, which `bh run` chooses for its accuracy; give it a table [mesh]"
        )
    scene = parse_scene(text, file.parent, file.stem)
    mesh = scene.model.mesh
    if len(mesh.triangles) > MOST_TRIANGLES:
        raise InputError(
            f"'{name}' has {len(mesh.triangles)} triangles, the window takes {MOST_TRIANGLES}; give a coarser [mesh]"
        )
    tables = [_table(key, data[key]) for key in KEPT if key in data]
    creases = data.get("creases")
    for crease, table in creases.items() if isinstance(creases, Mapping) else ():
        if isinstance(table, Mapping) and "width" in table:
            tables.append(_table(f"creases.{key_of(crease)}", table))
    said = ("the steps of the scene are left out: the window folds it",)
    sheet = live(file.stem, scene, "\n".join(tables), said)
    if drawing is None:
        return sheet
    with (file.parent / str(drawing)).open("rb") as stream:
        drawn = stream.read(LONGEST + 1)
    if len(drawn) > LONGEST:
        raise InputError(f"'{drawing}' is longer than {LONGEST // 10**6} MB")
    return replace(sheet, drawing=(str(drawing), drawn))


def _table(name: str, value: object) -> str:
    """A table as TOML writes it."""
    if not isinstance(value, Mapping):
        raise InputError(f"'{name}' has to be a table")
    return "\n".join([f"[{name}]", *(f"{key_of(key)} = {written(each)}" for key, each in value.items()), ""])
