"""What a formulation and its systems have to offer, and what they may: all that a new one is written against.

`Formulation` and `SheetSystem` are required. The abilities below them (`Mirrored`, `Differentiable`, `Refinable`,
`NodalUnknowns`) are optional: who needs one asks for it by `isinstance`. No class has to inherit from any of these; a
class that has the members is one of them. All lengths are in mm, forces in N, angles in rad and energies in N mm.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from bh.formulations.remarks import Remark
from bh.formulations.state import State
from bh.loading.load_step import LoadStep
from bh.model.constraints import Constraints
from bh.model.model import Model
from bh.solvers.system import System
from meshes.topology import Ints

if TYPE_CHECKING:
    from bh.loading.symmetry import Mirror
    from bh.model.refinement import Refinement

Array = NDArray[np.float64]
Data = dict[str, Array]


# ---------------------------------------------------------------------------------------------- systems


class SheetSystem(System, Protocol):
    """The system of one step of a sheet: what the driver asks, and what paths and analyses ask besides.

    Unknowns q are (n,) with n = `size`, lambda runs from 0 to 1 in the step. Nodes are those of the mesh of the model.
    """

    @property
    def constraints(self) -> Constraints:
        """Supports and prescribed displacements of the step; of a formulation with more nodes those of all of them."""
        ...

    def start(self) -> Array:
        """(n,) unknowns of the state that the step begins with, at lambda = 0."""
        ...

    def positions(self, q: Array, lam: float) -> Array:
        """(nodes, 3) positions of the nodes, mm.

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        ...

    def vectors(self, dq: Array) -> Array:
        """(nodes, 3) changes of the positions, mm, for changes dq (n,) of the unknowns; linear, the same for all q."""
        ...

    def loads(self, forces: Array) -> Array:
        """(n,) work of nodal forces (nodes, 3), N, on the unknowns: the transpose of `vectors`."""
        ...


@runtime_checkable
class NodalUnknowns(Protocol):
    """Ability of a system: its unknowns begin with displacements of the nodes of the mesh, and of no other nodes."""

    @property
    def moving(self) -> int:
        """How many these are: the free components of displacements, along orthonormal axes of each node, mm."""
        ...


@runtime_checkable
class PlacedSystem(Protocol):
    """Ability of a system: it has unknowns for any positions of the nodes, such as those of another mesh's state."""

    def unknowns_at(self, x: Array, lam: float) -> Array:
        """Unknowns of positions, as far as supports allow, all others those of least energy.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.

        Returns:
            (n,) unknowns.
        """
        ...


S = TypeVar("S", bound=SheetSystem)


# ---------------------------------------------------------------------------------------------- formulations


class Formulation(Protocol[S]):
    """Turns a description into the system of a step, and reads states from its unknowns; S are its systems."""

    @property
    def name(self) -> str:
        """How a model names it: that of its entry point in the group "bh.formulations", or "module:Class"."""
        ...

    @property
    def takes_nu(self) -> bool:
        """Whether it uses Poisson's ratio of the sheet."""
        ...

    def system(self, model: Model, load_step: LoadStep, start: State | None) -> S:
        """The system of one step.

        Args:
            model: the sheet and all its steps.
            load_step: what is prescribed in this one.
            start: the state that it begins at; None for the stress-free sheet.

        Raises:
            ModelError: it cannot take the model; one line says what, and what to do instead.
        """
        ...

    def observe(
        self, model: Model, system: S, q: Array, lam: float, step: int = 0, stable: bool | None = None
    ) -> State:
        """Everything that can be read from unknowns q (n,) of one of its systems at lambda.

        Args:
            model: that the system was made of.
            system: one that `system` has made.
            q: (n,) unknowns.
            lam: control parameter of the step.
            step: index of the step, from 0.
            stable: what is known of the state's stability; it is handed on.
        """
        ...

    def remarks(self, model: Model) -> tuple[Remark, ...]:
        """What a user should know of the mesh and the loads of a model with it, before anything is solved.

        Args:
            model: sheet, supports and steps.

        Returns:
            one remark each, empty where there is nothing to say.
        """
        ...


@runtime_checkable
class Mirrored(Formulation[S], Protocol[S]):
    """Ability of a formulation: a mirror-symmetric sheet is solved by one half of it."""

    def half(self, model: Model, load_step: LoadStep, start: State | None, plane: Mirror) -> S:
        """The system of the kept half; the model, the step and the state that it begins at are those of the whole.

        Args:
            model: of the whole sheet.
            load_step: of the whole sheet.
            start: of the whole sheet, where the step begins; None where it begins flat.
            plane: of the mirror.
        """
        ...

    def whole(self, whole: S, half: S, plane: Mirror, q: Array, lam: float) -> Array:
        """Unknowns (`whole.size`,) of the whole sheet from those of its half, q (`half.size`,).

        Args:
            whole: system of the whole sheet.
            half: system of its kept half.
            plane: of the mirror.
            q: (half.size,) unknowns of the half.
            lam: load parameter of the step, 0 to 1.

        Returns:
            (whole.size,) unknowns of the whole.
        """
        ...

    def part(self, whole: S, half: S, plane: Mirror, q: Array, lam: float) -> Array:
        """Unknowns (`half.size`,) of the half from those of the whole sheet, q (`whole.size`,).

        Args:
            whole: system of the whole sheet.
            half: system of its kept half.
            plane: of the mirror.
            q: (whole.size,) unknowns of the whole.
            lam: load parameter of the step, 0 to 1.

        Returns:
            (half.size,) unknowns of the half.
        """
        ...


@runtime_checkable
class Differentiable(Formulation[S], Protocol[S]):
    """Ability of a formulation: exact derivatives of its systems by their element data, for sensitivities."""

    def derivatives(self, system: S, q: Array, lam: float) -> Derivatives:
        """Derivatives at unknowns q (n,) of one of its systems.

        Args:
            system: one of the formulation's own.
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.

        Raises:
            ModelError: this system has none.
        """
        ...


@runtime_checkable
class Refinable(Formulation[S], Protocol[S]):
    """Ability of a formulation: it says on which meshes it converges, so that a wanted accuracy can be met."""

    @property
    def refinement(self) -> Refinement | None:
        """The meshes, and the errors measured on them; None for a member of a family that another one stands for."""
        ...


# ---------------------------------------------------------------------------------------------- derivatives


class Derivatives(Protocol):
    """How a system depends on its element data at one state: what its stiffness, lengths and angles do.

    Data are arrays by name (stress-free lengths, stiffnesses, rest angles, loads, places of supports, ...), of the
    formulation's own choice; "places" (nodes, 3) are positions along supports. A direction of the unknowns is given by
    velocities v (nodes, 3) of the nodes and w (n - `moving`,) of the other unknowns.
    """

    @property
    def moving(self) -> int:
        """Number of displacements that the unknowns begin with (`NodalUnknowns`)."""
        ...

    @property
    def unfollowed(self) -> Mapping[str, str]:
        """Data by whose change no derivative is known, and what to tell a user whose design changes them."""
        ...

    def data(self) -> Data:
        """The element data themselves."""
        ...

    def support(self) -> dict[str, Ints]:
        """For every entry of the data that depends on the flat mesh the nodes (..., k) that it depends on, then -1.

        Returns:
            by name of the data, (..., k) nodes, filled up with -1.
        """
        ...

    def imposed(self, by_data: Data) -> Array:
        """(hinges of the mesh,) derivatives by imposed dihedral angles, from those by the data; zero elsewhere.

        Returns:
            (hinges of the mesh,) derivatives, a rad.
        """
        ...

    def energy_gradient(self, kinds: tuple[str, ...]) -> tuple[Array, Array]:
        """Gradients of some kinds of `State.energy` by the positions (nodes, 3), N, and by the other unknowns."""
        ...

    def angle_gradient(self, hinges: Ints, weights: Array) -> tuple[Array, Array, Data]:
        """Gradients of the weighted sum of `State.dihedral_angles` of hinges: positions, other unknowns, data.

        Args:
            hinges: (k,) rows of `mesh.topology.hinges`.
            weights: (k,) of their angles.

        Returns:
            (nodes, 3) by the positions, rad / mm; (n,) by the other unknowns; and by the data.
        """
        ...

    def second_variation(self, v: Array, w: Array) -> tuple[Array, Array]:
        """Rates along (v, w) of the energy's gradients by all positions (nodes, 3) and by the other unknowns.

        Args:
            v: (nodes, 3) rates of the positions.
            w: rates of the other unknowns, of their shape.
        """
        ...

    def residual_to_data(self, v: Array, w: Array) -> Data:
        """Derivatives of residual . (v, w) by the data, at fixed positions and other unknowns.

        Args:
            v: (nodes, 3) rates of the positions.
            w: rates of the other unknowns, of their shape.
        """
        ...

    def energy_to_data(self, kinds: tuple[str, ...]) -> Data:
        """Derivatives of some kinds of `State.energy` by the data, at fixed positions and other unknowns."""
        ...

    def second_to_data(self, v: Array, w: Array) -> Data:
        """Derivatives of the second variation (v, w) . K (v, w) by the data, at fixed positions and other unknowns.

        Args:
            v: (nodes, 3) rates of the positions.
            w: rates of the other unknowns, of their shape.
        """
        ...


@runtime_checkable
class Stopping(Protocol):
    """Ability of a sheet's system: it knows which panels stop each other."""

    def meetings(self, x: Array) -> str:
        """Which parts of the sheet meet or lie too near at positions x (n, 3), in words; empty where it is clear.

        Args:
            x: (nodes, 3) positions, mm.
        """
        ...
