"""The shell's system for one step: energy, residual and tangent as functions of the unknowns."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bh.actuation import Ramp
from bh.errors import ModelError
from bh.model import Model
from bh.program import StepProgram
from bh.solvers.matrices import FreeBodyMatrix, Matrix
from bh.solvers.system import Evaluation
from bh.supports import free_motions, rigid_motions
from fem import loads
from fem.assembly import Pattern, build_pattern, element_components, scatter, turn_blocks
from fem.connectors import connectors
from fem.loads import EdgeConditions
from fem.observables import ShellState
from fem.shell import Frames, ShellElements, carried_frames, edge_tangents, flat_frames, unit
from meshes.topology import Ints

Array = NDArray[np.float64]
LARGEST_TURN = 1.3  # rad that any edge may turn in one increment before the driver mistrusts it
LARGEST_ANGLE = 2.6  # rad between an edge's sides or tangent and its frame, which begins anew with every step
ROUNDING = 8.0 * np.finfo(float).eps


@dataclass(frozen=True, eq=False)
class Here:
    """What has been computed at one (q, lambda)."""

    q: Array
    lam: float
    components: Array
    x: Array
    forces: Array
    energy: float
    B: Array
    pull: Array  # (t, 24) element forces by positions and side rotations


class ShellSystem:
    """`bh.solvers.System` of one step.

    Unknowns: free displacements of all nodes in local axes (mm), rotations alpha of edges and fold angles beta of elastic
    creases (rad). All of them minimise the energy; imposed angles are prescribed, not constrained. `start` None is the flat
    sheet.
    """

    def __init__(
        self,
        model: Model,
        program: StepProgram,
        start: ShellState | None,
        elements: ShellElements,
        conditions: EdgeConditions,
    ) -> None:
        if model.stiffness is not None:
            raise ModelError("given element stiffness is for bars and hinges; the shell takes a sheet (E, nu, t)")
        self.program, self.elements = program, elements
        mesh = self.mesh = elements.mesh
        self.reference = mesh.nodes
        step = 0 if start is None else start.step + 1
        x = mesh.nodes if start is None else start.nodes
        self.frames = flat_frames(mesh) if start is None else start.frames
        none = np.zeros((len(model.mesh.topology.hinges), 2))
        beta = none if start is None else start.fold_angles
        moments = none[:, 0] if start is None else np.nan_to_num(start.crease_moments)
        speed = np.linalg.norm(edge_tangents(mesh, mesh.nodes), axis=-1)
        self.creases = connectors(model, program, speed, beta, moments)

        self.constraints = loads.constraints(mesh, model, step)
        self.turned = np.flatnonzero(self.constraints.frame_of >= 0)
        self.turned_axes = self.constraints.frames[self.constraints.frame_of[self.turned]]
        self._lay_out(self.to_local(x - mesh.nodes), beta, conditions)
        force = loads.forces(mesh, model, step, elements.lengths)
        bending = self._edge_moments(conditions)
        self.load = Ramp(
            np.concatenate((self.to_local(force.start).ravel(), np.zeros_like(bending))),
            np.concatenate((self.to_local(force.end).ravel(), bending)),
        )
        self.has_loads = bool(np.abs(self.load.start).max() + np.abs(self.load.end).max() > 0.0)
        self._here: Here | None = None
        if self.constraints.rigid_body:
            self._check_balance()

    def _lay_out(self, displacement: Array, beta: Array, conditions: EdgeConditions) -> None:
        """Number all components: displacements, alpha, beta; prescribed ones get their values at both ends."""
        nodes, edges, creases = len(self.reference), len(self.elements.lengths), self.creases
        self.first_alpha, self.first_beta = 3 * nodes, 3 * nodes + 2 * edges
        clamped = np.zeros((edges, 2), dtype=bool)
        for name in conditions.clamped:
            clamped[self._edge_set(name)] = True
        held = np.repeat(creases.held, 2)
        fixed = np.concatenate((self.constraints.fixed.ravel(), clamped.ravel(), held))
        self._start = np.concatenate((displacement.ravel(), np.zeros(2 * edges), beta[creases.hinges].ravel()))
        given = np.concatenate((self.constraints.start.ravel(), np.zeros(2 * edges), creases.angle.start.ravel()))
        end = np.concatenate((self.constraints.end.ravel(), np.zeros(2 * edges), creases.angle.end.ravel()))
        # a displacement whose start is not given begins with what the node has
        self.prescribed = Ramp(np.where(np.isnan(given), self._start, given), end)
        self.free = np.flatnonzero(~fixed)
        self.number = np.full(len(fixed), -1, dtype=np.int64)
        self.number[self.free] = np.arange(len(self.free))
        if len(self.free) == 0:
            raise ModelError("the supports hold every node; nothing can move, so remove some of them")
        self.rate = np.where(fixed, self.prescribed.rate, 0.0)
        self.components = element_components(self.mesh, self.elements.sides, creases.of_edge)

    def _edge_set(self, name: str) -> Ints:
        sheet = self.mesh.sheet
        if name not in sheet.edge_sets:
            raise ModelError(f"the sheet has no edge set '{name}'; use one of {', '.join(sheet.edge_sets)}")
        return sheet.topology.find_edges(sheet.edge_sets[name])

    def _edge_moments(self, conditions: EdgeConditions) -> Array:
        """Loads on alpha and beta at the end of the step, N mm / rad."""
        edges = len(self.elements.lengths)
        out = np.zeros((edges, 2))
        side = np.zeros(edges)
        side[self.elements.edges] = self.elements.sides
        for name, moment in conditions.moments:
            chosen = self._edge_set(name)
            if (self.mesh.sheet.topology.edge_triangles[chosen, 1] >= 0).any():
                raise ModelError(f"edge moments act on boundary edges; '{name}' lies inside")
            out[chosen] += 0.5 * moment * (side * self.elements.lengths)[chosen, None]
        return np.concatenate((out.ravel(), np.zeros(2 * len(self.creases))))

    # ------------------------------------------------------------------------------- unknowns and positions

    @property
    def size(self) -> int:
        return len(self.free)

    @property
    def primal(self) -> int:
        return len(self.free)

    @property
    def rotation(self) -> float:
        return self.program.rotation

    @cached_property
    def energy_scale(self) -> float:
        sheet = self.elements.bending.trace(axis1=1, axis2=2)
        return 0.5 * float(sheet @ self.elements.areas) / float(np.mean(self.elements.areas))

    def start(self) -> Array:
        """Unknowns of the state that the step begins with."""
        return self._start[self.free]

    def whole(self, q: Array, lam: float) -> Array:
        """All components, prescribed ones included."""
        out = self.prescribed.at(lam)
        out[self.free] = q
        return out

    def alpha(self, components: Array) -> Array:
        """(e, 2) rotations of edges relative to the frames of the step."""
        return components[self.first_alpha : self.first_beta].reshape(-1, 2)

    def beta(self, components: Array) -> Array:
        """(c, 2) fold angles of creased edges."""
        return components[self.first_beta :].reshape(-1, 2)

    def node_positions(self, components: Array) -> Array:
        """(n, 3) positions of all nodes, middle nodes included, mm."""
        return self.reference + self.to_global(components[: self.first_alpha].reshape(-1, 3))

    def positions(self, q: Array, lam: float) -> Array:
        """(n, 3) positions of the corners, mm."""
        return self.node_positions(self.whole(q, lam))[: len(self.mesh.sheet.points)]

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

    def carried_frames(self, components: Array) -> Frames:
        """Frames for a step that begins at this state."""
        return carried_frames(
            self.mesh, self.frames, self.node_positions(components), self.alpha(components)
        )

    # ------------------------------------------------------------------------------- element vectors

    def gather(self, components: Array) -> Array:
        """(t, 24) positions' rates in global axes and side rotations of every element."""
        moves = self.to_global(components[: self.first_alpha].reshape(-1, 3))[self.mesh.triangles]
        c = self.components
        alpha = components[c[:, 18:24]] * np.repeat(self.elements.sides, 2, axis=1)
        beta = np.where(c[:, 24:] >= 0, components[c[:, 24:]], 0.0)
        return np.hstack((moves.reshape(-1, 18), alpha + 0.5 * beta))

    def spread(self, element: Array) -> Array:
        """Element vectors (t, 24) added up as components, in local axes: the transposed of `gather`."""
        c = self.components
        x = np.zeros((len(self.reference), 3))
        for axis in range(3):
            x[:, axis] = np.bincount(
                self.mesh.triangles.ravel(), element[:, axis:18:3].ravel(), minlength=len(x)
            )
        out = np.zeros(len(self.number))
        out[: self.first_alpha] = self.to_local(x).ravel()
        alpha = element[:, 18:] * np.repeat(self.elements.sides, 2, axis=1)
        used = c[:, 24:] >= 0
        rows = np.concatenate((c[:, 18:24].ravel(), c[:, 24:][used]))
        out += np.bincount(rows, np.concatenate((alpha.ravel(), 0.5 * element[:, 18:][used])), minlength=len(out))
        return out

    def at(self, q: Array, lam: float) -> Here:
        """Everything at (q, lam); the last one is remembered."""
        here = self._here
        if here is not None and here.lam == lam and np.array_equal(here.q, q):
            return here
        e = self.elements
        components = self.whole(q, lam)
        x = self.node_positions(components)
        gamma = self.gather(components)[:, 18:].reshape(-1, 3, 2)
        strain, curvature = e.measures(x, gamma, self.frames)
        forces = e.forces(strain, curvature)
        energy = 0.5 * float(np.vdot(forces[:, :9], strain) + np.vdot(forces[:, 9:], curvature))
        B = e.gradients(x, self.frames)
        pull = np.einsum("tkj,tk->tj", B, forces)
        self._here = Here(q.copy(), lam, components, x, forces, energy, B, pull)
        return self._here

    def gradient(self, here: Here) -> Array:
        """Derivative of the potential by all components; at prescribed ones the reactions."""
        out = self.spread(here.pull) - self.load.at(here.lam)
        out[self.first_beta :] += self.creases.gradient(self.beta(here.components), here.lam).ravel()
        return out

    # ------------------------------------------------------------------------------- the System protocol

    def evaluate(self, q: Array, lam: float) -> Evaluation:
        here = self.at(q, lam)
        beta = self.beta(here.components)
        energy = here.energy + float(self.creases.energy(beta, lam).sum()) + self.creases.load_energy(beta, lam)
        energy -= float(self.load.at(lam) @ here.components)
        residual = self.gradient(here)[self.free]
        return Evaluation(energy, residual, self._imbalance(residual, here), here.forces.ravel())

    def _imbalance(self, residual: Array, here: Here) -> float:
        """Largest force over the root mean square of element forces, or the same of moments on edges.

        Positions are rounded to eps |x|, which membrane and bending stiffness turn into forces that nobody can balance.
        """
        moves = self.free < self.first_alpha
        eps = ROUNDING * float(np.abs(here.x).max())
        load = self.load.at(here.lam)
        floors = (eps * self._stiffest[0], eps * self._stiffest[1])
        groups = (
            (residual[moves], here.pull[:, :18], load[: self.first_alpha], floors[0]),
            (residual[~moves], here.pull[:, 18:], load[self.first_alpha :], floors[1]),
        )
        worst = 0.0
        for part, elements, loads_, floor in groups:
            largest = float(np.abs(part).max(initial=0.0)) - floor
            if largest > 0.0:
                size = max(float(np.sqrt(np.mean(elements**2))), float(np.abs(loads_).max(initial=0.0)), 1e-300)
                worst = max(worst, largest / size)
        return worst

    @cached_property
    def _stiffest(self) -> tuple[float, float]:
        """Largest force, N, and moment on an edge, N mm, per mm of displacement of one node."""
        B = self.elements.gradients(self.reference, self.frames)
        K = np.zeros((len(B), 24, 24))
        for part, stiffness in ((B[:, :9], self.elements.membrane), (B[:, 9:], self.elements.bending)):
            K += np.einsum("tki,tkl,tlj->tij", part, stiffness, part, optimize=True)
        return float(np.abs(K[:, :18, :18]).max()), float(np.abs(K[:, 18:, :18]).max())

    def element_tangents(self, here: Here, forces: Array) -> Array:
        return self.elements.tangent(here.x, forces.reshape(-1, 18), here.B, self.frames)

    def tangent(self, q: Array, lam: float, forces: Array) -> Matrix:
        here = self.at(q, lam)
        K = self.element_tangents(here, forces)
        if len(self.turned):
            turn_blocks(K, self.mesh.triangles, self.constraints.frame_of, self.constraints.frames)
        pattern = self._pattern
        data = np.zeros(pattern.size)
        scatter(K, self.elements.sides, pattern.slots, data)
        slots, values = self._springs
        np.add.at(data, slots, values)
        if not self.constraints.rigid_body:
            return pattern.matrix(data)
        Z = self._rigid(here)
        ground = self._ground(Z, data)
        return FreeBodyMatrix(pattern.matrix(data), Z, *ground)

    def predicted_forces(self, forces: Array, dq: Array) -> Array:
        assert self._here is not None  # the tangent was made there
        change = np.zeros(len(self.number))
        change[self.free] = dq
        measure = np.einsum("tkj,tj->tk", self._here.B, self.gather(change))
        return forces + self.elements.forces(measure[:, :9], measure[:, 9:]).ravel()

    def control_rate(self, q: Array, lam: float) -> Array:
        out = self._times(self.at(q, lam), self.rate) - self.load.rate
        out[self.first_beta :] += self.creases.gradient_rate().ravel()
        return out[self.free]

    def power(self, q: Array, lam: float) -> float:
        here = self.at(q, lam)
        total = float(self.gradient(here) @ self.rate) - float(self.load.rate @ here.components)
        return total + self.creases.power(self.beta(here.components), lam)

    def control_stiffness(self, q: Array, lam: float) -> float:
        """d^2 energy / d lambda^2 at fixed q, N mm."""
        c = self.creases
        total = float(self._times(self.at(q, lam), self.rate) @ self.rate)
        total -= 2.0 * float(self.load.rate @ self.rate)
        total += 2.0 * float(np.vdot(c.gradient_rate(), self.beta(self.rate)))
        return total + float(np.einsum("c,ci,cij,cj->", c.stiffness, c.rest.rate, c.mass, c.rest.rate))

    def _times(self, here: Here, v: Array) -> Array:
        """Tangent of sheet and springs times v, all components."""
        out = np.zeros_like(v)
        if v.any():
            K = self.element_tangents(here, here.forces)
            out = self.spread(np.einsum("tij,tj->ti", K, self.gather(v)))
            turn = self.creases.stiffness[:, None] * np.einsum("cij,cj->ci", self.creases.mass, self.beta(v))
            out[self.first_beta :] += turn.ravel()
        return out

    def objection(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        before, after = self.whole(q, lam), self.whole(q_new, lam_new)
        turn = float(np.abs(self.alpha(after) - self.alpha(before)).max())
        if turn > LARGEST_TURN:
            return f"an edge turned by {np.degrees(turn):.0f} degrees"
        t = unit(edge_tangents(self.mesh, self.node_positions(after)))
        swing = float(np.arccos(np.clip(np.einsum("epc,epc->ep", t, self.frames.t0), -1.0, 1.0)).max())
        angle = max(float(np.abs(self.alpha(after)).max()), swing)
        if angle > LARGEST_ANGLE:
            return f"an edge turned by {np.degrees(angle):.0f} degrees within the step; split the step in two"
        return ""

    # ------------------------------------------------------------------------------- pattern, springs, grounding

    @cached_property
    def _pattern(self) -> Pattern:
        return build_pattern(self.mesh, self.components, self.number)

    @cached_property
    def _springs(self) -> tuple[Ints, Array]:
        """Slots and values of the stiffness of elastic creases."""
        c = self.creases
        slots, values = [], []
        triangle = self.mesh.sheet.topology.edge_triangles[c.edges, 0]
        local = np.argmax(self.elements.edges[triangle] == c.edges[:, None], axis=1)
        swapped = self.elements.sides[triangle, local] < 0
        for i, j in ((0, 0), (1, 1), (1, 0)):
            row, column = 24 + 2 * local + i, 24 + 2 * local + j
            slot = self._pattern.slots[triangle, row * (row + 1) // 2 + column]
            end = np.where(swapped, 1 - i, i), np.where(swapped, 1 - j, j)
            slots.append(slot)
            values.append(c.stiffness * c.mass[np.arange(len(c)), end[0], end[1]])
        slot, value = np.concatenate(slots), np.concatenate(values)
        return slot[slot >= 0], value[slot >= 0]

    def _rigid(self, here: Here) -> Array:
        """Orthonormal rigid motions (unknowns, r) that the supports leave free."""
        motions = rigid_motions(here.x) @ free_motions(here.x, self.constraints)
        moves = motions.reshape(-1, 3, motions.shape[1])
        element = moves[self.mesh.triangles].reshape(-1, 18, motions.shape[1])
        whole = np.zeros((len(self.number), motions.shape[1]))
        for column in range(motions.shape[1]):
            whole[: self.first_alpha, column] = self.to_local(moves[..., column]).ravel()
        for j in range(3):  # edges turn such that no curvature arises
            rows, columns = slice(9 + 3 * j, 11 + 3 * j), slice(18 + 2 * j, 20 + 2 * j)
            rate = -np.linalg.solve(here.B[:, rows, columns], here.B[:, rows, :18] @ element)
            whole[self.components[:, columns]] = self.elements.sides[:, j, None, None] * rate
        out: Array = np.linalg.qr(whole[self.free])[0]
        return out

    @cached_property
    def _ground_triangle(self) -> int:
        """The triangle that carries the stiffness against rigid motions: in the middle, with few supports of its own."""
        centres = self.reference[self.mesh.triangles].mean(axis=1)
        distance = np.linalg.norm(centres - self.reference.mean(axis=0), axis=1)
        held = (self.number[self.components[:, :18]] < 0).sum(axis=1)
        return int(np.lexsort((distance, held))[0])

    def _ground(self, Z: Array, data: Array) -> tuple[Ints, Array]:
        """Add a stiffness against the rigid motions of one triangle; returns its unknowns and its matrix."""
        number = self.number[self.components[self._ground_triangle, :18]]
        rows = np.where(number[:, None] >= 0, Z[np.maximum(number, 0)], 0.0)
        Q = np.linalg.qr(rows)[0] if Z.shape[1] else rows
        block = float(self.elements.membrane[self._ground_triangle].trace()) / 9.0
        block = block / self.elements.areas[self._ground_triangle] * (Q @ Q.T)
        lower = np.tril_indices(18)
        slots = self._pattern.slots[self._ground_triangle, : len(lower[0])]
        np.add.at(data, slots[slots >= 0], block[lower][slots >= 0])
        inside = number >= 0
        return number[inside], block[np.ix_(inside, inside)]

    def _check_balance(self) -> None:
        Z = self._rigid(self.at(self.start(), 0.0))
        for load in (self.load.start, self.load.end):
            local = load[self.free]
            if np.abs(Z.T @ local).max(initial=0.0) > 1e-9 * max(float(np.abs(local).sum()), 1e-300):
                raise ModelError(
                    "the forces on a sheet without enough supports are not in equilibrium; add supports or balance them"
                )
