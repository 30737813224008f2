"""What the shell has computed at one place, and how large its forces are."""

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
    """

    q: Array
    lam: float
    components: Array
    x: Array
    forces: Array
    energy: float
    B: Array
    pull: Array


def root_mean_square(values: Array) -> float:
    """Root mean square, also of values whose squares overflow, which a wild trial step may have."""
    largest = float(np.abs(values).max(initial=0.0))
    if not 0.0 < largest < np.inf:
        return largest
    return largest * float(np.sqrt(np.mean((values / largest) ** 2)))
