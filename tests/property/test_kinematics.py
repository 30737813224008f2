"""Length and dihedral angle against an independent definition, in extended precision, on all kinds of hinges."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import meshes
from bh.mechanics import kinematics

Array = NDArray[np.float64]
CHECK = settings(deadline=None, derandomize=True, max_examples=60)
QUICK = settings(deadline=None, derandomize=True, max_examples=25)
HINGE = np.array([[0, 1, 2, 3]])
BAR = np.array([[0, 1]])
LONG = np.longdouble


def hinge(dihedral: float, length: float, heights: tuple[float, float], feet: tuple[float, float]) -> Array:
    """(4, 3) wing, edge, edge, wing with the given dihedral angle below the sheet; the edge runs along y."""
    half = 0.5 * (dihedral - math.pi)  # each wing is lifted by this angle
    across, up = math.cos(half), math.sin(half)
    (ha, hb), (sa, sb) = heights, feet
    return np.array(
        [[-ha * across, sa * length, ha * up], [0, 0, 0], [0, length, 0], [hb * across, sb * length, hb * up]]
    )


def rotation(seed: int) -> Array:
    Q, R = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q * np.sign(np.linalg.det(Q))


def angle(x: Array) -> float:
    return float(kinematics.dihedral_angles(np.ascontiguousarray(x), HINGE)[0])


def reference_angles(x: NDArray[np.longdouble]) -> NDArray[np.longdouble]:
    """Dihedral angles of hinges (k, 4, 3) by definition: the angle between the two half planes, below the sheet.

    Written with other products than the kernel: angle of the heights, and the side by which wing a leaves the plane
    of the other triangle.
    """
    a, j, k, b = (x[:, i] for i in range(4))
    e = k - j
    e = e / np.sqrt((e * e).sum(axis=1))[:, None]

    def height(wing: NDArray[np.longdouble]) -> NDArray[np.longdouble]:
        w = wing - j
        return w - (w * e).sum(axis=1)[:, None] * e

    ua, ub = height(a), height(b)
    cross = np.cross(ua, ub)
    opening = np.arctan2(np.sqrt((cross * cross).sum(axis=1)), (ua * ub).sum(axis=1))
    upper_normal_b = np.cross(ub, e)  # triangle (k, j, b) is counter-clockwise from above
    above = (ua * upper_normal_b).sum(axis=1) > 0
    return np.where(above, 2 * np.arctan2(LONG(0), LONG(-1)) - opening, opening)


WEIGHTS = ((1, LONG(8) / 12), (-1, LONG(-8) / 12), (2, LONG(-1) / 12), (-2, LONG(1) / 12))


def reference_gradient(x: Array, steps: Array) -> Array:
    """(12,) fourth-order differences of the definition in extended precision; `steps` (4,) one for each vertex."""
    moved, weights = [], []
    for i in range(12):
        for times, weight in WEIGHTS:
            y = x.astype(LONG).copy()
            y[i // 3, i % 3] += times * LONG(steps[i // 3])
            moved.append(y)
            weights.append(weight / LONG(steps[i // 3]))
    terms = reference_angles(np.array(moved)) * np.array(weights)
    return terms.reshape(12, 4).sum(axis=1).astype(float)


def differenced_gradient(x: Array, steps: Array) -> Array:
    """(12, 12) fourth-order differences of the kernel's gradient."""
    moved, weights = [], []
    for i in range(12):
        for times, weight in WEIGHTS:
            y = x.copy()
            y[i // 3, i % 3] += times * steps[i // 3]
            moved.append(y)
            weights.append(float(weight) / steps[i // 3])
    hinges = np.arange(4 * len(moved)).reshape(-1, 4)
    g = kinematics.dihedral_gradients(np.concatenate(moved), hinges)
    return (g * np.array(weights)[:, None]).reshape(12, 4, 12).sum(axis=1)


def sizes(x: Array) -> Array:
    """(4,) length on which the angle varies when a vertex moves: the least of edge and nearby heights."""
    e = x[2] - x[1]
    length = float(np.linalg.norm(e))
    h = [float(np.linalg.norm(np.cross(x[w] - x[1], e))) / length for w in (0, 3)]
    shortest = min(h[0], h[1], length)
    return np.array([h[0], shortest, shortest, h[1]])


def check_gradient(x: Array) -> None:
    size = sizes(x)
    # lever arms of far feet make the edge vertices' share large; compare each vertex on its own scale
    g = kinematics.dihedral_gradients(x, HINGE)[0]
    fd = reference_gradient(x, 1e-4 * size)
    scale = np.maximum(np.abs(g).reshape(4, 3).max(axis=1), 1.0 / np.array([size[0], size.max(), size.max(), size[3]]))
    assert np.abs((g - fd).reshape(4, 3)).max(axis=1) <= pytest.approx(np.zeros(4), abs=1e-10 * scale.max()) or (
        (np.abs((g - fd).reshape(4, 3)).max(axis=1) / scale).max() < 1e-9
    )
