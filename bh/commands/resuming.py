"""From where a resumed run goes on, in words."""

from __future__ import annotations

import contextlib
from pathlib import Path

from bh.commands.occupied import FINISHED, UNFINISHED, changed
from bh.errors import InputError
from bh.paths.storage import PathFile, reading
from bh.runtime.terminal import say
from bh.scene.load import Scene
from bh.solvers.outcome import Outcome
from bh.solving.contact import stored_model
from bh.solving.follow import check_resumable
from bh.solving.levels import folder_of


def say_from(folder: Path, scene: Scene) -> None:
    """Print the state that a resumed run goes on from; nothing where nothing can be gone on from, as the run will say.

    Args:
        folder: of the run.
        scene: to be solved.
    """
    if clause := goes_on_from(folder, scene):
        say(f"{scene.name}: {clause}")


def goes_on_from(folder: Path, scene: Scene) -> str:
    """The state that a resumed run goes on from, as a clause.

    Args:
        folder: of the run.
        scene: to be solved.

    Returns:
        "goes on from step 2, lambda 0.4 (12 states are kept)"; empty where nothing is left to solve, or nothing can be
        gone on from.
    """
    for name, _ in (UNFINISHED, FINISHED):
        meshes = len(list(folder_of(folder / name).glob("*.bh")))
        if meshes and scene.accuracy is not None:
            return f"goes on with the states of {meshes} mesh{'es' if meshes > 1 else ''} that are kept"
    with contextlib.suppress(InputError):
        return _state(folder, scene) if scene.accuracy is None else ""
    return ""


def _state(folder: Path, scene: Scene) -> str:
    files = [folder / name for name, _ in (UNFINISHED, FINISHED) if (folder / name).is_file()]
    same = [file for file in files if not changed(file, scene)]
    if not files:
        return ""
    file = (same or files)[0]
    kept = None if same else check_resumable(file, stored_model(file, scene.model))
    with contextlib.closing(PathFile.open(file)) as stored, reading(file):
        outcomes = [outcome for outcome, *_ in stored.steps().values()]
        rows = [(row.step, row.lam) for row in stored.states() if kept is None or row.step < kept]
    whole = kept is None and outcomes == [Outcome.REACHED] * len(scene.model.steps)
    if whole or not rows:
        return ""
    step, lam = rows[-1]
    states = f"{len(rows)} state{'s are' if len(rows) > 1 else ' is'} kept"
    anew = "" if kept is None else f"; step {kept + 1} is not what it was"
    return f"goes on from step {step + 1}, lambda {lam:.4g} ({states}{anew})"
