"""The solved meshes of a run to an accuracy on disk, one path file each, so that a killed run goes on from them."""

from __future__ import annotations

import contextlib
import re
import shutil
from pathlib import Path as FilePath

from bh.errors import PathFileError
from meshes.cells import Cells


def folder_of(file: str | FilePath) -> FilePath:
    """Where the meshes of a run into a path file lie: `path-levels` beside `path.bh`."""
    file = FilePath(file)
    return file.with_name(f"{file.stem}-levels")


class Levels:
    """The folder of the meshes of a run.

    Nothing but the solved paths is kept: which mesh comes next follows from their values, so a run that goes on takes
    the same way again, and finds what it has solved.
    """

    def __init__(self, file: str | FilePath, resume: bool) -> None:
        """The folder beside a path file; it is emptied unless the run goes on.

        Raises:
            PathFileError: the folder cannot be written, or there is nothing to go on from.
        """
        self.folder = folder_of(file)
        if resume and not self.folder.is_dir():
            raise PathFileError(
                f"there are no solved meshes in '{self.folder}' to go on from; run without resume"
            )
        try:
            if not resume:
                remove(self.folder)
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise PathFileError(
                f"cannot write '{self.folder}' ({error.strerror}); choose a folder that can be written"
            ) from error

    def file(self, formulation: str, cells: Cells) -> FilePath:
        """The path file of a mesh: `consistent-64-x-4-staggered-cells.bh`.

        Args:
            formulation: its name.
            cells: of the mesh.
        """
        words = re.sub(r"[^A-Za-z0-9.]+", "-", f"{formulation} {cells}").strip("-")
        return self.folder / f"{words}.bh"


def remove(folder: FilePath) -> None:
    """Remove the solved meshes of a run, and the folder if nothing else is in it.

    Raises:
        OSError: a file cannot be removed.
    """
    if folder.is_dir():
        for file in [*folder.glob("*.bh"), *folder.glob("*.bh-journal"), *folder.glob("*.bh.part")]:
            file.unlink(missing_ok=True)
        with contextlib.suppress(OSError):
            folder.rmdir()


def move(old: FilePath, new: FilePath) -> None:
    """Put the meshes of a run in the place of those of an earlier one.

    Args:
        old: folder of this run.
        new: folder of the earlier run, which it replaces.
    """
    if old.is_dir():
        remove(new)
        with contextlib.suppress(OSError):
            shutil.move(old, new)
