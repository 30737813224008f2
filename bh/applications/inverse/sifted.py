"""What candidates for a target were turned down for, and the nearest that can be had."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.applications.inverse.wants import LEVER, Wants

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Tried:
    """Polished candidates.

    Attributes:
        ends: (N, 3) where they end, mm.
        missed: (N,) distances, mm.
        turned: (N,) angles, rad.
        bars: (N,) error bars of the ends, mm.
        legal: (N,) whether they obey the rules.
        clear: (N,) whether they stay out of the boxes.
    """

    ends: Array
    missed: Array
    turned: Array
    bars: Array
    legal: Bools
    clear: Bools


@dataclass
class Sifted:
    """Why candidates were turned down, for the one line that says so.

    Attributes:
        nearest: of all that obey the rules and stay out of the boxes, mm.
        turned: angle of the nearest one, rad.
        end: where it ends, mm.
        illegal: distance of the nearest one that breaks a rule, mm.
        bar: least error bar of those that are as near as they should be, mm.
    """

    nearest: float = math.inf
    turned: float = 0.0
    end: tuple[float, ...] = ()
    illegal: float = math.inf
    bar: float = math.inf

    def add(self, tried: Tried, tolerance: float) -> None:
        """Take polished candidates into account.

        Args:
            tried: the candidates.
            tolerance: of distances, mm.
        """
        cost = tried.missed + LEVER * tried.turned
        mine = np.where(tried.legal & tried.clear, cost, math.inf)
        i = int(np.argmin(mine))
        if mine[i] < self.nearest + LEVER * self.turned:
            self.nearest, self.turned = float(tried.missed[i]), float(tried.turned[i])
            self.end = tuple(tried.ends[i].tolist())
        self.illegal = min(self.illegal, float(np.where(tried.legal, math.inf, cost).min()))
        near = np.isfinite(mine) & (tried.missed <= tolerance)
        self.bar = min(self.bar, float(np.where(near, tried.bars, math.inf).min()))

    def told(self, wants: Wants, most: int, tolerance: float, angle: float) -> str:
        """One line: what was not found, and the nearest that can be had.

        Args:
            wants: what was asked for.
            most: segments.
            tolerance: of distances, mm.
            angle: of the direction, rad.
        """
        count = "one segment" if most == 1 else f"up to {most} segments"
        what = f"no crease of {count} was found that ends within {tolerance:g} mm of {_at(wants.point)}"
        if wants.directed:
            what += f" and {math.degrees(angle):g} degrees of its direction"
        if len(wants.keep_out):
            what += " and stays out of the boxes"
        if not math.isfinite(self.nearest):
            if len(wants.keep_out):
                return f"{what}; no strip that was looked at stays out of them: make the boxes smaller"
            return f"{what}; all that were looked at cross themselves: take another number of segments"
        near = f"the nearest ends {_length(self.nearest)} mm away"
        if wants.directed:
            near += f", {math.degrees(self.turned):.2g} degrees off"
        near += f", at {_at(np.round(self.end, 1))}"
        if self.nearest <= tolerance and self.turned <= angle:
            if self.bar > tolerance:
                return f"{what}; some do by the model, with an error bar of {self.bar:.2g} mm: allow more than that"
            near += ", but not with its error bar, or its flat strip cannot be cut"
        elif self.illegal <= tolerance:
            near += "; nearer ones cross themselves"
        return f"{what}; {near}"


def _at(point: ArrayLike) -> str:
    x, y, z = np.asarray(point, dtype=float) + 0.0  # no -0
    return f"({x:g}, {y:g}, {z:g})"


def _length(value: float) -> str:
    return f"{value:,.0f}" if value >= 100.0 else f"{value:.3g}"
