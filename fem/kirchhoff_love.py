"""Formulation "shell": the nonlinear Kirchhoff-Love shell as `bh` finds it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.remarks import Remark
from bh.formulations.state import State
from bh.loading.builder import load_steps
from bh.loading.load_step import LoadStep
from bh.model.model import Model
from bh.model.refinement import Refinement
from bh.model.sheet import Sheet
from bh.model.zones import SheetZone
from bh.runtime.threads import one_blas_thread
from bh.solvers.load_control import LoadControl
from bh.solvers.outcome import Outcome
from bh.solvers.points import Increment, point
from bh.solvers.walk import Strategy, Walk, walk
from fem.loads import EdgeMoments
from fem.observables import observe
from fem.remarks import straight_edges
from fem.shell import ShellElements, shell_elements
from fem.state import ShellState
from fem.system import ShellSystem
from meshes import SheetMesh
from meshes.curved import LinearMesh, QuadraticMesh, lift

Array = NDArray[np.float64]
FREE = EdgeMoments()


class Shell:
    """Formulation "shell": quadratic displacements, linear moments (HHJ) and membrane strains (Regge)."""

    name = "shell"
    takes_nu = True
    degree = 2
    refinement: Refinement | None = Refinement(
        "mirrored", ((0.5, 0.075), (1.0, 0.027), (2.0, 0.011), (4.0, 0.001)), 40.0, 1.95
    )

    def system(
        self, model: Model, load_step: LoadStep, start: State | None, moments: EdgeMoments = FREE
    ) -> ShellSystem:
        """The system of one step that begins at `start` (None: the stress-free sheet).

        Args:
            model: a flat sheet with its supports and steps.
            load_step: what the step imposes and loads.
            start: the state that the step begins with.
            moments: couples on boundary edges.

        Raises:
            ModelError: the model is not one that a shell can take.
            MeshError: the sheet is not flat, or its mesh too coarse for its curves.
        """
        if start is not None and not isinstance(start, ShellState):
            raise ModelError(
                f"a step of the shell begins at a state of the shell, not at a {type(start).__name__}"
            )
        return ShellSystem(model, load_step, start, self.elements(model), moments)

    def elements(self, model: Model) -> ShellElements:
        """Elements of the sheet, the same for every step.

        Args:
            model: a flat sheet.

        Raises:
            MeshError: the sheet is not flat, or its mesh too coarse for its curves.
        """
        return _elements(model.mesh, model.sheet, model.zones, self.degree)

    def remarks(self, model: Model) -> tuple[Remark, ...]:
        """What to know of the mesh of a model: only whether curved edges have lost their curves."""
        return straight_edges(model) if self.degree == 2 else ()

    def observe(
        self,
        model: Model,
        system: ShellSystem,
        q: Array,
        lam: float,
        step: int = 0,
        stable: bool | None = None,
    ) -> ShellState:
        """Everything that can be read from the unknowns `q` at `lam`.

        Args:
            model: the model that `system` was made from.
            system: of the step.
            q: (size,) unknowns.
            lam: how much of the step is applied, 0 to 1.
            step: number of the step.
            stable: whether the state is stable, None if that was not asked.
        """
        return observe(model, system, q, lam, step, stable)


class LinearShell(Shell):
    """Formulation "linear-shell": linear displacements, constant moments (HHJ) and strains; the cheap member."""

    name = "linear-shell"
    degree = 1
    refinement = None  # it is the consistent formulation, at a higher price


class CurvedShell(Shell):
    """A shell whose stress-free surface is not flat, for `follow`; a model of a scene cannot ask for it."""

    name = "curved-shell"
    refinement = None

    def __init__(self, mesh: QuadraticMesh) -> None:
        """Take the surface.

        Args:
            mesh: see `meshes.curved.lay_on`; a model of it has `mesh.sheet` for its mesh.
        """
        self.mesh = mesh

    def elements(self, model: Model) -> ShellElements:
        """Elements of the surface.

        Args:
            model: of the surface's own sheet, one isotropic material.

        Raises:
            ModelError: of another sheet, or of one with a grain or zones.
        """
        if model.mesh is not self.mesh.sheet:
            raise ModelError(
                "the model is of another mesh than the surface; build it with the surface's `sheet`"
            )
        if model.zones or model.sheet.directed:
            raise ModelError(
                "a curved stress-free surface has one isotropic material; leave grain and zones out"
            )
        return shell_elements(self.mesh, model.sheet)


@lru_cache(maxsize=4)
def _elements(mesh: SheetMesh, sheet: Sheet, zones: tuple[SheetZone, ...], degree: int) -> ShellElements:
    """Elements are those of the sheet, whatever the step."""
    return shell_elements(lift(mesh) if degree == 2 else LinearMesh(mesh), sheet, zones)


def follow(
    model: Model,
    moments: Sequence[EdgeMoments] = (),
    strategy: Strategy | None = None,
    shell: Shell | None = None,
) -> tuple[list[ShellState], list[Increment]]:
    """Follow a model with couples on its boundary edges or a curved surface, which `bh.trace` cannot be told.

    Args:
        model: a flat sheet with its supports and steps.
        moments: one a step, or none.
        strategy: what chooses increments; None for `bh.Automatic`.
        shell: the formulation; None for `Shell`.

    Returns:
        The state at the beginning and after every accepted increment, and all increments. The last
        increment's outcome is "reached" only if every step was.

    Raises:
        ModelError: couples for other steps than the model has, or a model that a shell cannot take.
    """
    with one_blas_thread():
        return _follow(model, moments, strategy or LoadControl(), shell or Shell())


def linear_response(model: Model, shell: Shell | None = None) -> tuple[Array, int]:
    """Displacements of linear theory under the loads of a model's first step.

    Args:
        model: at rest before the step; the step only loads.
        shell: the formulation; None for `Shell`.

    Returns:
        (n, 3) displacements of the corners, mm, and the number of unknowns.

    Raises:
        ModelError, MeshError: as `follow`.
        IndefiniteError: the sheet can move freely.
    """
    with one_blas_thread():
        system = (shell or Shell()).system(model, load_steps(model)[0], None)
        q = system.start()
        tangent = system.tangent(q, 0.0, system.evaluate(q, 0.0).forces)
        dq = tangent.matrix.factorise().solve(-system.control_rate(q, 0.0))
        return system.vectors(dq), len(q)


def _follow(
    model: Model, moments: Sequence[EdgeMoments], strategy: Strategy, shell: Shell
) -> tuple[list[ShellState], list[Increment]]:
    states: list[ShellState] = []
    increments: list[Increment] = []
    steps = load_steps(model)
    for step, load_step in enumerate(steps):
        now = moments[step] if moments else FREE
        system = shell.system(model, load_step, states[-1] if states else None, now)
        begin = point(system, system.start(), 0.0)
        if not states:
            states.append(shell.observe(model, system, begin.q, 0.0))
        for increment in walk(Walk(system, strategy, (begin,))):
            increments.append(increment)
            if increment.outcome != Outcome.REACHED:
                return states, increments
            at = increment.point
            states.append(shell.observe(model, system, at.q, at.lam, step, increment.stable))
    return states, increments
