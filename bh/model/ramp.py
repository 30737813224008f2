"""What a step does to a quantity: a value that goes linearly with the control parameter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Ramp:
    """A value that goes linearly from `start` to `end` while lambda runs from 0 to 1; both arrays of one shape."""

    start: Array
    end: Array

    def at(self, lam: float) -> Array:
        """The value at `lam`, of the shape of both ends.

        Returns:
            an array of the shape of both ends, linear in `lam` between them.
        """
        return (1.0 - lam) * self.start + lam * self.end

    @property
    def rate(self) -> Array:
        """Derivative by lambda, of the shape of both ends."""
        return self.end - self.start
