"""Plane curves, parametrised by u in [0, 1], that creases and edges lie on. Lengths in mm, angles in rad."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Curve(Protocol):
    """A plane curve. `point(u)` maps (k,) parameters in [0, 1] to (k, 2) points, at constant speed."""

    @property
    def length(self) -> float: ...

    @property
    def closed(self) -> bool: ...

    def point(self, u: Array) -> Array: ...


@dataclass(frozen=True)
class Line:
    """The straight segment from `start` to `end`, each (x, y) in mm."""

    start: tuple[float, float]
    end: tuple[float, float]

    @property
    def length(self) -> float:
        return float(np.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]))

    @property
    def closed(self) -> bool:
        return False

    def point(self, u: Array) -> Array:
        u = np.asarray(u, dtype=float)[:, None]
        return (1.0 - u) * np.asarray(self.start) + u * np.asarray(self.end)


@dataclass(frozen=True)
class Arc:
    """A circular arc about `centre` from polar angle `start` through `sweep` (rad, counter-clockwise positive)."""

    centre: tuple[float, float]
    radius: float
    start: float
    sweep: float

    @property
    def length(self) -> float:
        return float(self.radius * abs(self.sweep))

    @property
    def closed(self) -> bool:
        return bool(abs(abs(self.sweep) - 2.0 * np.pi) < 1e-12)

    def point(self, u: Array) -> Array:
        angle = self.start + self.sweep * np.asarray(u, dtype=float)
        offset = self.radius * np.column_stack((np.cos(angle), np.sin(angle)))
        return np.asarray(self.centre) + offset


@dataclass(frozen=True, eq=False)
class Polyline:
    """Straight segments through `vertices` (k, 2) in mm, at constant speed; closed if the first vertex is the last."""

    vertices: Array

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=float)
        vertices.setflags(write=False)
        object.__setattr__(self, "vertices", vertices)

    @property
    def _arc_length(self) -> Array:
        steps = np.linalg.norm(np.diff(self.vertices, axis=0), axis=1)
        return np.concatenate(([0.0], np.cumsum(steps)))

    @property
    def length(self) -> float:
        return float(self._arc_length[-1])

    @property
    def closed(self) -> bool:
        return bool(len(self.vertices) > 2 and np.allclose(self.vertices[0], self.vertices[-1]))

    def point(self, u: Array) -> Array:
        s = self._arc_length
        at = np.asarray(u, dtype=float) * s[-1]
        return np.column_stack([np.interp(at, s, self.vertices[:, axis]) for axis in range(2)])


def sample(curve: Curve, tolerance: float = 1e-3) -> Array:
    """Points (k, 2) on `curve` whose chords stay within about `tolerance` (mm) of it."""
    if isinstance(curve, Polyline):
        return curve.vertices
    count = 1
    if isinstance(curve, Arc):
        # sagitta of a chord over angle a: radius (1 - cos(a / 2))
        reach = np.sqrt(8.0 * min(tolerance, curve.radius) / curve.radius)
        count = max(int(np.ceil(abs(curve.sweep) / reach)), 8 if curve.closed else 1)
    return curve.point(np.linspace(0.0, 1.0, count + 1))
