"""How deep strips reach into boxes that they are to stay out of: residuals, so that designs are moved out of them.

Strips are drawn as in `self_intersection.Swept`, for many designs at once and by the crease and both edges only.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bh.applications.inverse.forward import Forward

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
WIDTH = 5.0  # of either panel, mm
ROOM = 1.0  # mm that designs are moved away from a box
FINE, COARSE = 2.0, 8.0  # mm between points along the crease, for small and large boxes


def depths(surrogate: Forward, boxes: Array, k0: Array, length: Array, pinched: Bools) -> Array:
    """Of designs (N, n) in boxes (b, 2, 3): (N, 2 b) depths, mm, folded and pinched; 0 where a strip stays out.

    The depth of a strip is the root of the sum of squares of those of its points; that of a point is its distance from
    the nearest side, `ROOM` included.

    Args:
        surrogate: the model.
        boxes: their lowest and highest corners, mm.
        k0: (N, n) curvatures before folding, 1/mm.
        length: (N, n), mm.
        pinched: (N, n).
    """
    if not len(boxes):
        return np.zeros((len(k0), 0))
    apart = min(COARSE, max(FINE, 0.5 * float(np.ptp(boxes, axis=1).min())))
    found = []
    for on in (np.zeros_like(pinched), pinched):
        points = drawn(surrogate, k0, length, on, apart)[:, None]
        low, high = boxes[:, None, 0] - ROOM, boxes[:, None, 1] + ROOM
        inside = np.minimum(points - low, high - points).min(axis=-1)  # (N, b, m)
        found.append(np.sqrt((np.maximum(inside, 0.0) ** 2).sum(axis=-1)))
    return np.concatenate(found, axis=1)


def drawn(surrogate: Forward, k0: Array, length: Array, pinched: Bools, apart: float) -> Array:
    """(N, m, 3) points of the crease and of both edges of folded strips, mm.

    Args:
        surrogate: the model.
        k0: (N, n) curvatures before folding, 1/mm.
        length: (N, n), mm.
        pinched: (N, n).
        apart: largest distance between points along the crease, mm.
    """
    ends, frames = surrogate.forward(k0, length, pinched, check=False)
    count = max(2, math.ceil(0.5 * float(length.max()) / apart))
    s = 0.5 * length[..., None] * np.linspace(0.0, 1.0, count + 1)
    half = 0.5 * surrogate.setting.fold
    side = WIDTH * np.array([math.sin(half), -math.cos(half)])
    found = []
    # the first half of a segment goes on from its start, the second one leads back from its end, behind its pinch
    for at, sign in ((slice(None, -1), 1.0), (slice(1, None), -1.0)):
        t, r = surrogate.arc(np.broadcast_to(k0[..., None], s.shape), sign * s)
        turn = frames[:, at]
        crease = ends[:, at, None] + np.einsum("nkab,nkmb->nkma", turn, t)
        across, up = (np.einsum("nkab,nkmb->nkma", turn, r[..., i]) for i in (1, 2))
        found += [crease, *(crease + sign_y * side[0] * across + side[1] * up for sign_y in (1.0, -1.0))]
    return np.concatenate([each.reshape(len(k0), -1, 3) for each in found], axis=1)
