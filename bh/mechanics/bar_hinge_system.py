"""The system of bars and hinges for one step: energy, residual and tangent as functions of the unknowns."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.mechanics.assembly import (
    Pattern,
    build_pattern,
    nodal_forces,
    predicted_forces,
    tangent_times,
    tangent_values,
)
from bh.mechanics.elements import sheet_elements
from bh.mechanics.hinge_lock import ZONE, until_closed
from bh.mechanics.kinematics import dihedral_angles, dihedral_gradients
from bh.mechanics.motions import describe_motion
from bh.model import Model
from bh.program import StepProgram, hinge_name
from bh.solvers.matrices import FreeBodyMatrix, IndefiniteError, Matrix
from bh.solvers.saddle import ConstraintRows, MultiplierMatrix
from bh.solvers.system import Evaluation
from bh.state import State
from bh.supports import Constraints, free_motions, rigid_motions
from meshes.topology import Ints

Array = NDArray[np.float64]
LARGEST_TURN = 1.3  # rad that any hinge may turn in one increment before the driver mistrusts it
COMPLIANCE = 1e-9  # of a held crease, in parts of 1 / gamma
ROUNDING = 8.0 * np.finfo(float).eps


class BarsAndHingesSystem:
    """`bh.solvers.System` of one step. Unknowns: free displacements in local axes (mm), then held moments (N mm)."""

    def __init__(self, model: Model, program: StepProgram, start: State | None) -> None:
        self.mesh = model.mesh
        mesh = self.mesh
        if len(program.constraints.clamped):
            raise ModelError(
                "bars and hinges have no slope at an edge to clamp; take formulation consistent, or hold the next row"
            )
        self.reference = mesh.points
        start_points = mesh.points if start is None else start.points
        held_start = dihedral_angles(start_points, mesh.topology.hinges)
        edges = mesh.points[mesh.topology.hinges[:, 1:3]]
        moments = np.zeros(len(held_start)) if start is None else np.nan_to_num(start.crease_moments)
        moments *= np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
        self.elements = sheet_elements(model, program, held_start, moments)
        self.turned = np.flatnonzero(program.constraints.frame_of >= 0)
        self.turned_axes = program.constraints.frames[program.constraints.frame_of[self.turned]]
        self._displacement_start = self.to_local(start_points - mesh.points)
        # a displacement whose start is not given begins with what the node has
        given = program.constraints.start
        begin = np.where(np.isnan(given), self._displacement_start, given)
        self.constraints: Constraints = replace(program.constraints, start=begin)
        self.force = program.force
        self.program = program

        free = ~self.constraints.fixed
        self.number = np.full(free.shape, -1, dtype=np.int64)
        self.number[free] = np.arange(free.sum())
        self.free = np.flatnonzero(free.ravel())
        self.primal = len(self.free)
        if self.primal == 0:
            raise ModelError("the supports hold every node; nothing can move, so remove some of them")
        self.size = self.primal + self.elements.held
        self.prescribed_rate = (self.constraints.end - self.constraints.start) * self.constraints.fixed
        self._bar_scale = model.sheet.E * model.sheet.t
        self._moments_start = moments
        self._d_bar = np.empty((len(self.elements.bars), 3))
        self._g_hinge = np.empty((len(self.elements.hinges), 12))
        self._k_hinge = np.empty(len(self.elements.hinges))  # with the locks, as of the last tangent
        if self.constraints.rigid_body:
            self._check_balance()

    # ------------------------------------------------------------------------------- unknowns and positions

    @property
    def rotation(self) -> float:
        return self.program.rotation

    @cached_property
    def energy_scale(self) -> float:
        return 0.5 * float(self.elements.hinge_stiffness.sum())

    def start(self) -> Array:
        """Unknowns of the state that the step begins with."""
        q = np.zeros(self.size)
        q[: self.primal] = self._displacement_start.ravel()[self.free]
        if self.elements.held:
            q[self.primal :] = self._moments_start[self.elements.source[-self.elements.held :]]
        return q

    def positions(self, q: Array, lam: float) -> Array:
        """(n, 3) node positions, mm."""
        local = (1.0 - lam) * self.constraints.start + lam * self.constraints.end
        local.ravel()[self.free] = q[: self.primal]
        return self.reference + self.to_global(local)

    def vectors(self, dq: Array) -> Array:
        """(n, 3) changes of positions, mm, for changes dq (size,) of the unknowns."""
        local = np.zeros_like(self.reference)
        local.ravel()[self.free] = dq[: self.primal]
        return self.to_global(local)

    def loads(self, forces: Array) -> Array:
        """(size,) what nodal forces (n, 3), N, are to the unknowns; their part along supports is left out."""
        out = np.zeros(self.size)
        out[: self.primal] = self.to_local(forces).ravel()[self.free]
        return out

    def to_global(self, local: Array) -> Array:
        if len(self.turned) == 0:
            return local
        out = local.copy()
        out[self.turned] = np.einsum("nij,ni->nj", self.turned_axes, local[self.turned])
        return out

    def to_local(self, vectors: Array) -> Array:
        if len(self.turned) == 0:
            return vectors
        out = vectors.copy()
        out[self.turned] = np.einsum("nij,nj->ni", self.turned_axes, vectors[self.turned])
        return out

    @cached_property
    def hinge_lengths(self) -> Array:
        ends = self.reference[self.elements.hinges[:, 1:3]]
        return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)

    # ------------------------------------------------------------------------------- the System protocol

    def evaluate(self, q: Array, lam: float) -> Evaluation:
        x = self.positions(q, lam)
        energy, size, f, forces, turn = self.internal_forces(x, q, lam)
        load = (1.0 - lam) * self.force.start + lam * self.force.end
        energy -= float(np.vdot(load, x - self.reference))
        f -= load
        residual = np.empty(self.size)
        residual[: self.primal] = self.to_local(f).ravel()[self.free]
        gap = penalty = 0.0
        if self.elements.held:
            missed = turn[-self.elements.held :]
            residual[self.primal :] = missed - self._compliance * q[self.primal :]
            energy -= 0.5 * float(self._compliance @ q[self.primal :] ** 2)
            penalty = 0.5 * float(self.elements.penalty @ missed**2)
            # a held angle is to be met to 1e-12 rad: what is left of it, times the stiffness of the bars, is a moment
            gap = 1e4 * max(float(np.abs(residual[self.primal :]).max()) - ROUNDING, 0.0)
            # the compliance is no excuse for an angle that is not met
            gap = max(gap, 10.0 * float(np.abs(missed).max()))
        return Evaluation(energy, residual, self._imbalance(residual, size, load, x, gap), forces, penalty)

    def _imbalance(self, residual: Array, size: float, load: Array, x: Array, gap: float) -> float:
        largest = float(np.abs(residual[: self.primal]).max(initial=0.0))
        # coordinates are rounded to eps |x| and angles to eps, which the stiffest elements turn into forces that
        # nobody can balance
        floor = ROUNDING * (self._stiffest_bar * float(np.abs(x).max()) + self._stiffest_hinge)
        if largest <= floor:
            return gap
        size = max(size, float(np.abs(load).max(initial=0.0)), 1e-300)
        return max((largest - floor) / size, gap)

    @cached_property
    def _stiffest_bar(self) -> float:
        return float(self.elements.bar_stiffness.max())

    @cached_property
    def _stiffest_hinge(self) -> float:
        """Largest stiffness over height of a wing, N / rad."""
        heights = 2.0 * self.mesh.areas.min() / self.hinge_lengths if len(self.hinge_lengths) else np.ones(1)
        return float((self.elements.hinge_stiffness / heights).max(initial=0.0))

    def internal_forces(self, x: Array, q: Array, lam: float) -> tuple[float, float, Array, Array, Array]:
        """Energy, typical element force, nodal forces (n, 3), element forces (bars, then hinges) and turns (h,), rad.

        The turn of a hinge is its dihedral angle less the one at rest.
        """
        e = self.elements
        f = np.zeros_like(x)
        turn = np.empty(len(e.hinges))
        forces = np.empty(len(e.bars) + len(e.hinges))
        energy, size = nodal_forces(
            x, e.bars, e.bar_length, e.bar_stiffness, e.green, e.hinges, e.hinge_stiffness, e.lock,
            e.rest.at(lam), self.couple(q, lam), f, forces[: len(e.bars)], forces[len(e.bars) :], turn,
        )  # fmt: skip
        return energy, size, f, forces, turn

    def couple(self, q: Array, lam: float) -> Array:
        """(h,) couples on the hinges, N mm: applied moments, and the multipliers of held creases."""
        couple = self.elements.couple.at(lam)
        if self.elements.held:
            couple[-self.elements.held :] = q[self.primal :]
        return couple

    def tangent(self, q: Array, lam: float, forces: Array) -> Matrix:
        e, pattern = self.elements, self._pattern
        bars = len(e.bars)
        x = self.positions(q, lam)
        data = np.zeros(pattern.size)
        tangent_values(
            x, e.bars, e.bar_length, e.bar_stiffness, e.green, forces[:bars], pattern.slots[0],
            e.hinges, self._augmented_stiffness, e.lock, forces[bars:], pattern.slots[1],
            self.constraints.frame_of, self.constraints.frames, data, self._d_bar, self._g_hinge, self._k_hinge,
        )  # fmt: skip
        matrix: Matrix
        if self.constraints.rigid_body:
            Z = self._rigid(x)
            ground = self._ground(Z, data)
            matrix = FreeBodyMatrix(pattern.matrix(data), Z, *ground)
        else:
            matrix = pattern.matrix(data)
        if not e.held:
            return matrix
        return MultiplierMatrix(matrix, self._constraint_rows(), e.penalty, self._compliance)

    def predicted_forces(self, forces: Array, dq: Array) -> Array:
        e = self.elements
        bars = len(e.bars)
        out = np.empty_like(forces)
        predicted_forces(
            e.bars, e.bar_stiffness, forces[:bars], self._d_bar, e.hinges, self._k_hinge, forces[bars:],
            self._g_hinge, self.vectors(dq), out[:bars], out[bars:],
        )  # fmt: skip
        if e.held:
            out[-e.held :] = forces[-e.held :] + dq[self.primal :]
        return out

    def control_rate(self, q: Array, lam: float) -> Array:
        e = self.elements
        x = self.positions(q, lam)
        _, _, _, forces, _ = self.internal_forces(x, q, lam)
        g = dihedral_gradients(x, e.hinges)
        moment_rate = e.couple.rate - e.hinge_stiffness * e.rest.rate
        out = -self.force.rate.copy()
        np.add.at(out, e.hinges, (moment_rate[:, None] * g).reshape(-1, 4, 3))
        moving = self.to_global(self.prescribed_rate)
        if moving.any():
            out += self._tangent_times(x, moving, forces)
        rate = np.empty(self.size)
        rate[: self.primal] = self.to_local(out).ravel()[self.free]
        if e.held:
            turn = np.einsum("hpc,hpc->h", g.reshape(-1, 4, 3), moving[e.hinges]) - e.rest.rate
            rate[self.primal :] = turn[-e.held :]
        return rate

    def power(self, q: Array, lam: float) -> float:
        e = self.elements
        x = self.positions(q, lam)
        _, _, f, _, turn = self.internal_forces(x, q, lam)
        moment = e.hinge_stiffness * turn + self.couple(q, lam)  # without the lock, which knows no rest angle
        total = float(e.couple.rate @ turn - moment @ e.rest.rate)
        total -= float(np.vdot(self.force.rate, x - self.reference))
        unbalanced = self.to_local(f - self.force.at(lam))
        return total + float(np.vdot(unbalanced, self.prescribed_rate))

    def control_stiffness(self, q: Array, lam: float) -> float:
        """d^2 energy / d lambda^2 at fixed q, N mm."""
        e = self.elements
        x = self.positions(q, lam)
        total = float(e.hinge_stiffness @ e.rest.rate**2) - 2.0 * float(e.couple.rate @ e.rest.rate)
        moving = self.to_global(self.prescribed_rate)
        if moving.any():
            _, _, _, forces, _ = self.internal_forces(x, q, lam)
            out = self._tangent_times(x, moving, forces)
            g = dihedral_gradients(x, e.hinges).reshape(-1, 4, 3)
            turn = np.einsum("hpc,hpc->h", g, moving[e.hinges])
            total += float(np.vdot(out, moving)) - 2.0 * float(np.vdot(self.force.rate, moving))
            total += 2.0 * float((e.couple.rate - e.hinge_stiffness * e.rest.rate) @ turn)
        return total

    def _tangent_times(self, x: Array, v: Array, forces: Array) -> Array:
        """Tangent of all elements times v (n, 3), in global axes and with no support left out."""
        e, bars = self.elements, len(self.elements.bars)
        out = np.zeros_like(x)
        tangent_times(
            x, v, e.bars, e.bar_length, e.bar_stiffness, e.green, forces[:bars],
            e.hinges, e.hinge_stiffness, e.lock, forces[bars:], out,
        )  # fmt: skip
        return out

    def objection(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        through = self.crossing(q, lam, q_new, lam_new)
        if through:
            return through
        turn = float(np.abs(self._angles(q_new, lam_new) - self._angles(q, lam)).max(initial=0.0))
        return f"a hinge turned by {np.degrees(turn):.0f} degrees" if turn > LARGEST_TURN else ""

    def obstacle(self, q: Array, lam: float) -> tuple[str, str]:
        touching = self.contact(q, lam)
        if touching:
            return "contact", touching
        if not self.constraints.rigid_body or not (self.force.start.any() or self.force.end.any()):
            return "", ""
        # an accepted state is in equilibrium; do the forces stay so a little further along the path?
        try:
            factor = self.tangent(q, lam, self.evaluate(q, lam).forces).factorise(1e-9)
        except IndefiniteError:
            return "", ""
        ahead = 1e-3 * max(lam, 0.01)
        moved = q - ahead * factor.solve(self.control_rate(q, lam))
        lost = self._unbalanced(moved, lam + ahead) - self._unbalanced(q, lam)
        if lost <= 1e-6 * ahead:
            return "", ""
        return "mechanism", "the forces turn the free sheet, so they do not stay in equilibrium; add supports"

    def _unbalanced(self, q: Array, lam: float) -> float:
        """Part of the dead forces that works on rigid motions."""
        local = self.to_local(self.force.at(lam)).ravel()[self.free]
        Z = self._rigid(self.positions(q, lam))
        return float(np.abs(Z.T @ local).max(initial=0.0)) / max(float(np.abs(local).sum()), 1e-300)

    def describe(self, q: Array, lam: float, motion: Array) -> str:
        return describe_motion(self.mesh, self.positions(q, lam), self.vectors(motion))

    def crossing(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        """Which panels passed through each other at a hinge between two states, or an empty string.

        Angles are known modulo a turn, so a hinge that passes 0 or 2 pi is seen to jump by nearly a turn; it counts as
        passed where the way through closed is the shorter one (a jump by more than pi).
        """
        jump = np.abs(self._angles(q_new, lam_new) - self._angles(q, lam))
        if jump.max(initial=0.0) <= np.pi:
            return ""
        return f"{self._panels(int(np.argmax(jump)))} would pass through each other"

    def contact(self, q: Array, lam: float) -> str:
        """Which panels have met at a hinge (within `hinge_lock.ZONE` of closed), or an empty string.

        Names the hinge that is nearest to 0 or 2 pi. Held creases are not asked, they follow their angle; nor are
        hinges that are made closed. Where a path cannot go on, this tells whether contact is the reason, with the lock
        or without.
        """
        e = self.elements
        left = until_closed(self._angles(q, lam))
        left[until_closed(dihedral_angles(self.reference, e.hinges)) < ZONE] = np.inf
        left = left[: e.bending + e.spring]
        if len(left) == 0 or left.min() >= ZONE:
            return ""
        nearest = int(np.argmin(left))
        return f"{self._panels(nearest)} touch ({np.degrees(left[nearest]):.2g} degrees from closed)"

    def _angles(self, q: Array, lam: float) -> Array:
        return dihedral_angles(self.positions(q, lam), self.elements.hinges)

    def _panels(self, hinge: int) -> str:
        return f"the panels at {hinge_name(self.mesh, int(self.elements.source[hinge]))}"

    # ------------------------------------------------------------------------------- pattern, grounding, constraints

    @cached_property
    def _pattern(self) -> Pattern:
        groups: tuple[Ints, ...] = (self.elements.bars, self.elements.hinges)
        if self.constraints.rigid_body:
            groups += (self.mesh.triangles[self._ground_triangle][None, :],)
        return build_pattern(self.number, groups, self.reference)

    @cached_property
    def _compliance(self) -> Array:
        """Compliance of held creases, rad / (N mm): far below rounding of the angles at ordinary moments.

        Where panels are rigid, a straight crease can carry moments that balance each other at no cost; it picks the
        smallest ones.
        """
        return COMPLIANCE / self.elements.penalty

    @cached_property
    def _augmented_stiffness(self) -> Array:
        e = self.elements
        return np.concatenate((e.hinge_stiffness[: len(e.hinges) - e.held], e.penalty))

    @cached_property
    def _held_columns(self) -> Ints:
        return self.number[self.elements.hinges[-self.elements.held :]].reshape(-1, 12)

    def _constraint_rows(self) -> ConstraintRows:
        g = self._g_hinge[-self.elements.held :]
        if len(self.turned):
            index = self.constraints.frame_of[self.elements.hinges[-self.elements.held :]]
            axes = np.where((index >= 0)[..., None, None], self.constraints.frames[index], np.eye(3))
            g = np.einsum("hpij,hpj->hpi", axes, g.reshape(-1, 4, 3)).reshape(-1, 12)
        return ConstraintRows(g.copy(), self._held_columns, self.primal)

    def _rigid(self, x: Array) -> Array:
        """Orthonormal rigid motions (primal, r) that the supports leave free at positions x."""
        motions = rigid_motions(x) @ free_motions(x, self.constraints)
        for column in range(motions.shape[1]):
            motions[:, column] = self.to_local(motions[:, column].reshape(-1, 3)).ravel()
        return np.linalg.qr(motions[self.free])[0]

    @cached_property
    def _ground_triangle(self) -> int:
        """The triangle that carries the stiffness against rigid motions: in the middle, without supports of its own."""
        centres = self.reference[self.mesh.triangles].mean(axis=1)
        distance = np.linalg.norm(centres - self.reference.mean(axis=0), axis=1)
        held = (self.number[self.mesh.triangles] < 0).sum(axis=(1, 2))
        return int(np.lexsort((distance, held))[0])

    def _ground(self, Z: Array, data: Array) -> tuple[Ints, Array]:
        """Add a stiffness against the rigid motions of one triangle; returns its unknowns and its matrix."""
        number = self.number[self.mesh.triangles[self._ground_triangle]].ravel()
        rows = np.where(number[:, None] >= 0, Z[np.maximum(number, 0)], 0.0)
        Q = np.linalg.qr(rows)[0] if Z.shape[1] else rows
        block = self._bar_scale * (Q @ Q.T)
        slots = self._pattern.slots[2][0]
        values = block[np.tril_indices(9)]
        keep = slots >= 0
        np.add.at(data, slots[keep], values[keep])
        inside = number >= 0
        return number[inside], block[np.ix_(inside, inside)]

    def _check_balance(self) -> None:
        Z = self._rigid(self.reference)
        for load in (self.force.start, self.force.end):
            local = self.to_local(load).ravel()[self.free]
            if np.abs(Z.T @ local).max(initial=0.0) > 1e-9 * max(float(np.abs(local).sum()), 1e-300):
                raise ModelError(
                    "the forces on a sheet without enough supports are not in equilibrium; add supports or balance them"
                )
