"""Curves that drawing programs have: cubic Bezier curves, arcs of ellipses, and chains of pieces. mm, rad.

A drawing is read into them, sampled for its mesh, and written from them, so that a cutter gets what was drawn. The
chords of a piece depend on the piece and the tolerance alone: a line that is written and read again has
the same points.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from meshes.curves import Arc, ArcChain, Array, Curve, Line, Polyline, arc_lengths

MOST = 20_000  # chords of a piece
ROUND = 1e-9  # by how much the axes of a circle may differ, as a part of its radius
Pair = tuple[float, float]


@dataclass(frozen=True)
class Bezier:
    """A cubic Bezier curve.

    Attributes:
        points: its four control points (x, y), mm; the curve begins at the first and ends at the last.
    """

    points: tuple[Pair, Pair, Pair, Pair]

    @property
    def length(self) -> float:
        """Length of the curve, mm, from 2,000 chords (1e-7 of it)."""
        return float(arc_lengths(self.at(np.linspace(0.0, 1.0, 2001)))[-1])

    @property
    def closed(self) -> bool:
        """True where it ends where it begins."""
        return self.points[0] == self.points[3]

    def at(self, t: Array) -> Array:
        """(k, 2) points, mm, at (k,) parameters of the polynomial in [0, 1]."""
        t = np.asarray(t, dtype=float)[:, None]
        a, b, c, d = (np.asarray(p) for p in self.points)
        s = 1.0 - t
        return np.asarray(s**3 * a + 3.0 * s * s * t * b + 3.0 * s * t * t * c + t**3 * d)

    def point(self, u: Array) -> Array:
        """(k, 2) points, mm, at (k,) parts of the length in [0, 1]."""
        return _by_length(self.at, u)

    def chords(self, tolerance: float) -> int:
        """How many keep within the tolerance (mm): the error of one is max |c''| / (8 n^2)."""
        a, b, c, d = (np.asarray(p) for p in self.points)
        bend = 6.0 * max(float(np.linalg.norm(a - 2 * b + c)), float(np.linalg.norm(b - 2 * c + d)))
        return _chords(bend, tolerance)

    def placed(self, scale: float, origin: Sequence[float]) -> Bezier:
        """Where its points minus `origin` lie, `scale` times as large.

        Args:
            scale: a factor.
            origin: (x, y), mm.
        """
        a, b, c, d = ((np.asarray(p) - origin) * scale for p in self.points)
        return Bezier((_pair(a), _pair(b), _pair(c), _pair(d)))


@dataclass(frozen=True)
class EllipseArc:
    """The points centre + cos(t) u + sin(t) v, t from `start` through `sweep`; a circle where u and v say so.

    Attributes:
        centre: (x, y), mm.
        u: one half-axis, mm.
        v: the other; need not be perpendicular (a sheared circle).
        start: of the parameter, rad.
        sweep: of the parameter, rad, from u to v positive.
    """

    centre: Pair
    u: Pair
    v: Pair
    start: float
    sweep: float

    @property
    def length(self) -> float:
        """Length of the curve, mm, from 2,000 chords (1e-6 of it)."""
        return float(arc_lengths(self.at(np.linspace(0.0, 1.0, 2001)))[-1])

    @property
    def closed(self) -> bool:
        """True for a whole turn."""
        return abs(abs(self.sweep) - 2.0 * math.pi) < 1e-9

    def at(self, part: Array) -> Array:
        """(k, 2) points, mm, at (k,) parts of the sweep in [0, 1]."""
        t = self.start + self.sweep * np.asarray(part, dtype=float)[:, None]
        return np.asarray(np.asarray(self.centre) + np.cos(t) * self.u + np.sin(t) * self.v)

    def point(self, u: Array) -> Array:
        """(k, 2) points, mm, at (k,) parts of the length in [0, 1]."""
        return _by_length(self.at, u)

    def chords(self, tolerance: float) -> int:
        """How many keep within the tolerance (mm); eight or more for a whole turn."""
        bend = max(math.hypot(*self.u), math.hypot(*self.v)) * self.sweep**2
        return max(_chords(bend, tolerance), 8 if self.closed else 1)

    def placed(self, scale: float, origin: Sequence[float]) -> EllipseArc:
        """Where its points minus `origin` lie, `scale` times as large.

        Args:
            scale: a factor.
            origin: (x, y), mm.
        """
        return replace(
            self,
            centre=_pair((np.asarray(self.centre) - origin) * scale),
            u=_pair(np.multiply(self.u, scale)),
            v=_pair(np.multiply(self.v, scale)),
        )

    def circle(self) -> Arc | None:
        """The arc of a circle that it is, or None for an ellipse."""
        a, b = math.hypot(*self.u), math.hypot(*self.v)
        inner = self.u[0] * self.v[0] + self.u[1] * self.v[1]
        if abs(a - b) > ROUND * a or abs(inner) > ROUND * a * b:
            return None
        turn = 1.0 if self.u[0] * self.v[1] > self.u[1] * self.v[0] else -1.0
        start = math.atan2(self.u[1], self.u[0]) + turn * self.start
        return Arc(self.centre, a, start, turn * self.sweep)

    def axes(self) -> EllipseArc:
        """The same arc by its principal axes: u the longer one, v perpendicular to its left."""
        turned, sizes, _ = np.linalg.svd(np.column_stack((self.u, self.v)))
        turned = turned @ np.diag((1.0, np.sign(np.linalg.det(turned))))
        # (cos t, sin t) in the new axes; it may run backwards in them
        new = turned.T @ np.column_stack((self.u, self.v)) / sizes[:, None]
        x, y = new @ (math.cos(self.start), math.sin(self.start))
        turn = float(np.sign(np.linalg.det(new)))
        u, v = turned[:, 0] * sizes[0], turned[:, 1] * sizes[1]
        return EllipseArc(self.centre, _pair(u), _pair(v), math.atan2(y, x), turn * self.sweep)


Piece = Line | Arc | EllipseArc | Bezier


@dataclass(frozen=True)
class Chain:
    """Pieces that follow one another, each from the end of the one before.

    Attributes:
        pieces: in order; one or more.
    """

    pieces: tuple[Piece, ...]

    @property
    def length(self) -> float:
        """Sum of the lengths of the pieces, mm."""
        return float(sum(piece.length for piece in self.pieces))

    @property
    def closed(self) -> bool:
        """True where the last piece ends where the first one begins."""
        (x, y), (u, v) = _end(self.pieces[0], 0.0), _end(self.pieces[-1], 1.0)
        return max(abs(x - u), abs(y - v)) <= 1e-9 * self.length

    def point(self, u: Array) -> Array:
        """(k, 2) points, mm, at (k,) parts of the length in [0, 1]."""
        lengths = np.array([piece.length for piece in self.pieces])
        ends = np.concatenate(([0.0], np.cumsum(lengths)))
        at = np.asarray(u, dtype=float) * ends[-1]
        which = np.clip(np.searchsorted(ends, at, side="right") - 1, 0, len(lengths) - 1)
        out = np.empty((len(at), 2))
        for number, piece in enumerate(self.pieces):
            here = which == number
            out[here] = piece.point((at[here] - ends[number]) / lengths[number])
        return out

    def chords(self, tolerance: float) -> int:
        """Of all pieces together."""
        return sum(_piece_chords(piece, tolerance) for piece in self.pieces)

    @np.errstate(invalid="ignore", over="ignore")  # what is not finite is refused by who reads it
    def sampled(self, tolerance: float) -> Array:
        """(k, 2) ends of chords that stay within `tolerance` (mm) of the curve, the ends of its pieces among them."""
        if len(self.pieces) == 1 and isinstance(
            line := self.pieces[0], Line
        ):  # drawings have thousands of these
            return np.array([line.start, line.end], dtype=np.float64)
        points = [self.pieces[0].point(np.zeros(1))]
        for piece in self.pieces:
            part = np.linspace(0.0, 1.0, _piece_chords(piece, tolerance) + 1)[1:]
            own = piece.at if isinstance(piece, Bezier | EllipseArc) else piece.point
            points.append(own(part))
        if self.closed:  # to the last bit
            points[-1][-1] = points[0][0]
        return np.vstack(points)

    def placed(self, scale: float, origin: Sequence[float]) -> Chain:
        """Where its points minus `origin` lie, `scale` times as large.

        Args:
            scale: a factor.
            origin: (x, y), mm.
        """
        return Chain(tuple(_placed(piece, scale, origin) for piece in self.pieces))


def chain_of(curve: Curve) -> Chain:
    """The pieces of any curve of a pattern; a polyline is a chain of lines.

    Raises:
        TypeError: a curve of one's own, which has no pieces.
    """
    if isinstance(curve, Chain):
        return curve
    if isinstance(curve, Line | Arc | EllipseArc | Bezier):
        return Chain((curve,))
    if isinstance(curve, Polyline):
        return lines_through(curve.vertices)
    if isinstance(curve, ArcChain):
        return Chain(tuple(_pieces_of_arcs(curve)))
    raise TypeError(f"a {type(curve).__name__} has no pieces")


def lines_through(points: Array) -> Chain:
    """A chain of lines through points (k, 2), mm."""
    return Chain(tuple(Line(_pair(a), _pair(b)) for a, b in pairwise(points)))


def quadratic(a: Sequence[float], b: Sequence[float], c: Sequence[float]) -> Bezier:
    """The quadratic Bezier curve of three control points, which is a cubic one.

    Args:
        a: its beginning (x, y), mm.
        b: the control point between, mm.
        c: its end, mm.
    """
    one, two, three = np.asarray(a), np.asarray(b), np.asarray(c)
    return Bezier(
        (_pair(one), _pair((one + 2.0 * two) / 3.0), _pair((three + 2.0 * two) / 3.0), _pair(three))
    )


def backwards(piece: Piece) -> Piece:
    """The same piece from its end to its beginning."""
    if isinstance(piece, Line):
        return Line(piece.end, piece.start)
    if isinstance(piece, Bezier):
        a, b, c, d = piece.points
        return Bezier((d, c, b, a))
    return replace(piece, start=piece.start + piece.sweep, sweep=-piece.sweep)


def _pieces_of_arcs(curve: ArcChain) -> list[Piece]:
    """Each piece of a chain of arcs, or of its parallel, through its two ends with its own curvature."""
    found: list[Piece] = []
    heading = curve.heading
    ends = curve.point(curve.breaks)
    for k, length, a, b in zip(curve.curvatures, curve.lengths, ends[:-1], ends[1:], strict=True):
        turn = k * length
        if abs(turn) < 1e-12:
            found.append(Line(_pair(a), _pair(b)))
        else:
            left = np.array([-math.sin(heading), math.cos(heading)])
            radius = 1.0 / k - curve.offset  # signed: the centre lies to the left where it is positive
            centre = a + radius * left
            out = a - centre
            found.append(Arc(_pair(centre), abs(radius), math.atan2(out[1], out[0]), turn))
        heading += turn
    return found


def _end(piece: Piece, part: float) -> Pair:
    """A piece's beginning (0) or end (1)."""
    if isinstance(piece, Line):
        return piece.end if part else piece.start
    return _pair(piece.point(np.array([part]))[0])


def _piece_chords(piece: Piece, tolerance: float) -> int:
    if isinstance(piece, Line):
        return 1
    if isinstance(piece, Arc):
        return max(_chords(piece.radius * piece.sweep**2, tolerance), 8 if piece.closed else 1)
    return piece.chords(tolerance)


@np.errstate(invalid="ignore", over="ignore")  # what is not finite is refused later
def _chords(bend: float, tolerance: float) -> int:
    if not math.isfinite(bend):
        return 1
    return int(
        min(max(math.ceil(math.sqrt(bend / (8.0 * tolerance)) - 1e-9), 1 if bend < tolerance else 2), MOST)
    )


def _placed(piece: Piece, scale: float, origin: Sequence[float]) -> Piece:
    if isinstance(piece, Line):
        a, b = ((np.asarray(p) - origin) * scale for p in (piece.start, piece.end))
        return Line(_pair(a), _pair(b))
    if isinstance(piece, Arc):
        centre = _pair((np.asarray(piece.centre) - origin) * scale)
        return replace(piece, centre=centre, radius=scale * piece.radius)
    return piece.placed(scale, origin)


def _by_length(at: Callable[[Array], Array], u: Array) -> Array:
    points = at(np.linspace(0.0, 1.0, 2001))
    s = arc_lengths(points)
    part = np.interp(np.asarray(u, dtype=float) * s[-1], s, np.linspace(0.0, 1.0, 2001))
    return np.asarray(at(part))


def _pair(point: Sequence[float] | Array) -> Pair:
    return float(point[0]), float(point[1])
