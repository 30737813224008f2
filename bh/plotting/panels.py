"""The sheet cut open along its creases, for surfaces that are shaded smoothly up to them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshes.mesh import SheetMesh

Ints = NDArray[np.int64]


def cut_open(mesh: SheetMesh) -> tuple[Ints, Ints]:
    """Nodes (m,) and triangles (t, 3) of the panels between creases.

    A node on a crease is there once for every panel that it belongs to: `points[nodes]` are the corners that
    `triangles` counts.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    topology = mesh.topology
    joined = np.ones(len(topology.edges), dtype=bool)
    joined[topology.edge_triangles[:, 1] < 0] = False
    for crease in mesh.creases:
        joined[topology.find_edges(mesh.crease_edges(crease))] = False
    one, two = topology.edge_triangles[joined].T
    count = len(mesh.triangles)
    graph = coo_array((np.ones(len(one)), (one, two)), shape=(count, count))
    _, panel = connected_components(graph, directed=False)
    keys = np.column_stack((np.repeat(panel, 3), mesh.triangles.ravel()))
    corners, triangles = np.unique(keys, axis=0, return_inverse=True)
    nodes: Ints = corners[:, 1]
    return nodes, triangles.reshape(-1, 3)
