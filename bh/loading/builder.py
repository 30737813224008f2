"""From the actuations of a model to load steps, one after another. docs/extending.md adds an actuation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError, NotHeldError
from bh.loading.asked import Asked, StepInHand
from bh.loading.load_step import LoadStep, StepEnd, edge_hinges, hinge_name
from bh.loading.supports import Supports, isostatic
from bh.model.actuations import Indenter
from bh.model.constraints import Constraints, Prescribed, check_held, resolve
from bh.model.crease_law import CreaseLaw
from bh.model.hinge_laws import HingeLaw
from bh.model.laws import PRESCRIBED, SPRING
from bh.model.model import Model, drawn_flat
from bh.model.mould import Mould
from bh.model.ramp import Ramp
from bh.model.sheet import Sheet
from bh.model.springs import ground_stiffness
from bh.model.step import Body, Step, Zone
from bh.model.zones import Sections
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
OVERLAP = 1e-9  # rad or N mm / mm: two zones that differ by less ask for the same


class LoadStepBuilder:
    """Walks through the steps of a model; the `bh.model.step.StepBuilder` that its actuations speak to."""

    def __init__(self, model: Model) -> None:
        """Begin before the first step of a model.

        Raises:
            ModelError, MeshError: its creases cannot be; one line.
        """
        self.mesh: SheetMesh = model.mesh
        self.sheet: Sheet = model.sheet
        self.sections: Sections = model.sections
        self._supports = Supports(model)
        self._ground = ground_stiffness(model.springs, model.mesh) if model.springs else None
        self._number = 0
        self._asked = Asked.nothing(model.mesh)
        self._rest_of_laws = self._asked.rest.copy()  # they come in during the first step
        self._step = StepInHand.after(self._asked)
        self._begun = self._asked  # the beginning of the last step
        self._laws: list[HingeLaw] = []
        for name, crease in model.creases.items():
            found = self._hinges(name)
            self._spring(found, crease)
            self._rest_of_laws[found] = crease.rest
            known = {self._laws[i] if i >= 0 else crease.law for i in self._asked.curve[found].tolist()}
            if known != {crease.law}:
                raise ModelError(
                    f"crease '{name}' shares an edge with one of another law; give both the same"
                )
            if crease.law is not None:
                self._asked.curve[found] = len(self._laws)
                self._laws.append(crease.law)
        for step in model.steps:  # a spring that a later step names is there from the start, at rest flat
            for item in step.actuations:
                item.prepare(self)

    # ------------------------------------------------------------------------------- what actuations call

    def creases(self, name: str) -> tuple[Ints, Array, Array]:
        """Hinges (k,) of a crease or of "all", drawn sense and drawn fold angles; see `StepBuilder.creases`."""
        names = [name]
        if name == "all":
            names = [crease for crease in self.mesh.creases if self.mesh.folds.get(crease) != "flat"]
            if not names:
                raise ModelError("fold of crease 'all': the sheet has no mountain or valley crease")
        hinges = [self._hinges(each) for each in names]
        sense = [
            np.full(len(found), self.mesh.sense(each)) for each, found in zip(names, hinges, strict=True)
        ]
        drawn = [
            np.asarray(self.mesh.fold_angles.get(each, np.full(len(found), np.nan)))
            for each, found in zip(names, hinges, strict=True)
        ]
        every, angles = np.concatenate(hinges), np.concatenate(drawn)
        # a hinge can have several names (all mountains, and each of them), and an angle by one of them only
        telling = np.argsort(np.isnan(angles), kind="stable")
        joined, first = np.unique(every[telling], return_index=True)
        first = telling[first]
        if name != "all":  # keep the order along the crease, angles may be given an edge
            first = np.sort(first)
            joined = every[first]
        return joined, np.concatenate(sense)[first], angles[first]

    def angles(self, hinges: Ints) -> Array:
        """(k,) dihedral angles, rad; see `StepBuilder.angles`."""
        return np.asarray(self._step.angles[hinges])

    def laws(self, hinges: Ints) -> Ints:
        """(k,) SHEET, SPRING or PRESCRIBED."""
        return np.asarray(self._asked.law[hinges])

    def spring(self, hinges: Ints, Lstar: float | None = None, stiffness: float | None = None) -> None:
        """Hinges of an elastic crease, for all steps; see `StepBuilder.spring`.

        Raises:
            ModelError: the crease has another stiffness already.
        """
        self._spring(hinges, CreaseLaw(Lstar, stiffness))

    def _spring(self, hinges: Ints, crease: CreaseLaw) -> None:
        value = crease.per_length(self.sheet)
        known = self._asked.stiffness[hinges]
        other = (self._asked.law[hinges] == SPRING) & ~np.isclose(known, value, rtol=1e-12)
        if other.any():
            edge = self.mesh.topology.hinges[hinges[int(np.argmax(other))], 1:3].tolist()
            raise ModelError(
                f"the crease at edge {edge} has two stiffnesses ({known[other][0]:.6g} and "
                f"{value:.6g} N mm / (mm rad)); give it one, it cannot change from step to step"
            )
        self._asked.law[hinges] = SPRING
        self._asked.stiffness[hinges] = value

    def prescribe(self, hinges: Ints, angle: Array, zone: Zone | None = None) -> None:
        """Impose dihedral angles (k,), rad; see `StepBuilder.prescribe`."""
        asked, pinch = self._asked, self._step.pinch
        asked.law[hinges] = PRESCRIBED
        if zone is None:
            self._turn(hinges, angle)
            asked.prescribed[hinges] = angle
            return
        asked.prescribed[hinges] = self._partly(hinges, angle, zone)
        pinch.toward[hinges], pinch.part[hinges], pinch.ends[hinges] = angle, zone.part, zone.ends
        pinch.base[hinges] = np.where(self._step.folded[hinges], self._step.angles[hinges], np.nan)
        asked.pinched[hinges] = True

    def rest_at(self, hinges: Ints, angle: Array, release: bool = False, zone: Zone | None = None) -> None:
        """Turn the rest angles (k,) of springs, rad; see `StepBuilder.rest_at`.

        Raises:
            ModelError: a hinge is no spring.
        """
        asked = self._asked
        if zone is None:
            self._turn(hinges, angle)
        release = release or bool((asked.curve[hinges] >= 0).all())  # its law is known; it is let go of
        if release:
            self._step.released[hinges] = asked.law[hinges] == PRESCRIBED
            asked.law[hinges], asked.prescribed[hinges] = SPRING, np.nan
        if (asked.law[hinges] != SPRING).any():
            row = int(hinges[int(np.argmax(asked.law[hinges] != SPRING))])
            raise ModelError(
                f"fold of {hinge_name(self.mesh, row)} by its rest angle needs Lstar or stiffness"
            )
        if zone is None:
            asked.rest[hinges] = angle
            asked.rest_ends[hinges] = np.asarray(angle)[..., None]
            return
        asked.rest[hinges] = self._partly(hinges, angle, zone)
        asked.rest_ends[hinges] += zone.ends * (angle[:, None] - asked.rest_ends[hinges])

    def couple(self, hinges: Ints, moment: Array, zone: Zone | None = None) -> None:
        """Dead couples (k,) a length, N mm / mm; see `StepBuilder.couple`."""
        if zone is None:
            self._once(1, hinges, moment, "N mm / mm")
            self._asked.moment[hinges] = moment
            return
        wanted = zone.part * moment
        self._claim(hinges, wanted, zone)
        self._asked.moment[hinges] = wanted

    def pull(self, nodes: Ints, force: Array) -> None:
        """Dead forces (k, 3) or (3,), N, in place of what pulled there."""
        self._asked.force[nodes] = force

    def bear(self, force: Array, what: str = "weight") -> None:
        """Dead forces (n, 3) beside those of `pull`, N, in place of what was borne by that name before."""
        self._asked.borne[what] = np.asarray(force, dtype=float)

    def press(self, triangles: Ints, pressure: float) -> None:
        """A pressure on triangles (k,), N / mm^2; see `StepBuilder.press`."""
        self._asked.pressed[triangles] = pressure

    def turn(self, edges: Ints, couple: float) -> None:
        """A dead couple a length on edges of the boundary (k,), N mm / mm; see `StepBuilder.turn`."""
        self._asked.turned[edges] = couple

    def grow(self, triangles: Ints, strain: Array, curvature: Array, change: float = 0.0) -> None:
        """Strain and curvature at which triangles (k,) are at rest; see `StepBuilder.grow`.

        Raises:
            ModelError: the stress-free sheet is not flat.
        """
        if not drawn_flat(self.mesh):
            raise ModelError(
                "a sheet that expands is measured from its flat shape in z = const; unfold it, or leave out expand"
            )
        asked = self._asked
        if asked.growth is None:
            asked.growth = np.zeros((2, len(self.mesh.triangles), 3, 3))
            asked.changed = np.zeros(len(self.mesh.triangles))
        fresh = [row for row in triangles.tolist() if row not in self._step.grown]
        assert asked.changed is not None
        asked.growth[:, fresh], asked.changed[fresh] = 0.0, 0.0
        asked.changed[triangles] += change
        self._step.grown.update(fresh)
        for kind, values in enumerate((strain, curvature)):
            asked.growth[kind, triangles] += values[:, None] if values.ndim == 2 else values

    def displace(self, nodes: Ints, direction: Sequence[float], by: float, further: bool = False) -> None:
        """Prescribe the displacement of nodes (k,) along a unit vector, mm; see `StepBuilder.displace`.

        Raises:
            ModelError: a node is displaced twice along it in one step.
        """
        x, y, z = (float(part) for part in direction)
        for node in nodes.tolist():
            known, relative = self._step.moved.setdefault((node, (x, y, z)), (by, further))
            if known != by or relative is not further:
                raise ModelError(
                    f"node {node} is displaced by {known:g} and by {by:g} mm along the same direction in one step; "
                    "remove one of them"
                )
            begin = self._supports.displacement(node, (x, y, z)) if further else 0.0
            self._asked.displaced[node, (x, y, z)] = begin + by

    def attach(self, body: Body) -> None:
        """Let a body act on the sheet in this step.

        Raises:
            ModelError: another indenter or mould of the step has its name, by which its force is told.
        """
        names = {other.name for other in self._step.bodies if isinstance(other, Indenter | Mould)}
        if isinstance(body, Indenter | Mould) and body.name in names:
            raise ModelError(f"two indenters of a step are named '{body.name}'; give each a name of its own")
        self._step.bodies.append(body)

    # ------------------------------------------------------------------------------- steps

    def build(self, step: Step) -> LoadStep:
        """The load step of the next step of the model."""
        start = self._begun = self._asked.copy()
        asked = self._asked
        self._number += 1
        self._supports.change(step, asked.displaced)
        start.displaced = {key: self._supports.now(key, value) for key, value in asked.displaced.items()}
        if self._number == 1:
            asked.rest = self._rest_of_laws.copy()
            asked.rest_ends = np.repeat(asked.rest, 2).reshape(-1, 2)
        self._step = now = StepInHand.after(asked)
        start.prescribed[asked.pinched] = np.nan  # it begins where it is
        for item in step.actuations:
            if not item.late:
                item.apply(self)
        now.angles = asked.angles()
        for item in step.actuations:
            if item.late:
                item.apply(self)
        freed = now.released & (asked.curve >= 0)  # they go on from where their own law is
        start.rest[now.released & ~freed] = start.rest_ends[now.released & ~freed] = np.nan
        end = asked.copy()
        return LoadStep(
            law=end.law,
            stiffness=end.stiffness,
            rest=Ramp(start.rest, end.rest),
            rest_ends=Ramp(start.rest_ends, end.rest_ends),
            prescribed=Ramp(start.prescribed, end.prescribed),
            pinch=now.pinch,
            moment=Ramp(start.moment, end.moment),
            force=Ramp(start.dead, end.dead),
            constraints=self._constraints(start, bool(now.bodies), bool(step.release)),
            bodies=tuple(now.bodies),
            releases=bool(step.release),
            curve=end.curve if self._laws else None,
            laws=tuple(self._laws),
            freed=freed if freed.any() else None,
            pressure=_some(start.pressed, end.pressed),
            edge_couple=_some(start.turned, end.turned),
            ground=self._ground,
            growth=_from_none(start.growth, end.growth),
            changed=_from_none(start.changed, end.changed),
        )

    def ended(self, points: Array) -> None:
        """Tell where the nodes are when the next step begins, (n, 3), mm: what lies there is held there.

        Args:
            points: positions at the end of the step that was built last.
        """
        self._supports.points = points

    def end_early(self, step: LoadStep, end: StepEnd) -> None:
        """Let the next step begin where `step` ended before it was complete.

        Args:
            step: that ended early.
            end: where it ended.

        Raises:
            ModelError: a prescribed crease was released in it, whose rest angle is not known on the way.
        """
        asked = self._asked
        asked.rest, asked.rest_ends, asked.moment, force = (
            ramp.at(end.lam) for ramp in (step.rest, step.rest_ends, step.moment, step.force)
        )
        for what, there in asked.borne.items():
            asked.borne[what] = Ramp(self._begun.borne.get(what, np.zeros_like(there)), there).at(end.lam)
        asked.force = force - sum(asked.borne.values(), np.zeros_like(force))
        asked.pressed = Ramp(self._begun.pressed, asked.pressed).at(end.lam)
        asked.turned = Ramp(self._begun.turned, asked.turned).at(end.lam)
        asked.growth = None if step.growth is None else step.growth.at(end.lam)
        asked.changed = None if step.changed is None else step.changed.at(end.lam)
        if np.isnan(asked.rest).any() or step.freed is not None:
            raise ModelError(
                "a prescribed crease is released in a step that ends early (until); release it in a step before"
            )
        asked.prescribed = np.where(asked.law == PRESCRIBED, end.dihedral_angles, np.nan)
        moved = end.points - self.mesh.points
        asked.displaced = {(node, axis): float(moved[node] @ axis) for node, axis in asked.displaced}

    # ------------------------------------------------------------------------------- its own

    def _hinges(self, crease: str) -> Ints:
        """Rows of `mesh.topology.hinges` along a crease, in order."""
        found = edge_hinges(self.mesh, crease)
        if (found < 0).any():
            raise ModelError(
                f"crease '{crease}' runs along the boundary, where nothing can fold; draw it inside"
            )
        return found

    def _turn(self, hinges: Ints, angle: Array) -> None:
        """A crease that is folded is pinched no more."""
        self._once(0, hinges, angle, "rad")
        self._step.folded[hinges], self._asked.pinched[hinges] = True, False
        self._step.pinch.toward[hinges] = np.nan

    def _once(self, kind: int, hinges: Ints, value: Array, unit: str) -> None:
        """Refuse two different values for one crease in one step."""
        value = np.broadcast_to(value, hinges.shape)
        known = self._step.given[kind, hinges]
        other = ~np.isnan(known) & ~np.isclose(known, value, rtol=1e-12, atol=0.0)
        if other.any():
            row = int(np.argmax(other))
            raise ModelError(
                f"{hinge_name(self.mesh, int(hinges[row]))} is given {known[row]:g} and {value[row]:g} {unit} in one "
                f"step ({self._number}); give it one, or the second in a step of its own"
            )
        self._step.given[kind, hinges] = value

    def _partly(self, hinges: Ints, angle: Array, zone: Zone) -> Array:
        """(k,) angles a part of the way to `angle`, rad, which no other zone may want otherwise."""
        now = self._step.angles[hinges]
        wanted = np.asarray(now + zone.part * (angle - now))
        self._claim(hinges, wanted, zone)
        return wanted

    def _claim(self, hinges: Ints, wanted: Array, zone: Zone) -> None:
        """Refuse zones that overlap and ask for different things."""
        for row, value in zip(hinges.tolist(), wanted.tolist(), strict=True):
            known, other = self._step.zones.setdefault(row, (value, zone.at))
            if abs(known - value) > OVERLAP:
                raise ModelError(
                    f"two pinches of crease '{zone.crease}' overlap and contradict each other (at {other:g} and "
                    f"{zone.at:g}); keep their zones apart, or pinch one after the other"
                )

    def _constraints(self, start: Asked, in_contact: bool, releases: bool) -> Constraints:
        # a node that begins to be displaced in a later step begins where it is
        moves = []
        for (node, direction), end in self._asked.displaced.items():
            first = self._supports.displacement(node, direction)
            begin = start.displaced.get((node, direction), first)
            by, further = self._step.moved.get((node, direction), (0.0, False))
            moves.append(Prescribed(np.array([node]), direction, begin, end, by if further else 0.0))
        supports = self._supports
        try:
            carried = in_contact or self._ground is not None
            found = resolve(self.mesh, supports.flat, moves, carried, supports.lying)
            if self._ground is not None and not in_contact:
                check_held(self.mesh, found, self._ground > 0.0, supports.lying)
            if releases and found.rigid_body and supports.points is not None and self._number > 1:
                # the forces that let go would turn a free sheet while they fade: it is held at six places meanwhile
                if self._asked.force.any():
                    raise NotHeldError(
                        "nothing holds the sheet any more while forces act; let them go to zero in a step before"
                    )
                stay = supports.lying
                assert stay is not None
                stay = replace(stay, supports=(*stay.supports, *isostatic(found, supports.points)))
                found = replace(resolve(self.mesh, supports.flat, moves, lying=stay), rigid_body=False)
        except NotHeldError as error:
            if self._supports.points is None or self._number == 1:
                raise
            raise NotHeldError(f"where step {self._number} begins, {error}") from None
        self._supports.points = None  # until the end of this step is told
        return found


def _some(start: Array, end: Array) -> Ramp | None:
    """A ramp, or None where there is nothing at either end."""
    return Ramp(start, end) if start.any() or end.any() else None


def _from_none(start: Array | None, end: Array | None) -> Ramp | None:
    """A ramp from nothing where nothing was asked for before; None where nothing is."""
    return None if end is None else Ramp(np.zeros_like(end) if start is None else start, end)


def load_steps(model: Model, ends: Mapping[int, StepEnd] | None = None) -> tuple[LoadStep, ...]:
    """The load steps of a model, in order; nothing is solved.

    Args:
        model: what is described.
        ends: where steps ended, by their index: those that ended early, and the last one where supports change. What
            is held as it lies is nan in constraints of a step before which it is not known.

    Returns:
        one load step for each step.

    Raises:
        ModelError, MeshError: an actuation or support that the sheet cannot take; the message names it.
    """
    builder = LoadStepBuilder(model)
    found = []
    for number, step in enumerate(model.steps):
        found.append(builder.build(step))
        if ends is not None and number in ends:
            if ends[number].lam < 1.0:
                builder.end_early(found[-1], ends[number])
            builder.ended(ends[number].points)
    return tuple(found)
