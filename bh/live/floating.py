"""Jaws that float: on a sheet that nothing else holds, both press alike, as two fingers do."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bh.live.controls import Controls
from bh.live.grips import Jaws

Array = NDArray[np.float64]
ALIKE = 0.01  # part of the larger force by which the two may differ
TOUCH = 1e-6  # of the sheet's size: jaws that give way by less do not press
ROUNDS = 25  # of moving the jaws for one wish, and no more
KEPT = 6  # rounds that are remembered
RANK = 1e-6  # of the largest singular value: smaller ones say nothing


class Floating:
    """Moves jaws between two equilibria until what they press together is all that acts on the sheet.

    Wanted are jaws on the line between their nodes, as far from one as from the other. Six numbers are the places of
    two jaws; their way there is Anderson's mixing of the last rounds (Anderson 1965; Walker and Ni 2011, Eq. 2.2).
    """

    def __init__(self) -> None:
        """Nothing was learnt yet."""
        self._rounds = 0
        self._known: dict[tuple[int, int], list[tuple[Array, Array]]] = {}

    def again(self) -> None:
        """Something else is wanted."""
        self._rounds = 0
        self._known.clear()

    def due(self, wanted: Controls, points: Array) -> bool:
        """Whether the jaws have to be moved.

        Args:
            wanted: what the sheet is in equilibrium with.
            points: (n, 3) of the state, mm.
        """
        return self._rounds < ROUNDS and any(_uneven(jaws, wanted, points) for jaws in wanted.jaws)

    def moved(self, wanted: Controls, points: Array) -> Controls:
        """Where the jaws should go; as they are where they press alike.

        Args:
            wanted: what the sheet is in equilibrium with.
            points: (n, 3) of the state, mm.
        """
        self._rounds += 1
        for jaws in [each for each in wanted.jaws if _uneven(each, wanted, points)]:
            gap = jaws.gap(wanted.grips)
            here, there = _places(jaws, gap), _places(jaws.on_line(points), gap)
            known = self._known.setdefault((jaws.a, jaws.b), [])
            known.append((here, there - here))
            del known[:-KEPT]
            ends = _mixed(known).reshape(2, 3)
            new = jaws.between(ends[0], ends[1])
            wanted = wanted.gripped(new.grips(gap), new)
        return wanted


def _places(jaws: Jaws, gap: float) -> Array:
    """(6,) of both jaws, at least a little apart, so that their direction is not lost."""
    half = 0.5 * max(gap, 1.0) * np.array(jaws.along)
    return np.concatenate((np.array(jaws.middle) - half, np.array(jaws.middle) + half))


def _mixed(known: list[tuple[Array, Array]]) -> Array:
    """(6,) the next places, from those of the last rounds and what each was off."""
    here, off = known[-1]
    if len(known) == 1:
        return here + off
    places, offs = (np.diff(np.array(each), axis=0).T for each in zip(*known, strict=True))
    parts = np.linalg.lstsq(offs, off, rcond=RANK)[0]
    return np.asarray(here + off - (places + offs) @ parts)


def _uneven(jaws: Jaws, wanted: Controls, points: Array) -> bool:
    """Whether the two forces differ by more than `ALIKE`, or do not lie on the line between the nodes."""
    one, two = (np.array(wanted.grips[node].to) - points[node] for node in (jaws.a, jaws.b))
    largest = max(float(np.linalg.norm(one)), float(np.linalg.norm(two)))
    size = float(np.ptp(points, axis=0).max())
    return largest > TOUCH * size and float(np.linalg.norm(one + two)) > ALIKE * largest
