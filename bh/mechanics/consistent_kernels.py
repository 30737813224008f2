"""Forces and tangent of the consistent formulation (docs/formulation.md), in one compiled pass over the triangles.

A triangle measures three half squares of its edges, gamma_k = (l_k^2 - L_k^2) / 2 (mm^2), and at its three edges the
angle theta_k (rad) between itself and the sheet's tangent plane at the edge, positive where the edge lies low as in a
valley. Edge k is opposite corner k. Its energy is 1/2 gamma.K.gamma + 1/2 theta.B.theta with constant 3 x 3 matrices.

theta_k is one of, as `kind[t, k]` says:

    NONE    0: the rotation of a free edge, already eliminated from B
    OWN     alpha: the edge's unknown rotation, `rotation[t, k]`
    TURN    phi - rest - alpha: what the hinge has turned and the other side has not taken (no alpha at a clamp)

The two sides of an edge thus add up to phi - rest. Only TURN edges make theta depend on positions: the four nodes
`quad[t, k]` of the hinge, of which a clamp's last one is `ghost[t, k]` (mm) beside its second. `place[t, k]` are their
rows among the nodes of the element: three corners, the wings across TURN edges, and one row for the rotations.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from bh.mechanics.assembly import _rotate, _scatter
from bh.mechanics.kinematics import OPTIONS, add_hinge_hessian, hinge_geometry

NONE, OWN, TURN = 0, 1, 2
FOUR = np.arange(4)


@njit(**OPTIONS)
def _turn_geometry(x, quad, ghost, xl, g):  # type: ignore[no-untyped-def]
    """`hinge_geometry` of a TURN edge; writes its gradient (12,), the ghost of a clamp moving with its edge."""
    for p in range(4):
        for i in range(3):
            xl[p, i] = x[quad[p], i]
    for i in range(3):
        xl[3, i] += ghost[i]
    return hinge_geometry(xl, FOUR, g)


@njit(inline="always", **OPTIONS)
def _stretches(x, corners, d, gamma, rest_square):  # type: ignore[no-untyped-def]
    """Edge vectors d (3, 3) of a triangle, edge k from corner k + 1 to k + 2, and gamma (3,)."""
    for k in range(3):
        a, b = corners[(k + 1) % 3], corners[(k + 2) % 3]
        square = 0.0
        for i in range(3):
            d[k, i] = x[b, i] - x[a, i]
            square += d[k, i] * d[k, i]
        gamma[k] = 0.5 * (square - rest_square[k])


@njit(**OPTIONS)
def sheet_forces(  # type: ignore[no-untyped-def]
    x, alpha, triangles, rest_square, K, kind, quad, ghost, rest, rotation, B, f, r, N, M, energy
):
    """The sum of squared element forces (N^2); adds the gradient of the energy to f (n, 3) and r (rotations,).

    `rest` (t, 3) are rest angles. Writes the forces N = K gamma (t, 3), N/mm, the moments M = B theta (t, 3), N mm,
    and the energies of stretching and bending of every triangle (t, 2), N mm.
    """
    d, gamma, theta = np.empty((3, 3)), np.empty(3), np.empty(3)
    xl, g = np.empty((4, 3)), np.empty((3, 12))
    size = 0.0
    for t in range(len(triangles)):
        corners = triangles[t]
        stretching, bending = 0.0, 0.0
        _stretches(x, corners, d, gamma, rest_square[t])
        for k in range(3):
            s = K[t, k, 0] * gamma[0] + K[t, k, 1] * gamma[1] + K[t, k, 2] * gamma[2]
            N[t, k] = s
            stretching += 0.5 * s * gamma[k]
            size += s * s * rest_square[t, k]
            a, b = corners[(k + 1) % 3], corners[(k + 2) % 3]
            for i in range(3):
                f[a, i] -= s * d[k, i]
                f[b, i] += s * d[k, i]
            theta[k] = alpha[rotation[t, k]] if rotation[t, k] >= 0 else 0.0
            if kind[t, k] == TURN:
                geometry = _turn_geometry(x, quad[t, k], ghost[t, k], xl, g[k])
                theta[k] = geometry[0] - rest[t, k] - theta[k]
        for k in range(3):
            s = B[t, k, 0] * theta[0] + B[t, k, 1] * theta[1] + B[t, k, 2] * theta[2]
            M[t, k] = s
            bending += 0.5 * s * theta[k]
            if rotation[t, k] >= 0:
                r[rotation[t, k]] += s if kind[t, k] == OWN else -s
            if kind[t, k] == TURN:
                size += s * s * (g[k, 0] * g[k, 0] + g[k, 1] * g[k, 1] + g[k, 2] * g[k, 2])
                for p in range(4):
                    for i in range(3):
                        f[quad[t, k, p], i] += s * g[k, 3 * p + i]
        energy[t, 0], energy[t, 1] = stretching, bending
    return size


@njit(**OPTIONS)
def spring_forces(x, alpha, hinges, stiffness, rest, couple, rotation, f, r, S, turns):  # type: ignore[no-untyped-def]
    """The same for spring creases: energy 1/2 k turn^2 + couple turn with turn = phi - alpha_1 - alpha_2 - rest."""
    g = np.empty(12)
    energy, size = 0.0, 0.0
    for h in range(len(hinges)):
        geometry = hinge_geometry(x, hinges[h], g)
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
    return energy, size


@njit(**OPTIONS)
def _add_placed(H, small, place, offset):  # type: ignore[no-untyped-def]
    """Add the lower triangle of `small` (12, 12) to that of H; `place` may name a row twice (a clamp's ghost)."""
    for p in range(12):
        P = 3 * place[p // 3] + p % 3 + offset
        for q in range(p + 1):
            Q = 3 * place[q // 3] + q % 3 + offset
            if P > Q:
                H[P, Q] += small[p, q]
            elif P < Q or p == q:
                H[Q, P] += small[p, q]
            else:
                H[P, P] += 2.0 * small[p, q]


@njit(**OPTIONS)
def _triangle_matrix(x, corners, rest_square, K, N, kind, quad, ghost, place, rotation, B, M, work):  # type: ignore[no-untyped-def]
    """Tangent of one triangle with element forces N and M, into the lower triangle of work's H."""
    H, G, W, small, d, gamma, xl, g = work
    width = len(H)
    last = width - 3
    H[:, :] = 0.0
    G[:, :] = 0.0
    _stretches(x, corners, d, gamma, rest_square)
    # stretching: edge k pulls at corners k + 1 and k + 2, so that it has the vector d_k - d_(k - 1) signs below
    for k in range(3):
        low, high = 3 * ((k + 1) % 3), 3 * ((k + 2) % 3)
        for i in range(3):
            G[k, low + i] = -d[k, i]
            G[k, high + i] = d[k, i]
    for k in range(3):
        for j in range(9):
            W[k, j] = K[k, 0] * G[0, j] + K[k, 1] * G[1, j] + K[k, 2] * G[2, j]
    for i in range(9):
        for j in range(i + 1):
            H[i, j] = G[0, i] * W[0, j] + G[1, i] * W[1, j] + G[2, i] * W[2, j]
    for k in range(3):
        low, high = 3 * ((k + 1) % 3), 3 * ((k + 2) % 3)
        above, below = max(low, high), min(low, high)
        for i in range(3):
            H[low + i, low + i] += N[k]
            H[high + i, high + i] += N[k]
            H[above + i, below + i] -= N[k]
    # bending
    for k in range(3):
        for j in range(9):
            G[k, j] = 0.0
        if kind[k] == OWN:
            G[k, last + k] = 1.0
        elif kind[k] == TURN:
            geometry = _turn_geometry(x, quad[k], ghost[k], xl, g)
            for p in range(4):
                for i in range(3):
                    G[k, 3 * place[k, p] + i] += g[3 * p + i]
            if rotation[k] >= 0:
                G[k, last + k] = -1.0
            small[:, :] = 0.0
            add_hinge_hessian(geometry, M[k], small)
            _add_placed(H, small, place[k], 0)
    for k in range(3):
        for j in range(width):
            W[k, j] = B[k, 0] * G[0, j] + B[k, 1] * G[1, j] + B[k, 2] * G[2, j]
    for i in range(width):
        g0, g1, g2 = G[0, i], G[1, i], G[2, i]
        for j in range(i + 1):
            H[i, j] += g0 * W[0, j] + g1 * W[1, j] + g2 * W[2, j]


@njit(**OPTIONS)
def _spring_matrix(x, hinge, stiffness, s, H, small, g):  # type: ignore[no-untyped-def]
    """Tangent of a spring crease for its four nodes and two rotations into the lower triangle of H (15, 15)."""
    H[:, :] = 0.0
    small[:, :] = 0.0
    add_hinge_hessian(hinge_geometry(x, hinge, g), s, small)
    for p in range(12):
        for q in range(p + 1):
            H[p, q] = small[p, q] + stiffness * g[p] * g[q]
        H[12, p] = H[13, p] = -stiffness * g[p]
    H[12, 12] = H[13, 12] = H[13, 13] = stiffness


@njit(**OPTIONS)
def _workspace(width):  # type: ignore[no-untyped-def]
    return (
        np.empty((width, width)), np.empty((3, width)), np.empty((3, width)), np.zeros((12, 12)),
        np.empty((3, 3)), np.empty(3), np.empty((4, 3)), np.empty(12),
    )  # fmt: skip


@njit(**OPTIONS)
def sheet_tangent(  # type: ignore[no-untyped-def]
    x, triangles, rest_square, K, N, kind, quad, ghost, place, rotation, B, M, nodes, frame_of, frames, slots, data
):
    """Add the tangent of all triangles to `data`; `nodes` (t, p) are the rows of the elements (for local axes)."""
    work = _workspace(3 * nodes.shape[1])
    H = work[0]
    turned = len(frames) > 0
    for t in range(len(triangles)):
        _triangle_matrix(
            x, triangles[t], rest_square[t], K[t], N[t], kind[t], quad[t], ghost[t], place[t], rotation[t],
            B[t], M[t], work,
        )  # fmt: skip
        if turned:
            _rotate(H, nodes[t], frame_of, frames)
        _scatter(H, len(H), slots[t], data)


@njit(**OPTIONS)
def spring_tangent(x, hinges, stiffness, S, nodes, frame_of, frames, slots, data):  # type: ignore[no-untyped-def]
    """The same for spring creases."""
    H, small, g = np.empty((15, 15)), np.zeros((12, 12)), np.empty(12)
    for h in range(len(hinges)):
        _spring_matrix(x, hinges[h], stiffness[h], S[h], H, small, g)
        if len(frames) > 0:
            _rotate(H, nodes[h], frame_of, frames)
        _scatter(H, 15, slots[h], data)


@njit(**OPTIONS)
def sheet_rates(  # type: ignore[no-untyped-def]
    x, v, w, triangles, K, kind, quad, ghost, rest_rate, rotation, B, out_N, out_M
):
    """Rates of the element forces, (t, 3) each, for velocities v (n, 3), w (rotations,) and `rest_rate` (t, 3).

    These are the forces that the tangent at x predicts.
    """
    gamma, theta = np.empty(3), np.empty(3)
    xl, g = np.empty((4, 3)), np.empty(12)
    for t in range(len(triangles)):
        for k in range(3):
            a, b = triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
            gamma[k] = 0.0
            for i in range(3):
                gamma[k] += (x[b, i] - x[a, i]) * (v[b, i] - v[a, i])
            theta[k] = w[rotation[t, k]] if rotation[t, k] >= 0 else 0.0
            if kind[t, k] == TURN:
                _turn_geometry(x, quad[t, k], ghost[t, k], xl, g)
                turn = -rest_rate[t, k]
                for p in range(4):
                    for i in range(3):
                        turn += g[3 * p + i] * v[quad[t, k, p], i]
                theta[k] = turn - theta[k]
        for k in range(3):
            out_N[t, k] = K[t, k, 0] * gamma[0] + K[t, k, 1] * gamma[1] + K[t, k, 2] * gamma[2]
            out_M[t, k] = B[t, k, 0] * theta[0] + B[t, k, 1] * theta[1] + B[t, k, 2] * theta[2]


@njit(**OPTIONS)
def spring_rates(x, v, w, hinges, stiffness, rest_rate, couple_rate, rotation, out, turns):  # type: ignore[no-untyped-def]
    """Rates of the spring moments and of their turns (h,)."""
    g = np.empty(12)
    for h in range(len(hinges)):
        hinge_geometry(x, hinges[h], g)
        turn = -w[rotation[h, 0]] - w[rotation[h, 1]] - rest_rate[h]
        for p in range(4):
            for i in range(3):
                turn += g[3 * p + i] * v[hinges[h, p], i]
        out[h], turns[h] = stiffness[h] * turn + couple_rate[h], turn


@njit(**OPTIONS)
def force_rates(x, v, triangles, kind, quad, ghost, rotation, N, M, dN, dM, hinges, S, dS, turns, f, r):  # type: ignore[no-untyped-def]
    """Add the rates of the gradient to f (n, 3) and r (rotations,): rates of the element forces at fixed geometry,

    and the element forces times the rate of their gradients for velocities v (n, 3) of the nodes. Everything in global
    axes and with no support left out. `turns` (h, 2) are the rotations of the springs.
    """
    xl, g, small = np.empty((4, 3)), np.empty(12), np.zeros((12, 12))
    for t in range(len(triangles)):
        for k in range(3):
            a, b = triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
            for i in range(3):
                s = dN[t, k] * (x[b, i] - x[a, i]) + N[t, k] * (v[b, i] - v[a, i])
                f[a, i] -= s
                f[b, i] += s
            if rotation[t, k] >= 0:
                r[rotation[t, k]] += dM[t, k] if kind[t, k] == OWN else -dM[t, k]
            if kind[t, k] == TURN:
                geometry = _turn_geometry(x, quad[t, k], ghost[t, k], xl, g)
                small[:, :] = 0.0
                add_hinge_hessian(geometry, M[t, k], small)
                _add_hinge_rate(small, g, dM[t, k], quad[t, k], v, f)
    for h in range(len(hinges)):
        r[turns[h, 0]] -= dS[h]
        r[turns[h, 1]] -= dS[h]
        small[:, :] = 0.0
        add_hinge_hessian(hinge_geometry(x, hinges[h], g), S[h], small)
        _add_hinge_rate(small, g, dS[h], hinges[h], v, f)


@njit(**OPTIONS)
def _add_hinge_rate(small, g, rate, nodes, v, f):  # type: ignore[no-untyped-def]
    for p in range(12):
        value = rate * g[p]
        for q in range(12):
            value += (small[p, q] if q <= p else small[q, p]) * v[nodes[q // 3], q % 3]
        f[nodes[p // 3], p % 3] += value


@njit(**OPTIONS)
def choose_sides(sides, counted, triangles):  # type: ignore[no-untyped-def]
    """(m,) which side of a hinge is to measure its turn, so that as few triangles as possible measure three.

    `sides` (m, 2) are its triangles. A triangle's element has one wing for each turn that it measures; what matters is
    the largest number. Hinges that are not `counted` get 0.
    """
    load = np.zeros(triangles, dtype=np.int64)
    chosen = np.zeros(len(sides), dtype=np.int64)
    for h in range(len(sides)):
        if counted[h]:
            chosen[h] = 1 if load[sides[h, 1]] <= load[sides[h, 0]] else 0
            load[sides[h, chosen[h]]] += 1
    for _ in range(3):
        for h in range(len(sides)):
            here, there = sides[h, chosen[h]], sides[h, 1 - chosen[h]]
            if counted[h] and load[here] > load[there] + 1:
                chosen[h] = 1 - chosen[h]
                load[here] -= 1
                load[there] += 1
    return chosen


@njit(**OPTIONS)
def dof_slots(dofs, position, stride, slots):  # type: ignore[no-untyped-def]
    """Keys row + stride * column of the lower entries of every element (e, w) of unknowns, -1 where one is missing."""
    for e in range(len(dofs)):
        at = 0
        for i in range(dofs.shape[1]):
            for j in range(i + 1):
                a, b = dofs[e, i], dofs[e, j]
                if a < 0 or b < 0:
                    slots[e, at] = -1
                else:
                    row, column = position[a], position[b]
                    slots[e, at] = max(row, column) + stride * min(row, column)
                at += 1


@njit(**OPTIONS)
def rotation_matrix(rotation, kind, B, turns, stiffness, rows, columns, values):  # type: ignore[no-untyped-def]
    """Entries of the constant Hessian of the energy in the rotations alone; returns how many."""
    at = 0
    for t in range(len(rotation)):
        for k in range(3):
            for j in range(3):
                if rotation[t, k] >= 0 and rotation[t, j] >= 0:
                    rows[at], columns[at] = rotation[t, k], rotation[t, j]
                    values[at] = B[t, k, j] if kind[t, k] == kind[t, j] else -B[t, k, j]
                    at += 1
    for h in range(len(turns)):
        for k in range(2):
            for j in range(2):
                rows[at], columns[at], values[at] = turns[h, k], turns[h, j], stiffness[h]
                at += 1
    return at


@njit(**OPTIONS)
def largest_turn(x, y, hinges):  # type: ignore[no-untyped-def]
    """Largest change of a dihedral angle between positions x and y, rad."""
    g = np.empty(12)
    largest = 0.0
    for h in range(len(hinges)):
        before, after = hinge_geometry(x, hinges[h], g)[0], hinge_geometry(y, hinges[h], g)[0]
        largest = max(largest, abs(after - before))
    return largest if math.isfinite(largest) else math.inf
