"""What a window may ask: one class a message, checked before anything is done with it."""

from __future__ import annotations

import base64
import binascii
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, field_validator

from bh.errors import InputError

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Point = tuple[Finite, Finite, Finite]


class Message(BaseModel):
    """Unknown keys are refused, so that a misspelt one is not lost."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Move(Message):
    """A slider or a point that is moved; those of one stroke of a hand, which is a number, are taken back at once."""

    stroke: int | None = None


class Open(Message):
    """A drawing that was dropped."""

    do: Literal["open"]
    name: Annotated[str, Field(max_length=200)]
    data: bytes

    @field_validator("data", mode="before")
    @classmethod
    def decoded(cls, value: object) -> bytes:
        """Bytes from base64."""
        try:
            return base64.b64decode(str(value), validate=True)
        except binascii.Error as error:
            raise ValueError("the file is no base64") from error


class Pattern(Message):
    """A pattern of the library, with numbers in place of its own (mm, rad)."""

    do: Literal["pattern"]
    name: str
    values: dict[str, Finite | Annotated[list[Finite], Field(max_length=20)]] = {}


class Spring(Message):
    """A crease, or "all", to a spring of a length scale, mm; None for an angle that is imposed."""

    do: Literal["spring"]
    crease: str
    Lstar: Positive | None = None


class Crease(Message):
    """A crease to another kind: what it is drawn as, from now on."""

    do: Literal["crease"]
    crease: str
    kind: Literal["mountain", "valley", "flat"]


class Contact(Message):
    """Panels stop each other, or pass through each other."""

    do: Literal["contact"]
    on: bool


class Film(Message):
    """Pictures of the folded sheet, as JPEG or PNG, to a GIF or an MP4."""

    do: Literal["film"]
    pictures: Annotated[list[Annotated[str, Field(max_length=400_000)]], Field(min_length=1, max_length=200)]
    ms: Annotated[int, Field(ge=20, le=1000)] = 80
    kind: Literal["gif", "mp4"] = "gif"


class Fold(Move):
    """The fold angle of a crease, rad; "all" for all."""

    do: Literal["fold"]
    crease: str
    angle: Finite


class Percent(Move):
    """Every crease to a part of its way."""

    do: Literal["percent"]
    value: Annotated[float, Field(ge=-100.0, le=100.0)]


class Pull(Move):
    """A node to a point, mm."""

    do: Literal["pull"]
    node: Annotated[int, Field(ge=0)]
    to: Point


class Pinch(Move):
    """Two nodes to jaws that are a gap apart, mm; without one the jaws touch them where they are."""

    do: Literal["pinch"]
    a: Annotated[int, Field(ge=0)]
    b: Annotated[int, Field(ge=0)]
    gap: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] | None = None


class LetGo(Message):
    """Let go of a node, or of all."""

    do: Literal["let-go"]
    node: int | None = None


class Material(Message):
    """Another material: one of the table, or numbers (MPa, 1, mm)."""

    do: Literal["material"]
    name: str | None = None
    E: Positive | None = None
    nu: Annotated[float, Field(gt=-1.0, le=0.5)] | None = None
    t: Positive | None = None


class Hold(Message):
    """Hold a node where it is flat, or leave it: "xyz" or nothing."""

    do: Literal["hold"]
    node: Annotated[int, Field(ge=0)]
    on: bool


class Plain(Message):
    """What needs no more words."""

    do: Literal["undo", "redo", "check", "flatten"]


class Colour(Message):
    """What the colours of the sheet show."""

    do: Literal["colour"]
    by: str


class Export(Message):
    """A file of what is in the window."""

    do: Literal["export"]
    what: str


Asked = (
    Open
    | Pattern
    | Spring
    | Crease
    | Contact
    | Film
    | Fold
    | Percent
    | Pull
    | Pinch
    | LetGo
    | Material
    | Hold
    | Plain
    | Colour
    | Export
)
_ADAPTER: TypeAdapter[Asked] = TypeAdapter(Annotated[Asked, Field(discriminator="do")])


def read(text: str | bytes) -> Asked:
    """A message from its JSON text.

    Args:
        text: as it came.

    Raises:
        InputError: it is none; one line.
    """
    try:
        return _ADAPTER.validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise InputError(f"this cannot be asked ({place}: {first['msg']})") from None
