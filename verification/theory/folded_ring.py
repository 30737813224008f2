"""A closed ring folded along its circle by one dihedral angle everywhere (Dias, Dudte, Mahadevan and Santangelo 2012).

The crease keeps its geodesic curvature 1 / R in both panels, so its curvature is kappa = 1 / (R sin(theta /
2)) everywhere, whatever the mechanics. A narrow ring then has the energy B w int (kn^2 + tau^2)^2 / kn^2 ds
with kn = cot(theta / 2) / R (developable panels whose rulings lean by tau / kn; Dias and Audoly 2014): a rod
with one curvature frozen. With T, N and B the frame of the crease and f = (kn^2 + tau^2)^2 / kn^2, rotations
of the rod conserve M = f'(tau) T + Mn N + Mb B:

    (f')' = kappa Mn,   Mn' = tau Mb - kappa f',   Mb' = -tau Mn.

The state in two waves has a mirror plane at each crest and trough, and a two-fold axis along N halfway:
tau(0) = 0, Mn(L / 8) = 0, and the planes of neighbouring crest and trough are at right angles, T(0) . N(L /
8) = -cos 45 degrees.

Rulings that lean give every panel a curvature tau^2 / kn across, and with it a moment that neither a free edge
nor, by symmetry, the crease bears. Elastic panels lose it in layers of width sqrt(t / kn): with eta across a
panel from its middle line, the rest u of the height, whose stretching is kn u, obeys

    B u'''' + E t kn^2 u = 0,   u'' = -tau^2 / kn and u''' = 0 at eta = -w / 2 and w / 2

(the wide beam of Ashwell, 1950, with tau^2 / kn in the place of nu kn), which leaves

    f = kn^2 + 2 tau^2 + (1 - release) tau^4 / kn^2,   release = 2 / l (cosh l - cos l) / (sinh l + sin l)

with l = 3^(1/4) w sqrt(kn / t) at nu = 0. A ring of some thickness goes to this one as w / R -> 0 at the same
l, so that t / w goes to 0 like w / R; and this one goes to the isometric ring as l grows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import root

Array = NDArray[np.float64]
EIGHTH = math.pi / 4.0  # of the crease's length, R = 1
START = math.radians(170.0)  # nearly flat: continuation in the angle begins here
STEP = math.radians(10.0)


@dataclass(frozen=True)
class FoldedRing:
    """Shape of the crease over R, and the energy.

    Attributes:
        height: from trough to crest, over R.
        crest: distance of the crests from the axis, over R; `node` that of the points halfway.
        node: see `crest`.
        energy: E R / (B w), w the width of each panel.
    """

    height: float
    crest: float
    node: float
    energy: float


def curvature(theta: float) -> float:
    """Kappa R.

    Args:
        theta: dihedral angle, rad.
    """
    return 1.0 / math.sin(0.5 * theta)


def release(theta: float, radius: float, width: float, thickness: float) -> float:
    """Part of the bending across that the layers of elastic panels lose, at nu = 0.

    Args:
        theta: dihedral angle, rad.
        radius: of the crease, mm.
        width: of each panel, mm.
        thickness: mm.
    """
    wide = 3.0**0.25 * width / math.sqrt(radius * math.tan(0.5 * theta) * thickness)
    if wide > 300.0:  # cosh overflows
        return float(2.0 / wide)
    ends = (math.cosh(wide) - math.cos(wide)) / (math.sinh(wide) + math.sin(wide))
    return float(2.0 / wide * ends)


@lru_cache(maxsize=16)
def folded_ring(theta: float, released: float = 0.0) -> FoldedRing:
    """The state in two waves of a narrow ring.

    Args:
        theta: dihedral angle, rad in (0.9, 2.9).
        released: part of the bending across that is lost (`release`); 0 for isometric panels.
    """
    unknown = _folded(theta)
    for part in np.linspace(0.0, released, 4)[1:] if released else ():
        unknown = _solved(theta, unknown, part)
    return _read(theta, _solved(theta, unknown, released), released)


@lru_cache(maxsize=16)
def _folded(theta: float) -> Array:
    """Mn and Mb at the crest of the isometric ring, by continuation from nearly flat."""
    at, unknown = START, _first(START)
    while at > theta:
        at = max(at - STEP, theta)
        unknown = _solved(at, unknown)
    return unknown


def _solved(theta: float, guess: Array, released: float = 0.0) -> Array:
    found = root(lambda x: _gap(theta, x, released), guess, tol=1e-12)
    if not np.abs(_gap(theta, found.x, released)).max() < 1e-9:
        raise ArithmeticError(f"the ring at {theta:g} rad was not found")
    return np.asarray(found.x)


@cache
def _first(theta: float) -> Array:
    """Mn and Mb at the crest: the first pair on a grid of amplitudes from which the conditions can be met."""
    for mn in np.geomspace(0.05, 50.0, 25):
        for mb in np.linspace(-10.0, 10.0, 21) * mn:
            found = root(lambda x: _gap(theta, x), np.array([mn, mb]), tol=1e-12)
            if found.success and found.x[0] > 1e-3 and np.abs(_gap(theta, found.x)).max() < 1e-9:
                waves = _along(theta, found.x, np.linspace(0.0, EIGHTH, 60))[0]
                if (waves[1:] > 0.0).all():  # torsion of one sign from crest to node: two waves, no more
                    return np.asarray(found.x)
    raise ArithmeticError(f"no state in two waves was found at {theta:g} rad")


def _along(theta: float, unknown: Array, at: Array, released: float = 0.0) -> Array:
    """(16, k) f', Mn, Mb, T, N, B, place and energy at arc lengths, torsion in place of f'."""
    kappa, kn, kept = curvature(theta), 1.0 / math.tan(0.5 * theta), 1.0 - released

    def rates(_s: float, y: Array) -> Array:
        tau = _torsion(float(y[0]), kn, kept)
        t, n, b = y[3:6], y[6:9], y[9:12]
        density = kn**2 + 2.0 * tau**2 + kept * tau**4 / kn**2
        turn = [kappa * y[1], tau * y[2] - kappa * y[0], -tau * y[1]]
        return np.concatenate((turn, kappa * n, tau * b - kappa * t, -tau * n, t, [density]))

    start = np.concatenate(([0.0, *unknown], np.eye(3).ravel(), np.zeros(4)))
    found = solve_ivp(rates, (0.0, EIGHTH), start, method="DOP853", rtol=1e-9, atol=1e-11, t_eval=at)
    if len(found.t) < len(at):
        return np.full((16, len(at)), np.nan)
    found.y[0] = [_torsion(float(couple), kn, kept) for couple in found.y[0]]
    return np.asarray(found.y)


def _torsion(couple: float, kn: float, kept: float) -> float:
    """The torsion at which f' = 4 tau (1 + kept tau^2 / kn^2) has a value."""
    scale = math.sqrt(3.0 * kept)  # u + kept u^3 = couple / 4 kn
    return kn * 2.0 / scale * math.sinh(math.asinh(0.375 * scale * couple / kn) / 3.0)


def _gap(theta: float, unknown: Array, released: float = 0.0) -> Array:
    end = _along(theta, unknown, np.array([EIGHTH]), released)[:, 0]
    off = np.array([end[1], end[6] + math.cos(0.25 * math.pi)])
    return np.where(np.isfinite(off), off, 1e3)


def _read(theta: float, unknown: Array, released: float) -> FoldedRing:
    end = _along(theta, unknown, np.array([EIGHTH]), released)[:, 0]
    tangent, normal, place = np.array([1.0, 0.0, 0.0]), end[6:9], end[12:15]
    axis = np.cross(tangent, normal)
    axis /= np.linalg.norm(axis)
    rise = float(place @ axis)
    # the axis of the ring meets the two-fold axis (along N at the node) and lies in the mirror plane of the crest
    flat = place - rise * axis
    reach = float(flat @ tangent) / float(normal @ tangent)
    crest = np.linalg.norm(flat - reach * normal)
    return FoldedRing(2.0 * abs(rise), float(crest), abs(reach), 8.0 * float(end[15]))
