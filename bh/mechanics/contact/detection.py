"""What can meet, and what is reached from where: pairs that are kept while little moves, and positions that are linked.

Two positions of a sheet are linked where nothing passes through anything on the straight way between them. A chain of
links is a motion in which nothing passes through anything; it is what every accepted state is asked for.
"""

from __future__ import annotations

from collections import deque

import ipctk
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
KEPT = 40  # positions that are known to be linked with the state that the step began with
ROUNDING = 1e-13  # of coordinates
STEPS = 300  # of detection, for one pair; of a way that takes more, the part that is known to be free
WAYS = 4  # straight ways that were looked at last
TRIED = 2  # of these, from which a straight way is looked for, the last one first
LOOKS = 4  # more, from where detection has stopped
FAR = 20.0  # slacks; no way so long is looked at on the off-chance, since it crosses very many pairs


class Detection:
    """Pairs near each other and continuous collision detection; positions x are (n, 3), mm."""

    def __init__(self, mesh: ipctk.CollisionMesh, least: float, most: float, slack: float) -> None:
        """Nothing is looked for yet.

        Args:
            mesh: what collides.
            least: distance that no pair may be nearer than, mm.
            most: distance up to which pairs are wanted, mm.
            slack: motion of a node, mm, for which pairs are kept.
        """
        self.mesh, self.least, self.most = mesh, least, most
        self.searches = self.looks = 0  # for pairs in the whole mesh; at single pairs
        self._slack = slack
        self._found: tuple[Array, ipctk.Candidates] | None = None
        self._linked: deque[Array] = deque(maxlen=KEPT)
        self._marks: deque[int] = deque(
            maxlen=KEPT
        )  # of the linked ones, which tell most others apart at once
        self._ways: deque[tuple[Array, Array, float]] = deque(maxlen=WAYS)
        # additive detection (Li, Kaufman and Jiang 2021): root finders take seconds where edges move in one plane
        self._method = ipctk.AdditiveCCD(STEPS)

    def candidates(self, x: Array) -> ipctk.Candidates:
        """Pairs that may be within `most` at x, and more.

        Args:
            x: (nodes, 3) positions, mm.
        """
        if self._found is None or _moved(self._found[0], x) > self._slack:
            near = ipctk.Candidates()
            near.build(self.mesh, x, 0.5 * self.most + self._slack)
            self.searches += 1
            self._found = (x.copy(), near)
        return self._found[1]

    def free_part(self, x: Array, moved: Array, least: float | None = None) -> float:
        """How much of the straight way from x to `moved` no pair comes nearer than `least`, 0 to 1.

        Args:
            x: (nodes, 3) positions, mm, with nothing passing through anything.
            moved: (nodes, 3) positions, mm.
            least: mm, `most` at most; the one that no pair may be nearer than unless given.
        """
        within = self.least if least is None else least
        if within == self.least and any(
            part >= 1.0 and np.array_equal(x, begin) and np.array_equal(moved - x, way)
            for begin, way, part in self._ways
        ):
            return 1.0
        part = self._free_part(x, moved, within)
        if within >= self.least and self._known(x):
            self._ways.append((x.copy(), moved - x, part))
        return part

    def _free_part(self, x: Array, moved: Array, within: float) -> float:
        """Detection stops at a tenth of a distance at once; what comes nearer than that is not yet in the way."""
        near = self._on_the_way(x, moved, within)  # also of the rest of the way

        first = part = self._seen_free(near, x, moved, within)
        for _ in range(LOOKS):
            if part >= 1.0 or first <= 0.0:
                return part
            part += (1.0 - part) * self._seen_free(near, x + part * (moved - x), moved, within)
        return first if part < 1.0 else 1.0

    def _seen_free(self, near: ipctk.Candidates, x: Array, moved: Array, within: float) -> float:
        self.looks += len(near)
        return float(near.compute_collision_free_stepsize(self.mesh, x, moved, within, self._method))

    def _on_the_way(self, x: Array, moved: Array, within: float) -> ipctk.Candidates:
        """Pairs that may come within a distance on the straight way from x to `moved`, and more."""
        if _moved(x, moved) > self._slack:
            near = ipctk.Candidates()
            near.build(self.mesh, x, moved, 0.5 * within)
            self.searches += 1
            return near
        near = self.candidates(x)
        assert self._found is not None
        if _moved(self._found[0], moved) > self._slack:
            self._found = None
            near = self.candidates(0.5 * (x + moved))
        return near

    def begin(self, x: Array) -> None:
        """Forget all links; x, with nothing passing through anything, is what others are linked with from now on.

        Args:
            x: (nodes, 3) positions, mm.
        """
        self._linked.clear()
        self._marks.clear()
        self._ways.clear()
        self._keep(x)

    def go_back(self, x: Array) -> None:
        """Take x, an accepted state, for the one that others are linked with, unless it is among those that are known.

        Args:
            x: (nodes, 3) positions, mm.
        """
        if not self._known(x):
            self.begin(x)

    def linked(self, x: Array) -> bool:
        """Is there a motion to x, from where the links begin, in which nothing passes through anything? If so, keep x.

        False means that none was found.

        Args:
            x: (nodes, 3) positions, mm.
        """
        if self._known(x):
            return True
        if not any(self._on(x, *way) for way in self._ways):
            for known in list(self._linked)[: -TRIED - 1 : -1]:
                if _moved(known, x) < FAR * self._slack and self._free_part(known, x, self.least) >= 1.0:
                    break
            else:
                return False
        self._keep(x)
        return True

    def _keep(self, x: Array) -> None:
        self._linked.append(x.copy())
        self._marks.append(hash(x.tobytes()))

    def _known(self, x: Array) -> bool:
        mark = hash(x.tobytes())
        return any(
            mark == other and np.array_equal(x, known)
            for other, known in zip(self._marks, self._linked, strict=True)
        )

    @staticmethod
    def _on(x: Array, begin: Array, way: Array, part: float) -> bool:
        """Does x lie on the first `part` of a straight way, but for rounding?"""
        size = float(np.vdot(way, way))
        if size == 0.0:
            return False
        at = float(np.vdot(x - begin, way)) / size
        off = float(np.abs(x - begin - at * way).max())
        return 0.0 <= at <= part and off <= ROUNDING * float(np.abs(x).max())


def _moved(x: Array, y: Array) -> float:
    """Longest way of a node, mm."""
    way = y - x
    return float(np.sqrt(np.einsum("nk,nk->n", way, way).max()))
