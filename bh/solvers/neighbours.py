"""Other stable states near one that a path has come to: pushed along its softest mode, both ways, and solved again.

A path that is cut, or runs along a mode that hardly resists, may end on one branch or another by the length of its
increments. Here is looked whether there is another state near, and whether it has less energy.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.solvers.matrices import IndefiniteError
from bh.solvers.modes import count_and_factor, lowest_mode, softness
from bh.solvers.newton import Newton, Solution
from bh.solvers.points import Factorised, Point
from bh.solvers.system import System, Tangent

Array = NDArray[np.float64]
PUSHES = (0.3, 0.8)  # along the softest mode, in parts of the largest unknown; from 0.1 all came back
SOFT = 1e-3  # a mode whose stiffness is less than this part of the next one's may lead anywhere
OTHER = 1e-5  # difference of energy, in parts of it, from which two states are not one
DOWNHILL = 40  # steps at most


class Neighbour(NamedTuple):
    """Another stable state at the same load.

    Attributes:
        lower: by how much its energy is lower, N mm; negative where it is higher.
        part: the same in parts of the larger energy of the two.
        way: largest change of an unknown on the way to it, in parts of the largest unknown.
        iterations: of the look.
    """

    lower: float
    part: float
    way: float
    iterations: int

    def __str__(self) -> str:
        """One clause."""
        if self.lower > 0.0:
            return f"a stable state of lower energy is within reach ({self.lower:.3g} N mm or {self.part:.2%} lower)"
        return f"another stable state is within reach ({-self.lower:.3g} N mm or {-self.part:.2%} higher)"


def look_around(
    system: System, here: Point, doubtful: bool, newton: Newton, factorised: Factorised | None = None
) -> str:
    """What lies beside the end of a step, where the way there, or the state itself, gives reason to look.

    Args:
        system: of the step.
        here: its last state.
        doubtful: whether to look anyway; else only where a mode hardly resists.
        newton: settings of the solves.
        factorised: what the state's stability was seen from; None to make it anew.

    Returns:
        one clause, or an empty string.
    """
    if here.negative:
        return ""
    if factorised is None:
        tangent = system.tangent(here.q, here.lam, here.forces)
        factorised = Factorised(tangent, None if doubtful else count_and_factor(tangent.matrix)[1])
    if not (doubtful or nearly_neutral(system, factorised)):
        return ""
    found = neighbour(system, here, newton, tangent=factorised.tangent)
    return "" if found is None else str(found)


def nearly_neutral(system: System, factorised: Factorised) -> bool:
    """Whether a mode of a state hardly resists, beside the next one.

    Args:
        system: of the step.
        factorised: what the stability of a state was seen from that has no negative mode; without a factor what
            rounding makes of a neutral mode is all that is negative.
    """
    return factorised.factor is None or softness(factorised.factor, system.primal) < SOFT


def neighbour(
    system: System,
    here: Point,
    newton: Newton,
    pushes: tuple[float, ...] = PUSHES,
    tangent: Tangent | None = None,
) -> Neighbour | None:
    """The stable state of least energy, other than `here`, that pushes along the softest mode lead to.

    Args:
        system: of the step.
        here: a stable state.
        newton: settings of the solves.
        pushes: in parts of the largest unknown.
        tangent: of the state, if it is at hand.

    Returns:
        None where every push leads back, or nowhere.
    """
    tangent = tangent or system.tangent(here.q, here.lam, here.forces)
    best: Neighbour | None = None
    spent = 0
    scale = 1e-12 * system.energy_scale
    for found in _pushed(system, here, tangent, newton, pushes):
        spent += found.iterations
        if not (found.converged and found.stable) or system.penetration(here.q, here.lam, found.q, here.lam):
            continue
        energy = found.evaluation.energy
        lower = here.energy - energy
        size = max(abs(here.energy), abs(energy))
        if abs(lower) <= OTHER * size + scale:
            continue
        p = system.primal
        way = float(np.abs((found.q - here.q)[:p]).max()) / max(float(np.abs(here.q[:p]).max()), 1e-300)
        if best is None or lower > best.lower:
            best = Neighbour(lower, lower / size, way, 0)
    return None if best is None else best._replace(iterations=spent)


def _pushed(
    system: System, here: Point, tangent: Tangent, newton: Newton, pushes: tuple[float, ...]
) -> Iterator[Solution]:
    """What solves from both sides of a state come to; by full steps, else downhill."""
    p = system.primal
    try:
        _, mode = lowest_mode(tangent.matrix, len(here.q), p)
    except IndefiniteError:
        return
    size = float(np.abs(here.q[:p]).max(initial=0.0))
    mode = mode / max(float(np.abs(mode[:p]).max()), 1e-300)
    down = replace(newton, globalised=DOWNHILL, held=None, unstable=False)
    for push in pushes:
        for sense in (1.0, -1.0):
            way = sense * push * size * mode
            found = down.solve_full(
                system, here.q + way, here.lam, tangent.predicted_forces(here.forces, way)
            )
            if not (found.converged and found.stable):
                spent = found.iterations
                found = down.solve_globalised(system, here.q + way, here.lam)
                found = replace(found, iterations=found.iterations + spent)
            yield found
