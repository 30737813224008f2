"""Rigid motions that the supports of a shell leave free, what holds them without force, and motions in words."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bh.model.constraints import MOTIONS, free_motions, rigid_motions
from fem.components import Components
from fem.creases import Connectors
from fem.shell import ShellElements
from meshes.curved import ElementMesh
from meshes.topology import Ints

Array = NDArray[np.float64]


def free_rigid_motions(components: Components, elements: ShellElements, x: Array, B: Array) -> Array:
    """(n, r) orthonormal rates of the unknowns in the rigid motions left free at positions x (all nodes).

    Edges turn such that no curvature arises, with B (t, 6 m, w) the gradients there.

    Args:
        components: of the step.
        elements: of the sheet.
        x: (n, 3) positions of all nodes, mm.
        B: (t, 6 m, w) gradients there.
    """
    motions = rigid_motions(x) @ free_motions(x, components.constraints)
    count = motions.shape[1]
    if count == 0:
        return np.zeros((len(components.free), 0))
    moves = motions.reshape(-1, 3, count)
    table, width = elements.tables, elements.moves
    own, turns = table.measures // 3, table.rotations
    element = moves[elements.mesh.triangles].reshape(-1, width, count)
    whole = np.zeros((len(components.number), count))
    for column in range(count):
        whole[: components.first_alpha, column] = components.to_local(moves[..., column]).ravel()
    for j in range(3):
        first, column = table.measures + own * j, width + turns * j
        rows, columns = slice(first, first + turns), slice(column, column + turns)
        rate = -np.linalg.solve(B[:, rows, columns], B[:, rows, :width] @ element)
        whole[components.of_element[:, columns]] = elements.loops.sides[:, j, None, None] * rate
    out: Array = np.linalg.qr(whole[components.free])[0]
    return out


def ground_triangle(components: Components, elements: ShellElements) -> int:
    """The triangle that is held against rigid motions: in the middle, with few supports of its own.

    Args:
        components: of the step.
        elements: of the sheet.
    """
    centres = elements.mesh.nodes[elements.mesh.triangles].mean(axis=1)
    distance = np.linalg.norm(centres - elements.mesh.nodes.mean(axis=0), axis=1)
    supported = (components.number[components.of_element[:, : elements.moves]] < 0).sum(axis=1)
    return int(np.lexsort((distance, supported))[0])


def ground_stiffness(
    components: Components, elements: ShellElements, triangle: int, Z: Array
) -> tuple[Ints, Array]:
    """Unknowns (3 n,) of a triangle (-1 if prescribed) and a stiffness (3 n, 3 n) against its rigid motions Z.

    Args:
        components: of the step.
        elements: of the sheet.
        triangle: that is held.
        Z: (n, r) orthonormal free rigid motions.

    Returns:
        unknowns and stiffness.
    """
    number = components.number[components.of_element[triangle, : elements.moves]]
    rows = np.where(number[:, None] >= 0, Z[np.maximum(number, 0)], 0.0)
    Q = np.linalg.qr(rows)[0]
    size = float(elements.membrane[triangle].trace()) / (elements.tables.measures * elements.areas[triangle])
    return number, size * (Q @ Q.T)


def describe_motion(mesh: ElementMesh, creases: Connectors, x: Array, moves: Array, beta: Array) -> str:
    """What moves, as a clause to be followed by how: the whole sheet, a crease, or a few nodes.

    Args:
        mesh: elements.
        creases: creased edges.
        x: (n, 3) positions of all nodes, mm.
        moves: (n, 3) their motion, of any size.
        beta: (c, r) the motion of fold angles.
    """
    size = float(np.linalg.norm(moves))
    if size > 0.0:
        rigid = rigid_motions(x)
        rigid /= np.linalg.norm(rigid, axis=0)
        share, *_ = np.linalg.lstsq(rigid, moves.ravel() / size, rcond=None)
        if float(np.linalg.norm(rigid @ share)) > 0.99:
            most = np.abs(share).max()
            named = " and ".join(MOTIONS[k] for k in np.flatnonzero(np.abs(share) > 0.3 * most))
            return f"the whole sheet moves ({named})"
    total = float(np.vdot(beta, beta))
    for crease in mesh.sheet.creases:
        rows = creases.of_edge[mesh.sheet.topology.find_edges(mesh.sheet.crease_edges(crease))]
        if float((beta[rows[rows >= 0]] ** 2).sum()) > 0.5 * total:
            return f"crease '{crease}' turns"
    node = int(np.argmax(np.linalg.norm(moves, axis=1)))
    at = ", ".join(f"{c:.4g}" for c in x[node])
    return f"the sheet moves near ({at})"
