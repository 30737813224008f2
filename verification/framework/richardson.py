"""Limits of sequences of meshes: observed rate, Richardson's value and an error bar."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Limit:
    """Where the values of a sequence of meshes go.

    Attributes:
        value: Richardson's extrapolation where the last three values converge at an observed rate of at least
            `SLOWEST`, else the last value.
        rate: observed order in the mesh size, nan where the values do not settle from one side.
        bar: what is left unknown: the distance from the last value to the extrapolated one; where there is no rate
        the last
            change, or a tenth of the one before if that is larger.
    """

    value: float
    rate: float
    bar: float


SLOWEST = 0.8  # rates below are no convergence to speak of


def limit(values: Sequence[float], ratio: float = 2.0) -> Limit:
    """Limit of the last three values on meshes that are `ratio` times finer each (Richardson 1911; Roache 1994)."""
    if len(values) < 3:
        change = abs(values[-1] - values[-2]) if len(values) == 2 else math.inf
        return Limit(values[-1], math.nan, change)
    first, second = values[-2] - values[-3], values[-1] - values[-2]
    if first * second > 0.0 and abs(second) < abs(first) * ratio**-SLOWEST:
        rate = math.log(first / second) / math.log(ratio)
        rest = second / (ratio**rate - 1.0)
        return Limit(values[-1] + rest, rate, abs(rest))
    return Limit(values[-1], math.nan, max(0.1 * abs(first), abs(second)))


LOWEST, HIGHEST = 0.5, 4.0  # orders that a fit may have
SAFETY = 1.25  # on what a clean sequence leaves (Roache 1994)
UNCLEAN = 3.0  # on the last change where no order can be read


def fitted(values: Sequence[float], sizes: Sequence[float]) -> Limit:
    """Limit of values on meshes of any sizes, coarse to fine, also where three of them show no clean order.

    Least squares of v0 + c h^p over the four finest meshes, finer ones with more weight (1 / h), with the order p from
    `LOWEST` to `HIGHEST` (Eca and Hoekstra 2014). The bar is `SAFETY` times the distance from the finest value to v0,
    plus the scatter about the fit, and not less than the last change. Where the best order lies at the end of that
    range, or the values scatter about the best fit, or it leads farther away than the four values lie apart,
    there is no order: then the value is the finest one and the bar is `UNCLEAN` times the last change, or the range of
    the last three if that is larger.

    Raises:
        ValueError: there are fewer than four values.
    """
    v, h = np.asarray(values, dtype=float)[-4:], np.asarray(sizes, dtype=float)[-4:]
    if len(v) < 4:
        raise ValueError("a fit needs the values of four meshes")
    weight = np.sqrt((1.0 / h) / (1.0 / h).sum())
    best = (math.inf, math.nan, float(v[-1]))
    orders = np.linspace(LOWEST, HIGHEST, 141)
    for p in orders:
        columns = np.column_stack((np.ones(len(h)), (h / h[0]) ** p)) * weight[:, None]
        found = np.linalg.lstsq(columns, v * weight, rcond=None)[0]
        scatter = float(np.linalg.norm(columns @ found - v * weight))
        if scatter < best[0]:
            best = (scatter, float(p), float(found[0]))
    scatter, p, value = best
    rest = abs(value - float(v[-1]))
    spread, change = float(np.ptp(v)), abs(float(v[-1] - v[-2]))
    if orders[0] < p < orders[-1] and scatter <= 0.1 * spread and rest <= spread:
        return Limit(value, p, max(SAFETY * rest + scatter, change))
    return Limit(float(v[-1]), math.nan, max(float(np.ptp(v[-3:])), UNCLEAN * change))
