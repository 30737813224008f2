"""Energies of edges as densities of the triangles beside them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]


def to_triangles(mesh: SheetMesh, energy: Array, edges: Ints) -> Array:
    """Energy of edges shared by area among their triangles.

    Args:
        mesh: the stress-free sheet.
        energy: (k,) energies, N mm.
        edges: (k,) rows of `mesh.topology.edges` that they belong to.

    Returns:
        (t,) energy density of every triangle, N mm / mm^2.
    """
    sides = mesh.topology.edge_triangles[edges]
    areas = np.where(sides >= 0, mesh.areas[np.maximum(sides, 0)], 0.0)
    share = energy / areas.sum(axis=1)
    density = np.zeros(len(mesh.triangles))
    for side in range(2):
        inside = sides[:, side] >= 0
        np.add.at(density, sides[inside, side], share[inside])
    return density
