"""The keys `contact` and `friction` of a scene: whether panels stop each other, how far apart, and how they rub."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from bh.errors import SceneError
from bh.model.actuations import Indenter
from bh.model.model import Contact, Model
from bh.model.mould import Mould
from bh.scene.reading import Length, Table, read_table


class ContactKey(Table):
    """The key as it is typed, but for false."""

    contact: Literal["thickness", "auto"] | Length = Field(
        description='"thickness", "auto", false, or a gap in mm that is above 0'
    )


class FrictionKey(Table):
    """The key as it is typed."""

    friction: Annotated[float, Field(ge=0.0, le=100.0)] = Field(
        description="a coefficient of 0 or more, such as 0.3"
    )


def friction_of(data: object) -> float:
    """What a scene has under `friction`.

    Args:
        data: of the key.

    Raises:
        SceneError: it cannot be; one line that says what can.
    """
    try:
        return read_table(FrictionKey, {"friction": data}, "").friction
    except SceneError as error:
        raise SceneError(str(error).removeprefix(".")) from error


def check_friction(model: Model) -> None:
    """Refuse friction where nothing can press.

    Args:
        model: of the scene.

    Raises:
        SceneError: panels pass through each other, and no step has a body that presses.
    """
    bodies = any(isinstance(item, Indenter | Mould) for step in model.steps for item in step.actuations)
    if model.friction > 0.0 and model.contact is False and not bodies:
        raise SceneError(
            f"friction = {model.friction:g} acts where something presses, but contact = false and no step has press; "
            'give contact = "thickness", or leave friction out'
        )


def contact_of(data: object) -> Contact:
    """What a scene has under `contact`.

    Args:
        data: of the key.

    Raises:
        SceneError: it cannot be; one line that says what can.
    """
    if data is False:
        return False
    try:
        return read_table(ContactKey, {"contact": data}, "").contact
    except SceneError as error:
        raise SceneError(str(error).removeprefix(".")) from error
