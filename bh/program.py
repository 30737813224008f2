"""The steps of a model as ramps: for every step what each hinge, node and support does while lambda runs.

Description only, shared by all formulations: no stiffness of the sheet, no unknowns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.actuation import Actuation, Array, Displace, Fold, Force, Moment, Ramp
from bh.errors import ModelError
from bh.model import CreaseLaw, Model
from bh.supports import AXES, Constraints, Prescribed, resolve, select
from meshes import SheetMesh
from meshes.topology import Ints

SHEET, SPRING, HELD = 0, 1, 2


@dataclass(frozen=True)
class StepProgram:
    """One step. Hinge arrays have one entry for each row of `mesh.topology.hinges`.

    Attributes:
        law: (m,) SHEET (uncreased), SPRING (elastic crease) or HELD (angle imposed exactly).
        stiffness: (m,) of spring creases a length, N mm / (mm rad).
        rest: rest dihedral angles of the springs, rad; start is nan where a held crease is released: the spring then
            begins with the moment that the crease has.
        held: imposed dihedral angles, rad; start is nan where the angle at the start of the step is to be taken.
        moment: couple a length that closes the dihedral angle below the sheet, N mm / mm.
        force: (n, 3) dead forces, N.
        constraints: supports and prescribed displacements.
    """

    law: NDArray[np.int64]
    stiffness: Array
    rest: Ramp
    held: Ramp
    moment: Ramp
    force: Ramp
    constraints: Constraints

    @property
    def rotation(self) -> float:
        """Largest change of an imposed or rest angle in this step, rad."""
        held = np.where(np.isnan(self.held.start), math.pi, self.held.start)
        change = np.concatenate(
            (np.abs(self.held.end - held)[self.law == HELD], np.abs(np.nan_to_num(self.rest.rate)))
        )
        return float(change.max(initial=0.0))


class _Builder:
    """Walks through the steps and remembers what the last one left behind."""

    def __init__(self, model: Model) -> None:
        self.model, self.mesh = model, model.mesh
        topology = model.mesh.topology
        hinges, nodes = len(topology.hinges), len(model.mesh.points)
        self.law = np.zeros(hinges, dtype=np.int64)
        self.stiffness = np.zeros(hinges)
        self.rest = stress_free_angles(model.mesh)
        self.made = self.rest.copy()  # rest angles of the laws; they come in during the first step
        self.held = np.full(hinges, np.nan)
        self.moment = np.zeros(hinges)
        self.steps = 0
        self.released = np.zeros(hinges, dtype=bool)
        self.force = np.zeros((nodes, 3))
        self.displaced: dict[tuple[int, tuple[float, float, float]], float] = {}
        self.now: dict[tuple[int, tuple[float, float, float]], float] = {}  # of this step
        for name, crease in model.creases.items():
            self._spring(self.hinges(name), crease)
            self.made[self.hinges(name)] = crease.rest
        for step in model.steps:  # a spring that a later step names is there from the start, at rest flat
            for item in step:
                if isinstance(item, Fold) and (item.Lstar is not None or item.stiffness is not None):
                    self._spring(self.creases(item.crease)[0], CreaseLaw(item.Lstar, item.stiffness))

    def _spring(self, hinges: Ints, law: CreaseLaw) -> None:
        stiffness = law.per_length(self.model.sheet)
        other = (self.law[hinges] == SPRING) & ~np.isclose(self.stiffness[hinges], stiffness, rtol=1e-12)
        if other.any():
            edge = self.mesh.topology.hinges[hinges[int(np.argmax(other))], 1:3].tolist()
            raise ModelError(
                f"the crease at edge {edge} has two stiffnesses ({self.stiffness[hinges][other][0]:.6g} and "
                f"{stiffness:.6g} N mm / (mm rad)); give it one, it cannot change from step to step"
            )
        self.law[hinges] = SPRING
        self.stiffness[hinges] = stiffness

    def hinges(self, crease: str) -> Ints:
        found = _edge_hinges(self.mesh, crease)
        if (found < 0).any():
            raise ModelError(
                f"crease '{crease}' runs along the boundary, where nothing can fold; draw it inside"
            )
        return found

    def creases(self, name: str) -> tuple[Ints, Array, Array]:
        """Hinges of a crease or of "all", the drawn sense (+1 mountain, -1 valley) and the drawn fold angles."""
        if name == "all":
            names = [crease for crease in self.mesh.creases if self.mesh.folds.get(crease) != "flat"]
            if not names:
                raise ModelError("fold of crease 'all': the sheet has no mountain or valley crease")
        else:
            names = [name]
        hinges = [self.hinges(each) for each in names]
        sense = [
            np.full(len(found), -1.0 if self.mesh.folds.get(each) == "valley" else 1.0)
            for each, found in zip(names, hinges, strict=True)
        ]
        drawn = [
            np.asarray(self.mesh.fold_angles.get(each, np.full(len(found), np.nan)))
            for each, found in zip(names, hinges, strict=True)
        ]
        joined, first = np.unique(np.concatenate(hinges), return_index=True)
        if name != "all":  # keep the order along the crease, angles may be given an edge
            first = np.sort(first)
            joined = np.concatenate(hinges)[first]
        return joined, np.concatenate(sense)[first], np.concatenate(drawn)[first]

    def step(self, actuations: tuple[Actuation, ...]) -> StepProgram:
        before = (self.rest.copy(), self.held.copy(), self.moment.copy(), self.force.copy())
        self.steps += 1
        if self.steps == 1:
            self.rest = self.made.copy()
        self.released = np.zeros(len(self.rest), dtype=bool)
        displaced = dict(self.displaced)
        self.now = {}
        for item in actuations:
            if isinstance(item, Fold):
                self._fold(item)
            elif isinstance(item, Moment):
                hinges, sense, _ = self.creases(item.crease)
                self.moment[hinges] = sense * item.to
            elif isinstance(item, Force):
                self._force(item)
            else:
                self._displace(item)
        rest, held, moment, force = before
        rest[self.released] = np.nan
        return StepProgram(
            law=self.law.copy(),
            stiffness=self.stiffness.copy(),
            rest=Ramp(rest, self.rest.copy()),
            held=Ramp(held, self.held.copy()),
            moment=Ramp(moment, self.moment.copy()),
            force=Ramp(force, self.force.copy()),
            constraints=resolve(self.mesh, self.model.supports, self._prescribed(displaced)),
        )

    def _fold(self, item: Fold) -> None:
        hinges, sense, drawn = self.creases(item.crease)
        spring = item.rest is not None or item.Lstar is not None or item.stiffness is not None
        if isinstance(item.by, str):
            if np.isnan(drawn).any():
                raise ModelError(
                    f"fold of crease '{item.crease}': the pattern gives no fold angles; use by = radians"
                )
            angle = math.pi - drawn
        elif item.by is not None:
            angle = math.pi - sense * self._per_edge(item, item.by, len(hinges))
        else:
            value = item.to if item.to is not None else item.rest
            assert value is not None
            angle = self._per_edge(item, value, len(hinges))
        if not spring:
            inside = (angle > 0.0) & (angle < 2.0 * math.pi)
            if not inside.all():
                raise ModelError(
                    f"fold of crease '{item.crease}' closes it completely; stay inside (0, 2 pi) rad"
                )
            self.law[hinges] = HELD
            self.held[hinges] = angle
            return
        if item.Lstar is not None or item.stiffness is not None:  # a held crease is released into its spring
            self.released[hinges] = self.law[hinges] == HELD
            self.law[hinges], self.held[hinges] = SPRING, np.nan
        if (self.law[hinges] != SPRING).any():
            raise ModelError(f"fold of crease '{item.crease}' by its rest angle needs Lstar or stiffness")
        self.rest[hinges] = angle

    @staticmethod
    def _per_edge(item: Fold, value: float | object, count: int) -> Array:
        angles = np.asarray(value, dtype=float)
        if angles.ndim and angles.shape != (count,):
            raise ModelError(f"fold of crease '{item.crease}' has {angles.size} angles for {count} edges")
        return np.broadcast_to(angles, (count,)).copy()

    def _force(self, item: Force) -> None:
        nodes = select(self.mesh, item.at)
        vector = item.each if item.each is not None else item.total
        share = 1.0 if item.each is not None else 1.0 / len(nodes)
        self.force[nodes] = share * np.asarray(vector, dtype=float)

    def _displace(self, item: Displace) -> None:
        raw = AXES[item.direction] if isinstance(item.direction, str) else item.direction
        unit = np.asarray(raw, dtype=float) / np.linalg.norm(raw)
        key = (float(unit[0]), float(unit[1]), float(unit[2]))
        for node in select(self.mesh, item.at).tolist():
            if self.now.setdefault((node, key), item.by) != item.by:
                raise ModelError(
                    f"node {node} is displaced by {self.now[node, key]:g} and by {item.by:g} mm along the same "
                    "direction in one step; remove one of them"
                )
            self.displaced[(node, key)] = item.by

    def _prescribed(self, before: dict[tuple[int, tuple[float, float, float]], float]) -> list[Prescribed]:
        # a node that begins to be displaced in a later step begins where it is
        start = np.nan if self.steps > 1 else 0.0
        return [
            Prescribed(np.array([node]), direction, before.get((node, direction), start), end)
            for (node, direction), end in self.displaced.items()
        ]


def stress_free_angles(mesh: SheetMesh) -> Array:
    """(m,) dihedral angles of the mesh as it is made, rad: there springs are at rest before the first step."""
    hinges = mesh.topology.hinges
    if mesh.flat:
        return np.full(len(hinges), math.pi)
    wing, tail, head, other = (mesh.points[hinges[:, k]] for k in range(4))
    edge = head - tail
    one, two = np.cross(edge, wing - tail), np.cross(other - tail, edge)
    length = np.linalg.norm(edge, axis=1)
    turn = np.arctan2(length * np.einsum("mi,mi->m", one, other - tail), np.einsum("mi,mi->m", one, two))
    return np.asarray(np.mod(math.pi + turn, 2.0 * math.pi))


def program(model: Model) -> tuple[StepProgram, ...]:
    """The ramps of every step of `model`, in order; nothing is solved.

    Raises:
        ModelError, MeshError: an actuation or support that the sheet cannot take; the message names it.
    """
    builder = _Builder(model)
    return tuple(builder.step(actuations) for actuations in model.steps)


def crease_hinges(mesh: SheetMesh, crease: str) -> Ints:
    """Rows of `mesh.topology.hinges` along a crease, in order."""
    found = _edge_hinges(mesh, crease)
    return found[found >= 0]


def hinge_name(mesh: SheetMesh, hinge: int) -> str:
    """A row of `mesh.topology.hinges` in words: "crease 'NAME' (edge 3-7)", or "edge 3-7" off creases.

    Where several names share the edge (FOLD files name all mountains, and each chain of them) it is the shortest one.
    """
    a, b = mesh.topology.hinges[hinge, 1:3].tolist()
    on = [name for name in mesh.creases if hinge in crease_hinges(mesh, name)]
    if not on:
        return f"edge {a}-{b}"
    return f"crease '{min(on, key=lambda name: len(mesh.crease_edges(name)))}' (edge {a}-{b})"


def open_ends(mesh: SheetMesh, step: StepProgram) -> list[str]:
    """Where an imposed fold ends inside the sheet, one line each: no sheet can follow it there without a limit.

    The slopes have a dislocation at such a node and the curvature goes with 1 / r (docs/fem.md). An end that is faded
    out to a tenth of the largest angle, or that another crease goes on from, is none.
    """
    topology = mesh.topology
    angle = np.where(step.law == HELD, np.abs(math.pi - step.held.end), 0.0)
    ends = topology.hinges[:, 1:3]
    creased = np.bincount(ends[step.law != SHEET].ravel(), minlength=len(mesh.points))
    creased[topology.boundary.ravel()] = 0
    held = np.flatnonzero(angle > 0.1 * angle.max(initial=0.0))
    return [
        f"{hinge_name(mesh, hinge)} ends inside the sheet at node {node} with its angle imposed: the energy there "
        "has no limit under refinement; let the angle fade out, or give the crease a spring"
        for hinge in held.tolist()
        for node in ends[hinge].tolist()
        if creased[node] == 1
    ]


def _edge_hinges(mesh: SheetMesh, crease: str) -> Ints:
    """Hinge of every edge of a crease, in order; -1 where the edge lies on the boundary."""
    topology = mesh.topology
    return topology.edge_hinges[topology.find_edges(mesh.crease_edges(crease))]
