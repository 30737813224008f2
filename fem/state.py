"""A state of the shell: what every formulation shows, and what only the shell has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.formulations.state import State
from bh.loading.load_step import crease_hinges
from fem.kernels import Frames

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ShellState(State):
    """A state of the shell.

    Dihedral angles of creases are the connector's, averaged along the edge; of other hinges they are pi minus the
    jump of the normal at the middle of the edge, which vanishes under refinement.

    Attributes:
        nodes: (n, 3) positions of corners and, with quadratic elements, (n + e, 3) of middle nodes too, mm.
        frames: frames of all edges, turned with them; the next step begins from here.
        fold_angles: (m, r) beta at the lower and the higher node of each hinge's edge, or one for both, rad; zero off
            creases.
        crease_couples: (m, r) couples that the crease takes there, conjugate to fold_angles, N mm / rad.
        membrane_forces, moments: (t, 3) components xx, yy, xy in the flat sheet's axes at the middle of each triangle
            (second Piola-Kirchhoff), N/mm and N; a moment is positive where it bends the sheet's edges up.
        point_history: (m p, 2) what creases that yield remember at the points of their edges, rad; None without such.
    """

    nodes: Array
    frames: Frames
    fold_angles: Array
    crease_couples: Array
    membrane_forces: Array
    moments: Array
    point_history: Array | None = None

    def fold_angles_along(self, crease: str) -> Array:
        """(k, 2) fold angles at both ends of every edge along a crease, in its order, rad; mountain positive."""
        hinges = crease_hinges(self.mesh, crease)
        pairs = self.mesh.crease_edges(crease)
        beta = np.broadcast_to(self.fold_angles[hinges], (len(hinges), 2))
        turned = pairs[:, 0] > pairs[:, 1]
        out: Array = np.where(turned[:, None], beta[:, ::-1], beta)
        return out

    def crease_curve(self, crease: str, points: int = 5) -> Array:
        """(k, 3) points on the deformed crease: `points` on every edge, in order, mm.

        Args:
            crease: its name.
            points: on every edge, its ends included.
        """
        pairs = self.mesh.crease_edges(crease)
        low, high = self.nodes[pairs[:, 0]], self.nodes[pairs[:, 1]]
        corners = len(self.mesh.points)
        quadratic = len(self.nodes) > corners
        middle = (
            self.nodes[corners + self.mesh.topology.find_edges(pairs)] if quadratic else 0.5 * (low + high)
        )
        s = np.linspace(0.0, 1.0, points)
        shape = np.stack(((1.0 - s) * (1.0 - 2.0 * s), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0)))
        ends = np.stack((low, middle, high))
        curve = np.einsum("kp,kec->epc", shape, ends)
        return np.vstack((curve[:, :-1].reshape(-1, 3), curve[-1, -1:]))
