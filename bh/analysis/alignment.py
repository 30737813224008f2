"""How far apart two deformed curves are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def aligned(points: Array, onto: Array) -> tuple[Array, Rotation, Array]:
    """The points (n, 3) moved rigidly onto as many others in the sense of least squares (Kabsch 1976).

    Args:
        points: (n, 3) to be moved.
        onto: (n, 3) where they should lie.

    Returns:
        the moved points, the rotation R and the shift s: moved = R points + s. A proper rotation: no reflection.
    """
    centre, other = points.mean(axis=0), onto.mean(axis=0)
    turn, _ = Rotation.align_vectors(onto - other, points - centre)
    shift = other - turn.apply(centre)
    return turn.apply(points) + shift, turn, shift


def hausdorff(one: Array, two: Array, dense: int = 8) -> float:
    """Hausdorff distance of two polylines (n, 3) and (m, 3): how far a point of either is at most from the other.

    Each is measured at its corners and at `dense` - 1 points between them, from the other's segments exactly.

    Args:
        one: (n, 3) corners of a polyline.
        two: (m, 3) of another.
        dense: parts that each segment is measured in.
    """
    return max(_farthest(_resampled(one, dense), two), _farthest(_resampled(two, dense), one))


def _resampled(line: Array, dense: int) -> Array:
    s = np.linspace(0.0, 1.0, dense, endpoint=False)[None, :, None]
    between = (1.0 - s) * line[:-1, None] + s * line[1:, None]
    return np.vstack((between.reshape(-1, 3), line[-1:]))


def _farthest(points: Array, line: Array) -> float:
    """Largest distance of points (n, 3) from the segments of a polyline (m, 3)."""
    start, along = line[:-1], np.diff(line, axis=0)
    out = points[:, None] - start
    s = np.clip(np.einsum("nmc,mc->nm", out, along) / np.einsum("mc,mc->m", along, along), 0.0, 1.0)
    distance = np.linalg.norm(out - s[:, :, None] * along, axis=2)
    return float(distance.min(axis=1).max())
