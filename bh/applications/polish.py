"""Designs whose solved model has the wanted observables: Gauss and Newton's method with adjoint gradients.

Each round solves the model once and takes the Jacobian from `bh.sensitivities.of`; the step is the smallest one, in
units of `scale`, that meets all targets to first order (or comes nearest) within bounds and a trust region. A step that
does not lower the sum of squares, or whose model cannot be solved, shrinks that region.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.analysis.sensitivities import Build, Observable, of
from bh.analysis.situation import Situation
from bh.errors import InputError, ModelError
from bh.paths.path import Path
from bh.solvers.outcome import Outcome
from bh.solvers.walk import Strategy
from bh.solving.follow import look_beside
from bh.solving.trace import trace

Array = NDArray[np.float64]
FIRST = 0.25  # longest first step, in units of the scale
SHORTEST = 1e-5
SMALL = 1e-3  # square root of what the size of a step weighs against the targets


class Solving(TypedDict, total=False):
    """How often and how models are solved.

    Attributes:
        most: solves of the model at most, 20 by default.
        steps: of the differences, see `bh.sensitivities.of`.
        strategy: of `bh.trace`.
    """

    most: int
    steps: ArrayLike | None
    strategy: Strategy | None


@dataclass(frozen=True)
class _Solving:
    most: int = 20
    steps: ArrayLike | None = None
    strategy: Strategy | None = None


@dataclass(frozen=True, eq=False)
class Polished:
    """What came of an initial guess.

    Attributes:
        design: (k,) the best parameters that were found.
        path: its solved model.
        values: (m,) of the observables there.
        missed: (m,) values less targets.
        solves: of the model, failed ones included.
        history: the largest miss over its tolerance, at the start and after each step that was taken.
        outcome: "reached", "limit of solves", or "no descent" where no step helps.
    """

    design: Array
    path: Path
    values: Array
    missed: Array
    solves: int
    history: tuple[float, ...]
    outcome: str


def polish(
    build: Build,
    design: ArrayLike,
    targets: Sequence[tuple[Observable, float]],
    tolerance: ArrayLike,
    *,
    scale: ArrayLike | None = None,
    bounds: tuple[ArrayLike, ArrayLike] | None = None,
    **solving: Unpack[Solving],
) -> Polished:
    """Change a design until observables of its solved model are what they are to be.

    Args:
        build: makes the model of a design (k,), as for `bh.sensitivities.of`.
        design: where to start, such as a surrogate's answer.
        targets: observables and the values that they are to have.
        tolerance: how far each may stay off, in its unit; one number or (m,).
        scale: (k,) typical changes of the parameters, by default their sizes at the start.
        bounds: least and largest values of the parameters.
        **solving: most, steps and strategy, see `Solving`.

    Raises:
        ModelError: the start cannot be solved, or input that does not fit.
    """
    how = _Solving(**solving)
    p = np.atleast_1d(np.array(design, dtype=float))
    wanted = np.array([value for _, value in targets], dtype=float)
    allowed = np.broadcast_to(np.asarray(tolerance, dtype=float), wanted.shape)
    if len(wanted) == 0 or not (allowed > 0.0).all():
        raise ModelError("polishing needs at least one target and positive tolerances")
    sizes = np.where(p == 0.0, 1.0, np.abs(p)) if scale is None else np.asarray(scale, dtype=float)
    ends = (-np.inf, np.inf) if bounds is None else bounds
    low, high = (np.broadcast_to(np.asarray(end, dtype=float), p.shape) for end in ends)
    if sizes.shape != p.shape or not (sizes > 0.0).all():
        raise ModelError(f"scale must be {len(p)} positive numbers, one for each parameter")
    if not ((low <= p) & (p <= high)).all():
        raise ModelError("the start lies outside its bounds; move it inside")
    observables = [observable for observable, _ in targets]
    path = trace(build(p), strategy=how.strategy, warn=False, neighbours=False)
    if not path.reached:
        raise ModelError(f"the start cannot be solved ({path.outcome}): {path.reason}")
    missed = _values(path, observables) - wanted
    solves, history, trust, outcome = 1, [float((np.abs(missed) / allowed).max())], FIRST, ""
    while not outcome:
        if history[-1] <= 1.0:
            outcome = Outcome.REACHED
            break
        found = of(path, build, p, observables, steps=how.steps)
        J = np.array([item.gradient for item in found]) / allowed[:, None] * sizes
        better = None
        while not outcome and better is None:
            room = (np.maximum((low - p) / sizes, -trust), np.minimum((high - p) / sizes, trust))
            step = _step(J, missed / allowed, room)
            if solves >= how.most:
                outcome = "limit of solves"
            elif trust < SHORTEST or np.abs(step).max() < SHORTEST:
                outcome = "no descent"
            else:
                better = _better(build, p + step * sizes, observables, wanted, allowed, missed, how.strategy)
                solves += 1
                trust *= 2.0 if better else 0.25
        if better is not None:
            path, p, missed = better
            history.append(float((np.abs(missed) / allowed).max()))
    look_beside(path)  # once, at the answer: on the way nobody asks for other stable states
    return Polished(p, path, missed + wanted, missed, solves, tuple(history), outcome)


def _step(J: Array, missed: Array, room: tuple[Array, Array]) -> Array:
    """(k,) step within `room` that meets the targets to first order, or comes nearest; the smallest of those.

    All in units of the scale. Of the squares the size of the step weighs one millionth.
    """
    from scipy.optimize import lsq_linear

    weight = SMALL * float(np.linalg.norm(J, 2))
    A = np.vstack((J, weight * np.eye(J.shape[1])))
    found = lsq_linear(A, np.concatenate((-missed, np.zeros(J.shape[1]))), bounds=room, method="bvls")
    return np.asarray(found.x)


def _values(path: Path, observables: Sequence[Observable]) -> Array:
    at = Situation(path, -1)
    return np.array([observable.value(at) for observable in observables])


def _better(
    build: Build,
    p: Array,
    observables: Sequence[Observable],
    wanted: Array,
    allowed: Array,
    missed: Array,
    strategy: Strategy | None,
) -> tuple[Path, Array, Array] | None:
    """The solved model of a design, the design and what it misses; None if that is no less than what is missed now."""
    try:
        path = trace(build(p), strategy=strategy, warn=False, neighbours=False)
    except InputError:
        return None
    if not path.reached:
        return None
    off = _values(path, observables) - wanted
    return (path, p, off) if ((off / allowed) ** 2).sum() < ((missed / allowed) ** 2).sum() else None
