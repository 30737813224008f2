"""Bars and hinges once more: dense, slow and independent, as a referee for limit points of given assemblages.

Written from Liu and Paulino (2017), Proc. R. Soc. A 473:20170348, and shares nothing with `bh`: gradients of the
dihedral angle in Bridson's form (Bridson, Marino and Fedkiw 2003), Hessians by the complex step (Squire and Trapp
1998), dense matrices, and the modified generalised displacement control of Leon et al. (2014). Two sets of laws:

- "quadratic": 1/2 EA / L (l - L)^2 a bar and 1/2 k L (phi - phi_0)^2 a hinge, the laws of `bh`;
- "published": Ogden bars, force EA (s^4 - 1) / 4 at stretch s (their section 2.1 with alpha = 5 and 1), and hinges that
  stiffen like a tangent outside `linear` (their section 2.2).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Law = Literal["quadratic", "published"]


def _cross(a: NDArray, b: NDArray) -> NDArray:
    return np.stack([a[..., (i + 1) % 3] * b[..., (i + 2) % 3] - a[..., (i + 2) % 3] * b[..., (i + 1) % 3]
                     for i in range(3)], axis=-1)  # fmt: skip


def _dot(a: NDArray, b: NDArray) -> NDArray:
    return np.sum(a * b, axis=-1, keepdims=True)


def hinge_gradients(x: NDArray) -> NDArray:
    """(m, 4, 3) gradients of dihedral angles; corners (m, 4, 3) are edge, edge, wing, wing, and may be complex."""
    j, k, a, b = (x[:, i] for i in range(4))
    e = k - j
    n1, n2 = _cross(a - j, a - k), _cross(b - k, b - j)
    length = np.sqrt(_dot(e, e))
    p, q = n1 / _dot(n1, n1), n2 / _dot(n2, n2)
    at_j = (_dot(a - k, e) * p + _dot(b - k, e) * q) / length
    at_k = -(_dot(a - j, e) * p + _dot(b - j, e) * q) / length
    return np.stack((at_j, at_k, length * p, length * q), axis=1)


def hinge_angles(x: Array) -> Array:
    """(m,) dihedral angles in [0, 2 pi), flat is pi; corners as in `hinge_gradients`."""
    j, k, a, b = (x[:, i] for i in range(4))
    e = k - j
    n1, n2 = _cross(a - j, a - k), _cross(b - k, b - j)
    sine = np.sum(_cross(n1, n2) * e, axis=-1) / np.linalg.norm(e, axis=-1)
    return np.asarray(np.mod(math.pi - np.arctan2(sine, np.sum(n1 * n2, axis=-1)), 2.0 * math.pi))


@dataclass(frozen=True, eq=False)
class DenseOrigami:
    """Bars and hinges under a dead load lambda times `load`.

    Attributes:
        points: (n, 3) stress-free nodes; bars: (b, 2); EA: axial stiffness of every bar, N.
        hinges: (m, 4) rows (edge, edge, wing, wing); hinge_stiffness: (m,) a length of edge, N mm / (mm rad).
        held: (n, 3) True where a node cannot move; load: (n, 3) N at lambda = 1.
        linear: angles between which published hinges are linear, rad.
    """

    points: Array
    bars: Ints
    EA: float
    hinges: Ints
    hinge_stiffness: Array
    held: NDArray[np.bool_]
    load: Array
    law: Law = "quadratic"
    linear: tuple[float, float] = (0.0, 2.0 * math.pi)

    @cached_property
    def _rest(self) -> tuple[Array, Array, Array]:
        """Lengths of the bars, lengths of the hinge edges and dihedral angles, all stress-free."""
        d = self.points[self.bars[:, 1]] - self.points[self.bars[:, 0]]
        e = self.points[self.hinges[:, 1]] - self.points[self.hinges[:, 0]]
        return np.linalg.norm(d, axis=1), np.linalg.norm(e, axis=1), hinge_angles(self.points[self.hinges])

    def _bar_law(self, stretch: Array) -> tuple[Array, Array]:
        """Axial force and its derivative with respect to the stretch, N."""
        if self.law == "quadratic":
            return self.EA * (stretch - 1.0), self.EA * np.ones_like(stretch)
        return 0.25 * self.EA * (stretch**4 - 1.0), self.EA * stretch**3

    def _hinge_law(self, phi: Array) -> tuple[Array, Array]:
        """Moment (N mm) and its derivative."""
        _, length, rest = self._rest
        k = self.hinge_stiffness * length
        moment, slope = k * (phi - rest), k.copy()
        if self.law == "published":
            low, high = self.linear
            for edge, room, out in ((low, low, phi < low), (high, 2.0 * math.pi - high, phi > high)):
                c = 0.5 * math.pi / room if room > 0.0 else 1.0
                beyond = c * (phi[out] - edge)
                moment[out] = k[out] * (edge - rest[out] + np.tan(beyond) / c)
                slope[out] = k[out] / np.cos(beyond) ** 2
        return moment, slope

    def forces(self, u: Array) -> Array:
        """(n, 3) internal nodal forces at displacements `u` (n, 3), N."""
        x = self.points + u
        f = np.zeros_like(x)
        lengths, _, _ = self._rest
        d = x[self.bars[:, 1]] - x[self.bars[:, 0]]
        now = np.linalg.norm(d, axis=1)
        pull = (self._bar_law(now / lengths)[0] / now)[:, None] * d
        np.add.at(f, self.bars[:, 1], pull)
        np.add.at(f, self.bars[:, 0], -pull)
        corners = x[self.hinges]
        moment, _ = self._hinge_law(hinge_angles(corners))
        np.add.at(f, self.hinges, moment[:, None, None] * hinge_gradients(corners))
        return f

    def stiffness(self, u: Array) -> Array:
        """(3 n, 3 n) tangent at displacements `u`."""
        x = self.points + u
        n = len(x)
        K = np.zeros((3 * n, 3 * n))
        lengths, _, _ = self._rest
        d = x[self.bars[:, 1]] - x[self.bars[:, 0]]
        now = np.linalg.norm(d, axis=1)
        force, slope = self._bar_law(now / lengths)
        d = d / now[:, None]
        dd = d[:, :, None] * d[:, None, :]
        block = (slope / lengths)[:, None, None] * dd + (force / now)[:, None, None] * (np.eye(3) - dd)
        whole = np.concatenate((np.concatenate((block, -block), 2), np.concatenate((-block, block), 2)), 1)
        _scatter(K, self.bars, whole)
        corners = x[self.hinges]
        g = hinge_gradients(corners).reshape(-1, 12)
        moment, slope = self._hinge_law(hinge_angles(corners))
        hessian = np.empty((len(g), 12, 12))
        for i in range(12):
            moved = corners.reshape(-1, 12).astype(complex)
            moved[:, i] += 1e-30j
            hessian[:, i] = hinge_gradients(moved.reshape(-1, 4, 3)).reshape(-1, 12).imag / 1e-30
        _scatter(
            K,
            self.hinges,
            slope[:, None, None] * g[:, :, None] * g[:, None, :] + moment[:, None, None] * hessian,
        )
        return K

    def follow(self, first: float, increments: int, tolerance: float = 1e-9) -> Iterator[tuple[float, Array]]:
        """(lambda, u) of every increment from the stress-free state; `first` is the first increment of lambda.

        Raises:
            ArithmeticError: an increment does not converge in 30 iterations.
        """
        free = ~self.held.ravel()
        F = self.load.ravel()[free]
        u, lam = np.zeros_like(self.points), 0.0
        before: Array | None = None
        scale, sign = 0.0, 1.0
        for _ in range(increments):
            predictor = np.asarray(np.linalg.solve(self.stiffness(u)[np.ix_(free, free)], F), dtype=float)
            scale = scale or float(predictor @ predictor)
            if before is not None:
                sign *= math.copysign(1.0, float(before @ predictor))
            before = predictor
            change = sign * first * math.sqrt(scale / float(predictor @ predictor))
            step = change * predictor
            for iteration in range(31):
                lam += change
                u = u.copy()
                u.ravel()[free] += step
                residual = lam * F - self.forces(u).ravel()[free]
                if np.abs(residual).max() < tolerance:
                    break
                if iteration == 30:
                    raise ArithmeticError(f"no convergence at lambda {lam:g}; use smaller increments")
                both = np.linalg.solve(self.stiffness(u)[np.ix_(free, free)], np.column_stack((F, residual)))
                change = -float(predictor @ both[:, 1]) / float(predictor @ both[:, 0])
                step = change * both[:, 0] + both[:, 1]
            yield lam, u


def _scatter(K: Array, nodes: Ints, blocks: Array) -> None:
    dof = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), 3 * nodes.shape[1])
    np.add.at(K, (dof[:, :, None], dof[:, None, :]), blocks)
