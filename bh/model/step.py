"""A step of a model: what acts in it, what ends it, and what an actuation can ask for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.sheet import Sheet
from bh.model.supports import Constraint
from bh.model.until import Until
from bh.model.zones import Sections
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Zone:
    """A part of a crease that is asked to go only some of the way.

    Attributes:
        part: (k,) how far each hinge goes, from 0 to 1; of an edge the mean along it.
        ends: (k, 2) the same at the lower and at the higher node of the edge, for formulations whose angles vary
            along an edge.
        crease: name of the crease, and `at` the middle of the zone as a part of its length, for messages.
    """

    part: Array
    ends: Array
    crease: str
    at: float


class StepBuilder(Protocol):
    """What an actuation speaks to: it finds hinges, then says what is asked of them at the end of the step.

    Hinges are rows of `mesh.topology.hinges`, k of them in any order. What nobody asks for stays as it was at the end
    of the step before. Every verb raises `ModelError` with one line where two actuations of a step ask for different
    things in one place. `bh.loading.builder` does it.
    """

    @property
    def mesh(self) -> SheetMesh:
        """The stress-free sheet."""
        ...

    @property
    def sheet(self) -> Sheet:
        """Its material and thickness."""
        ...

    @property
    def sections(self) -> Sections:
        """The same of every triangle, where there are zones."""
        ...

    def creases(self, name: str) -> tuple[Ints, Array, Array]:
        """Hinges of a crease, or of "all" that are drawn as mountain or valley.

        Returns:
            (k,) hinges, in order along a single crease; (k,) the drawn sense, +1 mountain and -1 valley; (k,) the fold
            angles that the pattern gives, rad, nan where it gives none.

        Raises:
            ModelError, MeshError: no such crease, or it runs along the boundary.
        """
        ...

    def angles(self, hinges: Ints) -> Array:
        """(k,) dihedral angles, rad, that the steps so far lead to; a `late` actuation sees those of its own step."""
        ...

    def laws(self, hinges: Ints) -> Ints:
        """(k,) what the hinges are now: SHEET, SPRING or PRESCRIBED of `bh.model.laws`."""
        ...

    def spring(self, hinges: Ints, Lstar: float | None = None, stiffness: float | None = None) -> None:
        """Make hinges an elastic crease in all steps (call it in `prepare`); arguments of `bh.CreaseLaw`.

        Args:
            hinges: (k,) rows of `mesh.topology.hinges`.
            Lstar: mm.
            stiffness: N mm / (mm rad), in place of `Lstar`.
        """
        ...

    def prescribe(self, hinges: Ints, angle: Array, zone: Zone | None = None) -> None:
        """Impose dihedral angles (k,), rad, exactly.

        With a `zone` each hinge goes its part of the way to `angle` from where the step finds it, or from where a fold
        of the same step brings it.

        Args:
            hinges: (k,) rows of `mesh.topology.hinges`.
            angle: (k,) dihedral angles at the end of the step, rad.
            zone: parts of the way; None for all of it.
        """
        ...

    def rest_at(self, hinges: Ints, angle: Array, release: bool = False, zone: Zone | None = None) -> None:
        """Turn the rest angles (k,) of springs, rad; `release` makes springs of prescribed hinges that are some.

        Args:
            hinges: (k,) rows of `mesh.topology.hinges`.
            angle: (k,) rest angles at the end of the step, rad.
            release: make springs of those that are prescribed.
            zone: parts of the way; None for all of it.
        """
        ...

    def couple(self, hinges: Ints, moment: Array, zone: Zone | None = None) -> None:
        """Dead couples (k,) a length, N mm / mm, positive towards smaller dihedral angles.

        Args:
            hinges: (k,) rows of `mesh.topology.hinges`.
            moment: (k,) a length, N mm / mm.
            zone: parts of the moment; None for all of it.
        """
        ...

    def pull(self, nodes: Ints, force: Array) -> None:
        """Dead forces (k, 3) or (3,) on nodes (k,), N, in place of what pulled there.

        Args:
            nodes: (k,) node indices.
            force: (k, 3) or (3,) on each of them, N.
        """
        ...

    def bear(self, force: Array, what: str = "weight") -> None:
        """Dead forces (n, 3) on all nodes beside those of `pull`, N, in place of what was borne by that name before.

        Args:
            force: (n, 3), such as the weight of what belongs to each node.
            what: name of what is borne.
        """
        ...

    def press(self, triangles: Ints, pressure: float) -> None:
        """A pressure on triangles (k,), N / mm^2, along their normals, in place of what pressed there.

        Args:
            triangles: (k,) rows of `mesh.triangles`.
            pressure: at the end of the step.
        """
        ...

    def turn(self, edges: Ints, couple: float) -> None:
        """A dead couple a length on edges of the boundary (k,), N mm / mm, in place of what turned them.

        Args:
            edges: (k,) rows of `mesh.topology.edges`.
            couple: at the end of the step; positive turns the outside towards the upper side.
        """
        ...

    def grow(self, triangles: Ints, strain: Array, curvature: Array, change: float = 0.0) -> None:
        """Strain and curvature at which triangles (k,) are at rest, in place of what was asked for there before.

        Several in one step add up. Values may differ between the corners of a triangle, linear between them.

        Args:
            triangles: (k,) rows of `mesh.triangles`.
            strain: (k, 3) or (k, 3 corners, 3) components xx, yy, 2 xy in the axes of the drawing.
            curvature: likewise, 1 / mm, positive where the edges go up.
            change: of temperature or moisture that is in both, which plies of a laminate feel one by one.
        """
        ...

    def displace(self, nodes: Ints, direction: Sequence[float], by: float, further: bool = False) -> None:
        """Prescribe the displacement of nodes (k,) along a unit vector (3,), mm from the stress-free position.

        Args:
            nodes: (k,) node indices.
            direction: (3,) unit vector.
            by: displacement at the end of the step, mm.
            further: measure it from where each node is when the step begins.
        """
        ...

    def attach(self, body: Body) -> None:
        """Let a body act on the sheet in this step."""
        ...


class Actuation:
    """What acts in a step.

    An actuation of your own derives from it and is a frozen dataclass of plain values (docs/extending.md).
    """

    late: ClassVar[bool] = False  # applied after the others of its step, from where they lead

    @property
    def looks_back(self) -> bool:
        """Does what it asks for depend on where nodes are when the step begins?"""
        return False

    def prepare(self, builder: StepBuilder) -> None:
        """Ask for springs that must be there before the first step."""

    def apply(self, builder: StepBuilder) -> None:
        """Ask for what is wanted at the end of the step.

        Raises:
            ModelError: the sheet cannot take it; one line.
        """
        raise NotImplementedError


class Body(Actuation):
    """An actuation that is a body of its own, which acts on the sheet during the step that names it."""

    def apply(self, builder: StepBuilder) -> None:
        """Be there."""
        builder.attach(self)


@dataclass(frozen=True)
class Step:
    """Actuations that act together while lambda runs from 0 to 1, and supports that change when it begins.

    Attributes:
        actuations: at least one, unless supports change.
        until: ends the step before they are complete, where an observable has a value; or None.
        support: supports that come in and stay; they hold nodes, and slopes of clamps, where the step finds them.
        release: what is let go of, before `support` comes in: places of supports or of prescribed displacements, or
            supports themselves. The forces that it carried go to zero while lambda runs from 0 to 1.
    """

    actuations: tuple[Actuation, ...] = ()
    until: Until | None = None
    support: tuple[Constraint, ...] = ()
    release: tuple[str | Sequence[int] | Constraint, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what is no step.

        Raises:
            ModelError: nothing happens in it, or something that is no actuation or support; one line.
        """
        if not (self.actuations or self.changes_supports):
            raise ModelError(
                "a step needs at least one actuation (fold, pinch, moment, force or displace), or supports that change"
            )
        for each in self.support:
            if not isinstance(each, Constraint):
                raise ModelError(f"a step takes supports such as bh.Support, not a {type(each).__name__}")
        if self.release and self.until is not None:
            raise ModelError(
                "a step that releases supports has to be complete; let a step of its own end early"
            )
        for item in self.actuations:
            if isinstance(item, Until):
                raise ModelError("what ends a step is no actuation; give it by name: step(..., until=...)")
            if not isinstance(item, Actuation):
                raise ModelError(
                    f"a step takes actuations, not a {type(item).__name__}; derive it from bh.Actuation"
                )

    @property
    def changes_supports(self) -> bool:
        """Do supports come in, or go?"""
        return bool(self.support or self.release)

    @property
    def looks_back(self) -> bool:
        """Does what it is depend on the state that it begins with, beyond what steps before have asked for?"""
        return self.changes_supports or any(item.looks_back for item in self.actuations)
