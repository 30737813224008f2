"""Values at the corners of triangles from values of the triangles, panel by panel and never across a crease."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
ENOUGH = 5  # triangles around a node that a plane is put through; fewer ask their neighbours, too
FLAT = 1e-3  # least eigenvalue of the (scaled) equations of a plane that is determined


def fans(mesh: SheetMesh, cut: Ints) -> tuple[int, Ints]:
    """Corners that share a value: those of triangles that meet around a node without a crease between them.

    Args:
        mesh: of the sheet.
        cut: (k,) rows of `mesh.topology.hinges` across which nothing is shared.

    Returns:
        their number, and (t, 3) which of them each corner is in.
    """
    topology = mesh.topology
    joined = np.ones(len(topology.hinges), dtype=bool)
    joined[cut] = False
    ends = topology.hinges[joined, 1:3]
    sides = topology.edge_triangles[topology.hinge_edges[joined]]
    pairs = []
    for node in ends.T:
        corner = np.stack([(mesh.triangles[side] == node[:, None]).argmax(axis=1) for side in sides.T])
        pairs.append(3 * sides.T + corner)
    one, two = np.concatenate(pairs, axis=1)
    size = mesh.triangles.size
    count, label = connected_components(sp.coo_array((np.ones(len(one)), (one, two)), (size, size)), False)
    return int(count), np.asarray(label, dtype=np.int64).reshape(-1, 3)


def corner_values(mesh: SheetMesh, values: Array, cut: Ints) -> Array:
    """Values at the corners, of a plane through those of the triangles around (by least squares, weighted by area).

    This is patch recovery (Zienkiewicz and Zhu 1992) in every panel by itself: what varies linearly is met exactly, on
    boundaries and creases too. Where there are too few triangles for a plane it is their mean.

    Args:
        mesh: stress-free and flat.
        values: (t, c) of the triangles.
        cut: (k,) rows of `mesh.topology.hinges` across which nothing is shared.

    Returns:
        (t, 3, c).
    """
    count, fan = fans(mesh, cut)
    triangles = len(mesh.triangles)
    around = sp.csr_array(
        (np.ones(3 * triangles), (fan.ravel(), np.repeat(np.arange(triangles), 3))), (count, triangles)
    )
    wider = (around @ around.T @ around).tocsr()
    centre, node = np.empty((count, 2)), mesh.points[mesh.triangles.ravel(), :2]
    centre[fan.ravel()] = node
    middle = mesh.points[mesh.triangles, :2].mean(axis=1)
    of_near, near = _planes(around, centre, middle, mesh.areas, values)
    of_wide, wide = _planes(wider, centre, middle, mesh.areas, values)
    weight = around.multiply(mesh.areas).tocsr()
    mean = (weight @ values) / np.asarray(weight.sum(axis=1))[:, None]
    some = around.sum(axis=1) >= ENOUGH
    out = np.where((near & some)[:, None], of_near, np.where(wide[:, None], of_wide, mean))
    return np.asarray(out[fan])


def _planes(
    members: sp.csr_array, centre: Array, middle: Array, areas: Array, values: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """(f, c) values at the centres (f, 2) of planes through those of the members, and which are determined (f,)."""
    entries = members.tocoo()
    row, column = entries.coords
    away = middle[column] - centre[row]
    terms = np.column_stack((np.ones(len(row)), away))
    weighted = areas[column, None] * terms
    A = np.zeros((len(centre), 3, 3))
    b = np.zeros((len(centre), 3, values.shape[1]))
    np.add.at(A, row, weighted[:, :, None] * terms[:, None, :])
    np.add.at(b, row, weighted[:, :, None] * values[column][:, None, :])
    scale = np.sqrt(np.einsum("fii->fi", A))
    scale = np.where(scale > 0.0, scale, 1.0)
    A /= scale[:, :, None] * scale[:, None, :]
    good = np.linalg.eigvalsh(A)[:, 0] > FLAT
    A[~good] = np.eye(3)
    found = np.linalg.solve(A, b / scale[:, :, None])[:, 0] / scale[:, :1]
    return found, good
