"""What the driver needs to know of a mechanical system; it knows nothing of mechanics.

All actuation enters through one scalar lambda, which runs from 0 to 1 in a step.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from bh.solvers.factor import IndefiniteError, Matrix

Array = NDArray[np.float64]


class Evaluation(NamedTuple):
    """A system at (q, lambda).

    Attributes:
        energy: potential whose stationary points are sought, N mm (with multipliers: the Lagrangian).
        residual: (n,) its gradient.
        imbalance: scale-free size of the residual: largest component beyond rounding, over the typical element
            force; constraint violations in rad or relative units. Zero for perfect equilibrium.
        forces: element forces at q (one array, in the system's own order); see `System.tangent`.
        penalty: what missed constraints add to the energy where steps are compared (line search), N mm.
    """

    energy: float
    residual: Array
    imbalance: float
    forces: Array
    penalty: float = 0.0

    @property
    def merit(self) -> float:
        """What a careful step must lower: the energy, with constraints the augmented Lagrangian; N mm."""
        return self.energy + self.penalty


class System(Protocol):
    """q: (n,) unknowns. The first `primal` of them minimise the energy, the rest are multipliers."""

    @property
    def size(self) -> int: ...

    @property
    def primal(self) -> int: ...

    def evaluate(self, q: Array, lam: float) -> Evaluation: ...

    def tangent(self, q: Array, lam: float, forces: Array) -> Matrix:
        """Symmetric tangent with the element forces `forces` in its geometric part.

        With `forces` of `evaluate(q, lam)` this is the Hessian; with those of `predicted_forces` it is the tangent
        of Newton's method with independent forces (Magisano, Leonetti and Garcea 2017).
        """
        ...

    def predicted_forces(self, forces: Array, dq: Array) -> Array:
        """Element forces that the last tangent predicts after the increment dq."""
        ...

    def control_rate(self, q: Array, lam: float) -> Array:
        """(n,) d residual / d lambda."""
        ...

    def power(self, q: Array, lam: float) -> float:
        """d energy / d lambda at fixed q: the rate of work of the actuation, N mm."""
        ...

    def objection(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        """Why an increment from one state to the next is not to be trusted, or an empty string."""
        ...

    def crossing(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        """What passed through itself between two states, which no increment may, or an empty string."""
        ...

    def obstacle(self, q: Array, lam: float) -> tuple[str, str]:
        """Outcome and reason where the state itself tells why a path ends (contact, ...), else empty strings."""
        ...

    def describe(self, q: Array, lam: float, motion: Array) -> str:
        """A motion (n,) of the unknowns in words, such as "crease 'a' turns freely"."""
        ...

    @property
    def energy_scale(self) -> float:
        """Stiffness times one radian squared over all hinges, N mm; 1e-15 of it is rounding."""
        ...

    @property
    def rotation(self) -> float:
        """Largest change of an imposed or rest angle while lambda runs from 0 to 1, rad."""
        ...


def grows_ahead(system: System, q: Array, lam: float, measure: Callable[[Array, float], float]) -> bool:
    """Does `measure`, zero in equilibrium, grow to first order along the path's own tangent from an accepted state?"""
    try:
        factor = system.tangent(q, lam, system.evaluate(q, lam).forces).factorise(1e-9)
    except IndefiniteError:
        return False
    ahead = 1e-3 * max(lam, 0.01)
    moved = q - ahead * factor.solve(system.control_rate(q, lam))
    return measure(moved, lam + ahead) - measure(q, lam) > 1e-6 * ahead
