"""What bars and hinges measure: length and dihedral angle, with analytic gradient and Hessian. Compiled.

A hinge is (wing a, edge j, edge k, wing b). With e the unit edge vector j -> k and, for each of its two triangles,
m the unit normal (up when a lies to the left of j -> k), u the unit vector in the triangle from the edge to the wing,
h the height of the wing and s the foot of the wing along the edge (0 at j, 1 at k), the dihedral angle measured
below the sheet is

    phi = pi - atan2(e . (m_a x m_b), m_a . m_b)            exact at flat, in [0, 2 pi]

    d phi / d x_wing = m / h
    d phi / d x_j = - sum (1 - s) m / h,    d phi / d x_k = - sum s m / h          (sums over both triangles)

The Hessian follows from d m = -(m . d) grad(lambda_i) when vertex i moves by d, with lambda_i its barycentric
coordinate. With S = u m^T + m u^T and c = 1 - s every block is a sum over the two triangles, so that neither
triangle needs to know the other:

    H_ww = -S / h^2
    H_wj =  c S / h^2 + e m^T / (h L)                        H_wk = s S / h^2 - e m^T / (h L)
    H_jj = -(c^2 / h^2 + 1 / (2 L^2)) S - c (m e^T + e m^T) / (h L)
    H_kk = -(s^2 / h^2 + 1 / (2 L^2)) S + s (m e^T + e m^T) / (h L)
    H_jk = (1 / (2 L^2) - s c / h^2) S + (c e m^T - s m e^T) / (h L)

(The asymmetric parts m u^T / L^2 of the two triangles cancel, which is used above.) Same derivatives as Tamstorf and
Grinspun (2013) and Liu and Paulino (2017), in a form that needs no case for the flat hinge. Units: mm and rad.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import wraps
from typing import TypeVar, cast

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.runtime.kernel_options import INNER, KERNEL

Array = NDArray[np.float64]
FAST = {"contract", "nsz", "arcp"}
OPTIONS = {**KERNEL, "fastmath": FAST}  # of what Python calls
INNER_OPTIONS = {**INNER, "fastmath": FAST}  # of what only kernels call
F = TypeVar("F", bound=Callable[..., object])


def compiled(function: F) -> F:
    """A kernel that Python calls, compiled when it is first used; it keeps its signature for type checkers.

    Read-only arrays are copied: numba takes them for a type of their own and would compile everything once more.
    """
    kernel = njit(**OPTIONS)(function)

    @wraps(function)
    def call(*arrays: Array) -> object:
        return kernel(*(array if array.flags.writeable else array.copy() for array in arrays))

    return cast(F, call)


@njit(inline="never", **INNER_OPTIONS)
def triangle_frame(x, wing, j, k, side):  # type: ignore[no-untyped-def]
    """(m, u, h, s) of one triangle of a hinge; `side` is +1 for the wing left of j -> k and -1 for the right one."""
    ex, ey, ez = x[k, 0] - x[j, 0], x[k, 1] - x[j, 1], x[k, 2] - x[j, 2]
    wx, wy, wz = x[wing, 0] - x[j, 0], x[wing, 1] - x[j, 1], x[wing, 2] - x[j, 2]
    edge2 = ex * ex + ey * ey + ez * ez
    s = (wx * ex + wy * ey + wz * ez) / edge2
    ux, uy, uz = wx - s * ex, wy - s * ey, wz - s * ez
    h = math.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / h, uy / h, uz / h
    scale = side / math.sqrt(edge2)
    mx, my, mz = scale * (ey * uz - ez * uy), scale * (ez * ux - ex * uz), scale * (ex * uy - ey * ux)
    return mx, my, mz, ux, uy, uz, h, s


@njit(**INNER_OPTIONS)
def hinge_geometry(x, a, j, k, b, g):  # type: ignore[no-untyped-def]
    """Dihedral angle of hinge (a, j, k, b); writes its gradient (12,) into `g` and returns what the Hessian needs."""
    ex, ey, ez = x[k, 0] - x[j, 0], x[k, 1] - x[j, 1], x[k, 2] - x[j, 2]
    length = math.sqrt(ex * ex + ey * ey + ez * ez)
    ex, ey, ez = ex / length, ey / length, ez / length
    m1x, m1y, m1z, u1x, u1y, u1z, h1, s1 = triangle_frame(x, a, j, k, 1.0)
    m2x, m2y, m2z, u2x, u2y, u2z, h2, s2 = triangle_frame(x, b, j, k, -1.0)
    sine = ex * (m1y * m2z - m1z * m2y) + ey * (m1z * m2x - m1x * m2z) + ez * (m1x * m2y - m1y * m2x)
    cosine = m1x * m2x + m1y * m2y + m1z * m2z
    phi = math.pi - math.atan2(sine, cosine)
    g[0], g[1], g[2] = m1x / h1, m1y / h1, m1z / h1
    g[9], g[10], g[11] = m2x / h2, m2y / h2, m2z / h2
    for i in range(3):
        g[3 + i] = -(1.0 - s1) * g[i] - (1.0 - s2) * g[9 + i]
        g[6 + i] = -s1 * g[i] - s2 * g[9 + i]
    return phi, length, (ex, ey, ez), (m1x, m1y, m1z), (u1x, u1y, u1z), h1, s1, (m2x, m2y, m2z), (
        u2x, u2y, u2z), h2, s2  # fmt: skip


@njit(**INNER_OPTIONS)
def add_hinge_hessian(geometry, factor, H):  # type: ignore[no-untyped-def]
    """Add factor times the Hessian of the dihedral angle to the lower triangle of H (12, 12)."""
    _, length, e, m1, u1, h1, s1, m2, u2, h2, s2 = geometry
    for side in range(2):
        if side == 0:
            m, u, h, s, w = m1, u1, h1, s1, 0
        else:
            m, u, h, s, w = m2, u2, h2, s2, 9
        c = 1.0 - s
        hh, hl, ll = factor / (h * h), factor / (h * length), factor * 0.5 / (length * length)
        for i in range(3):
            for k in range(3):
                S = u[i] * m[k] + m[i] * u[k]
                em, me = e[i] * m[k], m[i] * e[k]
                wj, wk = c * hh * S, s * hh * S
                if w == 0:  # blocks (j, a) and (k, a) lie below the diagonal: transposes of H_wj and H_wk
                    H[3 + i, k] += wj + hl * me
                    H[6 + i, k] += wk - hl * me
                else:
                    H[9 + i, 3 + k] += wj + hl * em
                    H[9 + i, 6 + k] += wk - hl * em
                H[6 + i, 3 + k] += (ll - s * c * hh) * S + hl * (c * me - s * em)
                if k <= i:
                    H[w + i, w + k] -= hh * S
                    H[3 + i, 3 + k] -= (c * c * hh + ll) * S + c * hl * (me + em)
                    H[6 + i, 6 + k] -= (s * s * hh + ll) * S - s * hl * (me + em)


@compiled
def dihedral_angles(x: Array, hinges: NDArray[np.int64]) -> Array:
    """(m,) dihedral angles in [0, 2 pi], rad, of (m, 4) hinges at node positions x (n, 3).

    A closed hinge reads 0 or 2 pi; which of them is decided by rounding, since both are the same position.

    Args:
        x: (nodes, 3) positions, mm.
        hinges: (m, 4) wing, edge, edge, wing.
    """
    phi = np.empty(len(hinges))
    g = np.empty(12)
    for i in range(len(hinges)):
        phi[i] = hinge_geometry(x, hinges[i, 0], hinges[i, 1], hinges[i, 2], hinges[i, 3], g)[0]
    return phi


@compiled
def dihedral_gradients(x: Array, hinges: NDArray[np.int64]) -> Array:
    """(m, 12) gradients of the dihedral angles with respect to (wing, edge, edge, wing), rad / mm.

    Args:
        x: (nodes, 3) positions, mm.
        hinges: (m, 4) wing, edge, edge, wing.
    """
    g = np.empty((len(hinges), 12))
    for i in range(len(hinges)):
        hinge_geometry(x, hinges[i, 0], hinges[i, 1], hinges[i, 2], hinges[i, 3], g[i])
    return g


@compiled
def dihedral_hessians(x: Array, hinges: NDArray[np.int64]) -> Array:
    """(m, 12, 12) symmetric Hessians of the dihedral angles, rad / mm^2.

    Args:
        x: (nodes, 3) positions, mm.
        hinges: (m, 4) wing, edge, edge, wing.
    """
    H = np.zeros((len(hinges), 12, 12))
    g = np.empty(12)
    for i in range(len(hinges)):
        add_hinge_hessian(
            hinge_geometry(x, hinges[i, 0], hinges[i, 1], hinges[i, 2], hinges[i, 3], g), 1.0, H[i]
        )
        for p in range(12):
            for q in range(p):
                H[i, q, p] = H[i, p, q]
    return H


@compiled
def bar_lengths(x: Array, bars: NDArray[np.int64]) -> Array:
    """(b,) lengths of (b, 2) bars, mm.

    Args:
        x: (nodes, 3) positions, mm.
        bars: (b, 2) node indices.
    """
    length = np.empty(len(bars))
    for i in range(len(bars)):
        d0 = x[bars[i, 1], 0] - x[bars[i, 0], 0]
        d1 = x[bars[i, 1], 1] - x[bars[i, 0], 1]
        d2 = x[bars[i, 1], 2] - x[bars[i, 0], 2]
        length[i] = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    return length
