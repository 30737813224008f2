"""Rotations of edges in the consistent formulation: those of least energy, and the turns of creases that they leave."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.mechanics.consistent import setup
from bh.mechanics.consistent.elements import ConsistentElements
from bh.mechanics.consistent.forces import Internal
from bh.mechanics.shared.base_system import SupportedSheet
from bh.mechanics.shared.kinematics import dihedral_angles
from meshes.topology import Ints

Array = NDArray[np.float64]
ITERATIONS = 30  # for the rotations of least energy with a law of bending, or of a crease, that is not linear


class Solver(Protocol):
    """A factorised matrix."""

    def solve(self, b: Array) -> Array:
        """Solution x of A x = b, both (n,)."""
        ...


class Slopes(NamedTuple):
    """Tangents of the laws at a state: patches (c, a, a) and springs (h,), N mm / rad."""

    patches: Array
    springs: Array


class TurningEdges(SupportedSheet):
    """What depends on edge rotations; `ConsistentSystem` is the whole."""

    elements: ConsistentElements
    hinges: Ints

    def internal(self, x: Array, alpha: Array, lam: float) -> Internal:
        """Energies, gradient and element forces at positions x and rotations alpha.

        Args:
            x: (nodes, 3) positions, mm.
            alpha: (rotations,) of the edges, rad.
            lam: load parameter of the step, 0 to 1.
        """
        raise NotImplementedError

    def rotations_at(self, x: Array, lam: float, couples: Array | None = None) -> Array:
        """(rotations,) of least energy at positions x (n, 3).

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
            couples: (rotations,) that act besides, N mm; None for none.

        Returns:
            in rad.

        Raises:
            ModelError: the minimum is not found.
        """
        alpha = np.zeros(self.size - self.moving)
        now = self.internal(x, alpha, lam)
        more = np.zeros_like(alpha) if couples is None else couples
        if self.elements.bending.constant and self.curves is None:
            r = now.r + more
            return np.asarray(-self._rotation_factor.solve(r)) if r.any() else r
        for _ in range(ITERATIONS):
            r = now.r + more
            if np.abs(r).max(initial=0.0) <= 1e-12 * self._stiffest[1]:
                return alpha
            B = self.elements.bending.stiffness(now.theta)
            stiffness = self.spring_stiffness(now.turns)
            alpha = alpha - sp.linalg.splu(self.rotation_stiffness(B, stiffness)).solve(r)
            now = self.internal(x, alpha, lam)
        raise ModelError(
            "no rotations of least energy at these positions: the law of bending, or of a crease, is not convex there"
        )

    @cached_property
    def _rotation_factor(self) -> Solver:
        e = self.elements
        factor: Solver = sp.linalg.splu(self.rotation_stiffness(e.patches.B, e.spring_stiffness))
        return factor

    def rotation_stiffness(self, B: Array, springs: Array) -> sp.csc_matrix:
        """Hessian of the energy in the rotations alone.

        Args:
            B: (c, a, a) stiffnesses of the patches, N mm.
            springs: (h,) slopes of the springs, N mm / rad.
        """
        e, joined = self.elements, self.elements.patches
        most = B.size + 4 * len(e.springs)
        rows, columns, values = np.empty(most, np.int64), np.empty(most, np.int64), np.empty(most)
        used = setup.rotation_matrix(e.rotation, joined.kind, B, e.turns, springs, rows, columns, values)
        entries = (values[:used], (rows[:used], columns[:used]))
        return sp.csc_matrix(entries, shape=(e.rotations, e.rotations))

    @cached_property
    def _heights(self) -> Array:
        """(rotations,) height of a triangle on the edge of each rotation, mm: what turns a moment into a force."""
        e = self.elements
        height = np.ones((len(self.mesh.triangles), 3))
        height[e.members] = e.heights
        out = np.ones(e.rotations)
        used = e.rotation >= 0
        out[e.rotation[used]] = height.ravel()[e.patches.half_edge[used]]
        return out

    @cached_property
    def _stiffest(self) -> tuple[float, float]:
        """Largest stiffness of an edge, N/mm, and of a hinge over the height of its wing, N / rad."""
        e = self.elements
        bend = (np.einsum("tkk->tk", e.B_triangle) / e.heights).max()
        spring = (e.spring_stiffness / e.heights.min()).max(initial=0.0)
        return e.stretching.largest, float(max(bend, spring))

    def turns(self, x: Array, alpha: Array, lam: float) -> Array:
        """(h,) turns of the springs from their rest angles, rad.

        Args:
            x: (nodes, 3) positions, mm.
            alpha: (rotations,) of the edges, rad.
            lam: load parameter of the step, 0 to 1.
        """
        e = self.elements
        beside = alpha[e.turns[:, 0]] + alpha[e.turns[:, 1]]
        return np.asarray(dihedral_angles(x, e.hinges) - beside - e.spring_rest.at(lam))

    def spring_stiffness(self, turns: Array) -> Array:
        """(h,) slopes of the springs at their turns (h,), N mm / rad.

        Args:
            turns: (h,) rad.
        """
        k = self.elements.spring_stiffness
        return k if self.curves is None else self.curves.slopes(k, turns)

    def slopes(self, x: Array, q: Array, lam: float) -> Array:
        """(h,) slopes of the springs at positions x (n, 3) and unknowns q (size,), N mm / rad.

        Args:
            x: (nodes, 3) positions, mm.
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        k = self.elements.spring_stiffness
        return k if self.curves is None else self.spring_stiffness(self.turns(x, q[self.moving :], lam))

    def crease_history_at(self, q: Array, lam: float) -> Array:
        """(m, 2) what creases remember where this state is accepted; see `bh.solvers.system.Remembering`.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        e = self.elements
        assert self.curves is not None
        x = self.near(q, lam)
        turns = np.zeros(len(self.hinges))
        prescribed = ~np.isnan(e.prescribed.end)
        turns[prescribed] = (e.prescribed.at(lam) - self.load_step.rest.at(lam))[prescribed]
        turns[e.springs] = self.turns(x, q[self.moving :], lam)
        return self.curves.accepted(turns)
