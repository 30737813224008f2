"""Forces and tangent of the consistent formulation (docs/formulation.md): compiled passes over its elements.

Stretching is in `membrane_kernels`.

Bending: a patch of one or more triangles measures angles theta (rad), its energy is 1/2 theta.B.theta. At an edge of
the patch theta is the angle between the triangle and the sheet's tangent plane at the edge, positive as in a valley; at
an edge inside it is what the two sides take together (how they share it is already eliminated from B). As
`kind[c, a]` says, theta_a is

    NONE    0: not used (patches have different numbers of angles)
    OWN     alpha: the edge's unknown rotation, `rotation[c, a]`
    TURN    phi - rest - alpha: what the hinge has turned and the patch across has not taken (no alpha inside, nor at a
            clamp)

The two sides of an edge thus add up to phi - rest. Only TURN angles depend on positions: those of the four nodes
`quad[c, a]` of the hinge, of which a clamp's last one is `ghost[c, a]` (mm) beside its second. The matrix of a patch
has three rows for each of its nodes, where `place[c, a]` are those of the quad, then one for each rotation,
`column[c, a]`. mm, N, rad.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bh.mechanics.shared.assembly import add_lower, rotate
from bh.mechanics.shared.hinge_lock import in_zone
from bh.mechanics.shared.kinematics import INNER_OPTIONS, OPTIONS, add_hinge_hessian, hinge_geometry

NONE, OWN, TURN = 0, 1, 2


# ------------------------------------------------------------------------------------------- bending


@njit(**INNER_OPTIONS)
def _clear(matrix):  # type: ignore[no-untyped-def]
    """Set all entries to zero; an assignment to a slice takes longer to compile."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            matrix[i, j] = 0.0


@njit(**INNER_OPTIONS)
def _turn_geometry(x, quad, ghost, xl, g):  # type: ignore[no-untyped-def]
    """`hinge_geometry` of a TURN edge; writes its gradient (12,), the ghost of a clamp moving with its edge."""
    for p in range(4):
        for i in range(3):
            xl[p, i] = x[quad[p], i]
    for i in range(3):
        xl[3, i] += ghost[i]
    return hinge_geometry(xl, np.int64(0), np.int64(1), np.int64(2), np.int64(3), g)


@njit(**OPTIONS)
def bending_forces(x, alpha, kind, quad, ghost, rest, rotation, B, f, r, M, theta):  # type: ignore[no-untyped-def]
    """Sum of squared forces (N^2), and whether a hinge is about to close.

    Adds the gradient of the energy to f (n, 3) and, for alpha, to r (rotations,). `rest` (c, a) are rest angles.
    Writes the angles theta and the moments M = B theta (c, a), N mm.
    """
    xl, g = np.empty((4, 3)), np.empty((kind.shape[1], 12))
    size, closing = 0.0, False
    for c in range(len(kind)):
        for a in range(kind.shape[1]):
            angle = alpha[rotation[c, a]] if rotation[c, a] >= 0 else 0.0
            if kind[c, a] == TURN:
                geometry = _turn_geometry(x, quad[c, a], ghost[c, a], xl, g[a])
                angle = geometry[0] - rest[c, a] - angle
                closing = closing or in_zone(geometry[0])
            theta[c, a] = angle
        for a in range(kind.shape[1]):
            if kind[c, a] == NONE:
                M[c, a] = 0.0
                continue
            s = 0.0
            for b in range(kind.shape[1]):
                s += B[c, a, b] * theta[c, b]
            M[c, a] = s
            if rotation[c, a] >= 0:
                r[rotation[c, a]] += s if kind[c, a] == OWN else -s
            if kind[c, a] == TURN:
                size += s * s * (g[a, 0] * g[a, 0] + g[a, 1] * g[a, 1] + g[a, 2] * g[a, 2])
                for p in range(4):
                    for i in range(3):
                        f[quad[c, a, p], i] += s * g[a, 3 * p + i]
    return size, closing


@njit(**OPTIONS)
def bending_angles(x, alpha, kind, quad, ghost, rest, rotation, theta):  # type: ignore[no-untyped-def]
    """Writes the angles (c, a) alone; whether a hinge is about to close."""
    xl, g = np.empty((4, 3)), np.empty(12)
    closing = False
    for c in range(len(kind)):
        for a in range(kind.shape[1]):
            angle = alpha[rotation[c, a]] if rotation[c, a] >= 0 else 0.0
            if kind[c, a] == TURN:
                geometry = _turn_geometry(x, quad[c, a], ghost[c, a], xl, g)
                angle = geometry[0] - rest[c, a] - angle
                closing = closing or in_zone(geometry[0])
            theta[c, a] = angle
    return closing


@njit(**OPTIONS)
def bending_gradient(x, kind, quad, ghost, rotation, M, f, r):  # type: ignore[no-untyped-def]
    """Sum of squared forces (N^2); adds the gradient of the energy to f and r for moments M (c, a) of any law."""
    xl, g = np.empty((4, 3)), np.empty(12)
    size = 0.0
    for c in range(len(kind)):
        for a in range(kind.shape[1]):
            s = M[c, a]
            if rotation[c, a] >= 0:
                r[rotation[c, a]] += s if kind[c, a] == OWN else -s
            if kind[c, a] == TURN:
                _turn_geometry(x, quad[c, a], ghost[c, a], xl, g)
                size += s * s * (g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
                for p in range(4):
                    for i in range(3):
                        f[quad[c, a, p], i] += s * g[3 * p + i]
    return size


@njit(**INNER_OPTIONS)
def _add_placed(H, small, place):  # type: ignore[no-untyped-def]
    """Add the lower triangle of `small` (12, 12) to that of H; `place` may name a row twice (a clamp's ghost)."""
    for p in range(12):
        P = 3 * place[p // 3] + p % 3
        for q in range(p + 1):
            Q = 3 * place[q // 3] + q % 3
            if P > Q:
                H[P, Q] += small[p, q]
            elif P < Q or p == q:
                H[Q, P] += small[p, q]
            else:
                H[P, P] += 2.0 * small[p, q]


@njit(**OPTIONS)
def bending_tangent(  # type: ignore[no-untyped-def]
    x, kind, quad, ghost, place, rotation, column, width, B, M, nodes, frame_of, frames, slots, data
):
    """Add the tangent of the patches with moments M to `data`; `nodes` (c, p) are their nodes, then -1.

    Returns whether a hinge is about to close.
    """
    closing = False
    angles, most = kind.shape[1], 3 * nodes.shape[1]
    H, small = np.empty((most, most)), np.empty((12, 12))
    G, W = np.empty((angles, most)), np.empty((angles, most))
    xl, g = np.empty((4, 3)), np.empty(12)
    for c in range(len(kind)):
        n = width[c]
        _clear(H)
        for a in range(angles):
            for i in range(n):
                G[a, i] = 0.0
            if kind[c, a] == OWN:
                G[a, column[c, a]] = 1.0
            elif kind[c, a] == TURN:
                geometry = _turn_geometry(x, quad[c, a], ghost[c, a], xl, g)
                closing = closing or in_zone(geometry[0])
                for p in range(4):
                    for i in range(3):
                        G[a, 3 * place[c, a, p] + i] += g[3 * p + i]
                if rotation[c, a] >= 0:
                    G[a, column[c, a]] = -1.0
                _clear(small)
                add_hinge_hessian(geometry, M[c, a], small)
                _add_placed(H, small, place[c, a])
        for a in range(angles):
            for i in range(n):
                W[a, i] = 0.0
            for b in range(angles):
                for j in range(n):
                    W[a, j] += B[c, a, b] * G[b, j]
        for i in range(n):
            for a in range(angles):
                if G[a, i] != 0.0:
                    for j in range(i + 1):
                        H[i, j] += G[a, i] * W[a, j]
        if len(frames) > 0:
            rotate(H, nodes[c], frame_of, frames)
        add_lower(H, n, slots[c], data)
    return closing


@njit(**OPTIONS)
def bending_rates(x, v, w, kind, quad, ghost, rest_rate, rotation, B, out):  # type: ignore[no-untyped-def]
    """Rates of the moments (c, a) for velocities v (n, 3), w (rotations,) and `rest_rate` (c, a)."""
    xl, g, theta = np.empty((4, 3)), np.empty(12), np.empty(kind.shape[1])
    for c in range(len(kind)):
        for a in range(kind.shape[1]):
            theta[a] = w[rotation[c, a]] if rotation[c, a] >= 0 else 0.0
            if kind[c, a] == TURN:
                _turn_geometry(x, quad[c, a], ghost[c, a], xl, g)
                turn = -rest_rate[c, a]
                for p in range(4):
                    for i in range(3):
                        turn += g[3 * p + i] * v[quad[c, a, p], i]
                theta[a] = turn - theta[a]
        for a in range(kind.shape[1]):
            out[c, a] = 0.0
            for b in range(kind.shape[1]):
                out[c, a] += B[c, a, b] * theta[b]


# ------------------------------------------------------------------------------------------- spring creases


@njit(**OPTIONS)
def spring_forces(x, alpha, hinges, stiffness, rest, couple, rotation, f, r, S, turns):  # type: ignore[no-untyped-def]
    """Energy (N mm) and sum of squared forces of spring creases, and whether one is about to close.

    Adds the gradient to f and r. Energy 1/2 k turn^2 + couple turn with
    turn = phi - alpha_1 - alpha_2 - rest. Writes moments S and turns (h,).
    """
    g = np.empty(12)
    energy, size, closing = 0.0, 0.0, False
    for h in range(len(hinges)):
        geometry = hinge_geometry(x, hinges[h, 0], hinges[h, 1], hinges[h, 2], hinges[h, 3], g)
        closing = closing or in_zone(geometry[0])
        turn = geometry[0] - alpha[rotation[h, 0]] - alpha[rotation[h, 1]] - rest[h]
        s = stiffness[h] * turn + couple[h]
        S[h], turns[h] = s, turn
        energy += (0.5 * stiffness[h] * turn + couple[h]) * turn
        size += s * s * (g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
        r[rotation[h, 0]] -= s
        r[rotation[h, 1]] -= s
        for p in range(4):
            for i in range(3):
                f[hinges[h, p], i] += s * g[3 * p + i]
    return energy, size, closing


@njit(**INNER_OPTIONS)
def _spring_matrix(x, hinge, stiffness, s, H, small, g):  # type: ignore[no-untyped-def]
    """Tangent of a spring crease for its four nodes and two rotations into the lower triangle of H (14, 14).

    Returns whether it is about to close.
    """
    _clear(H)
    _clear(small)
    geometry = hinge_geometry(x, hinge[0], hinge[1], hinge[2], hinge[3], g)
    add_hinge_hessian(geometry, s, small)
    for p in range(12):
        for q in range(p + 1):
            H[p, q] = small[p, q] + stiffness * g[p] * g[q]
        H[12, p] = H[13, p] = -stiffness * g[p]
    H[12, 12] = H[13, 12] = H[13, 13] = stiffness
    return in_zone(geometry[0])


@njit(**OPTIONS)
def spring_tangent(x, hinges, stiffness, S, nodes, frame_of, frames, slots, data):  # type: ignore[no-untyped-def]
    """Add the tangent of spring creases with moments S to `data`; `nodes` (h, 5) are their nodes, then -1."""
    H, small, g = np.empty((15, 15)), np.empty((12, 12)), np.empty(12)
    closing = False
    for h in range(len(hinges)):
        closing = _spring_matrix(x, hinges[h], stiffness[h], S[h], H, small, g) or closing
        if len(frames) > 0:
            rotate(H, nodes[h], frame_of, frames)
        add_lower(H, np.int64(14), slots[h], data)
    return closing


@njit(**OPTIONS)
def spring_rates(x, v, w, hinges, stiffness, rest_rate, couple_rate, rotation, out, turns):  # type: ignore[no-untyped-def]
    """Rates of the spring moments and of their turns (h,)."""
    g = np.empty(12)
    for h in range(len(hinges)):
        hinge_geometry(x, hinges[h, 0], hinges[h, 1], hinges[h, 2], hinges[h, 3], g)
        turn = -w[rotation[h, 0]] - w[rotation[h, 1]] - rest_rate[h]
        for p in range(4):
            for i in range(3):
                turn += g[3 * p + i] * v[hinges[h, p], i]
        out[h], turns[h] = stiffness[h] * turn + couple_rate[h], turn


# ------------------------------------------------------------------------------------------- rates of the gradient


@njit(**OPTIONS)
def bending_force_rates(x, v, kind, quad, ghost, rotation, M, dM, f, r):  # type: ignore[no-untyped-def]
    """Add the rate of the gradient to f (n, 3) and r (rotations,).

    Rates dM at these positions, M where they move by v.
    """
    xl, g, small = np.empty((4, 3)), np.empty(12), np.empty((12, 12))
    for c in range(len(kind)):
        for a in range(kind.shape[1]):
            if rotation[c, a] >= 0:
                r[rotation[c, a]] += dM[c, a] if kind[c, a] == OWN else -dM[c, a]
            if kind[c, a] == TURN:
                geometry = _turn_geometry(x, quad[c, a], ghost[c, a], xl, g)
                _clear(small)
                add_hinge_hessian(geometry, M[c, a], small)
                _add_hinge_rate(small, g, dM[c, a], quad[c, a], v, f)


@njit(**OPTIONS)
def spring_force_rates(x, v, hinges, rotation, S, dS, f, r):  # type: ignore[no-untyped-def]
    """The same for spring creases."""
    g, small = np.empty(12), np.empty((12, 12))
    for h in range(len(hinges)):
        r[rotation[h, 0]] -= dS[h]
        r[rotation[h, 1]] -= dS[h]
        _clear(small)
        add_hinge_hessian(
            hinge_geometry(x, hinges[h, 0], hinges[h, 1], hinges[h, 2], hinges[h, 3], g), S[h], small
        )
        _add_hinge_rate(small, g, dS[h], hinges[h], v, f)


@njit(**INNER_OPTIONS)
def _add_hinge_rate(small, g, rate, nodes, v, f):  # type: ignore[no-untyped-def]
    for p in range(12):
        value = rate * g[p]
        for q in range(12):
            value += (small[p, q] if q <= p else small[q, p]) * v[nodes[q // 3], q % 3]
        f[nodes[p // 3], p % 3] += value
