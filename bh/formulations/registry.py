"""Formulations, found through the entry-point group "bh.formulations", so that none is known by name here.

What they have to offer is in `bh.formulations.protocols`; a formulation that lacks some of it is refused here, by one
line that names what is missing, and not in the middle of a solve.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib.metadata import entry_points
from inspect import signature
from typing import cast

from bh.errors import ModelError
from bh.formulations.protocols import (
    Differentiable,
    Formulation,
    Mirrored,
    Refinable,
    SheetSystem,
)
from bh.formulations.remarks import Remark, unlikely
from bh.model.model import Model
from bh.model.plugins import named
from bh.solvers.system import System

GROUP = "bh.formulations"
HELP = "docs/extending.md says what has to be there"


def _members(protocol: type) -> tuple[str, ...]:
    """Names that a protocol itself asks for, in its order."""
    return tuple(name for name in vars(protocol) if not name.startswith("_"))


REQUIRED = _members(Formulation)
ABILITIES = tuple(_members(ability) for ability in (Mirrored, Differentiable, Refinable))
OF_SYSTEM = (*_members(System), *_members(SheetSystem))


def names() -> list[str]:
    """Names of all registered formulations.

    Returns:
        the names in alphabetical order.
    """
    return sorted(point.name for point in entry_points(group=GROUP))


@cache
def formulation(name: str) -> Formulation[SheetSystem]:
    """The formulation of that name, or of the user's own "module:Class".

    Args:
        name: of an entry point in the group "bh.formulations", or "module:Class".

    Returns:
        the formulation. Its own systems are the only ones that it may be given back, so no one else needs to know
        their class.

    Raises:
        ModelError: it is not registered (the message lists those that are), or lacks what a formulation must have.
    """
    for point in entry_points(group=GROUP):
        if point.name == name:
            return checked(_made(point.load(), name), name)
    if ":" in name:
        return checked(_made(named(name), name), name)
    known = ", ".join(names()) or "none; install the project with pip first"
    raise ModelError(f"formulation '{name}' is not known; use one of: {known}")


def _made(factory: Callable[[], object], name: str) -> object:
    """What a registered class or function makes."""
    try:
        return factory()
    except TypeError as wrong:
        raise ModelError(f"formulation '{name}' cannot be made without arguments: {wrong}") from wrong


def checked(found: object, name: str) -> Formulation[SheetSystem]:
    """An object as a formulation, if it has all that one must have.

    Args:
        found: the object.
        name: that it is registered by, for messages.

    Raises:
        ModelError: a member is missing or does not take its arguments, or an optional ability is there in part only.
    """
    for member in REQUIRED:
        if not hasattr(found, member):
            raise ModelError(f"formulation '{name}' has no {_call(Formulation, member)}; {HELP}")
        asked, there = getattr(Formulation, member), getattr(found, member)
        if callable(asked) and not _takes(there, len(signature(asked).parameters) - 1):
            raise ModelError(
                f"formulation '{name}': {member} cannot be called as {_call(Formulation, member)}; {HELP}"
            )
    for members in ABILITIES:
        missing = [member for member in members if not hasattr(found, member)]
        if 0 < len(missing) < len(members):
            given = ", ".join(member for member in members if member not in missing)
            raise ModelError(f"formulation '{name}' has {given} but no {', '.join(missing)}; {HELP}")
    return cast("Formulation[SheetSystem]", found)


def _takes(member: object, count: int) -> bool:
    """Can a member be called with that many positional arguments?"""
    if not callable(member):
        return False
    try:
        signature(member).bind(*range(count))
    except TypeError:
        return False
    return True


def _call(protocol: type, member: str) -> str:
    """A member as it is used: "observe(model, system, q, lam, step, stable)", or its name if it is no method."""
    asked = getattr(protocol, member)
    if not callable(asked):
        return member
    return f"{member}({', '.join(list(signature(asked).parameters)[1:])})"


def checked_system(system: SheetSystem, name: str) -> SheetSystem:
    """A system, if it has all that one must have: looked at once a step, before the step is solved.

    Args:
        system: the system of a step.
        name: of the formulation that has made it, for messages.

    Raises:
        ModelError: a member is missing.
    """
    own = getattr(system, "__dict__", {})
    missing = [member for member in OF_SYSTEM if member not in own and not hasattr(type(system), member)]
    if missing:
        what = f"a {type(system).__name__} without {', '.join(missing)}"
        raise ModelError(f"formulation '{name}' makes {what}, which is no system of a sheet; {HELP}")
    return system


def able(has: Callable[[Formulation[SheetSystem]], bool]) -> list[str]:
    """Names of the registered formulations that have an ability, for messages: `able(lambda f: isinstance(f, ...))`.

    Returns:
        the names for which `has` is true.
    """
    return [name for name in names() if has(formulation(name))]


def takes_nu(name: str) -> bool:
    """Whether a formulation uses Poisson's ratio of the sheet.

    Raises:
        ModelError: it is not registered.
    """
    return formulation(name).takes_nu


def remarks(model: Model) -> tuple[Remark, ...]:
    """What to know of a model before it is solved: of its drawing, and of its mesh and loads with its formulation.

    Args:
        model: the model.

    Returns:
        remarks, never errors; empty where there is nothing to say.

    Raises:
        ModelError: its formulation is not registered.
    """
    drawn = (Remark("drawing", text) for text in model.mesh.remarks)
    return (*drawn, *unlikely(model), *formulation(model.formulation).remarks(model))
