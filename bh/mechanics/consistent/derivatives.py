"""How the consistent formulation depends on the design: the counterpart of `bars_and_hinges.derivatives`.

Bars have gamma = (l^2 - L^2) / 2 and cells the energy 1/2 gamma.K.gamma of theirs, patches angles theta (phi - rest
less the rotations) and 1/2 theta.B.theta, spring creases 1/2 k turn^2. With velocities v of the nodes and w of the
rotations,

    r . (v, w) = sum gamma'.K.gamma + sum theta'.B.theta + sum (k turn + couple) turn' + lock m(phi) phi' - load . v.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.mechanics.consistent import kernels
from bh.mechanics.consistent.membrane import Cells
from bh.mechanics.consistent.membrane_kernels import bar_rates, cell_forces
from bh.mechanics.consistent.rotations import Slopes
from bh.mechanics.shared import penetration as closings
from bh.mechanics.shared.hinge_lock import lock_terms
from bh.mechanics.shared.kinematics import dihedral_angles, dihedral_gradients, dihedral_hessians
from meshes.topology import Ints

if TYPE_CHECKING:
    from bh.mechanics.consistent.system import ConsistentSystem

Array = NDArray[np.float64]
Data = dict[str, Array]
CLAMPED = "sensitivities to geometry do not know clamped edges; hold their nodes, or keep the geometry"
CELLS = ("K of triangles", "K of edges")


class ConsistentDerivatives:
    """Derivatives of one system at one state. `other` are the unknowns after the displacements: rotations, rad."""

    unfollowed: Mapping[str, str] = MappingProxyType({"ghost": CLAMPED})

    def __init__(self, system: ConsistentSystem, q: Array, lam: float) -> None:
        """Linearise elements at a state.

        Args:
            system: of the step.
            q: (size,) unknowns.
            lam: control parameter.
        """
        self.system, self.moving, self.q, self.lam = system, system.moving, q, lam
        e = system.elements
        self.alpha = q[system.moving :]
        self.x = system.positions(q, lam)
        self.now = system.internal(self.x, self.alpha, lam)
        self.N, self.M, self.S, self.L = system.split(self.now.forces)
        self.membrane = e.stretching.membrane
        self.gamma = e.stretching.gamma(self.x)
        self.turning = e.patches.kind == kernels.TURN
        self.unit_lock = lock_terms(dihedral_angles(self.x, system.hinges), np.ones(len(system.hinges)))

    def data(self) -> Data:
        """What the residual is made of. `places` (n, 3) are positions along supports, the rest element data.

        `prescribed` (m,) are imposed angles: of the residual they are part of `rest`, but states show them. `ghost` is
        where the sheet would go on beyond clamped edges.
        """
        e, lam = self.system.elements, self.lam
        return {
            "places": self.system.displacements.reactions(self.x),
            "rest_square": self.membrane.rest_square,
            **dict(zip(CELLS, e.stretching.stiffness(self.x), strict=True)),
            "B": e.patches.B,
            "rest": np.where(self.turning, e.rest.at(lam), 0.0),
            "ghost": e.ghost,
            "spring_stiffness": e.spring_stiffness,
            "spring_rest": e.spring_rest.at(lam),
            "couple": e.couple.at(lam),
            "prescribed": np.nan_to_num(e.prescribed.at(lam)),
            "lock": e.lock,
            "load": self.system.force.at(lam),
        }

    # ------------------------------------------------------------------------------- derivatives to positions

    def energy_gradient(self, kinds: tuple[str, ...]) -> tuple[Array, Array]:
        """Gradient of `State.energy` of some kinds to the positions (n, 3) and the rotations; without locks."""
        e, x, alpha = self.system.elements, self.x, self.alpha
        f, r = np.zeros_like(x), np.zeros(e.rotations)
        if "stretching" in kinds:
            e.stretching.forces(x, f, np.empty_like(self.N))
        if "bending" in kinds:
            rest, M, theta = e.rest.at(self.lam), np.empty_like(self.M), np.empty_like(self.M)
            kernels.bending_forces(
                x, alpha, e.patches.kind, e.quad, e.ghost, rest, e.rotation, e.patches.B, f, r, M, theta
            )
        if "folding" in kinds:
            S, turns, none = (np.zeros(len(e.springs)) for _ in range(3))
            rest = e.spring_rest.at(self.lam)
            kernels.spring_forces(x, alpha, e.hinges, e.spring_stiffness, rest, none, e.turns, f, r, S, turns)
        return f, r

    def angle_gradient(self, hinges: Ints, weights: Array) -> tuple[Array, Array, Data]:
        """Gradient of the weighted sum of `State.dihedral_angles` of some hinges of the mesh; and to the data."""
        e = self.system.elements
        free = np.isnan(e.prescribed.end[hinges])
        prescribed = np.zeros(len(e.prescribed.end))
        prescribed[hinges[~free]] = weights[~free]
        quads = self.system.hinges[hinges[free]]
        f, r = np.zeros_like(self.x), np.zeros(e.rotations)
        g = dihedral_gradients(self.x, quads).reshape(-1, 4, 3)
        np.add.at(f, quads, weights[free][:, None, None] * g)
        row = np.full(len(prescribed), -1)
        row[e.springs] = np.arange(len(e.springs))
        of_spring = row[hinges] >= 0
        for side in range(2):
            np.add.at(r, e.turns[row[hinges[of_spring]], side], -weights[of_spring])
        return f, r, {"prescribed": prescribed}

    def second_variation(self, v: Array, w: Array) -> tuple[Array, Array]:
        """Rates of the gradient, of all nodes and of the rotations, along v (n, 3) and w."""
        system, e, x = self.system, self.system.elements, self.x
        slopes = Slopes(e.patches.B, e.spring_stiffness)
        rates, _ = system.force_rates(x, v, w, slopes, closing=bool(self.L.any()), controlled=False)
        dN, dM, dS, _ = system.split(rates)
        f, r = np.zeros_like(x), np.zeros(e.rotations)
        e.stretching.force_rates(x, v, self.N, dN, f)
        kernels.bending_force_rates(x, v, e.patches.kind, e.quad, e.ghost, e.rotation, self.M, dM, f, r)
        kernels.spring_force_rates(x, v, e.hinges, e.turns, self.S, dS, f, r)
        if self.L.any():
            closings.lock_force_rates(x, v, system.hinges, e.lock, self.L, f)
        return f, r

    def support(self) -> dict[str, Ints]:
        """For every entry of the data that depends on the flat mesh the nodes (..., k) that it depends on, then -1."""
        e, joined = self.system.elements, self.system.elements.patches
        own = np.arange(len(self.x))[:, None, None].repeat(3, axis=1)
        inside = np.where((joined.members >= 0)[..., None], e.triangles[joined.members], -1)
        patch = inside.reshape(len(inside), 1, 1, -1)
        count = joined.kind.shape[1]
        of_spring = dict.fromkeys(("spring_stiffness", "spring_rest", "couple"), e.hinges)
        return {
            "places": own,
            "rest_square": self.membrane.bars,
            **{name: _spread(cells) for name, cells in zip(CELLS, self.membrane.cells, strict=True)},
            "B": patch.repeat(count, axis=1).repeat(count, axis=2),
            "lock": self.system.hinges,
            **of_spring,
        }

    def imposed(self, by_data: Data) -> Array:
        """(m,) derivatives to the imposed angles of hinges of the mesh, of derivatives to the data; zero elsewhere."""
        e = self.system.elements
        out = np.array(by_data.get("prescribed", np.zeros(len(e.prescribed.end))))
        here = self.turning & (e.patches.hinge >= 0)
        np.add.at(out, e.patches.hinge[here], by_data["rest"][here])
        return np.where(np.isnan(e.prescribed.end), 0.0, out)

    # ------------------------------------------------------------------------------- derivatives to data

    def residual_to_data(self, v: Array, w: Array) -> Data:
        """Derivatives of residual . (v, w) to the data, at fixed positions and rotations."""
        e = self.system.elements
        gamma1, theta1, turn1 = self._rates(v, w)
        _, _, phi_hinge1, _ = self._angles(v)
        return {
            "rest_square": -0.5 * self._forces(gamma1),
            **self._products(gamma1, self.gamma),
            "B": theta1[:, :, None] * self.now.theta[:, None, :],
            "rest": np.where(self.turning, -np.einsum("cab,cb->ca", e.patches.B, theta1), 0.0),
            "spring_stiffness": self.now.turns * turn1,
            "spring_rest": -e.spring_stiffness * turn1,
            "couple": turn1,
            "lock": self.unit_lock[:, 1] * phi_hinge1,
            "load": -v,
        }

    def energy_to_data(self, kinds: tuple[str, ...]) -> Data:
        """Derivatives of `State.energy` of some kinds to the data, at fixed positions and rotations."""
        stretch, bend, fold = (float(kind in kinds) for kind in ("stretching", "bending", "folding"))
        e, theta, turns = self.system.elements, self.now.theta, self.now.turns
        return {
            "rest_square": -0.5 * stretch * self.N,
            **self._products(0.5 * stretch * self.gamma, self.gamma),
            "B": 0.5 * bend * theta[:, :, None] * theta[:, None, :],
            "rest": np.where(self.turning, -bend * self.M, 0.0),
            "spring_stiffness": 0.5 * fold * turns**2,
            "spring_rest": -fold * e.spring_stiffness * turns,
        }

    def second_to_data(self, v: Array, w: Array) -> Data:
        """Derivatives of the second variation (v, w) . K (v, w) to the data, at fixed positions and rotations."""
        e = self.system.elements
        gamma1, theta1, turn1 = self._rates(v, w)
        ends = v[self.membrane.bars]
        gamma2 = ((ends[:, 1] - ends[:, 0]) ** 2).sum(axis=1)
        theta2, _, phi1, phi2 = self._angles(v)
        spring2 = phi2[e.springs]
        two = self._products(gamma2, self.gamma)
        return {
            "rest_square": -0.5 * self._forces(gamma2),
            **{name: one + two[name] for name, one in self._products(gamma1, gamma1).items()},
            "B": theta1[:, :, None] * theta1[:, None, :] + theta2[:, :, None] * self.now.theta[:, None, :],
            "rest": np.where(self.turning, -np.einsum("cab,cb->ca", e.patches.B, theta2), 0.0),
            "spring_stiffness": turn1**2 + self.now.turns * spring2,
            "spring_rest": -e.spring_stiffness * spring2,
            "couple": spring2,
            "lock": self.unit_lock[:, 1] * phi2 + self.unit_lock[:, 2] * phi1**2,
        }

    def _rates(self, v: Array, w: Array) -> tuple[Array, Array, Array]:
        """Rates of gamma (b,), theta (c, a) and the turns of the springs (h,)."""
        e = self.system.elements
        gamma1 = np.empty(len(self.membrane.bars))
        bar_rates(self.x, v, self.membrane.bars, gamma1)
        own = np.where(e.rotation >= 0, np.append(w, 0.0)[e.rotation], 0.0)
        _, phi1, phi_hinge1, _ = self._angles(v)
        theta1 = np.where(self.turning, phi1 - own, own)
        turn1 = phi_hinge1[e.springs] - w[e.turns].sum(axis=1)
        return gamma1, theta1, turn1

    def _forces(self, gamma: Array) -> Array:
        """(b,) sums over the cells of K gamma."""
        out = np.empty(len(gamma))
        three, five = self.membrane.cells
        K = self.system.elements.stretching.stiffness(self.x)
        cell_forces(three.bars, K[0], five.bars, K[1], gamma, out)
        return out

    def _products(self, one: Array, two: Array) -> Data:
        """Derivatives of one.K.two to the K of both kinds of cells, for values of all bars."""
        cells = zip(CELLS, self.membrane.cells, strict=True)
        return {name: one[c.bars][:, :, None] * two[c.bars][:, None, :] for name, c in cells}

    def _angles(self, v: Array) -> tuple[Array, Array, Array, Array]:
        """Second and first rates of the turns of patches (c, a), first and second ones of all hinges (m,)."""
        e, hinges = self.system.elements, self.system.hinges
        turning = v[hinges].reshape(-1, 12)
        phi1 = np.einsum("hi,hi->h", dihedral_gradients(self.x, hinges), turning)
        phi2 = np.einsum("hi,hij,hj->h", turning, dihedral_hessians(self.x, hinges), turning)
        on_hinge = self.turning & (e.patches.hinge >= 0)
        first, second = np.zeros(e.patches.kind.shape), np.zeros(e.patches.kind.shape)
        first[on_hinge], second[on_hinge] = phi1[e.patches.hinge[on_hinge]], phi2[e.patches.hinge[on_hinge]]
        clamp = self.turning & (e.patches.hinge < 0)
        if clamp.any():
            # a clamp's last node is a ghost that moves with its second one
            nodes = e.quad[clamp]
            corners = self.x[nodes]
            corners[:, 3] += e.ghost[clamp]
            rows, moving = np.arange(4 * len(nodes)).reshape(-1, 4), v[nodes].reshape(-1, 12)
            first[clamp] = np.einsum("hi,hi->h", dihedral_gradients(corners.reshape(-1, 3), rows), moving)
            hessians = dihedral_hessians(corners.reshape(-1, 3), rows)
            second[clamp] = np.einsum("hi,hij,hj->h", moving, hessians, moving)
        return second, first, phi1, phi2


def _spread(cells: Cells) -> Ints:
    """(c, k, k, p) nodes that the entries of a cell's K depend on."""
    count, most = cells.bars.shape
    return np.broadcast_to(cells.nodes[:, None, None, :], (count, most, most, cells.nodes.shape[1]))
