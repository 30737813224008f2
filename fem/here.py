"""A state of the shell in the terms of its system, and the size of forces in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Here:
    """What has been computed at one (q, lambda).

    Attributes:
        q: (size,) unknowns.
        lam: how much of the step is applied.
        components: (k,) all components, see `Components`.
        x: (n, 3) positions of all nodes, mm.
        forces: (t, 6 m) forces conjugate to strains and curvatures.
        energy: potential, N mm.
        B: (t, 6 m, w) derivatives of strains and curvatures.
        pull: (t, 3 n + 3 r) element forces by positions and side rotations.
        contact: energy of panels that press on each other, N mm; inf where they cannot be.
        pressed: (n, 3) its gradient, N; None without contact.
    """

    q: Array
    lam: float
    components: Array
    x: Array
    forces: Array
    energy: float
    B: Array
    pull: Array
    contact: float = 0.0
    pressed: Array | None = None


def root_mean_square(values: Array) -> float:
    """Root mean square, also of values whose squares overflow, which a wild trial step may have."""
    largest = float(np.abs(values).max(initial=0.0))
    if not 0.0 < largest < np.inf:
        return largest
    return largest * float(np.sqrt(np.mean((values / largest) ** 2)))


def out_of_balance(residual: Array, inner: Array, outer: float, floor: float) -> float:
    """Largest residual over the size of the forces that it is made of; 0 where it is rounding.

    Args:
        residual: of forces, or of couples.
        inner: element forces.
        outer: largest force from outside.
        floor: of rounding.
    """
    largest = float(np.abs(residual).max(initial=0.0)) - floor
    return largest / max(root_mean_square(inner), outer, 1e-300) if largest > 0.0 else 0.0
