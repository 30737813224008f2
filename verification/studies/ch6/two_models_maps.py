"""Single segments of a model of Chapter 6, folded and pinched, on the source's grid (Fig. 6.5 to 6.11)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.applications.inverse.forward import Forward

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
GRID = (81, 51)  # curvatures and lengths: the source's own


@dataclass(frozen=True, eq=False)
class Maps:
    """Ends of single segments on a grid of curvatures and lengths, nan outside the domain.

    Attributes:
        k0: (a, b), 1/mm.
        length: (a, b), mm.
        inside: (a, b) in the domain.
        folded: (a, b, 3) ends, mm.
        pinched: (a, b, 3), mm.
        folded_frames: (a, b, 3, 3).
        pinched_frames: (a, b, 3, 3).
    """

    k0: Array
    length: Array
    inside: Bools
    folded: Array
    pinched: Array
    folded_frames: Array
    pinched_frames: Array

    @property
    def moved(self) -> Array:
        """(a, b) how far pinches move ends, mm."""
        found: Array = np.linalg.norm(self.pinched - self.folded, axis=-1)
        return found


def segments(forward: Forward) -> Maps:
    """Single segments of a model, folded and pinched."""
    k0, length = np.meshgrid(
        np.linspace(-0.02, 0.02, GRID[0]), np.linspace(100.0, 300.0, GRID[1]), indexing="ij"
    )
    inside = np.asarray(forward.domain.holds(k0, length))
    one = (k0[..., None], length[..., None])
    there, frames = forward.forward(*one, np.ones((*k0.shape, 1), dtype=bool), check=False)
    before, flat = forward.unpinched(*one)
    parts = [np.where(inside[..., None], p[..., -1, :], np.nan) for p in (before, there)]
    turns = [np.where(inside[..., None, None], r[..., -1, :, :], np.nan) for r in (flat, frames)]
    return Maps(k0, length, inside, parts[0], parts[1], turns[0], turns[1])
