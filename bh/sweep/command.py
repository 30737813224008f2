"""`bh sweep`: the only part of a sweep that prints and exits."""

from __future__ import annotations

import os
import shlex
from contextlib import closing
from pathlib import Path
from typing import Annotated

import typer

import bh.sweep
from bh.errors import InputError
from bh.runtime.terminal import say
from bh.solvers.outcome import Outcome
from bh.sweep.pools import Pool


def sweep(
    file: Annotated[Path, typer.Argument(metavar="SWEEP", help="Sweep file (TOML).")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE.nc", help="Data set; default SWEEP.nc.")
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option("--workers", "-w", min=0, help="Local processes; 0: this one. Default: one a core."),
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option("--dask", metavar="ADDRESS", help="Run on the Dask cluster of this scheduler."),
    ] = None,
    dask_workers: Annotated[
        int | None,
        typer.Option("--dask-workers", min=1, help="Start a local Dask cluster of so many processes."),
    ] = None,
    chunk: Annotated[int, typer.Option("--chunk", min=1, help="Points a worker does in one go.")] = 1,
    warm: Annotated[
        bool,
        typer.Option("--warm", help="Begin at neighbours' states along the last axis, checked."),
    ] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on from the points that are finished.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
) -> int:
    """Solve a scene for many parameters into a labelled data set."""
    from bh.sweep.file import load_sweep

    asked = load_sweep(file)
    place = Path(f"{asked.name}.nc") if output is None else output
    if sum(choice is not None for choice in (workers, dask, dask_workers)) > 1:
        raise InputError("--workers, --dask and --dask-workers exclude each other; give one of them")
    pool: Pool | int = os.cpu_count() or 1 if workers is None else workers
    if dask is not None or dask_workers is not None:
        pool = bh.sweep.Dask(dask, dask_workers or 0)
    try:
        with closing(pool) if isinstance(pool, bh.sweep.Dask) else _nothing():
            data = bh.sweep.run(
                asked.task,
                asked.points,
                place,
                pool=pool,
                resume=resume,
                progress=not quiet,
                labels=asked.labels,
                chunk=chunk,
                warm=warm,
            )
    except KeyboardInterrupt:
        again = shlex.join(["bh", "sweep", str(file), "-o", str(place), "--resume"])
        say(f"bh: interrupted; what is finished is kept, go on with: {again}", err=True)
        return 130
    outcomes = data["outcome"].values.ravel().tolist()
    failed = [outcome for outcome in outcomes if outcome != Outcome.REACHED]
    if not quiet:
        say(
            f"{asked.name}: {len(outcomes) - len(failed):,} of {len(outcomes):,} points reached; wrote {place}"
        )
    if failed:
        kinds = ", ".join(f"{failed.count(kind):,} {kind}" for kind in dict.fromkeys(failed))
        have = "1 point has" if len(failed) == 1 else f"{len(failed):,} points have"
        reasons = zip(outcomes, data["reason"].values.ravel().tolist(), strict=True)
        first = next((" ".join(why.split()) for end, why in reasons if end != Outcome.REACHED and why), "")
        told = f"the first: {first}; see" if first else "see"
        say(f"bh: {file}: {have} no values ({kinds}); {told} 'reason' in {place}", err=True)
        return 1
    return 0


def _nothing() -> closing[bh.sweep.Here]:
    return closing(bh.sweep.Here())
