"""A mirror-symmetric model solved by one half: systems of the half, and unknowns from the one to the other and back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from bh.errors import ModelError
from bh.formulations.registry import formulation as registered
from bh.formulations.registry import names
from bh.formulations.state import State
from bh.loading.load_step import Ended, StepProgram
from bh.loading.program import program
from bh.loading.symmetry import Mirror, Plane, check, halved, mirror
from bh.model.model import Model
from bh.solvers.modes import count_negative

R = TypeVar("R")


@dataclass(frozen=True)
class Half:
    """One step: `system` of the half, `sheet` of the whole."""

    formulation: Any
    plane: Mirror
    system: Any
    sheet: Any

    def unknowns(self, q: Any, lam: float) -> Any:
        """Unknowns of the whole sheet."""
        return self.formulation.whole(self.sheet, self.system, self.plane, q, lam)

    def whole(self, record: R) -> R:
        """A record of the half as one of the whole sheet; all that it knows of stability is where the half has none."""
        at: Any = record
        points = tuple(
            replace(c, q=self.unknowns(c.q, c.lam), mode=self.sheet.loads(self.system.vectors(c.mode)))
            for c in at.critical
        )
        return replace(at, q=self.unknowns(at.q, at.lam), negative=at.negative or None, critical=points)

    def part(self, record: R) -> R:
        """A record of the whole sheet as one of the half."""
        at: Any = record
        return replace(at, q=self.formulation.part(self.sheet, self.system, self.plane, at.q, at.lam))


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
        self._half = halved(model, self.plane, any(step.constraints.rigid_body for step in steps))
        self._found: dict[int, Half] = {}

    def of(self, step: int, sheet: Any, start: State | None, ended: Mapping[int, Ended]) -> Half:
        """The half of a step that begins at a state of the whole sheet, whose system is `sheet`."""
        if step not in self._found:
            ramps = program(self._half, ended)[step]
            system = self.formulation.half(self.model, ramps, start, self.plane)
            self._found[step] = Half(self.formulation, self.plane, system, sheet)
        return self._found[step]

    @staticmethod
    def negative(sheet: Any, record: Any) -> int:
        """Negative modes of the whole sheet, symmetric or not."""
        forces = sheet.evaluate(record.q, record.lam).forces
        return count_negative(sheet.tangent(record.q, record.lam, forces))
