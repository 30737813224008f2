"""A mirror-symmetric model solved by one half: systems of the half, and unknowns from the one to the other and back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.protocols import Formulation, Mirrored, SheetSystem
from bh.formulations.registry import able
from bh.formulations.state import State
from bh.loading.builder import load_steps
from bh.loading.load_step import LoadStep, StepEnd
from bh.loading.symmetry import Mirror, Plane, check, halved, mirror
from bh.model.model import Model
from bh.solvers.modes import count_negative
from bh.solvers.system import hessian

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Half:
    """One step: `system` of the half, `sheet` of the whole, both made by the formulation."""

    formulation: Mirrored[SheetSystem]
    plane: Mirror
    system: SheetSystem
    sheet: SheetSystem

    def unknowns(self, q: Array, lam: float) -> Array:
        """Unknowns (sheet.size,) of the whole sheet from those of the half, q (system.size,).

        Args:
            q: (system.size,) unknowns of the half.
            lam: load parameter of the step, 0 to 1.

        Returns:
            (sheet.size,) unknowns of the whole.
        """
        return self.formulation.whole(self.sheet, self.system, self.plane, q, lam)

    def part(self, q: Array, lam: float) -> Array:
        """Unknowns (system.size,) of the half from those of the whole sheet, q (sheet.size,).

        Args:
            q: (sheet.size,) unknowns of the whole.
            lam: load parameter of the step, 0 to 1.

        Returns:
            (system.size,) unknowns of the half.
        """
        return self.formulation.part(self.sheet, self.system, self.plane, q, lam)

    def mode(self, mode: Array) -> Array:
        """A mode (system.size,) of the half as one of the whole sheet (sheet.size,), by what the nodes do in it.

        Returns:
            (sheet.size,) mode of the whole.
        """
        return self.sheet.loads(self.system.vectors(mode))


class Halves:
    """The halves of all steps of a model."""

    def __init__(
        self, formulation: Formulation[SheetSystem], model: Model, steps: Sequence[LoadStep], plane: Plane
    ) -> None:
        """See that everything is symmetric.

        Args:
            formulation: of the model.
            model: the whole sheet.
            steps: its load steps.
            plane: "x", "y" or a normal; see `bh.loading.symmetry.mirror`.

        Raises:
            ModelError: the formulation takes no plane of symmetry, or something is not symmetric; one line names it.
        """
        if not isinstance(formulation, Mirrored):
            others = ", ".join(able(lambda other: isinstance(other, Mirrored)))
            raise ModelError(
                f"formulation '{formulation.name}' cannot be solved by halves; take one of: {others}"
            )
        self.formulation: Mirrored[SheetSystem] = formulation
        self.model = model
        self.plane = mirror(model.mesh, plane)
        check(model, steps, self.plane)
        self._half = halved(model, self.plane, any(step.constraints.rigid_body for step in steps))
        self._found: dict[int, Half] = {}

    def of(self, step: int, sheet: SheetSystem, start: State | None, ends: Mapping[int, StepEnd]) -> Half:
        """The half of a step.

        Args:
            step: its index, from 0.
            sheet: the system of the whole sheet in that step.
            start: the state of the whole sheet that it begins at; None for the stress-free one.
            ends: where earlier steps ended before they were complete.
        """
        if step not in self._found:
            load_step = load_steps(self._half, ends)[step]
            system = self.formulation.half(self.model, load_step, start, self.plane)
            self._found[step] = Half(self.formulation, self.plane, system, sheet)
        return self._found[step]

    @staticmethod
    def negative(sheet: SheetSystem, q: Array, lam: float) -> int:
        """Number of negative modes of the whole sheet at unknowns q (sheet.size,), symmetric modes or not.

        Args:
            sheet: system of the whole.
            q: (sheet.size,) unknowns of the whole.
            lam: load parameter of the step, 0 to 1.
        """
        return count_negative(hessian(sheet, q, lam))
