"""How bars and hinges depend on the design: exact derivatives of forces and energies with respect to element data.

With velocities v of the nodes and w of the moments of held creases, and with a dot for rates along them,

    r . (v, w) = sum k_s (l - L) l' + sum [k (phi - phi_R) + couple + lock m(phi)] phi' + sum w (phi - target)
                 - load . v

is linear in every stiffness and smooth in lengths and angles; its derivatives with respect to these data, at fixed
positions, are written out below, and those of the energies and of the second variation (v, w) . K (v, w) too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.mechanics.shared.hinge_lock import lock_terms
from bh.mechanics.shared.kinematics import dihedral_gradients, dihedral_hessians
from meshes.topology import Ints

if TYPE_CHECKING:
    from bh.mechanics.bars_and_hinges.system import BarsAndHingesSystem

Array = NDArray[np.float64]
Data = dict[str, Array]


class BarHingeDesign:
    """Derivatives of one system at one state. `other` are the unknowns after the displacements: moments, N mm."""

    def __init__(self, system: BarsAndHingesSystem, q: Array, lam: float) -> None:
        if system.elements.green:
            raise ModelError("given element stiffness with Green's strain has no sensitivities; use l - L")
        self.system, self.q, self.lam = system, q, lam
        e = system.elements
        self.x = system.positions(q, lam)
        _, _, _, self.forces, self.turn = system.internal_forces(self.x, q, lam)
        self.d = self.x[e.bars[:, 1]] - self.x[e.bars[:, 0]]
        self.length = np.linalg.norm(self.d, axis=1)
        self.stretch = self.length - e.bar_length
        self.g = dihedral_gradients(self.x, e.hinges).reshape(-1, 4, 3)
        # energy, moment and stiffness of a lock of stiffness one
        self.unit_lock = lock_terms(self.turn + e.rest.at(lam), np.ones(len(e.hinges)))

    def data(self) -> Data:
        """What the residual is made of. `places` (n, 3) are positions along supports, the rest element data."""
        e, lam = self.system.elements, self.lam
        return {
            "places": self.system.displacements.reactions(self.x),
            "bar_length": e.bar_length,
            "bar_stiffness": e.bar_stiffness,
            "hinge_stiffness": e.hinge_stiffness,
            "lock": e.lock,
            "rest": e.rest.at(lam),
            "couple": e.couple.at(lam),
            "load": self.system.force.at(lam),
        }

    # ------------------------------------------------------------------------------- derivatives to positions

    def energy_gradient(self, kinds: tuple[str, ...]) -> tuple[Array, Array]:
        """Gradient of `State.energy` of some kinds to the positions (n, 3) and the other unknowns; without locks."""
        e = self.system.elements
        f = np.zeros_like(self.x)
        if "stretching" in kinds:
            pull = (e.bar_stiffness * self.stretch / self.length)[:, None] * self.d
            np.add.at(f, e.bars[:, 1], pull)
            np.add.at(f, e.bars[:, 0], -pull)
        moment = self._kinds(e.hinge_stiffness * self.turn, kinds)
        np.add.at(f, e.hinges, moment[:, None, None] * self.g)
        return f, np.zeros(e.held)

    def angle_gradient(self, hinges: Ints, weights: Array) -> tuple[Array, Array, Data]:
        """Gradient of the weighted sum of `State.dihedral_angles` of some hinges of the mesh; and to the data."""
        rows = self.system.mesh.topology.hinges[hinges]
        f = np.zeros_like(self.x)
        g = dihedral_gradients(self.x, rows).reshape(-1, 4, 3)
        np.add.at(f, rows, weights[:, None, None] * g)
        return f, np.zeros(self.system.elements.held), {}

    def second_variation(self, v: Array, w: Array) -> tuple[Array, Array]:
        """Rates of the gradient, of all nodes and of the other unknowns, along v (n, 3) and w."""
        system, e = self.system, self.system.elements
        f = system._tangent_times(self.x, v, self.forces)
        turned = self._rate(v)
        if e.held:
            held = slice(len(e.hinges) - e.held, None)
            np.add.at(f, e.hinges[held], w[:, None, None] * self.g[held])
            return f, turned[held] - system._compliance * w
        return f, np.zeros(0)

    def support(self) -> dict[str, Ints]:
        """For every entry of the data that depends on the flat mesh the nodes (..., k) that it depends on, then -1."""
        e = self.system.elements
        beside = self.system.mesh.topology.edge_triangles
        corners = np.where((beside >= 0)[..., None], self.system.mesh.triangles[beside], -1).reshape(
            len(beside), 6
        )
        own = np.arange(len(self.x))[:, None, None].repeat(3, axis=1)
        on_hinge = dict.fromkeys(("hinge_stiffness", "lock", "rest", "couple"), e.hinges)
        return {"bar_length": corners, "bar_stiffness": corners, "places": own, **on_hinge}

    def imposed(self, by_data: Data) -> Array:
        """(m,) derivatives to the imposed angles of hinges of the mesh, of derivatives to the data; zero elsewhere."""
        e = self.system.elements
        out = np.zeros(len(self.system.mesh.topology.hinges))
        if e.held:
            out[e.source[-e.held :]] = by_data["rest"][-e.held :]
        return out

    # ------------------------------------------------------------------------------- derivatives to data

    def residual_to_data(self, v: Array, w: Array) -> Data:
        """Derivatives of residual . (v, w) to the data, at fixed positions."""
        e = self.system.elements
        l1, p1 = self._stretching(v), self._rate(v)
        rest = -e.hinge_stiffness * p1
        couple = p1.copy()
        if e.held:
            rest[-e.held :], couple[-e.held :] = -w, 0.0
        return {
            "bar_length": -e.bar_stiffness * l1,
            "bar_stiffness": self.stretch * l1,
            "hinge_stiffness": self.turn * p1,
            "lock": self.unit_lock[:, 1] * p1,
            "rest": rest,
            "couple": couple,
            "load": -v,
        }

    def energy_to_data(self, kinds: tuple[str, ...]) -> Data:
        """Derivatives of `State.energy` of some kinds to the data, at fixed positions."""
        e = self.system.elements
        on = float("stretching" in kinds)
        return {
            "bar_length": -on * e.bar_stiffness * self.stretch,
            "bar_stiffness": 0.5 * on * self.stretch**2,
            "hinge_stiffness": self._kinds(0.5 * self.turn**2, kinds),
            "rest": self._kinds(-e.hinge_stiffness * self.turn, kinds),
        }

    def second_to_data(self, v: Array, w: Array) -> Data:
        """Derivatives of the second variation (v, w) . K (v, w) to the data, at fixed positions."""
        e = self.system.elements
        l1, p1 = self._stretching(v), self._rate(v)
        dv = v[e.bars[:, 1]] - v[e.bars[:, 0]]
        l2 = ((dv**2).sum(axis=1) - l1**2) / self.length
        turning = v[e.hinges].reshape(-1, 12)
        p2 = np.einsum("hi,hij,hj->h", turning, dihedral_hessians(self.x, e.hinges), turning)
        couple = p2.copy()
        if e.held:
            couple[-e.held :] = 0.0
        return {
            "bar_length": -e.bar_stiffness * l2,
            "bar_stiffness": l1**2 + self.stretch * l2,
            "hinge_stiffness": p1**2 + self.turn * p2,
            "lock": self.unit_lock[:, 1] * p2 + self.unit_lock[:, 2] * p1**2,
            "rest": -e.hinge_stiffness * p2,
            "couple": couple,
        }

    def _stretching(self, v: Array) -> Array:
        """(b,) rates of the lengths."""
        bars = self.system.elements.bars
        return np.asarray(np.einsum("bc,bc->b", self.d, v[bars[:, 1]] - v[bars[:, 0]]) / self.length)

    def _rate(self, v: Array) -> Array:
        """(h,) rates of the dihedral angles."""
        return np.asarray(np.einsum("hpc,hpc->h", self.g, v[self.system.elements.hinges]))

    def _kinds(self, values: Array, kinds: tuple[str, ...]) -> Array:
        """Values of hinges, zero for kinds that are not asked for."""
        e, out = self.system.elements, values.copy()
        if "bending" not in kinds:
            out[: e.bending] = 0.0
        if "folding" not in kinds:
            out[e.bending : e.bending + e.spring] = 0.0
        return out
