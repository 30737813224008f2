"""Sheets that are not flat from the start: a field of heights, a mode times an amplitude, a random field with a seed.

The sheet is stress-free in the imperfect shape. (That it is flat when free of stress and only *begins* elsewhere makes
no difference to an elastic state but by which branch is found.)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.errors import ModelError
from bh.model.expression import field
from bh.model.model import Model
from meshes import SheetMesh

Array = NDArray[np.float64]
WAVES = 64  # of a random field: it is Gaussian but for one part in a few hundred


@dataclass(frozen=True)
class RandomField:
    """A smooth random field of heights: plane waves of random directions and phases, the same on every mesh.

    Attributes:
        amplitude: standard deviation of the height, mm.
        wavelength: of the waves, mm; their lengths spread by a third around it.
        seed: the same seed gives the same field.
    """

    amplitude: float
    wavelength: float
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        for key in ("amplitude", "wavelength"):
            value = getattr(self, key)
            if not (math.isfinite(value) and value > 0.0):
                raise ModelError(f"random field: {key} = {value} cannot be; give a positive length in mm")
        if self.seed < 0:
            raise ModelError(f"random field: seed = {self.seed} cannot be; give a whole number from 0")

    def __call__(self, x: Array, y: Array) -> Array:
        """Heights (n,) at places x, y (n,), mm."""
        rng = np.random.default_rng(self.seed)
        angle, phase = rng.uniform(0.0, 2.0 * math.pi, size=(2, WAVES))
        number = 2.0 * math.pi / self.wavelength * rng.uniform(0.75, 1.5, size=WAVES)
        along = np.multiply.outer(x, number * np.cos(angle)) + np.multiply.outer(y, number * np.sin(angle))
        return np.asarray(self.amplitude * math.sqrt(2.0 / WAVES) * np.cos(along + phase).sum(axis=-1))


Field = str | ArrayLike | Callable[[Array, Array], ArrayLike]


def imperfect_mesh(mesh: SheetMesh, shape: Field, amplitude: float | None = None) -> SheetMesh:
    """The mesh with its nodes moved; see `imperfect`.

    Args:
        mesh: of the sheet.
        shape: how.
        amplitude: see `imperfect`.

    Raises:
        ModelError: see `imperfect`.
    """
    x, y = mesh.points[:, 0], mesh.points[:, 1]
    if isinstance(shape, str):
        found = field(shape, "imperfection z")(x, y)
    else:
        found = np.asarray(shape(x, y) if callable(shape) else shape, dtype=float)
    if found.shape not in (x.shape, mesh.points.shape) or not np.isfinite(found).all():
        raise ModelError(
            f"imperfection: an array of shape {found.shape} with finite numbers cannot be; give ({len(x)},) heights or "
            f"({len(x)}, 3) displacements in mm"
        )
    if amplitude is not None:
        if not math.isfinite(amplitude):
            raise ModelError(f"imperfection: amplitude = {amplitude} is not finite; give a length in mm")
        found = found * (amplitude / max(float(np.abs(found).max()), 1e-300))
    points = mesh.points.copy()
    if found.ndim == 1:
        points[:, 2] += found
    else:
        points += found
    return replace(mesh, points=points)


def imperfect(model: Model, shape: Field, amplitude: float | None = None) -> Model:
    """The model with a sheet that is not flat and free of stress as it is.

    Args:
        model: of a flat sheet, or of one that is not flat already.
        shape: heights z of x and y in mm as a text, such as "0.1 * sin(pi * x / 100)", a function or a `RandomField`;
            or an array (n,) of heights or (n, 3) of displacements, such as `BucklingMode.shape` or a mode of
            `bh.stiffness_probe`.
        amplitude: of the largest component, mm; None for the shape as it is.

    Raises:
        ModelError: a text that is no expression, or values that are not finite or do not fit; one line.
    """
    return replace(model, mesh=imperfect_mesh(model.mesh, shape, amplitude))
