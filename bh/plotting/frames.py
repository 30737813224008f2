"""Frames between the states of a path, so that a folding moves evenly: each is solved, none is drawn by blending."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.runtime.threads import one_blas_thread
from bh.solvers.newton import Newton

if TYPE_CHECKING:
    from bh.formulations.state import State
    from bh.paths.path import Path

Array = NDArray[np.float64]
LEAST = 8  # solves from one state of the path to the next, few frames or many
SAME = 1e-3  # of the sheet's extent: how near the way has to come to the state that it leads to


def evenly(path: Path, count: int) -> list[State]:
    """States at even distances along a path, as far as nodes move.

    Between two states of a step equilibria are solved at the control parameters between theirs. Where that does not
    lead to the second one (a snap, a path that runs back), and where states remember their past or panels press on
    each other, the nearer of the two states stands for the frame.

    Args:
        path: solved, as far as it goes.
        count: how many, 2 or more; the first and the last state are among them.

    Returns:
        states of the path's steps, in order.
    """
    ends = list(path)
    if len(ends) < 2:
        return ends * count
    moved = [float(np.sqrt(np.mean((b.points - a.points) ** 2))) for a, b in pairwise(ends)]
    along = np.concatenate(([0.0], np.cumsum(np.asarray(moved) + 1e-12 * path.model.mesh.size)))
    wanted = np.linspace(0.0, along[-1], count)
    gaps = np.clip(np.searchsorted(along, wanted, side="right") - 1, 0, len(ends) - 2)
    parts = (wanted - along[gaps]) / np.diff(along)[gaps]
    found: list[State] = []
    with one_blas_thread():
        for gap in range(len(ends) - 1):
            mine = parts[gaps == gap]
            if len(mine):
                found += _between(path, gap, np.clip(mine, 0.0, 1.0))
    return found


def _between(path: Path, gap: int, parts: Array) -> list[State]:
    """States at rising parts (k,) of the way from state `gap` to the next one."""
    ends = path[gap], path[gap + 1]
    nearer = [ends[int(part > 0.5)] for part in parts.tolist()]
    record, before = path.records[gap + 1], path.records[gap]
    inner = [part for part in parts.tolist() if 0.0 < part < 1.0]
    if not inner or record.jumped or record.history is not None or path.model.hindered:
        return nearer
    system = path.system(record.step)
    begin, lam = (before.q, before.lam) if before.step == record.step else (system.start(), 0.0)
    if record.lam <= lam:
        return nearer
    solved: dict[float, Array] = {}
    known = [(lam, begin)]
    for part in sorted({*inner, *np.linspace(0.0, 1.0, LEAST + 1)[1:].tolist()}):
        at = lam + part * (record.lam - lam)
        answer = Newton().solve(system, _guess(known, at), at)
        if not answer.converged:
            return nearer
        known.append((at, answer.q))
        solved[part] = answer.q
    reached = path.observe(record.step, known[-1][1], record.lam)
    if np.abs(reached.points - ends[1].points).max() > SAME * path.model.mesh.size:
        return nearer
    return [
        path.observe(record.step, solved[part], lam + part * (record.lam - lam))
        if part in solved and part < 1.0
        else state
        for part, state in zip(parts.tolist(), nearer, strict=True)
    ]


def _guess(known: list[tuple[float, Array]], at: float) -> Array:
    """Unknowns at `at` on the line through the last two states known; of one alone its own."""
    one, q = known[-1]
    if len(known) == 1:
        return q
    two, p = known[-2]
    return np.asarray(q + (at - one) / (one - two) * (q - p))
