"""The accuracy that a scene is solved to: the one that it asks for, or the default where it chooses no mesh."""

from __future__ import annotations

from collections.abc import Mapping

from bh.errors import SceneError
from bh.formulations.protocols import Refinable
from bh.formulations.registry import formulation
from bh.model.model import Model
from bh.model.refinement import DEFAULT, Goal, pattern_of
from bh.scene.reading import as_table, read_table, shown, within
from bh.scene.tables import AccuracyTable


def wanted_accuracy(data: Mapping[str, object], model: Model) -> Goal | None:
    """The goal of a scene from its tables and the model that was made of them; None where its mesh is used as given.

    Args:
        data: tables of the scene.
        model: that was made of them.

    Raises:
        SceneError: what is asked for cannot be; one line that names the key.
    """
    goal = _goal(data["accuracy"]) if "accuracy" in data else None
    if goal is None and ("mesh" in data or model.mesh.pattern is None):
        return None
    _check_refinable(model.formulation, "formulation" in as_table(data.get("model", {}), "model"))
    with within("accuracy" if goal is not None else "mesh is missing, and cannot be chosen"):
        pattern_of(model)
        if goal is not None and goal.at is not None:
            model.mesh.nodes(goal.at)
    return goal or Goal(DEFAULT)


def _goal(data: object) -> Goal:
    """A number, or a table."""
    with within("accuracy"):
        if not isinstance(data, dict):
            return Goal(data)  # type: ignore[arg-type]  # it refuses what is no number
        table = read_table(AccuracyTable, data, "accuracy")
        direction = None if table.direction is None else tuple(table.direction)
        return Goal(
            table.within,
            table.of,
            table.at,
            direction,  # type: ignore[arg-type]  # the table has checked that there are three
            most_triangles=table.most_triangles,
            seconds=table.seconds,
        )


def _check_refinable(name: str, given: bool) -> None:
    """Refuse a formulation that was asked for by name, and has no estimate of its error."""
    known = formulation(name)
    if given and not (isinstance(known, Refinable) and known.refinement):
        raise SceneError(
            f"model.formulation = {shown(name)} has no estimate of its own error to choose a mesh by; "
            "add a table [mesh] (and no accuracy), or leave the formulation out"
        )
