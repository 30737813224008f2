"""Keys of the laws of creases that are no straight line: `law = { kind = "bilinear", ... }` below `[creases.NAME]`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from bh.errors import SceneError
from bh.model.hinge_laws import LAWS, HingeLaw
from bh.model.plugins import made
from bh.scene.reading import (
    Bend,
    Closing,
    Couple,
    Slope,
    Stiffness,
    Table,
    Turn,
    arguments,
    as_table,
    nearest,
    read_table,
    within,
    without,
)

SOME = Field(min_length=2, max_length=10_000)


class MomentCurveTable(Table):
    """A measured curve of moment against turn."""

    kind: Literal["table"]
    turns: Annotated[list[Turn], SOME] = Field(
        description="rising turns from the rest angle in rad, 0 among them; from 0 on both senses are alike"
    )
    moments: Annotated[list[Couple], SOME] = Field(
        description="a moment a length for each turn, N mm / mm, 0 at the turn 0"
    )


class BilinearTable(Table):
    """Another stiffness beyond a turn."""

    kind: Literal["bilinear"]
    knee: Bend = Field(description="a positive turn from the rest angle in rad")
    beyond: Slope = Field(description="a stiffness a length beyond it, N mm / (mm rad); negative softens")


class SofteningTable(Table):
    """A moment that has a largest value."""

    kind: Literal["softening"]
    peak: Bend = Field(description="the turn of the largest moment in rad, a positive number")


class ElasticPlasticTable(Table):
    """A crease that keeps a part of its fold."""

    kind: Literal["elastic-plastic"]
    yield_moment: Closing = Field(description="a positive moment a length, N mm / mm")
    hardening: Stiffness = Field(0.0, description="a stiffness a length, N mm / (mm rad), 0 or more")
    hardens: Literal["kinematic", "isotropic"] = Field(
        "kinematic", description='"kinematic" (the other sense yields sooner) or "isotropic"'
    )


TABLES: dict[str, type[Table]] = {
    "table": MomentCurveTable,
    "bilinear": BilinearTable,
    "softening": SofteningTable,
    "elastic-plastic": ElasticPlasticTable,
}


def crease_law(item: object, at: str) -> HingeLaw:
    """The law that a table of a scene describes.

    Args:
        item: the table.
        at: where it stands, for messages.

    Raises:
        SceneError: it cannot be; one line that names the key.
    """
    table = as_table(item, at)
    kind = table.get("kind")
    if isinstance(kind, str) and ":" in kind:
        with within(at):
            own: HingeLaw = made(kind, without(table, "kind"), HingeLaw)
            return own
    if not isinstance(kind, str) or kind not in TABLES:
        known = f"{nearest(kind, TABLES)}; give one of {', '.join(TABLES)}"
        raise SceneError(f"{at}.kind = {kind!r} is no law of a crease{known}")
    given = arguments(read_table(TABLES[kind], item, at))
    with within(at):
        return LAWS[kind](**{key: value for key, value in given.items() if key != "kind"})
