"""A folder that holds a run already: whether a new one may be written there."""

from __future__ import annotations

import contextlib
from pathlib import Path

from bh.errors import InputError
from bh.model.compare import differing_keys, in_words
from bh.model.serialise import fingerprint
from bh.paths.storage import PathFile, reading
from bh.scene.load import Scene
from bh.solvers.outcome import Outcome
from bh.solving.contact import stored_model
from bh.solving.levels import folder_of

FINISHED, UNFINISHED = ("path.bh", "result.json"), ("path-unfinished.bh", "result-unfinished.json")


def changed(file: Path, scene: Scene) -> bool:
    """True if a path file is of another model than the scene's own.

    Args:
        file: the path file.
        scene: to be solved; where it chooses its mesh, no file is of its model.
    """
    if scene.accuracy is not None:
        return False
    with contextlib.closing(PathFile.open(file)) as stored, reading(file):
        return bool(stored.meta()["provenance"]["input"] != fingerprint(stored_model(file, scene.model)))


def check_folder(folder: Path, scene: Scene) -> None:
    """See that a new run does not take the place of a run that was stopped, or of one of another scene.

    Args:
        folder: for the files, which need not exist.
        scene: to be solved.

    Raises:
        InputError: it would; one line that names what differs, and what to add to the command.
    """
    for name in (UNFINISHED[0], FINISHED[0]):
        file = folder / name
        meshes = sorted(folder_of(file).glob("*.bh"))
        found = file if file.is_file() else meshes[-1] if meshes else None
        if found is None:
            continue
        try:
            with contextlib.closing(PathFile.open(found)) as stored, reading(found):
                data, arrays = stored.meta(), stored.arrays()
                ends, states = stored.steps(), any(True for _ in stored.states())
        except InputError:
            continue  # no path file: there is nothing to lose
        keys = differing_keys(data["model"], arrays, scene.model, chosen=scene.accuracy is not None)
        other = "or choose another folder with -o"
        if keys:
            raise InputError(
                f"'{folder}' holds a run of another scene (it differs in {in_words(keys)}); add --force to replace "
                f"it, --resume to go on from it where only later steps changed, {other}"
            )
        stopped = not file.is_file() or (
            len(ends) < len(data["model"]["steps"])
            and all(end[0] == Outcome.REACHED for end in ends.values())
        )
        if stopped and states:
            raise InputError(
                f"'{folder}' holds a run of this scene that was stopped; add --resume to go on from it, --force to "
                f"begin anew, {other}"
            )


def path_file(folder: Path) -> Path:
    """The path file in the output folder of a run.

    Raises:
        InputError: there is none.
    """
    for name, _ in (FINISHED, UNFINISHED):
        if (folder / name).is_file():
            return folder / name
    raise InputError(f"there is no {FINISHED[0]} in '{folder}'; give the output folder of `bh run`")
