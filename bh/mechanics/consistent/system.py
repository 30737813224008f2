"""The system of the consistent formulation for one step: energy, residual and tangent as functions of the unknowns."""

from __future__ import annotations

from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.formulations.state import State
from bh.loading.load_step import LoadStep
from bh.materials import Material
from bh.mechanics.consistent import kernels
from bh.mechanics.consistent.elements import LINEAR, consistent_elements, lock_stiffness
from bh.mechanics.consistent.forces import ElementForces, Internal
from bh.mechanics.consistent.membrane import Measure, smoothed_strain
from bh.mechanics.consistent.membrane_kernels import bar_forces
from bh.mechanics.consistent.rotations import Slopes, TurningEdges
from bh.mechanics.consistent.sparsity import rotation_pattern
from bh.mechanics.shared import penetration as closings
from bh.mechanics.shared.base_system import typical_force
from bh.mechanics.shared.crease_curves import crease_curves, letting_go
from bh.mechanics.shared.hinge_lock import lock_terms
from bh.mechanics.shared.kinematics import dihedral_angles
from bh.mechanics.shared.sparsity import Pattern
from bh.model.model import Model
from bh.solvers.matrices import FreeBodyMatrix, Matrix
from bh.solvers.system import Evaluation, Tangent
from meshes.topology import Ints

if TYPE_CHECKING:
    from bh.loading.symmetry import Mirror

Array = NDArray[np.float64]
GROUND = np.tril_indices(9)
ROUNDING = 8.0 * np.finfo(float).eps


class ConsistentSystem(TurningEdges):
    """`bh.solvers.System` of one step. Unknowns: free displacements in local axes (mm), then edge rotations (rad)."""

    def __init__(
        self,
        model: Model,
        load_step: LoadStep,
        start: State | None,
        plane: Mirror | None = None,
        measure: Measure = smoothed_strain,
        material: Material = LINEAR,
    ) -> None:
        """Elements, unknowns and supports of the step.

        Args:
            model: the whole sheet.
            load_step: what is prescribed.
            start: the state that the step begins at; None for the stress-free sheet.
            plane: of the half, or None for the whole sheet.
            measure: of the strain.
            material: of the sheet.

        Raises:
            ModelError: supports leave nothing to move, or a load that the formulation does not take.
        """
        of_half = load_step
        if plane is not None:
            from bh.mechanics.shared.mirrored import half_load_step

            of_half = half_load_step(load_step, plane)
        super().__init__(model, of_half, start, plane)
        mesh = self.mesh
        self.hinges = hinges = mesh.topology.hinges
        start_points = mesh.points if start is None else start.points
        reference = dihedral_angles(mesh.points, hinges)
        ends = mesh.points[hinges[:, 1:3]]
        moments = np.zeros(len(hinges)) if start is None else np.nan_to_num(start.crease_moments)
        moments *= np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        # a released crease begins with the moment that it has; what its lock takes of it is not the spring's
        moments -= lock_terms(dihedral_angles(start_points, hinges), lock_stiffness(model, load_step))[:, 1]
        # a crease that was ordinary sheet up to here is smooth, whatever its triangles do
        angles = (
            reference
            if start is None
            else np.where(np.isnan(start.crease_moments), reference, start.dihedral_angles)
        )
        if load_step.freed is not None:
            self.load_step = load_step = letting_go(model, load_step, start, angles, moments)
        self.elements = consistent_elements(
            model, load_step, angles, moments, plane, measure, material, start
        )
        self.curves = crease_curves(model, load_step, start, self.elements.springs, plane is not None)
        self.size = self.primal = self.moving + self.elements.rotations
        self._scale = model.sheet.E * model.sheet.t
        self._start_points = np.array(
            start_points
        )  # of a kind with all other positions: kernels compile once
        self._frame_of = np.append(self.constraints.frame_of, -1)
        self._let_go(start, self.start(), -self.elements.let_go)

    # ------------------------------------------------------------------------------- unknowns and positions

    @cached_property
    def energy_scale(self) -> float:
        """Bending stiffness of all triangles and stiffness of all springs, times one radian squared, N mm."""
        e = self.elements
        return 0.5 * float(np.trace(e.B_triangle, axis1=1, axis2=2).sum() + e.spring_stiffness.sum())

    def start(self) -> Array:
        """Unknowns of the state that the step begins with; the rotations are those of least energy there."""
        if self.tethers:
            return self.tethers.begin.copy()
        q = np.zeros(self.size)
        q[: self.moving] = self.displacements.start()
        q[self.moving :] = self.rotations_at(self._start_points, 0.0, self.elements.let_go)
        return q

    def unknowns_at(self, x: Array, lam: float) -> Array:
        """(size,) unknowns of positions x (n, 3), mm, as far as supports allow; rotations are those of least energy.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        q = np.zeros(self.size)
        q[: self.moving] = self.displacements.components(x - self.positions(q, lam))
        q[self.moving :] = self.rotations_at(self.positions(q, lam), lam)
        return q

    @cached_property
    def _counts(self) -> tuple[int, int, int, int]:
        e = self.elements
        return len(e.stretching.membrane.bars), e.rotation.size, len(e.springs), len(e.lock)

    def split(self, forces: Array) -> ElementForces:
        """Element forces as they belong together."""
        t, c, h, _ = self._counts
        M = forces[t : t + c].reshape(self.elements.rotation.shape)
        return ElementForces(forces[:t], M, forces[t + c : t + c + h], forces[t + c + h :])

    # ------------------------------------------------------------------------------- the System protocol

    def internal(self, x: Array, alpha: Array, lam: float) -> Internal:
        """Energies, gradient and element forces at positions x and rotations alpha.

        Args:
            x: (nodes, 3) positions, mm.
            alpha: (rotations,) of the edges, rad.
            lam: load parameter of the step, 0 to 1.
        """
        e = self.elements
        f, r = np.zeros_like(x), e.turning.at(lam)
        forces, theta = np.empty(sum(self._counts)), np.empty(e.rotation.shape)
        turns = np.empty(len(e.springs))
        N, M, S, L = self.split(forces)
        grown = None if e.growth is None else e.growth.at(lam)
        stretching, size = e.stretching.forces(x, f, N, grown)
        bending, more, closing = e.bending.forces(x, alpha, e.rest.at(lam), f, r, M, theta)
        if e.coupling is not None:
            bending += self._coupled(x, theta, lam, f, r, N, M)
        rest, couple, stiffness, missing = e.spring_rest.at(lam), e.couple.at(lam), e.spring_stiffness, 0.0
        if self.curves is not None:
            stiffness, couple, missing = self.curves.straight(stiffness, couple, self.turns(x, alpha, lam))
        springs, most, too = kernels.spring_forces(
            x, alpha, e.hinges, stiffness, rest, couple, e.turns, f, r, S, turns
        )
        springs += missing
        L[:] = 0.0
        lock = closings.lock_forces(x, self.hinges, e.lock, f, L) if closing or too else 0.0
        size = float(np.sqrt((size + more + most) / (len(forces) - len(L))))
        return Internal(stretching, bending, springs, lock, size, f, r, forces, theta, turns)

    def _coupled(self, x: Array, theta: Array, lam: float, f: Array, r: Array, N: Array, M: Array) -> float:
        """Energy of the coupling of laminates, N mm; adds its gradient to f and r, and its forces to N and M."""
        e = self.elements
        assert e.coupling is not None
        membrane = e.stretching.membrane
        energy, more, turning = e.coupling.forces(e.stretching.gamma(x), theta, lam)
        bar_forces(x, membrane.bars, membrane.rest_square, more, f)
        kernels.bending_gradient(x, e.patches.kind, e.quad, e.ghost, e.rotation, turning, f, r)
        N += more
        M += turning
        return energy

    def stretching_by_triangle(self, x: Array, lam: float = 0.0) -> Array:
        """(t,) energy of stretching, N mm, of the triangles of the mesh.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        topology = self.mesh.topology
        beside = topology.edge_triangles[topology.hinge_edges]
        growth = self.elements.growth
        at_rest = None if growth is None else growth.strains(lam)
        return self.elements.stretching.by_triangle(x, len(self.mesh.triangles), beside, at_rest)

    def bending_by_triangle(self, theta: Array, x: Array | None = None, lam: float = 0.0) -> Array:
        """(t,) energy of bending, N mm, and of the coupling of laminates.

        Args:
            theta: (c, a) angles of the patches, rad.
            x: (nodes, 3) positions, mm, of a laminate.
            lam: load parameter of the step, 0 to 1.
        """
        e = self.elements
        out = e.bending.by_triangle(theta, e.B_triangle)
        if e.coupling is not None and x is not None:
            out += np.einsum("ta,ta->t", e.coupling.forces(e.stretching.gamma(x), theta, lam)[2], theta)
        return out

    def evaluate(self, q: Array, lam: float) -> Evaluation:
        """Energy, residual (size,) and element forces (`split`) at q (size,)."""
        x = self.near(q, lam)
        now = self.internal(x, q[self.moving :], lam)
        load = self.force.at(lam)
        touched = self.press(x, lam, now.f)
        energy = (
            now.stretching
            + now.bending
            + now.springs
            + now.lock
            + touched
            - float(np.vdot(load, x - self.displacements.home))
            + float(self.elements.turning.at(lam) @ q[self.moving :])
        )
        residual = np.concatenate((self.displacements.components(now.f - load), now.r))
        energy += self.tethers.push(q, lam, residual)
        scale = self._outer_scale(load, x, lam)
        imbalance = self._imbalance(residual, now.size, scale, x) if energy < np.inf else np.inf
        return Evaluation(energy, residual, imbalance, now.forces)

    def _imbalance(self, residual: Array, size: float, load: Array, x: Array) -> float:
        largest = float(np.abs(residual[: self.moving]).max(initial=0.0))
        turning = float(np.abs(residual[self.moving :] / self._heights).max(initial=0.0))
        floor = self._floor(x)
        return max(largest - floor, turning - floor, 0.0) / typical_force(size, load)

    def _floor(self, x: Array) -> float:
        """Coordinates are rounded to eps |x| and angles to eps; the stiffest elements make forces of that."""
        stretch, bend = self._stiffest
        return ROUNDING * (stretch * float(np.abs(x).max()) + bend)

    def _size(self, x: Array, q: Array, lam: float) -> float:
        return self.internal(x, q[self.moving :], lam).size

    @property
    def _stiffest_edge(self) -> float:
        return self._stiffest[0]

    def tangent(self, q: Array, lam: float, forces: Array) -> Tangent:
        """The tangent at q (size,) with `forces` in its geometric part; see `bh.solvers.system.System`."""
        e, joined = self.elements, self.elements.patches
        x = self.near(q, lam)
        touching = self._touching(x, lam)
        pattern = self._pattern
        N, M, S, L = self.split(forces)
        data = np.zeros(pattern.size)
        axes = (self._frame_of, self.constraints.frames)
        e.stretching.tangent(x, N, *axes, pattern.slots[0], pattern.slots[3], data)
        B = joined.B
        if not e.bending.constant:
            B = e.bending.stiffness(e.bending.angles(x, q[self.moving :], e.rest.at(lam)))
        closing = kernels.bending_tangent(
            x, joined.kind, e.quad, e.ghost, e.place, e.rotation, e.column, e.width, B, M, e.nodes, *axes,
            pattern.slots[1], data,
        )  # fmt: skip
        if e.coupling is not None:
            e.coupling.tangent(x, joined, e.quad, e.ghost, e.rotation, *axes, pattern.slots[-1], data)
        stiffness = self.slopes(x, q, lam)
        closing |= kernels.spring_tangent(
            x, e.hinges, stiffness, S, self._spring_nodes, *axes, pattern.slots[2], data
        )
        if self.outside is not None:
            self.outside.tangent(x, lam, *axes, pattern.slots[0], data)
        if touching is not None and self.contact_blocks is not None:
            last = -1 if e.coupling is None else -2
            self.contact_blocks.add(*touching, *axes, pattern.slots[last], data)
        if closing or L.any():
            closings.lock_tangent(x, self.hinges, e.lock, L, *axes, pattern.slots[3], data)
        self.tethers.stiffen(lam, data, pattern)
        matrix: Matrix = pattern.matrix(data)
        if self.constraints.rigid_body:
            matrix = self._free_body(x, data)
        matrix = self._followed(matrix, x, lam)
        return Tangent(matrix, partial(self._predicted_forces, x, Slopes(B, stiffness), bool(closing)))

    def _free_body(self, x: Array, data: Array) -> FreeBodyMatrix:
        """The matrix of `data` where rigid motions are left free at positions x; grounds one triangle in `data`."""
        pattern = self._pattern
        rigid = self.displacements.rigid(x)
        Z = np.vstack((rigid, np.zeros((self.size - self.moving, rigid.shape[1]))))
        block = self.displacements.grounding(rigid, self._scale)
        slots, number = pattern.slots[4][0], self.displacements.ground_numbers
        np.add.at(data, slots[slots >= 0], block[GROUND][slots >= 0])
        inside = number >= 0
        weight = self.displacements.weight
        if weight is not None:
            weight = np.concatenate((weight, np.ones(self.size - self.moving)))
        return FreeBodyMatrix(pattern.matrix(data), Z, number[inside], block[np.ix_(inside, inside)], weight)

    @cached_property
    def _spring_nodes(self) -> Ints:
        """(h, 5) nodes of a spring, and -1 for the block of its rotations."""
        return np.pad(self.elements.hinges, ((0, 0), (0, 1)), constant_values=-1)

    @cached_property
    def _pattern(self) -> Pattern:
        ground = self.displacements.ground_triangle if self.constraints.rigid_body else None
        pairs = None if self.contact_blocks is None else self.contact_blocks.pairs
        return rotation_pattern(self.mesh, self.elements, self.displacements, ground, pairs)

    def _predicted_forces(self, x: Array, slopes: Slopes, closing: bool, forces: Array, dq: Array) -> Array:
        """Element forces after an increment dq (size,) from positions x with `forces`, linear in dq."""
        rates, _ = self.force_rates(x, self.vectors(dq), dq[self.moving :], slopes, closing, controlled=False)
        return forces + rates

    def force_rates(
        self, x: Array, v: Array, w: Array, slopes: Slopes, closing: bool, controlled: bool
    ) -> tuple[Array, Array]:
        """Rates of the element forces and of the springs' turns for velocities v (n, 3) and w (rotations,) at x.

        `controlled` adds what rest angles and couples do while
        lambda grows at the rate 1; without `closing` there are no locks.

        Args:
            x: (nodes, 3) positions, mm.
            v: (nodes, 3) velocities.
            w: (rotations,) rates of the rotations.
            slopes: of patches and springs there.
            closing: a hinge is in the zone of its lock.
            controlled: lambda grows at the rate 1.
        """
        e, by = self.elements, float(controlled)
        rates, turns = np.empty(sum(self._counts)), np.empty(len(e.springs))
        N, M, S, L = self.split(rates)
        e.stretching.rates(x, v, N)
        if e.growth is not None and controlled:
            N += e.growth.forces.rate
        joined = e.patches
        kernels.bending_rates(
            x, v, w, joined.kind, e.quad, e.ghost, by * e.rest.rate, e.rotation, slopes.patches, M
        )
        if e.coupling is not None:
            dN, dM = e.coupling.rates(e.stretching.gamma_rates(x, v), self._turning(x, v, w, by), controlled)
            N += dN
            M += dM
        kernels.spring_rates(
            x,
            v,
            w,
            e.hinges,
            slopes.springs,
            by * e.spring_rest.rate,
            by * e.couple.rate,
            e.turns,
            S,
            turns,
        )
        L[:] = 0.0
        if closing:
            closings.lock_rates(x, v, self.hinges, e.lock, L)
        return rates, turns

    def _turning(self, x: Array, v: Array, w: Array, by: float) -> Array:
        """(c, a) rates of the angles of patches, rest angles included where `by` is 1."""
        e, out = self.elements, np.empty(self.elements.rotation.shape)
        unit = np.tile(np.eye(3), (len(out), 1, 1))  # of single triangles
        rest = by * e.rest.rate
        kernels.bending_rates(x, v, w, e.patches.kind, e.quad, e.ghost, rest, e.rotation, unit, out)
        return out

    def _gradient_rates(self, q: Array, lam: float) -> tuple[Array, Array, float]:
        """Rates with lambda at fixed q of the gradient: f (n, 3) and r; and the second derivative of the energy.

        All of elements only, without dead forces.
        """
        e = self.elements
        x = self.near(q, lam)
        now = self.internal(x, q[self.moving :], lam)
        v = self.displacements.prescribed_motion
        at = Slopes(e.bending.stiffness(now.theta), self.spring_stiffness(now.turns))
        rates, turns = self.force_rates(x, v, np.zeros(e.rotations), at, closing=False, controlled=True)
        f, r = np.zeros_like(x), e.turning.rate
        (N, M, S, L), (dN, dM, dS, _) = self.split(now.forces), self.split(rates)
        e.stretching.force_rates(x, v, N, dN, f)
        kernels.bending_force_rates(x, v, e.patches.kind, e.quad, e.ghost, e.rotation, M, dM, f, r)
        kernels.spring_force_rates(x, v, e.hinges, e.turns, S, dS, f, r)
        if L.any():
            closings.lock_force_rates(x, v, self.hinges, e.lock, L, f)
        if self.outside is not None:
            self.outside.force_rates(x, v, lam, 1.0, f)
        if self.contact_blocks is not None:
            f += self.touch_rates(x, v, lam, 1.0)
        second = float(np.vdot(v, f)) - self._rest_work(dM, dS) + float(e.couple.rate @ turns)
        if e.growth is not None:
            second += e.growth.second(e.stretching.gamma_rates(x, v))
        if e.coupling is not None:
            turning = self._turning(x, v, np.zeros(e.rotations), 1.0)
            second += float(np.vdot(e.coupling.moments.rate, turning))
        return f, r, second

    def _rest_work(self, M: Array, S: Array) -> float:
        """Moments times the rates of the rest angles."""
        e = self.elements
        turning = e.patches.kind == kernels.TURN
        return float(np.vdot(M[turning], e.rest.rate[turning])) + float(S @ e.spring_rest.rate)

    def control_rate(self, q: Array, lam: float) -> Array:
        """(size,) d residual / d lambda at fixed q: N for displacements, N mm / rad for rotations."""
        f, r, _ = self._gradient_rates(q, lam)
        rate = np.concatenate((self.displacements.components(f - self.force.rate), r))
        return self.tethers.rates(q, lam, rate)

    def power(self, q: Array, lam: float) -> float:
        """Rate of work of the actuation, d energy / d lambda at fixed q (size,), N mm."""
        x = self.near(q, lam)
        now = self.internal(x, q[self.moving :], lam)
        _, M, S, _ = self.split(now.forces)
        total = float(self.elements.couple.rate @ now.turns) - self._rest_work(M, S)
        total += self.tethers.power(q, lam) - float(np.vdot(self.force.rate, x - self.displacements.home))
        total += float(self.elements.turning.rate @ q[self.moving :])
        if self.elements.growth is not None:
            total += self.elements.growth.power(self.elements.stretching.gamma(x), lam)
        if self.elements.coupling is not None:
            total += float(np.vdot(self.elements.coupling.moments.rate, now.theta))
        if self.outside is not None:
            total += self.outside.power(x, lam)
        if self.contact_blocks is not None:
            total += self.touch_power(x, lam)
        self.press(x, lam, now.f)
        unbalanced = self.displacements.to_local(now.f - self.force.at(lam))
        return total + float(np.vdot(unbalanced, self.displacements.prescribed_rate))

    def control_stiffness(self, q: Array, lam: float) -> float:
        """Second derivative of the energy by lambda at fixed q (size,), N mm."""
        v = self.displacements.prescribed_motion
        x = self.near(q, lam)
        more = 0.0 if self.outside is None else self.outside.control_stiffness(x, v, lam)
        more += self.tethers.second(q, lam)
        if self.contact_blocks is not None:
            more += self.touch_stiffness(x, v, lam)
        return self._gradient_rates(q, lam)[2] - 2.0 * float(np.vdot(self.force.rate, v)) + more
