"""What is asked of a system with hinges that close, beside `bh.solvers.system.System`."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Stops(NamedTuple):
    """Hinges that are to turn less than a step turns them.

    Attributes:
        hinges: (k,) which.
        wanted: (k,) how far they may turn, rad.
        taken: (k,) how far the step turns them, the shorter way, rad.
    """

    hinges: NDArray[np.int64]
    wanted: Array
    taken: Array


@runtime_checkable
class Hinged(Protocol):
    """A system with hinges that close, and stiffen as they do."""

    def left_to_close(self, q: Array, q_new: Array, lam: float) -> float:
        """Least part of its way to closed that a hinge is left with, of those that are about to close; 1 for none.

        Args:
            q: (n,) unknowns of the state before.
            q_new: (n,) unknowns of the state after.
            lam: load parameter of the step, 0 to 1.
        """
        ...

    def stops(self, q: Array, q_new: Array, lam: float) -> Stops:
        """Hinges that a step carries through closed, too near to it, or too far, and how far they may turn.

        Args:
            q: (n,) unknowns of the state before.
            q_new: (n,) unknowns behind the step.
            lam: load parameter of the step, 0 to 1.
        """
        ...

    def turning(self, q: Array, lam: float, hinges: NDArray[np.int64]) -> Array:
        """(k, n) derivatives of the dihedral angles of some hinges by the unknowns, rad / mm.

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
            hinges: (k,) which.
        """
        ...
