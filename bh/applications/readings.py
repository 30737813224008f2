"""What a calibration is told: readings at the ends of steps, and scans of a folded sheet."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.analysis.clouds import IDENTITY, Motion
from bh.analysis.scan import TRIM, Surface, distances, register
from bh.errors import ModelError
from bh.formulations.observables import OBSERVABLES
from bh.formulations.state import State
from bh.model.model import Model
from meshes.quantities import Kind

Array = NDArray[np.float64]
MOST_POINTS = 400  # of a scan: more tell little, and each is looked up in every solution
KINDS: dict[str, Kind] = {
    **dict.fromkeys(("energy", "stretching", "bending", "folding"), "energy"),
    **dict.fromkeys(("fold_angle", "largest_fold", "dihedral"), "angle"),
    **{f"reaction_{axis}": "force" for axis in "xyz"},
    **{f"displacement_{axis}": "length" for axis in "xyz"},
    "moment": "couple",
    "depth": "length",
}
UNITS: dict[Kind, str] = {"energy": "N mm", "angle": "rad", "force": "N", "length": "mm", "couple": "N mm/mm"}


class Reading(Protocol):
    """One kind of data: what was measured, and what a solved model has in its place."""

    @property
    def label(self) -> str:
        """What it is, in words."""
        ...

    @property
    def unit(self) -> str:
        """Unit of the values."""
        ...

    @property
    def noise(self) -> float | None:
        """Standard deviation of every value; None where it is not known."""
        ...

    def check(self, model: Model) -> None:
        """See that the model has the steps and places.

        Raises:
            ModelError: it has not; one line.
        """
        ...

    def measured(self) -> Array:
        """(k,) values."""
        ...

    def predicted(self, ends: Mapping[int, State]) -> Array:
        """(k,) what a model has.

        Args:
            ends: the state at the end of every step, by its number.
        """
        ...


@dataclass(frozen=True)
class Measured:
    """What was measured at the ends of steps.

    Attributes:
        observable: what, as for `Until`: "reaction_z", "displacement_z", "fold_angle", "moment", ...
        values: one a step, in the observable's own unit.
        of: the crease or place that it is of.
        steps: from 0, at the ends of which it was measured; None for all steps in order.
        sigma: standard deviation of the noise, in the unit of the values; None where it is not known: it is read
            from the residuals then.
    """

    observable: str
    values: Sequence[float]
    of: str | None = None
    steps: Sequence[int] | None = None
    sigma: float | None = None

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        if self.observable not in OBSERVABLES:
            raise ModelError(
                f"observable '{self.observable}' is not known; use one of {', '.join(sorted(OBSERVABLES))}"
            )
        if len(self.values) == 0 or not np.isfinite(np.asarray(self.values, dtype=float)).all():
            raise ModelError(f"measured {self.observable} needs finite numbers, one a step")
        _check_sigma(self.sigma)

    @property
    def label(self) -> str:
        """What it is, in words."""
        return self.observable if self.of is None else f"{self.observable} of {self.of}"

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return UNITS[KINDS[self.observable]]

    @property
    def noise(self) -> float | None:
        """Standard deviation of every value; None where it is not known."""
        return self.sigma

    def at(self, model: Model) -> tuple[int, ...]:
        """The steps of a model at whose ends the values are.

        Returns:
            numbers from 0, one a value.

        Raises:
            ModelError: there are more or fewer than values, or the model has no such step.
        """
        steps = tuple(range(len(model.steps))) if self.steps is None else tuple(self.steps)
        if len(steps) != len(self.values):
            raise ModelError(
                f"{len(self.values)} values of {self.observable} are no match for {len(steps)} steps; give one a step"
            )
        if any(not 0 <= step < len(model.steps) for step in steps):
            raise ModelError(f"data of step {max(steps)}: the model has steps 0 to {len(model.steps) - 1}")
        return steps

    def check(self, model: Model) -> None:
        """See that the model has the steps; see `Reading.check`."""
        self.at(model)

    def measured(self) -> Array:
        """(k,) values."""
        return np.asarray(self.values, dtype=float)

    def predicted(self, ends: Mapping[int, State]) -> Array:
        """(k,) what a model has; see `Reading.predicted`."""
        steps = sorted(ends) if self.steps is None else self.steps
        return np.array([OBSERVABLES[self.observable](ends[step], self.of) for step in steps])


class Scanned:
    """A scan of the sheet after a step: every point is to lie on the sheet, wherever that lies in space.

    The scan is registered anew in each solution (docs/scan.md). Points that do not belong to the sheet are left out as
    they are in the first one, and of very many points a seeded choice of 400 is taken.
    """

    def __init__(
        self, points: ArrayLike, step: int, sigma: float, start: Motion = IDENTITY, trim: float = TRIM
    ) -> None:
        """Points of a scan.

        Args:
            points: (k, 3) mm.
            step: after which it was made, from 0.
            sigma: standard deviation of a point across the sheet, mm.
            start: initial guess of the motion from the scan to the sheet.
            trim: robust standard deviations beyond which a point is a stray, as for `bh.scan.register`.

        Raises:
            ModelError: a sigma that cannot be.
        """
        _check_sigma(sigma)
        cloud = np.asarray(points, dtype=float)
        if cloud.ndim != 2 or cloud.shape[1:] != (3,) or not np.isfinite(cloud).all():
            raise ModelError(f"a scan is points (k, 3) in mm, not an array of shape {cloud.shape}")
        if len(cloud) > MOST_POINTS:
            cloud = cloud[np.sort(np.random.default_rng(0).permutation(len(cloud))[:MOST_POINTS])]
        self._cloud, self.step, self.sigma, self._motion, self._trim = cloud, step, sigma, start, trim
        self._kept: NDArray[np.bool_] | None = None

    label, unit = "distance of the scan", "mm"

    @property
    def noise(self) -> float | None:
        """Standard deviation of every point across the sheet, mm."""
        return self.sigma

    def check(self, model: Model) -> None:
        """See that the model has the step; see `Reading.check`."""
        if not 0 <= self.step < len(model.steps):
            raise ModelError(
                f"a scan after step {self.step}: the model has steps 0 to {len(model.steps) - 1}"
            )

    def measured(self) -> Array:
        """(k,) zeros: the distances that are to be."""
        return np.zeros(len(self._cloud))

    def predicted(self, ends: Mapping[int, State]) -> Array:
        """(k,) distances of the points from the sheet, mm; 0 for strays."""
        surface = Surface(ends[self.step])
        if self._kept is None:
            found = register(self._cloud, surface, self._motion, self._trim)
            self._kept, self._motion = found.kept, found.motion
        kept = self._cloud[self._kept]
        found = register(kept, surface, self._motion, math.inf)
        out = np.zeros(len(self._cloud))
        out[self._kept] = distances(found.motion.apply(kept), surface).values
        return out


def _check_sigma(sigma: float | None) -> None:
    if sigma is not None and not 0.0 < sigma < math.inf:
        raise ModelError(f"sigma = {sigma} cannot be; give a positive standard deviation, or None")
