"""The error of a path on a mesh that was given: one coarser mesh is solved, too.

With cells twice as large in both directions it has a quarter of the unknowns. Of two values no order can be seen;
Roache (1994) takes the order of the method, here two, and twice the safety: error = TWO_MESHES |v2 - v1| / (2^2 - 1).
Where no such mesh exists, or it would tell nothing, one line says why.
"""

from __future__ import annotations

import math
import time

import numpy as np

from bh.errors import InputError
from bh.formulations.protocols import Refinable
from bh.formulations.registry import formulation
from bh.loading.symmetry import Plane
from bh.model.model import Model
from bh.model.refinement import MOST, Goal, pattern_of, with_mesh
from bh.paths.estimate import Accuracy, Trial
from bh.paths.path import Path
from bh.runtime.progress import ProgressMeter, meter, stage
from bh.solvers.walk import Strategy
from bh.solving.accuracy import ORDERS, nothing, reading, snaps, steps_in_words
from bh.solving.follow import follow
from meshes.cells import Cells
from meshes.choices import cut

ENERGY = Goal(MOST)
TWO_MESHES = 3.0  # the safety of an estimate from two values


def add_estimate(
    path: Path,
    *,
    progress: bool | ProgressMeter = False,
    strategy: Strategy | None = None,
    symmetry: Plane | None = None,
) -> None:
    """Give a path its `accuracy`, of the energy, or the `estimate_reason` why it has none.

    Args:
        path: that is solved.
        progress: as of `bh.trace`.
        strategy: as the path was solved with.
        symmetry: as the path was solved with.
    """
    began = time.perf_counter()
    why = _why_not(path)
    cells = path.model.mesh.cells
    if why or cells is None:
        path.estimate_reason = why
        return
    coarse = cells.coarsened()
    assert coarse is not None
    report = meter(progress)
    stage(report, f"for the estimate, {coarse}")
    try:
        other = follow(
            with_mesh(path.model, cut(pattern_of(path.model), coarse), path.model.formulation),
            progress=report,
            strategy=strategy,
            symmetry=symmetry,
            neighbours=False,  # its energy is what is wanted, and no remark of it is shown
        )
    except InputError as error:
        path.estimate_reason = (
            f"a coarser mesh to compare with could not be solved ({str(error).split(';')[0]})"
        )
        return
    if not other.reached:
        path.estimate_reason = f"the path on a coarser mesh to compare with ended early ({other.outcome})"
    elif why := _not_repeated(set(snaps(path)), set(snaps(other))):
        path.estimate_reason = why
    else:
        path.accuracy = _compared(other, coarse, path, cells, time.perf_counter() - began)


def _not_repeated(here: set[int], coarse: set[int]) -> str:
    """What is doubtful where two meshes snap in different steps (numbers from 1); empty if they do not."""
    found = [
        f"in {steps_in_words(steps)} on {which}"
        for steps, which in (
            (here - coarse, "this mesh and not on a coarser one"),
            (coarse - here, "a coarser mesh and not on this one"),
        )
        if steps
    ]
    if not found:
        return ""
    return f"doubtful: the sheet snaps to another branch {', and '.join(found)}; use a finer mesh"


def _why_not(path: Path) -> str:
    """Why no estimate can be made, as far as that is known before anything is solved; empty if it can."""
    model = path.model
    if not path.reached:
        return f"the path ended early ({path.outcome})"
    known = formulation(model.formulation)
    if not (isinstance(known, Refinable) and known.refinement):
        return (
            f"{model.formulation} are not known to converge under refinement, so a coarser mesh tells nothing of the "
            'error; use formulation = "consistent" or accuracy = 0.05 in place of the mesh'
        )
    return _why_one_mesh(model)


def _why_one_mesh(model: Model) -> str:
    try:
        pattern_of(model)
    except InputError as error:
        return str(error).split(", or no accuracy")[0].split("; ")[0]
    cells = model.mesh.cells
    if cells is None or cells.coarsened() is None:
        return (
            "the panels have one row of cells, too few to compare with a coarser mesh; use rows = 2 or more, or "
            "accuracy = 0.05 in place of the mesh"
        )
    return ""


def _compared(coarse: Path, coarse_cells: Cells, path: Path, cells: Cells, spent: float) -> Accuracy:
    trials = tuple(_trial(p, c) for p, c in ((coarse, coarse_cells), (path, cells)))
    size = max(float(np.linalg.norm(trials[1].value)), nothing(path.model, ENERGY))
    error = TWO_MESHES * float(np.linalg.norm(trials[1].value - trials[0].value)) / (2.0 ** ORDERS[1] - 1.0)
    words = f"{trials[1].triangles} triangles ({cells})"
    return Accuracy(
        ENERGY,
        error / size if size > 0.0 else 0.0,
        True,
        math.nan,
        path.model.formulation,
        words,
        trials,
        spent,
        asked=False,
    )


def _trial(path: Path, cells: Cells) -> Trial:
    return Trial(
        path.model.formulation,
        math.nan,
        str(cells),
        len(path.model.mesh.triangles),
        path.unknowns,
        path.iterations,
        path.wall_time_s,
        path.outcome,
        reading(path, ENERGY),
        snaps(path),
    )
