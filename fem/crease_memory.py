"""What a step of the shell remembers of creases that yield; see `fem.crease_laws`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fem.components import Components
from fem.creases import Connectors

Array = NDArray[np.float64]


class CreaseMemory:
    """The part of a shell's system that remembers; see `bh.solvers.system.Remembering`."""

    creases: Connectors
    components: Components

    @property
    def remembers(self) -> bool:
        """Does a crease yield?"""
        return self.creases.laws is not None and self.creases.laws.remembers

    @property
    def history(self) -> Array:
        """(m p, 2) of the points of creases as they were accepted last, rad."""
        return np.zeros((0, 2)) if self.creases.laws is None else self.creases.laws.history

    def remember(self, history: Array) -> None:
        """Go on from a history (m p, 2).

        Args:
            history: as `history_at` gives it.
        """
        if self.creases.laws is not None:
            self.creases.laws.history = history

    def takes(self, history: Array) -> bool:
        """Can it go on from a history that was read from a file?

        Args:
            history: of any shape.

        Returns:
            whether it is one of this system.
        """
        return history.shape == self.history.shape

    def history_at(self, q: Array, lam: float) -> Array:
        """(m p, 2) what creases remember where this state is accepted.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        assert self.creases.laws is not None
        beta = self.components.beta(self.components.whole(q, lam))
        return self.creases.laws.accepted(beta - self.creases.rest.at(lam))
