"""The shell's system for one step: energy, residual and tangent as functions of the unknowns."""

from __future__ import annotations

from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.loading.load_step import LoadStep
from bh.loading.tethers import NONE, tethers
from bh.model.constraints import TURNED, UNBALANCED
from bh.model.model import Model
from bh.model.ramp import Ramp
from bh.solvers.matrices import FreeBodyMatrix, Matrix
from bh.solvers.outcome import Outcome
from bh.solvers.system import Evaluation, Tangent, grows_ahead
from fem import loads
from fem.assembly import NO_PAIRS, Pattern, build_pattern, scatter, turn_blocks
from fem.components import lay_out
from fem.contact import StoppedShell
from fem.crease_memory import CreaseMemory
from fem.creases import SpringEntries, connectors, spring_entries
from fem.growth import at_rest
from fem.here import Here, out_of_balance
from fem.kernels import Frames
from fem.loads import EdgeMoments
from fem.outside import shell_outside
from fem.rigid import describe_motion, free_rigid_motions, ground_stiffness, ground_triangle
from fem.shell import ShellElements, carried_frames, edge_tangents, first_frames, flat_stiffness, unit
from fem.state import ShellState
from meshes.topology import Ints

Array = NDArray[np.float64]
LARGEST_TURN = 1.3  # rad that any edge may turn in one increment before the driver mistrusts it
LARGEST_ANGLE = 2.6  # rad between an edge's sides or tangent and its frame, which begins anew with every step
ROUNDING = 8.0 * np.finfo(float).eps


class ShellSystem(StoppedShell, CreaseMemory):
    """`bh.solvers.System` of one step.

    Unknowns: free displacements of all nodes in local axes (mm), rotations alpha of edges and fold angles beta of
    elastic creases (rad). All of them minimise the energy; imposed angles are prescribed, not constrained. `start`
    None is the flat sheet.
    """

    def __init__(
        self,
        model: Model,
        load_step: LoadStep,
        start: ShellState | None,
        elements: ShellElements,
        moments: EdgeMoments,
    ) -> None:
        """Set up a step.

        Args:
            model: a sheet with supports and steps.
            load_step: what the step imposes and loads.
            start: the state that the step begins with; None is the flat sheet.
            elements: of the sheet.
            moments: couples on boundary edges.

        Raises:
            ModelError: the model is not one that a shell can take, or its loads turn a free sheet.
        """
        if model.stiffness is not None:
            raise ModelError(
                "given element stiffness is for bars and hinges; the shell takes a sheet (E, nu, t)"
            )
        self.load_step, self.elements = load_step, elements
        mesh = self.mesh = elements.mesh
        step = 0 if start is None else start.step + 1
        x = mesh.nodes if start is None else start.nodes
        self.frames = first_frames(mesh) if start is None else start.frames
        self.rest = at_rest(elements, load_step.growth)
        flat = np.zeros((len(model.mesh.topology.hinges), elements.tables.rotations))
        beta = flat if start is None else start.fold_angles
        self.creases = connectors(mesh, model, load_step, start)
        self.constraints = loads.constraints(mesh, model, step, None if start is None else x)
        clamped = mesh.sheet.topology.find_edges(load_step.constraints.clamped)
        self.components = lay_out(elements, self.constraints, self.creases, x, beta, clamped)
        self.outside = shell_outside(elements, load_step, loads.ground(elements, model), self.constraints, x)
        self.load = self._loads(model, step, moments)
        self._here: Here | None = None
        self.hinder(model, x, self.outside is not None and self.outside.bars is not None)
        self.tethers = NONE
        if load_step.releases and start is not None:
            pull = self.gradient(self.at(self.start(), 0.0))[self.components.free]
            moving = np.searchsorted(self.components.free, self.components.first_alpha)
            self.tethers = tethers(self.start(), pull, int(moving), mesh.sheet.areas)
        elif self.constraints.rigid_body and any(
            self._unbalanced(self.start(), lam) > 1e-9 for lam in (0.0, 1.0)
        ):
            raise ModelError(UNBALANCED)

    def _loads(self, model: Model, step: int, moments: EdgeMoments) -> Ramp:
        """(k,) loads on all components: forces in local axes, N, couples on edges, N mm / rad."""
        force = loads.forces(self.elements, model, step, self.load_step.force)
        couple = loads.edge_moments(self.elements, moments, self.load_step)
        none = np.zeros(self.elements.tables.rotations * len(self.creases))
        ends = [
            np.concatenate((self.components.to_local(f).ravel(), m.ravel(), none))
            for f, m in ((force.start, couple.start), (force.end, couple.end))
        ]
        return Ramp(ends[0], ends[1])

    # ------------------------------------------------------------------------------- unknowns and positions

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.components.free)

    @property
    def primal(self) -> int:
        """Number of unknowns: there are no multipliers."""
        return self.size

    @cached_property
    def rotation(self) -> float:
        """Largest angle that the step imposes on a crease, rad."""
        return self.load_step.rotation

    @property
    def energy_scale(self) -> float:
        """Moments against the rotations of all edges by one radian, N mm."""
        return self._flat_stiffness[0]

    def start(self) -> Array:
        """Unknowns of the state that the step begins with."""
        return self.components.begin[self.components.free]

    def positions(self, q: Array, lam: float) -> Array:
        """(n, 3) positions of the corners, mm."""
        return self.node_positions(self.components.whole(q, lam))[: len(self.mesh.sheet.points)]

    def vectors(self, dq: Array) -> Array:
        """(n, 3) changes of the corners' positions, mm, for changes dq (size,) of the unknowns."""
        change = np.zeros(len(self.components.number))
        change[self.components.free] = dq
        return self.components.moves(change)[: len(self.mesh.sheet.points)]

    def loads(self, forces: Array) -> Array:
        """(size,) what forces (n, 3) at the corners, N, are to the unknowns; their part along supports is left out."""
        nodal = np.zeros_like(self.mesh.nodes)
        nodal[: len(forces)] = forces
        whole = np.zeros(len(self.components.number))
        whole[: self.components.first_alpha] = self.components.to_local(nodal).ravel()
        return whole[self.components.free]

    def carried_frames(self, components: Array) -> Frames:
        """Frames for a step that begins at this state."""
        x = self.node_positions(components)
        return carried_frames(self.mesh, self.frames, x, self.components.alpha(components))

    def at(self, q: Array, lam: float) -> Here:
        """Everything at (q, lam); the last one is remembered.

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        here = self._here
        if here is not None and here.lam == lam and np.array_equal(here.q, q):
            return here
        e = self.elements
        components = self.components.whole(q, lam)
        x = self.node_positions(components)
        gamma = self.side_rotations(components)
        strain, curvature = self.elastic(x, gamma, lam)
        forces = e.forces(strain, curvature)
        energy = 0.5 * float(np.vdot(forces, np.hstack((strain, curvature))))
        B = e.gradients(x, self.frames)
        pull = np.einsum("tkj,tk->tj", B, forces)
        self._here = Here(q.copy(), lam, components, x, forces, energy, B, pull, *self.press(x))
        return self._here

    def elastic(self, x: Array, gamma: Array, lam: float) -> tuple[Array, Array]:
        """(t, 3 m) strains and curvatures, less those at rest.

        Args:
            x: (n, 3) positions of all nodes, mm.
            gamma: (t, 3, r) side rotations, rad.
            lam: load parameter of the step, 0 to 1.

        Returns:
            both.
        """
        strain, curvature = self.elements.measures(x, gamma, self.frames)
        if self.rest is None:
            return strain, curvature
        return strain - self.rest.strain.at(lam), curvature - self.rest.curvature.at(lam)

    def side_rotations(self, components: Array) -> Array:
        """(t, 3, r) rotations gamma of every triangle's side of its edges, rad."""
        gamma = self.components.gather(components)[:, self.elements.moves :]
        return np.ascontiguousarray(gamma).reshape(len(gamma), 3, -1)

    def gradient(self, here: Here) -> Array:
        """Derivative of the potential by all components; at prescribed ones the reactions.

        Returns:
            (k,) N, and N mm for rotations.
        """
        out = self.components.spread(here.pull) - self.load.at(here.lam)
        out[self.components.first_beta :] += self.creases.gradient(
            self.components.beta(here.components), here.lam
        ).ravel()
        if self.outside is not None:
            self._add_nodal(out, self.outside.gradient(here.x, here.lam))
        if here.pressed is not None:
            self._add_nodal(out, here.pressed)
        return out

    def _add_nodal(self, out: Array, nodal: Array) -> None:
        """Add nodal vectors (n, 3) to all components (k,)."""
        out[: self.components.first_alpha] += self.components.to_local(nodal).ravel()

    @cached_property
    def conservative(self) -> bool:
        """Is the residual the gradient of the energy? Not under a pressure on a sheet with free edges."""
        return self.outside is None or self.outside.conservative(self.components)

    # ------------------------------------------------------------------------------- the System protocol

    def evaluate(self, q: Array, lam: float) -> Evaluation:
        """Energy, residual and element forces at (q, lam)."""
        here = self.at(q, lam)
        beta = self.components.beta(here.components)
        energy = here.energy + float(self.creases.energy(beta, lam).sum())
        energy += self.creases.load_energy(beta, lam)
        energy -= float(self.load.at(lam) @ here.components)
        residual = self.gradient(here)[self.components.free]
        energy += here.contact + (0.0 if self.outside is None else self.outside.energy(here.x, lam))
        energy += self.tethers.push(q, lam, residual)
        return Evaluation(energy, residual, self._imbalance(residual, here), here.forces.ravel())

    def _imbalance(self, residual: Array, here: Here) -> float:
        """Largest force over the root mean square of element forces, or the same of moments on edges.

        Positions are rounded to eps |x|, which membrane and bending stiffness turn into forces that nobody can balance.
        """
        moves = self.components.free < self.components.first_alpha
        load = self.load.at(here.lam)
        floors = [ROUNDING * float(np.abs(here.x).max()) * each for each in self._flat_stiffness[1:]]
        couples = self.creases.largest(self.components.beta(here.components), here.lam)
        first, width = self.components.first_alpha, self.elements.moves
        acting = float(np.abs(load[:first]).max())
        acting += 0.0 if self.outside is None else self.outside.largest(here.x, here.lam)
        groups = (
            (residual[moves], here.pull[:, :width], acting, floors[0]),
            (
                residual[~moves],
                here.pull[:, width:],
                max(couples, float(np.abs(load[first:]).max())),
                floors[1],
            ),
        )
        return max(0.0, *(out_of_balance(*group) for group in groups))

    @cached_property
    def _flat_stiffness(self) -> tuple[float, float, float]:
        """`energy_scale`, and the largest force and moment on an edge a mm of displacement, of the flat sheet."""
        return flat_stiffness(self.elements, self.mesh)

    def element_tangents(self, here: Here, forces: Array) -> Array:
        """(t, w, w) element tangents at a state, with the given forces in their geometric part.

        Args:
            here: the state.
            forces: (t, 6 m) of the geometric part.
        """
        return self.elements.tangent(here.x, forces.reshape(here.forces.shape), here.B, self.frames)

    def tangent(self, q: Array, lam: float, forces: Array) -> Tangent:
        """The tangent at q (size,) with `forces` in its geometric part; see `bh.solvers.system.System`."""
        here = self.at(q, lam)
        return Tangent(self._matrix(here, forces), partial(self._predicted_forces, here.B))

    def _matrix(self, here: Here, forces: Array) -> Matrix:
        K = self.element_tangents(here, forces)
        if self.outside is not None:
            self.outside.add(K, here.x, here.lam)
        if (self.constraints.frame_of >= 0).any():
            turn_blocks(K, self.mesh.triangles, self.constraints.frame_of, self.constraints.frames)
        met = self.blocks(here.x)
        pattern = self._pattern
        data = np.zeros(pattern.size)
        scatter(K, self.components.sides, pattern.slots, data)
        if met is not None:
            self.add_blocks(*met, pattern, data)
        if len(self._springs.places):
            tangents = self.creases.tangents(self.components.beta(here.components), here.lam)
            np.add.at(data, self._springs.places, tangents[tuple(self._springs.which)])
        self.tethers.stiffen(here.lam, data, pattern)
        if not self.constraints.rigid_body:
            matrix = pattern.matrix(data)
            if self.outside is None or self.conservative:
                return matrix
            return self.outside.followed(matrix, self.components, here.x, here.lam)
        Z = free_rigid_motions(self.components, self.elements, self.frames, here.x)
        if Z.shape[1] == 0:  # clamped edges hold what the supports do not
            return pattern.matrix(data)
        ground = self._ground(Z, data)
        return FreeBodyMatrix(pattern.matrix(data), Z, *ground)

    def _predicted_forces(self, B: Array, forces: Array, dq: Array) -> Array:
        """Element forces after an increment dq (size,) from where measures had the derivatives B, linear in dq."""
        change = np.zeros(len(self.components.number))
        change[self.components.free] = dq
        measure = np.einsum("tkj,tj->tk", B, self.components.gather(change))
        return forces + self.elements.forces(*np.hsplit(measure, 2)).ravel()

    def control_rate(self, q: Array, lam: float) -> Array:
        """(size,) derivative of the residual by lambda."""
        here = self.at(q, lam)
        out = self._times(here, self.components.rate) - self.load.rate
        beta = self.components.beta(here.components)
        out[self.components.first_beta :] += self.creases.gradient_rate(beta, lam).ravel()
        if self.outside is not None:
            self._add_nodal(out, -self.outside.push_rate(here.x, lam))
        if self.rest is not None:
            out -= self.components.spread(
                np.einsum("tkj,tk->tj", here.B, self.elements.forces(*self.rest.rate))
            )
        return self.tethers.rates(q, lam, out[self.components.free])

    def power(self, q: Array, lam: float) -> float:
        """Derivative of the potential by lambda at fixed q, N mm."""
        here = self.at(q, lam)
        total = float(self.gradient(here) @ self.components.rate) - float(self.load.rate @ here.components)
        total += 0.0 if self.outside is None else self.outside.power(here.x, lam)
        total += self.tethers.power(q, lam)
        if self.rest is not None:
            total -= float(np.vdot(here.forces, np.hstack(self.rest.rate)))
        return total + self.creases.power(self.components.beta(here.components), lam)

    def control_stiffness(self, q: Array, lam: float) -> float:
        """Second derivative of the potential by lambda at fixed q, N mm."""
        c = self.creases
        here = self.at(q, lam)
        total = self.tethers.second(q, lam)
        total += float(self._times(here, self.components.rate) @ self.components.rate)
        if self.outside is not None:
            moves = self.components.moves(self.components.rate)
            total -= 2.0 * float(np.vdot(self.outside.push_rate(here.x, lam), moves))
            total += self.outside.second(here.x, lam)
        total -= 2.0 * float(self.load.rate @ self.components.rate)
        if self.rest is not None:
            forces, here = self.elements.forces(*self.rest.rate), self.at(q, lam)
            moving = np.einsum("tkj,tj->tk", here.B, self.components.gather(self.components.rate))
            total += float(np.vdot(forces, np.hstack(self.rest.rate) - 2.0 * moving))
        beta, moving = (self.components.beta(each) for each in (here.components, self.components.rate))
        total += 2.0 * float(np.vdot(c.gradient_rate(beta, lam), moving))
        return total + float(np.einsum("ci,cij,cj->", c.rest.rate, c.tangents(beta, lam), c.rest.rate))

    def _times(self, here: Here, v: Array) -> Array:
        """Tangent of sheet and springs times v, all components."""
        out = np.zeros_like(v)
        if v.any():
            K = self.element_tangents(here, here.forces)
            out = self.components.spread(np.einsum("tij,tj->ti", K, self.components.gather(v)))
            tangents = self.creases.tangents(self.components.beta(here.components), here.lam)
            turn = np.einsum("cij,cj->ci", tangents, self.components.beta(v))
            out[self.components.first_beta :] += turn.ravel()
            if self.outside is not None:
                self._add_nodal(out, self.outside.times(here.x, self.components.moves(v), here.lam))
            if self.barrier is not None:
                self._add_nodal(out, self.barrier.times(here.x, self.components.moves(v)))
        return out

    def objection(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        """Why an increment is not to be trusted; "" if it is.

        Args:
            q: (size,) unknowns before the increment.
            lam: before the increment.
            q_new: (size,) after it.
            lam_new: after it.
        """
        if stopped := self._passed(q, lam, q_new, lam_new):
            return stopped
        before, after = self.components.whole(q, lam), self.components.whole(q_new, lam_new)
        turn = float(np.abs(self.components.alpha(after) - self.components.alpha(before)).max())
        if turn > LARGEST_TURN:
            return f"an edge turned by {np.degrees(turn):.0f} degrees"
        t = unit(edge_tangents(self.mesh, self.node_positions(after)))
        swing = float(np.arccos(np.clip(np.einsum("epc,epc->ep", t, self.frames.t0), -1.0, 1.0)).max())
        angle = max(float(np.abs(self.components.alpha(after)).max()), swing)
        if angle > LARGEST_ANGLE:
            return f"an edge turned by {np.degrees(angle):.0f} degrees within the step; split the step in two"
        return ""

    def penetration(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        """What passed through itself between two states; without contact sides may do so, and nothing is said."""
        return self._passed(q, lam, q_new, lam_new)

    def obstacle(self, q: Array, lam: float) -> tuple[Outcome, str] | None:
        """What stands in the way of loads on a free sheet, with its outcome; None if nothing does."""
        if not self.constraints.rigid_body or not (self.load.start.any() or self.load.end.any()):
            return None
        return (Outcome.MECHANISM, TURNED) if grows_ahead(self, q, lam, self._unbalanced) else None

    def describe(self, q: Array, lam: float, motion: Array) -> str:
        """What moves in an eigenvector (size,), as a clause."""
        c = self.components
        whole = np.zeros(len(c.number))
        whole[c.free] = motion
        return describe_motion(self.mesh, self.creases, self.at(q, lam).x, c.moves(whole), c.beta(whole))

    # ------------------------------------------------------------------------------- pattern, springs, grounding

    @cached_property
    def _pattern(self) -> Pattern:
        c = self.components
        touching = NO_PAIRS if self.contact_blocks is None else self.contact_blocks.pairs
        return build_pattern(self.mesh, c.of_element, c.number, touching=touching)

    @cached_property
    def _springs(self) -> SpringEntries:
        """Slots of the stiffness of elastic creases."""
        return spring_entries(self.creases, self.elements, self.components.rotations, self._pattern.slots)

    @cached_property
    def _ground_triangle(self) -> int:
        return ground_triangle(self.components, self.elements)

    def _ground(self, Z: Array, data: Array) -> tuple[Ints, Array]:
        """Add a stiffness against the rigid motions of one triangle; returns its unknowns and its matrix."""
        number, block = ground_stiffness(self.components, self.elements, self._ground_triangle, Z)
        lower = np.tril_indices(self.elements.moves)
        slots = self._pattern.slots[self._ground_triangle, : len(lower[0])]
        np.add.at(data, slots[slots >= 0], block[lower][slots >= 0])
        inside = number >= 0
        return number[inside], block[np.ix_(inside, inside)]

    def _unbalanced(self, q: Array, lam: float) -> float:
        """Part of the loads that works on free rigid motions."""
        load = self.load.at(lam)[self.components.free]
        x = self.at(q, lam).x
        rigid = free_rigid_motions(self.components, self.elements, self.frames, x)
        work = rigid.T @ load if load.any() else load
        return float(np.abs(work).max(initial=0.0)) / max(float(np.abs(load).sum()), 1e-300)
