"""The patches of one half of a mirror-symmetric sheet of the consistent formulation.

- A triangle that is its own image counts half, and its angles at two edges that are images of each other are one.
- An edge in the plane turns by as much on either side: theta = (phi - phi_rest) / 2, and has no rotation. A spring
  there has one rotation for both sides.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bh.loading.symmetry import Mirror
from bh.mechanics.consistent.kernels import NONE, TURN
from bh.mechanics.consistent.patches import Patches

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]


def half_patches(joined: Patches, spring: Bools, plane: Mirror) -> Patches:
    """The patches that lie in the half, or are their own images, with the energy that belongs to the half.

    Args:
        joined: patches of the whole sheet.
        spring: (m,) hinges that are springs.
        plane: of the mirror symmetry.
    """
    weight = plane.triangle_weight[joined.members[:, 0]]
    keep = weight > 0.0
    kind, hinge, half_edge = joined.kind[keep], joined.hinge[keep], joined.half_edge[keep]
    inner = joined.inner[keep].copy()
    B = weight[keep][:, None, None] * joined.B[keep]
    edge = np.where(half_edge >= 0, plane.mesh.topology.triangle_edges.ravel()[half_edge], -1)

    inside = (hinge >= 0) & plane.hinge_inside[hinge] & ~spring[hinge]
    kind = np.where(inside, TURN, kind)
    inner |= inside
    share = np.where(inside, 0.5, 1.0)
    B = share[:, :, None] * B * share[:, None, :]
    shares = joined.shares[keep] * share[:, None, :]

    # in a triangle that is its own image, the image of an angle is the angle at the image of the edge
    own = (weight[keep] == 0.5)[:, None] & (edge >= 0)
    twice = own & (plane.edge_weight[edge] == 0.0)
    c, gone = np.nonzero(twice)
    same = (edge[c] == plane.edge[edge[c, gone]][:, None]) & (
        half_edge[c] // 3 == (half_edge[c, gone] // 3)[:, None]
    )
    kept = same.argmax(axis=1)
    fold = np.broadcast_to(np.eye(B.shape[1]), B.shape).copy()
    fold[c, gone, gone], fold[c, gone, kept] = 0.0, 1.0
    B = np.swapaxes(fold, 1, 2) @ B @ fold
    kind = np.where(twice, NONE, kind)
    return replace(
        joined, members=joined.members[keep], kind=kind, hinge=np.where(twice, -1, hinge),
        half_edge=np.where(twice, -1, half_edge), inner=inner & ~twice, B=B, shares=shares @ fold,
    )  # fmt: skip
