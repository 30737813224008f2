"""A solved state with its factorised tangent: what observables and their sensitivities are read from."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.protocols import Derivatives, Differentiable, SheetSystem
from bh.formulations.registry import able, formulation
from bh.formulations.state import State
from bh.loading.builder import load_steps
from bh.paths.path import Path
from bh.solvers.factor import Factor, IndefiniteError
from bh.solvers.matrices import FreeBodyMatrix, Matrix
from bh.solvers.saddle import MultiplierMatrix

Array = NDArray[np.float64]
UNBALANCED = 1e-8  # part of an observable's gradient along motions that are free
REFINED = 2


class Situation:
    """A solved state with its factorised tangent: what observables are read from."""

    def __init__(self, path: Path, index: int) -> None:
        """Factorise the tangent of a state.

        Args:
            path: solved.
            index: of the state, at the end of a step (in the first step any).

        Raises:
            ModelError: the state or its formulation has no sensitivities; one line says why.
        """
        self.path, self.model = path, path.model
        self.system, record = path.solved(index)
        form = formulation(path.model.formulation)
        if not isinstance(form, Differentiable):
            others = " or ".join(able(lambda other: isinstance(other, Differentiable)))
            raise ModelError(f"formulation '{path.model.formulation}' has no sensitivities; use {others}")
        self.formulation: Differentiable[SheetSystem] = form
        if record.step > 0 and record.lam != 1.0:
            raise ModelError(
                f"the state at lambda {record.lam:.4g} of step {record.step + 1} depends on the step before; "
                "take its end"
            )
        if any(step.until is not None for step in path.model.steps[: record.step + 1]):
            raise ModelError(
                "a step that ends where an observable has a value has no sensitivities; give it its end"
            )
        if any(step.looks_back for step in path.model.steps[: record.step + 1]):
            raise ModelError(
                "supports that change, or move further from where they are, have no sensitivities; give displacements "
                "from the stress-free sheet"
            )
        if load_steps(path.model)[record.step].bodies:
            raise ModelError("sheets that bars press on have no sensitivities; leave the bars out")
        self.step, self.q, self.lam = record.step, record.q, record.lam
        self.state: State = path[index]
        before = [i for i, other in enumerate(path.records) if other.step < record.step]
        self._before = before[-1] if before else None
        self.start: State | None = None if self._before is None else path[self._before]
        forces = self.system.evaluate(self.q, self.lam).forces
        self.matrix: Matrix = self.system.tangent(self.q, self.lam, forces).matrix
        try:
            self._factor: Factor = self.matrix.factorise_any()[0]
        except IndefiniteError:
            raise ModelError(
                "the tangent of this state is singular: it has no sensitivities; add supports"
            ) from None
        inner = self.matrix.augmented if isinstance(self.matrix, MultiplierMatrix) else self.matrix
        self._rigid = np.zeros((len(self.q), 0))
        if isinstance(inner, FreeBodyMatrix):
            self._rigid = np.zeros((len(self.q), inner.Z.shape[1]))
            self._rigid[: len(inner.Z)] = inner.Z

    @cached_property
    def previous(self) -> Situation:
        """The last state of the step before."""
        assert self._before is not None
        return Situation(self.path, self._before)

    @cached_property
    def derivatives(self) -> Derivatives:
        """Exact derivatives of the system at this state."""
        return self.formulation.derivatives(self.system, self.q, self.lam)

    @property
    def moving(self) -> int:
        """Number of displacements that the unknowns begin with."""
        return self.derivatives.moving

    def solve(self, load: Array, value: float = 0.0) -> Array:
        """Response (size,) of the unknowns to a load, the slope of an observable of that value.

        Args:
            load: (size,) slope of an observable, in its unit a unit of the unknowns.
            value: of the observable, in its unit.

        Raises:
            ModelError: a free sheet would be moved as a rigid body.
        """
        along = self._rigid.T @ load
        size = max(float(np.linalg.norm(load)), abs(value) / self.model.mesh.size)
        if np.linalg.norm(along) > UNBALANCED * size:
            raise ModelError(
                "this observable changes when the sheet moves as a rigid body, which nothing prevents; give the model "
                "supports, or observe something else"
            )
        load = load - self._rigid @ along
        x = self._factor.solve(load)
        for _ in range(REFINED):
            x = x + self._factor.solve(load - self.matrix @ x)
        return np.asarray(x - self._rigid @ (self._rigid.T @ x))

    def load(self, points: Array, other: Array) -> Array:
        """(size,) derivatives to the unknowns from those to all positions and to the other unknowns.

        Args:
            points: (nodes, 3) derivatives to all positions.
            other: derivatives to the other unknowns.
        """
        out = np.array(self.system.loads(points))
        out[self.moving :] += other
        return out
