"""Motions of a sheet in words, for messages."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bh.formulations.state import crease_hinges
from bh.mechanics.shared.kinematics import dihedral_gradients
from bh.model.supports import MOTIONS, rigid_motions
from meshes.mesh import SheetMesh

Array = NDArray[np.float64]


def describe_motion(mesh: SheetMesh, x: Array, motion: Array) -> str:
    """What moves in `motion` (n, 3) at positions x (n, 3): the whole sheet, a crease, or a few nodes.

    A clause such as "crease 'a' turns" to be followed by how.
    """
    size = float(np.linalg.norm(motion))
    if size == 0.0:
        return "nothing moves"
    rigid = rigid_motions(x)
    rigid /= np.linalg.norm(rigid, axis=0)
    share, *_ = np.linalg.lstsq(rigid, motion.ravel() / size, rcond=None)
    if float(np.linalg.norm(rigid @ share)) > 0.99:
        named = " and ".join(MOTIONS[k] for k in np.flatnonzero(np.abs(share) > 0.3 * np.abs(share).max()))
        return f"the whole sheet moves ({named})"
    hinges = mesh.topology.hinges
    turn = np.einsum("hk,hk->h", dihedral_gradients(x, hinges), motion[hinges].reshape(-1, 12))
    total = float(turn @ turn)
    for crease in mesh.creases:
        if float((turn[crease_hinges(mesh, crease)] ** 2).sum()) > 0.5 * total:
            return f"crease '{crease}' turns"
    node = int(np.argmax(np.linalg.norm(motion, axis=1)))
    at = ", ".join(f"{c:.4g}" for c in x[node])
    return f"node {node} at ({at}) moves with its neighbours"
