"""Limits of sequences of meshes: observed rate, Richardson's value and an error bar."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

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
    """Limit of the last three values on meshes that are `ratio` times finer each (Richardson 1911; Roache 1994).

    Args:
        values: coarse to fine.
        ratio: of the sizes of neighbouring meshes.
    """
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


def fitted(values: Sequence[float], sizes: Sequence[float], highest: float = HIGHEST) -> Limit:
    """Limit of values on meshes of any sizes, coarse to fine, also where three of them show no clean order.

    Least squares of v0 + c h^p over the four finest meshes, finer ones with more weight (1 / h), with the order p from
    `LOWEST` to `highest` (Eca and Hoekstra 2014). The bar is `SAFETY` times the distance from the finest value to v0,
    plus the scatter about the fit, and not less than the last change. Where the best order lies at the end of that
    range, or the values scatter about the best fit, or it leads farther away than the four values lie apart,
    there is no order: then the value is the finest one and the bar is `UNCLEAN` times the last change, or the range of
    the last three if that is larger.

    Args:
        values: of at least four meshes, coarse to fine.
        sizes: of their cells, falling.
        highest: order that the fit may have.

    Raises:
        ValueError: there are fewer than four values.
    """
    v, h = np.asarray(values, dtype=float)[-4:], np.asarray(sizes, dtype=float)[-4:]
    if len(v) < 4:
        raise ValueError("a fit needs the values of four meshes")
    weight = np.sqrt((1.0 / h) / (1.0 / h).sum())
    best = (math.inf, math.nan, float(v[-1]))
    orders = np.linspace(LOWEST, highest, round((highest - LOWEST) / 0.025) + 1)
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


class Verdict(StrEnum):
    """What can be said of values on finer and finer meshes."""

    CONVERGES = "converges"
    EXACT = "exact"  # alike to rounding: there is nothing to read an order from
    TURNS = "turns"  # values go up and down, or cross the known limit
    DRIFTS = "drifts"  # differences do not fall
    TOO_FAST = "too fast"  # an order above all that there are
    SCATTERS = "scatters"  # the finest four fit no order


@dataclass(frozen=True)
class Convergence:
    """Values on finer and finer meshes, and what they say.

    Attributes:
        sizes: of the cells, coarse to fine; only their ratios matter.
        values: one a mesh.
        verdict: what can be trusted.
        limit: value, order (nan where none can be trusted) and what is left unknown.
        orders: of every three meshes in a row, or of every two where the limit is known; nan where there is none.
        reason: why no order can be trusted, one line; empty where one can.
    """

    sizes: tuple[float, ...]
    values: tuple[float, ...]
    verdict: Verdict
    limit: Limit
    orders: tuple[float, ...]
    reason: str = ""


FASTEST = 4.6  # the shell's energies are of fourth order; what is seen above is no order
AGREE = 1.0  # by how much the order of the finest four may differ from that of the finest three
ROUNDING = 1e-9  # of the value: differences that are none


def judged(values: Sequence[float], sizes: Sequence[float], expected: float | None = None) -> Convergence:
    """What values on meshes of any sizes, coarse to fine, say of their limit and order.

    Of three meshes the order is the p that solves (v1 - v2) / (v2 - v3) = (h1^p - h2^p) / (h2^p - h3^p), and `SAFETY`
    times the distance to the limit is left unknown; of more it is that of `fitted` on the finest four, if
    the finest three show about the same. With a known limit the order is the least of all pairs.

    Args:
        values: of at least three meshes.
        sizes: of their cells, falling.
        expected: the limit, where it is known.

    Raises:
        ValueError: fewer than three values, or sizes that do not fall.
    """
    v, h = [float(x) for x in values], [float(x) for x in sizes]
    if len(v) < 3 or len(v) != len(h) or any(b >= a for a, b in pairwise(h)):
        raise ValueError("an order needs at least three values, on sizes that fall")
    if expected is not None:
        return _known(v, h, float(expected))
    scale = max(abs(x) for x in v)
    steps = [b - a for a, b in pairwise(v)]
    orders = tuple(_order(v[k : k + 3], h[k : k + 3]) for k in range(len(v) - 2))

    def found(verdict: Verdict, limit: Limit, reason: str = "") -> Convergence:
        return Convergence(tuple(h), tuple(v), verdict, limit, orders, reason)

    last, bar = v[-1], max(max(map(abs, steps[-2:])), float(np.ptp(v[-3:])), UNCLEAN * abs(steps[-1]))
    none = Limit(last, math.nan, bar)
    if max(map(abs, steps[-2:])) <= ROUNDING * scale:
        return found(Verdict.EXACT, Limit(last, math.nan, max(map(abs, steps[-2:]))))
    if any(a * b < 0.0 for a, b in pairwise(steps[-3:])):
        return found(Verdict.TURNS, none, "values turn, so no order can be trusted")
    p = orders[-1]
    if not p >= LOWEST:
        return found(Verdict.DRIFTS, none, "differences do not fall, so no order can be trusted")
    if p > FASTEST:
        why = f"the last three show {p:.1f}, an order that no formulation has: the coarsest is too coarse"
        return found(Verdict.TOO_FAST, none, f"{why}, so no order can be trusted")
    if len(v) == 3:
        rest = steps[-1] / ((h[-2] / h[-1]) ** p - 1.0)
        return found(Verdict.CONVERGES, Limit(last + rest, p, SAFETY * abs(rest)))
    fit = fitted(v, h, FASTEST)
    if not abs(fit.rate - p) <= AGREE:
        why = f"the finest four fit no order from {LOWEST:g} to {FASTEST:g} that the finest three show, too"
        fit = Limit(last, math.nan, max(bar, fit.bar))
        return found(Verdict.SCATTERS, fit, f"{why}, so no order can be trusted")
    return found(Verdict.CONVERGES, fit)


def _order(v: Sequence[float], h: Sequence[float]) -> float:
    """Order of three values; nan where they turn, 0 where their differences do not fall."""
    first, second = v[1] - v[0], v[2] - v[1]
    if first == 0.0 or second == 0.0 or first * second < 0.0:
        return math.nan

    def off(p: float) -> float:
        return math.log((h[0] ** p - h[1] ** p) / (h[1] ** p - h[2] ** p)) - math.log(first / second)

    low, high = 1e-3, 20.0
    if off(low) >= 0.0:
        return 0.0
    if off(high) <= 0.0:
        return math.inf
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if off(middle) < 0.0 else (low, middle)
    return 0.5 * (low + high)


def _known(v: list[float], h: list[float], expected: float) -> Convergence:
    """`judged` where the limit is known: the order is read from errors."""
    errors = [x - expected for x in v]
    scale = max(abs(expected), max(abs(x) for x in v))
    orders = tuple(
        math.log(a / b) / math.log(m / n) if a * b > 0.0 else math.nan
        for (a, b), (m, n) in zip(pairwise(errors), pairwise(h), strict=True)
    )
    verdict, rate, reason = Verdict.CONVERGES, min(orders), ""
    if max(map(abs, errors)) <= ROUNDING * scale:
        verdict, rate = Verdict.EXACT, math.nan
    elif any(a * b <= 0.0 for a, b in pairwise(errors)):
        verdict, rate = Verdict.TURNS, math.nan
        reason = "values cross the known limit, so no order can be trusted"
    return Convergence(tuple(h), tuple(v), verdict, Limit(v[-1], rate, abs(errors[-1])), orders, reason)
