"""Small systems with exact solutions, for the driver alone: it knows nothing of sheets, so it can follow these too."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bh.solvers.matrices import SparseMatrix
from bh.solvers.outcome import Outcome
from bh.solvers.system import Evaluation, Tangent

Array = NDArray[np.float64]


class Silent:
    """The answers of a system that has nothing to say of its states."""

    def objection(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        """No step is too long."""
        del q, lam, q_new, lam_new
        return ""

    def control_stiffness(self, q: Array, lam: float) -> float:
        """Second derivative of the energy by lambda, N mm: the load is linear in it."""
        del q, lam
        return 0.0

    def penetration(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        """Nothing crosses."""
        del q, lam, q_new, lam_new
        return ""

    def obstacle(self, q: Array, lam: float) -> tuple[Outcome, str] | None:
        """Nothing is in the way."""
        del q, lam
        return None

    def describe(self, q: Array, lam: float, motion: Array) -> str:
        """What moves, in words."""
        del q, lam, motion
        return "the truss moves"


@dataclass(frozen=True)
class VonMisesTruss(Silent):
    """Two bars from (+-span, 0) to (0, rise), pushed down by lambda * force at the top, or through a spring there.

    Unknowns: deflection w of the top (mm, downwards); with a spring of stiffness `spring` also the displacement s of
    its other end, where the force acts. A soft spring turns the snap-through into a snap-back. Energy of a bar
    1/2 stiffness (l - L)^2.
    """

    rise: float = 1.0
    span: float = 2.0
    stiffness: float = 1.0
    force: float = 0.5
    spring: float | None = None

    rotation = 0.0
    energy_scale = 1.0

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return 1 if self.spring is None else 2

    @property
    def primal(self) -> int:
        """Number of displacements among the unknowns: all of them."""
        return self.size

    def load(self, w: Array | float) -> Array:
        """Exact lambda of an equilibrium with deflection w."""
        length = np.hypot(self.rise - np.asarray(w, dtype=float), self.span)
        rest = math.hypot(self.rise, self.span)
        return -2.0 * self.stiffness * (length - rest) * (self.rise - w) / length / self.force

    def limit(self) -> float:
        """Exact lambda of the limit point: the largest load before the truss snaps through."""
        rest = math.hypot(self.rise, self.span)
        # d load / d w = 0 where the length cubed is span^2 times the rest length
        length = (self.span**2 * rest) ** (1.0 / 3.0)
        return float(self.load(self.rise - math.sqrt(length**2 - self.span**2)))

    def evaluate(self, q: Array, lam: float) -> Evaluation:
        """Energy, residual and its size over the force, at deflections q (size,) in mm."""
        w = float(q[0])
        length, rest = math.hypot(self.rise - w, self.span), math.hypot(self.rise, self.span)
        energy = self.stiffness * (length - rest) ** 2
        pull = float(self.load(w)) * self.force
        if self.spring is None:
            energy -= self.force * lam * w
            residual = np.array([pull - self.force * lam])
        else:
            stretch = float(q[1]) - w
            energy += 0.5 * self.spring * stretch**2 - self.force * lam * float(q[1])
            residual = np.array([pull - self.spring * stretch, self.spring * stretch - self.force * lam])
        return Evaluation(energy, residual, float(np.abs(residual).max()) / self.force, np.zeros(0))

    def tangent(self, q: Array, lam: float, forces: Array) -> Tangent:
        """Stiffness (size, size) at q, N/mm."""
        del lam, forces
        height = self.rise - float(q[0])
        length, rest = math.hypot(height, self.span), math.hypot(self.rise, self.span)
        along = (height / length) ** 2
        k = 2.0 * self.stiffness * (along + (1.0 - rest / length) * (1.0 - along))
        c = self.spring
        K = np.array([[k]]) if c is None else np.array([[k + c, -c], [-c, c]])
        return Tangent(SparseMatrix.of(sp.csc_array(K)))

    def control_rate(self, q: Array, lam: float) -> Array:
        """Derivative of the residual with respect to lambda, (size,), N."""
        del q, lam
        rate = np.zeros(self.size)
        rate[-1] = -self.force
        return rate

    def power(self, q: Array, lam: float) -> float:
        """Derivative of the energy with respect to lambda, N mm."""
        del lam
        return -self.force * float(q[-1])
