"""One drawing folded as `bh fold` does it, in a process of its own that has 60 s of processor time."""

from __future__ import annotations

import math
import os
import time
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bh.commands.fold import Folded, fold_file
from bh.errors import InputError
from bh.runtime.workers import Workers
from bh.scene.folding import Wish

LIMIT = 60.0  # s of processor time for all of it, the start of Python included
ASIDE = 12.0  # s of it for the start, for reading, and for picture and files
WALL = 600.0  # s, after which a process that does nothing is ended


@dataclass(frozen=True)
class Row:
    """What has come of a drawing.

    Attributes:
        file: its name, within its folder.
        read: whether it was understood.
        size: of the flat sheet, mm; None where it was not read.
        creases: mountains and valleys.
        way: the part of the wanted angles that was reached, 0 to 1.
        angle: mean of the fold angles then, degrees; None where it was not folded at all.
        mesh: in words.
        formulation: by which it was solved.
        unknowns: size of its system.
        iterations: Newton iterations of the scene that is kept.
        seconds: processor time.
        remarks: how many lines it was given, assumptions among them.
        why: one line why it is not folded all the way; "" where it is.
    """

    file: str
    read: bool = False
    size: tuple[float, float] | None = None
    creases: int = 0
    way: float = 0.0
    angle: float | None = None
    mesh: str = ""
    formulation: str = ""
    unknowns: int | None = None
    iterations: int | None = None
    seconds: float = math.nan
    remarks: int = 0
    why: str = ""


def fold_apart(file: Path, name: str, folder: Path, limit: float = LIMIT) -> Row:
    """Fold a drawing in another process; what goes wrong there, an end by force included, is a row too.

    Args:
        file: the drawing.
        name: to show.
        folder: for what is written.
        limit: processor time, s.
    """
    try:
        with Workers(1) as pool:
            return pool.submit(fold_here, file, name, folder, limit).result(timeout=WALL)
    except BrokenProcessPool:
        return Row(name, seconds=limit, why=f"ended at {limit:g} s of processor time")
    except TimeoutError:
        return Row(name, why=f"ended: it took {WALL:g} s, more than {limit:g} s of them waiting")


def fold_here(file: Path, name: str, folder: Path, limit: float = LIMIT) -> Row:
    """Fold a drawing in this process, which ends where its processor time is over.

    Args:
        file: the drawing.
        name: to show.
        folder: for what is written.
        limit: processor time, s.
    """
    _end_after(limit)
    try:
        done = fold_file(file, folder, Wish(), seconds=max(limit - ASIDE, 1.0), force=True)
    except InputError as error:
        return Row(
            name, seconds=time.process_time(), why=" ".join(str(error).replace(str(file), name).split())
        )
    except Exception as fault:
        return Row(
            name, seconds=time.process_time(), why=f"fault of the program: {type(fault).__name__}: {fault}"
        )
    return _row(name, done)


def _row(name: str, done: Folded) -> Row:
    path, mesh = done.path, done.path.model.mesh
    flat = (
        mesh.points if mesh.pattern is None else mesh.pattern.rings[0]
    )  # chords of a coarse mesh cut curves short
    height, width = np.sort(np.ptp(flat, axis=0))[-2:].tolist()
    chains = [
        crease
        for crease in mesh.creases
        if mesh.folds.get(crease) in ("mountain", "valley") and crease not in ("mountain", "valley")
    ]
    angles = [float(np.abs(path[-1].fold_angle(crease)).mean()) for crease in chains]
    return Row(
        file=name,
        read=True,
        size=(width, height),
        creases=len(chains),
        way=1.0 if path.reached else float(path[-1].lam),
        angle=math.degrees(sum(angles) / len(angles)) if angles else None,
        mesh=done.proposal.mesh,
        formulation=path.model.formulation,
        unknowns=path.unknowns,
        iterations=path.iterations,
        seconds=time.process_time(),
        remarks=len(done.proposal.assumed) + len(path.remarks),
        why="" if path.reached else done.notes[-1],
    )


def _end_after(seconds: float) -> None:
    """Have the system end this process after so much processor time; Windows cannot."""
    if os.name != "posix":
        return
    import resource

    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), hard))
