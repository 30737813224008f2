"""Hinges that close: their locks as elements of their own, and what to say of panels that meet. mm, N, rad.

Off the zone of `hinge_lock` a lock is nothing, so these passes run only where some hinge is in it.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.loading.load_step import hinge_name
from bh.mechanics.shared.assembly import add_lower, add_product, rotate
from bh.mechanics.shared.hinge_lock import ZONE, in_zone, lock, until_closed
from bh.mechanics.shared.kinematics import INNER_OPTIONS, OPTIONS, add_hinge_hessian, hinge_geometry
from bh.solvers.hinged import Stops
from bh.solvers.stops import KEPT
from meshes import SheetMesh

Array = NDArray[np.float64]
LARGEST_TURN = 1.3  # rad that any hinge may turn in one increment before the driver mistrusts it
HALF = 0.5  # of it that a hinge is left with which is held back
SHORT_OF = 0.8  # of the largest turn, for a hinge that would turn farther


@njit(**OPTIONS)
def lock_forces(x, hinges, k, f, L):  # type: ignore[no-untyped-def]
    """Energy of the locks (N mm); adds its gradient to f (n, 3) and writes the moments L (m,), N mm."""
    g = np.empty(12)
    energy = 0.0
    for h in range(len(hinges)):
        L[h] = 0.0
        if k[h] == 0.0:
            continue
        geometry = hinge_geometry(x, hinges[h, 0], hinges[h, 1], hinges[h, 2], hinges[h, 3], g)
        if in_zone(geometry[0]):
            more, L[h], _ = lock(geometry[0], k[h])
            energy += more
            for p in range(12):
                f[hinges[h, p // 3], p % 3] += L[h] * g[p]
    return energy


@njit(inline="always", **INNER_OPTIONS)
def _lock_matrix(x, hinge, k, moment, g, H):  # type: ignore[no-untyped-def]
    """Tangent of one lock into the lower triangle of H (12, 12); False where there is nothing."""
    geometry = hinge_geometry(x, hinge[0], hinge[1], hinge[2], hinge[3], g)
    if k == 0.0 or not (in_zone(geometry[0]) or moment != 0.0):
        return False
    stiffness = lock(geometry[0], k)[2] if in_zone(geometry[0]) else 0.0
    for p in range(12):
        for q in range(p + 1):
            H[p, q] = stiffness * g[p] * g[q]
    add_hinge_hessian(geometry, moment, H)
    return True


@njit(**OPTIONS)
def lock_tangent(x, hinges, k, L, frame_of, frames, slots, data):  # type: ignore[no-untyped-def]
    """Add the tangent of the locks with moments L to `data`."""
    g, H = np.empty(12), np.zeros((12, 12))
    for h in range(len(hinges)):
        if _lock_matrix(x, hinges[h], k[h], L[h], g, H):
            if len(frames) > 0:
                rotate(H, hinges[h], frame_of, frames)
            add_lower(H, np.int64(12), slots[h], data)


@njit(**OPTIONS)
def lock_rates(x, v, hinges, k, out):  # type: ignore[no-untyped-def]
    """Rates of the moments (m,) for velocities v (n, 3)."""
    g = np.empty(12)
    for h in range(len(hinges)):
        out[h] = 0.0
        geometry = hinge_geometry(x, hinges[h, 0], hinges[h, 1], hinges[h, 2], hinges[h, 3], g)
        if k[h] > 0.0 and in_zone(geometry[0]):
            turn = 0.0
            for p in range(12):
                turn += g[p] * v[hinges[h, p // 3], p % 3]
            out[h] = lock(geometry[0], k[h])[2] * turn


@njit(**OPTIONS)
def lock_force_rates(x, v, hinges, k, L, f):  # type: ignore[no-untyped-def]
    """Add the rate of the gradient of the locks for velocities v (n, 3) to f (n, 3)."""
    g, H = np.empty(12), np.zeros((12, 12))
    for h in range(len(hinges)):
        if _lock_matrix(x, hinges[h], k[h], L[h], g, H):
            add_product(H, hinges[h], v, f)


def penetration(mesh: SheetMesh, before: Array, after: Array) -> str:
    """Which panels passed through each other between dihedral angles (m,) of two states, or an empty string.

    Angles are known modulo a turn; a hinge passed 0 or 2 pi where the way through closed is the shorter one.

    Args:
        mesh: of the sheet.
        before: (m,) dihedral angles, rad.
        after: (m,) dihedral angles, rad.
    """
    jump = np.abs(after - before)
    if jump.max(initial=0.0) <= np.pi:
        return ""
    return f"the panels at {hinge_name(mesh, int(np.argmax(jump)))} would pass through each other"


def objection(mesh: SheetMesh, before: Array, after: Array, asked: Array) -> str:
    """Why an increment between dihedral angles (m,) of two states is not to be trusted, or an empty string.

    `asked` (m,) is how far the actuation turns each hinge, rad: that much it may turn more than the others.

    Args:
        mesh: of the sheet.
        before: (m,) dihedral angles, rad.
        after: (m,) dihedral angles, rad.
        asked: (m,) how far the actuation turns each hinge, rad.
    """
    turn = float((np.abs(after - before) - asked).max(initial=0.0))
    far = f"a hinge turned by {np.degrees(turn):.0f} degrees" if turn > LARGEST_TURN else ""
    return penetration(mesh, before, after) or far


def left_to_close(before: Array, after: Array) -> float:
    """Least part of its way to closed that a hinge is left with, of those that end in the zone of the locks; else 1.

    A way that began outside the zone counts from its edge.

    Args:
        before: (m,) dihedral angles, rad.
        after: (m,) dihedral angles, rad.
    """
    left = np.minimum(after, 2.0 * np.pi - after)
    had = np.minimum(np.minimum(before, 2.0 * np.pi - before), ZONE)
    return float((left / np.maximum(had, 1e-300)).min(initial=1.0, where=left < ZONE))


def stops(before: Array, after: Array) -> Stops:
    """Hinges that pass through closed, come too near to it or turn too far, and how far they may turn.

    A hinge about to close may go half of what it has left within the zone of its lock, one that turns too far nearly
    as far as is allowed.

    Args:
        before: (m,) dihedral angles, rad.
        after: (m,) dihedral angles behind the step, rad.
    """
    turn = after - before
    left, way = until_closed(after), until_closed(before)
    had = np.minimum(way, ZONE)
    closing = (np.abs(turn) > np.pi) | ((left < ZONE) & (left < KEPT * had))
    hinges = np.flatnonzero(closing | (np.abs(turn) > LARGEST_TURN))
    to_closed = np.where(before < np.pi, -1.0, 1.0) * (way - HALF * had)
    wanted = np.where(closing, to_closed, SHORT_OF * LARGEST_TURN * np.sign(turn))
    taken = (turn + np.pi) % (2.0 * np.pi) - np.pi
    return Stops(hinges, wanted[hinges], taken[hinges])


def panels_in_contact(mesh: SheetMesh, angles: Array, reference: Array, asked: NDArray[np.bool_]) -> str:
    """Which panels have met at a hinge (within the zone of closed), or an empty string.

    Only `asked` (m,) hinges count, and of them those that are not made closed (`reference` angles).

    Args:
        mesh: of the sheet.
        angles: (m,) dihedral angles, rad.
        reference: (m,) dihedral angles of the sheet as it is made, rad.
        asked: (m,) hinges that count.
    """
    left = np.where(asked & (until_closed(reference) >= ZONE), until_closed(angles), np.inf)
    if left.min(initial=np.inf) >= ZONE:
        return ""
    nearest = int(np.argmin(left))
    where = hinge_name(mesh, nearest)
    return f"the panels at {where} touch ({np.degrees(left[nearest]):.2g} degrees from closed)"
