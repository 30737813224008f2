"""Moulds that press on a sheet: the barrier between its nodes, edges and triangles and those of rigid bodies that move.

Positions that the barrier takes are those of the sheet's nodes, and below them the corners of the moulds.
"""

from __future__ import annotations

from collections.abc import Sequence

import ipctk
import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.mechanics.contact.barrier import SheetBarrier, barrier_pressure
from bh.model.model import Model
from bh.model.mould import Mould
from meshes.io.solids import encloses
from meshes.topology import Ints

Array = NDArray[np.float64]


class MouldBarrier(SheetBarrier):
    """What presses between a sheet and the moulds of one step."""

    KIND = 10

    def __init__(self, model: Model, moulds: tuple[Mould, ...]) -> None:
        """Pairs that can meet.

        Args:
            model: of the sheet.
            moulds: of the step.
        """
        mesh = model.mesh
        self.moulds, self.nodes = moulds, len(mesh.points)
        points, triangles, edges = [mesh.points], [mesh.triangles], [mesh.topology.edges]
        self._first = np.cumsum([self.nodes, *(len(mould.points) for mould in moulds)])
        for first, mould in zip(self._first.tolist(), moulds, strict=False):
            points.append(mould.points)
            triangles.append(first + mould.triangles)
            edges.append(first + solid_edges(mould.triangles))
        self.edges: Ints = np.vstack(edges)
        self.triangles = np.vstack(triangles)
        self._from = np.vstack(points[1:])
        self.velocity: Array = np.repeat(
            np.array([mould.by for mould in moulds]), [len(mould.points) for mould in moulds], axis=0
        )
        solid = ipctk.CollisionMesh(
            np.vstack(points), self.edges.astype(np.int32), self.triangles.astype(np.int32)
        )
        solid.can_collide = ipctk.make_vertex_patches_filter(
            np.repeat(np.array([0, 1], dtype=np.int32), [self.nodes, len(self._from)])
        )
        gap = min(mould.gap for mould in moulds)
        self._begin(solid, mesh, 0.0, gap, barrier_pressure(model))

    def places(self, x: Array, lam: float) -> Array:
        """Positions (n + corners, 3) of the sheet's nodes and of the moulds.

        Args:
            x: (nodes, 3) positions of the sheet, mm.
            lam: load parameter of the step, 0 to 1.
        """
        return np.vstack((x, self._from + lam * self.velocity))

    def rates(self, v: Array, moving: float) -> Array:
        """Velocities (n + corners, 3) of the sheet's nodes and of the moulds.

        Args:
            v: (nodes, 3) velocities of the sheet.
            moving: rate of lambda.
        """
        return np.vstack((v, moving * self.velocity))

    def corner_forces(self, x: Array) -> Array:
        """(corners, 3) gradient of the energy by the corners of the moulds, N.

        Args:
            x: positions (`places`), mm.
        """
        pairs = self._pairs(x)
        if len(pairs) == 0:
            return np.zeros_like(self._from)
        return np.asarray(self._potential.gradient(pairs, self._mesh, x).reshape(-1, 3)[self.nodes :])

    def by_mould(self, corners: Array) -> dict[str, Array]:
        """(3,) sums of what is known of corners (c, 3), by the name of the mould."""
        parts = np.split(corners, self._first[1:-1] - self.nodes)
        return {mould.name: part.sum(axis=0) for mould, part in zip(self.moulds, parts, strict=True)}

    def coefficient(self, nodes: Sequence[int], mu: float) -> float:
        """Of friction between some nodes; a mould may have one of its own.

        Args:
            nodes: of the sheet and of moulds.
            mu: where no mould says another one.
        """
        number = int(np.searchsorted(self._first, max(nodes), side="right")) - 1
        own = self.moulds[number].friction
        return mu if own is None else own

    def check_start(self, x: Array, lam: float, apart: bool) -> None:
        """Refuse a mould that crosses the sheet or that the sheet begins in.

        Args:
            x: (nodes, 3) positions of the sheet, mm.
            lam: load parameter of the step, 0 to 1.
            apart: refuse one that is nearer than its gap, too: nothing balances what it presses with.

        Raises:
            ModelError: one line that names the mould and the nodes.
        """
        places = self.places(x, lam)
        for mould, first in zip(self.moulds, self._first.tolist(), strict=False):
            corners = places[first : first + len(mould.points)]
            inside = np.flatnonzero(encloses(corners, mould.triangles, x))
            if len(inside):
                raise ModelError(
                    f"mould '{mould.name}' starts inside the sheet: {len(inside)} nodes lie in it, the first is "
                    f"node {inside[0]} at ({', '.join(f'{c:.4g}' for c in x[inside[0]])}); move it away (at)"
                )
        if not self.begin(places):
            crossing = self.meetings(places) or "they touch"
            names = ", ".join(f"'{mould.name}'" for mould in self.moulds)
            raise ModelError(
                f"mould {names} crosses the sheet where the step begins ({crossing}); move it away (at)"
            )
        if apart and self.presses(places):
            raise ModelError(
                f"a mould starts {self.distance(places):.4g} mm from the sheet, nearer than its gap of "
                f"{self.reach:g} mm; move it away (at), or give a smaller gap"
            )


def solid_edges(triangles: Ints) -> Ints:
    """(e, 2) edges of triangles, each once.

    Args:
        triangles: (t, 3) corners.
    """
    ends = np.vstack([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    return np.unique(np.sort(ends, axis=1), axis=0)
