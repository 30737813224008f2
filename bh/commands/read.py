"""What a run has left in its folder, read back: `bh.read("out")`."""

from __future__ import annotations

import contextlib
import os
from dataclasses import dataclass, field, replace
from pathlib import Path as FilePath

from bh.commands.occupied import FINISHED, UNFINISHED, path_file
from bh.errors import InputError, PathFileError
from bh.paths.path import Path
from bh.paths.storage import PathFile, reading
from bh.paths.stored import mapping, parsed_file
from bh.scene.load import Scene, parse_scene


@dataclass(frozen=True, eq=False, repr=False)
class Run:
    """A solved scene.

    Attributes:
        folder: that `bh run` has written.
        path: every state; `path.outcome`, `path[-1]`, `path.model`.
        result: the content of result.json, energies in N mm, angles in rad; empty where a run was killed.
        scene: as it was when it was run, with the model of the path; None where it cannot be read any more.
        scene_reason: why it cannot, one line; empty where there is one.
    """

    folder: FilePath
    path: Path
    result: dict[str, object] = field(default_factory=dict)
    scene: Scene | None = None
    scene_reason: str = ""

    def __repr__(self) -> str:
        """One line: "Run(out, Path(reached, 6 states, 16 iterations, 1 of 1 step))"."""
        return f"Run({self.folder}, {self.path})"


def read(folder: str | os.PathLike[str]) -> Run:
    """Path, result and scene of a run.

    Args:
        folder: that `bh run` or `bh fold` has written, or a path file.

    Raises:
        PathFileError: there is no path in it; one line.
    """
    place = FilePath(folder)
    if place.is_dir():
        try:
            file = path_file(place)
        except InputError as error:
            raise PathFileError(str(error)) from error
    else:
        file = place
    path = Path.load(file)
    scene, why = _scene(file, path)
    return Run(place if place.is_dir() else place.parent, path, _result(file), scene, why)


def _result(file: FilePath) -> dict[str, object]:
    names = dict([FINISHED, UNFINISHED])
    try:
        found = parsed_file(file.parent / names[file.name])
    except (KeyError, OSError):  # a path file of another name, or a run that was killed
        return {}
    except ValueError as error:
        raise PathFileError(f"'{file.parent / names[file.name]}' is no result of bh ({error})") from error
    return found if isinstance(found, dict) else {}


def _scene(file: FilePath, path: Path) -> tuple[Scene | None, str]:
    with contextlib.closing(PathFile.open(file)) as stored, reading(file):
        kept = stored.meta().get("scene")
        kept = None if kept is None else mapping(kept, "its scene")
    if kept is None or not {"file", "text"} <= set(kept):
        return None, "the path was not solved from a scene file"
    source, text = FilePath(str(kept["file"])), str(kept["text"])
    # the folder of a stranger's scene is not here, whatever the file says: drawings are looked for beside the path then
    folder = source.parent if _is_there(source, text) else file.parent
    try:
        scene = parse_scene(text, folder, source.stem)
    except (InputError, ValueError) as error:  # a drawing that has gone
        return None, str(error)
    return replace(scene, model=path.model, source=source), ""


def _is_there(source: FilePath, text: str) -> bool:
    """Whether the scene that a path was solved from still lies where it lay."""
    try:
        return source.is_file() and source.stat().st_size < 2**24 and source.read_text("utf-8-sig") == text
    except (OSError, ValueError):
        return False
