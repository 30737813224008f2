"""Data sets that inverse design interpolates in: pieces of strips, or the segments of the source (6.2.4).

bh segments -o mine.nc --zone 12
"""

from __future__ import annotations

import json
from concurrent.futures import Executor
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from bh.applications.inverse.models import Name, beside
from bh.applications.inverse.pieces import CONVERGING, PIECES, PieceTask, column
from bh.applications.inverse.pieces import table as piece_table
from bh.applications.inverse.segments import Domain, beyond, grid
from bh.applications.inverse.simulate import SETTING, SegmentTask, Setting
from bh.applications.inverse.surrogate import FORMAT, Surrogate
from bh.applications.inverse.variants import VARIANTS
from bh.applications.inverse.variants import table as variant_table
from bh.runtime.terminal import say
from bh.scene.options import a_length
from bh.solvers.outcome import Outcome
from bh.sweep import Label, Points, SweepError, run, table
from bh.sweep.pools import Pool
from bh.sweep.runner import Meter

if TYPE_CHECKING:
    from xarray import Dataset

BESIDE = (
    10.0  # mm on either side of a pinch in the shortest segment, where it dies out by a factor of a hundred
)
LABELS = {
    "k0": Label("1/mm", "curvature of the crease before folding, positive to the left"),
    "length": Label("mm", "length of the crease"),
    "t": Label("mm", "end of the crease in the frame at its start (Eq. 6.9)", ("xyz",)),
    "uvw": Label(
        "rad", "Tait-Bryan angles of the frame at the end (Eq. 6.14 to 6.16), w not wrapped", ("angle",)
    ),
    "end_dihedral": Label("rad", "dihedral angle of the first and the last edge of the crease", ("end",)),
    "energy": Label("N mm", "elastic energy"),
    "stable": Label("", "1: the state is stable"),
    "critical_points": Label("", "limit and bifurcation points on the way"),
}
PIECE_LABELS = {
    "kind": Label("", "arc, pinch or joint"),
    "before": Label("1/mm", "curvature of the crease before folding, positive to the left"),
    "after": Label("1/mm", "the same behind a joint"),
    "edge": Label("mm", "cells of the mesh along the crease"),
    "rows": Label("", "rows of cells a panel"),
    "t": Label("mm", "from the free end to the first section, and from there to the second", ("way", "xyz")),
    "r": Label("", "the same, rotations", ("way", "row", "column")),
    "to_middle": Label(
        "mm", "from the free end to the first section, and from there to the middle", ("way",)
    ),
    "energy": LABELS["energy"],
    "stable": LABELS["stable"],
    "critical_points": LABELS["critical_points"],
}
VARIANT_LABELS = {
    column("Lstar"): Label("mm", "length scale of the crease"),
    column("t"): Label("mm", "thickness"),
    column("zone"): Label("mm", "length of the pinched zone"),
    column("pinch"): Label("rad", "dihedral angle in its middle"),
    column("fold"): Label("rad", "rest dihedral angle"),
}


def points(domain: Domain | None = None, step_k0: float = 5e-4, step_length: float = 4.0) -> Points:
    """The source's grid (2,487 segments), and behind it those just beyond the domain that splines need at its edge.

    Args:
        domain: of curvatures and lengths; None for the source's.
        step_k0: between curvatures, 1/mm.
        step_length: between lengths, mm.
    """
    inside = grid(domain, step_k0, step_length)
    outside = beyond(domain, step_k0, step_length)
    k0, length = (np.concatenate(pair) for pair in zip(inside, outside, strict=True))
    # the rounded decimals, not what steps add up to, so that data sets of equal steps have equal keys
    return table({"k0": np.round(k0, 12).tolist(), "length": np.round(length, 9).tolist()})


def _about(title: str, version: int, setting: Setting) -> dict[str, str | int]:
    """Attributes of a data set, by which it is read back."""
    return {"title": title, "format": version, "setting": json.dumps(asdict(setting))}


def build(
    file: str | Path,
    setting: Setting = SETTING,
    *,
    pool: Pool | Executor | int | None = None,
    resume: bool = False,
    progress: bool | Meter = False,
) -> Dataset:
    """Simulate all segments of `points` and write the data set.

    Args:
        file: of the data set (netCDF-4).
        setting: sheet, fold and pinch of every segment.
        pool: see `bh.sweep.run`.
        resume: see `bh.sweep.run`.
        progress: see `bh.sweep.run`.

    Raises:
        SweepError: see `bh.sweep.run`.
    """
    return run(
        SegmentTask(setting),
        points(),
        file,
        pool=pool,
        resume=resume,
        progress=progress,
        labels=LABELS,
        attributes=_about("Pinched segments of a folded crease", FORMAT, setting),
    )


def build_pieces(
    file: str | Path,
    setting: Setting = CONVERGING,
    *,
    pool: Pool | Executor | int | None = None,
    resume: bool = False,
    progress: bool | Meter = False,
) -> Dataset:
    """Simulate all pieces of strips (`bh.applications.inverse.pieces`) and write the data set.

    Args:
        file: of the data set (netCDF-4).
        setting: sheet, fold and pinch; the levels have their own meshes.
        pool: see `bh.sweep.run`.
        resume: see `bh.sweep.run`.
        progress: see `bh.sweep.run`.

    Raises:
        SweepError: see `bh.sweep.run`.
    """
    return run(
        PieceTask(setting),
        table(piece_table()),
        file,
        pool=pool,
        resume=resume,
        progress=progress,
        labels=PIECE_LABELS,
        attributes=_about("Pieces of folded strips: arcs, free ends, pinches and joints", PIECES, setting),
    )


def build_variants(
    file: str | Path,
    setting: Setting = CONVERGING,
    *,
    pool: Pool | Executor | int | None = None,
    resume: bool = False,
    progress: bool | Meter = False,
) -> Dataset:
    """Simulate pieces that are made a little differently, and pinches that are closed by a part of the way.

    Args:
        file: of the data set (netCDF-4).
        setting: that is varied.
        pool: see `bh.sweep.run`.
        resume: see `bh.sweep.run`.
        progress: see `bh.sweep.run`.

    Raises:
        SweepError: see `bh.sweep.run`.
    """
    return run(
        PieceTask(setting),
        table(variant_table(setting)),
        file,
        pool=pool,
        resume=resume,
        progress=progress,
        labels=PIECE_LABELS | VARIANT_LABELS,
        attributes=_about("Variants of pieces of folded strips", VARIANTS, setting),
    )


def intensity_points(
    surrogate: Surrogate, steps: int = 9, parts: tuple[float, ...] = (0.25, 0.5, 0.75)
) -> Points:
    """Segments pinched by parts of the way: a grid of curvatures (k0 >= 0: mirror images are known), lengths and parts.

    Args:
        surrogate: of fully pinched segments, whose domain is taken.
        steps: curvatures a length, and lengths.
        parts: of the way from the fold to the full pinch.
    """
    lengths = np.linspace(*surrogate.domain.length, steps)
    setting = surrogate.setting
    rows = [
        (
            float(np.round(s * surrogate.sector_bound(length), 12)),
            float(length),
            float(setting.fold - a * way),
        )
        for way in (setting.fold - setting.pinch,)
        for a in parts
        for length in lengths
        for s in np.linspace(0.0, 1.0, steps)
    ]
    k0, length, pinch = (list(column) for column in zip(*rows, strict=True))
    return table({"k0": k0, "length": length, "pinch": pinch})


def build_intensities(
    file: str | Path, surrogate: Surrogate, *, pool: Pool | Executor | int | None = None, resume: bool = False
) -> Dataset:
    """Simulate `intensity_points` for a data set, as `bh.applications.inverse.graded` needs them.

    Args:
        file: of the data set (netCDF-4).
        surrogate: of fully pinched segments, see `intensity_points`.
        pool: see `bh.sweep.run`.
        resume: see `bh.sweep.run`.

    Raises:
        SweepError: see `bh.sweep.run`.
    """
    setting = surrogate.setting
    about = {
        "title": "Pinched segments of some intensities",
        "format": FORMAT,
        "setting": json.dumps(asdict(setting)),
    }
    points = intensity_points(surrogate)
    return run(SegmentTask(setting), points, file, pool=pool, resume=resume, labels=LABELS, attributes=about)


def segments(
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE.nc", help="Data set.")],
    zone: Annotated[
        float, typer.Option("--zone", metavar="40mm", parser=a_length, help="Length of the pinched zone.")
    ] = SETTING.zone,
    model: Annotated[
        Name, typer.Option("--model", help="converged, or source for one row of bars and hinges.")
    ] = "converged",
    workers: Annotated[int | None, typer.Option("--workers", "-w", min=0, help="Local processes.")] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on from the points that are finished.")
    ] = False,
) -> int:
    """Make the data set of strips for inverse design."""
    from dataclasses import replace

    most = Domain().length[0] - 2.0 * BESIDE
    if not zone > 0.0:
        raise SweepError(f"a zone of {zone:g} mm cannot be; use a length from 1 to {most:g} mm")
    if zone > most:
        raise SweepError(
            f"a zone of {zone:g} mm is longer than the shortest segment, {Domain().length[0]:g} mm, has room for; "
            f"use {most:g} mm or less"
        )
    if model == "source":
        makers = [("segments", build, replace(SETTING, zone=zone), output)]
    else:
        setting = replace(CONVERGING, zone=zone)
        makers = [
            ("pieces", build_pieces, setting, output),
            ("variants of pieces", build_variants, setting, beside(output)),
        ]
    failed = 0
    for what, make, made, file in makers:
        going_on = resume and (file.is_file() or Path(f"{file}.points").is_file() or file == output)
        data = make(file, made, pool=workers, resume=going_on, progress=True)
        lost = int((data["outcome"] != Outcome.REACHED).sum())
        say(f"{data.sizes['point'] - lost:,} of {data.sizes['point']:,} {what}; wrote {file}")
        failed += lost
    return 1 if failed else 0
