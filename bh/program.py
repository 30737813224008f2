"""The steps of a model as ramps: for every step what each hinge, node and support does while lambda runs.

Description only, shared by all formulations: no stiffness of the sheet, no unknowns.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.actuation import Actuation, Array, Bar, Displace, Fold, Force, Moment, Pinch, Ramp, Tether
from bh.errors import ModelError
from bh.model import CreaseLaw, Model
from bh.observables import Until
from bh.pinch_zone import Pinched, chain, is_chain, parts, zone
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
            begins with the moment that the crease has. `rest_ends` are those at the ends of each edge (m, 2), at the
            lower and the higher node, for a formulation whose angles vary along an edge.
        held: imposed dihedral angles, rad; start is nan where the angle at the start of the step is to be taken. What a
            pinch imposes depends on that angle, see `held_angles`.
        pinch: which held creases are pinched in this step, or were before.
        moment: couple a length that closes the dihedral angle below the sheet, N mm / mm.
        force: (n, 3) dead forces, N.
        constraints: supports and prescribed displacements.
        bodies: bars and tethers that act in this step.
    """

    law: NDArray[np.int64]
    stiffness: Array
    rest: Ramp
    rest_ends: Ramp
    held: Ramp
    pinch: Pinched
    moment: Ramp
    force: Ramp
    constraints: Constraints
    bodies: tuple[Bar | Tether, ...] = ()

    def held_angles(self, now: Array) -> Ramp:
        """Imposed angles for a step that begins with dihedral angles `now`, (m,) or (m, 2) at the ends of each edge."""
        ends = now.ndim == 2

        def spread(values: Array) -> Array:
            return np.repeat(values, 2).reshape(-1, 2) if ends else values

        start = spread(self.held.start)
        start = np.where(np.isnan(start), now, start)
        toward, base = spread(self.pinch.toward), spread(self.pinch.base)
        base = np.where(np.isnan(base), start, base)
        part = self.pinch.ends if ends else self.pinch.part
        return Ramp(start, np.where(np.isnan(toward), spread(self.held.end), base + part * (toward - base)))

    @property
    def rotation(self) -> float:
        """Largest change of an imposed or rest angle in this step, rad."""
        begin = np.where(np.isnan(self.pinch.toward), math.pi, self.pinch.present)
        held = np.where(np.isnan(self.held.start), begin, self.held.start)
        change = np.concatenate(
            (np.abs(self.held.end - held)[self.law == HELD], np.abs(np.nan_to_num(self.rest.rate)))
        )
        return float(change.max(initial=0.0))


@dataclass(frozen=True, eq=False)
class Ended:
    """Where a step ended before its actuations were complete.

    Attributes:
        lam: its control parameter there.
        points: (n, 3) node positions, mm.
        dihedral_angles: (m,) rad.
    """

    lam: float
    points: Array
    dihedral_angles: Array


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
        self.rest_ends = np.full((hinges, 2), math.pi)
        self.pinch = Pinched.none(hinges)
        self.pinched = np.zeros(hinges, dtype=bool)  # held at an angle that follows from a solved state
        self.folded = np.zeros(hinges, dtype=bool)  # in this step
        self.claimed: dict[int, tuple[float, Pinch]] = {}  # pinches of this step
        self.force = np.zeros((nodes, 3))
        self.displaced: dict[tuple[int, tuple[float, float, float]], float] = {}
        self.now: dict[tuple[int, tuple[float, float, float]], float] = {}  # of this step
        self.given = np.full((2, hinges), np.nan)  # angles and moments of this step
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

    def stop(self, step: StepProgram, end: Ended) -> None:
        """What the next step begins with where `step` ended early."""
        self.rest, self.rest_ends, self.moment, self.force = (
            ramp.at(end.lam) for ramp in (step.rest, step.rest_ends, step.moment, step.force)
        )
        if np.isnan(self.rest).any():
            raise ModelError(
                "a held crease is released in a step that ends early (until); release it in a step before"
            )
        self.held = np.where(self.law == HELD, end.dihedral_angles, np.nan)
        moved = end.points - self.mesh.points
        self.displaced = {(node, axis): float(moved[node] @ axis) for node, axis in self.displaced}

    def step(self, actuations: tuple[Actuation | Until, ...]) -> StepProgram:
        before = (self.rest.copy(), self.held.copy(), self.moment.copy(), self.force.copy())
        ends = self.rest_ends.copy()
        self.steps += 1
        if self.steps == 1:
            self.rest = self.made.copy()
            self.rest_ends = np.repeat(self.made, 2).reshape(-1, 2)
        self.released = np.zeros(len(self.rest), dtype=bool)
        self._begin_pinches(before[1])
        displaced = dict(self.displaced)
        self.now = {}
        self.given[:] = np.nan
        for item in actuations:
            if isinstance(item, Pinch):
                continue
            if isinstance(item, Fold):
                self._fold(item)
            elif isinstance(item, Moment):
                hinges, sense, _ = self.creases(item.crease)
                self._once(1, hinges, sense * item.to, "N mm / mm")
                self.moment[hinges] = sense * item.to
            elif isinstance(item, Force):
                self._force(item)
            elif isinstance(item, Displace):
                self._displace(item)
        angles = self._present()
        for item in actuations:  # a pinch goes from where the fold of its step ends
            if isinstance(item, Pinch):
                self._pinch(item, angles)
        bodies = tuple(item for item in actuations if isinstance(item, Bar | Tether))
        rest, held, moment, force = before
        rest[self.released] = np.nan
        ends[self.released] = np.nan
        return StepProgram(
            law=self.law.copy(),
            stiffness=self.stiffness.copy(),
            rest=Ramp(rest, self.rest.copy()),
            rest_ends=Ramp(ends, self.rest_ends.copy()),
            held=Ramp(held, self.held.copy()),
            pinch=self.pinch,
            moment=Ramp(moment, self.moment.copy()),
            force=Ramp(force, self.force.copy()),
            constraints=resolve(
                self.mesh, self.model.supports, self._prescribed(displaced), touching=bool(bodies)
            ),
            bodies=bodies,
        )

    def _begin_pinches(self, held: Array) -> None:
        """A pinch of an earlier step stays as it is until something else is asked for; `held` begins where it is."""
        self.pinch = Pinched.none(len(self.law))
        self.pinch.toward[self.pinched] = self.held[self.pinched]
        self.pinch.present[:] = self._present()
        held[self.pinched] = np.nan
        self.folded = np.zeros(len(self.law), dtype=bool)
        self.claimed = {}

    def _present(self) -> Array:
        """(m,) angles that the steps so far are meant to bring about, rad."""
        return np.select([self.law == HELD, self.law == SPRING], [self.held, self.rest], math.pi)

    def _pinch(self, item: Pinch, before: Array) -> None:
        """`before` (m,) angles that the pinches of this step go from, rad."""
        names = [item.crease]
        if item.crease == "all":
            names = [
                name
                for name in self.mesh.creases
                if self.mesh.folds.get(name) != "flat" and is_chain(self.mesh, name)
            ]
            if not names:
                raise ModelError("pinch of crease 'all': the sheet has no mountain or valley crease")
        for name in names:
            self._pinch_one(name, item, before)

    def _pinch_one(self, name: str, item: Pinch, before: Array) -> None:
        hinges, sense, _ = self.creases(name)
        line = chain(self.mesh, name)
        part, ends = parts(line, item.at, zone(line, name, item.at, item.length), item.profile)
        turned = self.mesh.crease_edges(name)
        ends = np.where((turned[:, 0] > turned[:, 1])[:, None], ends[:, ::-1], ends)
        inside = np.flatnonzero(part > 0.0)
        rows, part, ends = hinges[inside], part[inside], ends[inside]
        now, target = before[rows], item.target(sense)[inside]
        self._check_pinch(name, item, rows, now, target)
        nominal = now + part * (target - now)
        for row, angle in zip(rows.tolist(), nominal.tolist(), strict=True):
            known, other = self.claimed.setdefault(row, (angle, item))
            if abs(known - angle) > 1e-9:
                raise ModelError(
                    f"two pinches of crease '{name}' overlap and contradict each other (at {other.at:g} and "
                    f"{item.at:g}); keep their zones apart, or pinch one after the other"
                )
        if item.how == "rest":
            self.rest[rows] = nominal
            self.rest_ends[rows] += ends * (target[:, None] - self.rest_ends[rows])
            return
        self.law[rows], self.held[rows] = HELD, nominal
        self.pinch.toward[rows], self.pinch.part[rows], self.pinch.ends[rows] = target, part, ends
        self.pinch.base[rows] = np.where(self.folded[rows], now, np.nan)
        self.pinched[rows] = True

    def _check_pinch(self, name: str, item: Pinch, rows: Ints, now: Array, target: Array) -> None:
        law = self.law[rows]
        if (law == SHEET).any():
            raise ModelError(
                f"pinch of crease '{name}': it is ordinary sheet there; fold it before, or in the same step"
            )
        if item.how == "rest" and (law == HELD).any():
            raise ModelError(
                f"pinch of crease '{name}' by rest angles: its angle is imposed there and no spring acts; "
                "use how = 'imposed'"
            )
        other = (now - math.pi) * (target - math.pi) < 0.0
        if other.any():
            angle = float(target[int(np.argmax(other))])
            raise ModelError(
                f"pinch of crease '{name}' to {angle:.4g} rad would fold it to its other side; "
                f"give {2.0 * math.pi - angle:.4g}, or by"
            )

    def _fold(self, item: Fold) -> None:
        hinges, sense, drawn = self.creases(item.crease)
        self.folded[hinges] = True
        self.pinched[hinges] = False
        self.pinch.toward[hinges] = np.nan
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
        self._once(0, hinges, angle, "rad")
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
        self.rest_ends[hinges] = angle[:, None]

    def _once(self, kind: int, hinges: Ints, value: Array, unit: str) -> None:
        """Refuse two different values for one crease in one step."""
        known = self.given[kind, hinges]
        other = ~np.isnan(known) & ~np.isclose(known, value, rtol=1e-12, atol=0.0)
        if other.any():
            row = int(np.argmax(other))
            raise ModelError(
                f"{hinge_name(self.mesh, int(hinges[row]))} is given {known[row]:g} and {value[row]:g} {unit} in one "
                f"step ({self.steps}); give it one, or the second in a step of its own"
            )
        self.given[kind, hinges] = value

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


def program(model: Model, ended: Mapping[int, Ended] | None = None) -> tuple[StepProgram, ...]:
    """The ramps of every step of `model`, in order; nothing is solved. `ended` tells of steps that ended early.

    Raises:
        ModelError, MeshError: an actuation or support that the sheet cannot take; the message names it.
    """
    builder = _Builder(model)
    steps = []
    for number, actuations in enumerate(model.steps):
        steps.append(builder.step(actuations))
        if ended is not None and number in ended:
            builder.stop(steps[-1], ended[number])
    return tuple(steps)


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
