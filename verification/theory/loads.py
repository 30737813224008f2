"""Beams and plates under pressure, end loads, on springs, with imperfections: closed forms or their own equations.

Lengths in units of the span L, bending stiffness 1 unless said otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_bvp
from scipy.optimize import brentq

Array = NDArray[np.float64]
LEVY = {
    17.79: 0.237,
    38.3: 0.471,
    63.4: 0.695,
    95.0: 0.912,
    134.9: 1.121,
    184.0: 1.323,
    245.0: 1.521,
    318.0: 1.714,
    402.0: 1.902,
}  # Levy (1942), NACA TN 847: p a^4 / (E t^4) and w / t of a square whose clamped edges do not move, nu = 0.316


def cantilever_tip(force: Callable[[float], Array], pressure: float = 0.0) -> tuple[float, float]:
    """Tip (x, z) of an inextensible cantilever, the elastica with all terms, solved to 1e-8 by continuation.

    Bending stiffness and length 1: theta' = m, m' = -t x n, n' = -pressure times the normal.

    Args:
        force: dead force (x, z) on the tip, of the part of the load, 0 to 1.
        pressure: follower pressure from below.
    """
    s = np.linspace(0.0, 1.0, 201)
    state = np.zeros((6, len(s)))
    state[1] = s
    found = None
    for part in np.linspace(0.1, 1.0, 10):
        p, (fx, fz) = part * pressure, force(float(part))

        def slope(_: Array, y: Array, p: float = p) -> Array:
            c, z = np.cos(y[0]), np.sin(y[0])
            return np.array([y[3], c, z, -(c * y[5] - z * y[4]), p * z, -p * c])

        def ends(a: Array, b: Array, fx: float = fx, fz: float = fz) -> Array:
            return np.array([a[0], a[1], a[2], b[3], b[4] - fx, b[5] - fz])

        found = solve_bvp(slope, ends, s, state, tol=1e-8, max_nodes=50_000)
        state = found.sol(s)
    assert found is not None
    assert found.success
    tip = found.sol(1.0)
    return float(tip[1]), float(tip[2])


def lifted_tip(load: float) -> tuple[float, float]:
    """Tip (x, z) under a dead force F upwards with load = F L^2 / E I; Bisshopp and Drucker (1945)."""
    return cantilever_tip(lambda part: np.array([0.0, part * load]))


def blown_tip(pressure: float) -> tuple[float, float]:
    """Tip (x, z) under a pressure that follows it, p L^3 / D."""
    return cantilever_tip(lambda _: np.zeros(2), pressure)


def rolled_tip(angle: float) -> tuple[float, float]:
    """Tip (x, z) of the arc under an end moment m L / D = angle, rad."""
    return math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle


def held_strip(load: float, thickness: float) -> float:
    """Middle deflection over the span of a long strip between hinges that do not move, bent to a cylinder by pressure.

    Timoshenko and Woinowsky-Krieger, article 2: with u^2 = S L^2 / (4 D) the tension S is what stretches the strip.

    Args:
        load: p L^3 / D.
        thickness: t / L.
    """
    x = np.linspace(0.0, 1.0, 2001)

    def shape(u: float) -> Array:
        bow = np.cosh(u * (1.0 - 2.0 * x)) / math.cosh(u) - 1.0
        return np.asarray(load * (bow / (16.0 * u**4) + x * (1.0 - x) / (8.0 * u**2)))

    def missing(u: float) -> float:
        stretch = 0.5 * float(np.trapezoid(np.gradient(shape(u), x) ** 2, x))
        return stretch - thickness**2 / 12.0 * 4.0 * u**2  # S L / (E t / (1 - nu^2)), as S L^2 = 4 u^2 D

    u = brentq(missing, 1e-2, 200.0, xtol=1e-12)
    return float(shape(u)[1000])


def beam_on_springs(stiffness: float) -> float:
    """Middle deflection of a beam with free ends on springs, w E I / (F L^3), with F in the middle; Hetenyi (1946).

    Args:
        stiffness: k L^4 / E I, with k of the springs a length.
    """
    b = math.sqrt(math.sqrt(0.25 * stiffness))
    curve = (math.cosh(b) + math.cos(b) + 2.0) / (math.sinh(b) + math.sin(b))
    return b / (2.0 * stiffness) * curve


def beam_column(part: float) -> float:
    """Middle deflection of a beam between hinges under uniform load q and an axial force, w E I / (q L^4).

    Timoshenko and Gere (1961), article 1.3.

    Args:
        part: axial force over Euler's load.
    """
    u = 0.5 * math.pi * math.sqrt(part)
    return 5.0 / 384.0 * 12.0 * (2.0 / math.cos(u) - 2.0 - u**2) / (5.0 * u**4)


def clamped_plate(loads: Sequence[float], nu: float, terms: int = 6) -> list[float]:
    """Middle deflections w / t of a square plate with clamped edges that do not move: Karman's equations by Ritz.

    w is (1 - X^2)^2 (1 - Y^2)^2 times even Chebyshev polynomials of both, u is X (1 - X^2) (1 - Y^2) times such, and v
    its mirror image; with 6 x 6 terms each all digits shown stand.

    Args:
        loads: p a^4 / (E t^4), rising.
        nu: Poisson's ratio.
        terms: of each polynomial, along X and along Y.
    """
    points, weights = np.polynomial.legendre.leggauss(40)
    one = [_even(k) for k in range(terms)]
    bell = np.polynomial.Polynomial([1.0, 0.0, -1.0])
    along_w = np.array([_derivatives(bell**2 * each, points) for each in one])  # (terms, 3, q)
    odd = np.array([_derivatives(bell * each * np.polynomial.Polynomial([0.0, 1.0]), points) for each in one])
    even = np.array([_derivatives(bell * each, points) for each in one])

    def product(f: Array, g: Array, i: int, j: int) -> Array:
        """(terms^2, q^2) of derivatives i along x and j along y, x and y from -1/2 to 1/2."""
        found = np.einsum("mp,nq->mnpq", f[:, i], g[:, j]).reshape(len(f) * len(g), -1)
        return np.asarray(2.0 ** (i + j) * found)

    area = 0.25 * np.outer(weights, weights).ravel()
    w, wx, wy = (product(along_w, along_w, *order) for order in ((0, 0), (1, 0), (0, 1)))
    laplace = product(along_w, along_w, 2, 0) + product(along_w, along_w, 0, 2)
    ux, uy = product(odd, even, 1, 0), product(odd, even, 0, 1)
    mirrored = [np.swapaxes(f.reshape(len(f), 40, 40), 1, 2).reshape(len(f), -1) for f in (uy, ux)]
    stretch = np.stack((ux, mirrored[1], uy + mirrored[0]))  # of eps_x, eps_y, gamma
    moduli = np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]]) / (1.0 - nu**2)
    bend = (laplace * area) @ laplace.T / (12.0 * (1.0 - nu**2))
    ritz = _Ritz(area, wx, wy, stretch, moduli, bend, w @ area)
    a, b, found = np.zeros(len(w)), np.zeros(len(ux)), []
    for load in loads:
        for _ in range(60):
            residual, K = ritz.at(a, b, load)
            change = np.linalg.lstsq(K, -residual, rcond=1e-13)[0]
            a, b = a + change[: len(a)], b + change[len(a) :]
            if np.abs(change).max() < 1e-10 * max(float(np.abs(a).max()), 1e-300):
                break
        middle = np.array(
            [float(bell(0.0) ** 4 * one[m](0.0) * one[n](0.0)) for m, n in np.ndindex(terms, terms)]
        )
        found.append(float(a @ middle))
    return found


class _Ritz(NamedTuple):
    """Weights of points (q,), slopes of w, strains of u and v (3, terms, q), moduli, bending, work of pressure."""

    area: Array
    wx: Array
    wy: Array
    stretch: Array
    moduli: Array
    bend: Array
    push: Array

    def at(self, a: Array, b: Array, load: float) -> tuple[Array, Array]:
        """Residual and tangent at coefficients a of w and b of u and v."""
        wx, wy, area, count = self.wx, self.wy, self.area, len(a)
        sx, sy = a @ wx, a @ wy
        bowed = np.stack((0.5 * sx**2, 0.5 * sy**2, sx * sy))
        force = self.moduli @ (np.einsum("b,cbq->cq", b, self.stretch) + bowed)
        every = np.concatenate((np.stack((sx * wx, sy * wy, sx * wy + sy * wx)), self.stretch), axis=1)
        residual = np.einsum("q,cq,cfq->f", area, force, every)
        residual[:count] += self.bend @ a - load * self.push
        K = np.einsum("q,cd,cfq,dgq->fg", area, self.moduli, every, every, optimize=True)
        cross = (wx * (area * force[2])) @ wy.T
        K[:count, :count] += self.bend + cross + cross.T
        K[:count, :count] += (wx * (area * force[0])) @ wx.T + (wy * (area * force[1])) @ wy.T
        return residual, K


def _even(k: int) -> np.polynomial.Polynomial:
    """Chebyshev's polynomial of order 2 k."""
    return np.polynomial.Chebyshev.basis(2 * k).convert(kind=np.polynomial.Polynomial)


def _derivatives(p: np.polynomial.Polynomial, x: Array) -> Array:
    """(3, q) values and two derivatives."""
    return np.array([p(x), p.deriv(1)(x), p.deriv(2)(x)])
