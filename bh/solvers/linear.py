"""Small displacements: one solve with the tangent of a state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bh.solvers.system import System

Array = NDArray[np.float64]


class LinearSystem(System, Protocol):
    """A system that also knows its second derivative with respect to lambda."""

    def control_stiffness(self, q: Array, lam: float) -> float:
        """Second derivative of the energy by lambda at fixed q (n,), N mm.

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        ...


@dataclass(frozen=True)
class LinearResponse:
    """Response to the whole control (lambda from 0 to 1) with the tangent of a state frozen.

    Attributes:
        dq: (n,) change of the unknowns.
        energy: quadratic part of the potential, N mm: with prescribed displacements or angles the strain energy
            gained, with dead forces minus the strain energy.
    """

    dq: Array
    energy: float


def linear_response(system: LinearSystem, q: Array, lam: float = 0.0) -> LinearResponse:
    """Linear response of `system` at (q, lam); raises `IndefiniteError` where the state is not stable.

    Args:
        system: that is asked.
        q: (n,) unknowns.
        lam: load parameter of the step, 0 to 1.

    Raises:
        IndefiniteError: the state is not stable.
    """
    now = system.evaluate(q, lam)
    rate = system.control_rate(q, lam)
    dq = -system.tangent(q, lam, now.forces).matrix.factorise().solve(rate)
    # potential to second order: 1/2 dq K dq + dq . rate + 1/2 c, with K dq = -rate
    energy = 0.5 * (float(rate @ dq) + system.control_stiffness(q, lam))
    return LinearResponse(dq, energy)
