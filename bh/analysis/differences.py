"""Derivatives of sampled functions: finite differences of fourth order, smoothing splines, interpolating splines.

All are strategies with one method, `derivatives(u, values, at, highest)`; what uses them need not know which it has.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from bh.errors import InputError

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

Array = NDArray[np.float64]
EVEN = 1e-6  # steps that differ by less, relatively, count as equal
CENTRED = (5, 5, 5, 7)  # nodes of a centred stencil of fourth order for derivatives 0 to 3 on even steps
UNEVEN = (5, 5, 6, 7)  # nodes that fourth order takes where steps differ or the stencil is one-sided


class Differentiation(Protocol):
    """A way to differentiate samples."""

    def derivatives(self, u: Array, values: Array, at: Array, highest: int) -> Array:
        """The function itself and its derivatives at some parameters.

        Args:
            u: (k,) rising parameters of the samples.
            values: (k, c) samples.
            at: (a,) parameters.
            highest: order of the derivatives, up to 3.

        Returns:
            (highest + 1, a, c), in the unit of the samples over powers of that of the parameters.
        """
        ...


@dataclass(frozen=True)
class FiniteDifferences:
    """Differences whose errors are of fourth order in the step, at the ends too (source 5.2.1).

    Centred stencils of 5, 5 and 7 samples for the first, second and third derivative. Towards the ends of the samples
    the nearest 5, 6 and 7 are taken: one-sided, still of fourth order, but with larger constants. That is the end error
    of the source's Fig. 5.6 and 5.7: on a circle and a helix curvature is 6 to 15 times, torsion 190 times less
    accurate at the end than in the middle. `one_sided` names those samples.
    """

    def derivatives(self, u: Array, values: Array, at: Array, highest: int) -> Array:
        """See `Differentiation.derivatives`.

        Raises:
            InputError: too few samples for the highest derivative.
        """
        if len(u) < (needed := UNEVEN[highest]):
            raise InputError(
                f"{len(u)} points give no derivative of order {highest}; give at least {needed}, by more cells"
            )
        return np.array([self._derivative(u, values, at, order) for order in range(highest + 1)])

    def _derivative(self, u: Array, values: Array, at: Array, order: int) -> Array:
        rows, weights = stencils(u, at, CENTRED[order], order)
        out: Array = np.einsum("ap,apc->ac", weights, values[rows])
        if UNEVEN[order] != CENTRED[order]:
            loose = ~_even(u, at, rows)
            if loose.any():
                rows, weights = stencils(u, at[loose], UNEVEN[order], order)
                out[loose] = np.einsum("ap,apc->ac", weights, values[rows])
        return out


def stencils(u: Array, at: Array, count: int, order: int) -> tuple[NDArray[np.int64], Array]:
    """The `count` samples nearest to each place, (a, count), and the weights of the derivative there.

    Weights are those of the polynomial through the samples (Fornberg 1988).

    Args:
        u: (k,) rising parameters of the samples.
        at: (a,) parameters.
        count: samples of a stencil.
        order: of the derivative.
    """
    middle = np.interp(at, u, np.arange(len(u)))
    first = np.clip(np.ceil(middle - 0.5 * count - 1e-9).astype(np.int64), 0, len(u) - count)
    rows = first[:, None] + np.arange(count)
    offset = u[rows] - at[:, None]
    scale = np.abs(offset).max(axis=1)
    powers = np.arange(count)
    matrix = (offset / scale[:, None])[:, None, :] ** powers[:, None]
    wanted = np.zeros((len(at), count, 1))
    wanted[:, order, 0] = math.factorial(order) / scale**order
    return rows, np.linalg.solve(matrix, wanted)[:, :, 0]


def _even(u: Array, at: Array, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Is a stencil symmetric about its place? Then it is one order better than its number of samples says."""
    nodes = u[rows]
    lopsided = np.abs(nodes + nodes[:, ::-1] - 2.0 * at[:, None]).max(axis=1)
    return np.asarray(lopsided <= EVEN * np.ptp(nodes, axis=1))


def one_sided(u: Array, at: Array, order: int = 3) -> NDArray[np.bool_]:
    """(a,) where no centred stencil for that derivative fits: there the end error is to be expected.

    Args:
        u: (k,) rising parameters of the samples.
        at: (a,) parameters.
        order: of the derivative.
    """
    rows, _ = stencils(u, at, CENTRED[order], order)
    middle = np.interp(at, u, np.arange(len(u)))
    return np.asarray(np.abs(rows.mean(axis=1) - middle) > 0.75)


@dataclass(frozen=True)
class SmoothingSpline:
    """Quintic splines that pass the samples by `deviation` in the root mean square (Dierckx 1975; FITPACK).

    The third derivative of samples with noise e at steps h has noise of about e / h^3; a spline takes it out and rounds
    off what is shorter than a few steps.

    Attributes:
        deviation: in the unit of the samples; None estimates their noise from sixth differences, which leave nothing of
            a smooth function (of even steps). Zero interpolates.
    """

    deviation: float | None = None

    def __post_init__(self) -> None:
        """Check the deviation."""
        if self.deviation is not None and not (math.isfinite(self.deviation) and self.deviation >= 0.0):
            raise InputError(
                f"deviation = {self.deviation} of a smoothing spline cannot be; give 0 or a positive number"
            )

    def derivatives(self, u: Array, values: Array, at: Array, highest: int) -> Array:
        """See `Differentiation.derivatives`.

        Raises:
            InputError: too few samples for a quintic spline.
        """
        from scipy.interpolate import splev, splrep

        if len(u) < 7:
            raise InputError(
                f"{len(u)} points are too few for a quintic spline; give at least 7, by more cells"
            )
        scale = u[-1] - u[0]
        out = np.empty((highest + 1, len(at), values.shape[1]))
        for column in range(values.shape[1]):
            noise = deviation_of(values[:, column]) if self.deviation is None else self.deviation
            noise = noise if noise > 1e-10 * float(np.abs(values[:, column]).max()) else 0.0  # rounding
            made = splrep((u - u[0]) / scale, values[:, column], k=5, s=len(u) * noise**2)
            for order in range(highest + 1):
                out[order, :, column] = splev((at - u[0]) / scale, made, der=order) / scale**order
        return out


@dataclass(frozen=True)
class InterpolatingSpline:
    """The spline through the samples, for samples without noise; derivatives of order m err by h^(degree + 1 - m).

    Attributes:
        degree: odd; 7 gives third derivatives of fifth order in the step.
    """

    degree: int = 7

    def derivatives(self, u: Array, values: Array, at: Array, highest: int) -> Array:
        """See `Differentiation.derivatives`.

        Raises:
            InputError: too few samples for the degree.
        """
        made = self.through(u, values)
        return np.array([made(at, order) for order in range(highest + 1)])

    def through(self, u: Array, values: Array) -> BSpline:
        """The spline itself, of arrays (k, ...) along their first axis (`scipy.interpolate.BSpline`).

        Args:
            u: (k,) rising parameters.
            values: (k, ...) samples.

        Raises:
            InputError: too few samples for the degree.
        """
        from scipy.interpolate import make_interp_spline

        if len(u) <= self.degree:
            raise InputError(
                f"{len(u)} points are too few for a spline of degree {self.degree}; give at least {self.degree + 1}"
            )
        return make_interp_spline(u, values, k=self.degree)


def deviation_of(values: Array) -> float:
    """Root mean square of the noise in even samples (k, c), in their unit.

    It is read from sixth differences, which multiply noise by sqrt(924).
    """
    return float(np.sqrt(np.mean(np.diff(values, 6) ** 2) / 924.0)) if len(values) > 6 else 0.0
