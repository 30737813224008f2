"""What is to be shown of a sheet under a hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.formulations.state import State
from bh.live.controls import Controls
from bh.live.grips import Jaws, Vector

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Frame:
    """What is to be shown of a sheet under a hand: always a state in equilibrium.

    Attributes:
        state: the newest equilibrium.
        controls: what it is in equilibrium with, and `wanted` what was asked for.
        forces: (3,) of every grip on the sheet, N, by its node.
        snapped: the sheet has left its branch since the frame before.
        note: why it cannot go on to what is wanted, or an empty string.
        iterations: of Newton's method in all so far.
        seconds: that the update took.
        fading: what has pulled until now still does, a part of it, or jaws do not press alike yet.
        looked: whether the state's stability has been looked at, which one that is passed on the way is not.
    """

    state: State
    controls: Controls
    wanted: Controls
    forces: Mapping[int, Vector]
    snapped: bool
    note: str
    iterations: int
    seconds: float
    fading: bool = False
    looked: bool = True

    @property
    def at_rest(self) -> bool:
        """Whether this is the equilibrium of what is wanted, and a stable one."""
        return self.arrived and self.looked

    @property
    def arrived(self) -> bool:
        """Whether this is the equilibrium of what is wanted; its stability may not have been looked at."""
        return self.controls == self.wanted and not self.fading

    @property
    def points(self) -> Array:
        """(n, 3) node positions, mm."""
        return self.state.points

    def pinches(self) -> dict[Jaws, float]:
        """Pinches that are at work.

        Returns:
            the force by which each presses its two nodes together, N.
        """
        grips = self.controls.grips
        return {
            jaws: jaws.force(grips, self.points)
            for jaws in self.wanted.jaws
            if jaws.a in grips and jaws.b in grips
        }

    def fold_angles(self) -> dict[str, float]:
        """Mean fold angle of every crease that is handled.

        Returns:
            rad by name, positive the way that the crease is drawn.
        """
        mesh = self.state.mesh
        return {
            name: mesh.sense(name) * float(self.state.fold_angle(name).mean()) for name in self.controls.folds
        }
