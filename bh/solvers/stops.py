"""Steps that go round hinges which would close, in place of steps that are shortened as a whole.

A net that is folded far has always one hinge, of thousands, that a whole step downhill would carry through closed. Its
lock is a barrier that the tangent does not know before the hinge is next to it, so the step of all others would be cut
to a tenth for its sake. Here the step keeps its length: it is the one of least energy (of the same quadratic model)
among those by which these hinges turn only as far as they may. With K the tangent, G the rows of the hinges, t the
turns that they may make and d the free step it is

    d - K^-1 G^T (G K^-1 G^T)^-1 (G d - t),

as in active-set methods (Nocedal and Wright 2006, 16.5). A hinge turns otherwise than its row says where the step is
long, so what it misses goes into t, and those that would close next are added, a few times over.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bh.solvers.factor import Descent, Factor
from bh.solvers.hinged import Hinged
from bh.solvers.system import System, limited

Array = NDArray[np.float64]
KEPT = 0.2  # of the way of a hinge to closed that a step downhill leaves
ROUNDS = 5  # in which hinges that would close are found
MOST = 100  # hinges that are held back in one step; solves for more cost more than steps
SINGULAR = 1e-12  # of the largest: turns of hinges that are no others' business


def around(
    system: System, q: Array, lam: float, descent: Descent, factor: Factor, residual: Array
) -> Descent:
    """A direction downhill that closes no hinge at its full length, or the one that is given.

    Args:
        system: whose energy is lowered.
        q: (n,) unknowns.
        lam: load parameter of the step, 0 to 1.
        descent: the direction, of a system without multipliers.
        factor: of the tangent, shifted or not, that the direction is by.
        residual: (n,) there.
    """
    if not isinstance(system, Hinged) or len(q) > system.primal:
        return descent
    free = limited(system, q, descent.direction, lam)
    step, held, wanted = free, np.empty(0, dtype=np.int64), np.empty(0)
    rows = solved = np.empty((0, len(q)))
    for _ in range(ROUNDS):
        stops = system.stops(q, q + step, lam)
        if not len(stops.hinges):
            break
        new = np.flatnonzero(~np.isin(stops.hinges, held))
        if len(held) + len(new) > MOST:
            return descent
        known = np.flatnonzero(np.isin(stops.hinges, held))
        again = np.searchsorted(held, stops.hinges[known])
        wanted[again] += (stops.wanted - stops.taken)[known]
        if len(new):
            more = system.turning(q, lam, stops.hinges[new])
            held = np.concatenate([held, stops.hinges[new]])
            wanted = np.concatenate([wanted, stops.wanted[new]])
            rows = np.vstack([rows, more])
            solved = np.vstack([solved, factor.solve(more.T).T])
            order = np.argsort(held)
            held, wanted, rows, solved = held[order], wanted[order], rows[order], solved[order]
        moments = np.linalg.lstsq(rows @ solved.T, rows @ free - wanted, rcond=SINGULAR)[0]
        step = free - moments @ solved
    slope = float(residual @ step)
    return Descent(step, slope) if len(held) and slope < 0.0 else descent
