"""Two elasticas that meet their mirror image, by `scipy.integrate.solve_bvp`: bowed strips, and a ring.

An inextensible strip of stiffness EI has the slope theta and the curvature kappa along s, and carries a force N that is
constant between contacts (what lies beyond puts it on what lies before):

    x' = cos theta,  z' = sin theta,  theta' = kappa,  EI kappa' = Nx sin theta - Nz cos theta

Its mirror image in z = 0 is what it meets, without friction. Two bowed strips that are pressed on each other at their
ends lie flat, z = theta = kappa = 0, up to where they leave each other with a force in a point: for small slopes
EI / (R V) from their ends. A ring that opposite forces squeeze meets itself in their line (Flaherty, Keller and Rubinow
1972 have it under pressure): from then on its shape stays, and what the forces grow by goes through the point of
contact. N, mm, rad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_bvp

Array = NDArray[np.float64]
TOLERANCE = 1e-9
POINTS = 81  # at first


@dataclass(frozen=True)
class Pressed:
    """Half of a bowed strip that its ends are pressed on its image by.

    Attributes:
        flat: from the middle to where it leaves its image, mm.
        rise: of its end from the plane of symmetry, mm.
    """

    flat: float
    rise: float


def _rate(y: Array, length: float, nx: float, nz: float) -> Array:
    """Derivative of (x, z, theta, kappa) by the part of a length; forces over EI, 1 / mm^2."""
    _, _, theta, kappa = y
    sine, cosine = np.sin(theta), np.cos(theta)
    return length * np.array([cosine, sine, kappa, nx * sine - nz * cosine])


def _solved(rate: object, ends: object, s: Array, guess: Array, values: Array) -> tuple[Array, Array]:
    """States at both ends of a boundary value problem and its parameters.

    Raises:
        ValueError: no solution is found.
    """
    found = solve_bvp(rate, ends, s, guess, p=values, tol=TOLERANCE, max_nodes=100_000)
    if not found.success:
        raise ValueError(f"the elastica is not solved: {found.message}")
    return found.y[:, -1], found.p


def pressed(force: float, radius: float, L: float, EI: float) -> Pressed:
    """The strip whose end, without a couple, is pressed towards its image.

    Args:
        force: on its end, along z, N, enough for it to lie on its image.
        radius: of the strip where nothing acts on it, mm.
        L: half of its length, mm.
        EI: bending stiffness, N mm^2.

    Raises:
        ValueError: no solution is found, or it would lie on its image nowhere.
    """

    def rate(_: Array, y: Array, p: Array) -> Array:
        return _rate(y, p[0], 0.0, -force / EI)

    def ends(a: Array, b: Array, p: Array) -> Array:
        del p
        return np.array([*a, b[3] - 1.0 / radius])

    s, length = np.linspace(0.0, 1.0, POINTS), EI / (radius * force)
    kappa = s / radius
    guess = np.array([length * s, length**2 * s**3 / (6.0 * radius), 0.5 * length * s**2 / radius, kappa])
    end, (free,) = _solved(rate, ends, s, guess, np.array([length]))
    if not 0.0 < free < L:
        raise ValueError(f"it would leave its image {free:.4g} mm from its end, and is {L:.4g} mm long")
    return Pressed(L - float(free), float(end[1]))


def squeezed(radius: float, EI: float, apart: float = 0.0) -> float:
    """Each of the two opposite forces that bring opposite points of a ring together, N.

    Args:
        radius: of the ring, mm.
        EI: bending stiffness, N mm^2.
        apart: distance that is left between the points, mm.

    Raises:
        ValueError: no solution is found.
    """
    length = 0.5 * math.pi * radius

    def rate(_: Array, y: Array, p: Array) -> Array:
        return _rate(y, length, 0.0, p[0])

    def ends(a: Array, b: Array, p: Array) -> Array:
        del p
        return np.array([a[0], a[1] - 0.5 * apart, a[2], b[1], b[2] + 0.5 * math.pi])

    # a quarter: upwards from where the forces act, and a right angle downwards at its side
    s = np.linspace(0.0, 1.0, POINTS)
    theta = 4.0 * s * (1.0 - s) - 0.5 * math.pi * s**2
    kappa = np.gradient(theta, s) / length
    x, z = (
        length * np.concatenate(([0.0], np.cumsum(part(0.5 * (theta[1:] + theta[:-1])) * np.diff(s))))
        for part in (np.cos, np.sin)
    )
    _, (nz,) = _solved(rate, ends, s, np.vstack((x, z, theta, kappa)), np.array([20.0 / length**2]))
    return 2.0 * abs(float(nz)) * EI
