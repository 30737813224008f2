"""Displacements of a supported sheet as unknowns: local axes, prescribed components, and rigid motions left free."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.constraints import UNBALANCED, Constraints, free_motions, orthonormal, rigid_motions
from bh.model.ramp import Ramp
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
FAR = 1e4  # times the size of a sheet


class Displacements:
    """Node displacements of one step; the free ones, in local axes where a support is oblique, are unknowns (mm).

    Attributes:
        constraints: with every start given.
        number: (n, 3) unknown of each local component, -1 where it is prescribed.
        free: (k,) flat indices (3 node + component) of the unknowns.
        prescribed_rate, prescribed_motion: (n, 3) change of the prescribed displacements with lambda, mm, in local
            and in global axes.
    """

    weight: Array | None = None  # (k,) how many nodes an unknown stands for, if not one each
    home: Array  # (n, 3) `reference`, or the same with the middle of the sheet as origin where that is far away, mm

    def __init__(self, mesh: SheetMesh, constraints: Constraints, start_points: Array) -> None:
        """Number the unknowns.

        Args:
            mesh: the stress-free sheet.
            constraints: of the step; a start that is not given is that of `start_points`.
            start_points: (n, 3) positions that the step begins with, mm.

        Raises:
            ModelError: supports hold every node.
        """
        self.mesh = mesh
        self.reference = self.home = mesh.points
        self.turned = np.flatnonzero(constraints.frame_of >= 0)
        self.turned_axes = constraints.frames[constraints.frame_of[self.turned]]
        self._start = self.to_local(start_points - mesh.points)
        # a displacement whose start is not given begins with what the node has
        begin = np.where(np.isnan(constraints.start), self._start, constraints.start)
        self.constraints = replace(constraints, start=begin)
        free = ~self.constraints.fixed
        self.number = np.full(free.shape, -1, dtype=np.int64)
        self.number[free] = np.arange(free.sum())
        self.free = np.flatnonzero(free.ravel())
        if len(self.free) == 0:
            raise ModelError("the supports hold every node; nothing can move, so remove some of them")
        self.prescribed_rate = (self.constraints.end - self.constraints.start) * self.constraints.fixed
        self.prescribed_motion = self.to_global(self.prescribed_rate)

    def bring_home(self) -> None:
        """Give a sheet that lies far away an origin of its own: coordinates of 1e8 mm are rounded to 1e-8 mm.

        Only differences of positions count, but for bodies that stand somewhere.
        """
        middle = self.reference.mean(axis=0)
        if float(np.abs(middle).max()) > FAR * self.mesh.size:
            self.home = self.reference - middle

    def start(self) -> Array:
        """(k,) unknowns of the positions that the step begins with."""
        return np.asarray(self._start.ravel()[self.free])

    def unknowns(self, x: Array) -> Array:
        """(k,) unknowns of node positions x (n, 3)."""
        return np.asarray(self.to_local(x - self.reference).ravel()[self.free])

    def pattern_nodes(self, groups: tuple[Ints, ...]) -> tuple[Ints, tuple[Ints, ...]]:
        """Numbers of the unknowns (n, 3) and nodes of elements, as a pattern takes them."""
        return self.number, groups

    def positions(self, u: Array, lam: float) -> Array:
        """(n, 3) node positions, mm, for unknowns u (k,).

        Args:
            u: (k,) displacements, mm.
            lam: load parameter of the step, 0 to 1.
        """
        return self.reference + self._moves(u, lam)

    def near(self, u: Array, lam: float) -> Array:
        """The same from the origin of `home`; as unrounded as that is.

        Args:
            u: (k,) displacements, mm.
            lam: load parameter of the step, 0 to 1.

        Returns:
            (n, 3) positions, mm.
        """
        return self.home + self._moves(u, lam)

    def _moves(self, u: Array, lam: float) -> Array:
        """(n, 3) displacements, mm, in global axes."""
        local = (1.0 - lam) * self.constraints.start + lam * self.constraints.end
        local.ravel()[self.free] = u
        return self.to_global(local)

    def vectors(self, u: Array) -> Array:
        """(n, 3) changes of positions for changes u (k,) of the unknowns."""
        local = np.zeros_like(self.reference)
        local.ravel()[self.free] = u
        return self.to_global(local)

    def components(self, vectors: Array) -> Array:
        """(k,) components of nodal vectors (n, 3) along the unknowns."""
        return np.asarray(self.to_local(vectors).ravel()[self.free])

    def reactions(self, forces: Array) -> Array:
        """(n, 3) the part of nodal forces along supported components, in global axes."""
        local = self.to_local(forces)
        return self.to_global(np.where(self.constraints.fixed, local, 0.0))

    def to_global(self, local: Array) -> Array:
        """(n, 3) vectors in global axes, from their components along the axes of the supports."""
        if len(self.turned) == 0:
            return local
        out = local.copy()
        out[self.turned] = np.einsum("nij,ni->nj", self.turned_axes, local[self.turned])
        return out

    def to_local(self, vectors: Array) -> Array:
        """(n, 3) components along the axes of the supports, from vectors in global axes."""
        if len(self.turned) == 0:
            return vectors
        out = vectors.copy()
        out[self.turned] = np.einsum("nij,nj->ni", self.turned_axes, vectors[self.turned])
        return out

    # ------------------------------------------------------------------------------- rigid motions

    def rigid(self, x: Array) -> Array:
        """Orthonormal rigid motions (k, r) that the supports leave free at positions x."""
        motions = rigid_motions(x) @ free_motions(x, self.constraints)
        if len(self.turned):
            for column in range(motions.shape[1]):
                motions[:, column] = self.to_local(motions[:, column].reshape(-1, 3)).ravel()
        return orthonormal(motions[self.free])

    @cached_property
    def ground_triangle(self) -> int:
        """The triangle that carries the stiffness against rigid motions: in the middle, without supports of its own."""
        centres = self.reference[self.mesh.triangles].mean(axis=1)
        distance = np.linalg.norm(centres - self.reference.mean(axis=0), axis=1)
        supported = (self.number[self.mesh.triangles] < 0).sum(axis=(1, 2))
        return int(np.lexsort((distance, supported))[0])

    @cached_property
    def ground_numbers(self) -> Ints:
        """(9,) unknowns of that triangle, -1 where prescribed."""
        return np.asarray(self.number[self.mesh.triangles[self.ground_triangle]].ravel())

    def grounding(self, Z: Array, stiffness: float) -> Array:
        """(9, 9) stiffness (N/mm) of that triangle against the rigid motions Z and nothing else.

        Args:
            Z: (n, r) orthonormal free rigid motions.
            stiffness: N/mm.
        """
        rows = np.where(self.ground_numbers[:, None] >= 0, Z[np.maximum(self.ground_numbers, 0)], 0.0)
        Q = orthonormal(rows)
        return np.asarray(stiffness * (Q @ Q.T))

    def unbalanced(self, x: Array, force: Array) -> float:
        """Part of dead forces (n, 3) that works on rigid motions at positions x, of their sum.

        Args:
            x: (nodes, 3) positions, mm.
            force: (nodes, 3) N.
        """
        if not force.any():
            return 0.0
        local = self.components(force)
        size = max(float(np.abs(local).sum()), 1e-300)
        return float(np.abs(self.rigid(x).T @ local).max(initial=0.0)) / size

    def check_balance(self, force: Ramp) -> None:
        """Raises `ModelError` where dead forces would push a sheet that is free to move rigidly.

        Raises:
            ModelError: the forces push the sheet as a whole.
        """
        for load in (force.start, force.end):
            if self.unbalanced(self.home, load) > 1e-9:
                raise ModelError(UNBALANCED)
