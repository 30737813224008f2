"""The system of bars and hinges for one step: energy, residual and tangent as functions of the unknowns."""

from __future__ import annotations

from functools import cached_property, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.state import State
from bh.loading.load_step import LoadStep
from bh.mechanics.bars_and_hinges.elements import bending_moments, sheet_elements
from bh.mechanics.shared.assembly import (
    Pattern,
    build_pattern,
    nodal_forces,
    predicted_forces,
    tangent_times,
    tangent_values,
)
from bh.mechanics.shared.base_system import SupportedSheet, typical_force
from bh.mechanics.shared.crease_curves import Straightened, crease_curves, letting_go
from bh.mechanics.shared.kinematics import dihedral_angles, dihedral_gradients
from bh.model.laws import PRESCRIBED
from bh.model.model import Model
from bh.solvers.matrices import FreeBodyMatrix, Matrix
from bh.solvers.saddle import ConstraintRows, MultiplierMatrix
from bh.solvers.system import Evaluation, Tangent
from meshes.topology import Ints

if TYPE_CHECKING:
    from bh.loading.symmetry import Mirror

Array = NDArray[np.float64]
COMPLIANCE = 1e-9  # of a prescribed crease, in parts of 1 / gamma
ROUNDING = 8.0 * np.finfo(float).eps


class Linearised(NamedTuple):
    """Elements linearised at a state, which predicts their forces beside it.

    Attributes:
        directions: (b, 3) derivatives of the elongations of bars by the positions of their second ends.
        turns: (h, 12) derivatives of the dihedral angles by the positions of the four nodes, rad / mm.
        stiffness: (h,) of hinges with their locks there, N mm / rad.
    """

    directions: Array
    turns: Array
    stiffness: Array


class BarsAndHingesSystem(SupportedSheet):
    """`bh.solvers.System` of one step. Unknowns: free displacements in local axes (mm), then prescribed moments (N mm).

    With a `plane` it is that of the half of a symmetric sheet (`bh.mechanics.shared.mirrored`).
    """

    def __init__(
        self, model: Model, load_step: LoadStep, start: State | None, plane: Mirror | None = None
    ) -> None:
        """Elements, unknowns and supports of the step.

        Args:
            model: the whole sheet.
            load_step: what is prescribed.
            start: the state that the step begins at; None for the stress-free sheet.
            plane: of the half, or None for the whole sheet.

        Raises:
            ModelError: an edge is clamped, which has no meaning without slopes, or supports leave nothing to move.
        """
        mesh = model.mesh
        if load_step.edge_couple is not None:
            raise ModelError("bars and hinges have no slope at an edge to turn; take formulation consistent")
        if len(load_step.constraints.clamped):
            raise ModelError(
                "bars and hinges have no slope at an edge to clamp; take formulation consistent, or hold "
                "nodes: support in place of hold, and the next row for the slope"
            )
        self.reference = mesh.points
        start_points = mesh.points if start is None else start.points
        prescribed_start = dihedral_angles(start_points, mesh.topology.hinges)
        edges = mesh.points[mesh.topology.hinges[:, 1:3]]
        moments = np.zeros(len(prescribed_start)) if start is None else np.nan_to_num(start.crease_moments)
        moments *= np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
        if load_step.freed is not None:
            load_step = letting_go(model, load_step, start, prescribed_start, moments)
        self.elements = sheet_elements(model, load_step, prescribed_start, moments)
        self.curves = crease_curves(model, load_step, start, self.springs, plane is not None)
        if (
            start is not None
        ):  # a crease that was ordinary sheet up to here is held against the sheet's moment
            sheet = np.isnan(start.crease_moments) & (load_step.law == PRESCRIBED)
            moments = np.where(sheet, bending_moments(model, prescribed_start), moments)
        if plane is not None:
            from bh.mechanics.shared.mirrored import half_elements, half_load_step

            self.elements = half_elements(self.elements, plane)
            load_step, moments = half_load_step(load_step, plane), plane.hinge_weight * moments
        super().__init__(model, load_step, start, plane)
        self.primal = self.moving
        self.size = self.primal + self.elements.prescribed
        self._bar_scale = model.sheet.E * model.sheet.t
        self._moments_start = moments
        self._let_go(start, self.start())

    # ------------------------------------------------------------------------------- unknowns and positions

    @cached_property
    def energy_scale(self) -> float:
        """Stiffness of all hinges times one radian squared, N mm."""
        return 0.5 * float(self.elements.hinge_stiffness.sum())

    def start(self) -> Array:
        """Unknowns of the state that the step begins with."""
        q = np.zeros(self.size)
        q[: self.primal] = self.displacements.start()
        if self.elements.prescribed:
            q[self.primal :] = self._moments_start[self.elements.source[-self.elements.prescribed :]]
        return q

    @cached_property
    def hinge_lengths(self) -> Array:
        """(h,) stress-free lengths of the edges of the hinges, mm."""
        ends = self.reference[self.elements.hinges[:, 1:3]]
        return np.asarray(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))

    # ------------------------------------------------------------------------------- the System protocol

    def evaluate(self, q: Array, lam: float) -> Evaluation:
        """Energy, residual (size,) and element forces at q (size,): forces of bars, N, then moments of hinges, N mm."""
        x = self.near(q, lam)
        energy, size, f, forces, turn = self.internal_forces(x, q, lam)
        load = (1.0 - lam) * self.force.start + lam * self.force.end
        energy -= float(np.vdot(load, x - self.displacements.home))
        f -= load
        energy += self.press(x, lam, f)
        residual = np.empty(self.size)
        residual[: self.primal] = self.displacements.components(f)
        energy += self.tethers.push(q, lam, residual)
        gap = penalty = 0.0
        if self.elements.prescribed:
            missed = turn[-self.elements.prescribed :]
            residual[self.primal :] = missed - self.compliance * q[self.primal :]
            energy -= 0.5 * float(self.compliance @ q[self.primal :] ** 2)
            penalty = 0.5 * float(self.elements.penalty @ missed**2)
            # a prescribed angle is to be met to 1e-12 rad: what is left of it, times the bars' stiffness, is a moment
            gap = 1e4 * max(float(np.abs(residual[self.primal :]).max()) - ROUNDING, 0.0)
            # the compliance is no excuse for an angle that is not met
            gap = max(gap, 10.0 * float(np.abs(missed).max()))
        load = self._outer_scale(load, x, lam)
        imbalance = self._imbalance(residual, size, load, x, gap) if energy < np.inf else np.inf
        return Evaluation(energy, residual, imbalance, forces, penalty)

    def _imbalance(self, residual: Array, size: float, load: Array, x: Array, gap: float) -> float:
        largest = float(np.abs(residual[: self.primal]).max(initial=0.0))
        floor = self._floor(x)
        if largest <= floor:
            return gap
        return max((largest - floor) / typical_force(size, load), gap)

    def _floor(self, x: Array) -> float:
        """Coordinates are rounded to eps |x| and angles to eps; the stiffest elements make forces of that."""
        return ROUNDING * (self._stiffest_edge * float(np.abs(x).max()) + self._stiffest_hinge)

    def _size(self, x: Array, q: Array, lam: float) -> float:
        return self.internal_forces(x, q, lam)[1]

    @cached_property
    def _stiffest_edge(self) -> float:
        return float(self.elements.bar_stiffness.max())

    @cached_property
    def _stiffest_hinge(self) -> float:
        """Largest stiffness over height of a wing, N / rad."""
        heights = 2.0 * self.mesh.areas.min() / self.hinge_lengths if len(self.hinge_lengths) else np.ones(1)
        return float((self.elements.hinge_stiffness / heights).max(initial=0.0))

    def internal_forces(self, x: Array, q: Array, lam: float) -> tuple[float, float, Array, Array, Array]:
        """Energy, typical element force, nodal forces (n, 3), element forces (bars, then hinges) and turns (h,), rad.

        The turn of a hinge is its dihedral angle less the one at rest.

        Args:
            x: (nodes, 3) positions, mm.
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        e = self.elements
        f = np.zeros_like(x)
        turn = np.empty(len(e.hinges))
        forces = np.empty(len(e.bars) + len(e.hinges))
        rest, couple, stiffness, more = e.rest.at(lam), self.couple(q, lam), e.hinge_stiffness, 0.0
        if self.curves is not None:
            line = self._straight(x, lam, couple)
            stiffness, couple, more = line
        energy, size = nodal_forces(
            x, e.bars, e.bar_length, e.bar_stiffness, e.green, e.hinges, stiffness, e.lock,
            rest, couple, f, forces[: len(e.bars)], forces[len(e.bars) :], turn,
        )  # fmt: skip
        return energy + more, size, f, forces, turn

    # ------------------------------------------------------------------------------- creases that are no straight line

    @property
    def springs(self) -> Ints:
        """(springs,) rows of `mesh.topology.hinges` of the spring creases, as the elements have them."""
        return self.elements.source[self._of_springs]

    @property
    def _of_springs(self) -> slice:
        return slice(self.elements.bending, self.elements.bending + self.elements.spring)

    def _straight(self, x: Array, lam: float, couple: Array) -> Straightened:
        """All hinges (h,) as straight lines at positions x (n, 3), with couples (h,), N mm."""
        e, at = self.elements, self._of_springs
        assert self.curves is not None
        turns = dihedral_angles(x, e.hinges[at]) - e.rest.at(lam)[at]
        line = self.curves.straight(e.hinge_stiffness[at], couple[at], turns)
        stiffness, couple = e.hinge_stiffness.copy(), couple.copy()
        stiffness[at], couple[at] = line.stiffness, line.couple
        return Straightened(stiffness, couple, line.missing)

    def hinge_stiffness(self, x: Array, lam: float) -> Array:
        """(h,) present slopes of the hinges' moments at positions x (n, 3), N mm / rad.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        if self.curves is None:
            return self.elements.hinge_stiffness
        return self._straight(x, lam, self.elements.couple.start).stiffness

    def crease_history_at(self, q: Array, lam: float) -> Array:
        """(m, 2) what creases remember where this state is accepted; see `bh.solvers.system.Remembering`.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        assert self.curves is not None
        angles = dihedral_angles(self.near(q, lam), self.mesh.topology.hinges)
        return self.curves.accepted(angles - self.load_step.rest.at(lam))

    def couple(self, q: Array, lam: float) -> Array:
        """(h,) couples on the hinges, N mm: applied moments, and the multipliers of prescribed creases.

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        couple = self.elements.couple.at(lam)
        if self.elements.prescribed:
            couple[-self.elements.prescribed :] = q[self.primal :]
        return couple

    def tangent(self, q: Array, lam: float, forces: Array) -> Tangent:
        """The tangent at q (size,) with `forces` in its geometric part; see `bh.solvers.system.System`."""
        e = self.elements
        bars = len(e.bars)
        x = self.near(q, lam)
        touching = self._touching(x, lam)
        pattern = self._pattern
        data = np.zeros(pattern.size)
        linear = Linearised(np.empty((bars, 3)), np.empty((len(e.hinges), 12)), np.empty(len(e.hinges)))
        tangent_values(
            x, e.bars, e.bar_length, e.bar_stiffness, e.green, forces[:bars], pattern.slots[0],
            e.hinges, self._augmented_stiffness(x, lam), e.lock, forces[bars:], pattern.slots[1],
            self.constraints.frame_of, self.constraints.frames, data, *linear,
        )  # fmt: skip
        matrix: Matrix
        if self.outside is not None:
            slots = pattern.slots[-1 if touching is None else -2]
            self.outside.tangent(x, lam, self.constraints.frame_of, self.constraints.frames, slots, data)
        if touching is not None and self.contact_blocks is not None:
            axes = (self.constraints.frame_of, self.constraints.frames)
            self.contact_blocks.add(*touching, *axes, pattern.slots[-1], data)
        self.tethers.stiffen(lam, data, pattern)
        if self.constraints.rigid_body:
            Z = self.displacements.rigid(x)
            ground = self._ground(Z, data)
            matrix = FreeBodyMatrix(pattern.matrix(data), Z, *ground, self.displacements.weight)
        else:
            matrix = pattern.matrix(data)
        if e.prescribed:
            matrix = MultiplierMatrix(matrix, self._constraint_rows(linear.turns), e.penalty, self.compliance)
        else:  # with imposed angles Newton's steps are those of the symmetric part, and a few more
            matrix = self._followed(matrix, x, lam)
        return Tangent(matrix, partial(self._predicted_forces, linear))

    def _predicted_forces(self, linear: Linearised, forces: Array, dq: Array) -> Array:
        """Element forces after an increment dq (size,) from where elements were linearised with `forces`."""
        e = self.elements
        bars = len(e.bars)
        out = np.empty_like(forces)
        predicted_forces(
            e.bars, e.bar_stiffness, forces[:bars], linear.directions, e.hinges, linear.stiffness, forces[bars:],
            linear.turns, self.displacements.vectors(dq[: self.primal]), out[:bars], out[bars:],
        )  # fmt: skip
        if e.prescribed:
            out[-e.prescribed :] = forces[-e.prescribed :] + dq[self.primal :]
        return out

    def control_rate(self, q: Array, lam: float) -> Array:
        """(size,) d residual / d lambda at fixed q: N for displacements, rad for multipliers."""
        e = self.elements
        x = self.near(q, lam)
        _, _, _, forces, _ = self.internal_forces(x, q, lam)
        g = dihedral_gradients(x, e.hinges)
        moment_rate = e.couple.rate - self.hinge_stiffness(x, lam) * e.rest.rate
        out = -self.force.rate.copy()
        np.add.at(out, e.hinges, (moment_rate[:, None] * g).reshape(-1, 4, 3))
        moving = self.displacements.prescribed_motion
        if moving.any():
            out += self.tangent_times(x, moving, forces, lam)
        if self.outside is not None:
            self.outside.force_rates(x, moving, lam, 1.0, out)
        if self.contact_blocks is not None:
            out += self.touch_rates(x, moving, lam, 1.0)
        rate = np.empty(self.size)
        rate[: self.primal] = self.displacements.components(out)
        self.tethers.rates(q, lam, rate)
        if e.prescribed:
            turn = np.einsum("hpc,hpc->h", g.reshape(-1, 4, 3), moving[e.hinges]) - e.rest.rate
            rate[self.primal :] = turn[-e.prescribed :]
        return rate

    def power(self, q: Array, lam: float) -> float:
        """Rate of work of the actuation, d energy / d lambda at fixed q (size,), N mm."""
        e = self.elements
        x = self.near(q, lam)
        _, _, f, _, turn = self.internal_forces(x, q, lam)
        stiffness, couple = e.hinge_stiffness, self.couple(q, lam)
        if self.curves is not None:
            stiffness, couple, _ = self._straight(x, lam, couple)
        moment = stiffness * turn + couple  # without the lock, which knows no rest angle
        total = float(e.couple.rate @ turn - moment @ e.rest.rate)
        total -= float(np.vdot(self.force.rate, x - self.displacements.home))
        total += self.tethers.power(q, lam)
        if self.outside is not None:
            total += self.outside.power(x, lam)
        if self.contact_blocks is not None:
            total += self.touch_power(x, lam)
        self.press(x, lam, f)
        return total + float(np.vdot(f - self.force.at(lam), self.displacements.prescribed_motion))

    def control_stiffness(self, q: Array, lam: float) -> float:
        """Second derivative of the energy by lambda at fixed q (size,), N mm."""
        e = self.elements
        x = self.near(q, lam)
        stiffness = self.hinge_stiffness(x, lam)
        total = float(stiffness @ e.rest.rate**2) - 2.0 * float(e.couple.rate @ e.rest.rate)
        total += self.tethers.second(q, lam)
        moving = self.displacements.prescribed_motion
        if moving.any():
            _, _, _, forces, _ = self.internal_forces(x, q, lam)
            out = self.tangent_times(x, moving, forces, lam)
            g = dihedral_gradients(x, e.hinges).reshape(-1, 4, 3)
            turn = np.einsum("hpc,hpc->h", g, moving[e.hinges])
            if self.contact_blocks is not None:
                out += self.touch_rates(x, moving, lam, 1.0)
            total += float(np.vdot(out, moving)) - 2.0 * float(np.vdot(self.force.rate, moving))
            total += 2.0 * float((e.couple.rate - stiffness * e.rest.rate) @ turn)
        if self.contact_blocks is not None:
            total += self.touch_stiffness(x, moving, lam)
        if self.outside is None:
            return total
        rates = np.zeros_like(x)
        self.outside.force_rates(x, moving, lam, 1.0, rates)
        return total + float(np.vdot(rates, moving)) + self.outside.control_stiffness(x, moving, lam)

    def tangent_times(self, x: Array, v: Array, forces: Array, lam: float = 0.0) -> Array:
        """Tangent of all elements times v (n, 3), in global axes and with no support left out.

        Args:
            x: (nodes, 3) positions, mm.
            v: (nodes, 3) velocities.
            forces: (f,) element forces of the geometric part, N and N mm.
            lam: load parameter of the step, for creases that are no straight line.
        """
        e, bars = self.elements, len(self.elements.bars)
        out = np.zeros_like(x)
        tangent_times(
            x, v, e.bars, e.bar_length, e.bar_stiffness, e.green, forces[:bars],
            e.hinges, self.hinge_stiffness(x, lam), e.lock, forces[bars:], out,
        )  # fmt: skip
        return out

    # ------------------------------------------------------------------------------- pattern, grounding, constraints

    @cached_property
    def _pattern(self) -> Pattern:
        groups: tuple[Ints, ...] = (self.elements.bars, self.elements.hinges)
        if self.constraints.rigid_body:
            groups += (self.mesh.triangles[self.displacements.ground_triangle][None, :],)
        if self.outside is not None:
            groups += (self.mesh.triangles,)
        if self.contact_blocks is not None:
            groups += (self.contact_blocks.pairs,)
        number, groups = self.displacements.pattern_nodes(groups)
        return build_pattern(number, groups, self.reference)

    @cached_property
    def compliance(self) -> Array:
        """Compliance of prescribed creases, rad / (N mm): far below rounding of the angles at ordinary moments.

        Where panels are rigid, a straight crease can carry moments that balance each other at no cost; it picks the
        smallest ones.
        """
        return COMPLIANCE / self.elements.penalty

    def _augmented_stiffness(self, x: Array, lam: float) -> Array:
        e = self.elements
        if self.curves is None:
            return self._elastic_stiffness
        return np.concatenate((self.hinge_stiffness(x, lam)[: len(e.hinges) - e.prescribed], e.penalty))

    @cached_property
    def _elastic_stiffness(self) -> Array:
        e = self.elements
        return np.concatenate((e.hinge_stiffness[: len(e.hinges) - e.prescribed], e.penalty))

    @cached_property
    def _held_columns(self) -> Ints:
        return self.displacements.number[self.elements.hinges[-self.elements.prescribed :]].reshape(-1, 12)

    def _constraint_rows(self, turns: Array) -> ConstraintRows:
        """Gradients of the prescribed angles, in local axes, from those of all hinges (h, 12)."""
        g = turns[-self.elements.prescribed :]
        if len(self.displacements.turned):
            index = self.constraints.frame_of[self.elements.hinges[-self.elements.prescribed :]]
            axes = np.where((index >= 0)[..., None, None], self.constraints.frames[index], np.eye(3))
            g = np.einsum("hpij,hpj->hpi", axes, g.reshape(-1, 4, 3)).reshape(-1, 12)
        return ConstraintRows(g, self._held_columns, self.primal)

    def _ground(self, Z: Array, data: Array) -> tuple[Ints, Array]:
        """Add a stiffness against the rigid motions of one triangle; returns its unknowns and its matrix."""
        number = self.displacements.ground_numbers
        block = self.displacements.grounding(Z, self._bar_scale)
        slots = self._pattern.slots[2][0]
        values = block[np.tril_indices(9)]
        keep = slots >= 0
        np.add.at(data, slots[keep], values[keep])
        inside = number >= 0
        return number[inside], block[np.ix_(inside, inside)]
