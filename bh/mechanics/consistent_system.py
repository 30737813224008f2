"""The system of the consistent formulation for one step: energy, residual and tangent as functions of the unknowns."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bh.mechanics import consistent_kernels as kernels
from bh.mechanics.assembly import Pattern, pattern_of_keys
from bh.mechanics.consistent_elements import consistent_elements
from bh.mechanics.displacements import Displacements
from bh.mechanics.kinematics import dihedral_angles
from bh.model import Model
from bh.program import StepProgram
from bh.solvers.matrices import FreeBodyMatrix, Matrix, reverse_cuthill_mckee
from bh.solvers.system import Evaluation
from bh.state import State
from meshes.topology import Ints

Array = NDArray[np.float64]
LARGEST_TURN = 1.3  # rad that any hinge may turn in one increment before the driver mistrusts it
ROUNDING = 8.0 * np.finfo(float).eps


class ElementForces(NamedTuple):
    """Forces N (t, 3), N/mm, and moments M (t, 3) of triangles and moments S (h,) of spring creases, N mm."""

    N: Array
    M: Array
    S: Array


class Internal(NamedTuple):
    """Energies (N mm), their gradients to positions f (n, 3) and rotations r (r,), and element forces.

    `sheet` (t, 2) are stretching and bending of the triangles, `springs` is that of the springs and their couples.
    `size` is a typical element force (N), `turns` (h,) what the springs have turned (rad).
    """

    sheet: Array
    springs: float
    size: float
    f: Array
    r: Array
    forces: Array
    turns: Array


class ConsistentSystem:
    """`bh.solvers.System` of one step. Unknowns: free displacements in local axes (mm), then edge rotations (rad)."""

    def __init__(self, model: Model, program: StepProgram, start: State | None) -> None:
        self.mesh = mesh = model.mesh
        self.program = program
        self.force = program.force
        hinges = mesh.topology.hinges
        start_points = mesh.points if start is None else start.points
        reference = dihedral_angles(mesh.points, hinges)
        ends = mesh.points[hinges[:, 1:3]]
        moments = np.zeros(len(hinges)) if start is None else np.nan_to_num(start.crease_moments)
        moments *= np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        # a crease that was ordinary sheet up to here is smooth, whatever its triangles do
        angles = (
            reference
            if start is None
            else np.where(np.isnan(start.crease_moments), reference, start.dihedral_angles)
        )
        self.elements = consistent_elements(model, program, angles, moments)
        self.displacements = Displacements(mesh, program.constraints, start_points)
        self.constraints = self.displacements.constraints
        self.moving = len(self.displacements.free)
        self.size = self.primal = self.moving + self.elements.rotations
        self._scale = model.sheet.E * model.sheet.t
        self._start_points = start_points
        self._tangent_at = mesh.points
        self._frame_of = np.append(self.constraints.frame_of, -1)
        if self.constraints.rigid_body:
            self.displacements.check_balance(self.force)

    # ------------------------------------------------------------------------------- unknowns and positions

    @property
    def rotation(self) -> float:
        return self.program.rotation

    @cached_property
    def energy_scale(self) -> float:
        e = self.elements
        return 0.5 * float(np.trace(e.B, axis1=1, axis2=2).sum() + e.spring_stiffness.sum())

    def start(self) -> Array:
        """Unknowns of the state that the step begins with; the rotations are those of least energy there."""
        q = np.zeros(self.size)
        q[: self.moving] = self.displacements.start()
        r = self.internal(self._start_points, q[self.moving :], 0.0).r
        if np.abs(r).max(initial=0.0) > 0.0:
            q[self.moving :] = -sp.linalg.splu(self.rotation_stiffness()).solve(r)
        return q

    def rotation_stiffness(self) -> sp.csc_matrix:
        """Hessian of the energy in the rotations alone, which does not depend on anything."""
        e = self.elements
        most = 9 * len(e.triangles) + 4 * len(e.springs)
        rows, columns, values = np.empty(most, np.int64), np.empty(most, np.int64), np.empty(most)
        used = kernels.rotation_matrix(
            e.rotation, e.kind, e.B, e.turns, e.spring_stiffness, rows, columns, values
        )
        entries = (values[:used], (rows[:used], columns[:used]))
        return sp.csc_matrix(entries, shape=(e.rotations, e.rotations))

    def positions(self, q: Array, lam: float) -> Array:
        """(n, 3) node positions, mm."""
        return self.displacements.positions(q[: self.moving], lam)

    def split(self, forces: Array) -> ElementForces:
        """Element forces as they belong together."""
        t = 3 * len(self.elements.triangles)
        return ElementForces(forces[:t].reshape(-1, 3), forces[t : 2 * t].reshape(-1, 3), forces[2 * t :])

    # ------------------------------------------------------------------------------- the System protocol

    def internal(self, x: Array, alpha: Array, lam: float) -> Internal:
        """Energies, gradient and element forces at positions x and rotations alpha."""
        e = self.elements
        f, r = np.zeros_like(x), np.zeros(e.rotations)
        forces = np.empty(6 * len(e.triangles) + len(e.springs))
        N, M, S = self.split(forces)
        sheet = np.empty((len(e.triangles), 2))
        size = kernels.sheet_forces(
            x, alpha, e.triangles, e.rest_square, e.K, e.kind, e.quad, e.ghost, e.rest.at(lam), e.rotation, e.B,
            f, r, N, M, sheet,
        )  # fmt: skip
        turns = np.empty(len(e.springs))
        springs, more = kernels.spring_forces(
            x, alpha, e.hinges, e.spring_stiffness, e.spring_rest.at(lam), e.couple.at(lam), e.turns, f, r, S, turns
        )
        size = float(np.sqrt((size + more) / len(forces)))
        return Internal(sheet, springs, size, f, r, forces, turns)

    def evaluate(self, q: Array, lam: float) -> Evaluation:
        x = self.positions(q, lam)
        now = self.internal(x, q[self.moving :], lam)
        load = self.force.at(lam)
        energy = float(now.sheet.sum()) + now.springs - float(np.vdot(load, x - self.mesh.points))
        residual = np.concatenate((self.displacements.components(now.f - load), now.r))
        return Evaluation(energy, residual, self._imbalance(residual, now.size, load, x), now.forces)

    def _imbalance(self, residual: Array, size: float, load: Array, x: Array) -> float:
        largest = float(np.abs(residual[: self.moving]).max(initial=0.0))
        turning = float(np.abs(residual[self.moving :] / self._heights).max(initial=0.0))
        # coordinates are rounded to eps |x| and angles to eps, which the stiffest elements turn into forces that
        # nobody can balance
        stretch, bend = self._stiffest
        floor = ROUNDING * (stretch * float(np.abs(x).max()) + bend)
        size = max(size, float(np.abs(load).max(initial=0.0)), 1e-300)
        return max(largest - floor, turning - floor, 0.0) / size

    @cached_property
    def _heights(self) -> Array:
        """(rotations,) height of a triangle on the edge of each rotation, mm: what turns a moment into a force."""
        e = self.elements
        height = 2.0 * self.mesh.areas[:, None] / np.sqrt(e.rest_square)
        out = np.ones(e.rotations)
        used = e.rotation >= 0
        out[e.rotation[used]] = height[used]
        return out

    @cached_property
    def _stiffest(self) -> tuple[float, float]:
        """Largest stiffness of an edge, N/mm, and of a hinge over the height of its wing, N / rad."""
        e = self.elements
        stretch = np.einsum("tkk,tk->tk", e.K, e.rest_square).max()
        height = 2.0 * self.mesh.areas[:, None] / np.sqrt(e.rest_square)
        bend = (np.einsum("tkk->tk", e.B) / height).max()
        spring = (e.spring_stiffness / height.min()).max(initial=0.0)
        return float(stretch), float(max(bend, spring))

    def tangent(self, q: Array, lam: float, forces: Array) -> Matrix:
        e, pattern = self.elements, self._pattern
        x = self.positions(q, lam)
        N, M, S = self.split(forces)
        data = np.zeros(pattern.size)
        kernels.sheet_tangent(
            x, e.triangles, e.rest_square, e.K, N, e.kind, e.quad, e.ghost, e.place, e.rotation, e.B, M,
            e.nodes, self._frame_of, self.constraints.frames, pattern.slots[0], data,
        )  # fmt: skip
        kernels.spring_tangent(
            x, e.hinges, e.spring_stiffness, S, e.spring_nodes, self._frame_of, self.constraints.frames,
            pattern.slots[1], data,
        )  # fmt: skip
        self._tangent_at = x
        if not self.constraints.rigid_body:
            return pattern.matrix(data)
        rigid = self.displacements.rigid(x)
        Z = np.vstack((rigid, np.zeros((self.size - self.moving, rigid.shape[1]))))
        block = self.displacements.grounding(rigid, self._scale)
        slots, number = pattern.slots[2][0], self.displacements.ground_numbers
        np.add.at(data, slots[slots >= 0], block[np.tril_indices(9)][slots >= 0])
        inside = number >= 0
        return FreeBodyMatrix(pattern.matrix(data), Z, number[inside], block[np.ix_(inside, inside)])

    @cached_property
    def _pattern(self) -> Pattern:
        """Rotations are numbered with their edges: vertices of the graph are nodes, then rotations."""
        e, number, n = self.elements, self.displacements.number, len(self.mesh.points)
        past = np.vstack((number, np.full((1, 3), -1)))
        sheet, springs = past[e.nodes], past[e.spring_nodes]
        turns = self.moving + np.where(e.rotation >= 0, e.rotation, -1 - self.moving)
        sheet[:, -1] = np.where(e.rotation >= 0, turns, -1)
        springs[:, -1, :2] = self.moving + e.turns
        groups = [sheet.reshape(len(sheet), -1), springs.reshape(len(springs), 15)]
        if self.constraints.rigid_body:
            groups.append(self.displacements.ground_numbers[None, :])
        rotations = np.where(e.rotation >= 0, n + 1 + e.rotation, n)
        vertices = np.hstack((e.nodes[:, :-1], rotations))
        joined = np.hstack((e.spring_nodes[:, :-1], n + 1 + e.turns))
        order_vertices, _ = reverse_cuthill_mckee(*_pairs(vertices, joined, n), n + 1 + e.rotations)
        unknowns = np.full((n + 1 + e.rotations, 3), -1, dtype=np.int64)
        unknowns[:n] = number
        unknowns[n + 1 :, 0] = self.moving + np.arange(e.rotations)
        order = unknowns[order_vertices].ravel()
        order = order[order >= 0]
        position = np.empty(self.size, dtype=np.int64)
        position[order] = np.arange(self.size)
        keys = []
        for group in groups:
            width = group.shape[1]
            slots = np.empty((len(group), width * (width + 1) // 2), dtype=np.int64)
            kernels.dof_slots(group, position, self.size, slots)
            keys.append(slots)
        return pattern_of_keys(order, position, keys)

    def predicted_forces(self, forces: Array, dq: Array) -> Array:
        v = self.displacements.vectors(dq[: self.moving])
        rates, _ = self._force_rates(self._tangent_at, v, dq[self.moving :], controlled=False)
        return forces + rates

    def _force_rates(self, x: Array, v: Array, w: Array, controlled: bool) -> tuple[Array, Array]:
        """Rates of the element forces and of the springs' turns for velocities v (n, 3) and w (rotations,) at x.

        `controlled` adds what rest angles and couples do while lambda grows at the rate 1.
        """
        e, by = self.elements, float(controlled)
        rates, turns = np.empty(6 * len(e.triangles) + len(e.springs)), np.empty(len(e.springs))
        N, M, S = self.split(rates)
        kernels.sheet_rates(
            x, v, w, e.triangles, e.K, e.kind, e.quad, e.ghost, by * e.rest.rate, e.rotation, e.B, N, M
        )
        kernels.spring_rates(
            x, v, w, e.hinges, e.spring_stiffness, by * e.spring_rest.rate, by * e.couple.rate, e.turns, S, turns
        )
        return rates, turns

    def _gradient_rates(self, q: Array, lam: float) -> tuple[Array, Array, float]:
        """Rates with lambda at fixed q of the gradient: f (n, 3) and r; and the second derivative of the energy.

        All of elements only, without dead forces.
        """
        e = self.elements
        x = self.positions(q, lam)
        now = self.internal(x, q[self.moving :], lam)
        v = self.displacements.to_global(self.displacements.prescribed_rate)
        rates, turns = self._force_rates(x, v, np.zeros(e.rotations), controlled=True)
        f, r = np.zeros_like(x), np.zeros(e.rotations)
        (N, M, S), (dN, dM, dS) = self.split(now.forces), self.split(rates)
        kernels.force_rates(
            x, v, e.triangles, e.kind, e.quad, e.ghost, e.rotation, N, M, dN, dM, e.hinges, S, dS, e.turns, f, r
        )
        second = float(np.vdot(v, f)) - self._rest_work(dM, dS) + float(e.couple.rate @ turns)
        return f, r, second

    def _rest_work(self, M: Array, S: Array) -> float:
        """Moments times the rates of the rest angles."""
        e = self.elements
        turning = e.kind == kernels.TURN
        return float(np.vdot(M[turning], e.rest.rate[turning])) + float(S @ e.spring_rest.rate)

    def control_rate(self, q: Array, lam: float) -> Array:
        f, r, _ = self._gradient_rates(q, lam)
        return np.concatenate((self.displacements.components(f - self.force.rate), r))

    def power(self, q: Array, lam: float) -> float:
        x = self.positions(q, lam)
        now = self.internal(x, q[self.moving :], lam)
        _, M, S = self.split(now.forces)
        total = float(self.elements.couple.rate @ now.turns) - self._rest_work(M, S)
        total -= float(np.vdot(self.force.rate, x - self.mesh.points))
        unbalanced = self.displacements.to_local(now.f - self.force.at(lam))
        return total + float(np.vdot(unbalanced, self.displacements.prescribed_rate))

    def control_stiffness(self, q: Array, lam: float) -> float:
        """d^2 energy / d lambda^2 at fixed q, N mm."""
        v = self.displacements.to_global(self.displacements.prescribed_rate)
        return self._gradient_rates(q, lam)[2] - 2.0 * float(np.vdot(self.force.rate, v))

    def objection(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        before, after = self.positions(q, lam), self.positions(q_new, lam_new)
        turn = float(kernels.largest_turn(before, after, self.mesh.topology.hinges))
        return f"a hinge turned by {np.degrees(turn):.0f} degrees" if turn > LARGEST_TURN else ""


def _pairs(sheet: Ints, springs: Ints, absent: int) -> tuple[Ints, Ints]:
    """Pairs of vertices that share an element; `absent` stands for none."""
    rows, columns = [], []
    for group in (sheet, springs):
        for i in range(group.shape[1]):
            for j in range(i):
                both = (group[:, i] != absent) & (group[:, j] != absent)
                rows.append(group[both, i])
                columns.append(group[both, j])
    return np.concatenate(rows), np.concatenate(columns)
