"""Where a fine mesh has to look for a branch, the state that a coarser one has there is a good place to begin."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bh.formulations.protocols import PlacedSystem
from bh.paths.path import Path
from bh.solvers.automatic import Automatic
from bh.solvers.load_control import LoadControl
from bh.solvers.system import System
from bh.solvers.walk import Strategy
from meshes import SheetMesh

Array = NDArray[np.float64]
NEAREST = 8  # triangles that a node is looked for in


@dataclass(frozen=True)
class Coarser:
    """A path of the same sheet on a coarser mesh.

    Attributes:
        path: that reached its end.
    """

    path: Path

    def guiding(self, strategy: Strategy, mesh: SheetMesh, step: int) -> Strategy:
        """A strategy that takes the states of this path where Newton's method finds no way on from its own.

        The states of the finer mesh are found as ever where that works, so a branch that only the coarser mesh leaves
        leads it nowhere; and a state that is begun at this way is accepted as any other is.

        Args:
            strategy: of the finer mesh.
            mesh: the finer one.
            step: number of the step, from 0.

        Returns:
            the strategy itself where it is none that can be guided, or the step is not solved here.
        """
        states = [record for record in self.path.records if record.step == step]
        if not states:
            return strategy
        moved = np.array([self.path.observe(step, r.q, r.lam).points for r in states])
        moved -= self.path.model.mesh.points
        lams = np.array([record.lam for record in states])
        points = mesh.points
        triangles, weights = places(self.path.model.mesh, points)

        def guess(system: System, lam: float) -> Array | None:
            if not isinstance(system, PlacedSystem) or not lams[0] <= lam <= lams[-1]:
                return None
            k = min(max(int(np.searchsorted(lams, lam)), 1), len(lams) - 1) if len(lams) > 1 else 0
            part = (lam - lams[k - 1]) / (lams[k] - lams[k - 1]) if k else 1.0
            at = (1.0 - part) * moved[k - 1] + part * moved[k]
            there: Array = points + np.einsum("nk,nkd->nd", weights, at[triangles])
            return system.unknowns_at(there, lam)

        if isinstance(strategy, Automatic):
            return replace(strategy, load=replace(strategy.load, guess=guess))
        return replace(strategy, guess=guess) if isinstance(strategy, LoadControl) else strategy


def places(mesh: SheetMesh, points: Array) -> tuple[NDArray[np.int64], Array]:
    """In which triangle of a flat mesh points lie, or next to which.

    Args:
        mesh: the triangles.
        points: (n, 3) in their plane, mm.

    Returns:
        (n, 3) nodes and (n, 3) their weights, which are barycentric coordinates: less than zero outside a triangle.
    """
    from scipy.spatial import cKDTree

    corners = mesh.points[mesh.triangles][..., :2]
    near = (
        cKDTree(corners.mean(axis=1))
        .query(points[:, :2], min(NEAREST, len(corners)))[1]
        .reshape(len(points), -1)
    )
    a, b, c = np.moveaxis(corners[near], 2, 0)
    p = points[:, None, :2]
    areas = [_doubled_area(c - b, p - b), _doubled_area(a - c, p - c), _doubled_area(b - a, p - a)]
    weights = np.stack(areas, axis=-1) / _doubled_area(b - a, c - a)[..., None]
    best = weights.min(axis=-1).argmax(axis=1)
    rows = np.arange(len(points))
    return mesh.triangles[near[rows, best]], weights[rows, best]


def _doubled_area(a: Array, b: Array) -> Array:
    """Twice the signed areas of triangles with sides a and b (..., 2), mm^2."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
