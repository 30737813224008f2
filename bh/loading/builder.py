"""Where the actuations of a model leave what they ask for, step by step. docs/extending.md adds one."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bh.errors import ModelError
from bh.formulations.observables import Until
from bh.loading.load_step import Ended, StepProgram, edge_hinges, hinge_name
from bh.model.actuations import Actuation, Array, Bar, Ramp, Tether
from bh.model.laws import HELD, SPRING
from bh.model.model import CreaseLaw, Model
from bh.model.pinch import Pinched
from bh.model.supports import Prescribed, resolve
from meshes.topology import Ints, dihedral_angles

Direction = tuple[float, float, float]


class Ramps:
    """Walks through the steps and remembers what the last one left behind.

    An actuation calls what it needs in `apply`: `creases` to find hinges, then `hold`, `rest_at`, `couple`, `pull`,
    `displace` or `touch`. What nobody calls stays as it was.

    Attributes:
        mesh, sheet: of the model; steps: number of the step, from one.
        law, rest, rest_ends, held: see `bh.loading.load_step.StepProgram`, at the end of the step.
    """

    def __init__(self, model: Model) -> None:
        self.model, self.mesh, self.sheet = model, model.mesh, model.sheet
        hinges, nodes = len(model.mesh.topology.hinges), len(model.mesh.points)
        self.law = np.zeros(hinges, dtype=np.int64)
        self.stiffness = np.zeros(hinges)
        self.rest = dihedral_angles(model.mesh.points, model.mesh.topology.hinges)
        self.made = self.rest.copy()  # rest angles of the laws; they come in during the first step
        self.rest_ends = np.full((hinges, 2), math.pi)
        self.held = np.full(hinges, np.nan)
        self.moment = np.zeros(hinges)
        self.force = np.zeros((nodes, 3))
        self.displaced: dict[tuple[int, Direction], float] = {}
        self.steps = 0
        self.pinched = np.zeros(hinges, dtype=bool)  # held at an angle that follows from a solved state
        self._begin()
        for name, crease in model.creases.items():
            self.spring(self.hinges(name), crease.Lstar, crease.stiffness)
            self.made[self.hinges(name)] = crease.rest
        for step in model.steps:  # a spring that a later step names is there from the start, at rest flat
            for item in step:
                if isinstance(item, Actuation):
                    item.prepare(self)

    # ------------------------------------------------------------------------------- what actuations call

    def hinges(self, crease: str) -> Ints:
        """Rows of `mesh.topology.hinges` along a crease, in order."""
        found = edge_hinges(self.mesh, crease)
        if (found < 0).any():
            raise ModelError(
                f"crease '{crease}' runs along the boundary, where nothing can fold; draw it inside"
            )
        return found

    def creases(self, name: str) -> tuple[Ints, Array, Array]:
        """Hinges of a crease or of "all", the drawn sense (+1 mountain, -1 valley) and the drawn fold angles."""
        names = [name]
        if name == "all":
            names = [crease for crease in self.mesh.creases if self.mesh.folds.get(crease) != "flat"]
            if not names:
                raise ModelError("fold of crease 'all': the sheet has no mountain or valley crease")
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

    def spring(self, hinges: Ints, Lstar: float | None = None, stiffness: float | None = None) -> None:
        """Hinges of an elastic crease, for all steps; see `bh.CreaseLaw`."""
        value = CreaseLaw(Lstar, stiffness).per_length(self.sheet)
        other = (self.law[hinges] == SPRING) & ~np.isclose(self.stiffness[hinges], value, rtol=1e-12)
        if other.any():
            edge = self.mesh.topology.hinges[hinges[int(np.argmax(other))], 1:3].tolist()
            raise ModelError(
                f"the crease at edge {edge} has two stiffnesses ({self.stiffness[hinges][other][0]:.6g} and "
                f"{value:.6g} N mm / (mm rad)); give it one, it cannot change from step to step"
            )
        self.law[hinges] = SPRING
        self.stiffness[hinges] = value

    def hold(self, hinges: Ints, angle: Array) -> None:
        """Impose dihedral angles, rad, at the end of this step."""
        self._turn(hinges, angle)
        self.law[hinges], self.held[hinges] = HELD, angle

    def rest_at(self, hinges: Ints, angle: Array, release: bool = False) -> None:
        """Turn the rest angles of springs, rad; `release` lets go of angles that are held now."""
        self._turn(hinges, angle)
        if release:
            self.released[hinges] = self.law[hinges] == HELD
            self.law[hinges], self.held[hinges] = SPRING, np.nan
        if (self.law[hinges] != SPRING).any():
            row = int(hinges[int(np.argmax(self.law[hinges] != SPRING))])
            raise ModelError(
                f"fold of {hinge_name(self.mesh, row)} by its rest angle needs Lstar or stiffness"
            )
        self.rest[hinges] = angle
        self.rest_ends[hinges] = np.asarray(angle)[..., None]

    def couple(self, hinges: Ints, moment: Array) -> None:
        """Dead couples a length, N mm / mm, positive towards smaller dihedral angles."""
        self._once(1, hinges, moment, "N mm / mm")
        self.moment[hinges] = moment

    def pull(self, nodes: Ints, force: Array) -> None:
        """Dead forces, N, (k, 3) or (3,), in place of what pulled there."""
        self.force[nodes] = force

    def displace(self, nodes: Ints, direction: Sequence[float], by: float) -> None:
        """Prescribe the displacement of nodes along a unit vector, mm from the stress-free position."""
        x, y, z = (float(part) for part in direction)
        for node in nodes.tolist():
            if self.now.setdefault((node, (x, y, z)), by) != by:
                raise ModelError(
                    f"node {node} is displaced by {self.now[node, (x, y, z)]:g} and by {by:g} mm along the same "
                    "direction in one step; remove one of them"
                )
            self.displaced[node, (x, y, z)] = by

    def touch(self, body: Bar | Tether) -> None:
        """A body that the sheet touches in this step."""
        self.bodies.append(body)

    def present(self) -> Array:
        """(m,) angles that the steps so far are meant to bring about, rad."""
        return np.select([self.law == HELD, self.law == SPRING], [self.held, self.rest], math.pi)

    # ------------------------------------------------------------------------------- steps

    def step(self, items: Sequence[Actuation | Until]) -> StepProgram:
        """The ramps of the next step."""
        rest, held, moment, force = (part.copy() for part in (self.rest, self.held, self.moment, self.force))
        ends, displaced = self.rest_ends.copy(), dict(self.displaced)
        self.steps += 1
        if self.steps == 1:
            self.rest = self.made.copy()
            self.rest_ends = np.repeat(self.made, 2).reshape(-1, 2)
        self._begin()
        held[self.pinched] = np.nan  # it begins where it is
        acting = [item for item in items if isinstance(item, Actuation)]
        for item in acting:
            if not item.late:
                item.apply(self)
        self.before = self.present()
        for item in acting:
            if item.late:
                item.apply(self)
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
                self.mesh, self.model.supports, self._prescribed(displaced), touching=bool(self.bodies)
            ),
            bodies=tuple(self.bodies),
        )

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

    def _begin(self) -> None:
        """Nothing is asked for yet. A pinch of an earlier step stays as it is until something else is."""
        hinges = len(self.law)
        self.released = np.zeros(hinges, dtype=bool)
        self.folded = np.zeros(hinges, dtype=bool)
        self.given = np.full((2, hinges), np.nan)  # angles and moments
        self.now: dict[tuple[int, Direction], float] = {}
        self.bodies: list[Bar | Tether] = []
        self.claimed: dict[int, tuple[float, float]] = {}  # angles that pinches want, and where these are
        self.pinch = Pinched.none(hinges)
        self.pinch.toward[self.pinched] = self.held[self.pinched]
        self.pinch.present[:] = self.before = self.present()

    def _turn(self, hinges: Ints, angle: Array) -> None:
        """A crease that is folded is pinched no more."""
        self._once(0, hinges, angle, "rad")
        self.folded[hinges], self.pinched[hinges] = True, False
        self.pinch.toward[hinges] = np.nan

    def _once(self, kind: int, hinges: Ints, value: Array, unit: str) -> None:
        """Refuse two different values for one crease in one step."""
        value = np.broadcast_to(value, hinges.shape)
        known = self.given[kind, hinges]
        other = ~np.isnan(known) & ~np.isclose(known, value, rtol=1e-12, atol=0.0)
        if other.any():
            row = int(np.argmax(other))
            raise ModelError(
                f"{hinge_name(self.mesh, int(hinges[row]))} is given {known[row]:g} and {value[row]:g} {unit} in one "
                f"step ({self.steps}); give it one, or the second in a step of its own"
            )
        self.given[kind, hinges] = value

    def _prescribed(self, before: dict[tuple[int, Direction], float]) -> list[Prescribed]:
        # a node that begins to be displaced in a later step begins where it is
        start = np.nan if self.steps > 1 else 0.0
        return [
            Prescribed(np.array([node]), direction, before.get((node, direction), start), end)
            for (node, direction), end in self.displaced.items()
        ]
