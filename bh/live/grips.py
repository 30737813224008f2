"""What takes hold of a sheet: a spring that pulls a node, and jaws that close on two nodes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError

Array = NDArray[np.float64]
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Grip:
    """A node that is pulled by a spring.

    Attributes:
        to: (3,) the point that it is pulled to, mm.
        stiffness: of the spring, N/mm, positive.
    """

    to: Vector
    stiffness: float

    def __post_init__(self) -> None:
        """Refuse a spring that cannot be, before the sheet is asked to bear it.

        Raises:
            ModelError: its stiffness is not positive and finite.
        """
        if not 0.0 < self.stiffness < math.inf:
            raise ModelError(
                f"a stiffness of {self.stiffness} of a grip cannot be; give a positive number of N/mm"
            )

    def stiffened(self, stiffness: float, at: Array) -> Grip:
        """The same force by another spring.

        Args:
            stiffness: of that one, N/mm.
            at: (3,) where the node is, mm.
        """
        if stiffness == self.stiffness:
            return self
        x, y, z = (at + self.stiffness / stiffness * (np.array(self.to) - at)).tolist()
        return Grip((x, y, z), stiffness)


@dataclass(frozen=True)
class Jaws:
    """Two nodes that are squeezed, and the line along which their jaws move.

    Attributes:
        a, b: the nodes.
        middle: (3,) the point between the jaws, mm.
        along: (3,) unit vector from the jaw of `a` to that of `b`.
        stiffness: of the spring between each node and its jaw, N/mm.
    """

    a: int
    b: int
    middle: Vector
    along: Vector
    stiffness: float

    @classmethod
    def on(cls, points: Array, a: int, b: int, stiffness: float) -> Jaws:
        """Jaws that touch two nodes where they are.

        Args:
            points: (n, 3) positions, mm.
            a: a node.
            b: another one.
            stiffness: of their springs, N/mm.

        Raises:
            ModelError: a node is not there, or both lie at one point.
        """
        for node in (a, b):
            if not 0 <= node < len(points):
                raise ModelError(f"there is no node {node} to pinch; choose one of 0 to {len(points) - 1}")
        apart = points[b] - points[a]
        length = float(np.linalg.norm(apart))
        if length <= 1e-9 * float(np.ptp(points, axis=0).max()):
            raise ModelError(f"nodes {a} and {b} lie at one point; a pinch needs two that are apart")
        x, y, z = (0.5 * (points[a] + points[b])).tolist()
        u, v, w = (apart / length).tolist()
        return cls(a, b, (x, y, z), (u, v, w), stiffness)

    def grips(self, gap: float) -> dict[int, Grip]:
        """Where the jaws are when they are `gap` apart, mm.

        Returns:
            {node: grip} of both nodes.
        """
        found = {}
        for node, half in ((self.a, -0.5 * gap), (self.b, 0.5 * gap)):
            x, y, z = (np.array(self.middle) + half * np.array(self.along)).tolist()
            found[node] = Grip((x, y, z), self.stiffness)
        return found

    def gap(self, grips: Mapping[int, Grip]) -> float:
        """How far apart the jaws are, mm.

        Args:
            grips: of both nodes.
        """
        a, b = (np.array(grips[node].to) for node in (self.a, self.b))
        return float((b - a) @ np.array(self.along))

    def force(self, grips: Mapping[int, Grip], points: Array) -> float:
        """Force by which the jaws press the nodes together, N; negative where they pull them apart.

        On a sheet that is held elsewhere the two forces may differ; this is their mean along the line.

        Args:
            grips: that the state is in equilibrium with.
            points: (n, 3) of the state, mm.
        """
        on_a, on_b = (self.stiffness * (np.array(grips[n].to) - points[n]) for n in (self.a, self.b))
        return float(0.5 * (on_a - on_b) @ np.array(self.along))

    def on_line(self, points: Array) -> Jaws:
        """Halfway between the nodes, on the line that joins them.

        Args:
            points: (n, 3) of the state, mm.
        """
        return self.between(points[self.a], points[self.b])

    def between(self, one: Array, two: Array) -> Jaws:
        """Halfway between two points, on the line that joins them; as they are where these are one.

        Args:
            one: (3,) where the first node is, mm.
            two: (3,) where the second one is, mm.
        """
        apart = two - one
        if not apart.any():
            return self
        x, y, z = (0.5 * (one + two)).tolist()
        u, v, w = (apart / np.linalg.norm(apart)).tolist()
        return replace(self, middle=(x, y, z), along=(u, v, w))
