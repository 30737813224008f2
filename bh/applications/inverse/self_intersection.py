"""Does a design meet itself? Projected on the plane as the source does (6.3.1), or with its strips in space."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.applications.inverse.forward import Forward

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]


class SelfIntersectionRule(Protocol):
    """A rule that forbids designs."""

    def measure(self, surrogate: Forward, k0: Array, length: Array, pinched: Bools) -> Array:
        """(...) of designs (..., n).

        Args:
            surrogate: of the segments.
            k0: (..., n) curvatures before folding, 1/mm.
            length: (..., n), mm.
            pinched: (..., n).

        Returns:
            (...), 0 where a design is allowed, positive where it is not.
        """
        ...


def planar(points: ArrayLike) -> Bools:
    """Whether polygons intersect themselves: (...) of (..., n + 1, 2) vertices.

    Two segments cross if the ends of each lie on different sides of the other. Touching is allowed, so that a crease
    may end where it begins; a segment that goes straight back over the one before is not.
    """
    p = np.asarray(points, dtype=float)
    a, b = p[..., :-1, :], p[..., 1:, :]
    n = a.shape[-2]
    met = np.zeros(p.shape[:-2], dtype=bool)
    for i in range(n):
        for j in range(i + 2, n):
            met |= _crosses(a[..., i, :], b[..., i, :], a[..., j, :], b[..., j, :])
    for i in range(n - 1):  # neighbours: only where the second goes straight back over the first
        u, v = b[..., i, :] - a[..., i, :], b[..., i + 1, :] - a[..., i + 1, :]
        size = np.linalg.norm(u, axis=-1) * np.linalg.norm(v, axis=-1)
        met |= (np.abs(_cross(u, v)) <= 1e-12 * size) & ((u * v).sum(axis=-1) < 0.0)
    return met


def _crosses(a: Array, b: Array, c: Array, d: Array) -> Bools:
    """Do the segments ab and cd cross inside both? (..., 2) each."""
    sides = _cross(b - a, c - a) * _cross(b - a, d - a), _cross(d - c, a - c) * _cross(d - c, b - c)
    return np.asarray((sides[0] < 0.0) & (sides[1] < 0.0))


def _cross(u: Array, v: Array) -> Array:
    found: Array = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    return found


class Projected:
    """The source's rule: translation vectors, projected on the xy plane, must not cross, flat, folded or pinched.

    It forbids helices, and it knows nothing of the width of the strip or of the bulge of an arc over its chord.
    """

    def measure(self, surrogate: Forward, k0: Array, length: Array, pinched: Bools) -> Array:
        """(...) 1 where the chords of a design intersect in the plane, else 0; see the rule's protocol."""
        met = planar(surrogate.forward(k0, length, pinched, check=False)[0][..., :2])
        met |= planar(surrogate.unpinched(k0, length)[0][..., :2])
        return met.astype(float)


class Swept:
    """The strips themselves: panels of triangles along the folded crease in space, and the outline of the flat sheet.

    A pinched segment is drawn as two arcs with the pinch between them: to either side of the zone the crease is the
    folded arc. Panels that pass through one another, other than neighbours, are forbidden; passing above or below is
    not, so helices are found. The flat sheet has to be cut out of one piece: its outline must not cross itself.

    Attributes:
        width: of either panel, mm.
        cell: length of the drawn panels along the crease, mm.
    """

    def __init__(self, width: float = 5.0, cell: float = 5.0) -> None:
        """Set width and cell, mm."""
        self.width, self.cell = width, cell

    def measure(self, surrogate: Forward, k0: Array, length: Array, pinched: Bools) -> Array:
        """(...) 1 where the strips of a design intersect themselves, else 0; see the rule's protocol."""
        k0, length, on = (np.asarray(x) for x in np.broadcast_arrays(k0, length, pinched))
        found = np.empty(k0.shape[:-1])
        for at in np.ndindex(found.shape):
            found[at] = float(self.meets(surrogate, k0[at], length[at], on[at]))
        return found

    def meets(self, surrogate: Forward, k0: Array, length: Array, pinched: Bools) -> bool:
        """Whether one design, (n,) each, meets itself, flat, folded or pinched.

        Args:
            surrogate: of the segments.
            k0: (n,) curvatures before folding, 1/mm.
            length: (n,), mm.
            pinched: (n,).
        """
        from bh.analysis.contact import candidates
        from bh.analysis.triangles import intersecting

        if not self.flat_is_simple(k0, length):
            return True
        for on in (np.zeros(len(k0), dtype=bool), pinched):
            points, triangles, cell = self.strip(surrogate, k0, length, on)
            pairs = candidates(points, triangles)
            # panels next to each other touch at their joint; across a tight pinch the second next ones do
            far = (
                np.abs(cell[pairs[:, 0]] - cell[pairs[:, 1]])
                > math.ceil(0.5 * surrogate.setting.zone / self.cell) + 1
            )
            if far.any() and len(intersecting(points, triangles, pairs[far], 1e-9)):
                return True
        return False

    def flat_is_simple(self, k0: ArrayLike, length: ArrayLike) -> bool:
        """Whether the flat strip of one design, (n,) each, can be cut out of one sheet.

        Args:
            k0: (n,) curvatures before folding, 1/mm.
            length: (n,), mm.
        """
        from meshes import PatternError, parallel_creases

        try:
            parallel_creases(list(np.asarray(k0)), list(np.asarray(length)), self.width)
        except PatternError:
            return False
        return True

    def strip(
        self, surrogate: Forward, k0: Array, length: Array, pinched: Bools
    ) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
        """Points (m, 3), triangles (t, 3) and the number (t,) of the cell along the crease that each belongs to.

        Args:
            surrogate: of the segments.
            k0: (n,) curvatures before folding, 1/mm.
            length: (n,), mm.
            pinched: (n,).
        """
        points, frames = self.crease(surrogate, k0, length, pinched)
        half = 0.5 * surrogate.setting.fold
        down, out = self.width * math.cos(half), self.width * math.sin(half)
        left = points + out * frames[:, :, 1] - down * frames[:, :, 2]
        right = points - out * frames[:, :, 1] - down * frames[:, :, 2]
        n = len(points)
        i = np.arange(n - 1)
        sides = (
            (i, i + 1, n + i),
            (i + 1, n + i + 1, n + i),
            (2 * n + i, 2 * n + i + 1, i),
            (2 * n + i + 1, i + 1, i),
        )
        triangles = np.vstack([np.column_stack(corners) for corners in sides])  # left panel, right panel
        return np.vstack((points, left, right)), triangles, np.tile(i, 4)

    def crease(self, surrogate: Forward, k0: Array, length: Array, pinched: Bools) -> tuple[Array, Array]:
        """(m, 3) points and (m, 3, 3) frames along the whole crease, one a cell.

        Args:
            surrogate: of the segments.
            k0: (n,) curvatures before folding, 1/mm.
            length: (n,), mm.
            pinched: (n,).
        """
        ends, starts = surrogate.forward(k0, length, pinched, check=False)
        points, frames = [ends[:1]], [starts[:1]]
        for i, (k, size) in enumerate(zip(k0, length, strict=True)):
            cells = 2 * max(1, round(0.5 * size / self.cell))
            s = size * np.arange(1, cells + 1) / cells
            t, r = surrogate.arc(np.full(cells, k), s)
            # the second half is the arc that ends where the segment ends, behind a pinch if there is one
            back_t, back_r = surrogate.arc(np.full(cells, k), s - size)
            last = starts[i].T @ starts[i + 1]
            end = starts[i].T @ (ends[i + 1] - ends[i])
            behind = s > 0.5 * size
            t[behind] = end + back_t[behind] @ last.T
            r[behind] = last @ back_r[behind]
            points.append(ends[i] + t @ starts[i].T)
            frames.append(starts[i] @ r)
        return np.concatenate(points), np.concatenate(frames)


def allowed(
    rules: Sequence[SelfIntersectionRule], surrogate: Forward, k0: Array, length: Array, pinched: Bools
) -> Array:
    """(...) sum of the measures of some rules, 0 where a design is allowed.

    Args:
        rules: what is forbidden.
        surrogate: of the segments.
        k0: (..., n) curvatures before folding, 1/mm.
        length: (..., n), mm.
        pinched: (..., n).

    Returns:
        not negative.
    """
    total: Array = np.zeros(np.shape(k0)[:-1])
    for rule in rules:
        total = total + rule.measure(surrogate, k0, length, pinched)
    return total
