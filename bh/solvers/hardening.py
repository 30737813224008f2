"""Barriers that are harder for a while than those of the model, where a sheet that moves to rest would creep.

What presses on each other with much force rests in the innermost part of the barrier. A step sideways of size s changes
a distance by s^2 / 2R, with R some length of the mesh, so a whole step of Newton's method leads through a pair that has
less room than that left, and all steps are as short as the root of that room. It grows with the stiffness of the
barrier. So the sheet moves with a harder barrier where steps are cut short again and again while a pair has hardly
any room; once it is at rest the barrier is made softer, down to that of the model, with hardly any way left to go.
That is the order of interior-point methods (Nocedal and Wright 2006, 19.3), which Li et al. (2020) leave to a stiffness
that adapts; here the state that is found is one of the model as it was.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from bh.solvers.system import Hindered, System

Array = NDArray[np.float64]
ROOM = 0.05  # of the reach: a pair with less presses too hard for steps of any length
SHORT = 0.2  # of a step that is taken of one that is cut short
SOON = 3  # such steps in a row, behind which the barrier is made harder
HARDER = 30.0  # times at once
HARDEST = 1e6  # times the model's own


class Hardening:
    """How much harder the barriers of a system are than the model's, in the course of one motion to rest."""

    def __init__(self, system: System) -> None:
        """Nothing is harder.

        Args:
            system: that moves; one that nothing stands in the way of is left alone.
        """
        self._system = system if isinstance(system, Hindered) and system.hindered else None
        self._factor, self._short, self._eased = 1.0, 0, False

    def mind(self, q: Array, lam: float, wanted: Array, taken: Array) -> bool:
        """Look at a step; whether the barriers have become harder for it, so that energies are others.

        Args:
            q: (n,) unknowns behind the step.
            lam: load parameter of the step, 0 to 1.
            wanted: (n,) the whole step.
            taken: (n,) what was taken of it.
        """
        if self._system is None or self._eased or self._factor >= HARDEST:
            return False
        if _size(taken) >= SHORT * _size(wanted):
            self._short = 0
            return False
        self._short += 1
        if self._short < SOON or self._system.room(q, lam) > ROOM:
            return False
        self._set(min(HARDER * self._factor, HARDEST))
        return True

    def ease(self) -> bool:
        """The sheet is at rest; whether the barriers have become softer for it, so that it is not."""
        if self._factor == 1.0:
            return False
        self._eased = True
        self._set(max(self._factor / HARDER, 1.0))
        return True

    @contextmanager
    def own(self) -> Iterator[None]:
        """While it lasts barriers are those of the model: others look at the system between two steps."""
        if self._system is None or self._factor == 1.0:
            yield
            return
        self._system.harden(1.0)
        try:
            yield
        finally:
            self._system.harden(self._factor)

    def end(self) -> None:
        """The motion is over, wherever it has led; barriers are those of the model."""
        if self._factor != 1.0:
            self._set(1.0)

    def _set(self, factor: float) -> None:
        assert self._system is not None
        self._factor, self._short = factor, 0
        self._system.harden(factor)


def _size(step: Array) -> float:
    return float(np.abs(step).max(initial=0.0))
