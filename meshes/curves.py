"""Plane curves, parametrised by u in [0, 1], that creases and edges lie on. Lengths in mm, angles in rad."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Curve(Protocol):
    """A plane curve, mm; its points run at constant speed in the parameter (but see `ArcChain`)."""

    @property
    def length(self) -> float:
        """Length of the curve, mm."""

    @property
    def closed(self) -> bool:
        """True where the curve ends where it begins."""

    def point(self, u: Array) -> Array:
        """(k, 2) points, mm, at (k,) parameters in [0, 1]."""


@runtime_checkable
class Sampled(Protocol):
    """A curve that knows its own chords."""

    def sampled(self, tolerance: float) -> Array:
        """(k, 2) ends of chords that stay within `tolerance` (mm) of the curve."""


def arc_lengths(points: Array) -> Array:
    """(k,) lengths along a polyline (k, 2) or (k, 3) from its first point, in the unit of the points."""
    return np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))


def interpolated(at: Array, lengths: Array, values: Array) -> Array:
    """Values between samples, linear in the length.

    Args:
        at: (n,) lengths where they are wanted.
        lengths: (k,) rising lengths of the samples.
        values: (k, d) samples.

    Returns:
        (n, d).
    """
    return np.column_stack([np.interp(at, lengths, column) for column in values.T])


@dataclass(frozen=True)
class Line:
    """The straight segment from `start` to `end`, each (x, y) in mm."""

    start: tuple[float, float]
    end: tuple[float, float]

    @property
    def length(self) -> float:
        """Distance between its ends, mm."""
        return float(np.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]))

    @property
    def closed(self) -> bool:
        """False: a segment never closes."""
        return False

    def point(self, u: Array) -> Array:
        """(k, 2) points, mm, at (k,) parameters in [0, 1]."""
        u = np.asarray(u, dtype=float)[:, None]
        return (1.0 - u) * np.asarray(self.start, dtype=np.float64) + u * np.asarray(
            self.end, dtype=np.float64
        )


@dataclass(frozen=True)
class Arc:
    """A circular arc about `centre` from polar angle `start` through `sweep` (rad, counter-clockwise positive).

    Attributes:
        centre: (x, y), mm.
        radius: mm.
        start: polar angle of the first point, rad.
        sweep: angle that the arc turns through, rad, counter-clockwise positive.
    """

    centre: tuple[float, float]
    radius: float
    start: float
    sweep: float

    @property
    def length(self) -> float:
        """Length of the arc, mm."""
        return float(self.radius * abs(self.sweep))

    @property
    def closed(self) -> bool:
        """True for a whole turn."""
        return bool(abs(abs(self.sweep) - 2.0 * np.pi) < 1e-12)

    def point(self, u: Array) -> Array:
        """(k, 2) points, mm, at (k,) parameters in [0, 1]."""
        angle = self.start + self.sweep * np.asarray(u, dtype=float)
        offset = self.radius * np.column_stack((np.cos(angle), np.sin(angle)))
        return np.asarray(self.centre) + offset


@dataclass(frozen=True, eq=False)
class Polyline:
    """Straight segments through `vertices` (k, 2) in mm, at constant speed; closed if the first vertex is the last."""

    vertices: Array

    def __post_init__(self) -> None:
        """Keep a read-only copy of the vertices."""
        vertices = np.array(self.vertices, dtype=float)
        vertices.setflags(write=False)
        object.__setattr__(self, "vertices", vertices)

    @cached_property
    def _arc_length(self) -> Array:
        return arc_lengths(self.vertices)

    @property
    def length(self) -> float:
        """Sum of the lengths of the segments, mm."""
        return float(self._arc_length[-1])

    @property
    def closed(self) -> bool:
        """True if the first vertex is the last one."""
        return bool(len(self.vertices) > 2 and np.allclose(self.vertices[0], self.vertices[-1]))

    def point(self, u: Array) -> Array:
        """(k, 2) points, mm, at (k,) parameters in [0, 1], linear in the length."""
        s = self._arc_length
        at = np.asarray(u, dtype=float) * s[-1]
        return np.column_stack([np.interp(at, s, self.vertices[:, axis]) for axis in range(2)])


@dataclass(frozen=True)
class ArcChain:
    """Circular arcs and straight pieces that run smoothly into one another, or a curve parallel to such a chain.

    The speed is constant along the chain itself, so that parallel curves have the points of one normal at one u; that
    of a curve at an offset is constant on each piece.

    Attributes:
        start: (x, y) where the chain begins, mm.
        heading: polar angle of its tangent there, rad.
        curvatures: of the pieces, 1/mm, positive where the chain turns to the left.
        lengths: of the pieces, mm.
        offset: of the curve to the left of the chain, mm; less than any radius on that side.
    """

    start: tuple[float, float]
    heading: float
    curvatures: tuple[float, ...]
    lengths: tuple[float, ...]
    offset: float = 0.0

    @property
    def length(self) -> float:
        """Length of the curve at its offset, mm."""
        return float(
            sum(
                piece_length * (1.0 - k * self.offset)
                for k, piece_length in zip(self.curvatures, self.lengths, strict=True)
            )
        )

    @property
    def closed(self) -> bool:
        """False: a chain is taken as open."""
        return False

    @property
    def breaks(self) -> Array:
        """(n + 1,) parameters of the ends of the pieces."""
        s = np.concatenate(([0.0], np.cumsum(self.lengths)))
        return np.asarray(s / s[-1])

    def point(self, u: Array) -> Array:
        """(k, 2) points, mm, at (k,) parameters in [0, 1]."""
        s = np.atleast_1d(np.asarray(u, dtype=float)) * sum(self.lengths)
        knots = np.concatenate(([0.0], np.cumsum(self.lengths)))
        piece = np.clip(np.searchsorted(knots, s, side="right") - 1, 0, len(self.lengths) - 1)
        heading = self.heading + np.concatenate(
            ([0.0], np.cumsum(np.multiply(self.curvatures, self.lengths)))
        )
        knot = np.zeros((len(knots), 2))
        knot[0] = self.start
        for i, (k, piece_length) in enumerate(zip(self.curvatures, self.lengths, strict=True)):
            knot[i + 1] = knot[i] + _arc_step(heading[i], k, np.array([piece_length]))[0]
        out = np.empty((len(s), 2))
        for i, k in enumerate(self.curvatures):
            here = piece == i
            along = s[here] - knots[i]
            turned = heading[i] + k * along
            left = np.column_stack((-np.sin(turned), np.cos(turned)))
            out[here] = knot[i] + _arc_step(heading[i], k, along) + self.offset * left
        return out


def _arc_step(heading: float, k: float, s: Array) -> Array:
    """(n, 2) chords of an arc of curvature k after lengths s; sin x / x keeps straight ones exact."""
    half = 0.5 * k * s
    chord = s * np.sinc(half / np.pi)
    return np.column_stack((chord * np.cos(heading + half), chord * np.sin(heading + half)))


def sample(curve: Curve, tolerance: float = 1e-3) -> Array:
    """Points (k, 2) on `curve` whose chords stay within about `tolerance` (mm) of it.

    Args:
        curve: of any kind.
        tolerance: mm; a `Polyline` gives its own vertices whatever it is.
    """
    if isinstance(curve, Polyline):
        return curve.vertices
    if isinstance(curve, ArcChain):
        return curve.point(_chain_samples(curve, tolerance))
    if isinstance(curve, Sampled):
        return curve.sampled(tolerance)
    count = 1
    if isinstance(curve, Arc):
        # sagitta of a chord over angle a: radius (1 - cos(a / 2))
        reach = np.sqrt(8.0 * min(tolerance, curve.radius) / curve.radius)
        count = max(int(np.ceil(abs(curve.sweep) / reach)), 8 if curve.closed else 1)
    return curve.point(np.linspace(0.0, 1.0, count + 1))


def _chain_samples(chain: ArcChain, tolerance: float) -> Array:
    """Parameters of the ends of the pieces, and as many between them as their arcs need."""
    u = [np.zeros(1)]
    for i, (k, piece_length) in enumerate(zip(chain.curvatures, chain.lengths, strict=True)):
        size = piece_length * abs(1.0 - k * chain.offset)
        bend = abs(k) / max(abs(1.0 - k * chain.offset), 1e-300)
        count = max(int(np.ceil(size * np.sqrt(bend / (8.0 * tolerance)))), 1)
        u.append(np.linspace(chain.breaks[i], chain.breaks[i + 1], count + 1)[1:])
    return np.concatenate(u)
