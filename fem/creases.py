"""Creases of the shell: a fold angle beta between the two sides of an edge.

It is linear along the edge (r = 2 values, at the lower and the higher node), or constant where positions are linear
(r = 1).

The side rotations of an edge are gamma = +-alpha + beta / 2 (+ for the triangle on its left), alpha the rotation of
the edge and beta the fold angle pi - phi, positive where the sides drop away from the crease (a mountain). Ordinary
edges have none.
- rigid: beta is prescribed, its reaction is the crease's moment;
- elastic: 1/2 k_f int (beta - beta_R)^2 ds; free hinge: k_f = 0;
- moment-driven: - int m beta ds, on top of either.

- a law of its own (table, elastic-plastic, ...): an energy at the points of the edge (`fem.crease_laws`).

As the moment of a side is conjugate to gamma, an elastic crease is the same as a compliance -sigma_nn^2 / (2 k_f) in
the mixed energy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.loading.load_step import LoadStep
from bh.model.laws import PRESCRIBED, SHEET, SPRING
from bh.model.model import Model
from bh.model.ramp import Ramp
from fem.crease_laws import CreaseLaws, crease_laws
from fem.shell import ShellElements, edge_tangents
from fem.spaces import tables
from fem.state import ShellState
from meshes.curved import ElementMesh
from meshes.topology import Ints

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Connectors:
    """Creased edges of one step; c of them, r values of beta each, rad.

    Attributes:
        hinges: (c,) rows of `mesh.topology.hinges`.
        edges: (c,) rows of `mesh.topology.edges`.
        of_edge: (e,) row of a creased edge, -1 elsewhere.
        prescribed: (c,) True where beta is imposed.
        angle: (c, r) what is imposed there, rad.
        mass: (c, r, r) int of the products of beta's shape functions, mm.
        stiffness: (c,) k_f a length, N mm / (mm rad).
        rest: (c, r) beta_R, rad.
        moment: (c, r) couple a length, N.
        laws: of creases that are no straight lines, whose `stiffness` here is zero; None without such creases.
    """

    hinges: Ints
    edges: Ints
    of_edge: Ints
    prescribed: NDArray[np.bool_]
    angle: Ramp
    mass: Array
    stiffness: Array
    rest: Ramp
    moment: Ramp
    laws: CreaseLaws | None = None

    def __len__(self) -> int:
        """Number of creased edges, c."""
        return len(self.edges)

    @cached_property
    def _straight(self) -> Array:
        """(c, r, r) stiffness of creases that are straight lines, N mm / rad^2."""
        return self.stiffness[:, None, None] * self.mass

    def energy(self, beta: Array, lam: float) -> Array:
        """(c,) energies of springs, with what yielding has dissipated, N mm.

        Args:
            beta: (c, r) turns of the connectors, rad.
            lam: load parameter of the step, 0 to 1.
        """
        turn = beta - self.rest.at(lam)
        out: Array = 0.5 * self.stiffness * np.einsum("ci,cij,cj->c", turn, self.mass, turn)
        return out if self.laws is None else out + self.laws.held(turn).energy

    def load_energy(self, beta: Array, lam: float) -> float:
        """Potential of the couples, N mm.

        Args:
            beta: (c, r) turns of the connectors, rad.
            lam: load parameter of the step, 0 to 1.
        """
        return -float(np.einsum("ci,cij,cj->", self.moment.at(lam), self.mass, beta))

    def springs(self, beta: Array, lam: float) -> Array:
        """(c, r) derivative of the energies of springs by beta, N mm / rad.

        Args:
            beta: (c, r) turns of the connectors, rad.
            lam: load parameter of the step, 0 to 1.
        """
        turn = beta - self.rest.at(lam)
        out: Array = np.einsum("cij,cj->ci", self._straight, turn)
        return out if self.laws is None else out + self.laws.held(turn).gradient

    def tangents(self, beta: Array, lam: float) -> Array:
        """(c, r, r) second derivative of the energies of springs by beta, N mm / rad^2.

        Args:
            beta: (c, r) turns of the connectors, rad.
            lam: load parameter of the step, 0 to 1.
        """
        out = self._straight
        return out if self.laws is None else out + self.laws.held(beta - self.rest.at(lam)).tangent

    def gradient(self, beta: Array, lam: float) -> Array:
        """(c, r) derivative of both energies by beta, N mm / rad.

        Args:
            beta: (c, r) turns of the connectors, rad.
            lam: load parameter of the step, 0 to 1.
        """
        return np.asarray(self.springs(beta, lam) - np.einsum("cij,cj->ci", self.mass, self.moment.at(lam)))

    def largest(self, beta: Array, lam: float) -> float:
        """Largest couple of a spring or of a load on one value of beta, N mm / rad.

        Args:
            beta: (c, r) turns of the connectors, rad.
            lam: load parameter of the step, 0 to 1.
        """
        spring = np.abs(self.springs(beta, lam)).max(initial=0.0)
        load = np.abs(self.moment.at(lam) * self.mass.sum(axis=2)).max(initial=0.0)
        return float(max(spring, load))

    def gradient_rate(self, beta: Array, lam: float) -> Array:
        """(c, r) derivative of `gradient` by lambda at fixed beta.

        Args:
            beta: (c, r) turns of the connectors, rad.
            lam: load parameter of the step, 0 to 1.
        """
        turning = np.einsum("cij,cj->ci", self.tangents(beta, lam), self.rest.rate)
        return np.asarray(-turning - np.einsum("cij,cj->ci", self.mass, self.moment.rate))

    def power(self, beta: Array, lam: float) -> float:
        """Derivative of both energies by lambda at fixed beta, N mm.

        Args:
            beta: (c, r) turns of the connectors, rad.
            lam: load parameter of the step, 0 to 1.
        """
        loads = float(np.einsum("ci,cij,cj->", self.moment.rate, self.mass, beta))
        return -float(np.vdot(self.springs(beta, lam), self.rest.rate)) - loads


def connectors(mesh: ElementMesh, model: Model, load_step: LoadStep, start: ShellState | None) -> Connectors:
    """Creased edges of a step.

    Args:
        mesh: elements.
        model: has the laws of its creases.
        load_step: what the step imposes.
        start: state that the step begins at; None for the flat sheet.

    Raises:
        ModelError: a couple acts where there is no crease to turn.
    """
    topology = model.mesh.topology
    loaded = (load_step.law == SHEET) & ((load_step.moment.start != 0.0) | (load_step.moment.end != 0.0))
    if loaded.any():
        edge = topology.hinges[int(np.argmax(loaded)), 1:3].tolist()
        raise ModelError(
            f"a moment acts at edge {edge}, which is no spring crease; give its crease a stiffness (0 for a free hinge)"
        )
    hinges = np.flatnonzero(load_step.law != SHEET)
    edges = topology.hinge_edges[hinges]
    of_edge = np.full(len(topology.edges), -1, dtype=np.int64)
    of_edge[edges] = np.arange(len(edges))
    table = tables(mesh.degree)
    turns = table.rotations
    flat = np.zeros((len(topology.hinges), turns))
    beta, couple = (flat, flat) if start is None else (start.fold_angles, start.crease_couples)
    weights = table.edge_weights * np.linalg.norm(edge_tangents(mesh, mesh.nodes), axis=-1)[edges]
    mass = np.einsum("cp,ip,jp->cij", weights, table.turn, table.turn)
    prescribed = load_step.law[hinges] == PRESCRIBED
    laws = crease_laws(load_step, hinges, weights, table, start)
    straight = (load_step.law == SPRING) & (True if load_step.curve is None else load_step.curve < 0)
    stiffness = np.where(straight, load_step.stiffness, 0.0)[hinges]

    def fold(angles: Array) -> Array:
        """(c, r) fold angles of dihedral angles (m, 2) at the ends of edges, or (m,) of whole edges."""
        out: Array = (math.pi - angles[hinges]).reshape(-1, turns)
        return out

    begin = beta[hinges]
    imposed = load_step.prescribed_angles(math.pi - (beta if turns == 2 else beta[:, 0]))
    springs = load_step.rest_ends if turns == 2 else load_step.rest
    angle = Ramp(*(np.where(prescribed[:, None], fold(at), 0.0) for at in (imposed.start, imposed.end)))
    # a prescribed crease that is released keeps its moment: k (rest - beta) is what the crease carried
    turn = np.linalg.solve(mass, couple[hinges][..., None])[..., 0]
    released = begin + turn / np.where(stiffness > 0.0, stiffness, np.inf)[:, None]
    before = fold(springs.start)
    rest = Ramp(np.where(np.isnan(before), released, before), fold(springs.end))
    load = [
        np.repeat(np.where(prescribed, 0.0, at[hinges])[:, None], turns, axis=1)
        for at in (load_step.moment.start, load_step.moment.end)
    ]
    if laws is not None and load_step.freed is not None:  # what imposed their angles fades out
        own = np.linalg.solve(mass, laws.held(begin - rest.start).gradient[..., None])[..., 0]
        freed = load_step.freed[hinges] & ~prescribed
        load[0] = np.where(freed[:, None], turn + own, load[0])
    return Connectors(
        hinges, edges, of_edge, prescribed, angle, mass, stiffness, rest, Ramp(load[0], load[1]), laws
    )


class SpringEntries(NamedTuple):
    """Where the stiffness of elastic creases goes: (k,) places, and (3, k) which of their entries (c, r, r)."""

    places: Ints
    which: Ints


def spring_entries(
    creases: Connectors, elements: ShellElements, turns: int, slots: NDArray[np.int32]
) -> SpringEntries:
    """Where the stiffness of elastic creases goes.

    Args:
        creases: of the step.
        elements: of the sheet.
        turns: rotations of an edge.
        slots: (t, entries) of the lower entries of every element in the matrix, -1 where there is none.
    """
    places, which = [], []
    triangle = elements.mesh.sheet.topology.edge_triangles[creases.edges, 0]
    local = np.argmax(elements.loops.edges[triangle] == creases.edges[:, None], axis=1)
    swapped = elements.loops.sides[triangle, local] < 0
    first = elements.width
    for i, j in zip(*np.tril_indices(turns), strict=True):
        row, column = first + turns * local + i, first + turns * local + j
        end = np.where(swapped, turns - 1 - i, i), np.where(swapped, turns - 1 - j, j)
        places.append(slots[triangle, row * (row + 1) // 2 + column])
        which.append(np.stack((np.arange(len(creases)), *end)))
    place, entry = np.concatenate(places), np.concatenate(which, axis=1)
    return SpringEntries(place[place >= 0], entry[:, place >= 0])
