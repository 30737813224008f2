"""Creases of the shell: a fold angle beta between the two sides of an edge, linear along it.

The side rotations of an edge are gamma = +-alpha + beta / 2 (+ for the triangle on its left), alpha the rotation of
the edge and beta the fold angle pi - phi, positive where the sides drop away from the crease (a mountain). Ordinary
edges have none.
- rigid: beta is prescribed, its reaction is the crease's moment;
- elastic: 1/2 k_f int (beta - beta_R)^2 ds; free hinge: k_f = 0;
- moment-driven: - int m beta ds, on top of either.

As the moment of a side is conjugate to gamma, an elastic crease is the same as a compliance -sigma_nn^2 / (2 k_f) in
the mixed energy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.actuation import Ramp
from bh.errors import ModelError
from bh.model import Model
from bh.program import HELD, SHEET, SPRING, StepProgram
from fem.shell import edge_tangents
from fem.spaces import tables
from meshes.curved import QuadraticMesh
from meshes.topology import Ints

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Connectors:
    """Creased edges of one step; c of them, two values of beta each (at the lower and the higher node), rad.

    Attributes:
        hinges: (c,) rows of `mesh.topology.hinges`; edges: (c,) of `mesh.topology.edges`.
        of_edge: (e,) row of a creased edge, -1 elsewhere.
        held: (c,) True where beta is imposed; `angle` (c, 2) what is imposed.
        mass: (c, 2, 2) int of the products of beta's shape functions, mm.
        stiffness: (c,) k_f a length, N mm / (mm rad); rest: (c, 2) beta_R; moment: (c,) couple a length, N.
    """

    hinges: Ints
    edges: Ints
    of_edge: Ints
    held: NDArray[np.bool_]
    angle: Ramp
    mass: Array
    stiffness: Array
    rest: Ramp
    moment: Ramp

    def __len__(self) -> int:
        return len(self.edges)

    def energy(self, beta: Array, lam: float) -> Array:
        """(c,) elastic energies of springs, N mm."""
        turn = beta - self.rest.at(lam)
        out: Array = 0.5 * self.stiffness * np.einsum("ci,cij,cj->c", turn, self.mass, turn)
        return out

    def load_energy(self, beta: Array, lam: float) -> float:
        """Potential of the couples, N mm."""
        return -float(np.einsum("c,cij,cj->", self.moment.at(lam), self.mass, beta))

    def gradient(self, beta: Array, lam: float) -> Array:
        """(c, 2) derivative of both by beta, N mm."""
        turn = self.stiffness[:, None] * (beta - self.rest.at(lam)) - self.moment.at(lam)[:, None]
        out: Array = np.einsum("cij,cj->ci", self.mass, turn)
        return out

    def largest(self, beta: Array, lam: float) -> float:
        """Largest couple of a spring or of a load on one value of beta, N mm / rad."""
        turn = self.stiffness[:, None] * (beta - self.rest.at(lam))
        spring = np.abs(np.einsum("cij,cj->ci", self.mass, turn)).max(initial=0.0)
        load = np.abs(self.moment.at(lam)[:, None] * self.mass.sum(axis=2)).max(initial=0.0)
        return float(max(spring, load))

    def gradient_rate(self) -> Array:
        """(c, 2) derivative of `gradient` by lambda."""
        turn = -self.stiffness[:, None] * self.rest.rate - self.moment.rate[:, None]
        out: Array = np.einsum("cij,cj->ci", self.mass, turn)
        return out

    def power(self, beta: Array, lam: float) -> float:
        """Derivative of both energies by lambda at fixed beta, N mm."""
        return float(np.vdot(self.gradient_rate(), beta)) + float(
            np.einsum("c,ci,cij,cj->", self.stiffness, self.rest.rate, self.mass, self.rest.at(lam))
        )


def connectors(
    mesh: QuadraticMesh, model: Model, program: StepProgram, beta: Array, couple: Array
) -> Connectors:
    """Creased edges of a step that begins with fold angles beta (m, 2) and couples on them (m, 2), N mm / rad.

    Raises:
        ModelError: a couple acts where there is no crease to turn.
    """
    topology = model.mesh.topology
    loaded = (program.law == SHEET) & ((program.moment.start != 0.0) | (program.moment.end != 0.0))
    if loaded.any():
        edge = topology.hinges[int(np.argmax(loaded)), 1:3].tolist()
        raise ModelError(
            f"a moment acts at edge {edge}, which is no spring crease; give its crease a stiffness (0 for a free hinge)"
        )
    hinges = np.flatnonzero(program.law != SHEET)
    edges = topology.hinge_edges[hinges]
    of_edge = np.full(len(topology.edges), -1, dtype=np.int64)
    of_edge[edges] = np.arange(len(edges))
    table = tables()
    shape = np.column_stack((1.0 - table.s, table.s))
    speed = np.linalg.norm(edge_tangents(mesh, mesh.nodes), axis=-1)
    mass = np.einsum("p,cp,pi,pj->cij", table.edge_weights, speed[edges], shape, shape)
    held = program.law[hinges] == HELD
    stiffness = np.where(program.law == SPRING, program.stiffness, 0.0)[hinges]

    def fold(angles: Array) -> Array:
        """(c, 2) fold angles of dihedral angles (m, 2)."""
        out: Array = math.pi - angles[hinges]
        return out

    begin = beta[hinges]
    imposed = program.held_angles(math.pi - beta)
    angle = Ramp(*(np.where(held[:, None], fold(at), 0.0) for at in (imposed.start, imposed.end)))
    # a held crease that is released keeps its moment: k (rest - beta) is what the crease carried
    turn = np.linalg.solve(mass, couple[hinges][..., None])[..., 0]
    released = begin + turn / np.where(stiffness > 0.0, stiffness, np.inf)[:, None]
    start = fold(program.rest_ends.start)
    rest = Ramp(np.where(np.isnan(start), released, start), fold(program.rest_ends.end))
    load = Ramp(
        np.where(held, 0.0, program.moment.start[hinges]), np.where(held, 0.0, program.moment.end[hinges])
    )
    return Connectors(hinges, edges, of_edge, held, angle, mass, stiffness, rest, load)
