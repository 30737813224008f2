"""What the elements of the consistent formulation are asked for at one state: forces and energies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class ElementForces(NamedTuple):
    """Bar forces N (b,), N/mm; moments of patches M (c, a), spring creases S (h,) and locks L (m,), N mm."""

    N: Array
    M: Array
    S: Array
    L: Array


class Internal(NamedTuple):
    """Energies (N mm), their gradients to positions f (n, 3) and rotations r (r,), and element forces.

    `stretching` and `bending` are the whole, `springs` that of the springs and their couples,
    `lock` that of locks.
    `size` is a typical element force (N), `theta` (c, a) are the angles of the patches and `turns` (h,) what the
    springs have turned (rad).
    """

    stretching: float
    bending: float
    springs: float
    lock: float
    size: float
    f: Array
    r: Array
    forces: Array
    theta: Array
    turns: Array
