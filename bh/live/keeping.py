"""Newton's steps with a factor that is kept while they contract, as states close to the last ones need but one."""

from __future__ import annotations

from collections.abc import Callable, Generator

import numpy as np
from numpy.typing import NDArray

from bh.solvers.creeping import diverged, slow
from bh.solvers.factor import Factor
from bh.solvers.modes import factorise_shifted
from bh.solvers.newton import ENDLESS, INDEFINITE, NEAR_SADDLE, Newton, Solution
from bh.solvers.system import System, limited, unchanged

Array = NDArray[np.float64]
KEEPS = 1e-2  # part of the imbalance that a step may leave, behind which its factor serves the next one
HELPS = 0.1  # the same of a step with a factor that was kept; one that leaves more is not made


def kept_steps(
    newton: Newton, system: System, q: Array, lam: float, forces: Array
) -> Generator[Array, None, Solution]:
    """`Newton.full_steps` with fewer factorisations; the stability of what is found is not looked at.

    A factor that has taken most of the imbalance away serves on (modified Newton). Where it does not, a new one is
    made; where that is not positive definite as it is, or hardly helps near the solution, `full_steps` goes on.

    Args:
        newton: tolerance and number of steps.
        system: whose equilibrium is sought.
        q: (n,) guess.
        lam: load parameter of the step.
        forces: (f,) element forces that go with the guess.

    Yields:
        (n,) unknowns after every step.

    Returns:
        what came of it; `stable` is None where every tangent was positive definite.
    """
    now = system.evaluate(q, lam)
    if not np.isfinite(now.energy):
        return Solution(q, now, 0, False, "the guess has no energy")
    predicted: Callable[[Array, Array], Array] = unchanged  # forces, by the last tangent
    factor: Factor | None = None
    least, steps = now.imbalance, 0
    moved: tuple[Array, Array] | None = None  # forces before the last step, and the step
    sizes: list[float] = []
    while now.imbalance > newton.tolerance and steps < newton.full:
        new = factor is None
        if factor is None:
            forces, moved = forces if moved is None else predicted(*moved), None
            tangent = system.tangent(q, lam, forces)
            predicted = tangent.predicted_forces
            factor, shift = factorise_shifted(tangent.matrix, 0.0, newton.full_shift)
            if factor is None:
                return Solution(q, now, steps, False, INDEFINITE)
            if shift > 0.0:
                break
        dq = -factor.solve(now.residual)
        if not float(np.abs(dq).max(initial=0.0)) < ENDLESS:
            return Solution(q, now, steps, False, "singular tangent")
        dq = limited(system, q, dq, lam)
        there = system.evaluate(q + dq, lam)
        left = there.imbalance / now.imbalance
        if not new and not left <= HELPS:
            factor = None
            continue
        sizes.append(float(np.linalg.norm(dq[: system.primal])))
        if newton.hasty and now.imbalance > NEAR_SADDLE and slow(sizes):
            return Solution(q, now, steps, False, "slow contraction")
        if diverged(there, least):
            return Solution(q + dq, there, steps + 1, False, "diverged")
        moved = now.forces, dq
        factor = factor if left <= KEEPS or not new else None
        near = now.imbalance <= NEAR_SADDLE
        q, now, steps = q + dq, there, steps + 1
        least = min(least, now.imbalance)
        yield q
        if near and left > 0.5:
            break
    if steps and now.imbalance <= newton.tolerance:
        return Solution(q, now, steps, True)
    forces = forces if moved is None else predicted(*moved)
    found = yield from newton.full_steps(system, q, lam, forces)
    return found.after(steps)
