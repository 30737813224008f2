"""Pieces of strips that are made a little differently, and pinches that are not closed all the way.

What a strip does when one thing about it is off (L*, thickness, zone, pinch and fold angle) is the difference of two
chains of pieces in the limit of fine meshes: on the coarsest level an end moves by a quarter less with the pinch angle.
A chain of pieces takes no time, so movements are known of thousands of designs, where whole strips are simulated for
one.

Pinches that are closed by a part of the way are pieces too, at Chebyshev points of that part, on levels of meshes with
a limit and an error bar as the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, get_args

import numpy as np
from numpy.typing import NDArray

from bh.applications.inverse.levels import Limit, Series, points
from bh.applications.inverse.piece_data import PieceData
from bh.applications.inverse.pieces import LEVELS, VARIED, Kind, Level, column, simulated
from bh.applications.inverse.simulate import Setting

if TYPE_CHECKING:
    from xarray import Dataset

Array = NDArray[np.float64]
VARIANTS = 2  # format of the data set
STEPS = {
    "Lstar": 0.05,
    "t": 0.002,
    "zone": 1.0,
    "pinch": 0.02,
    "fold": 0.02,
}  # up and down: mm, mm, mm, rad, rad
LOCAL = ("zone", "pinch")  # change pinches only
PARTS = 5  # Chebyshev points of the part of the way that a pinch is closed, both ends included
CLOSING = 3  # levels of meshes of pinches that are closed by a part of the way
MOVING: dict[Kind, tuple[Level, ...]] = {  # of variants: differences of two of them need fewer curvatures
    **LEVELS,
    "pinch": tuple(replace(level, degree=16) for level in LEVELS["pinch"][:3]),
}


def parts() -> Array:
    """(PARTS,) parts of the way of a pinch from 0 to 1."""
    return 0.5 * (points(PARTS) + 1.0)


def variants(setting: Setting) -> dict[tuple[str, int], Setting]:
    """Settings with one thing a step less or more.

    Args:
        setting: that is varied.

    Returns:
        the settings, by the name of what is changed and the sign of its step.
    """
    return {
        (name, sign): replace(setting, **{name: getattr(setting, name) + sign * step})
        for name, step in STEPS.items()
        for sign in (-1, 1)
    }


def table(setting: Setting) -> dict[str, list[float | int | str]]:
    """Columns of all points: kind, before, after (1/mm), edge (mm), rows, and what is varied; cheap ones first.

    Args:
        setting: that is varied.
    """
    rows: list[tuple[object, ...]] = []

    def add(kind: Kind, level: Level, made: Setting) -> None:
        fields = tuple(float(np.round(getattr(made, name), 12)) for name in VARIED)
        rows.extend((kind, *pair, level.edge, level.rows, *fields) for pair in simulated(kind, level))

    for (name, _), made in variants(setting).items():
        kinds: tuple[Kind, ...] = ("pinch",) if name in LOCAL else get_args(Kind)
        for kind in kinds:
            for level in MOVING[kind]:
                add(kind, level, made)
    for part in parts()[1:-1]:
        for level in LEVELS["pinch"][:CLOSING]:
            add("pinch", level, closed(setting, float(part)))
    rows.sort(key=lambda row: row[4])  # type: ignore[arg-type, return-value]
    names = ("kind", "before", "after", "edge", "rows", *map(column, VARIED))
    return {name: list(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)}


def closed(setting: Setting, part: float) -> Setting:
    """A pinch that is closed by a part of the way from the fold, 0 to 1.

    Args:
        setting: with the pinch closed all the way.
        part: of the way.
    """
    return replace(setting, pinch=setting.fold - part * (setting.fold - setting.pinch))


@dataclass(frozen=True, eq=False)
class VariantData:
    """Simulated pieces of the variants of a setting.

    Attributes:
        data: of `bh.sweep.segments.build_variants`.
        pieces: of the setting itself; arcs and joints are taken from it where only pinches differ.
        setting: that is varied.
    """

    data: Dataset
    pieces: PieceData
    setting: Setting

    def _of(self, made: Setting, local: bool, levels: Mapping[Kind, tuple[Level, ...]] = LEVELS) -> PieceData:
        fits = np.ones(self.data.sizes["point"], dtype=bool)
        for name in VARIED:
            fits &= np.abs(self.data[column(name)].values - getattr(made, name)) < 1e-9
        return PieceData(self.data.isel(point=np.flatnonzero(fits)), self.pieces if local else None, levels)

    def series(self, name: str, sign: int, level: int | None = None) -> Mapping[str, Series]:
        """Functions arc, end, pinch and joint of strips that are made differently.

        Args:
            name: of the field that is varied.
            sign: of its step, 1 or -1.
            level: of meshes, from 0; None for the limit of fine ones.

        Raises:
            KeyError: the data set has no such pieces.
            ValueError: a piece could not be simulated.
        """
        read = self._of(variants(self.setting)[name, sign], name in LOCAL, MOVING)
        if level is not None:
            return read.series(level)
        return {name: limit.value for name, limit in read.limits.items()}

    @cached_property
    def closing(self) -> tuple[Limit, ...]:
        """Pinches that are closed by the parts of the way between the ends of `parts`, in their order."""
        found = []
        for part in parts()[1:-1]:
            each = self._of(closed(self.setting, float(part)), local=True)
            found.append(each.pinches(CLOSING))
        return tuple(found)
