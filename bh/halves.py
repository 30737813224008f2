"""A mirror-symmetric model solved by one half: systems of the half, and unknowns from the one to the other and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar

from bh.errors import ModelError
from bh.formulations import formulation as registered
from bh.formulations import names
from bh.model import Model
from bh.program import StepProgram, program
from bh.solvers.modes import count_negative
from bh.state import State
from bh.symmetry import Plane, check, halved, mirror

R = TypeVar("R")


class Halves:
    """The halves of all steps of a model.

    Raises:
        ModelError: the formulation cannot be solved by halves, or something is not symmetric; one line names it.
    """

    def __init__(self, formulation: Any, model: Model, steps: Sequence[StepProgram], plane: Plane) -> None:
        if not hasattr(formulation, "half"):
            able = ", ".join(name for name in names() if hasattr(registered(name), "half"))
            raise ModelError(
                f"formulation '{formulation.name}' cannot be solved by halves; take one of: {able}"
            )
        self.formulation, self.model = formulation, model
        self.plane = mirror(model.mesh, plane)
        check(model, steps, self.plane)
        free = any(step.constraints.rigid_body for step in steps)
        self._programs = program(halved(model, self.plane, free))
        self._systems: dict[int, Any] = {}

    def system(self, step: int, start: State | None) -> Any:
        """The half's system of a step that begins at a state of the whole sheet."""
        if step not in self._systems:
            self._systems[step] = self.formulation.half(self.model, self._programs[step], start, self.plane)
        return self._systems[step]

    def whole(self, step: int, whole: Any, record: R) -> R:
        """A record of the half as one of the whole sheet; all that it knows of stability is where the half has none."""
        half, at = self._systems[step], record
        q = self.formulation.whole(whole, half, self.plane, at.q, at.lam)  # type: ignore[attr-defined]
        points = tuple(
            replace(
                c,
                q=self.formulation.whole(whole, half, self.plane, c.q, c.lam),
                mode=whole.loads(half.vectors(c.mode)),
            )
            for c in at.critical  # type: ignore[attr-defined]
        )
        negative = at.negative or None  # type: ignore[attr-defined]
        return replace(at, q=q, negative=negative, critical=points)  # type: ignore[type-var]

    @staticmethod
    def negative(whole: Any, record: Any) -> int:
        """Negative modes of the whole sheet, symmetric or not."""
        forces = whole.evaluate(record.q, record.lam).forces
        return count_negative(whole.tangent(record.q, record.lam, forces))

    def part(self, step: int, whole: Any, record: R) -> R:
        """The unknowns of the half from a record of the whole sheet."""
        q = self.formulation.part(whole, self._systems[step], self.plane, record.q, record.lam)  # type: ignore[attr-defined]
        return replace(record, q=q)  # type: ignore[type-var]
