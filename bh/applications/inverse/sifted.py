"""What candidates for a target were turned down for, and the nearest that can be had."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.applications.inverse.wants import LEVER, Wants

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass
class Sifted:
    """Why candidates were turned down, for the one line that says so.

    Attributes:
        nearest: of all that obey the rules and stay out of the boxes, mm.
        turned: angle of the nearest one, rad.
        illegal: distance of the nearest one that breaks a rule, mm.
    """

    nearest: float = math.inf
    turned: float = 0.0
    illegal: float = math.inf

    def add(self, missed: Array, turned: Array, legal: Bools, clear: Bools) -> None:
        """Take polished candidates into account.

        Args:
            missed: (N,) distances, mm.
            turned: (N,) angles, rad.
            legal: (N,) whether they obey the rules.
            clear: (N,) whether they stay out of the boxes.
        """
        cost = np.where(legal & clear, missed + LEVER * turned, math.inf)
        i = int(np.argmin(cost))
        if cost[i] < self.nearest + LEVER * self.turned:
            self.nearest, self.turned = float(missed[i]), float(turned[i])
        self.illegal = min(self.illegal, float(np.where(legal, math.inf, missed + LEVER * turned).min()))

    def told(self, wants: Wants, most: int, tolerance: float, angle: float) -> str:
        """One line: what was not found, and the nearest that can be had.

        Args:
            wants: what was asked for.
            most: segments.
            tolerance: of distances, mm.
            angle: of the direction, rad.
        """
        x, y, z = wants.point
        where = f"({x:g}, {y:g}, {z:g})"
        what = f"no crease of up to {most} segments was found that ends within {tolerance:g} mm of {where}"
        if wants.directed:
            what += f" and {math.degrees(angle):g} degrees of its direction"
        if len(wants.keep_out):
            what += " and stays out of the boxes"
            if not math.isfinite(self.nearest):
                return f"{what}; no strip that was looked at stays out of them: make the boxes smaller"
        near = f"the nearest ends {self.nearest:.3g} mm away"
        if wants.directed:
            near += f", {math.degrees(self.turned):.2g} degrees off"
        if self.nearest <= tolerance and self.turned <= angle:
            near += ", but not with its error bar, or its flat strip cannot be cut"
        elif self.illegal <= tolerance:
            near += "; nearer ones cross themselves"
        return f"{what}; {near}"
