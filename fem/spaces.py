"""Tables of the reference triangle: positions of degree k, moments (HHJ) and membrane strains (Regge) of degree k - 1.

Reference triangle with corners (0, 0), (1, 0), (0, 1) and barycentric coordinates l_0, l_1, l_2. Edge j lies opposite
corner j and runs counter-clockwise, r_j = v_(j+2) - v_(j+1) its vector, n_j = (r_y, -r_x) its outward normal; both
carry the length of the edge. Node 3 + j is the middle of edge j.

Moments and strains are symmetric tensors with linear components, nine functions each: number 3 j + k is l_i S_j or
l_i R_j with i = j + 1, j + 2, j for k = 0, 1, 2 and

    S_j = -sym(r_(j+1) r_(j+2)),  n_i S_j n_i = delta_ij   (contravariant; normal-normal component on edge j alone)
    R_j = -sym(n_(j+1) n_(j+2)),  r_i R_j r_i = delta_ij   (covariant; tangential-tangential one on edge j alone)

so that the first two of each three live on the edge and the third is zero on all edges. Both families are complete,
local to the triangle, and are condensed there; how they are joined across edges is told in `fem.shell`.

With linear positions (k = 1) there are no middle nodes, moments and strains are constant, S_j and R_j themselves, and
what is linear along an edge above is constant there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine, RefTri

Array = NDArray[np.float64]
CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
SLOPES = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])  # gradients of the barycentric coordinates
EDGES = np.roll(CORNERS, -2, axis=0) - np.roll(CORNERS, -1, axis=0)  # r_j
NORMALS = np.column_stack((EDGES[:, 1], -EDGES[:, 0]))  # n_j
INWARD = CORNERS - 0.5 * (np.roll(CORNERS, -1, axis=0) + np.roll(CORNERS, -2, axis=0))  # from edge to corner


def symmetric(a: Array, b: Array) -> Array:
    """sym(a b) = (a b^T + b a^T) / 2 of vectors (..., 2).

    Args:
        a: (..., 2) vectors.
        b: (..., 2) vectors.

    Returns:
        (..., 2, 2).
    """
    ab = a[..., :, None] * b[..., None, :]
    out: Array = 0.5 * (ab + np.swapaxes(ab, -1, -2))
    return out


MOMENTS = np.array([-symmetric(EDGES[(j + 1) % 3], EDGES[(j + 2) % 3]) for j in range(3)])  # S_j
STRAINS = np.array([-symmetric(NORMALS[(j + 1) % 3], NORMALS[(j + 2) % 3]) for j in range(3)])  # R_j


def barycentric(points: Array) -> Array:
    """(q, 3) barycentric coordinates of (q, 2) reference points."""
    return np.column_stack((1.0 - points.sum(axis=1), points))


def gradients(points: Array) -> Array:
    """(q, 6, 2) gradients of the quadratic shape functions."""
    b = barycentric(points)
    out = np.empty((len(points), 6, 2))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        out[:, k] = (4.0 * b[:, k, None] - 1.0) * SLOPES[k]
        out[:, 3 + k] = 4.0 * (b[:, i, None] * SLOPES[j] + b[:, j, None] * SLOPES[i])
    return out


def shapes(points: Array) -> Array:
    """(q, 6) quadratic shape functions."""
    b = barycentric(points)
    return np.hstack((b * (2.0 * b - 1.0), 4.0 * np.roll(b, -1, axis=1) * np.roll(b, -2, axis=1)))


def hessians() -> Array:
    """(6, 2, 2) second derivatives of the quadratic shape functions, which are constant."""
    corner = [4.0 * symmetric(SLOPES[k], SLOPES[k]) for k in range(3)]
    middle = [8.0 * symmetric(SLOPES[(k + 1) % 3], SLOPES[(k + 2) % 3]) for k in range(3)]
    return np.array(corner + middle)


def local_order() -> Array:
    """(9, 2) of each moment or strain function the barycentric coordinate i and the tensor j."""
    return np.array([(i % 3, j) for j in range(3) for i in (j + 1, j + 2, j)], dtype=np.int64)


def regge_interpolation() -> Array:
    """(9, 6, 6) coefficients of the interpolated strain: eps_c = 1/2 sum_ij Q[c, i, j] x_i . x_j.

    The canonical Regge interpolant of degree one (Li 2018; Neunteufel and Schoeberl 2021) of the covariant tensor
    1/2 x_,a . x_,b: it keeps the tangential-tangential moments against linear functions on each edge (which are those
    of the edge's own stretch, equal from both sides) and the mean of the tensor.
    """
    s, weights = get_quadrature(RefLine, 7)
    points, area_weights = get_quadrature(RefTri, 6)
    order = local_order()

    def functionals(tensor_at: list[Array], inside: Array) -> Array:
        """Of tensors on each edge (q, ..., 2, 2) and inside (q, ..., 2, 2)."""
        rows = []
        for k in range(3):
            stretch = np.einsum("q...ab,a,b->q...", tensor_at[k], EDGES[k], EDGES[k])
            rows += [np.einsum("q,q...->...", weights * weight, stretch) for weight in (1.0 - s[0], s[0])]
        for k in range(3):
            stretch = np.einsum("q...ab,a,b->q...", inside, EDGES[k], EDGES[k])
            rows.append(np.einsum("q,q...->...", area_weights, stretch))
        return np.array(rows)

    def basis(at: Array) -> Array:
        b = barycentric(at)
        functions: Array = np.stack([b[:, i, None, None] * STRAINS[j] for i, j in order], axis=1)
        return functions

    def metric(at: Array) -> Array:
        g = gradients(at)
        return symmetric(g[:, :, None, :], g[:, None, :, :])

    on_edges = [edge_points(k, s[0]) for k in range(3)]
    of_basis = functionals([basis(at) for at in on_edges], basis(points.T))
    of_metric = functionals([metric(at) for at in on_edges], metric(points.T))
    coefficients = np.linalg.solve(of_basis, of_metric.reshape(9, 36))
    return np.asarray(coefficients, dtype=float).reshape(9, 6, 6)


def edge_points(edge: int, s: Array) -> Array:
    """(q, 2) points at parameters s in [0, 1] on an edge, counter-clockwise.

    Args:
        edge: of the triangle, 0 to 2.
        s: (q,) in [0, 1].
    """
    return np.asarray(CORNERS[(edge + 1) % 3] + s[:, None] * EDGES[edge])


@dataclass(frozen=True, eq=False)
class Tables:
    """What the element loops need.

    n nodes, q points inside, p points on an edge, m functions with each of the tensors S_j or R_j (3 m in all, number
    m j + k), r of which and of the rotations live on the edge.

    Attributes:
        Q: (3 m, n, n) the strain's coefficients are 1/2 sum_ij Q[c, i, j] x_i . x_j; see
            `regge_interpolation`.
        weights: (q,) of the points inside (their sum is 1/2).
        slopes: (q, n, 2) derivatives of the shapes there.
        factors: (q, 3, m) what tensor j is multiplied by.
        middle: (m,) the same in the middle of the triangle.
        bend: (n, 3) second derivatives 11, 22, 12 of the shapes.
        S: (3, 3) components 11, 22 and twice 12 of the tensors S_j, so that S . kappa is their double
            contraction.
        s: (p,) points on [0, 1].
        edge_weights: (p,) their weights.
        turn: (r, p) the functions of the edge there.
        along: (3, p, n) derivatives of the shapes along r_j.
        across: (3, p, n) derivatives of the shapes toward the opposite corner.
    """

    Q: Array
    weights: Array
    slopes: Array
    factors: Array
    middle: Array
    bend: Array
    S: Array
    s: Array
    edge_weights: Array
    turn: Array
    along: Array
    across: Array

    @property
    def nodes(self) -> int:
        """Nodes of an element, n."""
        return len(self.bend)

    @property
    def measures(self) -> int:
        """Strains, and as many curvatures, of an element: 3 m."""
        return len(self.Q)

    @property
    def rotations(self) -> int:
        """Rotations of an edge, r."""
        return len(self.turn)


@cache
def tables(degree: int = 2) -> Tables:
    """Tables of positions of degree 2, exact to degree 4 inside and 5 on edges, or of degree 1: all is constant."""
    return _quadratic(4, 5) if degree == 2 else _linear()


def _quadratic(inside: int, on_edge: int) -> Tables:
    points, weights = get_quadrature(RefTri, inside)
    line, edge_weights = get_quadrature(RefLine, on_edge)
    s = np.sort(line[0])
    bary = barycentric(points.T)
    h = hessians()
    on_edges = [gradients(edge_points(j, s)) for j in range(3)]
    return Tables(
        Q=regge_interpolation(),
        weights=weights,
        slopes=gradients(points.T),
        factors=bary[:, local_order()[:, 0]].reshape(-1, 3, 3),
        middle=np.full(3, 1.0 / 3.0),
        bend=np.column_stack((h[:, 0, 0], h[:, 1, 1], h[:, 0, 1])),
        S=_double(MOMENTS),
        s=s,
        edge_weights=edge_weights[np.argsort(line[0])],
        turn=np.stack((1.0 - s, s)),
        along=np.array([g @ EDGES[j] for j, g in enumerate(on_edges)]),
        across=np.array([g @ INWARD[j] for j, g in enumerate(on_edges)]),
    )


def _linear() -> Tables:
    s = np.array([0.5])
    return Tables(
        Q=np.einsum("ja,jb,ia,kb->jik", EDGES, EDGES, SLOPES, SLOPES),  # stretch of edge j
        weights=np.array([0.5]),
        slopes=SLOPES[None],
        factors=np.ones((1, 3, 1)),
        middle=np.ones(1),
        bend=np.zeros((3, 3)),
        S=_double(MOMENTS),
        s=s,
        edge_weights=np.ones(1),
        turn=np.ones((1, 1)),
        along=np.einsum("ja,ia->ji", EDGES, SLOPES)[:, None],
        across=np.einsum("ja,ia->ji", INWARD, SLOPES)[:, None],
    )


def _double(tensors: Array) -> Array:
    return np.column_stack((tensors[:, 0, 0], tensors[:, 1, 1], 2.0 * tensors[:, 0, 1]))
