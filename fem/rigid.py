"""Rigid motions that the supports of a shell leave free, what holds them without force, and motions in words."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bh.model.constraints import MOTIONS, free_motions, orthonormal, rigid_motions
from fem.components import Components
from fem.creases import Connectors
from fem.kernels import Frames
from fem.shell import ShellElements, edge_tangents, unit
from meshes.curved import ElementMesh
from meshes.topology import Ints

Array = NDArray[np.float64]


def free_rigid_motions(components: Components, elements: ShellElements, frames: Frames, x: Array) -> Array:
    """(n, r) orthonormal rates of the unknowns in the rigid motions left free at positions x (all nodes).

    Edges turn such that no curvature arises. Where the sheet rotates at the rate w, the conormal at a point of an edge
    with tangent t rises above the frame that was carried there from the tangent t0 at the rate

        -w . (t0 + t) / (1 + t0 . t),

    which is -w . t less the spin of the frame (`fem.points`). What of it the functions of the edge can take is taken as
    curvatures are measured, weighted by 1 / |dx/ds| of the flat edge.

    Args:
        components: of the step.
        elements: of the sheet.
        frames: of the step.
        x: (n, 3) positions of all nodes, mm.
    """
    allowed = free_motions(x, components.constraints)
    motions = rigid_motions(x) @ allowed
    count = motions.shape[1]
    if count == 0:
        return np.zeros((len(components.free), 0))
    whole = np.zeros((len(components.number), count))
    whole[: components.first_alpha] = motions
    if (components.constraints.frame_of >= 0).any():
        for column in range(count):
            local = components.to_local(motions[:, column].reshape(-1, 3))
            whole[: components.first_alpha, column] = local.ravel()
    t = unit(edge_tangents(elements.mesh, x))
    both = frames.t0 + t
    both /= 1.0 + np.einsum("epc,epc->ep", frames.t0, t)[..., None]
    turns = -np.einsum("erp,epc->erc", elements.edge_fit, both)
    whole[components.first_alpha : components.first_beta] = (turns @ allowed[3:]).reshape(-1, count)
    return orthonormal(whole[components.free])


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
