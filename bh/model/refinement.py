"""A model at another density: the same pattern, supports and steps on another mesh and by another formulation.

A scene names places and not nodes, so it goes over to any mesh of its pattern; so does a model that was made by hand of
`meshes.structured(pattern, ...)` or `meshes.unstructured`, whose mesh knows its pattern.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bh.errors import ModelError
from bh.model.actuations import Fold, Force, Indenter
from bh.model.growth import Expand
from bh.model.model import Model
from bh.model.mould import Mould
from bh.model.supports import Support, select
from meshes import CreasePattern, SheetMesh
from meshes.cells import Kind
from meshes.choices import choices, cut

GOALS = ("energy", "tip", "stiffness")
LEAST, MOST = 1e-4, 0.5  # accuracies that can be asked for
DEFAULT = 0.05  # of the energy, where neither a mesh nor an accuracy is given
MOST_TRIANGLES = 40_000


@dataclass(frozen=True)
class Goal:
    """What is to be how accurate.

    Attributes:
        within: relative error, 0.02 is 2 %.
        of: "energy" (elastic, total), "tip" (displacement of a place, as a part of itself) or "stiffness" (of a place
            against a force in a direction).
        at: the place of a tip or a stiffness.
        direction: of the force on it; three numbers.
        most_triangles: no finer mesh is made.
        seconds: no mesh is begun that is likely to take longer than is left of them; None for no limit. Counted by
            work (unknowns times iterations, 5.5e-6 s each), not by the clock: the same mesh is chosen everywhere.
    """

    within: float
    of: str = "energy"
    at: str | None = None
    direction: tuple[float, float, float] | None = None
    most_triangles: int = MOST_TRIANGLES
    seconds: float | None = None

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        ok = isinstance(self.within, float | int) and not isinstance(self.within, bool)
        if not (ok and LEAST <= self.within <= MOST):
            raise ModelError(
                f"accuracy = {self.within!r} cannot be; give a relative error from {LEAST:g} to {MOST:g} (0.02 is 2 %)"
            )
        if self.of not in GOALS:
            raise ModelError(f"accuracy of '{self.of}' is not known; use one of {', '.join(GOALS)}")
        if self.of != "energy" and not isinstance(self.at, str):
            raise ModelError(f'accuracy of the {self.of} needs a place: at = "corner:outer-end", for example')
        if self.of == "energy" and self.at is not None:
            raise ModelError(
                'accuracy of the energy has no place; remove at, or say of = "tip" or "stiffness"'
            )
        if (self.of == "stiffness") != (self.direction is not None):
            raise ModelError(
                "a direction [x, y, z] goes with the accuracy of a stiffness, and with nothing else"
            )
        if self.most_triangles < 1:
            raise ModelError(f"most_triangles = {self.most_triangles} cannot be; use a whole number from 1")
        if self.seconds is not None and not self.seconds > 0.0:
            raise ModelError(f"seconds = {self.seconds} cannot be; use a positive time in s, or leave it out")


@dataclass(frozen=True)
class Refinement:
    """Meshes on which a formulation converges, and what `bh verify speed_error` has measured there.

    Levels are those of `meshes.choices.choices`, powers of two.

    Attributes:
        kind: the mesh pattern.
        errors: (level, error) with the larger of the errors of energy and stiffness that folded sheets had there, of
            rising levels.
        cost: time of level 1, ms; only the ratio of two formulations matters.
        power: how the time grows with the level, time ~ level^power.
    """

    kind: Kind
    errors: tuple[tuple[float, float], ...]
    cost: float
    power: float

    def level(self, error: float) -> float:
        """The level that is likely to keep an error, but not below the third; finer than measured at second order."""
        for level, measured in self.errors[2:]:
            if measured <= error:
                return level
        last, measured = self.errors[-1]
        return float(last * 2.0 ** math.ceil(0.5 * math.log2(measured / error)))

    def time(self, error: float) -> float:
        """Relative time that an error is likely to take."""
        return float(self.cost * self.level(error) ** self.power)


def mesh_at(pattern: CreasePattern, kind: Kind, level: float) -> SheetMesh:
    """The mesh of a level (see `meshes.choices.choices`): structured where the pattern has rails, else by gmsh.

    Args:
        pattern: to be meshed.
        kind: how cells are cut.
        level: the higher, the finer.

    Raises:
        MeshError: the pattern has no such mesh; `bh.solving.mesh_choice` tries others.
    """
    return cut(pattern, next(choices(pattern, kind, level)))


def with_mesh(model: Model, mesh: SheetMesh, formulation: str) -> Model:
    """The model on another mesh of the same sheet.

    Args:
        model: on any mesh of the sheet.
        mesh: that replaces it.
        formulation: name of the one that solves it.
    """
    return replace(model, mesh=mesh, formulation=formulation)


def pattern_of(model: Model) -> CreasePattern:
    """The pattern of a model that can be meshed anew.

    Raises:
        ModelError: its mesh knows no pattern, or something in it belongs to that mesh alone; one line names it.
    """
    pattern = model.mesh.pattern
    if pattern is None:
        raise ModelError(
            "this mesh was read from a file, given as arrays or changed, so it cannot be refined; make it of a pattern "
            "with meshes.structured or meshes.unstructured, or leave out accuracy"
        )
    if model.stiffness is not None:
        raise ModelError("given element stiffness belongs to one mesh; leave out accuracy or the stiffness")
    for number, support in enumerate(model.supports):
        if isinstance(support, Support):
            _check_place(support.at, f"supports[{number}]")
    for number, step in enumerate(model.steps):
        for item in step.actuations:
            where = f"steps[{number}].{type(item).__name__.lower()}"
            _check_actuation(model, item, where)
    return pattern


def _check_actuation(model: Model, item: Any, where: str) -> None:
    if isinstance(item, Fold):
        for key in ("to", "by", "rest"):
            value = getattr(item, key)
            if value is not None and not isinstance(value, float | int | str):
                raise ModelError(
                    f"{where}.{key} gives every edge of one mesh its angle; give one angle, or no accuracy"
                )
    elif isinstance(item, Expand):
        if any(not isinstance(each, float) and np.ndim(each) == 2 for each in (item.by, item.through)):
            raise ModelError(
                f"{where} gives every triangle of one mesh its own; give one for all, or no accuracy"
            )
    elif isinstance(item, Indenter | Mould):
        raise ModelError(
            f"{where}: the surface of a bar is as stiff as the edges of one mesh are long; give a mesh, no accuracy"
            if isinstance(item, Indenter)
            else f"{where}: what a mould presses on depends on the mesh; give a mesh, no accuracy"
        )
    elif hasattr(item, "at") and not isinstance(
        item.at, float | int
    ):  # a pinch is at a part of its crease's length
        _check_place(item.at, where)
        if isinstance(item, Force) and item.each is not None and len(select(model.mesh, item.at)) > 1:
            raise ModelError(
                f"{where}.each acts on every node, so the load grows with the mesh; give total, or no accuracy"
            )


def _check_place(at: Any, where: str) -> None:
    if not isinstance(at, str) or at.startswith("node:"):
        raise ModelError(
            f"{where}.at names nodes of one mesh; name a place (corner:..., edge:..., crease:...), or no accuracy"
        )
