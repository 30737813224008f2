"""Tethers: what stands for supports that a step lets go of, and grows softer until nothing is left of them.

An unknown that was held is tied to a place a little beyond its own, so far that the tether pulls just as the support
did. Its stiffness falls by as many powers of ten as lie between a support and a sheet that hardly resists, and is
nothing at the end of the step:

    E = 1/2 s(lambda) sum k (q - a)^2,   a = q_0 - f / k,   s = (exp(-c lambda) - exp(-c)) / (1 - exp(-c)),

f being the force of the support on the sheet along q. Dead forces f that fade would do the same for a sheet that is
stable under them; one that was folded through a clamp is not (docs/decisions.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bh.solvers.matrices import Storage
from meshes.topology import Ints

Array = NDArray[np.float64]
STRETCH = 0.01  # of the largest tether where the step begins: in edges of the mesh, and rad
FADING = 18.0  # c: seven to eight powers of ten
NOTHING = 1e-6  # part of the largest force, below which an unknown was not held


@dataclass(frozen=True, eq=False)
class Tethers:
    """Springs on some of the unknowns of a step.

    Attributes:
        unknowns: (k,) which.
        stiffness: (k,) at the beginning of the step, N / mm, and N mm / rad on rotations.
        anchor: (k,) where each would pull no more, mm or rad.
        begin: (size,) all unknowns where the step begins.
    """

    unknowns: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    stiffness: Array = field(default_factory=lambda: np.zeros(0))
    anchor: Array = field(default_factory=lambda: np.zeros(0))
    begin: Array = field(default_factory=lambda: np.zeros(0))

    def __bool__(self) -> bool:
        """Are there any?"""
        return len(self.unknowns) > 0

    def push(self, q: Array, lam: float, gradient: Array) -> float:
        """Energy, N mm, where unknowns are q (size,); its gradient is added to `gradient`, (size,) or primal ones only.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
            gradient: added to.
        """
        if not self:
            return 0.0
        stretch = q[self.unknowns] - self.anchor
        pull = left(lam) * self.stiffness * stretch
        gradient[self.unknowns] += pull
        return 0.5 * float(pull @ stretch)

    def stiffen(self, lam: float, data: Array, storage: Storage) -> None:
        """Adds the tangent to the values `data` of a matrix.

        Args:
            lam: load parameter of the step, 0 to 1.
            data: values; added to.
            storage: where the matrix has them.
        """
        if self:
            data[storage.diagonal(self.unknowns)] += left(lam) * self.stiffness

    def rates(self, q: Array, lam: float, out: Array) -> Array:
        """Adds the rate of the gradient with lambda at fixed unknowns q (size,) to `out`, and returns it.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
            out: added to.
        """
        if self:
            out[self.unknowns] += left(lam, 1) * self.stiffness * (q[self.unknowns] - self.anchor)
        return out

    def power(self, q: Array, lam: float) -> float:
        """Rate of the energy with lambda at fixed unknowns q (size,), N mm.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        return left(lam, 1) * self._whole(q) if self else 0.0

    def second(self, q: Array, lam: float) -> float:
        """Second derivative of the energy by lambda at fixed unknowns q (size,), N mm.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        return left(lam, 2) * self._whole(q) if self else 0.0

    def _whole(self, q: Array) -> float:
        """Energy with nothing of the stiffness gone, N mm."""
        return 0.5 * float(self.stiffness @ (q[self.unknowns] - self.anchor) ** 2)


NONE = Tethers()


def left(lam: float, order: int = 0) -> float:
    """What is left of the stiffness of tethers, from 1 to 0, or a derivative of it.

    Args:
        lam: load parameter of the step, 0 to 1.
        order: of the derivative by lambda.
    """
    end = math.exp(-FADING)
    value = (-FADING) ** order * math.exp(-FADING * lam)
    return (value - end if order == 0 else value) / (1.0 - end)


def tethers(begin: Array, pull: Array, moving: int, areas: Array) -> Tethers:
    """Tethers that keep a sheet in balance whose supports are let go of.

    Args:
        begin: (size,) unknowns where the step begins.
        pull: (k,) derivative of the energy by the first k unknowns there, without what the supports exerted: N for
            displacements, N mm for rotations.
        moving: how many unknowns are displacements; they come first.
        areas: (t,) of the triangles, mm^2, for the length of an edge.
    """
    stiffness, edge = np.zeros(len(pull)), math.sqrt(2.0 * float(areas.mean()))
    for part, stretch in ((slice(0, moving), STRETCH * edge), (slice(moving, None), STRETCH)):
        force = np.abs(pull[part])
        largest = float(force.max(initial=0.0))
        stiffness[part] = np.where(force > NOTHING * largest, largest / stretch, 0.0)
    held = np.flatnonzero(stiffness)
    return Tethers(held, stiffness[held], begin[held] + pull[held] / stiffness[held], begin)
