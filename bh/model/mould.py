"""A rigid body of triangles that presses on the sheet, such as a mould that is read from an STL file."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field, fields
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.errors import InputError, ModelError
from bh.model.step import Body
from meshes.io.solids import read_solid
from meshes.quantities import Typed, number, take_units
from meshes.topology import Ints

Array = NDArray[np.float64]
Spot = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Mould(Body):
    """A rigid body of triangles that presses on the sheet in the step that names it; nothing passes through it.

    Where the sheet is nearer to its surface than `gap` a barrier acts that grows without bound (`docs/contact.md`).
    Like indenters, moulds take the place of the rigid-body support in their step.

    Attributes:
        name: in `State.contact_forces`.
        points: (n, 3) corners where the step begins, mm.
        triangles: (t, 3) of them, a closed surface, counter-clockwise seen from outside.
        by: how far it moves while lambda runs from 0 to 1, mm.
        gap: distance at which it begins to press, mm.
        friction: coefficient between it and the sheet; None for that of the model.
    """

    name: str
    points: Array = field(repr=False)
    triangles: Ints = field(repr=False)
    by: Spot = (0.0, 0.0, 0.0)
    gap: float = 0.05
    friction: float | None = None

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        what = f"mould '{self.name}'"
        take_units(self, what, by="length", gap="length")
        points, triangles = np.array(self.points, dtype=float), np.array(self.triangles, dtype=np.int64)
        if points.ndim != 2 or points.shape[1:] != (3,) or triangles.ndim != 2 or triangles.shape[1:] != (3,):
            raise ModelError(f"{what}: give points (n, 3) and triangles (t, 3)")
        if len(triangles) == 0 or not np.isfinite(points).all():
            raise ModelError(f"{what} has no triangles, or corners that are not finite")
        if triangles.min() < 0 or triangles.max() >= len(points):
            raise ModelError(f"{what} has a triangle with a corner that it does not have")
        if len(self.by) != 3 or not all(math.isfinite(each) for each in self.by):
            raise ModelError(f"{what}: by = {self.by} cannot be; give three numbers in mm")
        if not (math.isfinite(self.gap) and self.gap > 0.0):
            raise ModelError(f"{what}: gap = {self.gap} cannot be; give a positive number")
        check_friction(self.friction, what)
        for array in (points, triangles):
            array.setflags(write=False)
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "triangles", triangles)
        object.__setattr__(self, "by", tuple(float(each) for each in self.by))

    def __eq__(self, other: object) -> bool:
        """The same body that moves in the same way?"""
        if not isinstance(other, Mould):
            return NotImplemented
        pairs = ((getattr(self, f.name), getattr(other, f.name)) for f in fields(self))
        return all(np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b for a, b in pairs)

    def __hash__(self) -> int:
        """Of what is small."""
        return hash((self.name, len(self.points), self.by, self.gap))

    @classmethod
    def read(  # noqa: PLR0913 - the fields of the dataclass, and the place of the file
        cls,
        file: str | os.PathLike[str],
        unit: str,
        name: str = "mould",
        at: tuple[Typed, Typed, Typed] = (0.0, 0.0, 0.0),
        axis: Spot = (0.0, 0.0, 1.0),
        angle: Typed = 0.0,
        by: tuple[Typed, Typed, Typed] = (0.0, 0.0, 0.0),
        gap: Typed = 0.05,
        friction: float | None = None,
    ) -> Mould:
        """A mould from an STL or OBJ file, turned about an axis through the origin of the file, then moved.

        Args:
            file: its place.
            unit: of length in the file, such as "mm": neither STL nor OBJ says it.
            name: in `State.contact_forces`.
            at: (3,) where the origin of the file comes to lie, mm.
            axis: (3,) that it is turned about before.
            angle: by how much, rad.
            by: see the attributes.
            gap: see the attributes.
            friction: see the attributes.

        Raises:
            ModelError: the file cannot be read, is not closed, has no triangles or too many; one line.
        """
        what = f"mould '{name}': {Path(file).name}"
        try:
            scale = number(f"1{unit}", "length")
            points, triangles = read_solid(file)
            turned = scale * points @ rotation(axis, number(angle, "angle")).T
            moved = turned + np.array([number(each, "length") for each in at], dtype=float)
        except InputError as error:
            raise ModelError(f"{what} {error}") from error
        there = tuple(number(each, "length") for each in by)
        return cls(name, moved, triangles, (there[0], there[1], there[2]), number(gap, "length"), friction)


def check_friction(value: float | None, what: str) -> None:
    """Refuse a coefficient of friction that cannot be.

    Args:
        value: the coefficient; None where none is given.
        what: it belongs to, for the message.

    Raises:
        ModelError: it is negative or not finite.
    """
    if value is not None and not (isinstance(value, float | int) and 0.0 <= value < math.inf):
        raise ModelError(
            f"{what}: friction = {value} cannot be; give a coefficient of 0 or more, such as 0.3"
        )


def rotation(axis: ArrayLike, angle: float) -> Array:
    """(3, 3) turn about an axis (Rodrigues' formula).

    Args:
        axis: (3,) of any length.
        angle: rad.

    Raises:
        ModelError: the axis has no direction.
    """
    along = np.asarray(axis, dtype=float)
    size = float(np.linalg.norm(along))
    if along.shape != (3,) or not (math.isfinite(size) and size > 0.0):
        raise ModelError(f"axis = {along.tolist()} cannot be; give three numbers that are not all zero")
    x, y, z = along / size
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)
