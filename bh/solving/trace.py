"""`bh.trace`: solve a model, on its own mesh or to a wanted accuracy."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from pathlib import Path as FilePath
from typing import TYPE_CHECKING

from bh.errors import ModelError, NotReachedWarning
from bh.model.model import Model
from bh.paths.path import Path
from bh.runtime.compiling import compilation_told
from bh.runtime.progress import ProgressMeter, meter
from bh.solvers.walk import Strategy
from bh.solving.follow import follow

if TYPE_CHECKING:
    from bh.loading.symmetry import Plane
    from bh.model.refinement import Goal


def trace(  # noqa: PLR0913 - the options of the one entry, all by name
    model: Model,
    *,
    symmetry: Plane | None = None,
    progress: bool | ProgressMeter = False,
    strategy: Strategy | None = None,
    file: str | FilePath | None = None,
    resume: bool = False,
    accuracy: float | Goal | None = None,
    estimate: bool = False,
    after: Path | None = None,
    warn: bool = True,
    neighbours: bool | None = None,
) -> Path:
    """Follow the equilibrium of `model` through all its steps.

    Args:
        model: the sheet, its supports and its steps.
        symmetry: "x", "y" or a normal [x, y, 0]: solve one half of a mirror-symmetric model (`bh.loading.symmetry`).
            States are of the whole sheet; what leaves the symmetry is only looked for in the last state
            (`path.stable`).
        progress: True for a bar in the terminal, or an object that is told about every increment.
        strategy: how increments are chosen; the default suits all scenes.
        file: write every accepted state to this file before the next increment begins.
        resume: go on from the states in `file` (which must be of the same model) instead of starting anew.
        accuracy: wanted relative error of the energy, such as 0.02, or a `bh.Goal`. Formulation and mesh are then
            chosen (those of the model only say what the sheet is) and refined until an estimate of the error holds;
            see `bh.solving.accuracy` and `path.accuracy`. With a file, every mesh has one of its own in a folder
            beside it (`path-levels` beside `path.bh`), and `resume` goes on from these.
        estimate: solve one coarser mesh, too, for an estimate of the error (`path.accuracy`), at about a quarter of the
            cost; where it cannot be had, `path.estimate_reason` says why.
        after: a solved path of the same model with fewer steps, whose states this one begins with.
        warn: give a `bh.NotReachedWarning` where the path ends early; False where the caller looks at its outcome.
        neighbours: at the end of each step look for other stable states beside it, such as one of lower energy, and
            say so in `path.remarks`; None looks where an increment was cut, a branch was left or a mode hardly
            resists. With an accuracy one look is taken, on the mesh before the one that is taken.

    Returns:
        the path; `path.outcome` is "reached" only if every step was. A step that cannot go on ends the path with
        its reason and keeps everything up to there; `path.require()` raises then.

    Raises:
        ModelError: the model has no steps, or cannot be solved as described.
        PathFileError: the file cannot be written, or is of another model.
    """
    if not isinstance(model, Model):
        what = "give scene.model" if hasattr(model, "model") else "give a bh.Model"
        raise ModelError(f"trace takes a model, not a {type(model).__name__}; {what}")
    if not model.steps:
        raise ModelError("the model has no steps; add one, for example model.fold('crease', to=1.57)")
    if accuracy is not None and (after is not None or (resume and file is None)):
        raise ModelError(
            "a run to a wanted accuracy begins anew on every mesh; leave out after, and resume it with its file"
        )
    report = meter(progress)
    with compilation_told(report):
        options = _Options(symmetry, report, strategy, file, resume, after, neighbours)
        if accuracy is not None:
            path = _to_accuracy(model, accuracy, options)
        else:
            path = _as_needed(model, options) if model.contact == "auto" else options.follow(model)
        if estimate and path.accuracy is None:
            from bh.solving.given_mesh import add_estimate

            add_estimate(path, progress=report, strategy=strategy, symmetry=symmetry)
            if file is not None:
                path.save_accuracy(file)
    if warn and not path.reached:
        warnings.warn(path.early_end, NotReachedWarning, stacklevel=2)
    return path


@dataclass(frozen=True)
class _Options:
    """How a model is followed on its own mesh; as of `trace`."""

    symmetry: Plane | None
    report: ProgressMeter
    strategy: Strategy | None
    file: str | FilePath | None
    resume: bool
    after: Path | None
    neighbours: bool | None

    def follow(self, model: Model, begun: Path | None = None) -> Path:
        return follow(
            model,
            symmetry=None if model.stops_itself and begun is not None else self.symmetry,
            progress=self.report,
            strategy=self.strategy,
            file=self.file,
            resume=self.resume and begun is None,
            after=self.after if begun is None else None,
            neighbours=self.neighbours,
            begun=begun,
        )


def _as_needed(model: Model, options: _Options, free: Path | None = None) -> Path:
    """A path of a model with contact = "auto", from one without that is solved first."""
    from bh.solving.contact import WITH, go_on_as_needed, stored_model

    if options.after is not None and options.after.model.contact == WITH:  # its panels have met
        return options.follow(replace(model, contact=WITH))
    if free is None:
        stored = model if options.file is None else stored_model(FilePath(options.file), model)
        if options.resume and stored.stops_itself:
            return options.follow(stored)
        free = options.follow(model)
    ends = list(free.steps)
    path = go_on_as_needed(free, options.follow)
    if options.file is not None and path.steps != ends:
        path.save_steps(options.file)
    return path


def _to_accuracy(model: Model, accuracy: float | Goal, options: _Options) -> Path:
    # its analyses are loaded only where they are needed
    from bh.model.refinement import Goal
    from bh.solving.accuracy import solve
    from bh.solving.levels import Levels

    goal = accuracy if isinstance(accuracy, Goal) else Goal(accuracy)
    levels = None if options.file is None else Levels(options.file, options.resume)
    path = solve(
        model,
        goal,
        progress=options.report,
        strategy=options.strategy,
        symmetry=options.symmetry,
        levels=levels,
        neighbours=options.neighbours,
    )
    if options.file is not None:
        path.save(options.file)
    if model.contact == "auto":
        path = _as_needed(path.model, options, path)
        if options.file is not None and path.model.stops_itself:
            path.save_accuracy(options.file)
    return path
