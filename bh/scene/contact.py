"""The key `contact` of a scene: whether panels stop each other, and how far apart."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from bh.errors import SceneError
from bh.model.model import Contact
from bh.scene.reading import Length, Table, read_table


class ContactKey(Table):
    """The key as it is typed, but for false."""

    contact: Literal["thickness", "auto"] | Length = Field(
        description='"thickness", "auto", false, or a gap in mm that is above 0'
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
