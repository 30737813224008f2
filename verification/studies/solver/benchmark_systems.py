"""Small systems with exact solutions, for the driver alone: it knows nothing of sheets, so it can follow these too."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bh.solvers.matrices import SparseMatrix
from bh.solvers.system import Evaluation

Array = NDArray[np.float64]


class Silent:
    """The answers of a system that has nothing to say of its states."""

    def objection(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        return ""

    def crossing(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        return ""

    def obstacle(self, q: Array, lam: float) -> tuple[str, str]:
        return "", ""

    def describe(self, q: Array, lam: float, motion: Array) -> str:
        return "the toy moves"


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
        return 1 if self.spring is None else 2

    @property
    def primal(self) -> int:
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

    def tangent(self, q: Array, lam: float, forces: Array) -> SparseMatrix:
        height = self.rise - float(q[0])
        length, rest = math.hypot(height, self.span), math.hypot(self.rise, self.span)
        along = (height / length) ** 2
        k = 2.0 * self.stiffness * (along + (1.0 - rest / length) * (1.0 - along))
        c = self.spring
        K = np.array([[k]]) if c is None else np.array([[k + c, -c], [-c, c]])
        return SparseMatrix.of(sp.csc_array(K))

    def predicted_forces(self, forces: Array, dq: Array) -> Array:
        return forces

    def control_rate(self, q: Array, lam: float) -> Array:
        rate = np.zeros(self.size)
        rate[-1] = -self.force
        return rate

    def power(self, q: Array, lam: float) -> float:
        return -self.force * float(q[-1])
