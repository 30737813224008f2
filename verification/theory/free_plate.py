"""Where free plates that are curved at rest, or heated laminates, leave their first shape: Karman's equations by Ritz.

A free plate wants the curvatures k0 (tensor components xx, yy, 2 xy in 1 / mm, positive where its edges go up). With
A, B, D of lamination theory, its deflection w and the membrane forces N = (phi_yy, phi_xx, -phi_xy) of an Airy function
that vanishes with its slope on the free edge,

    U = 1/2 int (k - k0) . (D - B A^-1 B) (k - k0) + max over phi of int N . (1/2 w_,a w_,b - A^-1 B (k - k0)) - 1/2 N . A^-1 N

(strains at rest that are alike all over do nothing). w and phi are polynomials, all integrals Gauss's, so the energy is a
quartic of the coefficients of w. With w of the second degree alone this is the model of uniform curvature (Hyer 1981;
Freund 2000; Seffen 2007), which has the closed form below for a disc; more terms go to Karman's equations, the shell's
limit of small slopes. M. W. Hyer, J. Composite Materials 15 (1981) 296; L. B. Freund, J. Mech. Phys. Solids 48 (2000)
1159; E. H. Mansfield, Proc. R. Soc. A 268 (1962) 316; K. A. Seffen, Proc. R. Soc. A 463 (2007) 67.
"""  # noqa: E501

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.optimize import brentq

Array = NDArray[np.float64]


def disc(nu: float, t: float, radius: float) -> float:
    """Natural curvature at which a disc that wants to be a bowl becomes a cylinder, 1 / mm, of uniform curvature.

    The bowl k obeys D (1 + nu) (k - k0) + E t R^4 k^3 / 192 = 0 and is lost at D (1 - nu) = E t R^4 k^2 / 192:
    k0 = 8 t / (R^2 (1 + nu)^(3/2)) (Freund 2000, for one material).

    Args:
        nu: Poisson's ratio.
        t: thickness, mm.
        radius: mm.
    """
    return 8.0 * t / (radius**2 * math.sqrt(1.0 + nu) ** 3)


@dataclass(frozen=True, eq=False)
class FreePlate:
    """A free plate in the square |x|, |y| <= `half`, or in the disc of that radius.

    Attributes:
        A: (3, 3) N / mm, components xx, yy, 2 xy.
        B: (3, 3) N.
        D: (3, 3) N mm.
        half: half the side, or the radius, mm.
        round: True for the disc.
        degree: of the polynomials of w, even; those of phi have two more beside the factor that vanishes on the edge.
    """

    A: Array
    B: Array
    D: Array
    half: float
    round: bool = False
    degree: int = 8

    def _points(self) -> tuple[Array, Array, Array]:
        """x, y in parts of `half`, and weights."""
        s, w = np.polynomial.legendre.leggauss(2 * self.degree + 8)
        if not self.round:
            x, y = np.meshgrid(s, s, indexing="ij")
            return x.ravel(), y.ravel(), np.outer(w, w).ravel()
        r, angles = 0.5 * (s + 1.0), 8 * self.degree + 32
        a = 2.0 * math.pi * np.arange(angles) / angles
        x, y = np.outer(r, np.cos(a)), np.outer(r, np.sin(a))
        return x.ravel(), y.ravel(), np.repeat(0.5 * w * r * 2.0 * math.pi / angles, angles)

    def _powers(self, degree: int, least: int) -> list[tuple[int, int]]:
        """Exponents that are both even, or both odd: the plate keeps its two-fold axis."""
        return [(i, n - i) for n in range(least, degree + 1, 2) for i in range(n + 1)]

    @cached_property
    def _tables(self) -> tuple[Array, Array, Array, Array]:
        """First derivatives (q, n, 2) and curvatures (q, n, 3) of w, forces (q, m, 3) of phi, and weights (q,)."""
        x, y, weights = self._points()
        first, second = [], []
        for i, j in self._powers(self.degree, 2):
            p, q = _legendre(i), _legendre(j)
            first.append(np.stack((p(x, 1) * q(y), p(x) * q(y, 1)), axis=-1) / self.half)
            k = np.stack((p(x, 2) * q(y), p(x) * q(y, 2), 2.0 * p(x, 1) * q(y, 1)), axis=-1)
            second.append(k / self.half**2)
        forces = []
        for i, j in self._powers(self.degree + 2, 0):
            p, q = _legendre(i), _legendre(j)
            own = [[p(x, a) * q(y, b) for b in range(3)] for a in range(3)]
            rim = self._rim(x, y)
            xx = rim[2][0] * own[0][0] + 2.0 * rim[1][0] * own[1][0] + rim[0][0] * own[2][0]
            yy = rim[0][2] * own[0][0] + 2.0 * rim[0][1] * own[0][1] + rim[0][0] * own[0][2]
            xy = rim[1][1] * own[0][0] + rim[1][0] * own[0][1] + rim[0][1] * own[1][0] + rim[0][0] * own[1][1]
            forces.append(np.stack((yy, xx, -xy), axis=-1) / self.half**2)
        return np.stack(first, 1), np.stack(second, 1), np.stack(forces, 1), weights * self.half**2

    def _rim(self, x: Array, y: Array) -> list[list[Array]]:
        """Derivatives [a][b] by x and y of the factor that vanishes with its slope on the edge."""
        if not self.round:
            f = Polynomial([1.0, 0.0, -2.0, 0.0, 1.0])
            parts = [[f.deriv(k)(s) if k else f(s) for k in range(3)] for s in (x, y)]
            return [[parts[0][a] * parts[1][b] for b in range(3)] for a in range(3)]
        g = 1.0 - x**2 - y**2
        none = np.zeros_like(g)
        return [
            [g**2, -4.0 * y * g, 8.0 * y**2 - 4.0 * g],
            [-4.0 * x * g, 8.0 * x * y, none],
            [8.0 * x**2 - 4.0 * g, none, none],
        ]

    @cached_property
    def _forms(self) -> tuple[Array, Array, Array, Array, Array, Array]:
        """Bending (n, n), its load by k0 (n, 3), and of phi: flexibility^-1, quadratic (m, n, n), linear, by k0."""
        slopes, k, N, weights = self._tables
        flexible = np.linalg.inv(self.A)
        coupled = flexible @ self.B
        reduced = self.D - self.B @ coupled
        bending = np.einsum("q,qni,ij,qmj->nm", weights, k, reduced, k, optimize=True)
        load = np.einsum("q,qni,ij->nj", weights, k, reduced, optimize=True)
        M = np.einsum("q,qmi,ij,qlj->ml", weights, N, flexible, N, optimize=True)
        pairs = slopes[:, :, None, :] * slopes[:, None, :, :]
        mixed = slopes[:, :, None, 0] * slopes[:, None, :, 1]
        quadratic = np.einsum("q,qm,qnl->mnl", weights, N[..., 0], pairs[..., 0], optimize=True)
        quadratic += np.einsum("q,qm,qnl->mnl", weights, N[..., 1], pairs[..., 1], optimize=True)
        twist = np.einsum("q,qm,qnl->mnl", weights, N[..., 2], mixed, optimize=True)
        quadratic = 0.5 * (quadratic + twist + twist.transpose(0, 2, 1))
        linear = -np.einsum("q,qmi,ij,qnj->mn", weights, N, coupled, k, optimize=True)
        rest = np.einsum("q,qmi,ij->mj", weights, N, coupled, optimize=True)
        return bending, load, np.linalg.inv(M), quadratic, linear, rest

    def first_shape(self, k0: Array, amount: float, begin: Array | None = None) -> tuple[Array, float]:
        """The shape that the plate comes to first, and the least eigenvalue of its energy there.

        A bowl (or a saddle) that is the same (the opposite) when x and y change places, which is kept up.

        Args:
            k0: (3,) curvature that it wants, 1 / mm, at the amount 1.
            amount: factor of it.
            begin: coefficients to begin Newton's iterations with.

        Returns:
            coefficients of w (n,), and the eigenvalue over that of the flat plate; negative: the shape is lost.
        """
        powers = self._powers(self.degree, 2)
        swapped = np.array([powers.index((j, i)) for i, j in powers])
        even = np.array([1.0 - i % 2 for i, _ in powers])
        sign = 1.0 if k0[0] * k0[1] > 0.0 else -1.0
        return self._balance(amount * k0, begin, lambda c: np.asarray(0.5 * (c + sign * c[swapped]) * even))

    def cylinder(self, k0: Array, amount: float) -> tuple[Array, float]:
        """Mean curvatures (3,) of the shape that is bent along x alone, and the least eigenvalue there.

        Args:
            k0: (3,) curvature that the plate wants at the amount 1, 1 / mm.
            amount: factor of it, beyond the critical one.
        """
        _, k, _, weights = self._tables
        bending, load = self._forms[:2]
        begin = np.asarray(np.linalg.solve(bending, load @ (amount * k0 * [1.0, 0.0, 0.0])))
        c, least = self._balance(amount * k0, begin, lambda c: c)
        return np.einsum("q,qni,n->i", weights, k, c) / weights.sum(), least

    def _balance(self, k0: Array, begin: Array | None, kept: Callable[[Array], Array]) -> tuple[Array, float]:
        """Newton's iterations to a shape in the space that `kept` projects on, and the least eigenvalue of all."""
        bending, load, stiff, quadratic, linear, rest = self._forms
        c = np.asarray(np.linalg.solve(bending, load @ k0) if begin is None else begin)
        scale = np.sqrt(np.diag(bending))
        for _ in range(60):
            g = np.einsum("mnl,n,l->m", quadratic, c, c) + linear @ c + rest @ k0
            slope = 2.0 * np.einsum("mnl,l->mn", quadratic, c) + linear
            phi = stiff @ g
            residual = bending @ c - load @ k0 + slope.T @ phi
            tangent = bending + slope.T @ stiff @ slope + 2.0 * np.einsum("mnl,m->nl", quadratic, phi)
            step = np.linalg.solve(tangent, residual)
            c = kept(c - step)
            if np.abs(step * scale).max() < 1e-12 * np.abs(c * scale).max():
                break
        least = np.linalg.eigvalsh(tangent / np.outer(scale, scale))[0]
        return c, float(least)

    def _least(self, k0: Array, begin: Array | None, amount: float) -> float:
        return self.first_shape(k0, amount, begin)[1]

    def critical(self, k0: Array, most: float, steps: int = 24) -> float:
        """The amount of k0 at which the first shape is lost.

        Args:
            k0: (3,) curvature that the plate wants at the amount 1, 1 / mm.
            most: amount that is beyond it.
            steps: on the way there.

        Raises:
            ValueError: it is not lost up to there.
        """
        shape, before, sign = None, 0.0, 1.0
        for amount in np.linspace(0.0, most, steps + 1)[1:]:
            last = shape
            shape, sign = self.first_shape(k0, float(amount), shape)
            if sign < 0.0:
                least = partial(self._least, k0, last)
                return float(brentq(least, before, amount, xtol=1e-10 * most))
            before = float(amount)
        raise ValueError(f"the first shape is not lost up to {most:g}")


def _legendre(degree: int) -> Callable[..., Array]:
    one = np.polynomial.legendre.Legendre.basis(degree)
    return lambda x, k=0: np.asarray(one.deriv(k)(x) if k else one(x))


def isotropic(E: float, nu: float, t: float) -> tuple[Array, Array, Array]:
    """A, B and D of one material.

    Args:
        E: MPa.
        nu: Poisson's ratio.
        t: mm.
    """
    Q = E / (1.0 - nu**2) * np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])
    return t * Q, np.zeros((3, 3)), t**3 / 12.0 * Q


def cross_ply(E1: float, E2: float, nu12: float, G: float, t: float) -> tuple[Array, Array, Array]:
    """A, B and D of [0/90], fibres along x at the bottom; for a strain e - z k.

    Args:
        E1: along the fibres, MPa.
        E2: across them, MPa.
        nu12: Poisson's ratio.
        G: in shear, MPa.
        t: of either ply, mm.
    """
    scale = 1.0 - nu12**2 * E2 / E1
    Q = np.array([[E1, nu12 * E2, 0.0], [nu12 * E2, E2, 0.0], [0.0, 0.0, G * scale]]) / scale
    turned = Q[np.ix_([1, 0, 2], [1, 0, 2])]
    return t * (Q + turned), 0.5 * t**2 * (turned - Q), t**3 / 3.0 * (Q + turned)
