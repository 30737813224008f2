"""What the mesh of a model does to the answer of the shell."""

from __future__ import annotations

import numpy as np

from bh.formulations.remarks import Remark
from bh.model.model import Model
from meshes import SheetMesh

GENTLE = (
    np.radians(0.5),
    np.radians(45.0),
)  # turns between edges of what is meant as a curve: half of them, and all


def straight_edges(model: Model) -> tuple[Remark, ...]:
    """A remark where rows of edges bow but lie on no curve, as of a mesh from a file of straight edges.

    Returns:
        the remark, or none.
    """
    mesh = model.mesh
    on_curves = [mesh.topology.find_edges(mesh.edge_sets[n]) for n in mesh.curves if n in mesh.edge_sets]
    covered = np.zeros(len(mesh.topology.edges), dtype=bool)
    for edges in on_curves:
        covered[edges] = True
    names = [
        name
        for name, pairs in mesh.edge_sets.items()
        if not covered[mesh.topology.find_edges(pairs)].all() and _bows(mesh, name)
    ]
    if not names:
        return ()
    return (
        Remark(
            "curved-edges",
            f"edges of '{names[0]}' bow but lie on no curve of the mesh: the shell takes them as straight, "
            "10 to 40 % wrong in energy along a crease; mesh the pattern where it is to lie, with its curves",
        ),
    )


def _bows(mesh: SheetMesh, name: str) -> bool:
    """Do the edges of a set follow each other and turn a little at nearly every node?"""
    pairs = mesh.edge_sets[name]
    if len(pairs) < 3 or (pairs[1:, 0] != pairs[:-1, 1]).any():
        return False
    along = mesh.points[pairs[:, 1]] - mesh.points[pairs[:, 0]]
    along /= np.linalg.norm(along, axis=1)[:, None]
    turn = np.arccos(np.clip((along[1:] * along[:-1]).sum(axis=1), -1.0, 1.0))
    return bool(np.median(turn) > GENTLE[0] and turn.max() < GENTLE[1])
