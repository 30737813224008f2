"""Bending of a sheet: angles of patches and the law of the curvature that they measure, as one energy.

A triangle with angles theta at its edges has the curvature kappa = (1 / A) sum_e L_e theta_e mu_e (x) mu_e. Where the
moduli are constant the energy is 1/2 theta.B.theta with constant B, and rotations inside a patch and on free edges are
eliminated from B once (`patches`). A law that is not linear has no such matrix: every patch is one triangle then, and
every edge, free ones too, keeps its rotation as an unknown.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bh.materials import Constant, Law
from bh.mechanics.consistent import kernels
from bh.mechanics.consistent.patches import Patches
from meshes.topology import Ints

Array = NDArray[np.float64]


class Bending:
    """Energy of the angles theta (c, a) of patches; its element forces are the moments M (c, a), N mm.

    Args:
        law: of the curvature, in the frame of the first triangle of every patch.
        maps: (t, 3, 3) curvatures (xx, yy, 2 xy) of triangles from the angles at their edges, 1 / mm.
        area: (t,) of the triangles that counts, mm^2.
        quad, ghost, rotation: of the angles, see `bh.mechanics.consistent.kernels`.
    """

    def __init__(
        self, patches: Patches, law: Law, maps: Array, area: Array, quad: Ints, ghost: Array, rotation: Ints
    ) -> None:
        """The law of the curvatures that patches measure; arrays as in `ConsistentElements`."""
        self.patches, self.law, self.constant = patches, law, isinstance(law, Constant)
        self.quad, self.ghost, self.rotation = quad, ghost, rotation
        if self.constant:
            return
        triangle = patches.members[:, 0]
        self._maps = maps[triangle] @ patches.shares
        self._area = area[triangle]

    def forces(
        self, x: Array, alpha: Array, rest: Array, f: Array, r: Array, M: Array, theta: Array
    ) -> tuple[float, float, bool]:
        """Energy (N mm), the sum of squared forces (N^2), and whether a hinge is about to close.

        Adds the gradient to f (n, 3) and r (rotations,); writes angles and moments.

        Args:
            x: (nodes, 3) positions, mm.
            alpha: (rotations,) of the edges, rad.
            rest: (c, a) angles at rest, rad.
            f: (nodes, 3) N; the gradient is added.
            r: (rotations,) N mm; the gradient is added.
            M: (c, a) moments, N mm; written.
            theta: (c, a) angles less those at rest, rad; written.

        Returns:
            three numbers.
        """
        p = self.patches
        if self.constant:
            size, closing = kernels.bending_forces(
                x, alpha, p.kind, self.quad, self.ghost, rest, self.rotation, p.B, f, r, M, theta
            )
            return 0.5 * float(np.vdot(M, theta)), size, closing
        closing = kernels.bending_angles(x, alpha, p.kind, self.quad, self.ghost, rest, self.rotation, theta)
        curvature = self.curvature(theta)
        moment = self._area[:, None] * self.law.stress(curvature)
        M[:] = np.einsum("cia,ci->ca", self._maps, moment)
        size = kernels.bending_gradient(x, p.kind, self.quad, self.ghost, self.rotation, M, f, r)
        return float(self._area @ self.law.energy(curvature)), size, closing

    def curvature(self, theta: Array) -> Array:
        """(c, 3) curvatures of the triangles of a law that is not linear, 1 / mm."""
        return np.asarray(np.einsum("cia,ca->ci", self._maps, theta))

    def stiffness(self, theta: Array) -> Array:
        """(c, a, a) derivatives of the moments by the angles, N mm."""
        if self.constant:
            return self.patches.B
        moduli = self._area[:, None, None] * self.law.moduli(self.curvature(theta))
        B = np.swapaxes(self._maps, 1, 2) @ moduli @ self._maps
        return np.asarray(0.5 * (B + np.swapaxes(B, 1, 2)))

    def angles(self, x: Array, alpha: Array, rest: Array) -> Array:
        """(c, a) angles at positions x (n, 3) and rotations alpha, rad.

        Args:
            x: (nodes, 3) positions, mm.
            alpha: (rotations,) of the edges, rad.
            rest: (c, a) angles at rest, rad.
        """
        theta = np.empty(self.rotation.shape)
        kernels.bending_angles(x, alpha, self.patches.kind, self.quad, self.ghost, rest, self.rotation, theta)
        return theta

    def by_triangle(self, theta: Array, B_triangle: Array) -> Array:
        """(t,) energies of the triangles, N mm, of which `B_triangle` (t, 3, 3) are the matrices of a linear law.

        Args:
            theta: (c, a) angles less those at rest, rad.
            B_triangle: (t, 3, 3) N mm.
        """
        p = self.patches
        out = np.empty(len(B_triangle))
        if not self.constant:
            out[p.members[:, 0]] = self._area * self.law.energy(self.curvature(theta))
            return out
        half = np.einsum("cha,ca->ch", p.shares, theta).reshape(*p.members.shape, 3)
        inside = p.members >= 0
        member = p.members[inside]
        out[member] = 0.5 * np.einsum("tk,tkl,tl->t", half[inside], B_triangle[member], half[inside])
        return out
