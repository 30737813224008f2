"""Formulation "shell": the nonlinear Kirchhoff-Love shell as `bh` finds it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.state import State
from bh.loading.load_step import StepProgram
from bh.loading.program import program
from bh.model.model import Model, Sheet
from bh.model.refinement import Refinement
from bh.runtime.threads import one_blas_thread
from bh.solvers.continuation import LoadControl
from bh.solvers.increments import Increment, point
from bh.solvers.trace import Strategy, Walk, walk
from fem.loads import EdgeMoments
from fem.observables import ShellState, observe
from fem.shell import ShellElements, shell_elements
from fem.system import ShellSystem
from meshes import SheetMesh
from meshes.curved import LinearMesh, lift

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
        self, model: Model, program: StepProgram, start: State | None, moments: EdgeMoments = FREE
    ) -> ShellSystem:
        """The system of one step that begins at `start` (None: the stress-free sheet).

        Raises:
            ModelError, MeshError: the model is not one that a shell can take.
        """
        if start is not None and not isinstance(start, ShellState):
            raise ModelError(
                f"a step of the shell begins at a state of the shell, not at a {type(start).__name__}"
            )
        return ShellSystem(model, program, start, _elements(model.mesh, model.sheet, self.degree), moments)

    def observe(
        self,
        model: Model,
        system: ShellSystem,
        q: Array,
        lam: float,
        step: int = 0,
        stable: bool | None = None,
    ) -> ShellState:
        """Everything that can be read from the unknowns `q` at `lam`."""
        return observe(model, system, q, lam, step, stable)


class LinearShell(Shell):
    """Formulation "linear-shell": linear displacements, constant moments (HHJ) and strains; the cheap member."""

    name = "linear-shell"
    degree = 1
    refinement = None  # it is the consistent formulation, at a higher price


@lru_cache(maxsize=4)
def _elements(mesh: SheetMesh, sheet: Sheet, degree: int) -> ShellElements:
    """Elements are those of the sheet, whatever the step."""
    return shell_elements(lift(mesh) if degree == 2 else LinearMesh(mesh), sheet)


def follow(
    model: Model,
    moments: Sequence[EdgeMoments] = (),
    strategy: Strategy | None = None,
) -> tuple[list[ShellState], list[Increment]]:
    """Follow a model whose boundary edges are loaded by couples, which `bh.trace` cannot be told.

    Args:
        moments: one a step, or none.

    Returns:
        the state at the beginning and after every accepted increment, and all increments. The last increment's
        outcome is "reached" only if every step was.
    """
    with one_blas_thread():
        return _follow(model, moments, strategy or LoadControl())


def _follow(
    model: Model, moments: Sequence[EdgeMoments], strategy: Strategy
) -> tuple[list[ShellState], list[Increment]]:
    shell = Shell()
    states: list[ShellState] = []
    increments: list[Increment] = []
    programs = program(model)
    for step, ramps in enumerate(programs):
        now = moments[step] if moments else FREE
        system = shell.system(model, ramps, states[-1] if states else None, now)
        begin = point(system, system.start(), 0.0)
        if not states:
            states.append(shell.observe(model, system, begin.q, 0.0))
        for increment in walk(Walk(system, strategy, (begin,))):
            increments.append(increment)
            if increment.outcome != "reached":
                return states, increments
            at = increment.point
            states.append(shell.observe(model, system, at.q, at.lam, step, increment.stable))
    return states, increments
