"""Where points of the crease between its ends are, by any model of folded and pinched strips."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bh.applications.inverse.forward import Forward
from bh.applications.inverse.self_intersection import Swept
from bh.applications.inverse.simulate import Simulated
from meshes.curves import arc_lengths

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]


def along(surrogate: Forward, k0: Array, length: Array, pinched: Bools, share: float) -> Array:
    """(N, 3) points of the creases of designs (N, n), mm.

    The first half of a segment goes on from its start, the second one leads back from its end, behind its pinch. So in
    the zone of a pinch, which is a point to the model, the crease is some millimetres beside.

    Args:
        surrogate: the model.
        k0: (N, n) curvatures before folding, 1/mm.
        length: (N, n), mm.
        pinched: (N, n).
        share: of the length of the crease, from 0 at its start to 1.
    """
    ends, frames = surrogate.forward(k0, length, pinched, check=False)
    knots = np.cumsum(length, axis=1)
    s = share * knots[:, -1:]
    at = np.minimum((knots <= s).sum(axis=1), length.shape[1] - 1)  # number of the segment
    rows = np.arange(len(k0))
    size = length[rows, at]
    inside = s[:, 0] - (knots[rows, at] - size)
    back = inside > 0.5 * size
    t, _ = surrogate.arc(k0[rows, at], np.where(back, inside - size, inside))
    start = at + back
    found: Array = ends[rows, start] + np.einsum("nab,nb->na", frames[rows, start], t)
    return found


def along_strip(strip: Simulated, share: float) -> Array:
    """(3,) a point of the crease of a simulated strip in the frame at its start, mm.

    Args:
        strip: folded and pinched.
        share: of the length of the crease, from 0 at its start to 1.
    """
    crease = strip.crease()
    place = share * (len(crease) - 1)
    i = min(int(place), len(crease) - 2)
    found: Array = crease[i] + (place - i) * (crease[i + 1] - crease[i])
    return found


def landed(
    surrogate: Forward, k0: Sequence[float], length: Sequence[float], pinched: Sequence[bool], end: Array
) -> Array:
    """(k, 3) points of the crease of one design, moved along its length so that it ends where its strip lands, mm.

    Args:
        surrogate: the model.
        k0: (n,) curvatures before folding, 1/mm.
        length: (n,), mm.
        pinched: (n,).
        end: (3,), mm.
    """
    points = Swept().crease(surrogate, np.asarray(k0), np.asarray(length), np.asarray(pinched))[0]
    s = arc_lengths(points)
    moved: Array = points + (s / s[-1])[:, None] * (end - points[-1])
    return moved
