"""The unit truss of Fig. 3.3: two chords, two verticals and a diagonal, against a plane-stress sheet with nu = 0.

Height H = 1, width W = 1 / alpha, E = t = 1; deflections are ratios truss / sheet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class UnitTruss:
    """Nodes 0 (0, 0), 1 (W, 0), 2 (W, H), 3 (0, H); left nodes 0 and 3 are pinned; the diagonal runs 0-2."""

    alpha: float
    diagonal_factor: float = 1.0

    def stiffness(self) -> Array:
        """(8, 8) stiffness matrix by Eq. 3.3, the diagonal times its factor."""
        W, H = 1.0 / self.alpha, 1.0
        points = np.array([[0.0, 0.0], [W, 0.0], [W, H], [0.0, H]])
        bars = {(0, 1): 0.5, (3, 2): 0.5, (0, 3): 0.5, (1, 2): 0.5, (0, 2): 1.0}  # share of the cell area W H
        K = np.zeros((8, 8))
        for (a, b), share in bars.items():
            d = points[b] - points[a]
            length = np.linalg.norm(d)
            k = share * W * H / length**2 * (self.diagonal_factor if (a, b) == (0, 2) else 1.0)
            row = np.zeros(8)
            row[2 * a : 2 * a + 2], row[2 * b : 2 * b + 2] = -d / length, d / length
            K += k * np.outer(row, row)
        return K

    def tension(self) -> float:
        """Elongation under a unit axial load shared by the right nodes, over that of the sheet, W / (E H t)."""
        free = [2, 3, 4, 5]
        u = np.linalg.solve(self.stiffness()[np.ix_(free, free)], [0.5, 0.0, 0.5, 0.0])
        return float(0.5 * (u[0] + u[2])) * self.alpha

    def shear_cantilever(self) -> float:
        """Deflection under a unit transverse load at the diagonal's free node, over the pure shear W / (G H t)."""
        free = [2, 3, 4, 5]
        u = np.linalg.solve(self.stiffness()[np.ix_(free, free)], [0.0, 0.0, 0.0, 1.0])
        return float(u[3]) / (2.0 / self.alpha)

    def shear_guided(self) -> float:
        """The same with the right nodes guided (transverse motion only), where only the diagonal works."""
        free = [3, 5]
        K = self.stiffness()[np.ix_(free, free)]
        return float(1.0 / K.sum()) / (2.0 / self.alpha)
