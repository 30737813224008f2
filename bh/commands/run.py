"""A scene solved into a folder: `path.bh` with every accepted state, `result.json`, and what else is asked for.

A folder that holds a finished result keeps it until another run has reached its end, too: until then that run
writes `path-unfinished.bh`, and `result-unfinished.json` if it ends early.
"""

from __future__ import annotations

import contextlib
import json
import shutil
import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from bh.analysis.contact import Contact, first_contact
from bh.analysis.yielding import Yielding, yielding
from bh.commands.compile_ahead import compiled_ahead
from bh.commands.occupied import FINISHED, UNFINISHED, changed, check_folder
from bh.commands.result import result
from bh.errors import InputError, ModelError
from bh.model.serialise import fingerprint
from bh.paths.export import FOLDED, folded_frame, write_flat, write_state
from bh.paths.path import Path as Trace
from bh.paths.storage import PathFile, reading
from bh.paths.stored import parsed_file
from bh.runtime.lock import only_writer
from bh.runtime.progress import ProgressMeter
from bh.scene.flat import write_flat_pattern
from bh.scene.load import Scene
from bh.solvers.outcome import Outcome
from bh.solvers.walk import Strategy
from bh.solving.contact import stored_model
from bh.solving.follow import check_resumable
from bh.solving.levels import folder_of, move
from bh.solving.levels import remove as remove_levels
from bh.solving.trace import trace
from meshes.io.export import replacing


class Solved(NamedTuple):
    """What a run has come to.

    Attributes:
        path: solved, as far as it goes.
        names: of its two files in the folder.
        before: whether it had been finished before.
        contact: its first self-contact, if any.
        yields: how near to yield it comes, or why that cannot be told; None for a sheet whose strength is not given.
    """

    path: Trace
    names: tuple[str, str]
    before: bool
    contact: Contact | None
    yields: Yielding | str | None


def solve(
    scene: Scene,
    folder: Path,
    *,
    resume: bool = False,
    force: bool = False,
    progress: bool | ProgressMeter = False,
    estimate: bool = True,
    strategy: Strategy | None = None,
    neighbours: bool | None = None,
) -> Solved:
    """Trace a scene into a folder, which is made if need be.

    Pictures, series and FOLD files that `bh run` has written there of other states are removed.

    Args:
        scene: to be solved.
        folder: for the files.
        resume: go on from the states in the folder.
        force: begin anew where the folder holds a run that was stopped, or one of another scene.
        progress: as for `bh.trace`.
        estimate: solve a coarser mesh, too, where the mesh was given, for an estimate of the error.
        strategy: of the increments; None for the scene's.
        neighbours: as for `bh.trace`; None for what the scene says.

    Raises:
        InputError: the folder cannot be written, there is nothing to resume, or the model cannot be solved as
            described; a folder that was made for the run is taken away again if nothing came of it.
    """
    if not (resume or force):
        check_folder(folder, scene)
    names = _names(folder, scene, resume)
    made = make_folder(folder)
    ours = False
    try:
        with only_writer(folder):
            ours = True
            return _solved(
                scene,
                folder,
                names,
                resume=resume,
                progress=progress,
                estimate=estimate,
                strategy=strategy,
                neighbours=neighbours,
            )
    except (InputError, KeyboardInterrupt):
        if ours and not resume and not holds_states(folder):
            remove_levels(folder_of(folder / names[0]))
            take_back(folder / names[0], made)
        raise


def _solved(
    scene: Scene,
    folder: Path,
    names: tuple[str, str],
    *,
    resume: bool,
    progress: bool | ProgressMeter,
    estimate: bool,
    strategy: Strategy | None,
    neighbours: bool | None,
) -> Solved:
    """What `solve` gives, of a folder that nobody else writes."""
    file = folder / names[0]
    goes_on = resume and names == FINISHED and _is_finished(folder) and changed(file, scene)
    if goes_on:  # the finished one stays until this one is finished, too
        check_resumable(file, stored_model(file, scene.model))
        names, file = UNFINISHED, folder / UNFINISHED[0]
        shutil.copyfile(folder / FINISHED[0], file)
    before = resume and not goes_on and _is_whole(file, scene)
    solved = _solved_meshes(file)
    if not resume:  # of an earlier run that ended early; while this one runs it would tell about no path
        (folder / names[1]).unlink(missing_ok=True)
    with compiled_ahead():
        path = trace(
            scene.model,
            progress=progress,
            file=file,
            resume=resume,
            accuracy=scene.accuracy,
            symmetry=scene.symmetry,
            strategy=strategy or scene.strategy,
            estimate=estimate and scene.accuracy is None,
            neighbours=scene.neighbours if neighbours is None else neighbours,
            warn=False,  # the command says it in a line of its own
        )
    _keep_scene(scene, file)
    clear = not resume or names == UNFINISHED  # what another run has begun beside a finished one stays
    if path.reached:
        if names == UNFINISHED:
            _move(file, folder / FINISHED[0])
            move(folder_of(file), folder_of(folder / FINISHED[0]))
        names = FINISHED
    before = before and solved == _solved_meshes(folder / names[0])
    contact, yields = first_contact(path), _yields(path)
    text = json.dumps(result(path, scene, contact, yields), indent=2, allow_nan=False) + "\n"
    with replacing(folder / names[1]) as draft:
        draft.write_text(text, encoding="utf-8")
    if not before:
        remove_extras(folder, "-unfinished" if names == UNFINISHED else "")
    if names == FINISHED and clear:
        for name in UNFINISHED:
            (folder / name).unlink(missing_ok=True)
        remove_levels(folder_of(folder / UNFINISHED[0]))
        remove_extras(folder, "-unfinished")
    return Solved(path, names, before, contact, yields)


def _yields(path: Trace) -> Yielding | str | None:
    sheet = path.model.sheet
    if all(part.strength is None for part in (sheet, *(sheet.plies or ()))):
        return None
    try:
        return yielding(path)
    except ModelError as error:
        return str(error)


def _keep_scene(scene: Scene, file: Path) -> None:
    """Put the text of the scene into its path file, for `bh.read`."""
    if scene.source is None:
        return
    with contextlib.suppress(OSError, UnicodeDecodeError), contextlib.closing(PathFile.open(file)) as stored:
        text = scene.source.read_text(encoding="utf-8-sig")
        stored.note("scene", {"file": str(scene.source.resolve()), "text": text})


def _solved_meshes(file: Path) -> list[str]:
    """Names of the path files of the meshes of a run to an accuracy."""
    return sorted(found.name for found in folder_of(file).glob("*.bh"))


def _is_whole(file: Path, scene: Scene) -> bool:
    """True if all steps of a scene are reached in a path file."""
    if scene.accuracy is not None and not file.is_file():
        return False
    model = scene.model
    with contextlib.closing(PathFile.open(file)) as stored, reading(file):
        outcomes = [outcome for outcome, *_ in stored.steps().values()]
    return outcomes == [Outcome.REACHED] * len(model.steps)


def holds_states(folder_or_file: Path) -> bool:
    """True if a path file (or one in a folder, or of its meshes) has a state to go on from."""
    files = [folder_or_file]
    if folder_or_file.is_dir():
        files = [folder_or_file / name for name, _ in (UNFINISHED, FINISHED)]
        files += [mesh for file in files for mesh in sorted(folder_of(file).glob("*.bh"))]
    for file in files:
        with (
            contextlib.suppress(InputError),
            contextlib.closing(PathFile.open(file)) as stored,
            reading(file),
        ):
            if next(stored.states(), None) is not None:
                return True
    return False


def _names(folder: Path, scene: Scene, resume: bool) -> tuple[str, str]:
    """Names of the path and the result that a run writes.

    Raises:
        InputError: there is nothing to resume.
    """
    if not resume:
        return UNFINISHED if _is_finished(folder) else FINISHED
    if scene.accuracy is not None:
        for names in (UNFINISHED, FINISHED):
            if folder_of(folder / names[0]).is_dir():
                return names
        raise InputError(f"there are no solved meshes in '{folder}' to go on from; run without --resume")
    found = [names for names in (UNFINISHED, FINISHED) if (folder / names[0]).is_file()]
    if not found:
        raise InputError(f"there is no {FINISHED[0]} in '{folder}' to go on from; run without --resume")
    wanted = fingerprint(scene.model)
    for names in found:
        place = folder / names[0]
        with contextlib.closing(PathFile.open(place)) as file, reading(place):
            if file.meta()["provenance"]["input"] == wanted:
                return names
    return found[0]  # of another scene, as `trace` will say


def _is_finished(folder: Path) -> bool:
    try:
        result = parsed_file(folder / FINISHED[1])
    except (OSError, ValueError):
        return False
    return isinstance(result, dict) and result.get("outcome") == Outcome.REACHED


def make_folder(folder: Path) -> list[Path]:
    """Make the folder and what is missing above it; returns what was made, the deepest last.

    Raises:
        InputError: it cannot be made or written to; then nothing is left behind.
    """
    made: list[Path] = []
    try:
        for place in (*reversed(folder.parents), folder):
            if not place.exists():
                place.mkdir()
                made.append(place)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (OSError, ValueError) as error:
        take_back(None, made)
        why = getattr(error, "strerror", None) or error
        raise InputError(
            f"the output folder '{folder}' cannot be written ({why}); choose another with -o"
        ) from error
    for name in (*FINISHED, *UNFINISHED):
        if (folder / name).is_dir():
            raise InputError(
                f"'{folder / name}' is a folder where a file is to be written; remove it, or choose another with -o"
            )
    return made


def take_back(file: Path | None, made: Sequence[Path]) -> None:
    """Remove a file and the folders that were made for it, as far as nothing else is in them."""
    with contextlib.suppress(OSError):
        if file is not None:
            file.unlink(missing_ok=True)
        for place in reversed(made):
            place.rmdir()


def _move(file: Path, place: Path) -> None:
    # a journal that a killed run left there belongs to the file that goes
    place.with_name(place.name + "-journal").unlink(missing_ok=True)
    file.replace(place)


def remove_extras(folder: Path, mark: str) -> None:
    """Remove what `extras` has written for another run, as far as it can be removed; nothing else.

    Args:
        folder: of the run.
        mark: "" or "-unfinished", as in the names of the files.
    """
    with contextlib.suppress(OSError):
        for name in (f"folded{mark}.png", f"path{mark}.pvd", *(f"folded{mark}{suffix}" for suffix in FOLDED)):
            (folder / name).unlink(missing_ok=True)
        for file in (folder / f"path{mark}").glob("[0-9][0-9][0-9][0-9]*.vtu"):
            file.unlink()
        if (folder / f"path{mark}").is_dir():
            (folder / f"path{mark}").rmdir()


def write_extras(
    path: Trace, scene: Scene, folder: Path, pictures: bool = False, vtu: bool = False
) -> list[Path]:
    """Write what is wished for beside the result, and return the files.

    Args:
        path: solved, as far as it goes.
        scene: whose outputs are written.
        folder: for the files.
        pictures: also draw the folded sheet.
        vtu: also write all states for ParaView.

    Returns:
        the files.

    Raises:
        InputError: one of them cannot be written; the result is.
    """
    written = []
    for name, write in extras(path, scene, folder, pictures, vtu).items():
        try:
            write()
        except (InputError, ImportError, OSError) as error:
            raise InputError(
                f"the result is in '{folder}', but {name} could not be written: {error}"
            ) from error
        written.append(folder / name)
    return written


def extras(
    path: Trace, scene: Scene, folder: Path, pictures: bool, vtu: bool
) -> dict[str, Callable[[], object]]:
    """What is written on request beside the result, by name (marked where a finished result is kept).

    Args:
        path: solved, as far as it goes.
        scene: whose outputs are written.
        folder: for the files.
        pictures: also draw the folded sheet.
        vtu: also write all states for ParaView.

    Returns:
        By the name of the file what writes it.
    """
    mark = "-unfinished" if not path.reached and _is_finished(folder) else ""

    def draw() -> None:
        from bh.plotting import picture

        picture(path[-1], folder / f"folded{mark}.png")

    def series() -> None:
        from bh.plotting import export_series

        export_series(path, folder, f"path{mark}")

    def fold() -> None:
        from meshes.io import write_fold

        frame = folded_frame(path[-1], "folded")
        write_fold(folder / f"folded{mark}.fold", path.model.mesh, frames=[frame], title=scene.name)

    wanted = {
        f"folded{mark}.png": (draw, pictures or scene.outputs.pictures),
        f"path{mark}.pvd": (series, vtu or scene.outputs.vtu),
        f"folded{mark}.fold": (fold, scene.outputs.fold),
    }
    files: dict[str, Callable[[], object]] = {name: write for name, (write, asked) in wanted.items() if asked}
    for suffix in scene.outputs.folded:
        name = f"folded{mark}.{suffix}"
        files[name] = partial(write_state, folder / name, [path[-1]], scene.name)
    for suffix in scene.outputs.flat:
        file = folder / f"flat.{suffix}"
        if suffix == "fold":
            files[file.name] = partial(write_flat, file, scene.model.mesh)
        else:
            files[file.name] = partial(write_flat_pattern, file, scene)
    return files
